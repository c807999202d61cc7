"""The 2012 model: its unit of length, table 1, and refits of its own kernels."""

import math
import runpy
import time
from pathlib import Path

import numpy as np
import pytest
from reference_pixels import make_profile
from scipy.optimize import check_grad
from scipy.stats import norm

from sssfit.errors import FitError
from sssfit.fit import fit_falloff, make_target
from sssfit.fit.falloff import (
    STRETCH,
    fit_scale,
    sampled_misfit,
    sampled_pixels,
    scale_of,
    stretched_skin,
)
from sssfit.shapes import SKIN_VARIANCES_MM2, SKIN_WEIGHTS
from sssfit.simulate import simulate_deon_skin

ROOT = Path(__file__).parents[1]
MADE = runpy.run_path(str(ROOT / "docs" / "make_falloff.py"))
TABLE_1 = MADE["TABLE_1"]


@pytest.fixture(scope="module")
def skin():
    return simulate_deon_skin()


def test_samples_are_dense_near_the_middle_and_reach_far_out():
    at = sampled_pixels(400)
    np.testing.assert_array_equal(at[:10], range(10))
    steps = np.diff(at)
    assert (np.diff(steps) >= 0).all()
    assert steps[-1] > 20
    assert 400 - at[-1] <= 400 / 8
    assert list(sampled_pixels(1)) == [0]


def test_eq_3_is_summed_over_the_sampled_pixels_of_the_plane():
    rng = np.random.default_rng(4)
    half, quadrant = rng.random(20), rng.random((20, 20))
    quadrant += quadrant.T
    value, gradient = sampled_misfit(half, quadrant)
    whole = {sign * int(i) for i in sampled_pixels(20) for sign in (1, -1)}
    left = sum(
        (quadrant[abs(i), abs(j)] - half[abs(i)] * half[abs(j)]) ** 2 for i in whole for j in whole
    )
    assert value == pytest.approx(
        left / sum(quadrant[abs(i), abs(j)] ** 2 for i in whole for j in whole), rel=1e-12
    )
    assert not gradient[17]  # from 16 on every second pixel
    error = check_grad(
        lambda x: sampled_misfit(x, quadrant)[0], lambda x: sampled_misfit(x, quadrant)[1], half
    )
    assert error < 1e-5 * np.linalg.norm(gradient)


def test_the_pass_has_the_derivatives_of_finite_differences():
    edges = 0.25 * (np.arange(20) - 0.5)
    x = np.array((0.6, -0.4))
    _, slopes = stretched_skin(x, edges)
    for i in range(2):
        step = np.zeros(2)
        step[i] = 1e-6
        more, _ = stretched_skin(x + step, edges)
        less, _ = stretched_skin(x - step, edges)
        np.testing.assert_allclose(slopes[i], (more - less) / 2e-6, atol=1e-8)


def test_at_full_strength_and_its_own_scale_it_is_red_skin(skin):
    unit = 1 / (STRETCH * 0.014) - 0.001  # falloff at which red skin is not stretched
    result = fit_falloff(
        skin, mm_per_pixel=0.2, support_mm=9.0, width=0.014, strength=1.0, falloff=unit
    )
    weights = [row[0] for row in SKIN_WEIGHTS]
    edges = 0.2 * (np.arange(92) - 45.5)
    red = np.diff(norm.cdf(edges[:, None], scale=np.sqrt(SKIN_VARIANCES_MM2)), axis=0) @ weights
    ours = result.kernel.weights[0, :, 0]
    np.testing.assert_allclose(ours / ours.sum(), red / red.sum(), rtol=1e-9)


@pytest.mark.parametrize("strength", [0.3, 0.78])
@pytest.mark.parametrize("scale", [0.15, 1.0, 2.3])
@pytest.mark.parametrize("pitch_mm", [0.1, 0.5])
def test_a_kernel_of_the_model_refits(strength, scale, pitch_mm):
    edges = pitch_mm * (np.arange(round(10 / pitch_mm)) - 0.5)
    half, _ = stretched_skin(np.array((strength, math.log(scale))), edges)
    found = fit_scale(np.outer(half, half), edges)
    np.testing.assert_allclose(found.x, (strength, math.log(scale)), atol=1e-6)
    assert found.stop_reason.startswith("converged")


def test_a_larger_width_widens(skin):
    def spread(width):
        kernel = fit_falloff(
            skin, mm_per_pixel=0.2, support_mm=9.0, width=width, strength=1.0, falloff=0.3
        ).kernel
        x = np.arange(-kernel.half_pixels, kernel.half_pixels + 1)
        return np.average(x**2, weights=kernel.weights[0, :, 0])

    assert spread(0.01) < spread(0.014) < spread(0.025)


