"""The guide function beside what the guided fit leaves, as a figure: `guide_figure`.

The record comes from ``sssfit.compare.guide``, which has computed everything.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, SymLogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from sssfit.arrays import FloatArray
from sssfit.chart.page import (
    COLOURS,
    LEFT,
    LINE_WIDTH,
    RIGHT,
    WIDTH_INCHES,
    Style,
    chart_style,
    draw_footnotes,
    draw_text,
    name_axes,
    new_figure,
)
from sssfit.chart.panels import draw_plane, place_panel, signed_norm, tick_powers
from sssfit.chart.text import kernel_subtitle, shortened

if TYPE_CHECKING:
    from sssfit.compare.guide import Guide

_IMAGE_INCHES = 1.62  # a square
_ROW_INCHES = _IMAGE_INCHES + 0.33
_SECOND = LEFT * WIDTH_INCHES + _IMAGE_INCHES + 0.32  # from the left edge: the residual
_THIRD = _SECOND + _IMAGE_INCHES + 0.72  # the pass
_BAR_INCHES = 0.09
_BAR_DOWN = 0.2  # under the last row: room for the name of x
_BAR_WIDER = 0.46  # the residual's, whose numbers are long
_FOOT_INCHES = 1.05  # under the bars: their numbers and names, and three lines of notes
_TABLE_INCHES = 0.165
_COLUMNS = (0.25, 0.44, 0.61, 0.80)  # of the width: the table's figures
_HEADS = ("middle pixel of the pass", "energy misplaced", "Frobenius error", "misfit weighted by Γ")
_GUIDE_DECADES = 3  # of the guide functions, below and above their value halfway out
_PASS_DECADES = 6
_GREY = "#666666"
_NOTE = (
    "Residual: 2D kernel less a aᵀ, as a share of the channel's energy; red where the fit has too "
    "little light, blue where it has too much. Misplaced: half the sum of |residual|. Misfit: "
    "Γ residual² over Γ kernel², summed. Γ is drawn over its value on the diagonal halfway out; "
    "Γₚ = 1/(a(x) a(y)) of the pre-integrated pass has that pass for its best (S.8). The first "
    "step of a pass is its middle pixel."
)


class _Row(NamedTuple):
    """One line of panels; no guided pass beside the pre-integrated one in its own."""

    guide: str
    name: str
    gamma: FloatArray
    residual: FloatArray
    guided: FloatArray | None = None


def guide_figure(guide: Guide) -> Figure:
    """Draw guide function, what is left, and the pass: pre-integrated first, then a row for each k.

    Parameters
    ----------
    guide : Guide

    Returns
    -------
    matplotlib.figure.Figure
        8 inches wide. Gamma, logarithmic, over its value on the diagonal halfway out, and the
        residual R_d - a a^T as a share of the channel's energy in each pixel, over mm: symmetric
        and logarithmic, one scale for all rows. a / sum(a) per mm over the distance from the
        middle, with the pre-integrated pass.
    """
    rows = _rows(guide)
    head = 0.95 + _TABLE_INCHES * len(rows) + 0.12
    height = head + _ROW_INCHES * len(rows) + _BAR_DOWN + _FOOT_INCHES
    with chart_style():
        figure = new_figure(height)
        _draw_head(figure, guide)
        draw_footnotes(figure, [_NOTE])
        shades = (
            LogNorm(10.0**-_GUIDE_DECADES, 10.0**_GUIDE_DECADES),
            signed_norm(np.stack([each.residual for each in rows])),
        )
        for i, row in enumerate(rows):
            place = head + _ROW_INCHES * i, i == 1, i == len(rows) - 1
            _draw_row(figure, guide, row, place, shades)
        below = head + _ROW_INCHES * len(rows) + _BAR_DOWN
        _draw_bars(figure, below, shades)
    return figure


def _draw_head(figure: Figure, guide: Guide) -> None:
    """Title, provenance and a table: a line for each k."""
    draw_text(figure, 0.16, _title(guide), size=12, weight="bold")
    draw_text(figure, 0.41, kernel_subtitle(guide.profile, guide.pixels, guide.mm_per_pixel))
    down = 0.68
    grey: Style = {"color": "#444444", "size": 8}
    for left, head in zip(_COLUMNS, _HEADS, strict=True):
        draw_text(figure, down, head, left=left, **grey)
    for name, figures in _table(guide):
        down += _TABLE_INCHES
        draw_text(figure, down, name)
        for left, each in zip(_COLUMNS, figures, strict=True):
            draw_text(figure, down, each, left=left, size=8)


def _rows(guide: Guide) -> list[_Row]:
    """Return what is drawn: the pre-integrated pass with its Gamma_p, then the fits."""
    line = _Row("Γₚ", "pre-integrated", guide.preintegrated_gamma, guide.preintegrated_residual)
    fits = [
        _Row(f"Γ, k = {k:g}", f"k = {k:g}", guide.gamma[i], guide.residual[i], guide.passes[i])
        for i, k in enumerate(guide.ks)
    ]
    return [line, *fits]


def _table(guide: Guide) -> list[tuple[str, list[str]]]:
    """Name and figures of each line."""
    line = guide.preintegrated[0], guide.preintegrated_misplaced, *guide.preintegrated_errors
    columns = (
        guide.centre_share,
        guide.misplaced,
        guide.relative_frobenius_error,
        guide.weighted_residual,
    )
    figures = [("pre-integrated", line)]
    figures += [(f"k = {k:g}", tuple(e[i] for e in columns)) for i, k in enumerate(guide.ks)]
    return [(name, [f"{100.0 * each:.1f} %" for each in row]) for name, row in figures]


def _draw_row(
    figure: Figure,
    guide: Guide,
    row: _Row,
    place: tuple[float, bool, bool],
    shades: tuple[LogNorm, SymLogNorm],
) -> None:
    """Draw a row's panels; ``place`` is inches down the page, whether with the legend, the last."""
    down, is_keyed, is_last = place
    x_label = "x (mm)" if is_last else ""
    lefts, square = (LEFT * WIDTH_INCHES, _SECOND), (_IMAGE_INCHES, _IMAGE_INCHES)
    first, second = (place_panel(figure, left, down, *square) for left in lefts)
    third = place_panel(figure, _THIRD, down, RIGHT * WIDTH_INCHES - _THIRD, _IMAGE_INCHES)
    half_mm = 0.5 * guide.pixels * guide.mm_per_pixel
    draw_plane(first, _over_halfway(row.gamma), half_mm, shades[0], "cividis")
    draw_plane(second, row.residual, half_mm, shades[1], "RdBu_r")
    _draw_pass(third, guide, row.guided)
    if is_keyed:
        third.legend(loc="lower left", fontsize=7.5, reverse=True)
    name_axes(first, f"guide function {row.guide}", x_label, "y (mm)")
    name_axes(second, f"residual, {row.name}", x_label, "")
    name_axes(third, f"pass, {row.name}", "distance from the middle (mm)" if is_last else "", "")
    third.set_ylabel("share per mm")
    third.yaxis.set_label_coords(-0.16, 0.5)  # the same in all rows
    second.tick_params(labelleft=False)
    for each in (first, second, third):
        each.tick_params(labelbottom=is_last)


