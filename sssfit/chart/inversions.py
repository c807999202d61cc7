"""From a colour to an albedo as a figure: `inversions_figure`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from sssfit.chart.page import (
    COLOURS,
    LINE_STYLES,
    Style,
    add_legend,
    check_drawn,
    name_axes,
    new_page,
    tick,
    tick_decades,
)

if TYPE_CHECKING:
    from sssfit.compare.inversions import InversionCurves

_HEIGHT_INCHES = 4.1
_FORMULA: Style = {"color": "#000000", "linestyle": LINE_STYLES[0], "lw": 1.6}
_NOTES = (
    "Kulla and Conty 2017: albedo = 1 - s^2, s = 4.09712 + 4.20863 C - sqrt(9.59217 + 41.6808 C + "
    "17.7126 C^2), for every index. Exact: the albedo of the half space that returns the share C "
    "of the light that enters.",
)


def inversions_figure(curves: InversionCurves) -> Figure:
    """Draw 1 - albedo against the colour, and the colour that the formula's albedos have.

    Parameters
    ----------
    curves : InversionCurves
        Up to three indices.

    Returns
    -------
    matplotlib.figure.Figure
        8 inches wide; 1 - albedo is the share that a collision absorbs.

    Raises
    ------
    ArgumentError
        ``curves`` is another record.
    """
    check_drawn(curves, "InversionCurves")
    title = "From a colour to an albedo: the renderers' formula and the exact solver"
    lit = {"normal": "light along the normal", "diffuse": "light from all directions"}
    subtitle = f"half space, isotropic scattering, {lit[curves.light]}"
    with new_page(_HEIGHT_INCHES, title, subtitle, _NOTES) as (figure, below):
        styles = [_style(k) for k in range(len(curves.etas))]
        handles = [Line2D([], [], **each) for each in (_FORMULA, *styles)]
        labels = ["Kulla and Conty", *(f"exact, eta {eta:g}" for eta in curves.etas)]
        below = add_legend(below, handles, labels)
        absorbed, seen = below.subplots(1, 2)
        absorbed.set_yscale("log")
        absorbed.plot(curves.colour, 1.0 - curves.formula, **_FORMULA)
        for k, style in enumerate(styles):
            absorbed.plot(curves.colour, 1.0 - curves.exact[k], **style)
            seen.plot(curves.colour, curves.seen[k] - curves.colour, **style)
        seen.plot(curves.colour, 0.0 * curves.colour, **{**_FORMULA, "lw": 0.8})
        tick_decades(absorbed.yaxis, 8)
        absorbed.yaxis.set_major_formatter("{x:g}")
        for axes in (absorbed, seen):
            axes.set_xlim(0.0, 1.0)
            tick(axes.xaxis)
        tick(seen.yaxis)
        name_axes(absorbed, "(a) absorbed by a collision", "colour C", "1 - albedo")
        name_axes(seen, "(b) error of the formula's colour", "colour C asked for", "C seen - C")
    return figure


def _style(k: int) -> Style:
    return {"color": COLOURS[k], "linestyle": LINE_STYLES[k + 1], "lw": 1.3}
