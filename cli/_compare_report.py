"""What ``sssfit compare`` found, for people: kernels, their fronts, a budget, a sheet."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from sssfit.messages import number, of_material, table

if TYPE_CHECKING:
    from sssfit.compare.budget import Budget, Cause
    from sssfit.compare.comparison import Comparison

_HEADS = ["", "Delta E mean", "p95", "p99", "relative L2", "largest drift", "of the whole"]


def kernels_text(comparison: Comparison, error: str, cost: str) -> str:
    """Write a table for each picture, sorted by cost and error, the front marked with a star."""
    from sssfit.compare import table as rows_as

    parts = [rows_as.setting_of(comparison)]
    for picture in comparison.pictures:
        rows = rows_as.sorted_rows(comparison, picture, error, cost)
        cells = [
            rows_as.cells_of(row, "* " if (error, cost) in row.fronts else "  ") for row in rows
        ]
        parts.append(
            f"{rows_as.picture_line(picture)}\n{table(['  kernel', *rows_as.HEADS[1:]], cells)}"
        )
    parts.append(f"* {rows_as.front_words(error, cost)}")
    parts += rows_as.left_out_lines(comparison)
    parts.append("\n".join(rows_as.verdict_lines(comparison, error, cost)))
    return "\n\n".join(parts)


def fronts_text(done: Sequence[Comparison], error: str, cost: str) -> str:
    """Write the kernels that no other beats, a line a material and picture."""
    cells = [
        [
            comparison.profile.material_name or "profile",
            picture.name,
            ", ".join(
                f"{row.label} {row.error(error):.2g}"
                for row in comparison.front(picture.name, error, cost)
            ),
        ]
        for comparison in done
        for picture in comparison.pictures
    ]
    return table(["material", "picture", f"front of {error} by {cost}, cheapest first"], cells)


def sheet_text(figures: dict[str, Any]) -> str:
    """Write mean Delta E for people."""
    rows = [
        [
            row["label"],
            str(row["passes"] or "-"),
            *(f"{each:.3g}" for each in row["delta_e_2000_mean"]),
        ]
        for row in figures["rows"]
    ]
    return (
        f"{of_material(figures['material'])}: mean Delta E 2000 on {figures['pixels']} x "
        f"{figures['pixels']} pixels of {figures['mm_per_pixel']:.4g} mm\n"
        f"{table(['kernel', 'passes', *figures['scenes']], rows)}"
    )


def budget_text(budget: Budget) -> str:
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
