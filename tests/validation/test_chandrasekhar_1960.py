"""Totals of an index-matched half space: the exact solver and the walk against the H function."""

import checks
import pytest
import reference
from published import Published, check, what

from sssfit.simulate.half_space import diffuse_reflectance

TITLE = "Chandrasekhar 1960"
SOURCE = "S. Chandrasekhar, *Radiative Transfer*, Dover, 1960"
PLACE = "chapter V, 1 - sqrt(1 - albedo) H(1)"
TOTALS = {0.5: "0.11523", 0.9: "0.41495", 0.99: "0.75272"}

FIGURES = [
    figure
    for albedo, printed in TOTALS.items()
    for figure in (
        Published(
            PLACE,
            f"total at albedo {albedo:g}, exact solver",
            printed,
            lambda a=albedo: diffuse_reflectance([a], 1.0),
        ),
        Published(
            PLACE,
            f"total at albedo {albedo:g}, 1e6 photons",
            printed,
            lambda a=albedo: checks.chandrasekhar(a, 1_000_000),
        ),
    )
]


@pytest.mark.parametrize("figure", FIGURES, ids=what)
def test_figure(figure):
    check(figure)


@pytest.mark.parametrize("albedo", TOTALS)
def test_the_reference_of_the_tests_has_the_same_digits(albedo):
    assert reference.chandrasekhar_total(albedo) == pytest.approx(float(TOTALS[albedo]), abs=5e-6)


@pytest.mark.slow
@pytest.mark.parametrize("albedo", TOTALS)
def test_total_of_a_long_walk(albedo):
    figure = checks.chandrasekhar(albedo, 100_000_000)
    assert abs(figure.sigmas) < checks.LIMIT, figure
