"""Every kernel's pictures beside their differences, as a figure: `sheet_figure`.

The record comes from ``sssfit.compare.sheet``, which has computed everything.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from matplotlib.figure import Figure

from sssfit.chart.page import (
    WIDTH_INCHES,
    Style,
    chart_style,
    draw_footnotes,
    draw_text,
    new_figure,
)
from sssfit.chart.panels import draw_bar, draw_difference, draw_picture
from sssfit.chart.text import method_name, shortened

if TYPE_CHECKING:
    from sssfit.compare.sheet import Sheet, SheetRow

AMPLIFIED = 10.0
_MOST_INCHES = 1.0  # a picture: 200 of the page's pixels
_HEAD_INCHES = 0.98
_LABEL_INCHES = 1.15  # a row's name, right of the margin
_ROW_GAP_INCHES = 0.2  # holds the figures under the pictures
_APART_INCHES, _PAIR_APART_INCHES = 0.03, 0.1
_FOOT_INCHES = 1.16
_LEFT_INCHES = 0.2
_GREY = "#444444"


def sheet_figure(sheet: Sheet) -> Figure:
    """Draw a contact sheet: a row for each kernel, picture and difference for each scene.

    Parameters
    ----------
    sheet : Sheet

    Returns
    -------
    matplotlib.figure.Figure
        8 inches wide; pictures in sRGB at the truth's exposure. Differences are of lightness
        (CIE L*), ten times amplified: red is too bright, blue too dark.
    """
    first = _LEFT_INCHES + _LABEL_INCHES
    room = WIDTH_INCHES - 0.14 - first
    gaps = len(sheet.scenes) * _APART_INCHES + (len(sheet.scenes) - 1) * _PAIR_APART_INCHES
    inches = min((room - gaps) / (2 * len(sheet.scenes)), _MOST_INCHES)
    step = inches + _ROW_GAP_INCHES
    with chart_style():
        figure = new_figure(_HEAD_INCHES + step * len(sheet.rows) + _FOOT_INCHES)
        _draw_head(figure, sheet)
        lefts = [
            first + k * (2 * inches + _APART_INCHES + _PAIR_APART_INCHES)
            for k in range(len(sheet.scenes))
        ]
        for scene, left in zip(sheet.scenes, lefts, strict=True):
            _put(figure, _HEAD_INCHES - 0.1, scene, left, weight="bold")
        for k, row in enumerate(sheet.rows):
            _draw_row(figure, row, _HEAD_INCHES + step * k, lefts, inches)
        bar = "CIE L* less that of the true kernel"
        below = _HEAD_INCHES + step * len(sheet.rows) + 0.06
        draw_bar(figure, first, below, 3.0, AMPLIFIED, bar)
        draw_footnotes(figure, _notes(sheet))
    return figure


def _put(figure: Figure, down: float, text: str, left: float = _LEFT_INCHES, **style: Any) -> None:
    """Write a line, left in inches."""
    draw_text(figure, down, text, left=left / WIDTH_INCHES, **style)


def _draw_head(figure: Figure, sheet: Sheet) -> None:
    """Title and provenance."""
    name = sheet.profile.material_name
    what = "what kernels show, and what each gets wrong"
    title = f"{shortened(name, 24)}: {what}" if name else what.capitalize()
    draw_text(figure, 0.16, title, size=12, weight="bold", left=_LEFT_INCHES / WIDTH_INCHES)
    meta = sheet.profile.meta
    side = sheet.pixels * sheet.mm_per_pixel
    parts = [
        method_name(meta.get("method", "unknown")),
        f"{sheet.pixels} x {sheet.pixels} pixels of {sheet.mm_per_pixel:.4g} mm, {side:.4g} mm",
        f"kernels {2 * sheet.support_mm:.3g} mm wide",
        f"sssfit {shortened(str(meta.get('version', '')))}",
    ]
    _put(figure, 0.41, " · ".join(parts))
    words = f"right of each picture its difference of lightness, amplified {AMPLIFIED:g} times; "
    words += "below, mean Delta E 2000"
    _put(figure, 0.64, words, color=_GREY)


def _draw_row(
    figure: Figure, row: SheetRow, down: float, lefts: list[float], inches: float
) -> None:
    """Draw one kernel's name, price, pictures and figures."""
    for k, words in enumerate(_label(row)):
        style: Style = {"color": _GREY} if k else {}
        _put(figure, down + 0.1 + 0.15 * k, words, **style)
    for left, panel in zip(lefts, row.panels, strict=True):
        draw_picture(figure, left, down, panel.codes, inches)
        right = left + inches + _APART_INCHES
        draw_difference(figure, right, down, panel.difference, inches, AMPLIFIED)
        figures = f"ΔE {panel.score.delta_e_2000_mean:.3g}"
        if row.passes is not None or panel.score.delta_e_2000_mean > 0.0:
            _put(figure, down + inches + 0.08, figures, left)


def _label(row: SheetRow) -> list[str]:
    """Split a label at its comma, and say how many passes there are."""
    name, _, rest = row.label.partition(", ")
    lines = [name, rest] if rest else [name]
    return [*lines, f"{row.passes} passes"] if row.passes is not None else lines


def _notes(sheet: Sheet) -> list[str]:
    """Say what is drawn."""
    values = [
        f"{name} {' '.join(f'{each:g}' for each in sheet.production[key])}"
        for name, key in (("near", "near_mm2"), ("far", "far_mm2"))
    ]
    weight = " ".join(f"{each:g}" for each in sheet.production["weight"])
    return [
        "SVD is rescaled to the profile's energy. Each picture is exposed as its truth: 99 % of it "
        f"below 0.8. Of disk and edge, what is within {sheet.support_mm:.3g} mm of light or border "
        f"counts. Production: {', '.join(values)} mm², weight {weight}, by hand: the fit's "
        "narrowest near for all channels, twice its far.",
    ]
