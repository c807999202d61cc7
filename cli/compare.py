"""``sssfit compare``: why a kernel's picture is not the true one, and every kernel by its cost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import click

from sssfit.methods import FITS
from sssfit.scene.made import COMPARED

from ._compare_parts import budget_and_kernels, fronts, profile_of
from ._input import load_source
from ._options import Common, common_options, options, own_settings, refuse
from ._output import finish_one, held_charts, target, write_chart
from ._picture import check_pictures
from ._verb_options import COMPARE

_OF_BUDGETS = ("budget_chart", "photons", "rank", "terms", "model")


@click.command()
@click.argument("material", required=False)
@options(*COMPARE)
@common_options
@click.pass_context
def compare(context: click.Context, /, material: str | None, common: Common, **given: Any) -> None:
    """Compare all kernels of MATERIAL by error and cost, and split an error by cause.

    The error budget comes first: simulation noise, energy beyond the grid, separability and
    storage, each alone compared with the exact profile's 2D kernel, the largest first. Then come
    every method, rank and number of Gaussians on the pictures' pixels, with error and cost. A star
    marks the Pareto front: no other kernel is better in both. Seconds are measured on this machine.

    MATERIAL is a name (`sssfit materials` lists them), a path to your own TOML, or a .profile.npz
    file, - for one on stdin; a budget needs a half space with g = 0.

    \b
      sssfit compare skin1
      sssfit compare skin1 --chart skin1-pareto.png --table skin1.csv
      sssfit compare skin1 --what budget --method gaussians --budget-chart budget.png
      sssfit compare skin1 --what front --cost passes
      sssfit compare skin1 --picture head --size 1024x1024 --mm-per-pixel 0.15 --cost seconds
      sssfit compare slab.profile.npz --picture mine.exr --error l2
      sssfit compare --all -o charts
      sssfit compare skin1 --what sheet --chart skin1-sheet.png
    """
    names = [name for each in given["pictures"] or COMPARED for name in each.split(",")]
    _check(material, given, names)
    if material is None:
        from sssfit.material import material_names

        folder = Path(given["output"] or ".")
        stems = {name: folder / f"{name}-pareto" for name in material_names(paper=given["paper"])}
        files = {each: (f"{stem}.png", f"{stem}.md") for each, stem in stems.items()}
        fronts(files, names, given, common)
    elif given["what"] == "front":
        fronts({material: (given["chart"], given["table"])}, names, given, common)
    elif given["what"] == "sheet":
        _sheet(material, given, common)
    else:
        settings = {key: given[key] for key in ("rank", "terms")}
        own = own_settings(context, FITS, given["method"], settings)
        budget_and_kernels(material, names, own, given, common)


def _check(material: str | None, given: Mapping[str, Any], names: Sequence[str]) -> None:
    """Refuse options that do not go together, or that would do nothing."""
    what, several = given["what"], material is None
    if [not several, given["every"], given["paper"]].count(True) != 1:
        raise click.UsageError("name one MATERIAL or profile, or give --all or --paper.")
    if several and what not in (None, "front"):
        raise click.UsageError("--all is for --what front; name one MATERIAL.")
    if several and (given["chart"] or given["table"]):
        raise click.UsageError("--all names its charts and tables; leave --chart and --table out.")
    if several and given["mm_per_pixel"] == "profile":
        raise click.UsageError("the pictures of --all share their pixels; give a length in mm.")
    if given["output"] is not None and not several:
        raise click.UsageError("-o is the folder of --all; name files by --chart and --table.")
    idle = list(_OF_BUDGETS) if several or what not in (None, "budget") else []
    idle += ["chart", "table"] if what == "budget" else []
    idle += ["pictures", "size", "layer", "mask", "table"] if what == "sheet" else []
    refuse(given, dict.fromkeys(idle, "another --what"))
    if what == "sheet" and not given["chart"]:
        raise click.UsageError("--what sheet is a picture; name its file with --chart.")
    if given["chart"] == given["budget_chart"] == "-":
        raise click.UsageError("only one of --chart and --budget-chart can go to stdout.")
    check_pictures(names, given["layer"], given["mask"], given["size"])


def _sheet(name: str, given: Mapping[str, Any], common: Common) -> None:
    """Draw a contact sheet of a profile's kernels, and print its figures."""
    from sssfit.chart import figure_of
    from sssfit.compare.sheet import compute_sheet
    from sssfit.compare.table import sheet_text

    path = target(given["chart"])
    with held_charts([path], inputs=[name], force=given["force"]):
        profile = profile_of(load_source(name), common)
        pitch = given["mm_per_pixel"]
        found = compute_sheet(profile, mm_per_pixel=pitch, threads=common.threads)
        write_chart(figure_of(found), path)
    told = found.to_dict()
    finish_one(common, "compare", path, told, sheet_text(told), "a PNG")
