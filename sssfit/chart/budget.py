"""An error budget as a figure: `budget_figure`.

``sssfit.compare.budget`` computes the records. Delta E of causes do not add up, so they are drawn
side by side; shares of the squared error do, so these are stacked.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from sssfit.chart.looks import BLUE, DASHED, GREEN, GREY, ORANGE, PURPLE, SKY, series
from sssfit.chart.page import Style, check_drawn, drawable, name_axes, new_page, tick
from sssfit.chart.text import count, shortened
from sssfit.kernel import Taps
from sssfit.messages import counted

if TYPE_CHECKING:
    from sssfit.compare.budget import Budget, Cause

_BAR_INCHES = 0.3  # height of a picture's stacked bar
_ROW_INCHES = 0.23  # height of a cause's line of markers
_LEAST = 1e-4  # Delta E, or relative L2 in percent: smaller ones are drawn at the edge
_WRITTEN_PERCENT = 6.0  # smallest share with room for its figure in the bar
# Okabe and Ito 2008, "Color Universal Design", with hatches that distinguish them in grey.
_FILLS = (
    (BLUE, ""),
    (ORANGE, "////"),
    (SKY, ".."),
    (PURPLE, "xx"),
    (GREEN, "\\\\\\\\"),
    ("#bbbbbb", ""),
)
_MOST_PICTURES = 5
_NOTES = (
    "Alone: one cause switched on against the exact profile's whole 2D kernel. Filled: mean over "
    "the picture; hollow: 99th percentile. In brackets: alternatives, not in the kernel's error.",
    "Shares: of the squared difference from the true picture, <cause, all> / <all, all>; they add "
    "up to 100 %, below 0 where a cause makes up for others. Means and percentiles do not add up.",
)


def budget_figure(budgets: Budget | Sequence[Budget]) -> Figure:
    """Draw the contribution of each cause to a kernel's error, on one picture or several.

    Parameters
    ----------
    budgets : Budget or sequence of Budget
        Budgets of one material and kernel; the first five are drawn.

    Returns
    -------
    matplotlib.figure.Figure
        8 inches wide: a stacked bar for each picture, shares [%] of the squared error; under it,
        for each cause alone, Delta E 2000 on a logarithmic axis, or relative L2 [%] if the channels
        have no colour.

    Raises
    ------
    ArgumentError
        ``budgets`` is another record, or there is none.
    """
    given = list(budgets) if isinstance(budgets, Sequence) else [budgets]
    check_drawn(given[0] if given else None, "Budget")
    shown, names = given[:_MOST_PICTURES], _names(given[0])
    bars, rows = _BAR_INCHES * len(shown), _ROW_INCHES * len(names)
    notes = [*_NOTES, *_left_out(given)]
    title, subtitle = _title(given[0]), _subtitle(given[0])
    with new_page(3.2 + bars + rows, title, subtitle, notes) as (figure, below):
        stacked, alone = below.subplots(2, height_ratios=(bars, rows))
        _draw_shares(stacked, shown)
        _draw_alone(alone, shown, names)
    return figure


def _title(budget: Budget) -> str:
    """Return the title with the material."""
    return f"{shortened(budget.material.name, 24)}: why the kernel's picture is not the true one"


def _subtitle(budget: Budget) -> str:
    """Return text about the kernel's profile and the pictures."""
    source = budget.model or f"{count(budget.photons)} photons, seed {budget.seed}"
    kernel, scene = budget.kernel, budget.scene
    made = (
        f"{kernel.structure} on pixels"
        if isinstance(kernel, Taps)
        else f"{counted(kernel.rank, 'term')} on {counted(kernel.pixels, 'pixel')}"
    )
    words = [
        f"{source}, grid to {budget.radius_mm:.3g} mm",
        f"{kernel.method}, {made} of {scene.mm_per_pixel:.4g} mm",
        f"pictures {scene.width} x {scene.height}",
    ]
    return " · ".join(words)


def _names(budget: Budget) -> list[tuple[str, str]]:
    """Return the causes from the top down with their labels, then the whole."""
    measured = list(budget.causes)
    inside = [(each.name, each.name) for each in measured if each.is_in_whole]
    others = [(each.name, f"({each.name})") for each in measured if not each.is_in_whole]
    together = [(each.name, each.name) for each in (budget.interaction, budget.whole)]
    return [*inside, *together, *others]


