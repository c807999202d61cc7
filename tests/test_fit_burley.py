"""Normalised diffusion fitted to profiles: known shapes come back, the pass is its marginal."""

import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reference_pixels import make_profile
from scipy.integrate import quad
from scipy.optimize import minimize_scalar

from sssfit import shapes
from sssfit.errors import FitError, SssfitWarning
from sssfit.fit import fit_burley, fit_preintegrated, fit_svd
from sssfit.material import load_material
from sssfit.simulate import simulate_burley, simulate_exact


def diffusion_profile(s, totals, edges):
    """Normalised diffusion as a profile: exact energies, the rest beyond the grid."""
    shares = np.stack([shapes.diffusion_cdf(edges, each) for each in s], axis=1)
    return make_profile(
        edges, np.diff(shares, axis=0) * totals, beyond_grid=(1.0 - shares[-1]) * totals
    )


def fitted_shapes(fitted):
    return [each["s_per_mm"] for each in fitted.kernel.parameters.values()]


@settings(max_examples=40, deadline=None)
@given(
    s=st.floats(0.05, 50.0),
    total=st.floats(1e-4, 1.0),
    reach=st.floats(1.0, 60.0),
    annuli=st.integers(5, 400),
    power=st.floats(0.7, 2.0),
)
def test_a_known_shape_comes_back(s, total, reach, annuli, power):
    edges = reach / s * (np.arange(annuli + 1) / annuli) ** power
    profile = diffusion_profile([s], [total], edges)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SssfitWarning)  # a short reach cuts off energy
        fitted = fit_burley(profile, mm_per_pixel=reach / s / 20)
    assert fitted_shapes(fitted)[0] == pytest.approx(s, rel=1e-8)
    assert fitted.kernel.parameters["c0"]["cumulative_error"] < 1e-8


def test_a_simulated_model_comes_back_in_every_channel():
    profile = simulate_burley(load_material("skin1"), reflectance=[0.44, 0.22, 0.13])
    fitted = fit_burley(profile, mm_per_pixel="profile")
    truth = profile.meta["settings"]["s_per_mm"]
    np.testing.assert_allclose(fitted_shapes(fitted), truth, rtol=1e-8)
    np.testing.assert_allclose(fitted_shapes(fit_burley(profile, mm_per_pixel=0.5)), truth)


@pytest.mark.parametrize("spacing", ["even", "widening"])
def test_the_shape_is_the_one_of_least_squares(spacing):
    profile = simulate_exact(load_material("skin1"))
    if spacing == "widening":  # the integral is over r, whatever the annuli
        rows = np.unique((np.linspace(0.0, 1.0, 80) ** 2 * profile.n_annuli).astype(int))
        energy = np.diff(profile.cumulative[rows], axis=0)
        profile = make_profile(profile.r_edges_mm[rows], energy, beyond_grid=profile.beyond_grid)
    fitted = fit_burley(profile, mm_per_pixel=0.1)
    for c, found in enumerate(fitted.kernel.parameters.values()):
        shares = profile.cumulative[:, c] / profile.diffuse_reflectance[c]

        def objective(s, shares=shares):
            apart = shapes.diffusion_cdf(profile.r_edges_mm, s) - shares
            return np.trapezoid(apart**2, profile.r_edges_mm)

        near = minimize_scalar(
            objective,
            bounds=(0.5 * found["s_per_mm"], 2.0 * found["s_per_mm"]),
            method="bounded",
            options={"xatol": 1e-10},
        )
        assert found["s_per_mm"] == pytest.approx(near.x, rel=1e-6)
        apart = np.abs(shapes.diffusion_cdf(profile.r_edges_mm, found["s_per_mm"]) - shares)
        assert found["cumulative_error"] == pytest.approx(apart.max(), rel=1e-9)
        assert found["diffuse_reflectance"] == profile.diffuse_reflectance[c]


def test_the_pass_is_the_models_line_integral():
    profile = diffusion_profile([1.3], [0.4], np.linspace(0.0, 30.0, 601))
    pixels = {"mm_per_pixel": 0.25, "support_mm": 5.0}
    kernel = fit_burley(profile, energy="keep", **pixels).kernel
    line = kernel.line[:, 0]
    h = kernel.half_pixels
    for k in (1, 2, 7, h):
        integral, _ = quad(
            lambda x: float(shapes.diffusion_marginal(x, 1.3)), (k - 0.5) * 0.25, (k + 0.5) * 0.25
        )
        assert line[h + k] == pytest.approx(0.4 * integral, rel=1e-8)
    half, _ = quad(lambda x: float(shapes.diffusion_marginal(x, 1.3)), 0.0, 0.125)
    assert line[h] == pytest.approx(0.8 * half, rel=1e-6)  # quadrature of a logarithm
    assert kernel.energy[0] == pytest.approx(line.sum(), rel=1e-12)
    # what the profile itself gives, but for its flat annuli next to the logarithm at 0
    theirs = fit_preintegrated(profile, energy="keep", **pixels).kernel
    np.testing.assert_allclose(kernel.weights, theirs.weights, atol=1e-3 * theirs.weights.max())


def test_energy_outside_the_support_is_restored():
    profile = simulate_exact(load_material("skin1"))
    for pixels, lost in ((13, 0.306), (31, 0.106)):
        support = {"mm_per_pixel": 0.3, "support_mm": 0.15 * (pixels - 1)}
        result = fit_burley(profile, **support)
        kept = fit_burley(profile, energy="keep", **support)
        np.testing.assert_allclose(result.kernel.energy, profile.diffuse_reflectance, rtol=1e-12)
        np.testing.assert_allclose(result.energy_error, 0.0, atol=1e-12)
        assert kept.energy_error[0] == pytest.approx(-lost, abs=0.002)
        assert result.kernel.parameters == kept.kernel.parameters
        assert result.kernel.meta["settings"] == {"energy": "rescale", "normalize": False}
        assert kept.kernel.meta["settings"] == {"energy": "keep", "normalize": False}
    with pytest.raises(FitError, match="energy = 'lose'; expected 'rescale' or 'keep'"):
        fit_burley(profile, energy="lose", mm_per_pixel="profile")


def test_one_pass_has_no_smaller_error_than_the_best_of_rank_one():
    profile = simulate_exact(load_material("skin1"))
    best = fit_svd(profile, rank=1, energy="keep", mm_per_pixel=0.3)
    assert (
        fit_burley(profile, mm_per_pixel=0.3).relative_frobenius_error
        > best.relative_frobenius_error
    ).all()


def test_a_grid_that_does_not_tell_the_shape_is_refused():
    all_in_the_first = make_profile(np.arange(11.0), np.eye(10)[:, :1])
    with pytest.raises(FitError) as caught:
        fit_burley(all_in_the_first, mm_per_pixel=0.1, support_mm=1.0)
    assert "channel c0: no shape of normalised diffusion" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_ring_has_a_best_shape_and_a_bad_one():
    ring = make_profile([0.0, 1.0, 2.0], [[0.0], [0.5]])
    with pytest.warns(SssfitWarning, match="test: the burley kernel is farther .* than no kernel"):
        fitted = fit_burley(ring, mm_per_pixel=0.1)
    assert fitted.kernel.parameters["c0"]["cumulative_error"] > 0.2
    assert fitted.relative_frobenius_error[0] > 0.5
