"""The singular values of a profile's kernel, as a figure: `spectrum_figure`.

``sssfit.compare.spectrum`` computes the record.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullLocator

from sssfit.arrays import FloatArray
from sssfit.chart.page import (
    COLOURS,
    LINE_STYLES,
    Style,
    add_table,
    check_drawn,
    name_axes,
    new_page,
    short_number,
)
from sssfit.chart.text import (
    channel_name,
    kernel_subtitle,
    left_out_note,
    spread,
    titled,
)

if TYPE_CHECKING:
    from sssfit.compare.spectrum import Spectrum

HEIGHT_INCHES = 4.4
_MOST_CHANNELS = 3
_MOST_TERMS = 12
_DECADES = 6  # most decades of a share that are drawn
_MARKERS = "os^"
_HEADS = ("", "first value, squared", "first value, absolute", "terms for an error of 1 %")


def spectrum_figure(spectrum: Spectrum) -> Figure:
    """Draw the share of each singular value in the kernel, in both readings of "energy".

    Parameters
    ----------
    spectrum : Spectrum
        If it has more than three channels, the first, the middle and the last one are drawn.

    Returns
    -------
    matplotlib.figure.Figure
        8 x 4.4 inches: shares [%] of the sum of squares and of the sum of absolute values over the
        number of the term, logarithmic; hollow if the eigenvalue is negative.

    Raises
    ------
    ArgumentError
        ``spectrum`` is another record.
    """
    check_drawn(spectrum, "Spectrum")
    shown = spread(spectrum.profile.n_channels, _MOST_CHANNELS)
    where = kernel_subtitle(spectrum.profile, spectrum.pixels, spectrum.mm_per_pixel)
    title = titled(spectrum.profile, "energy of the kernel's singular values")
    notes = _notes(spectrum, shown)
    with new_page(HEIGHT_INCHES, title, where, notes) as (figure, below):
        rows = [_row(spectrum, channel) for channel in shown]
        handles = [Line2D([], [], **_style(k)) for k in range(len(shown))]
        left, right = add_table(below, _HEADS, rows, handles).subplots(1, 2, sharey=True)
        _draw_shares(left, spectrum, spectrum.squared_share, shown)
        _draw_shares(right, spectrum, spectrum.absolute_share, shown)
        term = "term, largest first"
        name_axes(left, "(a) of the sum of squares", term, "share of the kernel (%)")
        name_axes(right, "(b) of the sum of absolute values", term, "")
        _limit(left, spectrum, shown)
    return figure


def _style(k: int) -> Style:
    """Return colour, dashes and marker of the k-th channel, distinguishable without colour too."""
    return {
        "color": COLOURS[k],
        "linestyle": LINE_STYLES[k],
        "marker": _MARKERS[k],
        "markersize": 4.5,
        "lw": 1.0,
    }


def _draw_shares(axes: Axes, spectrum: Spectrum, shares: FloatArray, shown: Sequence[int]) -> None:
    """Draw a line per channel, with hollow markers for negative eigenvalues."""
    terms = np.arange(1, min(_MOST_TERMS, len(shares)) + 1)
    for k, channel in enumerate(shown):
        percent = 100.0 * shares[: terms.size, channel]
        values = spectrum.values[: terms.size, channel]
        axes.plot(terms, np.where(percent > 0.0, percent, np.nan), **_style(k))
        below = np.where(values < 0.0, percent, np.nan)
        hollow = _style(k) | {"linestyle": "none", "markerfacecolor": "white", "zorder": 3}
        axes.plot(terms, below, **hollow)
    axes.set_yscale("log", nonpositive="clip")
    axes.set_xlim(0.5, max(terms[-1], 2) + 0.5)
    axes.xaxis.set_major_locator(MaxNLocator(12, integer=True))


def _limit(axes: Axes, spectrum: Spectrum, shown: Sequence[int]) -> None:
    """Set the shared axis of both panels: percent, at most six decades."""
    squared = 100.0 * spectrum.squared_share[:_MOST_TERMS, shown]
    least = float(squared[squared > 0.0].min(initial=100.0))
    axes.set_ylim(max(least / 2.0, 10.0 ** (2 - _DECADES)), 160.0)
    axes.yaxis.set_major_locator(LogLocator(numticks=8))
    axes.yaxis.set_major_formatter(FuncFormatter(short_number))
    axes.yaxis.set_minor_locator(NullLocator())


def _row(spectrum: Spectrum, channel: int) -> tuple[str, list[str]]:
    """Return name and figures of one channel in the table."""
    name = channel_name(spectrum.profile.channels, channel)
    first = (spectrum.squared_share[0, channel], spectrum.absolute_share[0, channel])
    if not first[0] > 0.0:
        return name, ["returns no light", "", ""]
    shares = [f"{100.0 * each:.1f} %" for each in first]
    return name, [*shares, str(spectrum.rank_for(0.01, channel))]


def _notes(spectrum: Spectrum, shown: Sequence[int]) -> list[str]:
    """Return the notes on drawn and omitted parts."""
    note = (
        "Term: a horizontal and a vertical pass. The squares that N terms leave are the square of "
        "the relative Frobenius error of the best N-term kernel. Hollow: negative eigenvalue."
    )
    return [note, *left_out_note(spectrum.profile.n_channels - len(shown))]
