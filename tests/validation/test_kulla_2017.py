"""Van de Hulst's formula, inverted: the albedo of a colour."""

import functools

import numpy as np
import pytest
from published import Published, check, what

from sssfit.simulate.inversion import published_inversions, van_de_hulst_albedo

TITLE = "Kulla and Conty 2017"
SOURCE = (
    'C. Kulla, A. Conty, "Revisiting physically based shading at Imageworks", SIGGRAPH courses '
    "2017; coefficients as in OpenPBR 1.1"
)
FORMULA = "s = 4.09712 + 4.20863 C - sqrt(9.59217 + 41.6808 C + 17.7126 C^2)"
# R / (1 - R_sp) of 0.44, 0.23 and 0.13 and the printed formula, by hand; under diffuse light R is
# that share already.
ALBEDOS = {"normal": "0.883040 0.669708 0.470580", "diffuse": "0.878312 0.663546 0.464995"}


@functools.cache
def skin_albedos(light):
    """Return the albedos of three reflectances at eta 1.3."""
    return published_inversions([0.44, 0.23, 0.13], 1.3, light=light)["van_de_hulst"].albedo


FIGURES = [
    Published(
        FORMULA,
        f"albedos of R = 0.44, 0.23, 0.13 under {light} light, eta 1.3",
        printed,
        lambda e=light: skin_albedos(e),
    )
    for light, printed in ALBEDOS.items()
]


@pytest.mark.parametrize("figure", FIGURES, ids=what)
def test_figure(figure):
    check(figure)


@pytest.mark.parametrize("g", [0.0, 0.8])
def test_the_inverse_undoes_van_de_hulsts_formula(g):
    albedo = np.array([0.0, 0.1, 0.5, 0.9, 0.99, 0.9999, 1.0])
    s = np.sqrt((1 - albedo) / (1 - albedo * g))
    colour = (1 - s) * (1 - 0.139 * s) / (1 + 1.17 * s)
    # The published coefficients have six digits.
    np.testing.assert_allclose(van_de_hulst_albedo(colour, g), albedo, atol=5e-5)
