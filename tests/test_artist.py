"""The two-Gaussian kernel: refits what it is made of, takes what is set by hand."""

import time

import numpy as np
import pytest
from reference_pixels import make_profile
from scipy.integrate import quad
from scipy.optimize import check_grad

from sssfit.errors import FitError
from sssfit.fit import fit_artist, fit_preintegrated, make_target
from sssfit.fit._by_hand import gaussian_pixels, kernel_misfit, line_misfit, normalised
from sssfit.fit.artist import fit_two_gaussians, two_gaussians
from sssfit.material import load_material
from sssfit.shapes import gaussian_cdf, gaussian_marginal
from sssfit.simulate import simulate_exact


def profile_of(variances, weights, energy=0.4, dr_mm=0.002, radius_mm=8.0):
    """A profile that is a sum of Gaussians of the plane."""
    edges = np.linspace(0, radius_mm, round(radius_mm / dr_mm) + 1)
    within = energy * gaussian_cdf(edges[:, None], np.array(variances)) @ np.array(weights)
    return make_profile(
        edges, np.diff(within)[:, None], beyond_grid=np.array([energy * sum(weights) - within[-1]])
    )


@pytest.fixture(scope="module")
def skin1():
    return simulate_exact(load_material("skin1"))


def test_gaussians_over_pixels_are_integrals():
    edges = 0.3 * (np.arange(12) - 0.5)
    sigmas = np.array((0.05, 0.7))
    energy, slope = gaussian_pixels(edges, sigmas)
    for i, sigma in enumerate(sigmas):
        for j in range(11):
            integral, _ = quad(
                gaussian_marginal, edges[j], edges[j + 1], args=(sigma**2,), points=[0]
            )
            assert energy[i, j] == pytest.approx(integral, abs=1e-10)
    wider, _ = gaussian_pixels(edges, sigmas * np.exp(1e-6))
    narrower, _ = gaussian_pixels(edges, sigmas * np.exp(-1e-6))
    np.testing.assert_allclose(slope, (wider - narrower) / 2e-6, atol=1e-9)


@pytest.mark.parametrize("kind", ["line", "kernel"])
def test_gradients_are_those_of_finite_differences(kind):
    edges, rng = 0.2 * (np.arange(10) - 0.5), np.random.default_rng(3)
    copies = np.where(np.arange(9) == 0, 1.0, 2.0)
    square = rng.random((9, 9))
    misfit, wanted = {
        "line": (line_misfit, rng.random(9)),
        "kernel": (kernel_misfit, square + square.T),
    }[kind]

    def function(x, part):
        half, slopes = normalised(*two_gaussians(edges, x))
        value, gradient = misfit(half, wanted, copies)
        return value if part == 0 else slopes @ gradient

    x = np.array((0.3, -2.0, 0.4))
    error = check_grad(lambda y: function(y, 0), lambda y: function(y, 1), x, epsilon=1e-7)
    assert error < 1e-5 * np.linalg.norm(function(x, 1))


CERTIFIED = [(0.05, 1.0, 0.4), (0.2, 0.6, 0.7), (0.03, 2.0, 0.9)]


@pytest.mark.parametrize(("near", "far", "weight"), CERTIFIED)
def test_a_line_of_two_gaussians_refits(near, far, weight):
    edges = 0.1 * (np.arange(62) - 0.5)
    copies = np.where(np.arange(61) == 0, 1.0, 2.0)
    x = np.array((weight, np.log(near), np.log(far)))
    line, _ = normalised(*two_gaussians(edges, x))
    found = fit_two_gaussians(edges, lambda half: line_misfit(half, line, copies))
    np.testing.assert_allclose(found.x, x, atol=1e-7)
    assert found.value < 1e-16


@pytest.mark.parametrize(("near", "far", "weight"), CERTIFIED)
def test_a_profile_of_two_gaussians_refits(near, far, weight):
    profile = profile_of((near, far), (weight, 1 - weight))
    result = fit_artist(profile, mm_per_pixel=0.1, support_mm=6.0)
    found = result.kernel.parameters["c0"]
    # Annuli 0.002 mm wide are flat: (dr / sigma)^2 is 1.3e-4 for the narrowest Gaussian.
    assert found["near_mm2"] == pytest.approx(near, rel=2e-4)
    assert found["far_mm2"] == pytest.approx(far, rel=2e-4)
    assert found["weight"] == pytest.approx(weight, rel=2e-4)
    assert found["depth_variance_mm2"] == found["far_mm2"]
    np.testing.assert_allclose(result.kernel.energy, 0.4, rtol=1e-12)


@pytest.mark.parametrize("target", ["line", "kernel"])
def test_one_gaussian_is_separable_and_fits_without_error(target):
    result = fit_artist(
        profile_of((0.5,), (1.0,)), mm_per_pixel=0.15, support_mm=5.0, target=target
    )
    assert result.relative_frobenius_error[0] < 1e-5
    assert abs(result.energy_error[0]) < 1e-12


def test_each_target_is_nearest_to_what_it_names(skin1):
    fits = {t: fit_artist(skin1, mm_per_pixel=0.2, target=t) for t in ("line", "kernel")}
    line = make_target(skin1, 0.2).half_line()

    def line_error(result):
        h = result.kernel.half_pixels
        return np.linalg.norm(result.kernel.line[h:] - line, axis=0)

    assert (fits["kernel"].relative_frobenius_error < fits["line"].relative_frobenius_error).all()
    assert (line_error(fits["line"]) < line_error(fits["kernel"])).all()


