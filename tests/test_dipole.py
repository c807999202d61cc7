"""The dipoles against quadrature of their density, closed totals, and what they refuse."""

import math

import numpy as np
import pytest
import reference_models as reference
from checks import medium
from checks_layers import layer, stack

from sssfit.errors import SimulationError
from sssfit.grid import paper_grid
from sssfit.material import load_material, material_names
from sssfit.simulate import simulate_dipole, simulate_dipole_grosjean
from sssfit.simulate.dipole import (
    fresnel_moments,
    mismatch_by_moments,
    mismatch_by_polynomial,
)
from sssfit.simulate.half_space import diffuse_reflectance

BOTH = [simulate_dipole, simulate_dipole_grosjean]


def entering(eta):
    return 1.0 - ((eta - 1.0) / (eta + 1.0)) ** 2


@pytest.mark.parametrize("name", ["skin1", "marble", "ketchup"])
def test_classical_annuli_are_the_integral_of_the_density(name):
    material = load_material(name)
    profile, coefficients = simulate_dipole(material), material.layers[0]
    for c in range(3):
        sigma_a, sigma_s = coefficients.sigma_a_per_mm[c], coefficients.sigma_s_per_mm[c]
        a = reference.polynomial_mismatch(coefficients.eta)
        for k in (1, 7, 90, profile.n_annuli):
            expected = reference.disk_energy(
                lambda r, s=(sigma_a, sigma_s, a): reference.dipole_density(r, *s),
                profile.r_edges_mm[k],
                1.0 / (sigma_a + sigma_s),
            )
            ours = profile.cumulative[k, c]
            assert ours == pytest.approx(entering(coefficients.eta) * expected, rel=1e-9)


def test_grosjean_annuli_are_the_integral_of_the_density():
    sigma_a, sigma_s, eta = 0.3, 0.9, 1.45
    profile = simulate_dipole_grosjean(medium(sigma_a, sigma_s, eta))
    a = (1 + 3 * reference.fresnel_moment(eta, 2)) / (1 - 2 * reference.fresnel_moment(eta, 1))
    d_mm = (2 * sigma_a + sigma_s) / (3 * (sigma_a + sigma_s) ** 2)
    for k in (1, 20, 300):
        expected = reference.disk_energy(
            lambda r: reference.dipole_density(r, sigma_a, sigma_s, a, d_mm), profile.r_edges_mm[k]
        )
        assert profile.cumulative[k, 0] == pytest.approx(entering(eta) * expected, rel=1e-9)


@pytest.mark.parametrize("name", material_names(paper=True))
def test_classical_total_is_its_closed_form(name):
    material = load_material(name)
    coefficients = material.layers[0]
    a = reference.polynomial_mismatch(coefficients.eta)
    root = np.sqrt(3.0 * (1.0 - coefficients.albedo))
    closed = coefficients.albedo / 2 * (1 + np.exp(-4 / 3 * a * root)) * np.exp(-root)
    profile = simulate_dipole(material)
    np.testing.assert_allclose(
        profile.diffuse_reflectance, entering(coefficients.eta) * closed, rtol=1e-13
    )
    assert profile.n_annuli == paper_grid(material).annuli
    assert np.isnan(profile.annulus_energy_stderr).all()


def test_figures_of_skin1():
    # by hand: alpha' .838, A 2.603, sqrt(3 (1 - alpha')) .697; the exact total is .2096
    assert simulate_dipole(load_material("skin1")).diffuse_reflectance[1] == pytest.approx(
        0.2235, abs=5e-5
    )


@pytest.mark.parametrize(
    ("simulate", "albedo", "eta", "percent"),
    [
        (simulate_dipole, 0.75, 1.0, -15),
        (simulate_dipole, 0.75, 1.3, 11),
        (simulate_dipole, 0.75, 1.4, 25),
        (simulate_dipole_grosjean, 0.99, 1.4, 1),
        (simulate_dipole_grosjean, 0.73, 1.0, -9.5),
        (simulate_dipole_grosjean, 0.73, 1.3, 23),
        (simulate_dipole_grosjean, 0.73, 1.4, 40),
    ],
)
def test_the_documented_errors_of_totals(simulate, albedo, eta, percent):
    exact = diffuse_reflectance(albedo, eta)
    total = simulate(medium(1.0 - albedo, albedo, eta=eta)).diffuse_reflectance
    assert 100.0 * (total / exact - 1.0) == pytest.approx(percent, abs=0.5)


