"""Smoothed profiles: nearer to the exact one than the walk, of the same energy, and power laws."""

import dataclasses

import numpy as np
import pytest
from test_profile import make_profile

from sssfit.errors import ProfileError
from sssfit.fit import fit_result, fit_svd
from sssfit.fit._target import Target
from sssfit.material import load_material
from sssfit.profile import smooth
from sssfit.profile.directions import angular_reflectance
from sssfit.profile.smooth import smoothed
from sssfit.simulate import simulate_exact, simulate_montecarlo

PITCH = 0.3


@pytest.fixture(scope="module")
def exact():
    return simulate_exact(load_material("skin1"))


def walk(exact, photons, seed):
    radius_mm = float(exact.r_edges_mm[-1])
    return simulate_montecarlo(
        load_material("skin1"), photons=photons, seed=seed, radius_mm=radius_mm
    )


def of_photons(profile, photons):
    return dataclasses.replace(profile, meta={**profile.meta, "photons": photons})


def error_of(profile, exact, channel=0):
    """Return the error of a pass's pixels over their own size, out to 30 pixels."""
    mine, true = (Target(each, PITCH, 30).half_line()[:, channel] for each in (profile, exact))
    return np.sqrt(np.mean((mine / true - 1.0) ** 2))


@pytest.mark.parametrize("photons", [1_000, 20_000])
def test_a_smoothed_walk_is_nearer_to_the_exact_kernel(exact, photons):
    pairs = []
    for seed in range(12):
        own = walk(exact, photons, seed)
        pairs.append([error_of(own, exact), error_of(smoothed(own), exact)])
    before, after = np.log(pairs).T
    gain = before - after
    assert gain.mean() > 3.0 * gain.std(ddof=1) / np.sqrt(len(gain))


def test_each_channel_keeps_its_energy_and_its_annuli(exact):
    own = walk(exact, 2_000, 1)
    found = smoothed(own)
    np.testing.assert_allclose(found.total_on_grid, own.total_on_grid, rtol=1e-12)
    np.testing.assert_array_equal(found.beyond_grid, own.beyond_grid)
    np.testing.assert_array_equal(found.r_edges_mm, own.r_edges_mm)
    assert (found.annulus_energy >= 0.0).all()
    assert np.isnan(found.annulus_energy_stderr).all()
    assert fit_svd(found, rank=3, mm_per_pixel=PITCH).kernel.rank == 3


def test_light_by_exit_angle_is_that_of_all_annuli_and_does_not_change():
    own = simulate_montecarlo(load_material("skin1"), photons=2_000, angles=6)
    before, after = (angular_reflectance(each) for each in (own, smoothed(own)))
    assert after.profile.angle_reflected.shape == (1, 6, 3)
    np.testing.assert_allclose(after.per_sr, before.per_sr, rtol=1e-12)
    np.testing.assert_allclose(after.per_sr_stderr, before.per_sr_stderr, rtol=1e-9)


def test_a_kernel_of_a_smoothed_profile_is_the_walks(exact):
    """So `sssfit render` finds the walk itself, and judges by that."""
    own = walk(exact, 2_000, 1)
    fitted = fit_result(own, "svd", rank=2, mm_per_pixel=PITCH, smooth=True).kernel
    assert fitted.meta["profile_sha256"] == own.sha256
    assert fitted.meta["settings"]["smooth"] is True
    wanted = fit_svd(smoothed(own), rank=2, mm_per_pixel=PITCH).kernel
    np.testing.assert_array_equal(fitted.weights, wanted.weights)
    assert "smooth" not in fit_svd(own, mm_per_pixel=PITCH).kernel.meta["settings"]


def test_a_power_law_is_not_penalised():
    """Under a penalty far above the hits 1/r comes back within the error of its two parameters."""
    rng = np.random.default_rng(3)
    edges_mm = np.linspace(0.0, 8.0, 401)
    areas = np.diff(np.pi * edges_mm**2)
    wanted = areas / (edges_mm[1:] + edges_mm[:-1])
    wanted *= 50_000 / wanted.sum()
    hits = rng.poisson(wanted).astype(float)
    basis = smooth._basis(edges_mm)
    start = np.full(basis.shape[1], np.log(hits.sum() / areas.sum()))
    found = smooth._fitted(basis, hits, areas, 1e9, start)
    # The factor is known to 1 / sqrt(50 000), the power to as much a decade: the ends to thrice.
    assert np.abs(found.hits / wanted - 1.0).max() < 5.0 * 3.0 / np.sqrt(50_000)


def test_a_profile_without_errors_is_refused_in_one_line(exact):
    walked = walk(exact, 1000, 1)
    nothing = np.full_like(walked.annulus_energy, np.nan)
    unknown = dataclasses.replace(walked, annulus_energy_stderr=nothing)
    for profile, said in (
        (exact, "is of no photons"),  # its errors are estimates of the solver's
        (of_photons(walked, None), "is of no photons"),
        (unknown, "has no standard errors"),
    ):
        with pytest.raises(ProfileError, match=f"the profile {said}, and only a walk's") as caught:
            smoothed(profile)
        assert "\n" not in str(caught.value)


def test_a_channel_without_light_stays_dark():
    edges_mm = np.linspace(0.0, 2.0, 11)
    nothing = np.zeros((10, 1))
    profile = of_photons(make_profile(edges_mm, nothing, annulus_energy_stderr=nothing), 100)
    np.testing.assert_array_equal(smoothed(profile).annulus_energy, nothing)
