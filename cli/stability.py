"""``sssfit stability``: where each method is safe, and where it breaks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from sssfit.messages import stated
from sssfit.methods import STRESSES, lines_of

from ._input import load_source
from ._options import Common, common_options, options, refuse
from ._output import finish, held, target, write, write_chart
from ._progress import step_progress
from ._verb_options import STABILITY


@click.command(epilog="\b\nStresses:\n" + lines_of(STRESSES))
@click.argument("material", required=False)
@options(*STABILITY)
@common_options
def stability(material: str | None, common: Common, **given: Any) -> None:
    """Find where each fit of MATERIAL is safe, and where it breaks.

    Cascades and published methods are compared under one stress at a time, which grows step by
    step. A method is safe until its measure exceeds the limit, or has a range if places differ.

    MATERIAL is a name (`sssfit materials` lists them), a path to your own TOML, or a .profile.npz
    file, - for one on stdin; stresses that walk photons need a profile that says its material.

    \b
      sssfit stability skin1 --chart skin1-stability.png
      sssfit stability marble --only noise,pixel-size --table marble.md
      sssfit stability skin1 --only gaussians --json
      sssfit stability --paper -o docs
    """
    if bool(material) == given["paper"]:
        raise click.UsageError("name one MATERIAL, or give --paper without one.")
    single = dict.fromkeys(("chart", "table"), "one MATERIAL")
    refuse(given, {"output": "--paper"} if material else single)
    from sssfit.chart.files import chart_format, is_chart_file
    from sssfit.material import material_names
    from sssfit.stability import is_stability_table
    from sssfit.stability import stability as stressed
    from sssfit.stability.page import chart_name, page

    if given["chart"] not in (None, "-"):
        chart_format(given["chart"])
    folder = Path(given["output"] or ".")
    names = [material] if material else list(material_names(paper=True))
    charts = [given["chart"]] if material else [str(folder / chart_name(each)) for each in names]
    table = given["table"] if material else str(folder / "stability.md")
    wrote = [each for each in (*charts, table) if each]
    ours = lambda path: is_chart_file(path) or is_stability_table(path)  # noqa: E731
    asked = {key: given[key] for key in ("only", "mm_per_pixel", "is_whole")}
    asked |= {"seed": common.seed, "threads": common.threads}
    hold, found = {"inputs": [material], "force": given["force"]}, list[Any]()
    outputs = [target(each) for each in wrote]
    with held(outputs, ours, **hold), step_progress("stresses") as step:
        for name, chart in zip(names, charts, strict=True):
            found.append(stressed(load_source(name), **asked, progress=step))
            if chart:
                write_chart(found[-1], target(chart))
            if table:  # the page again after each material: eleven take hours
                words = found[0].table() if material else page(found)
                write(words.encode(), target(table))
    figures = found[0].to_dict() if material else {"materials": [each.to_dict() for each in found]}
    text = [found[0].text()] * bool(material)
    finish(common, {"output": wrote, **figures}, "\n".join([*text, *map(stated, wrote)]))
