"""The colours of a sweep over wavelengths, as a figure: `swatches_figure`.

``sssfit.compare.swatches`` computes the record.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from sssfit.chart.page import NOTE_COLOUR, RC, check_drawn, drawable, new_mosaic, new_page
from sssfit.chart.text import left_out_note, method_name, shortened, spread
from sssfit.messages import counted

if TYPE_CHECKING:
    from sssfit.compare.swatches import Swatches

_MOST_COLUMNS, _MOST_ROWS = 10, 24
_TALL, _APART = 0.55, 0.06  # of a swatch's width
_MOST_INCHES, _ROOM_INCHES = 1.1, 6.2  # width of a swatch, and of them all
_GREY = 0.18  # luminance of a grey card: letters on what is brighter are dark


def swatches_figure(found: Swatches) -> Figure:
    """Draw a swatch for each spectrum: columns are the last axis, rows all others.

    Parameters
    ----------
    found : Swatches
        If there are more than 10 columns or 24 rows, that many are drawn, spread from the first to
        the last.

    Returns
    -------
    matplotlib.figure.Figure
        8 inches wide; colours in sRGB under D65, a perfect white being #ffffff, with their codes.
        A swatch whose spectrum is not finished is crossed out.

    Raises
    ------
    ArgumentError
        ``found`` is another record.
    """
    check_drawn(found, "Swatches")
    lengths = [len(each) for each in found.axes.values()]
    every = list(itertools.product(*map(range, lengths[:-1])))
    rows = [every[k] for k in spread(len(every), _MOST_ROWS)]
    columns = spread(lengths[-1] if lengths else 1, _MOST_COLUMNS)
    width, height = len(columns) * (1.0 + _APART), len(rows) * (_TALL + _APART)
    inches = min(_ROOM_INCHES / width, _MOST_INCHES)
    title = f"{shortened(found.name, 24)}: colour in daylight"
    notes = _notes(found, len(rows) * len(columns))
    with new_page(1.9 + height * inches, title, _subtitle(found), notes) as (figure, below):
        axes = new_mosaic(below, width, height)
        for (i, row), (k, column) in itertools.product(enumerate(rows), enumerate(columns)):
            at = k * (1.0 + _APART), i * (_TALL + _APART)
            _draw(axes, found, (*row, column) if lengths else (), at)
        _name(axes, found, rows, columns)
    return figure


def _draw(axes: Axes, found: Swatches, position: tuple[int, ...], at: tuple[float, float]) -> None:
    """Draw one swatch with its code, or a cross."""
    x, y = at
    code = found.hexadecimal(position)
    axes.add_patch(Rectangle(at, 1.0, _TALL, facecolor=code or "none", edgecolor="#bbbbbb", lw=0.4))
    if code is None:
        axes.plot([x, x + 1.0], [y, y + _TALL], [x, x + 1.0], [y + _TALL, y], color="#bbbbbb")
        return
    shade = "#000000" if found.xyz[(*position, 1)] > _GREY else "#ffffff"
    middle = x + 0.5, y + 0.5 * _TALL
    axes.text(*middle, code, color=shade, ha="center", va="center", size=RC["xtick.labelsize"])


def _name(
    axes: Axes, found: Swatches, rows: Sequence[tuple[int, ...]], columns: Sequence[int]
) -> None:
    """Label the columns with values of the last axis, the rows with those of the others."""
    if not found.axes:
        return
    *above, last = found.axes
    middles = [0.5 + k * (1.0 + _APART) for k in range(len(columns))]
    axes.set_xticks(middles, [f"{found.axes[last][k]:g}" for k in columns])
    axes.set_xlabel(drawable(_axis(found, last)))
    axes.xaxis.set_label_position("top")
    if above:
        words = [
            ", ".join(f"{found.axes[name][k]:g}" for name, k in zip(above, row, strict=True))
            for row in rows
        ]
        axes.set_yticks([0.5 * _TALL + i * (_TALL + _APART) for i in range(len(rows))], words)
        axes.set_ylabel(drawable(", ".join(_axis(found, name) for name in above)))
    axes.tick_params(colors=NOTE_COLOUR)


def _axis(found: Swatches, name: str) -> str:
    """Name an axis with its unit."""
    unit = found.units[name]
    return shortened(name, 32) + (f" ({unit})" if unit != "1" else "")


def _subtitle(found: Swatches) -> str:
    nm = found.wavelengths_nm
    parts = [
        method_name(found.method),
        f"{counted(len(nm), 'wavelength')} from {nm.min():g} to {nm.max():g} nm",
        "CIE 1931 observer (2°), illuminant D65",
    ]
    return " · ".join(parts)


def _notes(found: Swatches, drawn: int) -> list[str]:
    """Return the notes on colours, noise and what is left out."""
    notes = [
        "Diffuse reflectance alone, without the light that the surface reflects; a white that "
        "returns all light is #ffffff. Linear between wavelengths, constant beyond them."
    ]
    noise = found.luminance_stderr[np.isfinite(found.luminance_stderr)]
    if noise.size and noise.max() > 0.0:
        notes.append(f"Standard error of the luminance Y: at most {noise.max():.2g} of a white's.")
    if found.outside:
        notes.append(f"{counted(found.outside, 'colour')} outside sRGB, drawn clipped.")
    notes += left_out_note(found.luminance_stderr.size - drawn, "swatch")
    if found.missing:
        notes.append("Crossed out: not all of the wavelengths are finished.")
    return notes
