"""Errors of engines' own diffusion, as a figure: `presets_figure`.

``sssfit.compare.presets`` computes the record.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator

from sssfit.arrays import FloatArray
from sssfit.chart.looks import RULE, series
from sssfit.chart.page import Style, add_legend, check_drawn, label_minor, name_axes, new_page

if TYPE_CHECKING:
    from sssfit.compare.presets import PresetComparison

_HEIGHT_INCHES, _LINE_INCHES, _GAP_INCHES = 1.8, 0.075, 0.09  # of a row: per picture, and between
_LEAST = 1e-2  # what is smaller has a place of its own: a logarithmic axis has none for 0
_NOTE = (
    "ΔE 2000, 95th percentile over the pixels of each picture, of the engine's own diffusion model "
    "with the exported parameters against the exact 2D kernel. Engines that take the medium itself "
    "have the exact profile by construction, so their error is 0. A difference of 1 is about the "
    "least that is seen side by side."
)


def presets_figure(found: PresetComparison) -> Figure:
    """Draw the error of every preset on every picture, the best preset at the top.

    Parameters
    ----------
    found : PresetComparison

    Returns
    -------
    matplotlib.figure.Figure
        8 inches wide; a row takes .09 inches and .075 more for each picture.

    Raises
    ------
    ArgumentError
        ``found`` is another record.
    """
    check_drawn(found, "PresetComparison")
    names = [each.parameters.preset.name for each in found.rows]
    errors = np.array([each.p95 for each in found.rows])
    count = len(found.pictures)
    row_inches = max(_GAP_INCHES + _LINE_INCHES * count, 0.26)
    height = _HEIGHT_INCHES + row_inches * len(names)
    where = f"{found.material}, pixels of {found.mm_per_pixel:g} mm"
    with new_page(height, "What engines show of a material", where, [_NOTE]) as (figure, below):
        styles: list[Style] = [{**series(k), "ls": ""} for k in range(count)]
        below = add_legend(below, [Line2D([], [], **each) for each in styles], found.pictures)
        axes = below.subplots()
        least = _scale(axes, errors)
        places = np.arange(len(names))
        # Pictures lie under each other within a row, so that equal errors can be seen.
        shifts = _LINE_INCHES / row_inches * (np.arange(count) - 0.5 * (count - 1))
        for k, style in enumerate(styles):
            seen = np.where(errors[:, k] < _LEAST, least, errors[:, k])
            axes.plot(seen, places + shifts[k], **style)
        axes.axvline(1.0, color=RULE, lw=0.6)
        if (errors < _LEAST).any():
            _break(axes, least * 10.0**0.25)
        name_axes(axes, "", "ΔE 2000, 95th percentile", "")
        axes.set_yticks(places, names)
        axes.set_ylim(len(names) - 0.5, -0.5)
    return figure


def _scale(axes: Axes, errors: FloatArray) -> float:
    """Scale errors logarithmically; return where those too small for it are drawn.

    Their place is half a decade left of the least power of ten, beyond a break of the axis.
    """
    seen = errors[errors >= _LEAST]
    low, high = (f(seen, initial=1.0) for f in (np.min, np.max))
    first = 10.0 ** math.floor(math.log10(low))
    powers = first * 10.0 ** np.arange(math.floor(math.log10(high / first)) + 1)
    least = first / math.sqrt(10.0)
    is_broken = seen.size < errors.size
    axes.set_xscale("log")
    axes.set_xlim((least if is_broken else low) / 1.4, 1.4 * high)
    axes.xaxis.set_major_locator(FixedLocator([least, *powers] if is_broken else [*powers]))
    axes.xaxis.set_major_formatter(
        FuncFormatter(lambda x, _: f"<{_LEAST:g}" if x < 0.9 * first else f"{x:g}")
    )
    minor = LogLocator(subs=(2, 5)).tick_values(first, 10.0 * high)
    axes.xaxis.set_minor_locator(FixedLocator([each for each in minor if each > first]))
    label_minor(axes.xaxis, bool(high < 20.0 * low))
    return least


def _break(axes: Axes, x: float) -> None:
    """Mark a break of the axis: a gap between two short slanted lines."""
    ends = [x / 1.025, x * 1.025]
    style: Style = {"transform": axes.get_xaxis_transform(), "clip_on": False}
    axes.plot(ends, [0.0, 0.0], color="white", lw=2.0, zorder=5, **style)
    slash: Style = {"marker": [(-1, -2), (1, 2)], "ms": 6, "mec": "black", "mew": 0.6, "ls": ""}
    axes.plot(ends, [0.0, 0.0], zorder=6, **slash, **style)
