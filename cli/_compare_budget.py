"""The error budget of ``sssfit compare``: what each cause alone does to a picture."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ._compare_input import material_of
from ._compiling import say_if_compiling
from ._figure import chart_path, write_chart
from ._options import Common
from ._report import percent, table

if TYPE_CHECKING:
    from sssfit.compare.budget import Budget, Cause
    from sssfit.scene.record import Scene

_HEADS = ["", "Delta E mean", "p95", "p99", "relative L2", "largest drift", "of the whole"]
_SCORES = (
    *("delta_e_2000_mean", "delta_e_2000_p95", "delta_e_2000_p99", "share_above_1"),
    *("relative_l2", "energy_drift"),
)


@dataclass(frozen=True)
class BudgetRequest:
    """What was asked for; ``settings`` are keywords of the fit."""

    photons: int
    method: str
    settings: Mapping[str, Any]
    model: str | None
    chart: str | None


def compare_budget(
    material: str, scenes: Sequence[Scene], request: BudgetRequest, common: Common
) -> tuple[dict[str, Any], str]:
    """Make the budget of a material on each picture, draw it if asked to; figures and text.

    The chart's file is held by the caller.
    """
    budgets = _budgets(material, scenes, request, common)
    if request.chart is not None:
        _draw(budgets, request.chart)
    return _figures(budgets), "\n\n".join(_text(each) for each in budgets)


def _figures(budgets: Sequence[Budget]) -> dict[str, Any]:
    """Everything that is printed, as ``--json`` has it."""
    first = budgets[0]
    return {
        "material": first.material.name,
        "channels": first.material.channels,
        "method": first.kernel.method,
        "rank": first.kernel.rank,
        "model": first.model,
        "storage": first.storage,
        "photons": first.photons,
        "seed": first.seed,
        "mm_per_pixel": first.scene.mm_per_pixel,
        "radius_mm": first.radius_mm,
        "beyond_grid": first.beyond_grid,
        "rows": [row for each in budgets for row in _rows(each)],
    }


def _draw(budgets: Sequence[Budget], name: str) -> None:
    from sssfit.chart.budget import budget_figure

    write_chart(budget_figure(budgets), chart_path(name))


def _budgets(
    name: str, scenes: Sequence[Scene], request: BudgetRequest, common: Common
) -> list[Budget]:
    """Read the material and take the errors of its pictures apart."""
    from sssfit.compare.budget import error_budgets

    from ._progress import walk_progress

    material = material_of(name, "a budget")
    say_if_compiling(common, walk=material, solver=True)
    with walk_progress(material.name, quiet=common.quiet) as show:
        return error_budgets(
            material,
            scenes,
            photons=request.photons,
            seed=common.seed,
            method=request.method,
            settings=request.settings or None,
            model=request.model,
            threads=common.threads,
            progress=show,
        )


def _rows(budget: Budget) -> list[dict[str, Any]]:
    """Figures of every cause, of the whole and of the interaction; null for what is not made."""
    return [
        {
            "picture": budget.scene.name,
            "width": budget.scene.width,
            "height": budget.scene.height,
            "cause": each.name,
            "in_whole": each.is_in_whole,
            **{key: getattr(each.score, key, None) for key in _SCORES},
            "share_of_whole": budget.share(each),
            "hint": each.hint,
        }
        for each in (*budget.causes, budget.interaction, budget.whole)
    ]


def _text(budget: Budget) -> str:
    """Write the budget of a picture for people."""
    scene, kernel = budget.scene, budget.kernel
    simulated = f"{budget.photons:,} photons" if budget.model is None else str(budget.model)
    inside = [each for each in budget.causes if each.is_in_whole]
    others = [each for each in budget.causes if not each.is_in_whole]
    lines = [
        f"{budget.material.name} on {scene.name}, {scene.width} x {scene.height} pixels of "
        f"{scene.mm_per_pixel:.4g} mm: {simulated} to {budget.radius_mm:.4g} mm, {kernel.method}, "
        f"{kernel.rank} terms",
        table(
            _HEADS,
            [
                *(_line(budget, each) for each in inside),
                _line(budget, budget.interaction),
                _line(budget, budget.whole),
                *(_line(budget, each) for each in others),
            ],
        ),
        _advice(inside),
    ]
    return "\n".join(lines)


def _line(budget: Budget, cause: Cause) -> list[str]:
    """Figures of one cause; what is not in the whole has no share in it."""
    name = cause.name if cause.is_in_whole else f"({cause.name})"
    score = cause.score
    if score is None:
        return [name, cause.hint, "", "", "", "", ""]
    return [
        name,
        _number(score.delta_e_2000_mean, ".4f"),
        _number(score.delta_e_2000_p95, ".3f"),
        _number(score.delta_e_2000_p99, ".3f"),
        f"{100.0 * score.relative_l2:.4f} %",
        percent(max(score.energy_drift, key=abs), "+.3f"),
        percent(budget.share(cause), "+.1f") if cause.is_in_whole else "",
    ]


def _number(value: float, digits: str) -> str:
    """Write a figure; a dash for channels that have no colour."""
    return "-" if math.isnan(value) else f"{value:{digits}}"


def _advice(inside: Sequence[Cause]) -> str:
    """Say what to do about the two largest."""
    first, second = inside[:2]
    return f"First: {first.name} ({first.hint}). Then: {second.name} ({second.hint})."
