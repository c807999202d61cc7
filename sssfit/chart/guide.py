"""The guide function beside the residual of the guided fit, as a figure: `guide_figure`.

``sssfit.compare.guide`` computes the record.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, SymLogNorm
from matplotlib.figure import Figure, SubFigure
from matplotlib.ticker import LogLocator, NullFormatter, NullLocator

from sssfit.arrays import FloatArray
from sssfit.chart.looks import METHODS
from sssfit.chart.page import (
    LINE_STYLES,
    LINE_WIDTH,
    Style,
    add_table,
    check_drawn,
    draw_plane,
    draw_steps,
    name_axes,
    new_page,
    signed_norm,
    tick_powers,
)
from sssfit.chart.text import channel_name, kernel_subtitle, shortened

if TYPE_CHECKING:
    from sssfit.compare.guide import Guide

_ROW_INCHES, _LINE_INCHES = 2.05, 0.165  # heights of panels, of the table
_WIDTHS = (1.0, 1.0, 1.75)  # widths of the columns, so that images fill theirs
_HEADS = (
    "",
    "middle pixel of the pass",
    "energy misplaced",
    "Frobenius error",
    "misfit weighted by Γ",
)
_GUIDE_DECADES = 3  # decades of the guide functions, below and above their value halfway out
_PASS_DECADES = 6
_DISTANCE = "distance from the middle (mm)"
_NOTE = (
    "Difference: a aᵀ less the 2D kernel, as a share of the channel's energy; red where the fit "
    "has too much light, blue where it has too little. Misplaced: half the sum of |difference|. "
    "Misfit: Γ difference² over Γ kernel², summed. Γ is drawn over its value on the diagonal "
    "halfway out; Γₚ = 1/(a(x) a(y)) of the pre-integrated pass has that pass for its best (S.8). "
    "The first step of a pass is its middle pixel."
)


class _Row(NamedTuple):
    """One row of panels; the pre-integrated row has no guided pass."""

    guide: str
    name: str
    gamma: FloatArray
    residual: FloatArray
    guided: FloatArray | None = None


def guide_figure(guide: Guide) -> Figure:
    """Draw guide function, residual and pass: pre-integrated first, then a row for each k.

    Parameters
    ----------
    guide : Guide

    Returns
    -------
    matplotlib.figure.Figure
        8 inches wide. Gamma, logarithmic, over its value on the diagonal halfway out, and the
        difference a a^T - R_d as a share of the channel's energy in each pixel, over mm: symmetric
        and logarithmic, one scale for all rows. a / sum(a) per mm over the distance from the
        middle, with the pre-integrated pass.

    Raises
    ------
    ArgumentError
        ``guide`` is another record.
    """
    check_drawn(guide, "Guide")
    rows = _rows(guide)
    where = kernel_subtitle(guide.profile, guide.pixels, guide.mm_per_pixel)
    height = 2.05 + (_LINE_INCHES + _ROW_INCHES) * len(rows)
    with new_page(height, _title(guide), where, [_NOTE]) as (figure, below):
        below = add_table(below, _HEADS, _table(guide))
        panels = below.subplots(
            len(rows), len(_WIDTHS), squeeze=False, sharex="col", width_ratios=_WIDTHS
        )
        shades = (
            LogNorm(10.0**-_GUIDE_DECADES, 10.0**_GUIDE_DECADES),
            signed_norm(np.stack([each.residual for each in rows])),
        )
        for row, line in zip(rows, panels, strict=True):
            _draw_row(line, guide, row, shades)
        for axes, name in zip(panels[-1], ("x (mm)", "x (mm)", _DISTANCE), strict=True):
            axes.set_xlabel(name)
        panels[1, 2].legend(loc="lower left", reverse=True)
        below.align_ylabels(panels[:, 2])
        _draw_bars(below, panels, shades)
    return figure


def _rows(guide: Guide) -> list[_Row]:
    """Return the rows: the pre-integrated pass with its Gamma_p, then the fits."""
    line = _Row("Γₚ", "pre-integrated", guide.preintegrated_gamma, guide.preintegrated_residual)
    fits = [
        _Row(f"Γ, k = {k:g}", f"k = {k:g}", guide.gamma[i], guide.residual[i], guide.passes[i])
        for i, k in enumerate(guide.ks)
    ]
    return [line, *fits]


def _table(guide: Guide) -> list[tuple[str, list[str]]]:
    """Return name and figures of each row."""
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
    panels: Sequence[Axes], guide: Guide, row: _Row, shades: tuple[LogNorm, SymLogNorm]
) -> None:
    """Draw a row's panels."""
    first, second, third = panels
    half_mm = 0.5 * guide.pixels * guide.mm_per_pixel
    draw_plane(first, _over_halfway(row.gamma), half_mm, shades[0], "cividis")
    draw_plane(second, -row.residual, half_mm, shades[1], "RdBu_r")
    _draw_pass(third, guide, row.guided)
    name_axes(first, f"guide function {row.guide}", "", "y (mm)")
    name_axes(second, f"difference, {row.name}", "", "")
    name_axes(third, f"pass, {row.name}", "", "share per mm")
    second.tick_params(labelleft=False)


