"""The albedo inversion that a renderer uses for a surface's base colour."""

import numpy as np
import pytest
from published import Published, check, what

from sssfit.simulate.inversion import chiang_albedo, published_inversions

TITLE = "Chiang, Kutz and Burley 2016"
SOURCE = (
    'M. J.-Y. Chiang, P. Kutz, B. Burley, "Practical and controllable subsurface scattering for '
    'production path tracing", SIGGRAPH talks 2016'
)
FORMULA = "albedo = 1 - exp(-5.09406 A + 2.61188 A^2 - 4.31805 A^3)"
# The printed polynomial, by hand.
ALBEDOS = {0.0: "0.000000", 0.13: "0.466114", 0.23: "0.662437", 0.44: "0.877978"}

FIGURES = [
    Published(FORMULA, f"A = {a:g}", printed, lambda a=a: chiang_albedo(np.array([a])))
    for a, printed in ALBEDOS.items()
]


@pytest.mark.parametrize("figure", FIGURES, ids=what)
def test_figure(figure):
    check(figure)


@pytest.mark.parametrize("light", ["normal", "diffuse"])
def test_the_polynomial_takes_the_reflectance_under_any_light(light):
    a = np.array([0.44, 0.23, 0.13])
    expected = 1 - np.exp(-5.09406 * a + 2.61188 * a**2 - 4.31805 * a**3)
    np.testing.assert_allclose(chiang_albedo(a), expected, atol=1e-15)
    found = published_inversions(a, 1.3, light=light)
    np.testing.assert_allclose(found["chiang2016"].albedo, expected, atol=1e-15)
    np.testing.assert_allclose(chiang_albedo(np.array([0.0, 1.0])), [0.0, 1 - np.exp(-6.80023)])
