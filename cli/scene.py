"""``sssfit scene``: heads in a row by diffusion in texture space, and what need not be computed."""

from __future__ import annotations

from functools import partial
from typing import Any

import click

from ._input import load
from ._options import Common, common_options, options, refuse
from ._output import finish, held, target, write, write_chart
from ._progress import step_progress
from ._verb_options import SCENE

_OF_FRAMES = dict.fromkeys(("heads", "distance_units", "output", "bloom"), "a single frame")
_OF_FILES = ("bloom", "table", "chart", "output", "force")


@click.command(short_help="Render heads with diffusion in texture space.")
@click.argument("kernel", required=False)
@options(*SCENE)
@common_options
def scene(kernel: str | None, common: Common, **given: Any) -> None:
    """Render heads in a row with diffusion in texture space, and count the work.

    Each head has an irradiance map of its own, on which the kernel's passes run. Three savings
    leave out what is not seen: texels that face away (culled), maps too fine for their distance
    (depth), and what lies outside of the picture (clipped). The picture is compared with the one
    in which nothing is left out, and with diffusion in screen space; errors inside are those
    farther from outlines and from the border than the kernel reaches. One unit is 100 mm.

    KERNEL is a .kernel.json or .taps.json file, or - for stdin; by default the six Gaussians of
    skin1, each blurred from the one before.

    \b
      sssfit scene --heads 4 --distance 10 -o heads.exr
      sssfit scene skin1.cascade24.taps.json --heads 16 --distance 50 --savings depth,clipped
      sssfit scene --table --chart table.png
    """
    refuse(given, _OF_FRAMES if given["table"] else {"chart": "--table"})
    if given["bloom"] and not given["output"]:
        raise click.UsageError("--bloom is for the picture of -o; name its file.")
    from sssfit.chart.files import chart_format, is_chart_file
    from sssfit.crowd import runner
    from sssfit.formats.pictures import image_format, is_image_file
    from sssfit.kernel import read_kernel
    from sssfit.messages import stated

    if given["chart"] not in (None, "-"):
        chart_format(given["chart"])
    form = image_format(given["output"]) if given["output"] not in (None, "-") else "exr"
    wrote = [each for each in (given["chart"], given["output"]) if each]
    hold = {"inputs": [kernel, given["mesh"]], "force": given["force"]}
    ours = is_chart_file if given["table"] else is_image_file
    own = {key: each for key, each in given.items() if key not in _OF_FILES and each is not None}
    with held([target(each) for each in wrote], ours, **hold), step_progress("frames") as step:
        loaded = load(read_kernel, kernel) if kernel else runner.six_gaussians()
        if given["table"]:
            found: Any = runner.table_of(loaded, **own, threads=common.threads, progress=step)
        else:
            found = runner.frame_of(loaded, **own, threads=common.threads)
        if given["chart"]:
            write_chart(found, target(given["chart"]))
        if given["output"]:
            save = partial(found.save, format=form, bloom=given["bloom"] or 0.0)
            write(save, target(given["output"]))
    text = "\n".join([found.text(), *map(stated, wrote)])
    finish(common, {"output": wrote, "kernel": kernel, **found.to_dict()}, text)
