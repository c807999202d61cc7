"""Edits of the 2012 model in a row, as a figure: `editing_figure`.

The record comes from ``sssfit.compare.editing``, which has computed everything.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from matplotlib.figure import Figure

from sssfit.chart.page import (
    LEFT,
    RIGHT,
    WIDTH_INCHES,
    chart_style,
    draw_footnotes,
    draw_text,
    new_figure,
)
from sssfit.chart.panels import draw_bar, draw_difference, draw_picture

if TYPE_CHECKING:
    from sssfit.compare.editing import Edit, Editing

AMPLIFIED = 10.0
_HEAD_INCHES = 1.12
_APART_INCHES = 0.12
_WORDS_INCHES = 0.24  # under a row of pictures
_FOOT_INCHES = 0.6
_MOST_INCHES = 1.65  # 330 of the page's pixels
_GREY = "#444444"


def editing_figure(editing: Editing) -> Figure:
    """Draw the original and its edits, and under each edit what it changed.

    Parameters
    ----------
    editing : Editing

    Returns
    -------
    matplotlib.figure.Figure
        8 inches wide; sRGB at one exposure, differences of lightness ten times amplified.
    """
    count = len(editing.edits)
    room = (RIGHT - LEFT) * WIDTH_INCHES - (count - 1) * _APART_INCHES
    inches = min(room / count, _MOST_INCHES)
    rows, columns = editing.edits[0].panel.difference.shape
    tall = inches * rows / columns
    second = _HEAD_INCHES + tall + _WORDS_INCHES
    with chart_style():
        figure = new_figure(second + tall + _FOOT_INCHES)
        _draw_head(figure, editing)
        for k, edit in enumerate(editing.edits):
            left = LEFT * WIDTH_INCHES + k * (inches + _APART_INCHES)
            _draw_edit(figure, edit, left, inches, is_original=k == 0)
            if k > 0:
                difference = edit.panel.difference
                draw_difference(figure, left, second, difference, inches, AMPLIFIED)
        bar = LEFT * WIDTH_INCHES + 0.1, second + 0.5 * tall
        draw_bar(figure, *bar, inches - 0.25, AMPLIFIED, "CIE L* less the original's")
        draw_footnotes(figure, _notes(editing))
    return figure


def _put(figure: Figure, down: float, text: str, left: float, **style: Any) -> None:
    """Write a line, left in inches."""
    draw_text(figure, down, text, left=left / WIDTH_INCHES, **style)


def _draw_head(figure: Figure, editing: Editing) -> None:
    """Title, provenance and what is shown."""
    title = "Six-Gaussian skin: the 2012 model edited by hand"
    draw_text(figure, 0.16, title, size=12, weight="bold")
    rows, columns = editing.edits[0].panel.difference.shape
    version = editing.profile.meta.get("version")
    pitch = f"{columns} x {rows} pixels of {editing.mm_per_pixel:g} mm"
    draw_text(figure, 0.41, f"head, no texture · {pitch} · sssfit {version}")
    below = f"below: difference of lightness to the original, amplified {AMPLIFIED:g} times"
    draw_text(figure, 0.64, below, color=_GREY)


def _draw_edit(
    figure: Figure, edit: Edit, left: float, inches: float, *, is_original: bool
) -> None:
    """Draw one edit's name and picture, and its distance from the original."""
    _put(figure, _HEAD_INCHES - 0.12, edit.label, left, weight="bold")
    draw_picture(figure, left, _HEAD_INCHES, edit.panel.codes, inches)
    tall = inches * edit.panel.difference.shape[0] / edit.panel.difference.shape[1]
    score = edit.panel.score
    if not is_original:
        words = f"ΔE {score.delta_e_2000_mean:.2f}, p99 {score.delta_e_2000_p99:.1f}"
        _put(figure, _HEAD_INCHES + tall + 0.12, words, left)


def _notes(editing: Editing) -> list[str]:
    """Say where the figures come from."""
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
