"""The error budget of ``sssfit compare``: what each cause alone does to a picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ._compare_input import material_of
from ._options import Common
from ._output import number, table, target, write_chart
from ._progress import say_if_compiling

if TYPE_CHECKING:
    from sssfit.compare.budget import Budget, Cause
    from sssfit.scene.record import Scene

_HEADS = ["", "Delta E mean", "p95", "p99", "relative L2", "largest drift", "of the whole"]


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
    each = [budget.to_dict() for budget in budgets]
    figures = {**each[0], "rows": [row for one in each for row in one["rows"]]}
    return figures, "\n\n".join(_text(each) for each in budgets)


def _draw(budgets: Sequence[Budget], name: str) -> None:
    from sssfit.chart.budget import budget_figure

    write_chart(budget_figure(budgets), target(name))


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
        number(score.delta_e_2000_mean, ".4f"),
        number(score.delta_e_2000_p95, ".3f"),
        number(score.delta_e_2000_p99, ".3f"),
        f"{100.0 * score.relative_l2:.4f} %",
        number(max(score.energy_drift, key=abs), "+.3f%"),
        number(budget.share(cause), "+.1f%|nan %") if cause.is_in_whole else "",
    ]


def _advice(inside: Sequence[Cause]) -> str:
    """Say what to do about the two largest."""
    first, second = inside[:2]
    return f"First: {first.name} ({first.hint}). Then: {second.name} ({second.hint})."
