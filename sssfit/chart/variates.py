"""The supplement's control variates over time, as a figure: `variates_figure`.

``sssfit.motion.table`` computes the record; the panels are those of figures 1 and 2 of Xie and
Olano 2021, "Supplementary: Real-time Subsurface Control Variates".
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from sssfit.arrays import FloatArray
from sssfit.chart.looks import BLACK, ORANGE, PURPLE
from sssfit.chart.page import (
    COLOURS,
    LINE_STYLES,
    Style,
    add_table,
    check_drawn,
    name_axes,
    new_page,
    tick,
)
from sssfit.messages import counted

if TYPE_CHECKING:
    from sssfit.motion.table import VariateTable

_HEIGHT_INCHES = 8.2
# Of the columns of the paper's table, by their names in it.
_LABELS = {
    "Res_f": "no control variate",
    "Res_SF": "coefficient of a single frame",
    "Res_SF_EMA": "its moving mean",
    "Res_EMCM": "moving covariance",
    "Res_hat_EMCM": "moving covariance, G constant in a frame",
    "Res_GT": "true coefficient",
}
_COLOURS = (*COLOURS, ORANGE, BLACK, PURPLE)
_ORDER = (0, 5, 1, 2, 3, 4)  # what is drawn first lies behind
_HEADS = ("", "name", "still light", "published", "moving light", "published")
_LETTERS = "ace", "bdf"  # of the panels of a column
_PANELS = ("coefficient of g", "residual", "deviation of the residual")
_NOTE = (
    "Lines: one run, the first seed. Residual: f less the coefficient times g, mean of a frame's "
    "samples; G is the known integral of g. Table: medians over the seeds of the residual's "
    "deviation, frames 25 to 100, beside those of Xie and Olano (2021, supplement, Table 1). "
    "Still: h = 1; moving: h = 1 + 3 sin(t / 10). Both lines of moving covariance have "
    "the same coefficient."
)


def variates_figure(table: VariateTable) -> Figure:
    """Draw coefficient, residual and error over the frames, under still and under moving light.

    Parameters
    ----------
    table : VariateTable

    Returns
    -------
    matplotlib.figure.Figure
        8 x 8.2 inches, with the table at the top.

    Raises
    ------
    ArgumentError
        ``table`` is another record.
    """
    check_drawn(table, "VariateTable")
    title = "Control variates under light that changes"
    where = f"f = h(t) / (1 + y), g = h(t) (1 - y), 16 samples a frame, {_seeds(table)}"
    with new_page(_HEIGHT_INCHES, title, where, [_NOTE]) as (figure, below):
        handles = [Line2D([], [], **_style(k)) for k in range(len(_LABELS))]
        below = add_table(below, _HEADS, _rows(table), handles)
        grid = below.subplots(3, 2, sharex=True)
        for column, (light, trace) in enumerate(table.traces.items()):
            parts = (trace.coefficient, trace.residual, trace.error)
            for axes, values in zip(grid[:, column], parts, strict=True):
                _draw(axes, values)
            for axes, name, letter in zip(grid[:, column], _PANELS, _LETTERS[column], strict=True):
                name_axes(axes, f"({letter}) {light} light", "", name)
            grid[2, column].set_xlabel("frame")
            coefficients = trace.coefficient[:, 9:]
            low, high = float(coefficients.min()), float(coefficients.max())
            room = 0.1 * (high - low)
            grid[0, column].set_ylim(low - room, high + room)
        for column in range(2):
            below.align_ylabels(grid[:, column])
    return figure


def _seeds(table: VariateTable) -> str:
    return f"{counted(table.seeds, 'seed')} from {table.seed}"


def _rows(table: VariateTable) -> list[tuple[str, list[str]]]:
    """Return what each residual is, its name in the paper, and its figures."""
    told = table.to_dict()
    return [
        (
            label,
            [
                name,
                *(
                    f"{told[of][light][name]:.4f}"
                    for light in ("still", "moving")
                    for of in ("table", "published")
                ),
            ],
        )
        for name, label in _LABELS.items()
    ]


def _style(k: int) -> Style:
    return {"color": _COLOURS[k], "linestyle": LINE_STYLES[k % len(LINE_STYLES)], "lw": 1.0}


def _draw(axes: Axes, values: FloatArray) -> None:
    frames = np.arange(1, values.shape[1] + 1)
    for k in _ORDER:
        axes.plot(frames, values[k], **_style(k))
    axes.set_xlim(1, frames[-1])
    tick(axes.xaxis)
    tick(axes.yaxis)
