"""``sssfit compare``: why a kernel's picture is not the true one, and every kernel by its cost."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import click

from sssfit.methods import FITS

from ._compare_budget import BudgetRequest, compare_budget
from ._compare_options import PICTURES, compare_options
from ._compare_pareto import Outputs, Wish, compare_all, compare_one, held_outputs
from ._compare_sheet import chart_convergence, chart_editing, chart_sheet
from ._deon_skin import DEON_SKIN
from ._methods import own_settings
from ._options import Common, common_options
from ._output import finish, held_charts, say, target

_BUDGET = ("photons", "method", "rank", "terms", "model")
_SHEETS = ("sheet", "editing", "convergence")
_PHOTONS = 10**6


@click.command()
@click.argument("material", required=False)
@compare_options
@common_options
@click.pass_context
def compare(context: click.Context, /, material: str | None, common: Common, **given: Any) -> None:
    """Compare all kernels of MATERIAL by error and cost, and take an error apart by cause.

    The error budget comes first: noise of the simulation, energy beyond the grid, separability and
    storage, each alone against the exact profile's whole 2D kernel, largest first. Then come every
    method, rank and number of Gaussians on the pictures' pixels, with error and cost. A star marks
    the Pareto front: no other kernel is better in both. Seconds are those of this machine.

    MATERIAL is a name (`sssfit materials` lists them), a path to your own TOML, or a .profile.npz
    file, - for one on stdin; a budget takes a half space with g = 0.

    \b
      sssfit compare skin1
      sssfit compare skin1 --chart skin1-pareto.png --table skin1.csv
      sssfit compare skin1 --only budget --method gaussians --budget-chart budget.png
      sssfit compare skin1 --picture head --size 1024x1024 --mm-per-pixel 0.15 --cost seconds
      sssfit compare slab.profile.npz --picture mine.exr --error l2
      sssfit compare --all -o charts
      sssfit compare skin1 --sheet skin1-sheet.png
    """
    asked = {key: given[key] for key in _SHEETS if given[key]}
    if asked:
        _check_sheets(material, asked, given)
        _sheets(material, asked, given, common)
        return
    _check(material, given)
    names = [name for each in given["pictures"] or (PICTURES,) for name in each.split(",")]
    wish = Wish(
        names,
        given["size"],
        given["mm_per_pixel"],
        given["error"],
        given["cost"],
        given["force"],
        common,
        given["layer"],
        given["mask"],
    )
    if material is None:
        compare_all(Path(given["output"] or "."), wish)
        return
    if wish.mm_per_pixel == "profile":
        wish = _on_pixels_of_the_profile(material, wish)
    request = _request(context, given)
    kernels = budget = None
    charts = [given[key] for key in ("chart", "budget_chart") if given[key]]
    tables = [given["table"]] if given["table"] else []
    with held_outputs(charts, tables, wish, inputs=[material]):
        if given["only"] != "budget":
            kernels = compare_one(material, Outputs(given["chart"], given["table"]), wish)
        if given["only"] != "kernels":
            budget = _budget(material, request, wish, only=given["only"] == "budget")
    _report([budget, kernels], given, common)


def _on_pixels_of_the_profile(material: str, wish: Wish) -> Wish:
    """Read the profile first, for its pitch."""
    from sssfit.fit import pitch_of

    from ._compare_input import profile_of

    profile = profile_of(material, wish.common)
    return dataclasses.replace(wish, profile=profile, mm_per_pixel=pitch_of(profile, "profile"))


def _request(context: click.Context, given: Mapping[str, Any]) -> BudgetRequest:
    """Put together what the budget needs."""
    terms = {key: given[key] for key in ("rank", "terms")}
    return BudgetRequest(
        given["photons"] or _PHOTONS,
        given["method"],
        own_settings(context, FITS, given["method"], terms),
        given["model"],
        given["budget_chart"],
    )


def _budget(
    material: str, request: BudgetRequest, wish: Wish, *, only: bool
) -> tuple[dict[str, Any], str] | None:
    """Make the budget; say why there is none, unless it is all that was asked for."""
    from sssfit.errors import SimulationError

    if not only and (material.endswith(".npz") or material in ("-", DEON_SKIN)):
        say(wish.common, f"No budget: {material} is a profile, and a budget simulates a material.")
        return None
    try:
        return compare_budget(material, wish.scenes[0], request, wish.common)
    except SimulationError as error:
        if only:
            raise
        say(wish.common, f"No budget: {error}")
        return None


def _report(
    parts: Sequence[tuple[dict[str, Any], str] | None], given: Mapping[str, Any], common: Common
) -> None:
    """Print both parts and what was written."""
    budget, kernels = (None if part is None else part[0] for part in parts)
    output = [given[key] for key in ("budget_chart", "chart", "table") if given[key]]
    figures = {
        "command": "compare",
        "output": output,
        **(kernels or {"rows": []}),
        "budget": budget,
    }
    texts = [part[1] for part in parts if part is not None]
    if output:
        texts.append(f"Wrote {', '.join(output)}")
    finish(common, figures, "\n\n".join(texts), to_stderr="-" in output)


def _sheets(
    material: str | None, asked: Mapping[str, str], given: Mapping[str, Any], common: Common
) -> None:
    """Draw the sheets that were asked for."""
    paths = [target(each) for each in asked.values()]
    with held_charts(paths, inputs=[material], force=given["force"]):
        if "sheet" in asked:
            from ._compare_input import profile_of

            profile = profile_of(str(material), common)
            chart_sheet(profile, asked["sheet"], given["mm_per_pixel"], common)
        if "editing" in asked:
            chart_editing(asked["editing"], common)
        if "convergence" in asked:
            chart_convergence(str(material), asked["convergence"], given["photons"], common)


def _check_sheets(material: str | None, asked: Mapping[str, str], given: Mapping[str, Any]) -> None:
    """Refuse what does not go with a sheet."""
    if material is None and set(asked) != {"editing"}:
        raise click.UsageError("name one MATERIAL; only --editing needs none.")
    pictures = ("pictures", "size", "layer", "mask")
    for key in ("every", "only", *pictures, "chart", "table", "budget_chart", "output"):
        if given[key]:
            raise click.UsageError(
                f"{_option(key)} does not go with --{next(iter(asked))}; leave it out."
            )
    for key, owner in (("mm_per_pixel", "sheet"), ("photons", "convergence")):
        if given[key] is not None and owner not in asked:
            raise click.UsageError(f"{_option(key)} is for another chart; leave it out.")


def _check(material: str | None, given: Mapping[str, Any]) -> None:
    """Refuse options that do not go together, or that would do nothing."""
    if (material is None) != given["every"]:
        raise click.UsageError("name one MATERIAL or profile, or give --all.")
    if given["every"] and (given["chart"] or given["table"]):
        raise click.UsageError("--all names its charts and tables; leave --chart and --table out.")
    if given["every"] and given["mm_per_pixel"] == "profile":
        raise click.UsageError("the pictures of --all share their pixels; give a length in mm.")
    if given["output"] is not None and not given["every"]:
        raise click.UsageError("-o is the folder of --all; name files by --chart and --table.")
    without_budget = given["every"] or given["only"] == "kernels"
    idle = ["budget_chart", "photons", "rank", "terms", "model"] if without_budget else []
    idle += ["chart", "table"] if given["only"] == "budget" else []
    for key in idle:
        if given[key]:
            raise click.UsageError(f"{_option(key)} is for the other part; leave it out.")
    if given["chart"] == given["budget_chart"] == "-":
        raise click.UsageError("only one of --chart and --budget-chart can go to stdout.")


def _option(key: str) -> str:
    """Return an option as it is typed."""
    return "--" + {"every": "all", "pictures": "picture"}.get(key, key).replace("_", "-")
