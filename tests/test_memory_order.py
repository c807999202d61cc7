"""The same bits whatever order an array's values lie in: sums must not see rows as columns."""

import dataclasses

import numpy as np
import pytest
from reference_pixels import make_profile, one_over_r_profile

from sssfit.fit import METHODS, fit_svd
from sssfit.kernel import SeparableKernel
from sssfit.measure.asymmetry import asymmetry_by_radius, radial_asymmetry
from sssfit.measure.score import auto_exposure, measure
from sssfit.profile import full_kernel
from sssfit.render.reference import convolve, render_reference
from sssfit.render.screen import render_screen
from sssfit.render.separable import apply_passes, render_separable
from sssfit.render.transmittance import transmittance
from sssfit.scene.record import Scene
from sssfit.simulate import simulate_gaussians

SHAPE = (61, 47, 3)


def reordered(values):
    """The same values in other places of the memory: columns first, and every other of twice."""
    spread = np.zeros([2 * size for size in values.shape], values.dtype)
    every_other = spread[tuple(np.s_[::2] for _ in values.shape)]
    every_other[...] = values
    return np.asfortranarray(values), every_other, values[::-1].copy()[::-1]


def assert_alike(function, *arrays):
    """Call with every array as it is and with each of the others' order; all bits are equal."""
    expected = function(*map(np.ascontiguousarray, arrays))
    for changed in zip(*map(reordered, arrays), strict=True):
        for found, wanted in zip(
            np.atleast_1d(function(*changed)), np.atleast_1d(expected), strict=True
        ):
            np.testing.assert_array_equal(found, wanted)


@pytest.fixture(scope="module")
def picture():
    # Values of many sizes, so that no two orders of adding them round alike.
    return np.random.default_rng(3).lognormal(sigma=3.0, size=SHAPE)


@pytest.fixture(scope="module")
def profile():
    # Of what lies beyond the grid the picture's mean is sent back: a sum over all pixels.
    near = one_over_r_profile(60, 0.1, [0.4, 0.2, 0.7])
    return dataclasses.replace(near, beyond_grid=np.array((0.1, 0.05, 0.2)))


@pytest.fixture(scope="module")
def kernel(profile):
    return fit_svd(profile, rank=2, mm_per_pixel=0.3).kernel


def scene_of(irradiance, **more):
    return Scene("test", irradiance, 0.3, **more)


@pytest.mark.parametrize("border", ["mirror", "clamp", "zero"])
def test_the_true_picture(picture, profile, border):
    assert_alike(lambda each: render_reference(scene_of(each), profile, border=border), picture)


def test_convolution(picture, profile):
    quadrant = profile.quadrant_kernel(0.3, 9)
    assert_alike(convolve, picture, quadrant)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_passes(picture, kernel, dtype):
    assert_alike(lambda each: render_separable(scene_of(each), kernel, dtype=dtype), picture)
    assert_alike(apply_passes, picture.astype(dtype), kernel.weights, kernel.signs)


def test_screen_space(picture, kernel):
    rng = np.random.default_rng(4)
    depth, scale = rng.uniform(300.0, 303.0, SHAPE[:2]), rng.uniform(0.5, 2.0, SHAPE[:2])
    mask, specular = rng.integers(0, 3, SHAPE[:2]), rng.random(SHAPE)

    def render(irradiance, depth, scale, mask, specular):
        scene = scene_of(
            irradiance, distance_mm=300.0, depth_mm=depth, mask=mask, specular=specular
        )
        return render_screen(scene, kernel, scale=scale)

    assert_alike(render, picture, depth, scale, mask, specular)


def test_measures(picture):
    rng = np.random.default_rng(5)
    truth = picture * rng.uniform(0.9, 1.1, SHAPE)
    mask = rng.integers(0, 2, SHAPE[:2])
    whole = np.ones(SHAPE[:2])

    def figures(image, truth, mask):
        score = measure(image, truth, mask=mask)
        return np.hstack(
            [
                *(score.rmse, score.relative_l2, score.psnr_db, score.energy_drift, score.exposure),
                *(score.delta_e_2000_mean, score.delta_e_2000_p99, auto_exposure(truth, mask)),
            ]
        )

    assert_alike(figures, picture, truth, mask)
    assert_alike(figures, picture, truth, whole)


def test_structure(picture):
    pytest.importorskip("skimage")
    pytest.importorskip("flip_evaluator")
    truth = picture * np.random.default_rng(6).uniform(0.9, 1.1, SHAPE)

    def figures(image, truth):
        score = measure(image, truth, structure=True)
        return np.array((score.ssim, score.flip))

    assert_alike(figures, picture, truth)


def test_asymmetry(picture):
    square = picture[:47, :, 0]
    assert_alike(radial_asymmetry, square)
    assert_alike(asymmetry_by_radius, square)


def test_kernels(picture, kernel):
    half = picture[:, :20]
    weights = np.concatenate((half[:, :0:-1], half), axis=1)

    def figures(weights):
        signs = np.ones((SHAPE[0], 3))
        fields = {"relative_frobenius_error": np.zeros(3), "energy_error": np.zeros(3)}
        fields |= {"scale": np.ones(3), "parameters": {}, "meta": {}}
        made = SeparableKernel("by hand", 0.3, tuple("RGB"), signs, weights, **fields)
        return np.vstack((made.energy, made.line, made.full(1)[0, :, None] * np.ones(3)))

    assert_alike(figures, weights)


@pytest.mark.filterwarnings("ignore::sssfit.errors.SssfitWarning")
@pytest.mark.parametrize("method", METHODS)
def test_fits(method):
    energy = one_over_r_profile(30, 0.1, [0.4, 0.2, 0.7]).annulus_energy
    edges = 0.1 * np.arange(31)

    def weights(energy, edges):
        profile = make_profile(edges, energy)
        return METHODS[method].fit(profile, mm_per_pixel=0.3).kernel.weights

    assert_alike(weights, energy, edges)


def test_pixels_of_profiles(picture):
    def pixels(energy):
        profile = make_profile(0.1 * np.arange(SHAPE[1] + 1), energy)
        return full_kernel(profile.quadrant_kernel(0.13, 9)), profile.line_kernel(0.13)

    for part in (0, 1):
        assert_alike(lambda each, part=part: pixels(each)[part], picture[0])


def test_gaussians_and_transmittance(picture):
    variances, weights = 0.1 + picture[0, :40] / 1e3, picture[1, :40]
    weights = weights / weights.sum(axis=0)
    assert_alike(transmittance, picture[:, :, 0], variances, weights)
    assert_alike(
        lambda v, w: simulate_gaussians(v, w, name="test").annulus_energy,
        np.sort(variances[:, 0]),
        0.9 * weights,
    )
