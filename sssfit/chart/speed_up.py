"""The paper's Table 1 for heads in a row, as a figure: `speed_up_figure`.

``sssfit.crowd.table`` computes the record.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, LogLocator, MaxNLocator, NullLocator

from sssfit.arrays import FloatArray
from sssfit.chart.looks import RULE, series
from sssfit.chart.page import Style, add_legend, check_drawn, name_axes, new_page, tick_decades
from sssfit.messages import counted

if TYPE_CHECKING:
    from sssfit.crowd.table import SpeedUpTable

_HEIGHT_INCHES = 7.6
_SHORT_DECADES, _LEAST_DECADES = 2.0, 0.5  # of the y axis
_SOME, _MANY = (1.0, 2.0, 5.0), (1.0, 2.0, 3.0, 4.0, 6.0)  # numbers of a decade
_DOTTED: Style = {"lw": 0.9, "linestyle": ":"}
_NOTE = (
    "Speed-up: without savings over with all three. Published: Jimenez and Gutierrez 2008, Table "
    "1, frames a second on a GeForce 8800 GTX, in the colours of the heads. Texture over screen: "
    "texels that texture space with savings convolves over pixels that screen space does; below 1 "
    "texture space is cheaper."
)


def speed_up_figure(table: SpeedUpTable) -> Figure:
    """Draw speed-ups in texels and in time, and texture space beside screen space.

    Parameters
    ----------
    table : SpeedUpTable

    Returns
    -------
    matplotlib.figure.Figure
        8 x 7.6 inches.

    Raises
    ------
    ArgumentError
        ``table`` is another record.
    """
    check_drawn(table, "SpeedUpTable")
    frame = table.frames[0][0]
    height, width = frame.row.resolution
    where = (
        f"heads of {frame.row.head_units:g} units, {frame.row.spacing_units:g} apart, "
        f"{frame.row.fov_degrees:g} degrees, {width} x {height} pixels, maps of {frame.map_size}"
    )
    title = "What texture space need not compute"
    with new_page(_HEIGHT_INCHES, title, where, [_NOTE]) as (figure, below):
        handles = [Line2D([], [], **_style(k)) for k in range(len(table.heads))]
        handles.append(Line2D([], [], color=RULE, **_DOTTED))
        heads = [counted(each, "head") for each in table.heads]
        below = add_legend(below, handles, [*heads, "published (2008)"])
        grid = below.subplots(2, 2).ravel()
        _draw(grid[0], table, table.texels, "(a) speed-up in convolved texels", "times fewer")
        _draw(grid[1], table, table.seconds, "(b) speed-up in time", "times as fast")
        for axes in grid[:2]:
            _draw_published(axes, table)
        _draw(grid[2], table, table.over_screen, "(c) texture over screen space", "texels / pixels")
        grid[2].axhline(1.0, color=RULE, lw=0.6)
        errors = np.array([[f.work["saved"].mean_delta_e for f in row] for row in table.frames])
        _draw(grid[3], table, np.maximum(errors, 1e-4), "(d) error of the savings", "mean ΔE 2000")
        for axes in grid:
            _tick(axes.yaxis)
    return figure


def _style(k: int) -> Style:
    return {**series(k, 3.5), "lw": 1.0}


def _draw(axes: Axes, table: SpeedUpTable, values: FloatArray, title: str, y_label: str) -> None:
    """Draw a line for each number of heads over the distance."""
    for k, line in enumerate(values):
        axes.plot(table.distances, line, **_style(k))
    name_axes(axes, title, "distance (units of 100 mm)", y_label)
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(FixedLocator(list(table.distances)))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_yscale("log")


def _tick(axis: Axis) -> None:
    """Tick powers of ten; on a short axis, where one or two would lie, plain numbers between."""
    low, high = axis.get_view_interval()
    decades = math.log10(high / low)
    if decades > _SHORT_DECADES:
        tick_decades(axis, 6)
        return
    if decades > _LEAST_DECADES:
        axis.set_major_locator(LogLocator(subs=_MANY if decades < 1.0 else _SOME))
    else:
        axis.set_major_locator(MaxNLocator(5))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_locator(NullLocator())


def _draw_published(axes: Axes, table: SpeedUpTable) -> None:
    """Draw the paper's speed-ups, dotted."""
    for k, line in enumerate(table.published):
        axes.plot(table.distances, line, color=series(k)["color"], **_DOTTED)
