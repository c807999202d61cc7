"""``sssfit stability``: where each method is safe, and where it breaks."""

from __future__ import annotations

from typing import Any

import click

from sssfit.methods import STRESSES, lines_of

from ._input import load_source
from ._options import Common, common_options, options
from ._output import finish, held, target, write, write_chart
from ._progress import step_progress
from ._verb_options import STABILITY


@click.command(epilog="\b\nStresses:\n" + lines_of(STRESSES))
@click.argument("material")
@options(*STABILITY)
@common_options
def stability(material: str, common: Common, **given: Any) -> None:
    """Stress every method on MATERIAL until it breaks, and say where it is safe.

    Cascades and published methods side by side, a stress at a time: each is made harder step by
    step, and a method is safe up to where its measure passes the limit. Places are given with their
    uncertainty, from the spread over seeds or from the steps.

    MATERIAL is a name (`sssfit materials` lists them), a path to your own TOML, or a .profile.npz
    file, - for one on stdin; stresses that walk photons need a profile that says its material.

    \b
      sssfit stability skin1 --chart skin1-stability.png
      sssfit stability marble --only noise,pixel-size --table marble.md
      sssfit stability skin1 --only gaussians --json
    """
    from sssfit.chart.files import chart_format, is_chart_file
    from sssfit.stability import is_stability_table
    from sssfit.stability import stability as stressed

    if given["chart"] not in (None, "-"):
        chart_format(given["chart"])
    outputs = [target(each) for each in (given["chart"], given["table"]) if each]
    ours = lambda path: is_chart_file(path) or is_stability_table(path)  # noqa: E731
    with (
        held(outputs, ours, inputs=[material], force=given["force"]),
        step_progress("stresses") as step,
    ):
        found = stressed(
            load_source(material),
            only=given["only"],
            mm_per_pixel=given["mm_per_pixel"],
            is_whole=given["is_whole"],
            seed=common.seed,
            threads=common.threads,
            progress=step,
        )
        if given["chart"]:
            write_chart(found, target(given["chart"]))
        if given["table"]:
            write(found.table().encode(), target(given["table"]))
    wrote = [each for each in (given["chart"], given["table"]) if each]
    words = [found.text(), *(f"Wrote {each}" for each in wrote)]
    finish(common, {"output": wrote, **found.to_dict()}, "\n".join(words))
