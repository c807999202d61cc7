"""The grid of the supplement's simulations."""

import pytest
from published import Published, check, what

from sssfit.grid import paper_grid
from sssfit.material import load_material

TITLE = "Jimenez et al. 2015"
SOURCE = (
    'J. Jimenez et al., "Separable subsurface scattering", *Computer Graphics Forum* 34, 2015, '
    "with its supplement"
)
RULE = "supplement F, dr = min(MFP) / 20, radius = 32 max(MFP)"
# dr [mm] and the number of annuli by hand: 640 max(MFP) / min(MFP), rounded up.
GRIDS = {
    "skin1": "0.033557 1236",  # 640 * 1.49 / 0.772 = 1235.2
    "chicken1": "0.087719 2211",
    "ketchup": "0.033784 3931",  # 640 * 1.48 / 0.241 = 3930.3
    "marble": "0.016627 878",
}


def grid(name):
    """Return dr [mm] and the number of annuli of a shipped material."""
    found = paper_grid(load_material(name))
    return [found.dr_mm, found.annuli]


FIGURES = [
    Published(RULE, f"{name}: dr (mm), annuli", printed, lambda n=name: grid(n))
    for name, printed in GRIDS.items()
]


@pytest.mark.parametrize("figure", FIGURES, ids=what)
def test_figure(figure):
    check(figure)


@pytest.mark.parametrize(
    ("name", "extinction"),
    [("skin1", 1.49), ("chicken1", 0.57), ("ketchup", 1.48), ("marble", 3.0071)],
)
def test_rings_are_a_twentieth_of_the_shortest_mean_free_path(name, extinction):
    assert grid(name)[0] == pytest.approx(1.0 / extinction / 20.0, rel=1e-12)