def _draw_shares(axes: Axes, budgets: Sequence[Budget]) -> None:
    """Stack signed shares: those below 0 to the left."""
    parts = [name for name, _ in _names(budgets[0]) if _is_part(budgets[0], name)]
    fills = dict(zip(parts, _FILLS, strict=False))
    fills[budgets[0].interaction.name] = _FILLS[-1]
    for row, budget in enumerate(budgets):
        ends = {1.0: 0.0, -1.0: 0.0}  # the stacked sums on either side of 0
        for name in parts:
            percent = 100.0 * budget.share(_cause(budget, name))
            if math.isnan(percent) or percent == 0.0:
                continue
            side = math.copysign(1.0, percent)
            colour, hatch = fills[name]
            style: Style = {"color": colour, "hatch": hatch, "edgecolor": "white", "linewidth": 0.6}
            axes.barh(row, percent, 0.72, left=ends[side], **style)
            if abs(percent) >= _WRITTEN_PERCENT:
                _write_share(axes, row, ends[side] + 0.5 * percent, percent)
            ends[side] += percent
    axes.set_ylim(len(budgets) - 0.5, -0.5)
    axes.set_yticks(range(len(budgets)), [drawable(shortened(b.scene.name, 24)) for b in budgets])
    axes.axvline(0.0, color=GREY, lw=0.6)
    axes.grid(visible=False, axis="y")
    tick(axes.xaxis)
    name_axes(axes, "", "share of the squared error (%)", "")
    swatches = [
        Patch(facecolor=fills[each][0], hatch=fills[each][1], edgecolor="white", label=each)
        for each in parts
    ]
    _legend(axes, "(a) shares by cause", swatches, 3)


def _write_share(axes: Axes, row: int, middle: float, percent: float) -> None:
    """Write a share's figure into its part of the bar, on white because of the hatches."""
    box: Style = {"facecolor": "white", "edgecolor": "none", "pad": 1.2, "alpha": 0.9}
    words = f"{percent:.0f} %"
    axes.text(middle, row, words, ha="center", va="center", fontsize=7.5, bbox=box)


def _draw_alone(axes: Axes, budgets: Sequence[Budget], names: Sequence[tuple[str, str]]) -> None:
    """Draw a line per cause with a marker for each picture; hollow is the 99th percentile."""
    is_seen = all(not math.isnan(b.whole.score.delta_e_2000_mean) for b in budgets)
    for k, budget in enumerate(budgets):
        for row, (name, _) in enumerate(names):
            values = _figures(_cause(budget, name), is_seen=is_seen)
            place = row + 0.7 * (k - 0.5 * (len(budgets) - 1)) / len(budgets)
            drawn = [max(each, _LEAST) for each in values]
            line: Style = {**series(k, 4.5), "lw": 0}
            axes.plot(drawn[:1], [place], clip_on=False, zorder=3, **line)
            axes.plot(drawn[1:], [place] * (len(drawn) - 1), mfc="white", clip_on=False, **line)
    axes.set_xscale("log")
    axes.set_xlim(left=_LEAST)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.set_yticks(range(len(names)), [text for _, text in names])
    axes.xaxis.set_major_formatter("{x:g}")
    if is_seen:
        axes.axvline(1.0, color=GREY, lw=0.8, ls=DASHED, zorder=1)
    unit = "ΔE 2000 (dashed: 1)" if is_seen else "relative L2 (%)"
    name_axes(axes, "", f"{unit}; smaller than {_LEAST:g} at the left edge", "")
    handles = [
        Line2D([], [], lw=0, label=label, **series(k, 4.5))
        for k, label in enumerate(drawable(shortened(b.scene.name, 24)) for b in budgets)
    ]
    _legend(axes, "(b) each cause alone", handles, len(handles))


def _legend(axes: Axes, title: str, handles: Sequence[Patch | Line2D], columns: int) -> None:
    """Put a title and a legend over a panel."""
    axes.legend(
        handles=list(handles),
        ncols=columns,
        title=title,
        alignment="left",
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        borderaxespad=0.3,
        borderpad=0.0,
        columnspacing=1.5,
    )


def _figures(cause: Cause, *, is_seen: bool) -> list[float]:
    """Return mean and 99th percentile of Delta E, or relative L2 in percent."""
    if not is_seen:
        return [100.0 * cause.score.relative_l2]
    return [cause.score.delta_e_2000_mean, cause.score.delta_e_2000_p99]


def _cause(budget: Budget, name: str) -> Cause:
    """Return a cause, the interaction or the whole by its name."""
    every = (*budget.causes, budget.interaction, budget.whole)
    return next(each for each in every if each.name == name)


def _is_part(budget: Budget, name: str) -> bool:
    """Return whether a cause is stacked: part of the whole, and not the whole itself."""
    return name != budget.whole.name and _cause(budget, name).is_in_whole


def _left_out(budgets: Sequence[Budget]) -> list[str]:
    """Return a note on the number of pictures that are not drawn."""
    more = len(budgets) - _MOST_PICTURES
    return [f"Not drawn: {counted(more, 'more picture')}."] if more > 0 else []
