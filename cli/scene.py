"""``sssfit scene``: heads in a row by diffusion in texture space, and what need not be computed."""

from __future__ import annotations

from typing import Any

import click

from ._input import load
from ._options import Common, common_options, options, refuse
from ._output import finish, held, target, write, write_chart
from ._progress import step_progress
from ._verb_options import SCENE

_OF_FRAMES = ("heads", "distance_units", "output")


@click.command()
@click.argument("kernel", required=False)
@options(*SCENE)
@common_options
def scene(kernel: str | None, common: Common, **given: Any) -> None:
    """Render heads in a row with diffusion in texture space, and count its work.

    Each head has an irradiance map of its own, on which the kernel's passes run. Three savings
    leave out what is not seen: texels that face away (culled), maps too fine for their distance
    (depth), and what lies outside of the picture (clipped). The picture is compared with that of
    all texels, and with diffusion in screen space. One unit is 100 mm.

    KERNEL is a .kernel.json or .taps.json file, or - for stdin; by default the six Gaussians of
    skin1, each blurred from the one before.

    \b
      sssfit scene --heads 4 --distance 10 -o heads.exr
      sssfit scene skin1.taps.json --heads 16 --distance 50 --savings depth,clipped
      sssfit scene --table --chart table.png
    """
    from sssfit.chart.files import chart_format, is_chart_file
    from sssfit.crowd import runner
    from sssfit.formats.pictures import image_format, is_image_file
    from sssfit.kernel import read_kernel

    refuse(given, {"output": "a frame"} if given["table"] else {"chart": "--table"})
    if given["chart"] not in (None, "-"):
        chart_format(given["chart"])
    if given["output"]:
        image_format(target(given["output"]))
    loaded = load(read_kernel, kernel) if kernel else runner.six_gaussians()
    wrote = [each for each in (given["chart"], given["output"]) if each]
    ours = lambda path: is_chart_file(path) or is_image_file(path)  # noqa: E731
    outputs = [target(each) for each in wrote]
    asked = {key: given[key] for key in runner.GEOMETRY} | {"threads": common.threads}
    hold = {"inputs": [kernel, given["mesh"]], "force": given["force"]}
    with held(outputs, ours, **hold), step_progress("frames") as step:
        if given["table"]:
            found: Any = runner.table_of(loaded, **asked, progress=step)
        else:
            found = runner.frame_of(loaded, **asked, **{key: given[key] for key in _OF_FRAMES[:2]})
        if given["chart"]:
            write_chart(found, target(given["chart"]))
        if given["output"]:
            write(found.image_bytes(given["output"]), target(given["output"]))
    words = [found.text(), *(f"Wrote {each}" for each in wrote)]
    finish(common, {"output": wrote, "kernel": kernel, **found.to_dict()}, "\n".join(words))
