"""The chain of Gaussians: it is their sum, and nearer to the profile where more of it is fitted."""

import math
from dataclasses import replace

import numpy as np
import pytest
from reference_pixels import one_over_r_profile
from scipy.ndimage import convolve1d
from scipy.special import ive

from sssfit import fit
from sssfit.errors import FitError
from sssfit.fit import fit_gaussians, fit_taps, make_target
from sssfit.fit._tied_chain import gaussian_weights
from sssfit.fit.cascade import lit_channels
from sssfit.fit.gaussian_chain import shared_gaussians
from sssfit.kernel import Stage, Taps
from sssfit.material import load_material
from sssfit.render.taps import render_taps
from sssfit.scene.record import Scene
from sssfit.shapes import SKIN_VARIANCES_MM2, SKIN_WEIGHTS
from sssfit.simulate import simulate_deon_skin, simulate_exact

PITCH = 0.3


@pytest.fixture(scope="module")
def skin1():
    return simulate_exact(load_material("skin1"))


@pytest.fixture(scope="module")
def published(skin1):
    return fit_taps(skin1, "gaussian-chain", blur="published").kernel


# The chain of six Gaussians is their sum


def discrete_gaussian(variance, half):
    """Lindeberg's Gaussian on texels, whose variances add up exactly: e^-t I_n(t)."""
    return ive(np.abs(np.arange(-half, half + 1)), variance)


def test_a_chain_of_gaussians_is_the_sum_of_six():
    """Each blurs the one before by the difference of variances: d'Eon's skin, to 1e-12."""
    variances = np.array(SKIN_VARIANCES_MM2) / PITCH**2
    blend = np.concatenate((np.zeros((1, 3)), np.array(SKIN_WEIGHTS)))
    stages = []
    for added in np.diff(variances, prepend=0.0):
        line = discrete_gaussian(added, 64)[64:]
        weights = line / (line[0] + 2.0 * line[1:].sum())
        stages.append(Stage(0, "pair", PITCH * np.arange(1, 65), np.tile(weights[:, None], 3)))
    none = np.full(3, np.nan)
    errors = {"spectral": none, "energy": none}
    chain = Taps("test", PITCH, ("R", "G", "B"), True, tuple(stages), blend, errors, {})
    picture = np.random.default_rng(1).random((90, 70, 3))
    shown = render_taps(Scene("noise", picture, PITCH), chain)
    total = np.zeros_like(picture)
    for variance, weights in zip(variances, np.array(SKIN_WEIGHTS), strict=True):
        line = discrete_gaussian(variance, 110)
        once = convolve1d(picture, line, axis=0, mode="reflect")
        total += weights * convolve1d(once, line, axis=1, mode="reflect")
    np.testing.assert_allclose(shown, total, rtol=0, atol=1e-12)


def test_shares_of_a_gaussian_are_the_published_weights():
    """GPU Gems 3, listing 14-1: .006, .061, .242, .383, .242, .061, .006."""
    np.testing.assert_allclose(gaussian_weights(3), [0.383, 0.242, 0.061, 0.006], atol=5e-4)
    for pairs in (1, 2, 5):
        weights = gaussian_weights(pairs)
        assert weights[0] + 2.0 * weights[1:].sum() == pytest.approx(1.0, rel=1e-14)


def test_variances_of_the_stages_are_differences_of_the_fitted_ones(skin1, published):
    target = make_target(skin1, PITCH, 30.0)
    variances, weights, _ = shared_gaussians(target, lit_channels(target), 6)
    np.testing.assert_allclose(published.blend[1:], weights, rtol=1e-9, atol=1e-300)
    assert (published.blend[0] == 0.0).all()
    assert published.fetches == 6 * 14 + 5  # six pictures, the last one is still at hand
    summed = np.zeros(3)
    for stage, wanted in zip(published.stages, variances, strict=True):
        line = stage.pass_weights(PITCH)
        place = np.arange(len(line)) - len(line) // 2
        summed += PITCH**2 * place**2 @ line
        np.testing.assert_allclose(summed, wanted, rtol=1e-9)


def test_the_energy_is_exact_and_nothing_is_negative(skin1, published):
    for taps in (published, fit(skin1, "gaussian-chain", stages="1|1")):
        np.testing.assert_allclose(taps.energy, skin1.diffuse_reflectance, rtol=1e-9)
        assert (taps.blend >= 0.0).all()
        assert all((each.weights >= 0.0).all() for each in taps.stages)
        assert taps.method == "gaussian-chain"


