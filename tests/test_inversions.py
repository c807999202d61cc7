"""The renderers' formula from a colour to an albedo, beside the exact solver, and its chart."""

import numpy as np
import pytest
from figures import assert_legible, legends_of, words_of

from sssfit.chart import figure_of
from sssfit.compare.inversions import compute_inversions
from sssfit.simulate.inversion import reflectance_of

COLOURS = [0.05, 0.2, 0.44, 0.8, 0.95]


@pytest.fixture(scope="module")
def curves():
    return compute_inversions(COLOURS)


def test_the_formula_has_the_published_albedos(curves):
    published = [0.218489, 0.613357, 0.878312, 0.990589, 0.999505]
    np.testing.assert_allclose(curves.formula, published, atol=5e-7)


def test_exact_albedos_have_their_colours(curves):
    for eta, albedo in zip(curves.etas, curves.exact, strict=True):
        np.testing.assert_allclose(reflectance_of(albedo, eta, "diffuse"), COLOURS, atol=1e-7)


def test_the_formula_is_right_without_an_interface_and_dark_behind_one(curves):
    np.testing.assert_allclose(curves.seen[0], COLOURS, rtol=0.04, atol=1e-3)
    assert (curves.seen[1:] < np.array(COLOURS)).all()
    assert (curves.seen[2] < curves.seen[1]).all()
    assert (curves.exact[1:] > curves.formula).all()


def test_colours_of_normal_light_are_shares_of_what_enters():
    normal = compute_inversions(COLOURS, etas=[1.4], light="normal")
    diffuse = compute_inversions(COLOURS, etas=[1.4])
    assert (normal.seen < diffuse.seen).all()
    assert normal.to_dict()["light"] == "normal"


def test_the_chart_is_legible_and_names_every_curve():
    figure = assert_legible(lambda: figure_of(compute_inversions()))
    (legend,) = legends_of(figure)
    said = [each.get_text() for each in legend.get_texts()]
    assert said == ["Kulla and Conty", "exact, eta 1", "exact, eta 1.4", "exact, eta 1.5"]
    assert "light from all directions" in words_of(figure)