@pytest.mark.parametrize("eta", [0.3, 0.7, 0.999, 1.0, 1.0001, 1.05, 1.3, 1.5, 2.5, 4.0])
def test_fresnel_moments_against_adaptive_quadrature(eta):
    for power, ours in enumerate(fresnel_moments(eta), 1):
        assert ours == pytest.approx(reference.fresnel_moment(eta, power), abs=1e-10)


@pytest.mark.parametrize(
    ("eta", "within"),
    [(eta, 0.002) for eta in (0.5, 0.6, 0.8, 0.999, 1.001, 1.05, 1.3, 1.5, 2.0)] + [(2.5, 0.006)],
)
def test_polynomial_is_near_the_integral_it_stands_for(eta, within):
    a = mismatch_by_polynomial(eta)
    reflected = 2 * reference.fresnel_moment(eta, 1)
    assert (a - 1) / (a + 1) == pytest.approx(reflected, abs=within)


def test_no_step_no_mismatch():
    assert mismatch_by_polynomial(1.0) == mismatch_by_moments(1.0) == 1.0


def test_index_counts_relative_to_what_is_above():
    wet = stack(layer(0.1, 1.0, 0.0, 1.5), above=1.25)
    dry = stack(layer(0.1, 1.0, 0.0, 1.2))
    for simulate in BOTH:
        one, other = simulate(wet), simulate(dry)
        np.testing.assert_allclose(one.annulus_energy, other.annulus_energy, rtol=1e-13)


@pytest.mark.parametrize("simulate", BOTH)
def test_anisotropy_enters_by_reduced_scattering(simulate):
    grid = {"dr_mm": 0.1, "radius_mm": 10.0}
    forward = simulate(medium(0.05, 10.0, 1.4, 0.9), **grid)
    plain = simulate(medium(0.05, 1.0, 1.4), **grid)
    np.testing.assert_allclose(forward.annulus_energy, plain.annulus_energy, rtol=1e-12)


@pytest.mark.parametrize("simulate", BOTH)
def test_no_absorption_returns_all_that_entered(simulate):
    for sigma_a in (0.0, 1e-12):
        profile = simulate(medium(sigma_a, 1.0, 1.3))
        assert profile.diffuse_reflectance[0] == pytest.approx(entering(1.3), abs=1e-5)
        assert (profile.annulus_energy > 0.0).all()
    exact = simulate(medium(0.0, 1.0, 1.3)).diffuse_reflectance[0]
    assert exact == pytest.approx(entering(1.3), rel=1e-14)


@pytest.mark.parametrize("simulate", BOTH)
def test_no_scattering_returns_nothing(simulate):
    profile = simulate(medium([1.0, 0.5], [0.0, 0.5], 1.3))
    assert profile.diffuse_reflectance[0] == 0.0
    assert profile.diffuse_reflectance[1] > 0.0


@pytest.mark.parametrize("simulate", BOTH)
def test_one_annulus_and_many_channels(simulate):
    one = simulate(load_material("skin1"), dr_mm=2.0, radius_mm=2.0)
    fine = simulate(load_material("skin1"), dr_mm=0.5, radius_mm=2.0)
    np.testing.assert_allclose(one.annulus_energy[0], fine.total_on_grid, rtol=1e-13)
    np.testing.assert_allclose(one.beyond_grid, fine.beyond_grid, rtol=1e-15)
    many = simulate(medium(np.full(64, 0.1), np.linspace(0.1, 6.4, 64), 1.3))
    assert many.n_channels == 64


@pytest.mark.parametrize("simulate", BOTH)
def test_what_is_refused(simulate):
    skin = load_material("skin1")
    with pytest.raises(SimulationError, match="multipole or montecarlo"):
        simulate(stack(layer(0.1, 1.0, 0.0, 1.3, 5.0)))
    for bad in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(SimulationError, match="expected a length"):
            simulate(skin, radius_mm=bad)
    with pytest.raises(SimulationError, match="annuli"):
        simulate(skin, dr_mm=1e-6)


def test_index_beyond_the_polynomial_is_refused():
    with pytest.raises(SimulationError, match=r"2.6.*dipole-grosjean"):
        simulate_dipole(medium(0.1, 1.0, 2.6))
    assert 0 < simulate_dipole_grosjean(medium(0.1, 1.0, 2.6)).diffuse_reflectance[0] < 1
