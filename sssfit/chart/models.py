"""Profile models against the exact solution, as a figure: `models_figure`.

Above, what each method says of 2 pi r R_d; below, its error; a column a channel. The record comes
from ``sssfit.compare.models``, which has computed everything.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter, StrMethodFormatter

from sssfit.arrays import FloatArray
from sssfit.chart import _models_text as words
from sssfit.chart.page import (
    LEFT,
    RC,
    RIGHT,
    TEXT_INCHES,
    WIDTH_INCHES,
    Style,
    chart_style,
    draw_footnotes,
    draw_text,
    drawable,
    fitting,
    new_figure,
)
from sssfit.chart.text import WEIGHTED, method_name, spread

if TYPE_CHECKING:
    from sssfit.compare.models import ModelComparison, ModelCurve

HEIGHT_INCHES = 6.6
_ROW_INCHES = 0.165
_TABLE_LEFT = 0.37  # of the width: the legend's totals
_MOST_COLUMNS = 3
_DECADES = 5  # of 2 pi r R_d that are drawn at most
_LINEAR_PERCENT, _LEAST_PERCENT, _MOST_PERCENT = 10.0, -100.0, 1000.0
_TICKS_PERCENT = (-100, -10, 0, 10, 100, 1000)

# Black, and of Okabe and Ito 2008: sky blue, vermillion, blue, bluish green; dashes tell them apart
# without colour.
_STYLES: dict[str, Style] = {
    "exact": {"color": "#000000", "linestyle": "-", "lw": 1.3},
    "montecarlo": {"color": "#56b4e9", "linestyle": "-", "lw": 0.8},
    "dipole": {"color": "#d55e00", "linestyle": (0, (5, 1.5)), "lw": 1.2},
    "dipole-grosjean": {"color": "#0072b2", "linestyle": (0, (6, 1.4, 1.2, 1.4)), "lw": 1.2},
    "burley": {"color": "#009e73", "linestyle": (0, (1.3, 1.2)), "lw": 1.5},
}
_BAND_ALPHA = 0.45


def models_figure(comparison: ModelComparison) -> Figure:
    """Draw what every method says of one material, and how far that is from the exact solution.

    Parameters
    ----------
    comparison : ModelComparison
        Of more than three channels the first, the middle and the last one are drawn.

    Returns
    -------
    matplotlib.figure.Figure
        8 x 6.6 inches, a column a channel: 2 pi r R_d [1/mm] over r [mm], and the relative error
        [%] below, linear to 10 % and logarithmic beyond; totals and their errors in the legend.
    """
    shown = spread(comparison.material.n_channels, _MOST_COLUMNS)
    room = TEXT_INCHES / len(shown) - 0.15
    with chart_style():
        figure = new_figure(HEIGHT_INCHES)
        top = _draw_head(figure, comparison, shown)
        bottom = draw_footnotes(figure, words.model_notes(comparison, shown))
        panels = figure.subplots(
            2, len(shown), squeeze=False, sharex=True, sharey="row", height_ratios=(1.25, 1)
        )
        figure.subplots_adjust(LEFT, bottom, RIGHT, top, wspace=0.08, hspace=0.1)
        for k, channel in enumerate(shown):
            _draw_densities(panels[0, k], comparison, channel)
            title = fitting(words.panel_titles(comparison, channel), RC["font.size"], room)
            panels[0, k].set_title(drawable(title), loc="left", parse_math=False)
            _draw_errors(panels[1, k], comparison, channel)
        _limit(panels, comparison, shown)
        panels[0, 0].set_ylabel(WEIGHTED)
        panels[1, 0].set_ylabel("relative error of $R_d$ (%)")
        figure.align_ylabels(panels[:, 0])
    return figure


def _draw_head(figure: Figure, comparison: ModelComparison, shown: Sequence[int]) -> float:
    """Title, provenance and a legend with totals; the height of what is left, as a fraction."""
    draw_text(figure, 0.16, words.models_title(comparison), size=12, weight="bold")
    draw_text(figure, 0.41, words.models_subtitle(comparison))
    grey: Style = {"color": "#444444", "size": 8}
    down = 0.68
    draw_text(figure, down, "Total diffuse reflectance, and its error", **grey)
    columns = np.linspace(_TABLE_LEFT, RIGHT, len(shown) + 1)[:-1]
    room = WIDTH_INCHES * (RIGHT - _TABLE_LEFT) / len(shown) - 0.05
    for left, channel in zip(columns, shown, strict=True):
        draw_text(figure, down, words.channel_name(comparison, channel), left=left, **grey)
    for curve in comparison.curves:
        down += _ROW_INCHES
        _draw_sample(figure, curve.method, down)
        draw_text(figure, down, method_name(curve.method), left=LEFT + 0.06)
        for left, channel in zip(columns, shown, strict=True):
            total = fitting(words.total_with_error(curve, channel), 8, room)
            draw_text(figure, down, total, left=left, size=8)
    return 1 - (down + 0.42) / HEIGHT_INCHES


def _draw_sample(figure: Figure, method: str, inches_down: float) -> None:
    """Draw a piece of the method's line, on its band for the walk, before its name."""
    y = 1 - inches_down / HEIGHT_INCHES
    style = _STYLES[method]
    if method == "montecarlo":
        half = 0.055 / HEIGHT_INCHES
        band = Rectangle((LEFT, y - half), 0.05, 2 * half, lw=0, alpha=_BAND_ALPHA)
        band.set_facecolor(style["color"])
        figure.add_artist(band)
    figure.add_artist(Line2D([LEFT, LEFT + 0.05], [y, y], **style))