def test_more_freedom_than_a_grid_of_variances(skin1):
    result = fit_artist(skin1, mm_per_pixel=0.2)
    target = make_target(skin1, 0.2)
    line = target.half_line() / (target.copies @ target.half_line())
    logs = np.linspace(np.log(1e-3), np.log(30), 30)
    for channel, found in enumerate(result.kernel.parameters.values()):

        def misfit(x, channel=channel):
            half, _ = normalised(*two_gaussians(target.edges_mm(), x))
            return line_misfit(half, line[:, channel], target.copies)[0]

        ours = misfit(
            np.array((found["weight"], np.log(found["near_mm2"]), np.log(found["far_mm2"])))
        )
        theirs = min(
            misfit(np.array((w, a, b)))
            for w in np.linspace(0, 1, 11)
            for i, a in enumerate(logs)
            for b in logs[i:]
        )
        assert ours <= theirs


def test_set_by_hand_is_taken_as_it_is(skin1):
    by_hand = {"near_mm2": 0.1, "far_mm2": (2.0, 0.05, 0.4), "weight": 0.5}
    result = fit_artist(skin1, mm_per_pixel=0.2, **by_hand)
    found = result.kernel.parameters
    assert found["R"] == {
        "near_mm2": pytest.approx(0.1),
        "far_mm2": pytest.approx(2.0),
        "weight": 0.5,
        "depth_variance_mm2": pytest.approx(2.0),
    }
    assert found["G"]["depth_variance_mm2"] == pytest.approx(0.1)
    assert result.stop_reasons == ("set by hand",) * 3
    assert result.evaluations == (0, 0, 0)
    np.testing.assert_allclose(result.kernel.energy, skin1.diffuse_reflectance, rtol=1e-12)


def test_its_pass_is_the_preintegrated_one_of_two_gaussians():
    profile = profile_of((0.1, 0.8), (0.3, 0.7))
    ours = fit_artist(profile, mm_per_pixel=0.1, support_mm=6.0)
    theirs = fit_preintegrated(profile, mm_per_pixel=0.1, support_mm=6.0)
    np.testing.assert_allclose(ours.kernel.weights, theirs.kernel.weights, atol=1e-6)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"near_mm2": 1.0}, "weight and far_mm2 missing"),
        ({"near_mm2": (1.0, 2.0), "far_mm2": 1.0, "weight": 0.1}, "one for each of R, G, B"),
        ({"near_mm2": 0.0, "far_mm2": 1.0, "weight": 0.1}, "variances above 0"),
        ({"near_mm2": 1e-320, "far_mm2": 1.0, "weight": 0.1}, "from 1e-18 to 1e.18"),
        ({"near_mm2": 1.0, "far_mm2": 1e308, "weight": 0.1}, "variances above 0, from 1e-18"),
        ({"near_mm2": 1.0, "far_mm2": np.nan, "weight": 0.1}, "one finite number"),
        ({"near_mm2": 1.0, "far_mm2": 1.0, "weight": 1.1}, "shares from 0 to 1"),
        ({"target": "disk"}, 'target = "disk"; expected "line", "kernel" or a function that'),
        ({"target": "picture"}, 'target = "picture"; expected "line", "kernel" or a function that'),
    ],
)
def test_bad_settings_are_one_line(skin1, settings, words):
    with pytest.raises(FitError, match=words):
        fit_artist(skin1, mm_per_pixel=0.3, **settings)


def test_seconds_are_those_of_all_of_the_fit(skin1, monkeypatch):
    def slow(pixels):
        time.sleep(0.3)
        return lambda x: float(x[0].sum())

    monkeypatch.setattr("sssfit.fit.artist._MAX_EVALUATIONS", 20)
    result = fit_artist(skin1, mm_per_pixel=0.5, target=slow)
    assert result.seconds > 0.3
    assert result.evaluations == (47,) * 3  # 27 starts, and 20 more
    assert result.stop_reasons == ("stopped after 20 evaluations, the best of them kept",) * 3


def test_what_judges_pictures_gets_the_numbers_of_all_channels():
    energy = np.outer(np.full(20, 0.02), [1.0, 0.0, 0.5])
    profile = make_profile(np.arange(21) * 0.1, energy)
    best, seen = np.array([[0.3, 0.0, 0.7], [-2.0, 0.0, -1.0], [-0.5, 0.0, 0.5]]), []

    def judge(pixels):
        assert pixels.profile is profile
        assert pixels.mm_per_pixel == 0.2

        def error(x):
            seen.append(x)
            return float(((x - best)[:, [0, 2]] ** 2).sum())

        return error

    kernel = fit_artist(profile, mm_per_pixel=0.2, target=judge).kernel
    assert all(each[:, 1].tolist() == [1.0, 0.0, 0.0] for each in seen)  # the one without light
    assert set(kernel.parameters) == {"c0", "c2"}
    for c in (0, 2):
        found = kernel.parameters[f"c{c}"]
        x = np.array((found["weight"], np.log(found["near_mm2"]), np.log(found["far_mm2"])))
        np.testing.assert_allclose(x, best[:, c], atol=0.05)
    assert kernel.meta["settings"]["target"] == "picture"
    np.testing.assert_allclose(kernel.energy, profile.diffuse_reflectance, rtol=1e-12)
