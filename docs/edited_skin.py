"""The 2012 model edited by hand: what its parameters do to a lit head.

The edits are those of figure 6 of Jimenez, Jarabo and Gutierrez 2012, "Separable Subsurface
Scattering", technical report RR-02-12, on the six-Gaussian skin of that report and without
texture. `compute_editing` makes the record and `editing_figure` draws it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from sssfit.arrays import plain
from sssfit.chart.page import draw_bar, new_mosaic, new_page, put_difference, put_picture
from sssfit.compare.pictures import Panel, make_panel
from sssfit.fit import fit_falloff
from sssfit.measure.score import COLOUR_FIGURES, ImageScore, auto_exposure, measure
from sssfit.profile import Profile
from sssfit.render.reference import render_reference
from sssfit.render.separable import render_separable
from sssfit.scene.made import make_scene
from sssfit.simulate import simulate_deon_skin

# The delta in the model is one pixel: docs/fits.md, on STRETCH, says why 0.5 mm.
MM_PER_PIXEL = 0.5
HEIGHT, WIDTH = 210, 165  # brows to mouth, with the shadow of the nose
SUPPORT_MM = 16.0  # three standard deviations of red at the larger width
TABLE_1: dict[str, Any] = {
    "width": 0.014,
    "strength": (0.78, 0.70, 0.75),
    "falloff": (0.57, 0.13, 0.08),
}
EDITS: dict[str, dict[str, Any]] = {
    "original": {},
    "width .025": {"width": 0.025},
    "strength 1 .71 .51": {"strength": (1.0, 0.71, 0.51)},
    "red falloff .5": {"falloff": (0.5, 0.13, 0.08)},
}


@dataclass(frozen=True, slots=True, eq=False)
class Edit:
    """The model with one parameter changed.

    Parameters
    ----------
    label : str
    settings : mapping
        width, strength and falloff.
    panel : Panel
        Compared with the original.
    """

    label: str
    settings: Mapping[str, Any]
    panel: Panel


@dataclass(frozen=True, slots=True, eq=False)
class Editing:
    """Edits of a model, the original first.

    Parameters
    ----------
    profile : Profile
    mm_per_pixel : float [mm]
    edits : tuple of Edit
    original_score : ImageScore
        Of the original against the profile's own 2D kernel.
    """

    profile: Profile
    mm_per_pixel: float
    edits: tuple[Edit, ...]
    original_score: ImageScore

    def to_dict(self) -> dict[str, Any]:
        """Return the Delta E of every edit to the original, and the original's own."""
        original = self.original_score
        return plain(
            {
                "mm_per_pixel": self.mm_per_pixel,
                **{f"original_{key}": getattr(original, key) for key in COLOUR_FIGURES},
                "rows": [
                    {
                        "label": each.label,
                        **each.settings,
                        **{key: getattr(each.panel.score, key) for key in COLOUR_FIGURES},
                    }
                    for each in self.edits
                ],
            }
        )


def compute_editing(
    *,
    mm_per_pixel: float = MM_PER_PIXEL,
    height: int = HEIGHT,
    width: int = WIDTH,
    threads: int | None = None,
) -> Editing:
    """Render the head with table 1's kernel and with each of the figure's edits.

    Parameters
    ----------
    mm_per_pixel : float [mm]
    height, width : int
        Pixels of the head.
    threads : int, optional

    Raises
    ------
    FitError, RenderError
        Invalid pixels.
    """
    profile = simulate_deon_skin()
    scene = make_scene("head", height=height, width=width, mm_per_pixel=mm_per_pixel)
    truth = render_reference(scene, profile, threads=threads)
    exposure = auto_exposure(truth, scene.mask)
    edits: list[Edit] = []
    pictures = []
    for label, change in EDITS.items():
        settings = TABLE_1 | change
        fitted = fit_falloff(profile, mm_per_pixel=mm_per_pixel, support_mm=SUPPORT_MM, **settings)
        rendered = render_separable(scene, fitted.kernel, threads=threads)
        pictures.append(np.asarray(rendered, dtype=np.float64))
        panel = make_panel(pictures[-1], pictures[0], exposure=exposure, mask=scene.mask)
        edits.append(Edit(label, settings, panel))
    score = measure(pictures[0], truth, exposure=exposure, mask=scene.mask)
    return Editing(profile, mm_per_pixel, tuple(edits), score)


AMPLIFIED = 10.0
_TITLE = "Six-Gaussian skin: the 2012 model edited by hand"
_MOST_INCHES, _ROOM_INCHES = 1.8, 7.6  # of a picture, of a row of them
_APART, _ROWS_APART = 0.05, 0.15  # of a picture; rows have figures between


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
    """Say what is shown."""
    rows, columns = editing.edits[0].panel.difference.shape
    return (
        f"head, no texture · {columns} x {rows} pixels of {editing.mm_per_pixel:g} mm · sssfit "
        f"{editing.profile.meta.get('version')}\nbelow: difference of lightness to the original, "
        f"amplified {AMPLIFIED:g} times"
    )


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
