"""Slabs of Gaussians: the algebra against products in Fourier space, and the exact stack."""

import numpy as np
import pytest
from checks_layers import layer, stack

from sssfit.errors import SimulationError
from sssfit.simulate import simulate_exact_many
from sssfit.simulate.slabs import GaussianSlab, GaussianSum, combined

K = np.geomspace(0.01, 30.0, 60)


def random_sum(rng, total):
    weights = rng.uniform(0.1, 1.0, 4)
    return GaussianSum.of(total * weights / weights.sum(), 10.0 ** rng.uniform(-3.0, 1.0, 4))


def random_slab(rng):
    totals = rng.dirichlet(np.ones(3), 2)[:, :2]
    (r, t), (r_up, t_up) = ([random_sum(rng, each) for each in pair] for pair in totals)
    return GaussianSlab(r, t, r_up, t_up)


@pytest.mark.parametrize("seed", range(3))
def test_two_slabs_are_their_product_in_fourier_space(seed):
    rng = np.random.default_rng([22, seed])
    first, second = random_slab(rng), random_slab(rng)
    found = combined(first, second)
    r1, t1, b1, u1 = (getattr(first, each).transform(K) for each in first.__slots__)
    r2, t2, b2, u2 = (getattr(second, each).transform(K) for each in second.__slots__)
    between = 1.0 - b1 * r2
    for name, theory in (
        ("reflected", r1 + t1 * r2 * u1 / between),
        ("transmitted", t1 * t2 / between),
        ("reflected_up", b2 + u2 * b1 * t2 / between),
        ("transmitted_up", u2 * u1 / between),
    ):
        np.testing.assert_allclose(getattr(found, name).transform(K), theory, rtol=0, atol=1e-10)


def test_wide_slabs_on_a_grid_of_variances_are_not_taken_for_more_than_all_light():
    mirror = GaussianSum.of(np.full(20, 0.95 / 20), np.geomspace(1e-3, 1e3, 20))
    slab = GaussianSlab.symmetric(mirror, GaussianSum.of(0.05, 0.3))
    found = combined(slab, slab)
    r, t = mirror.transform(K), slab.transmitted.transform(K)
    np.testing.assert_allclose(found.transmitted.transform(K), t * t / (1.0 - r * r), atol=1e-10)


def test_two_gaussians_convolve_to_one():
    found = GaussianSum.of(0.5, 0.2) * GaussianSum.of(0.6, 0.5)
    np.testing.assert_allclose((found.weights, found.variances), [[0.3], [0.7]], rtol=1e-14)
    r = np.linspace(0.0, 2.0, 5)
    theory = 0.3 * np.exp(-(r**2) / 1.4) / (1.4 * np.pi)
    np.testing.assert_allclose(found.density(r), theory, rtol=1e-13)
    np.testing.assert_allclose(found.cumulative(r), 0.3 * -np.expm1(-(r**2) / 1.4), atol=1e-15)


def test_slabs_of_diffuse_light_are_those_of_the_exact_stack():
    # Thick and index-matched: 5 mean free paths on 5, where light between them is all diffuse.
    upper, lower = layer(0.02, 0.98, 0.0, 1.0, 5.0), layer(0.05, 0.95, 0.0, 1.0, 5.0)
    grid = {"dr_mm": 0.1, "radius_mm": 40.0, "tolerance": 2e-3}
    one, two, both = simulate_exact_many(
        [stack(*each) for each in ([upper], [lower], [upper, lower])], **grid
    )

    def slab(profile):
        edges = profile.r_edges_mm
        r = profile.annulus_energy[:, 0], profile.beyond_grid[0]
        t = profile.annulus_transmittance[:, 0], profile.beyond_grid_transmittance[0]
        return GaussianSlab.symmetric(*(GaussianSum.fitted(edges, *each) for each in (r, t)))

    found = combined(slab(one), slab(two))
    assert found.reflected.total == pytest.approx(both.diffuse_reflectance[0], rel=0.03)
    assert found.transmitted.total == pytest.approx(both.transmittance[0], rel=0.3)
    apart = found.reflected.cumulative(both.r_edges_mm) - both.cumulative[:, 0]
    assert np.abs(apart).max() < 0.02 * both.diffuse_reflectance[0]


def test_a_fit_keeps_energy_and_shape():
    edges = np.linspace(0.0, 8.0, 200)
    true = GaussianSum.of([0.3, 0.2, 0.1], [0.05, 0.4, 2.5])
    energy = np.diff(true.cumulative(edges))
    found = GaussianSum.fitted(edges, energy, true.total - energy.sum())
    assert found.total == pytest.approx(0.6)
    np.testing.assert_allclose(found.cumulative(edges), true.cumulative(edges), atol=2e-3)


def test_bad_input_gets_one_line():
    for weights, variances in (([1.0, 2.0], [1.0]), (np.nan, 1.0), (1.0, -0.1), (1.0, np.inf)):
        with pytest.raises(SimulationError, match="variance"):
            GaussianSum.of(weights, variances)
    mirror = GaussianSlab.symmetric(GaussianSum.of(1.0, 1.0), GaussianSum.of(0.0, 1.0))
    with pytest.raises(SimulationError, match="expected less than 1"):
        combined(mirror, mirror)


def test_slabs_that_return_nearly_all_the_light_to_each_other_are_summed_to_the_end():
    mirror = GaussianSum.of([0.4, 0.5995], [0.01, 0.2])
    slab = GaussianSlab.symmetric(mirror, GaussianSum.of(5e-4, 0.3))
    found = combined(slab, slab)
    r, t = mirror.transform(K), slab.transmitted.transform(K)
    np.testing.assert_allclose(found.transmitted.transform(K), t * t / (1.0 - r * r), atol=1e-10)
