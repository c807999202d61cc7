"""Where methods are safe, as a figure of small panels: `stability_figure`.

``sssfit.stability`` computes the record.
"""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from sssfit.arrays import FloatArray
from sssfit.chart.looks import RULE, variants
from sssfit.chart.page import (
    WIDTH_INCHES,
    Style,
    add_legend,
    check_drawn,
    name_axes,
    new_page,
    short_number,
    tick,
    tick_decades,
)
from sssfit.chart.text import symbols

if TYPE_CHECKING:
    from sssfit.stability import Curve, Panel, Stability

_COLUMNS, _PANEL_INCHES, _HEAD_INCHES = 2, 2.15, 1.35
# Of all stresses, 38 panels: five a row on a page of a large screen, where two made one of 42 in.
_MANY, _WIDE_COLUMNS, _WIDE_PANEL_INCHES, _WIDE_INCHES = 12, 5, 2.0, 16.0
_SAFE, _SMALL, _POINTS = "#e8f3ec", 6.5, 3.4
_HEADROOM = 0.25  # of the axis above the limit, at least
_BELOW = 0.05  # of the axis below 0, so that points at 0 are whole
_CROWDED = 3  # curves; above more stands their legend. Of as many labels it is the largest
_SHORT_DECADES = 1.3  # as `tick_decades` has it
_LEGEND_LINE = 0.135  # of the axis of a crowded panel


def stability_figure(stability: Stability) -> Figure:
    """Draw every panel of a record: a line for each method, and what is safe shaded.

    Parameters
    ----------
    stability : Stability
        With one panel or more.

    Returns
    -------
    matplotlib.figure.Figure
        8 inches wide, with more than 12 panels 16. Bars are where other seeds lie; a line leaves
        its panel at the top where a fit is refused.

    Raises
    ------
    ArgumentError
        ``stability`` is another record.
    """
    check_drawn(stability, "Stability")
    panels = stability.panels
    shared = _shared(stability)
    styles = _styles(panels)
    is_wide = len(panels) > _MANY
    columns = _WIDE_COLUMNS if is_wide else _COLUMNS
    rows = math.ceil(len(panels) / columns)
    where = f"pixels of {stability.mm_per_pixel:g} mm, seed {stability.seed}"
    notes = [_note(panels), *stability.notes]
    height = _HEAD_INCHES + rows * (_WIDE_PANEL_INCHES if is_wide else _PANEL_INCHES)
    width = _WIDE_INCHES if is_wide else WIDTH_INCHES
    title = f"{stability.material}: where fits are safe"
    with new_page(height, title, where, notes, width_inches=width) as (figure, below):
        if shared:
            handles = [Line2D([], [], **styles[each]) for each in shared]
            below = add_legend(below, handles, shared)
        grid = below.subplots(rows, columns, squeeze=False).ravel()
        for axes, panel in zip(grid, panels, strict=False):
            _draw(axes, panel, styles, shared)
        for axes in grid[len(panels) :]:
            axes.remove()
    return figure


def _note(panels: Sequence[Panel]) -> str:
    """Return what shades and lines mean."""
    note = "Shaded: within the limit. Bars: where other seeds lie."
    if any(map(_reaches_floor, panels)):
        note += " Dotted: the least that a panel shows; points on it are as small or smaller, or 0."
    return note


def _reaches_floor(panel: Panel) -> bool:
    """Return whether measures were raised to the panel's floor."""
    return any(bool((each.y <= panel.floor).any()) for each in panel.curves) and panel.is_log


def _shared(stability: Stability) -> list[str]:
    """Return the labels of the figure's legend, in their order.

    They are those of several stresses, and those of panels whose own legend would leave no room.
    """
    seen = {(panel.stress, each.label) for panel in stability.panels for each in panel.curves}
    stresses = Counter(label for _, label in seen)
    labels = [[each.label for each in panel.curves] for panel in stability.panels]
    own = [[each for each in some if stresses[each] == 1] for some in labels]
    crowds = {each for some in own if len(some) > _CROWDED for each in some}
    every = dict.fromkeys(itertools.chain.from_iterable(labels))
    return [label for label in every if stresses[label] > 1 or label in crowds]


