"""Sheets of ``sssfit compare``: pictures of every kernel and of edits, a simulation's error."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ._compare_input import material_of
from ._options import Common
from ._output import finish, table, target, write_chart
from ._progress import say_if_compiling

if TYPE_CHECKING:
    from sssfit.fit import Pitch
    from sssfit.profile import Profile

MOST_PHOTONS = 10**7
_LEAST_PHOTONS = 10_000
_PER_DECADE = 2


def chart_sheet(profile: Profile, output: str, mm_per_pixel: Pitch | None, common: Common) -> None:
    """Draw a contact sheet of a profile's kernels; ``-`` is PNG on stdout."""
    from sssfit.compare.sheet import compute_sheet

    sheet = compute_sheet(profile, mm_per_pixel=mm_per_pixel, threads=common.threads)

    from sssfit.chart.sheet import sheet_figure

    path = target(output)
    write_chart(sheet_figure(sheet), path)
    _finish(path, sheet.to_dict(), _sheet_text, common)


def chart_editing(output: str, common: Common) -> None:
    """Draw the 2012 model edited by hand; ``-`` is PNG on stdout."""
    from sssfit.compare.editing import compute_editing

    editing = compute_editing(threads=common.threads)

    from sssfit.chart.editing import editing_figure

    path = target(output)
    write_chart(editing_figure(editing), path)
    _finish(path, editing.to_dict(), _editing_text, common)


def chart_convergence(name: str, output: str, photons: int | None, common: Common) -> None:
    """Draw a simulation's error against its price; ``-`` is PNG on stdout.

    ``photons`` is the largest number walked.
    """
    from sssfit.errors import SimulationError

    numbers = photon_numbers(photons or MOST_PHOTONS)
    material = material_of(name, "a convergence")
    if not material.is_semi_infinite:
        raise SimulationError(
            f"{material.name} is not one half space: walks are held against the exact solution, "
            "and only half spaces have one; name another material."
        )
    from sssfit.compare.convergence import compute_convergence

    say_if_compiling(common, walk=material, solver=True)
    found = compute_convergence(
        material, photons=numbers, first_seed=common.seed, threads=common.threads
    )

    from sssfit.chart.convergence import convergence_figure

    path = target(output)
    write_chart(convergence_figure(found), path)
    _finish(path, found.to_dict(), _convergence_text, common)


def photon_numbers(most: int) -> tuple[int, ...]:
    """Return two numbers of photons a decade, from 1e4 up to ``most``."""
    if most < 10 * _LEAST_PHOTONS:
        raise click.UsageError(f"{most:,} photons are too few for a slope; expected 1e5 or more.")
    numbers: list[int] = []
    while (number := round(_LEAST_PHOTONS * 10 ** (len(numbers) / _PER_DECADE))) <= most:
        numbers.append(number)
    return tuple(numbers)


def _finish(
    path: Path | None,
    figures: dict[str, Any],
    text: Callable[[dict[str, Any]], str],
    common: Common,
) -> None:
    """Print the figures, and say where the chart went."""
    figures = {"command": "compare", "output": [str(path or "-")], **figures}
    words = f"{text(figures)}\nWrote {path or 'a PNG to stdout'}"
    finish(common, figures, words, to_stderr=path is None)


def _sheet_text(figures: dict[str, Any]) -> str:
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
        f"{figures['material']}: mean Delta E 2000 on {figures['pixels']} x {figures['pixels']} "
        f"pixels of {figures['mm_per_pixel']:.4g} mm\n"
        f"{table(['kernel', 'passes', *figures['scenes']], rows)}"
    )


def _editing_text(figures: dict[str, Any]) -> str:
    """Write Delta E to the original for people."""
    rows = [
        [row["label"], f"{row['delta_e_2000_mean']:.3g}", f"{row['delta_e_2000_p99']:.3g}"]
        for row in figures["rows"]
    ]
    heads = ["edit", "mean Delta E to the original", "99th percentile"]
    return (
        f"{table(heads, rows)}\n"
        "The original against the 2D kernel of the six Gaussians: mean "
        f"{figures['original_delta_e_2000_mean']:.3g}, 99th percentile "
        f"{figures['original_delta_e_2000_p99']:.3g}"
    )


def _convergence_text(figures: dict[str, Any]) -> str:
    """Write the same for people, a line a run."""
    rows = [
        [f"{row['photons']:,} photons", f"{row['seconds']:.3f}", f"{row['error']:.2g}", "-"]
        for row in figures["rows"]
    ]
    rows += [
        [
            f"exact, tolerance {row['tolerance']:g}",
            f"{row['seconds']:.3f}",
            "-" if row["error"] is None else f"{row['error']:.2g}",
            f"{row['estimate']:.2g}",
        ]
        for row in figures["exact"]
    ]
    return (
        f"{figures['material']}: error of F(r) as a share of the total; slope "
        f"{figures['slope']:.3f} +- {figures['slope_stderr']:.3f}, theory -0.5\n"
        f"{table(['run', 'seconds', 'error', 'own estimate'], rows)}"
    )
