"""``sssfit stability``: where each method is safe, and where it breaks."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

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
      sssfit stability --paper -o docs
    """
    _check(material, given)
    from sssfit.chart.files import chart_format
    from sssfit.stability import stability as stressed

    asked = {key: given[key] for key in ("only", "mm_per_pixel", "is_whole")}
    asked |= {"seed": common.seed, "threads": common.threads}
    if material is None:
        finish(common, *_page(given, asked))
        return
    if given["chart"] not in (None, "-"):
        chart_format(given["chart"])
    wrote = [each for each in (given["chart"], given["table"]) if each]
    outputs = [target(each) for each in wrote]
    with (
        held(outputs, _is_ours, inputs=[material], force=given["force"]),
        step_progress("stresses") as step,
    ):
        found = stressed(load_source(material), **asked, progress=step)
        if given["chart"]:
            write_chart(found, target(given["chart"]))
        if given["table"]:
            write(found.table().encode(), target(given["table"]))
    words = [found.text(), *(f"Wrote {each}" for each in wrote)]
    finish(common, {"output": wrote, **found.to_dict()}, "\n".join(words))


def _page(given: Mapping[str, Any], asked: Mapping[str, Any]) -> tuple[dict[str, Any], str]:
    """Write charts and page of the paper's materials, the page again after each; tell of them."""
    from sssfit.material import load_material, material_names
    from sssfit.stability import stability as stressed
    from sssfit.stability.page import chart_name, page

    names, folder = material_names(paper=True), Path(given["output"] or ".")
    charts, found = [folder / chart_name(each) for each in names], list[Any]()
    outputs = [folder / "stability.md", *charts]
    with (
        held(outputs, _is_ours, inputs=[], force=given["force"]),
        step_progress("materials") as step,
    ):
        for k, (name, chart) in enumerate(zip(names, charts, strict=True)):
            if step is not None:
                step(k, len(names), name)
            found.append(stressed(load_material(name), **asked))
            write_chart(found[-1], chart)
            write(page(found).encode(), outputs[0])
    wrote = [str(each) for each in outputs]
    figures = {"output": wrote, "materials": [each.to_dict() for each in found]}
    return figures, "\n".join(f"Wrote {each}" for each in wrote)


def _is_ours(path: Path) -> bool:
    """Tell whether a file is a chart, a table or a page that we wrote."""
    from sssfit.chart.files import is_chart_file
    from sssfit.stability import is_stability_table

    return is_chart_file(path) or is_stability_table(path)


def _check(material: str | None, given: Mapping[str, Any]) -> None:
    """Refuse options that do not go together."""
    if (material is None) != given["paper"]:
        raise click.UsageError("name one MATERIAL, or give --paper without one.")
    idle = ("chart", "table") if given["paper"] else ()
    refuse(given, dict.fromkeys(idle, "one MATERIAL") | ({} if idle else {"output": "--paper"}))
