"""Kernels thinned to taps: energy, second moment, what is rendered, and what it costs."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from reference_taps import rendered

from sssfit.errors import FitError, SssfitWarning
from sssfit.fit import fit_result, make_target
from sssfit.fit._fitted_taps import _Terms
from sssfit.fit._spectrum import spectral_target
from sssfit.fit.on_taps import on_taps
from sssfit.material import load_material
from sssfit.render.separable import render_separable
from sssfit.render.taps import render_taps
from sssfit.scene.record import Scene
from sssfit.simulate import simulate_exact

PLACES = ("cumulative", "quadratic")
KERNELS = {
    "preintegrated": {},
    "svd": {"rank": 3},
    "svd kept": {"rank": 2, "energy": "keep"},
    "artist": {},
    "guided": {"k": 1.0},
    "gaussians": {"terms": 3},
    "falloff": {},
    "weighted": {"rank": 2},
}


@pytest.fixture(scope="module")
def skin1():
    return simulate_exact(load_material("skin1"))


@pytest.fixture(scope="module")
def dense(skin1):
    settings = {"mm_per_pixel": 0.6, "support_mm": 13.8}
    with warnings.catch_warnings():  # of misfits and of the pitch, which do not matter here
        warnings.simplefilter("ignore", SssfitWarning)
        return {
            name: fit_result(skin1, name.split()[0], **settings, **own).kernel
            for name, own in KERNELS.items()
        }


def moments(kernel):
    """Energy and second moment [pixels^2] of each term's pass (T, C), from dense passes."""
    x = np.arange(kernel.pixels) - kernel.half_pixels
    return kernel.weights.sum(axis=1), np.einsum("p,tpc->tc", x**2.0, kernel.weights)


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("name", KERNELS)
def test_every_term_keeps_its_energy_and_second_moment(dense, name, place):
    kernel = dense[name]
    for count in (3, 7, 25, kernel.pixels):
        taps = on_taps(kernel, count, place=place)
        again = taps.separable_kernel()
        assert len(taps.stages) == kernel.rank
        for found, wanted in zip(moments(again), moments(kernel), strict=True):
            np.testing.assert_allclose(np.abs(found), np.abs(wanted), rtol=1e-11, atol=1e-13)
        np.testing.assert_allclose(taps.energy, kernel.energy, rtol=1e-12)
        np.testing.assert_array_equal(taps.errors["energy"], kernel.energy_error)
        assert taps.fetches == (kernel.rank + 1) * count
        assert taps.passes == kernel.rank + 1
        assert len({tuple(each.offsets_mm) for each in taps.stages}) == 1


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("name", KERNELS)
def test_with_a_tap_for_every_pixel_it_is_the_dense_kernel(dense, name, place):
    kernel = dense[name]
    taps = on_taps(kernel, kernel.pixels, place=place)
    np.testing.assert_allclose(
        taps.stages[0].offsets_mm, 0.6 * np.arange(1, kernel.half_pixels + 1), rtol=1e-12
    )
    light = Scene("light", np.random.default_rng(1).random((40, 31, 1)), 0.6)
    wanted = render_separable(light, kernel)
    np.testing.assert_allclose(render_taps(light, taps), wanted, rtol=1e-11, atol=1e-13)


@pytest.mark.parametrize("name", ["preintegrated", "svd"])
def test_few_taps_are_rendered_as_a_shader_fetches_them(dense, name):
    taps = on_taps(dense[name], 7)
    light = np.random.default_rng(1).random((12, 9, 1))
    wanted = np.stack([rendered(light[:, :, 0], taps, c, 0.6) for c in range(3)], axis=2)
    found = render_taps(Scene("light", light, 0.6), taps)
    np.testing.assert_allclose(found, wanted, rtol=1e-12)
    dense_of_taps = render_separable(Scene("light", light, 0.6), taps.separable_kernel())
    np.testing.assert_allclose(found, dense_of_taps, rtol=1e-11)


@pytest.mark.parametrize("place", PLACES)
def test_taps_are_a_texel_apart_and_reach_the_end(dense, place):
    kernel = dense["svd"]
    for count in (3, 5, 11, 25, 41, kernel.pixels):
        pixels = on_taps(kernel, count, place=place).stages[0].offsets_mm / 0.6
        assert np.diff(pixels, prepend=0.0).min() >= 1.0 - 1e-12
        assert pixels[-1] == pytest.approx(kernel.half_pixels, rel=1e-12)


def test_more_taps_come_nearer(skin1, dense):
    """Of a kernel that was fitted under the same spectrum; others may gain by being thinned."""
    errors = [
        on_taps(dense["weighted"], count, profile=skin1).errors["spectral"]
        for count in (5, 11, 25, dense["weighted"].pixels)
    ]
    assert (np.diff(errors, axis=0) < 0.0).all()


def test_the_spectral_error_is_that_of_the_2d_kernel(skin1, dense):
    kernel = dense["svd"]
    taps = on_taps(kernel, 11, profile=skin1)
    wanted = spectral_target(make_target(skin1, 0.6, 13.8), [0, 1, 2], "natural")
    again = taps.separable_kernel()
    x = np.arange(again.pixels) - again.half_pixels
    cosines = np.cos(np.outer(wanted.frequencies, x))
    for c in range(3):
        apart = cosines @ again.full(c) @ cosines.T - wanted.wanted[c]
        error = np.sqrt(np.sum(wanted.power[c] * apart**2))
        assert taps.errors["spectral"][c] == pytest.approx(error, rel=1e-9)
    assert np.isnan(on_taps(kernel, 5).errors["spectral"]).all()