def _draw_densities(axes: Axes, comparison: ModelComparison, channel: int) -> None:
    """2 pi r R_d of every method, the exact one on top of the walk's band."""
    edges_mm = comparison.edges_mm[channel]
    widths_mm = np.diff(edges_mm)
    for curve in _back_to_front(comparison):
        density = curve.energy[channel] / widths_mm
        error = curve.energy_stderr[channel] / widths_mm
        _draw_curve(axes, curve, edges_mm, np.where(density > 0, density, np.nan), error)
    axes.set_yscale("log", nonpositive="clip")


def _draw_errors(axes: Axes, comparison: ModelComparison, channel: int) -> None:
    """Error of every method against the exact one, in percent."""
    edges_mm = comparison.edges_mm[channel]
    for curve in _back_to_front(comparison):
        error = 100 * curve.relative_error[channel]
        stderr = 100 * curve.relative_error_stderr[channel]
        _draw_curve(axes, curve, edges_mm, error, stderr)
    axes.set_yscale("symlog", linthresh=_LINEAR_PERCENT)
    axes.axhspan(-_LINEAR_PERCENT, _LINEAR_PERCENT, color="#f3f3f3", lw=0, zorder=0)
    axes.set_xlabel("r (mm)")


def _back_to_front(comparison: ModelComparison) -> list[ModelCurve]:
    """Put the walk first, with its wide band, and the exact solution on top of all."""
    return [comparison.walk, *comparison.curves[2:], comparison.exact]


def _draw_curve(
    axes: Axes, curve: ModelCurve, edges_mm: FloatArray, mean: FloatArray, error: FloatArray
) -> None:
    """Draw a line through the middles of the bins; the walk as steps with a band."""
    style = _STYLES[curve.method]
    if edges_mm.size < 2:
        return  # the walk has too few photons, as the title says
    if curve.method != "montecarlo":
        axes.plot(0.5 * (edges_mm[1:] + edges_mm[:-1]), mean, **style)
        return
    axes.stairs(
        mean + error,
        edges_mm,
        baseline=mean - error,
        fill=True,
        lw=0,
        alpha=_BAND_ALPHA,
        color=style["color"],
    )
    axes.stairs(mean, edges_mm, baseline=None, **style)


def _limit(panels: npt.NDArray[Any], comparison: ModelComparison, shown: Sequence[int]) -> None:
    """Set the axes: r from half an annulus on, five decades of densities, errors to 1000 %."""
    peak = max(
        float((comparison.exact.energy[c] / np.diff(comparison.edges_mm[c])).max(initial=0.0))
        for c in shown
    )
    peak = peak or 1.0
    least = min(
        float((comparison.exact.energy[c] / np.diff(comparison.edges_mm[c])).min(initial=peak))
        for c in shown
    )
    panels[0, 0].set_ylim(max(least, peak * 10.0**-_DECADES) / 2, 3 * peak)
    panels[0, 0].yaxis.set_major_locator(LogLocator(numticks=7))
    panels[1, 0].set_ylim(1.15 * _LEAST_PERCENT, _MOST_PERCENT)
    panels[1, 0].set_yticks(_TICKS_PERCENT)
    panels[1, 0].yaxis.set_minor_formatter(NullFormatter())
    panels[1, 0].yaxis.set_major_formatter(FuncFormatter(_signed))
    first_mm = comparison.exact.profile.r_edges_mm[1]
    panels[0, 0].set_xscale("log")
    panels[0, 0].set_xlim(
        0.5 * first_mm, max(comparison.edges_mm[c][-1] for c in shown) or first_mm
    )
    panels[0, 0].xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    panels[0, 0].xaxis.set_minor_formatter(NullFormatter())


def _signed(value: float, _: int) -> str:
    """Write a tick with its sign, 0 without."""
    return f"{value:+g}".replace("-", words.MINUS) if value else "0"
