"""Edits of the 2012 model in a row, as a figure: `editing_figure`.

``sssfit.compare.editing`` computes the record.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from sssfit.chart.page import new_page
from sssfit.chart.panels import draw_bar, new_mosaic, put_difference, put_picture

if TYPE_CHECKING:
    from sssfit.compare.editing import Editing

AMPLIFIED = 10.0
_TITLE = "Six-Gaussian skin: the 2012 model edited by hand"
_MOST_INCHES, _ROOM_INCHES = 1.8, 7.6  # size of a picture, of a row of them
_APART, _ROWS_APART = 0.05, 0.15  # gap, in pictures; rows have figures between them


def editing_figure(editing: Editing) -> Figure:
    """Draw the original and its edits, with the changes under each edit.

    Parameters
    ----------
    editing : Editing

    Returns
    -------
    matplotlib.figure.Figure
        8 inches wide; sRGB at one exposure, differences of lightness ten times amplified.
    """
    rows, columns = editing.edits[0].panel.difference.shape
    wide, tall = 1.0 + _APART, rows / columns + _ROWS_APART
    width, height = wide * len(editing.edits) - _APART, 2.0 * tall - _ROWS_APART
    inches = min(_ROOM_INCHES / width, _MOST_INCHES)
    tall_inches = 1.95 + height * inches
    with new_page(tall_inches, _TITLE, _subtitle(editing), _notes(editing)) as (figure, below):
        axes = new_mosaic(below, width, height)
        for k, edit in enumerate(editing.edits):
            put_picture(axes, wide * k, 0.0, edit.panel.codes)
            if k > 0:
                score = edit.panel.score
                words = f"ΔE {score.delta_e_2000_mean:.2f}, p99 {score.delta_e_2000_p99:.1f}"
                axes.text(wide * k, tall - 0.5 * _ROWS_APART, words, va="center")
                put_difference(axes, wide * k, tall, edit.panel.difference, AMPLIFIED)
        middles = [0.5 + wide * k for k in range(len(editing.edits))]
        axes.set_xticks(middles, [each.label for each in editing.edits], weight="bold")
        draw_bar(below, axes, AMPLIFIED, "CIE L* less the original's")
    return figure


def _subtitle(editing: Editing) -> str:
    """Return the title."""
    rows, columns = editing.edits[0].panel.difference.shape
    return (
        f"head, no texture · {columns} x {rows} pixels of {editing.mm_per_pixel:g} mm · sssfit "
        f"{editing.profile.meta.get('version')}\nbelow: difference of lightness to the original, "
        f"amplified {AMPLIFIED:g} times"
    )


def _notes(editing: Editing) -> list[str]:
    """Return the notes on the figures."""
    first, score = editing.edits[0].settings, editing.original_score
    strength, falloff = (
        " ".join(f"{value:g}" for value in first[key]) for key in ("strength", "falloff")
    )
    return [
        f"Original: width {first['width']:g}, strength {strength}, falloff {falloff} (R G B), "
        "table 1 of RR-02-12; edits as in its figure 6. Against the 2D kernel of the six "
        f"Gaussians the original has ΔE {score.delta_e_2000_mean:.2f}, p99 "
        f"{score.delta_e_2000_p99:.1f}."
    ]
