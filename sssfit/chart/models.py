"""Profile models against the exact solution, as a figure: `models_figure`.

The upper panels show 2 pi r R_d by each method, the lower ones its error, with one column per
channel. ``sssfit.compare.models`` computes the record.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import (
    FuncFormatter,
    NullFormatter,
    NullLocator,
)

from sssfit.arrays import FloatArray
from sssfit.chart.looks import model_look
from sssfit.chart.page import (
    Handle,
    Style,
    add_table,
    check_drawn,
    draw_steps,
    name_axes,
    new_page,
    short_number,
    tick_decades,
)
from sssfit.chart.text import (
    NO_LIGHT,
    WEIGHTED,
    channel_name,
    count,
    grid,
    left_out_note,
    method_name,
    shortened,
    spread,
)

if TYPE_CHECKING:
    from sssfit.compare.models import ModelComparison, ModelCurve

HEIGHT_INCHES = 6.6
_MOST_COLUMNS = 3
_DECADES = 5  # most decades of 2 pi r R_d that are drawn
_LINEAR_PERCENT, _LEAST_PERCENT, _MOST_PERCENT = 10.0, -100.0, 1000.0
_TICKS_PERCENT = (-100, -10, 0, 10, 100, 1000)
_MINUS = "\N{MINUS SIGN}"

_WIDTHS = {"exact": 1.3, "montecarlo": 0.8, "burley": 1.5}  # points; of the others 1.2
_BAND_ALPHA = 0.45


def models_figure(comparison: ModelComparison) -> Figure:
    """Draw a material by every method, and the error of each compared with the exact solution.

    Parameters
    ----------
    comparison : ModelComparison
        If it has more than three channels, the first, the middle and the last one are drawn.

    Returns
    -------
    matplotlib.figure.Figure
        8 x 6.6 inches, one column per channel: 2 pi r R_d [1/mm] over r [mm], and the relative
        error [%] below, linear to 10 % and logarithmic beyond; totals and their errors in the
        legend.

    Raises
    ------
    ArgumentError
        ``comparison`` is another record.
    """
    check_drawn(comparison, "ModelComparison")
    shown = spread(comparison.material.n_channels, _MOST_COLUMNS)
    title, subtitle = _title(comparison), _subtitle(comparison)
    with new_page(HEIGHT_INCHES, title, subtitle, _notes(comparison, shown)) as (figure, below):
        below = add_table(below, *_table(comparison, shown))
        panels = below.subplots(
            2, len(shown), squeeze=False, sharex=True, sharey="row", height_ratios=(1.25, 1)
        )
        for k, channel in enumerate(shown):
            _draw_densities(panels[0, k], comparison, channel)
            name_axes(panels[0, k], _panel_title(comparison, channel), "", "")
            _draw_errors(panels[1, k], comparison, channel)
        _limit(panels, comparison, shown)
        panels[0, 0].set_ylabel(WEIGHTED)
        panels[1, 0].set_ylabel("relative error of $R_d$ (%)")
        below.align_ylabels(panels[:, 0])
    return figure


def _table(
    comparison: ModelComparison, shown: Sequence[int]
) -> tuple[list[str], list[tuple[str, list[str]]], list[Handle]]:
    """Return heads, a row for each method with its totals, and its line or the walk's band."""
    channels = [_channel_name(comparison, each) for each in shown]
    rows = [
        (method_name(curve.method), [_total_with_error(curve, each) for each in shown])
        for curve in comparison.curves
    ]
    handles = [_handle(curve.method) for curve in comparison.curves]
    return ["total diffuse reflectance (error)", *channels], rows, handles


def _handle(method: str) -> Handle:
    """Return the line of a method, for the walk with its band."""
    line = Line2D([], [], **_style(method))
    if method != "montecarlo":
        return line
    return Patch(facecolor=_style(method)["color"], alpha=_BAND_ALPHA, lw=0), line


def _draw_densities(axes: Axes, comparison: ModelComparison, channel: int) -> None:
    """Draw 2 pi r R_d of every method, the exact one on top of the walk's band."""
    edges_mm = comparison.edges_mm[channel]
    widths_mm = np.diff(edges_mm)
    for curve in _back_to_front(comparison):
        density = curve.energy[channel] / widths_mm
        error = curve.energy_stderr[channel] / widths_mm
        _draw_curve(axes, curve, edges_mm, np.where(density > 0, density, np.nan), error)
    axes.set_yscale("log", nonpositive="clip")


def _draw_errors(axes: Axes, comparison: ModelComparison, channel: int) -> None:
    """Draw the error of every method compared with the exact one, in percent."""
    edges_mm = comparison.edges_mm[channel]
    for curve in _back_to_front(comparison):
        error = 100 * curve.relative_error[channel]
        stderr = 100 * curve.relative_error_stderr[channel]
        _draw_curve(axes, curve, edges_mm, error, stderr)
    axes.set_yscale("symlog", linthresh=_LINEAR_PERCENT)
    axes.axhspan(-_LINEAR_PERCENT, _LINEAR_PERCENT, color="#f3f3f3", lw=0, zorder=0)
    axes.set_xlabel("r (mm)")


def _back_to_front(comparison: ModelComparison) -> list[ModelCurve]:
    """Return the drawing order: the walk with its band first, the exact solution last."""
    return [comparison.walk, *comparison.curves[2:], comparison.exact]


