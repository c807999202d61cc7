"""``sssfit motion``: adaptive sampling under light that changes from frame to frame."""

from __future__ import annotations

from typing import Any

import click

from sssfit.messages import counted, stated
from sssfit.methods import LIGHTS, RENDERERS, lines_of
from sssfit.scene.made import check_pictures

from ._input import load_source
from ._options import Common, common_options, options, refuse
from ._output import finish, held, target, write_chart
from ._progress import step_progress
from ._verb_options import MOTION

_OF_TABLES = {"table", "seeds", "chart", "force"}


@click.command(
    epilog="\b\nLights:\n" + lines_of(LIGHTS) + "\n\n\b\nRenderers:\n" + lines_of(RENDERERS)
)
@click.argument("material", required=False)
@options(*MOTION)
@common_options
def motion(material: str | None, common: Common, **given: Any) -> None:
    """Render MATERIAL under changing light by adaptive sampling.

    Every pixel takes the samples that its variance over the last frames asks for, 1 to 64. Light
    that flickers looks like noise and asks for many; control variates take it out of the variance.
    Fixed sampling, a separable kernel and a cascade then have as many fetches a pixel. Errors are
    those of each frame, against the true 2D kernel.

    MATERIAL is a name (`sssfit materials` lists them), a path to your own TOML, or a .profile.npz
    file, - for one on stdin.

    \b
      sssfit motion skin1 --light strobe --chart motion.png
      sssfit motion marble --irradiance edge --size 256x256 --length 50 --only variates,fixed
      sssfit motion skin1 --light gunshot --frames shots --format exr --of ahead
      sssfit motion --table --chart table.png
    """
    _check(material, given)
    from sssfit.chart.files import chart_format, is_chart_file
    from sssfit.motion import runner, table

    charts = [given["chart"]] if given["chart"] else []
    if given["chart"] not in (None, "-"):
        chart_format(given["chart"])
    hold = {"inputs": [material, given["irradiance"]], "force": given["force"]}
    outputs = [target(each) for each in charts]
    with held(outputs, is_chart_file, **hold), step_progress("frames") as step:
        if material is None:
            found: Any = table.measure_table(seeds=given["seeds"] or 200, seed=common.seed)
            frames: list[str] = []
        else:
            own: dict[str, Any] = {"seed": common.seed, "threads": common.threads, "progress": step}
            own |= {k: v for k, v in given.items() if k not in _OF_TABLES and v is not None}
            found, frames = runner.run_sequence(load_source(material), **own, force=given["force"])
        for each in outputs:
            write_chart(found, each)
    wrote = [f"{counted(len(frames), 'frame')} to {given['frames']}"] if frames else []
    words = [found.text(), *map(stated, [*wrote, *charts])]
    finish(common, {"output": [*frames, *charts], **found.to_dict()}, "\n".join(words))


def _check(material: str | None, given: dict[str, Any]) -> None:
    """Refuse options that do not go together, or that would do nothing."""
    if (material is None) != given["table"]:
        raise click.UsageError("name one MATERIAL, or give --table without one.")
    if given["table"]:
        refuse(given, dict.fromkeys({*given} - _OF_TABLES, "a sequence"))
        return
    of_frames = {} if given["frames"] else {"form": "--frames", "of": "--frames"}
    refuse(given, {"seeds": "--table", **of_frames})
    check_pictures([given["irradiance"]], layer=given["layer"], size=given["size"])
