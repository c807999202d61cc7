"""The tables that separable-sss ships, by its own algorithm."""

import numpy as np
import pytest
from published import Published, check, what

from sssfit.export.presets.separable import FALLOFF, STRENGTH
from sssfit.kernel.listing import listing

TITLE = "Jimenez and Gutierrez 2012"
SOURCE = (
    'J. Jimenez, D. Gutierrez, "Separable subsurface scattering", source of the demo, 2012, '
    "SeparableSSS.h"
)
# Weights of red, green and blue, and the offset, of the first three taps.
TABLES = {
    25: (
        "0.530605 0.613514 0.739601 0.000000",
        "0.0211412 0.0459286 0.0378196 0.0208333",
        "0.0402784 0.0657244 0.0463100 0.0833333",
    ),
    17: (
        "0.536343 0.624624 0.748867 0.000000",
        "0.0324462 0.0656718 0.0532821 0.0312500",
        "0.0582416 0.0659959 0.0411329 0.1250000",
    ),
    11: (
        "0.560479 0.669086 0.784728 0.000000",
        "0.0771802 0.1134910 0.0793803 0.0800000",
        "0.0821904 0.0358608 0.0209261 0.3200000",
    ),
}
PLACES = ("the centre", "the next tap", "the one after it")


def row(taps, k):
    """Return the weights and the offset of a tap from the middle outwards."""
    offsets, weights = listing(taps, np.array(STRENGTH), np.array(FALLOFF))
    return [*weights[k], 0.0 if k == 0 else offsets[k - 1]]


FIGURES = [
    Published(
        "SeparableSSS.h, SSSS_QUALITY",
        f"{taps} taps, {PLACES[k]}: weights of R, G, B, offset",
        printed,
        lambda taps=taps, k=k: row(taps, k),
        within=6e-7,  # six significant digits
    )
    for taps, table in TABLES.items()
    for k, printed in enumerate(table)
]


@pytest.mark.parametrize("figure", FIGURES, ids=what)
def test_figure(figure):
    check(figure)
