"""The surface's reflectance of diffuse light from outside, in closed form."""

import pytest
import reference
from published import Published, check, what

from sssfit.simulate.half_space import entering_light

TITLE = "Duntley 1942"
SOURCE = (
    'S. Q. Duntley, "The optical properties of diffusing materials", *Journal of the Optical '
    "Society of America* 32, 1942"
)

FIGURES = [
    Published(
        "closed form of R_sp under diffuse light",
        f"eta {eta:g}",
        f"{reference.duntley_specular(eta):.10f}",
        lambda n=eta: 1.0 - entering_light(n, "diffuse"),
        within=1e-10,
    )
    for eta in (1.001, 1.1, 1.3, 1.5, 2.0, 4.0)
]


@pytest.mark.parametrize("figure", FIGURES, ids=what)
def test_figure(figure):
    check(figure)