def _styles(panels: Sequence[Panel]) -> dict[str, Style]:
    """Return a style for every label: its method's colour, and a marker of its own."""
    labels = [each.label for panel in panels for each in panel.curves]
    return {label: style | {"lw": 1.0} for label, style in variants(labels, _POINTS).items()}


def _draw(axes: Axes, panel: Panel, styles: Mapping[str, Style], shared: Sequence[str]) -> None:
    own = []
    for each in panel.curves:
        line = _line(axes, each, styles[each.label])
        own += [line] if each.label not in shared else []
    name_axes(axes, panel.title, panel.axis.label, symbols(panel.y_label))
    axes.yaxis.label.set_fontsize(_SMALL)  # "change of p99 of ΔE 2000" is as long as a panel
    if panel.axis.is_log:
        axes.set_xscale("log")
        _tick_decades(axes.xaxis, 8)
    else:
        tick(axes.xaxis)
    low, high = _range(panel)
    is_crowded = panel.is_log and bool(own) and len(panel.curves) > _CROWDED
    legend_share = _LEGEND_LINE * len(own) * is_crowded
    if panel.is_log:
        axes.set_yscale("log")
        axes.set_ylim(low, high * (high / low) ** (legend_share / (1.0 - legend_share)))
        _tick_decades(axes.yaxis, 6)
    else:
        axes.set_ylim(low, high)
        tick(axes.yaxis)
    axes.axhspan(low, panel.limit, color=_SAFE, zorder=0)
    axes.axhline(panel.limit, color=RULE, lw=0.6, zorder=1)
    if _reaches_floor(panel):
        axes.axhline(panel.floor, color=RULE, lw=0.8, ls=":", zorder=1)
    if own:
        place: Style = {"loc": "upper right" if is_crowded else "best"}
        legend = axes.legend(handles=own, fontsize=_SMALL, frameon=True, framealpha=0.85, **place)
        legend.get_frame().set_edgecolor("none")


def _tick_decades(axis: Axis, most: int) -> None:
    """Tick powers of ten; on a short axis 1, 2 and 5 are labelled in one way."""
    tick_decades(axis, most)
    low, high = axis.get_view_interval()
    if math.log10(high / low) < _SHORT_DECADES:
        axis.set_major_formatter(short_number)


def _line(axes: Axes, curve: Curve, style: Style) -> Line2D:
    """Draw a curve with its bars, and return its line."""
    known = np.isfinite(curve.y)
    (line,) = axes.plot(curve.x[known], curve.y[known], label=curve.label, **style)
    if curve.low is None or curve.high is None:
        return line
    bars = _bars(curve.y, curve.low, curve.high)[:, known]
    axes.errorbar(
        curve.x[known], curve.y[known], yerr=bars, fmt="none", ecolor=style["color"], elinewidth=0.7
    )
    return line


def _bars(y: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return lengths of bars down and up (2, N); 0 where an end is infinite."""
    with np.errstate(invalid="ignore"):
        bars = np.stack((y - low, high - y))
    found: FloatArray = np.where(np.isfinite(bars), np.maximum(bars, 0.0), 0.0)
    return found


def _range(panel: Panel) -> tuple[float, float]:
    """Return the limits of the measure's axis, with room above the limit and for bars."""
    ends = [each.high for each in panel.curves if each.high is not None]
    values = np.concatenate([*(each.y for each in panel.curves), *ends])
    values = np.append(values[np.isfinite(values)], panel.limit)
    if not panel.is_log:
        high = float(values.max()) * (1.0 + _HEADROOM) or 1.0
        return -_BELOW * high * (float(values.min()) <= 0.0), high
    positive = values[values > 0.0]
    low, high = float(positive.min()), float(positive.max())
    return 0.7 * low, max(high, panel.limit * 3.0) * 1.5