def _draw_curve(
    axes: Axes, curve: ModelCurve, edges_mm: FloatArray, mean: FloatArray, error: FloatArray
) -> None:
    """Draw a line through the middles of the bins; the walk as steps with a band."""
    style = _style(curve.method)
    if edges_mm.size < 2:
        return  # the walk has too few photons; the title says so
    if curve.method != "montecarlo":
        axes.plot(0.5 * (edges_mm[1:] + edges_mm[:-1]), mean, **style)
        return
    band: Style = {"lw": 0, "alpha": _BAND_ALPHA, "color": style["color"]}
    draw_steps(axes, mean + error, edges_mm, baseline=mean - error, **band)
    draw_steps(axes, mean, edges_mm, **style)


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
    tick_decades(panels[0, 0].yaxis, 7)
    panels[1, 0].set_ylim(1.15 * _LEAST_PERCENT, _MOST_PERCENT)
    panels[1, 0].set_yticks(_TICKS_PERCENT)
    panels[1, 0].yaxis.set_minor_locator(NullLocator())
    panels[1, 0].yaxis.set_major_formatter(FuncFormatter(_signed))
    first_mm = comparison.exact.profile.r_edges_mm[1]
    panels[0, 0].set_xscale("log")
    panels[0, 0].set_xlim(
        0.5 * first_mm, max(comparison.edges_mm[c][-1] for c in shown) or first_mm
    )
    panels[0, 0].xaxis.set_major_formatter(FuncFormatter(short_number))
    panels[0, 0].xaxis.set_minor_formatter(NullFormatter())


def _signed(value: float, _: int) -> str:
    """Return the label of a tick with its sign; 0 has none."""
    return f"{value:+g}".replace("-", _MINUS) if value else "0"


def _title(comparison: ModelComparison) -> str:
    """Return the title with the material and the reference of the models."""
    return f"{shortened(comparison.material.name, 20)}: models against the exact solution"


def _subtitle(comparison: ModelComparison) -> str:
    """Return text about the walk, the exact solution and their grid."""
    exact, walk = comparison.exact.profile, comparison.walk.profile
    reached = 100.0 * float(exact.meta["relative_error"] or 0.0)
    return (
        f"Exact to {reached:.1g} % of the total · {count(walk.photons or 0)} photons, seed "
        f"{walk.meta.get('seed', 'unknown')} · {grid(walk)} · sssfit {exact.meta['version']}"
    )


def _channel_name(comparison: ModelComparison, channel: int) -> str:
    """Return the name of a channel."""
    return channel_name(comparison.material.channels, channel)


def _panel_title(comparison: ModelComparison, channel: int) -> str:
    """Return a channel's name with albedo and mean free path, or why it is empty."""
    name, layer = _channel_name(comparison, channel), comparison.material.layers[0]
    apart = " · " if len(name) <= 4 else "\n"  # a longer one leaves too little room for the rest
    if comparison.edges_mm[channel].size < 2:
        is_dark = not comparison.exact.profile.diffuse_reflectance[channel] > 0.0
        return f"{name}{apart}{NO_LIGHT if is_dark else 'too few photons to draw'}"
    if len(comparison.material.layers) > 1:
        return f"{name}{apart}{len(comparison.material.layers)} layers"
    albedo, path_mm = layer.albedo[channel], layer.mean_free_path_mm[channel]
    return f"{name}{apart}albedo {albedo:.4g} · MFP {path_mm:#.3g} mm"


def _total_with_error(curve: ModelCurve, channel: int) -> str:
    """Return the total diffuse reflectance and its error compared with the exact one."""
    total = float(curve.profile.diffuse_reflectance[channel])
    error = 100.0 * float(curve.total_error[channel])
    if curve.method == "exact" or math.isnan(error):
        return f"{total:#.4g}"
    if "reflectance" in (curve.profile.meta.get("settings") or {}):
        return f"{total:#.4g} (given)"
    signed = f"{error:+.{2 if abs(error) < 1.0 else 1}f}".replace("-", _MINUS)
    if curve.profile.photons is not None:
        stderr = float(curve.profile.diffuse_reflectance_stderr[channel])
        signed += f" ± {100.0 * stderr / total:.2f}"
    return f"{total:#.4g} ({signed} %)"


def _notes(comparison: ModelComparison, shown: Sequence[int]) -> list[str]:
    """Return the notes on the bins, the band and omitted parts."""
    notes = [
        "Means over annuli merged until the walk has 100 effective photons in each; curves end "
        "where it has too few. Band: ±1 standard error of the walk. Errors: linear within ±10 % "
        "(grey), logarithmic beyond, above +1000 % not drawn. MFP: mean free path.",
    ]
    notes += comparison.left_out
    if any(each.g.any() for each in comparison.material.layers) and len(comparison.curves) > 2:
        notes.append(
            "g is not 0: the models are of isotropic scattering of (1 - g) sigma_s, which is an "
            "approximation; the exact solution and the walk follow g itself."
        )
    return [*notes, *left_out_note(comparison.material.n_channels - len(shown))]


def _style(method: str) -> Style:
    return model_look(method).stroke(_WIDTHS.get(method, 1.2))
