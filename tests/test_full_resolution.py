"""Cascades with nothing halved: the mean over places, and what halving adds in an error budget."""

import itertools

import numpy as np
import pytest
from reference_pixels import make_profile

from sssfit.errors import RenderError
from sssfit.fit import fit_taps
from sssfit.fit.on_taps import on_taps
from sssfit.fit.preintegrated import fit_preintegrated
from sssfit.render.full_resolution import render_full_resolution
from sssfit.render.taps import render_taps
from sssfit.scene.record import Scene


@pytest.fixture(scope="module")
def profile():
    edges = np.arange(61) * 0.1
    light = np.exp(-edges[:-1, None] / [0.4, 0.9]) * (edges[:-1, None] + 0.05)
    return make_profile(edges, 0.4 * light / light.sum(axis=0))


def point(size, row, column):
    light = np.zeros((size, size, 1))
    light[row, column] = 1.0
    return Scene("a point", light, 0.5)


@pytest.mark.parametrize("stages", ["1-2", "1|1", "*|*", "1|*-1", "1|1|1"])
def test_it_is_the_mean_over_places_of_what_is_rendered(profile, stages):
    taps = fit_taps(profile, stages=stages, mm_per_pixel=0.5).kernel
    size, period = 160, 2 ** taps.stages[-1].level
    middle = size // 2
    mean = np.zeros((size, size, 2))
    for dy, dx in itertools.product(range(period), repeat=2):
        shown = render_taps(point(size, middle + dy, middle + dx), taps)
        mean += np.roll(shown, (-dy, -dx), axis=(0, 1)) / period**2
    found = render_full_resolution(point(size, middle, middle), taps)
    # A point between pixels has its mirror image half a pixel off; far inside there is none.
    inside = slice(period, size - period)
    np.testing.assert_allclose(found[inside, inside], mean[inside, inside], rtol=0, atol=1e-12)


def test_without_halvings_it_is_what_is_rendered(profile):
    taps = fit_taps(profile, stages="1-1", mm_per_pixel=0.5).kernel
    light = np.random.default_rng(1).uniform(size=(23, 40, 1))
    scene = Scene("noise", light, 0.5)
    np.testing.assert_allclose(
        render_full_resolution(scene, taps), render_taps(scene, taps), rtol=0, atol=1e-12
    )


def test_other_tables_have_nothing_halved(profile):
    dense = fit_preintegrated(profile, mm_per_pixel=0.5).kernel
    with pytest.raises(RenderError, match="only a cascade has halved pictures"):
        render_full_resolution(point(8, 4, 4), on_taps(dense, 3))
