"""The paper's Table 1 for heads in a row, as a figure: `speed_up_figure`.

``sssfit.crowd.table`` computes the record.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from sssfit.arrays import FloatArray
from sssfit.chart.page import COLOURS, Style, add_legend, name_axes, new_page, tick_decades
from sssfit.messages import counted

if TYPE_CHECKING:
    from sssfit.crowd.table import SpeedUpTable

_HEIGHT_INCHES = 7.6
_COLOURS = (*COLOURS, "#e69f00", "#000000")
_MARKERS = "os^Dv"
_NOTE = (
    "Speed-up: without savings over with all three. Dotted: Jimenez and Gutierrez 2008, Table 1, "
    "frames a second on a GeForce 8800 GTX. Texture over screen: texels that texture space with "
    "savings convolves over pixels that screen space does; below 1 texture space is cheaper."
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
    """
    frame = table.frames[0][0]
    height, width = frame.row.resolution
    where = (
        f"heads of {frame.row.head_units:g} units, {frame.row.spacing_units:g} apart, "
        f"{frame.row.fov_degrees:g} degrees, {width} x {height} pixels, maps of {frame.map_size}"
    )
    title = "What texture space need not compute"
    with new_page(_HEIGHT_INCHES, title, where, [_NOTE]) as (figure, below):
        handles = [Line2D([], [], **_style(k)) for k in range(len(table.heads))]
        below = add_legend(below, handles, [counted(each, "head") for each in table.heads])
        grid = below.subplots(2, 2).ravel()
        _draw(grid[0], table, table.texels, "speed-up in convolved texels", "times fewer")
        _draw(grid[1], table, table.seconds, "speed-up in time", "times as fast")
        for axes in grid[:2]:
            _draw_published(axes, table)
        _draw(grid[2], table, table.over_screen, "texture over screen space", "texels / pixels")
        grid[2].axhline(1.0, color="#666666", lw=0.6)
        errors = np.array([[f.work["saved"].mean_delta_e for f in row] for row in table.frames])
        _draw(grid[3], table, np.maximum(errors, 1e-4), "error of the savings", "mean Delta E 2000")
    return figure


def _style(k: int) -> Style:
    return {"color": _COLOURS[k], "marker": _MARKERS[k], "markersize": 3.5, "lw": 1.0}


def _draw(axes: Axes, table: SpeedUpTable, values: FloatArray, title: str, y_label: str) -> None:
    """Draw a line for each number of heads over the distance."""
    for k, line in enumerate(values):
        axes.plot(table.distances, line, **_style(k))
    name_axes(axes, title, "distance (units of 100 mm)", y_label)
    for axis in (axes.xaxis, axes.yaxis):
        scale = axes.set_xscale if axis is axes.xaxis else axes.set_yscale
        scale("log")
        tick_decades(axis, 6)


def _draw_published(axes: Axes, table: SpeedUpTable) -> None:
    """Draw the paper's speed-ups, dotted."""
    for k, line in enumerate(table.published):
        axes.plot(table.distances, line, color=_COLOURS[k], lw=0.9, linestyle=":")