def _over_halfway(gamma: FloatArray) -> FloatArray:
    """Return a guide function over its value on the diagonal halfway out, where it has one."""
    diagonal = np.diagonal(gamma)[: gamma.shape[0] // 2 + 1]
    known = diagonal[np.isfinite(diagonal) & (diagonal > 0.0)]
    return gamma / known[-1] if known.size else gamma


def _draw_pass(axes: Axes, guide: Guide, guided: FloatArray | None) -> None:
    """Step from pixel to pixel; the middle one, from 0 to half a pixel, reaches the left edge."""
    pitch = guide.mm_per_pixel
    edges = pitch * (np.arange(guide.preintegrated.size + 1) - 0.5)
    edges[0] = 0.2 * pitch
    line: Style = {"baseline": None, "snap": False}
    axes.stairs(
        guide.preintegrated / pitch,
        edges,
        color=_GREY,
        ls=(0, (4, 1.6)),
        lw=LINE_WIDTH,
        label="pre-integrated",
        **line,
    )
    if guided is not None:
        axes.stairs(guided / pitch, edges, color=COLOURS[2], lw=1.4, label="guided", **line)
    axes.set_xscale("log")
    axes.set_yscale("log", nonpositive="clip")
    axes.set_xlim(edges[0], edges[-1])
    top = 2.0 * float(max(guide.passes.max(), guide.preintegrated[0])) / pitch
    axes.set_ylim(top * 10.0**-_PASS_DECADES, top)
    axes.yaxis.set_major_locator(LogLocator(numticks=5))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_minor_formatter(NullFormatter())


def _draw_bars(figure: Figure, down: float, shades: tuple[LogNorm, SymLogNorm]) -> None:
    """Explain the colours of both columns of images, under them."""
    height = figure.get_figheight()
    bottom, tall = 1 - (down + _BAR_INCHES) / height, _BAR_INCHES / height
    lefts = LEFT, _SECOND / WIDTH_INCHES
    wide, wider = (_IMAGE_INCHES + each for each in (0.0, _BAR_WIDER))
    for norm, shown, left, width, name in (
        (shades[0], "cividis", lefts[0], wide, "Γ over Γ halfway out"),
        (shades[1], "RdBu_r", lefts[1], wider, "energy per pixel, of the channel's"),
    ):
        cax = figure.add_axes((left, bottom, width / WIDTH_INCHES, tall))
        bar = figure.colorbar(ScalarMappable(norm, shown), cax=cax, orientation="horizontal")
        bar.set_label(name)
        bar.ax.xaxis.set_major_formatter("{x:g}")
        if isinstance(norm, SymLogNorm):
            tick_powers(bar, norm)


def _title(guide: Guide) -> str:
    """Name the material and the channel."""
    material = guide.profile.material
    channel = shortened(guide.profile.channels[guide.channel])
    what = "guide function and residual of the guided kernel"
    return f"{shortened(material.name, 24) + ', ' if material else ''}{channel}: {what}"
