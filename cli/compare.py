"""``sssfit compare``: why a kernel's picture is not the true one, and every kernel by its cost."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from sssfit.methods import FITS

from ._compare_input import profile_of
from ._compare_options import compare_options
from ._compare_parts import (
    budget,
    compared,
    first_read,
    fronts,
    held_outputs,
    kernels,
    scenes_asked,
    sheet,
    write_kernels,
)
from ._methods import own_settings
from ._options import Common, common_options
from ._output import finish

_OF_BUDGETS = ("budget_chart", "photons", "rank", "terms", "model")


@click.command()
@click.argument("material", required=False)
@compare_options
@common_options
@click.pass_context
def compare(context: click.Context, /, material: str | None, common: Common, **given: Any) -> None:
    """Say why a kernel of MATERIAL loses what it loses, and what every other would.

    First the error budget: noise of the simulation, energy beyond the grid, separability, storage,
    each switched on alone against the exact profile's whole 2D kernel, the largest first. Then
    every method, rank and number of Gaussians on the pictures' pixels, with error and cost; a star
    marks the Pareto front: no other kernel is better in both. Seconds are of this machine.

    MATERIAL is a name (`sssfit materials` lists them), a path to your own TOML, or a .profile.npz
    file, - for one on stdin; a budget takes a half space with g = 0.

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
    _check(material, given)
    if material is None:
        from sssfit.material import material_names

        folder = Path(given["output"] or ".")
        stems = {name: folder / f"{name}-pareto" for name in material_names(paper=given["paper"])}
        fronts({name: (f"{each}.png", f"{each}.md") for name, each in stems.items()}, given, common)
    elif given["what"] == "front":
        fronts({material: (given["chart"], given["table"])}, given, common)
    elif given["what"] == "sheet":
        sheet(material, given, common)
    else:
        settings = {key: given[key] for key in ("rank", "terms")}
        own = own_settings(context, FITS, given["method"], settings)
        _budget_and_kernels(material, given, own, common)


def _budget_and_kernels(
    material: str, given: Mapping[str, Any], settings: Mapping[str, Any], common: Common
) -> None:
    """Do both parts, or the one that was asked for, and print them."""
    figures: dict[str, Any] = {"rows": []}
    of_budget, texts = None, []
    charts = [given[key] for key in ("chart", "budget_chart") if given[key]]
    tables = [given["table"]] if given["table"] else []
    with held_outputs(charts, tables, given, inputs=[material]):
        first = first_read(material, given, common)
        scenes = scenes_asked(given, common, first)
        if given["what"] != "budget":
            profile = first or profile_of(material, common)
            comparison = compared(profile, scenes, given, common)
            write_kernels(comparison, given, given["chart"], given["table"])
            figures, text = kernels(comparison, given)
            texts.append(text)
        if given["what"] != "kernels":
            found = budget(material, scenes[0], given, settings, common)
            if found is not None:
                of_budget = found[0]
                texts.insert(0, found[1])
    output = [given[key] for key in ("budget_chart", "chart", "table") if given[key]]
    texts += [f"Wrote {', '.join(output)}"] if output else []
    whole = {"command": "compare", "output": output, **figures, "budget": of_budget}
    finish(common, whole, "\n\n".join(texts), to_stderr="-" in output)


def _check(material: str | None, given: Mapping[str, Any]) -> None:
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
    for key in idle:
        if given[key]:
            raise click.UsageError(f"{_option(key)} is for another --what; leave it out.")
    if what == "sheet" and not given["chart"]:
        raise click.UsageError("--what sheet is a picture; name its file with --chart.")
    if given["chart"] == given["budget_chart"] == "-":
        raise click.UsageError("only one of --chart and --budget-chart can go to stdout.")


def _option(key: str) -> str:
    """Return an option as it is typed."""
    return "--" + {"pictures": "picture"}.get(key, key).replace("_", "-")
