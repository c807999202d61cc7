"""Every kernel's pictures beside their differences, as a figure: `sheet_figure`.

``sssfit.compare.sheet`` computes the record.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sssfit.chart.page import (
    RC,
    check_drawn,
    draw_bar,
    drawable,
    new_mosaic,
    new_page,
    put_difference,
    put_picture,
)
from sssfit.chart.text import method_name, shortened, titled
from sssfit.messages import counted

if TYPE_CHECKING:
    from sssfit.compare.sheet import Sheet, SheetRow

AMPLIFIED = 10.0
# Size of a picture, 200 of the page's pixels; of a row of them.
_MOST_INCHES, _ROOM_INCHES = 1.0, 6.5
# Gap, in pictures; rows have figures between them.
_APART, _PAIRS_APART, _ROWS_APART = 0.03, 0.1, 0.22


def sheet_figure(sheet: Sheet) -> Figure:
    """Draw a contact sheet: a row for each kernel, picture and difference for each scene.

    Parameters
    ----------
    sheet : Sheet

    Returns
    -------
    matplotlib.figure.Figure
        8 inches wide; pictures in sRGB at the truth's exposure. Differences are in lightness (CIE
        L*), amplified ten times: red is too bright, blue too dark.

    Raises
    ------
    ArgumentError
        ``sheet`` is another record.
    """
    check_drawn(sheet, "Sheet")
    wide, tall = 2.0 + _APART + _PAIRS_APART, 1.0 + _ROWS_APART
    width, height = wide * len(sheet.scenes) - _PAIRS_APART, tall * len(sheet.rows)
    inches = min(_ROOM_INCHES / width, _MOST_INCHES)
    title = titled(sheet.profile, "what kernels show, and what each gets wrong")
    with new_page(2.2 + height * inches, title, _subtitle(sheet), _notes(sheet)) as (figure, below):
        axes = new_mosaic(below, width, height)
        for k, row in enumerate(sheet.rows):
            _draw_row(axes, row, tall * k, wide)
        middles = [1.0 + wide * k for k in range(len(sheet.scenes))]
        axes.set_xticks(middles, [drawable(each) for each in sheet.scenes], weight="bold")
        names = [drawable(_label(each)) for each in sheet.rows]
        axes.set_yticks([0.5 + tall * k for k in range(len(names))], names)
        draw_bar(below, axes, AMPLIFIED, "CIE L* less that of the true kernel")
    return figure


def _subtitle(sheet: Sheet) -> str:
    """Return text about the pictures and their differences."""
    meta = sheet.profile.meta
    side = sheet.pixels * sheet.mm_per_pixel
    parts = [
        method_name(meta.get("method", "unknown")),
        f"{sheet.pixels} x {sheet.pixels} pixels of {sheet.mm_per_pixel:.4g} mm, {side:.4g} mm",
        f"kernels {2 * sheet.support_mm:.3g} mm wide",
        f"sssfit {shortened(str(meta.get('version', '')))}",
    ]
    return (
        f"{' · '.join(parts)}\nright of each picture its difference of lightness, amplified "
        f"{AMPLIFIED:g} times; below, mean ΔE 2000"
    )


def _draw_row(axes: Axes, row: SheetRow, down: float, wide: float) -> None:
    """Draw one kernel's pictures and figures."""
    for k, panel in enumerate(row.panels):
        put_picture(axes, wide * k, down, panel.codes)
        put_difference(axes, wide * k + 1.0 + _APART, down, panel.difference, AMPLIFIED)
        error = panel.score.delta_e_2000_mean
        if row.passes is not None or error > 0.0:
            text = f"ΔE {error:#.3g}".rstrip(".")
            axes.text(wide * k, down + 1.02, text, va="top", size=RC["xtick.labelsize"])


def _label(row: SheetRow) -> str:
    """Split a label at its comma, and add the number of passes."""
    name = row.label.replace(", ", "\n")
    return name if row.passes is None else f"{name}\n{counted(row.passes, 'pass')}"


def _notes(sheet: Sheet) -> list[str]:
    """Return the notes on the rows."""
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
