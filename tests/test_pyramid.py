"""The convolution pyramid: one filter on all levels, as Farbman's, and what it is held against."""

import numpy as np
import pytest
from scipy.ndimage import correlate1d

from sssfit import fit
from sssfit.errors import FitError
from sssfit.fit import fit_taps
from sssfit.material import load_material
from sssfit.render.taps import render_taps
from sssfit.scene.record import Scene
from sssfit.simulate import simulate_exact

PITCH = 0.3


@pytest.fixture(scope="module")
def skin1():
    return simulate_exact(load_material("skin1"))


@pytest.fixture(scope="module")
def fitted(skin1):
    return fit(skin1, "pyramid")


def test_all_levels_have_one_filter(fitted):
    assert fitted.structure == "1|1|1|1|1"
    first = fitted.stages[0]
    for stage in fitted.stages:
        texels = stage.offsets_mm / (PITCH * 2.0**stage.level)
        np.testing.assert_allclose(texels, first.offsets_mm / PITCH, rtol=1e-12)
        weights = np.tile(first.weights[:, :1], 3)
        np.testing.assert_allclose(stage.weights, weights, rtol=1e-12)
    assert np.ptp(fitted.blend / fitted.energy, axis=1).max() > 0.01  # the blend is a channel's own


def test_the_energy_is_exact_and_nothing_is_negative(skin1, fitted):
    np.testing.assert_allclose(fitted.energy, skin1.diffuse_reflectance, rtol=1e-9)
    assert (fitted.blend >= 0.0).all()
    assert all((each.weights >= 0.0).all() for each in fitted.stages)
    assert fitted.method == "pyramid"


def filtered(picture, line):
    return correlate1d(correlate1d(picture, line, axis=0), line, axis=1)


def enlarged(picture):
    """Zeros between texels, filtered by h2 = (1, 3, 3, 1) / 4."""
    for axis in (0, 1):
        ends = [(1, 1) if k == axis else (0, 0) for k in (0, 1)]
        padded = np.pad(picture, ends, mode="symmetric")
        between = np.zeros([2 * n if k == axis else n for k, n in enumerate(padded.shape)])
        between[(slice(None), slice(1, None, 2)) if axis else slice(1, None, 2)] = padded
        wide = correlate1d(between, [0.25, 0.75, 0.75, 0.25], axis=axis)
        picture = wide.take(np.arange(3, 2 * picture.shape[axis] + 3), axis)
    return picture


def test_it_is_a_convolution_pyramid(fitted):
    """Analysis by g and the mean of four, synthesis by h2 and g with the level's weight."""
    line = fitted.stages[0].pass_weights(PITCH)[:, 0]
    picture = np.random.default_rng(2).random((64, 96))
    shown = render_taps(Scene("noise", np.tile(picture[..., None], 3), PITCH), fitted)
    for c in range(3):
        level, levels = picture, []
        for weight in fitted.blend[1:, c]:
            g = filtered(level, line)
            levels.append(weight * g)
            level = g.reshape(g.shape[0] // 2, 2, g.shape[1] // 2, 2).mean(axis=(1, 3))
        total = levels.pop()
        while levels:
            total = levels.pop() + enlarged(total)
        total += fitted.blend[0, c] * picture
        np.testing.assert_allclose(shown[..., c], total, rtol=0, atol=1e-12)


def test_more_levels_reach_farther_and_a_pair_has_five_texels_at_once(skin1, fitted):
    """Farbman's h1 has five taps: one bilinear pair beside the middle, at 1 to 2 texels."""
    assert 1.0 < fitted.stages[0].offsets_mm[0] / PITCH < 2.0
    short = fit(skin1, "pyramid", stages="1|1|1")
    assert (short.errors["spectral"] > 5 * fitted.errors["spectral"]).all()


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"stages": "1|x"}, "stages = '1|x'; expected numbers of tap pairs"),
        ({"stages": "1|2"}, "stages = '1|2'; expected the same number of tap pairs in each"),
        ({"stages": "*|*"}, "expected the same number of tap pairs in each"),
        ({"spectrum": "pink"}, "spectrum = 'pink'; expected 'natural' or 'white'"),
    ],
)
def test_bad_settings_are_one_line(skin1, settings, said):
    with pytest.raises(FitError) as caught:
        fit_taps(skin1, "pyramid", **settings)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)
