"""Errors of engines' own diffusion, as a figure: `presets_figure`.

``sssfit.compare.presets`` computes the record.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from sssfit.chart.page import COLOURS, Style, add_legend, name_axes, new_page, tick_decades

if TYPE_CHECKING:
    from sssfit.compare.presets import PresetComparison

_HEIGHT_INCHES, _ROW_INCHES = 1.7, 0.26
_MARKERS = "os^Dv<>P*X"
_LEAST = 1e-2  # what is drawn at the left edge: an engine that takes the medium has no error
_NOTE = (
    "Delta E 2000, 95th percentile over the pixels of each picture, of the engine's own diffusion "
    "model with the exported parameters against the exact 2D kernel. Engines that take the medium "
    "itself have the exact profile by construction and lie at the left edge. 1 is about the least "
    "difference that is seen side by side."
)


def presets_figure(found: PresetComparison) -> Figure:
    """Draw the error of every preset on every picture, the best preset at the top.

    Parameters
    ----------
    found : PresetComparison

    Returns
    -------
    matplotlib.figure.Figure
        8 inches wide; a row takes .26 inches.
    """
    names = [each.parameters.preset.name for each in found.rows]
    height = _HEIGHT_INCHES + _ROW_INCHES * len(names)
    where = f"{found.material}, pixels of {found.mm_per_pixel:g} mm"
    with new_page(height, "What engines show of a material", where, [_NOTE]) as (figure, below):
        styles: list[Style] = [
            {"color": COLOURS[k % len(COLOURS)], "marker": _MARKERS[k % len(_MARKERS)], "ls": ""}
            for k in range(len(found.pictures))
        ]
        below = add_legend(below, [Line2D([], [], **each) for each in styles], found.pictures)
        axes = below.subplots()
        places = np.arange(len(names))
        for k, style in enumerate(styles):
            errors = np.maximum([each.p95[k] for each in found.rows], _LEAST)
            axes.plot(errors, places, markersize=4.5, **style)
        axes.axvline(1.0, color="#666666", lw=0.6)
        axes.set_xscale("log")
        tick_decades(axes.xaxis, 6)
        name_axes(axes, "", "Delta E 2000, 95th percentile", "")
        axes.set_yticks(places, names)
        axes.set_ylim(len(names) - 0.5, -0.5)
    return figure