# Gaussians that channels share


def test_the_gaussians_of_skin_are_found_again():
    """Its six variances serve all channels; on a fine grid they leave hardly anything."""
    skin = simulate_deon_skin()
    target = make_target(skin, 0.02, 10.0)
    variances, weights, _ = shared_gaussians(target, lit_channels(target), 6)
    np.testing.assert_allclose(variances, SKIN_VARIANCES_MM2, rtol=2e-2)
    np.testing.assert_allclose(weights, SKIN_WEIGHTS, atol=5e-3)


def test_of_one_channel_they_are_the_sum_of_gaussians():
    profile = one_over_r_profile(100, 0.1, [0.4])
    target = make_target(profile, 0.3, 9.0)
    variances, weights, _ = shared_gaussians(target, [0], 3)
    with pytest.warns(match="steep near the beam"):
        own = fit_gaussians(profile, terms=3, mm_per_pixel=0.3, support_mm=9.0)
    (found,) = own.kernel.parameters.values()
    np.testing.assert_allclose(variances, found["variances_mm2"], rtol=1e-6)
    np.testing.assert_allclose(weights[:, 0], found["weights"], rtol=1e-6)


# What is fitted


def test_stages_have_one_shape_and_their_own_widths(skin1):
    taps = fit(skin1, "gaussian-chain", stages="3-3|3")
    ratios = [each.offsets_mm / each.offsets_mm[0] for each in taps.stages]
    np.testing.assert_allclose(ratios, np.tile(ratios[0], (3, 1)), rtol=1e-12)
    for stage in taps.stages:
        weights = np.tile(taps.stages[0].weights[:, :1], 3)
        np.testing.assert_allclose(stage.weights, weights, rtol=1e-12)


def test_more_that_is_fitted_is_nearer(skin1, published):
    """In the sum that is minimised; on pictures see docs/cascades.md."""
    found = [published, *(fit(skin1, "gaussian-chain", blur=each) for each in ("widths", "shape"))]
    misfits = [float((each.errors["spectral"] ** 2).sum()) for each in found]
    assert misfits[0] > 20 * misfits[1]  # 1.5e-3 against 3e-5 from one start, and 3e-6
    assert misfits[1] > 1.2 * misfits[2]
    for stage in found[1].stages:
        steps = np.diff(stage.offsets_mm, prepend=0.0)
        np.testing.assert_allclose(steps, steps[0], rtol=1e-12)
        np.testing.assert_allclose(stage.weights, np.tile(gaussian_weights(3)[:, None], 3))


def test_the_same_seed_gives_the_same_bits(skin1):
    first, again = (fit(skin1, "gaussian-chain", stages="1|1", seed=3) for _ in range(2))
    assert first.blend.tobytes() == again.blend.tobytes()
    assert first.blend.tobytes() != fit(skin1, "gaussian-chain", stages="1|1").blend.tobytes()


def test_a_channel_without_light_stays_black(skin1):
    energy = skin1.annulus_energy * [1, 0, 1]
    dark = replace(skin1, annulus_energy=energy, beyond_grid=skin1.beyond_grid * [1, 0, 1])
    for blur in ("published", "shape"):
        taps = fit(dark, "gaussian-chain", stages="1-1", blur=blur)
        assert (taps.blend[:, 1] == 0.0).all()
        np.testing.assert_allclose(taps.energy, dark.diffuse_reflectance, rtol=1e-9)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"stages": "3-x"}, "stages = '3-x'; expected numbers of tap pairs"),
        ({"stages": "3-2"}, "stages = '3-2'; expected the same number of tap pairs in each"),
        ({"stages": "*-*"}, "expected the same number of tap pairs in each"),
        ({"blur": "box"}, "blur = 'box'; expected 'published' or 'widths' or 'shape'."),
        ({"stages": "3|3", "blur": "published"}, "the published chain has no halved pictures"),
        ({"mm_per_pixel": math.nan}, "mm_per_pixel = nan"),
    ],
)
def test_bad_settings_are_one_line(skin1, settings, said):
    with pytest.raises(FitError) as caught:
        fit_taps(skin1, "gaussian-chain", **settings)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)
