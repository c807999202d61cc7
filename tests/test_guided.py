"""The guided fit against literal sums, another optimiser, the SVD, and its own purpose."""

import dataclasses
import warnings

import numpy as np
import pytest
from reference_pixels import kernel_energy, make_profile, one_over_r_profile
from scipy.integrate import dblquad
from scipy.optimize import LinearConstraint, check_grad, minimize

from sssfit.errors import FitError, SssfitWarning
from sssfit.fit import fit_guided, fit_preintegrated, make_target, support_of
from sssfit.fit.guided import (
    _levels,
    _misfit,
    _resampled,
    fit_one_pass,
    gamma,
    guided_target,
    rank_one,
)
from sssfit.material import load_material
from sssfit.simulate import simulate_exact

LENGTH_MM = 1.0


@pytest.fixture(scope="module")
def profile():
    """R_d ~ exp(-r/L)/r with two lengths: the shape of the profiles in use."""
    return one_over_r_profile(600, 0.02, [LENGTH_MM, 0.4])


@pytest.fixture(scope="module")
def skin1():
    return simulate_exact(load_material("skin1"))


def quiet(fit, *arguments, **settings):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SssfitWarning)
        return fit(*arguments, **settings)


@pytest.mark.parametrize(("half", "k"), [(0, 1.0), (3, 0.0), (5, 1.55), (6, 4.0)])
def test_gamma_is_the_mean_over_each_pixel(half, k):
    values = gamma(half, k, 50.0)

    def guide(y, x):
        return (x * x + y * y) ** (k / 2) * -np.expm1(-50 * x * x) * -np.expm1(-50 * y * y)

    for i, j in {(0, 0), (half, 0), (half, half), (half // 2, half)}:
        x0, x1, y0, y1 = ((n + d) / (half + 0.5) for n in (i, j) for d in (-0.5, 0.5))
        integral, _ = dblquad(guide, x0, x1, y0, y1, epsabs=1e-10)
        np.testing.assert_allclose(values[i, j], integral * (half + 0.5) ** 2, rtol=1e-4)
    np.testing.assert_allclose(values, values.T, rtol=1e-14)


def test_the_gradient_is_that_of_finite_differences():
    rng = np.random.default_rng(1)
    wanted, weights = rng.random((7, 7)), rng.random((7, 7))
    wanted, weights = wanted + wanted.T, weights + weights.T
    scale = 1 + rng.random(7)

    def function(x, part):
        return _misfit(scale * x, wanted, weights, scale, 3.0)[part]

    x = rng.random(7)
    slope = function(x, 1)
    error = check_grad(lambda y: function(y, 0), lambda y: function(y, 1), x, epsilon=1e-7)
    assert error < 1e-5 * np.linalg.norm(slope)


def test_the_misfit_is_the_sum_over_the_whole_plane(profile):
    half = 6
    target = make_target(profile, 0.5, half * 0.5)
    quadrant = target.quadrant(0)
    rng = np.random.default_rng(2)
    a, guide = rng.random(half + 1), gamma(half, 1.55)
    copies = target.copies
    value, _ = _misfit(a, quadrant, copies[:, None] * copies * guide, np.ones(half + 1), 1.0)
    literal = 0.0
    for i in range(-half, half + 1):
        for j in range(-half, half + 1):
            u, v = abs(i), abs(j)
            literal += guide[u, v] * (quadrant[u, v] - a[u] * a[v]) ** 2
    assert value == pytest.approx(literal, rel=1e-12)


@pytest.mark.parametrize("channel", [0, 1])
def test_without_guide_and_constraint_it_is_the_svds_first_term(profile, channel):
    half = 20
    target = make_target(profile, 0.2, half * 0.2)
    quadrant = target.quadrant(channel)
    found = rank_one(quadrant, np.ones_like(quadrant), target.half_line()[:, channel], total=None)
    full = np.abs(np.arange(-half, half + 1))
    values, vectors = np.linalg.eigh(quadrant[np.ix_(full, full)])
    first = np.sqrt(values[-1]) * np.abs(vectors[:, -1])
    np.testing.assert_allclose(found.x[full], first, atol=1e-6 * first.max())
    left = 1 - values[-1] ** 2 / np.sum(values**2)
    assert found.value == pytest.approx(left, rel=1e-9)


@pytest.mark.parametrize("k", [0.0, 1.55, 4.0])
def test_another_optimiser_finds_nothing_better(profile, k):
    result = quiet(fit_guided, profile, mm_per_pixel=0.4, support_mm=6.0, k=k)
    target = make_target(profile, 0.4, 6.0)
    for channel in range(2):
        quadrant = target.quadrant(channel) / target.total[channel]
        copies = target.copies
        weights = copies[:, None] * copies * gamma(target.half_pixels, k)
        norm = np.sum(weights * quadrant**2)

        def objective(a, quadrant=quadrant, weights=weights, norm=norm):
            return _misfit(a, quadrant, weights, np.ones(a.size), norm)

        theirs = minimize(
            objective,
            np.full(copies.size, 1 / copies.sum()),
            jac=True,
            method="SLSQP",
            bounds=[(0, None)] * copies.size,
            constraints=LinearConstraint(copies, 1, 1),
            options={"maxiter": 2000, "ftol": 1e-14},
        )
        ours = list(result.kernel.parameters.values())[channel]["weighted_residual"]
        assert ours <= theirs.fun * (1 + 1e-6)


@pytest.mark.parametrize("k", [0, 2, 4])
def test_the_energy_is_the_profiles(skin1, k):
    result = quiet(fit_guided, skin1, mm_per_pixel=0.3, k=k)
    np.testing.assert_allclose(result.kernel.energy, skin1.diffuse_reflectance, rtol=1e-8)
    np.testing.assert_allclose(result.energy_error, 0, atol=1e-8)
    assert (result.kernel.weights >= 0).all()


@pytest.mark.parametrize("channel", [0, 1, 2])
def test_small_k_is_better_near_the_beam_and_large_k_far_from_it(skin1, channel):
    # Each channel on its own support: "near" is a share of that.
    profile = make_profile(skin1.r_edges_mm, skin1.annulus_energy[:, channel : channel + 1])
    pitch = support_of(profile) / 64.001
    wanted = make_target(profile, pitch).quadrant(0)
    x = np.arange(len(wanted)) / 64
    # Off the axes, where Gamma says next to nothing and the spike's cross lies.
    off_axes = (x > 0.05)[:, None] & (x > 0.05)
    distance = np.hypot(x[:, None], x)
    left = {}
    for k in (0, 4):
        found = quiet(fit_guided, profile, mm_per_pixel=pitch, k=k).kernel.quadrant(0)
        rings = (off_axes & (distance < 0.12), off_axes & (distance > 0.3))
        left[k] = [np.linalg.norm((found - wanted)[ring]) for ring in rings]
    assert left[0][0] < 0.5 * left[4][0]
    assert left[4][1] < 0.5 * left[0][1]


def distance_from_preintegrated(profile, k, channel, support_mm):
    """Half the sum of the differences of two passes of sum 1."""
    settings = {"mm_per_pixel": 0.3, "support_mm": support_mm}
    fits = (
        quiet(fit_guided, profile, k=k, **settings),
        quiet(fit_preintegrated, profile, **settings),
    )
    passes = [
        fit.kernel.weights[0, :, channel] / fit.kernel.weights[0, :, channel].sum() for fit in fits
    ]
    return 0.5 * np.abs(passes[0] - passes[1]).sum()


@pytest.mark.parametrize("support_mm", [6.0, 12.0, 21.4])
def test_of_skin1s_red_k_0_is_nearest_to_the_preintegrated_pass(skin1, support_mm):
    # docs/fits.md has the distances of all channels; 1.55, the k that the paper draws, was called
    # the nearest.
    found = [distance_from_preintegrated(skin1, k, 0, support_mm) for k in (0, 0.5, 1, 1.55, 2)]
    assert found[0] == min(found)
    assert found[3] > 1.4 * found[0]


def test_k_and_b_refer_to_each_channels_mean_free_path(skin1):
    fitted = quiet(fit_guided, skin1, mm_per_pixel=0.3, support_mm=12.0)
    extents = [each["extent_mm"] for each in fitted.kernel.parameters.values()]
    paths_mm = load_material("skin1").layers[0].mean_free_path_mm
    np.testing.assert_allclose(extents, 12.15 * paths_mm / paths_mm[0], rtol=1e-12)
    # A channel alone, on the support that is its extent, is fitted as beside the others.
    target = make_target(skin1, 0.3, 12.0)
    alone = fit_one_pass(target, 1, extents[1], 1.55, 50.0, 1.0)
    np.testing.assert_array_equal(alone.half[0], fitted.kernel.weights[0, 40:, 1])
    wider = fit_one_pass(target, 1, extents[0], 1.55, 50.0, 1.0)
    assert np.abs(wider.half[0] - alone.half[0]).max() > 0.01 * alone.half[0].max()


def test_gamma_of_an_extent_is_that_of_more_pixels():
    # x = 1 at 6.5 pixels of a support of 10.5: the inner part of it is Gamma over 6.5 pixels.
    inner, whole = gamma(6, 2.0, 50.0), gamma(10, 2.0, 50.0, extent=6.5 / 10.5)
    np.testing.assert_allclose(whole[:7, :7], inner, rtol=2e-3)
    assert whole[10, 10] > 2.0 * whole[6, 6]


def test_without_mean_free_paths_the_support_serves_all_channels(profile):
    fitted = quiet(fit_guided, profile, mm_per_pixel=0.4, support_mm=6.0)
    for found in fitted.kernel.parameters.values():
        assert found["extent_mm"] == pytest.approx(6.2)


def test_the_longest_mean_free_path_is_that_of_a_lit_channel(skin1):
    energy = skin1.annulus_energy * (0.0, 1.0, 1.0)
    dark = dataclasses.replace(skin1, annulus_energy=energy, beyond_grid=np.zeros(3))
    fitted = quiet(fit_guided, dark, mm_per_pixel=0.3, support_mm=6.0)
    assert fitted.kernel.parameters["G"]["extent_mm"] == pytest.approx(6.15)
    assert 4.0 < fitted.kernel.parameters["B"]["extent_mm"] < 5.0


def test_levels_keep_their_stop_reasons(profile):
    result = quiet(fit_guided, profile, mm_per_pixel=0.05)
    for channel, found in enumerate(result.kernel.parameters.values()):
        levels = found["levels"]
        assert levels[-1]["pixels"] == result.kernel.pixels
        assert [level["pixels"] for level in levels] == sorted(level["pixels"] for level in levels)
        assert all(level["stop_reason"].startswith("converged") for level in levels)
        assert result.stop_reasons[channel] == levels[-1]["stop_reason"]
        assert result.evaluations[channel] == sum(level["evaluations"] for level in levels)


def test_levels_double():
    assert _levels(256) == [8, 16, 32, 64, 128, 256]
    assert _levels(0) == [0]
    assert _levels(15) == [15]
    assert _levels(17) == [8, 17]


@pytest.mark.parametrize("half", [4, 9, 20])
def test_a_refined_pass_keeps_sum_and_sign(half):
    coarse = np.array((0.4, 0.1, 0.15, 0.05, 0.0))
    fine = _resampled(coarse, half)
    assert fine.size == half + 1
    assert 2 * fine.sum() - fine[0] == pytest.approx(2 * coarse.sum() - coarse[0], rel=1e-14)
    assert (fine >= 0).all()
    np.testing.assert_allclose(_resampled(coarse, 4), coarse, atol=1e-15)


def test_the_spike_is_reported_warned_of_and_bounded(skin1):
    with pytest.warns(SssfitWarning, match=r"R 0\.\d+ \(pre-integrated 0\.\d+\).*centre_bound"):
        free = fit_guided(skin1, mm_per_pixel=0.2, k=4)
    line = fit_preintegrated(skin1, mm_per_pixel=0.2).kernel.weights[0]
    for channel, found in enumerate(free.kernel.parameters.values()):
        whole = free.kernel.weights[0, :, channel]
        assert found["centre_share"] == pytest.approx(whole.max() / whole.sum())
        of_line = line[:, channel].max() / line[:, channel].sum()
        assert found["preintegrated_centre_share"] == pytest.approx(of_line)
    bounded = fit_guided(skin1, mm_per_pixel=0.2, k=4, centre_bound=0.15)
    for found, before in zip(
        bounded.kernel.parameters.values(), free.kernel.parameters.values(), strict=True
    ):
        assert found["centre_share"] <= 0.15 + 1e-12
        assert found["weighted_residual"] > before["weighted_residual"]
    np.testing.assert_allclose(bounded.energy_error, 0, atol=1e-8)


def test_a_single_pixel_is_the_identity(profile):
    with pytest.warns(SssfitWarning, match="single pixel"):
        result = fit_guided(profile, mm_per_pixel=50.0, centre_bound=0.1)
    np.testing.assert_allclose(result.kernel.energy, profile.diffuse_reflectance)


def test_a_channel_without_light_and_one_in_a_single_annulus():
    energy = np.zeros((50, 2))
    energy[0, 1] = 0.3
    result = quiet(
        fit_guided, make_profile(np.arange(51) * 0.1, energy), mm_per_pixel=0.1, support_mm=3.0
    )
    np.testing.assert_allclose(result.kernel.energy, (0, 0.3), rtol=1e-8)
    assert result.stop_reasons[0] == "the channel returns no light"


def test_too_many_pixels_name_a_pitch_that_would_do(skin1):
    with pytest.raises(FitError, match=r"up to 513 pixels.*1275 pixels") as refusal:
        fit_guided(skin1, mm_per_pixel=float(skin1.r_edges_mm[1]))
    pitch = float(str(refusal.value).partition("`mm_per_pixel = ")[2].partition("`")[0])
    pixels = 2 * int(support_of(skin1) / pitch) + 1
    assert 500 < pixels <= 513
    with pytest.warns(SssfitWarning, match=rf"pixels of {pitch:.3g} mm are used"):
        assert guided_target(skin1, "profile", None).mm_per_pixel == pitch
    with pytest.warns(SssfitWarning, match="and the support is 801 pixels of 0.3 mm"):
        wide = guided_target(one_over_r_profile(1500, 0.1, [1.0]), None, 120.0)
    assert 500 < 2 * wide.half_pixels + 1 <= 513


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"k": -0.1}, r"k = -0.1 is outside \[0, 4\]"),
        ({"k": 4.5}, r"k = 4.5 is outside"),
        ({"k": float("nan")}, "k = nan is outside"),
        ({"b": 0}, "b = 0; expected a number above 0"),
        ({"centre_bound": 0.0}, "centre_bound = 0; expected a share"),
        ({"centre_bound": 1.5}, "centre_bound = 1.5; expected a share"),
    ],
)
def test_bad_settings_are_one_line(profile, settings, words):
    with pytest.raises(FitError, match=words):
        fit_guided(profile, mm_per_pixel=0.2, **settings)


def test_normalising_keeps_the_energy_apart(profile):
    result = quiet(fit_guided, profile, mm_per_pixel=0.3, normalize=True)
    np.testing.assert_allclose(result.kernel.energy, 1, rtol=1e-8)
    np.testing.assert_allclose(result.kernel.scale, profile.diffuse_reflectance, rtol=1e-8)
    quadrant = result.kernel.quadrant(0)
    assert kernel_energy(quadrant) == pytest.approx(1)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["apple", "ketchup", "cream", "skin2", "marble"])
@pytest.mark.parametrize("k", [0, 1.55, 4])
def test_full_size_converges_at_every_level(name, k):
    profile = simulate_exact(load_material(name))
    result = quiet(fit_guided, profile, mm_per_pixel=support_of(profile) / 256.001, k=k)
    assert result.kernel.pixels == 513
    np.testing.assert_allclose(result.energy_error, 0, atol=1e-8)
    for found in result.kernel.parameters.values():
        assert all(level["stop_reason"].startswith("converged") for level in found["levels"])