@pytest.mark.parametrize("name", KERNELS)
def test_fitted_taps_are_better_than_both_starts_and_keep_the_energy(skin1, dense, name):
    """The sum of squares over the channels is what is minimised."""
    kernel = dense[name]
    errors = {
        place: np.sum(on_taps(kernel, 9, place=place, profile=skin1).errors["spectral"] ** 2)
        for place in (*PLACES, "fitted")
    }
    assert errors["fitted"] < 0.999 * min(errors[place] for place in PLACES)
    taps = on_taps(kernel, 9, place="fitted", profile=skin1)
    np.testing.assert_allclose(taps.energy, kernel.energy, rtol=1e-9)
    np.testing.assert_array_equal(taps.blend[0], 0.0)
    assert taps.fetches == (kernel.rank + 1) * 9
    assert taps.stages[0].offsets_mm[-1] < 1.05 * kernel.half_pixels * 0.6


def test_the_gradient_of_fitted_taps_is_that_of_differences(skin1, dense):
    kernel = dense["svd"]
    rng = np.random.default_rng(2)
    terms = _Terms(
        spectral_target(make_target(skin1, 0.6, 13.8), [0, 1, 2], "natural"),
        kernel.signs,
        kernel.energy,
    )
    for last in (20.3, 24.6):  # within the kernel of 23 pixels, and beyond
        offsets = np.array([1.3, 3.7, 8.2, last])
        half = kernel.weights[:, kernel.half_pixels :][:, [0, 1, 4, 8, 20]].transpose(0, 2, 1)
        x = np.concatenate((np.log(np.diff(offsets, prepend=0.0)), 2.0 * half.ravel()))
        x += rng.normal(0.0, 1e-3, x.size)
        _, gradient = terms.misfit(x, 4)
        for along in rng.normal(size=(5, x.size)):
            step = 1e-5 * along
            difference = terms.misfit(x + step, 4)[0] - terms.misfit(x - step, 4)[0]
            assert difference / 2e-5 == pytest.approx(gradient @ along, rel=1e-5)


def test_fitted_taps_of_a_normalised_kernel_are_those_of_the_plain_one(skin1):
    settings = {"mm_per_pixel": 0.6, "support_mm": 13.8, "rank": 2}
    plain, unit = (
        fit_result(skin1, "svd", normalize=each, taps=9, place="fitted", **settings).kernel
        for each in (False, True)
    )
    np.testing.assert_allclose(unit.energy, plain.energy, rtol=1e-9)
    np.testing.assert_allclose(unit.errors["spectral"], plain.errors["spectral"], rtol=1e-3)


def test_a_channel_without_light_stays_black_where_taps_are_fitted(skin1):
    energy = skin1.annulus_energy * [1.0, 0.0, 1.0]
    dark = replace(skin1, annulus_energy=energy, beyond_grid=skin1.beyond_grid * [1, 0, 1])
    taps = fit_result(dark, "svd", taps=9, place="fitted", mm_per_pixel=0.6).kernel
    assert (taps.blend[:, 1] == 0.0).all()
    np.testing.assert_allclose(taps.energy, dark.diffuse_reflectance, rtol=1e-9)


def test_a_normalised_kernel_keeps_its_energy(skin1):
    settings = {"mm_per_pixel": 0.6, "support_mm": 13.8, "rank": 2}
    plain = fit_result(skin1, "svd", **settings).kernel
    unit = fit_result(skin1, "svd", normalize=True, **settings).kernel
    np.testing.assert_allclose(on_taps(unit, 9).energy, on_taps(plain, 9).energy, rtol=1e-12)


def test_settings_and_origin_are_kept(dense):
    taps = on_taps(dense["svd"], 9, place="quadratic")
    assert taps.method == "svd"
    assert taps.meta["material"] == "skin1"
    assert taps.meta["profile_sha256"] == dense["svd"].meta["profile_sha256"]
    assert taps.meta["settings"]["rank"] == 3
    assert (taps.meta["settings"]["taps"], taps.meta["settings"]["place"]) == (9, "quadratic")


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"taps": 8}, "taps = 8; expected an odd number from 3 to 129"),
        ({"taps": 1}, "taps = 1; expected an odd number"),
        ({"taps": 131}, "taps = 131; expected an odd number"),
        ({"taps": 9.0}, "taps = 9.0; expected an odd number"),
        ({"taps": 49}, "taps = 49 for a kernel of 47 pixels; expected at most as many"),
        ({"taps": 9, "place": "fitted"}, 'place = "fitted" needs the profile'),
        (
            {"taps": 9, "place": "even"},
            "place = 'even'; expected 'cumulative' or 'quadratic' or 'fitted'",
        ),
    ],
)
def test_what_cannot_be_thinned_is_refused(dense, given, message):
    with pytest.raises(FitError) as caught:
        on_taps(dense["svd"], **given)
    assert message in str(caught.value)
