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
from sssfit.crowd.table import DISTANCES, HEADS, PUBLISHED
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
        handles = [Line2D([], [], **_style(k)) for k in range(len(HEADS))]
        below = add_legend(below, handles, [counted(each, "head") for each in HEADS])
        grid = below.subplots(2, 2).ravel()
        _draw(grid[0], table.texels, "speed-up in convolved texels", "times fewer", PUBLISHED)
        _draw(grid[1], table.seconds, "speed-up in time", "times as fast", PUBLISHED)
        _draw(grid[2], _over_screen(table), "texture over screen space", "texels / pixels", None)
        grid[2].axhline(1.0, color="#666666", lw=0.6)
        errors = np.array([[f.work["saved"].mean_delta_e for f in row] for row in table.frames])
        _draw(grid[3], np.maximum(errors, 1e-4), "error of the savings", "mean Delta E 2000", None)
    return figure


def _over_screen(table: SpeedUpTable) -> FloatArray:
    """Return texels convolved with savings over pixels convolved in screen space."""
    return np.array(
        [
            [
                f.work["saved"].texels_convolved / max(f.work["screen"].texels_convolved, 1)
                for f in row
            ]
            for row in table.frames
        ]
    )


def _style(k: int) -> Style:
    return {"color": _COLOURS[k], "marker": _MARKERS[k], "markersize": 3.5, "lw": 1.0}


def _draw(
    axes: Axes, values: FloatArray, title: str, y_label: str, published: FloatArray | None
) -> None:
    """Draw a line for each number of heads over the distance."""
    for k, line in enumerate(values):
        axes.plot(DISTANCES, line, **_style(k))
        if published is not None:
            axes.plot(DISTANCES, published[k], color=_COLOURS[k], lw=0.9, linestyle=":")
    name_axes(axes, title, "distance (units of 100 mm)", y_label)
    for axis in (axes.xaxis, axes.yaxis):
        scale = axes.set_xscale if axis is axes.xaxis else axes.set_yscale
        scale("log")
        tick_decades(axis, 6)