def _over_halfway(gamma: FloatArray) -> FloatArray:
    """Return a guide function relative to its value on the diagonal halfway out."""
    diagonal = np.diagonal(gamma)[: gamma.shape[0] // 2 + 1]
    known = diagonal[np.isfinite(diagonal) & (diagonal > 0.0)]
    return gamma / known[-1] if known.size else gamma


def _draw_pass(axes: Axes, guide: Guide, guided: FloatArray | None) -> None:
    """Step from pixel to pixel; the middle one, from 0 to half a pixel, reaches the left edge."""
    pitch = guide.mm_per_pixel
    edges = pitch * (np.arange(guide.preintegrated.size + 1) - 0.5)
    edges[0] = 0.2 * pitch
    theirs, ours = METHODS["preintegrated"], METHODS["guided"]
    dashed: Style = {"color": theirs.colour, "ls": LINE_STYLES[1], "lw": LINE_WIDTH}
    values = guide.preintegrated / pitch
    draw_steps(axes, values, edges, snap=False, label=theirs.name, **dashed)
    if guided is not None:
        style: Style = {"color": ours.colour, "lw": 1.4, "label": ours.name}
        draw_steps(axes, guided / pitch, edges, snap=False, **style)
    axes.set_xscale("log")
    axes.set_yscale("log", nonpositive="clip")
    axes.set_xlim(edges[0], edges[-1])
    top = 2.0 * float(max(guide.passes.max(), guide.preintegrated[0])) / pitch
    axes.set_ylim(top * 10.0**-_PASS_DECADES, top)
    axes.yaxis.set_major_locator(LogLocator(numticks=5))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_minor_formatter(NullFormatter())


def _draw_bars(
    below: SubFigure, panels: npt.NDArray[Any], shades: tuple[LogNorm, SymLogNorm]
) -> None:
    """Draw the colour bars of both columns of images, under them."""
    place: Style = {"location": "bottom", "pad": 0.02, "aspect": 20}
    first = below.colorbar(ScalarMappable(shades[0], "cividis"), ax=panels[:, 0], **place)
    first.set_label("Γ over Γ halfway out")
    first.ax.xaxis.set_major_formatter("{x:g}")
    second = below.colorbar(ScalarMappable(shades[1], "RdBu_r"), ax=panels[:, 1], **place)
    second.set_label("share of the channel's\nenergy in a pixel")
    tick_powers(second, shades[1])


def _title(guide: Guide) -> str:
    """Return the title with material and channel."""
    material = guide.profile.material
    channel = channel_name(guide.profile.channels, guide.channel)
    what = "guide function and residual of the guided kernel"
    return f"{shortened(material.name, 24) + ', ' if material else ''}{channel}: {what}"
