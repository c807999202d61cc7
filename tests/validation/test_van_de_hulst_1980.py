"""A slab with anisotropic scattering: the layered walk."""

import functools

import checks
import checks_layers
import pytest
from published import Published, check, what

TITLE = "van de Hulst 1980"
SOURCE = (
    "H. C. van de Hulst, *Multiple Light Scattering*, Academic Press, 1980; as quoted in Wang, "
    "Jacques and Zheng 1995, table 1"
)
CASE = "slab of optical thickness 2, albedo 0.9, g 0.75, index-matched"

slab = functools.cache(checks_layers.van_de_hulst)

FIGURES = [
    Published("total", f"R_d, {CASE}, 3e5 photons", "0.09739", lambda: slab(300_000)[0]),
    Published("total", f"T, {CASE}, 3e5 photons", "0.66096", lambda: slab(300_000)[1]),
]


@pytest.mark.parametrize("figure", FIGURES, ids=what)
def test_figure(figure):
    check(figure)


@pytest.mark.slow
def test_totals_of_a_long_walk():
    for figure in slab(30_000_000):
        assert abs(figure.sigmas) < checks.LIMIT, figure