def test_the_unit_of_length_makes_table_1_fit_best(skin):
    stretch, left = MADE["best_stretch"](skin, MADE["PITCH_MM"])
    assert stretch == pytest.approx(STRETCH, abs=0.05)
    _, of_table = MADE["fitted"](skin, MADE["PITCH_MM"], **TABLE_1)
    assert of_table == pytest.approx(left, rel=1e-4)
    # At that length table 1's red channel is red skin itself, to 2 %.
    assert scale_of(0.014, 0.57) == pytest.approx(1, abs=0.03)


@pytest.mark.parametrize("pitch_mm", [0.2, 0.5, 1.0])
def test_our_fit_is_no_worse_than_table_1(skin, pitch_mm):
    by_hand = fit_falloff(skin, mm_per_pixel=pitch_mm, support_mm=8.0, **TABLE_1)
    fitted = fit_falloff(skin, mm_per_pixel=pitch_mm, support_mm=8.0)
    for ours, theirs in zip(
        fitted.kernel.parameters.values(), by_hand.kernel.parameters.values(), strict=True
    ):
        assert ours["misfit"] <= theirs["misfit"]


def test_no_grid_of_parameters_beats_the_fit(skin):
    target = make_target(skin, 0.3, 8.0)
    fitted = fit_falloff(skin, mm_per_pixel=0.3, support_mm=8.0)
    for channel, found in enumerate(fitted.kernel.parameters.values()):
        quadrant = target.quadrant(channel)
        best = min(
            sampled_misfit(stretched_skin(np.array((t, log_m)), target.edges_mm())[0], quadrant)[0]
            for t in np.linspace(0, 1, 26)
            for log_m in np.linspace(-4, 3, 60)
        )
        assert found["misfit"] <= best


def test_the_widest_channel_has_the_falloff_one_and_all_share_the_width(skin):
    fitted = fit_falloff(skin, mm_per_pixel=0.3, support_mm=8.0)
    found = fitted.kernel.parameters
    assert found["R"]["falloff"] == pytest.approx(1)
    assert all(0 <= each["falloff"] <= 1 + 1e-12 for each in found.values())
    assert len({each["width"] for each in found.values()}) == 1
    np.testing.assert_allclose(fitted.kernel.energy, 1, rtol=1e-9)
    again = fit_falloff(
        skin,
        mm_per_pixel=0.3,
        support_mm=8.0,
        width=found["R"]["width"],
        strength=[each["strength"] for each in found.values()],
        falloff=[each["falloff"] for each in found.values()],
    )
    np.testing.assert_array_equal(again.kernel.weights, fitted.kernel.weights)


def test_a_channel_without_light():
    energy = np.zeros((40, 2))
    energy[:, 1] = np.exp(-np.arange(40) / 8)
    profile = make_profile(np.arange(41) * 0.1, 0.05 * energy)
    result = fit_falloff(profile, mm_per_pixel=0.2)
    assert list(result.kernel.parameters) == ["c1"]
    assert result.stop_reasons[0] == "the channel returns no light"


def test_a_pass_of_which_its_pixels_hold_nothing_is_refused(skin):
    with pytest.raises(FitError, match="so wide that its pixels hold nothing of it"):
        fit_falloff(skin, mm_per_pixel=1e-3, support_mm=0.02, width=1e9, strength=1.0, falloff=1e6)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"width": 0.014}, "strength and falloff missing"),
        ({"width": 0.0, "strength": 0.5, "falloff": 0.5}, "one number above 0"),
        ({"width": (1.0, 2.0, 3.0), "strength": 0.5, "falloff": 0.5}, "for all channels"),
        ({"width": 0.014, "strength": 1.2, "falloff": 0.5}, "shares from 0 to 1"),
        ({"width": 0.014, "strength": 0.5, "falloff": -0.1}, "numbers from 0 to 1e.06"),
        ({"width": 0.014, "strength": 0.5, "falloff": 1e308}, "numbers from 0 to 1e.06"),
        ({"width": 1e308, "strength": 0.5, "falloff": 0.5}, "from 1e-09 to 1e.09"),
        ({"width": 1e-320, "strength": 0.5, "falloff": 0.5}, "from 1e-09 to 1e.09"),
    ],
)
def test_bad_settings_are_one_line(skin, settings, words):
    with pytest.raises(FitError, match=words):
        fit_falloff(skin, mm_per_pixel=0.3, **settings)


def test_the_documented_section_is_up_to_date():
    page = (ROOT / "docs" / "fits.md").read_text(encoding="utf-8")
    assert MADE["section"]() in page, "run: python docs/make_falloff.py"


def test_seconds_are_those_of_all_of_the_fit(skin, monkeypatch):
    def slow(*arguments):
        time.sleep(0.1)
        return fit_scale(*arguments)

    monkeypatch.setattr("sssfit.fit.falloff.fit_scale", slow)
    assert fit_falloff(skin, mm_per_pixel=1.0, support_mm=5.0).seconds > 0.3
