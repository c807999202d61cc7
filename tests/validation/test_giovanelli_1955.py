"""A half space with a reflecting surface: all three solvers."""

import checks
import checks_layers
import pytest
from published import Published, check, what

from sssfit.simulate import simulate_exact

TITLE = "Giovanelli 1955"
SOURCE = (
    'R. G. Giovanelli, "Reflection by semi-infinite diffusers", *Optica Acta* 2, 1955; as quoted '
    "in Wang, Jacques and Zheng 1995, table 2"
)
CASE = "specular + diffuse, albedo 0.9, eta 1.5"


def exact_total():
    """Return the total of the exact solver."""
    profile = simulate_exact(checks.medium(1.0, 9.0, 1.5))
    return profile.specular_reflectance + profile.diffuse_reflectance[0]


FIGURES = [
    Published("total", f"{CASE}, exact solver", "0.2600", exact_total, within=1e-4),
    Published("total", f"{CASE}, 1e6 photons", "0.2600", lambda: checks.giovanelli(1_000_000)),
    Published(
        "total",
        f"{CASE}, layered walk, 3e5 photons",
        "0.2600",
        lambda: checks_layers.giovanelli(300_000),
    ),
]


@pytest.mark.parametrize("figure", FIGURES, ids=what)
def test_figure(figure):
    check(figure)


@pytest.mark.slow
@pytest.mark.parametrize(
    "walked", [lambda: checks.giovanelli(100_000_000), lambda: checks_layers.giovanelli(30_000_000)]
)
def test_total_of_a_long_walk(walked):
    figure = walked()
    assert abs(figure.sigmas) < checks.LIMIT, figure
