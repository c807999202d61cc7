"""The three fits of the shape of normalised diffusion."""

import numpy as np
import pytest
from published import Published, check, what

from sssfit import shapes

TITLE = "Christensen and Burley 2015"
SOURCE = (
    'P. H. Christensen, B. Burley, "Approximate reflectance profiles for efficient subsurface '
    'scattering", Pixar technical memo 15-04, 2015'
)
# Values of the printed polynomials, by hand.
VALUES = [
    ("s = 1.85 - A + 7 |A - 0.8|^3", "perpendicular", shapes.s_perpendicular, 0.3, "2.425"),
    ("s = 1.85 - A + 7 |A - 0.8|^3", "perpendicular", shapes.s_perpendicular, 1.0, "0.906"),
    ("s = 1.9 - A + 3.5 (A - 0.8)^2", "diffuse", shapes.s_diffuse, 0.3, "2.475"),
    ("s = 3.5 + 100 (A - 0.33)^4", "diffuse-mfp", shapes.s_diffuse_mean_free_path, 0.33, "3.5"),
    ("s = 3.5 + 100 (A - 0.33)^4", "diffuse-mfp", shapes.s_diffuse_mean_free_path, 0.83, "9.75"),
]

FIGURES = [
    Published(formula, f"{mapping}, A = {a:g}", printed, lambda f=function, a=a: f(a), within=1e-12)
    for formula, mapping, function, a, printed in VALUES
]


@pytest.mark.parametrize("figure", FIGURES, ids=what)
def test_figure(figure):
    check(figure)


def test_mappings_take_arrays():
    found = shapes.s_diffuse_mean_free_path([0.33, 1.33])
    np.testing.assert_array_equal(found, [3.5, 103.5])
