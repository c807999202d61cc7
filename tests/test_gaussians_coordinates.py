"""Gaussians in few coordinates: the same objective as on annuli, and the same sums."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from sssfit.fit._gaussians_basis import basis_of
from sssfit.fit._gaussians_objective import make_annuli
from sssfit.fit._gaussians_search import local_minimum
from sssfit.shapes import gaussian_cdf

BOUNDS = (2.0 * np.log(0.005), 2.0 * np.log(12.0))


def annuli_of(total=None, signed=False, noise=0.0, count=600, seed=1):
    """Three Gaussians and a 1/r near the beam, with the noise of so many photons."""
    edges_mm = np.linspace(0.0, 12.0, count + 1)
    within = [w * gaussian_cdf(edges_mm, v) for w, v in ((0.2, 0.01), (0.2, 0.3), (0.1, 4.0))]
    energy = np.diff(sum(within) + 0.05 * (1.0 - np.exp(-edges_mm)))
    if noise:
        energy = np.random.default_rng(seed).poisson(energy * noise) / noise
    return make_annuli(edges_mm, energy, total, signed=signed)


@pytest.mark.parametrize("count", [6, 40, 600])
@pytest.mark.parametrize("signed", [False, True])
@pytest.mark.parametrize("total", [None, 1.0, 1.02])
def test_coordinates_have_the_point_that_annuli_have(count, signed, total):
    """Of widths from a quarter of an annulus on, as fits have them."""
    annuli = annuli_of(total, signed, count=count)
    bounds = 2.0 * np.log(3.0 / count), BOUNDS[1]
    few = annuli.within(bounds)
    for seed in range(8):
        rng = np.random.default_rng(seed)
        x = np.sort(rng.uniform(*bounds, min(1 + seed, count // 2)))
        wanted, found = annuli.at(x), few.at(x)
        if not np.isfinite(wanted.cost):
            assert not np.isfinite(found.cost)
            continue
        assert found.cost == pytest.approx(wanted.cost, rel=1e-9, abs=1e-20)
        np.testing.assert_allclose(found.weights, wanted.weights, rtol=1e-5, atol=1e-9)
        size = np.linalg.norm(wanted.jacobian) or 1.0
        gradients = [each.jacobian.T @ each.residual for each in (found, wanted)]
        np.testing.assert_allclose(*gradients, atol=1e-9 * size)
        products = [each.jacobian.T @ each.jacobian for each in (found, wanted)]
        np.testing.assert_allclose(*products, atol=1e-9 * size**2)


def test_a_basis_has_every_gaussian_to_rounding():
    annuli = annuli_of()
    basis = basis_of(annuli.inner, annuli.width, BOUNDS)
    assert basis.vectors.shape[1] < 80
    root = np.sqrt(2.0 * np.pi * annuli.width[:, 0])
    for log_variance in np.linspace(*BOUNDS, 57):
        inverse = np.exp(-log_variance)
        energy = -np.exp(-annuli.inner[:, 0] * inverse) * np.expm1(-annuli.width[:, 0] * inverse)
        column = energy / root
        assert basis.split(column)[-1] < 1e-13 * np.linalg.norm(column)


@pytest.mark.parametrize("noise", [0.0, 1e3, 1e5])
@pytest.mark.parametrize("total", [None, 1.01])
def test_a_descent_ends_where_one_over_all_annuli_ends(noise, total):
    """From starts such as a search has, with light at every variance: else rounding decides."""
    annuli = annuli_of(total, noise=noise)
    for seed in range(12):
        rng = np.random.default_rng(seed)
        start = np.array([-4.6, -1.2, 1.3])[: 1 + seed % 3] + rng.uniform(-0.5, 0.5, 1 + seed % 3)
        wanted = least_squares(
            lambda x: annuli.at(x).residual,
            start,
            lambda x: annuli.at(x).jacobian,
            BOUNDS,
            x_scale=1.5,
            ftol=1e-8,
            xtol=1e-9,
            gtol=None,
        )
        point = local_minimum(annuli, start, BOUNDS)
        assert point.cost == pytest.approx(2.0 * wanted.cost, rel=1e-9)
        np.testing.assert_allclose(point.log_variances, wanted.x, atol=1e-7)
