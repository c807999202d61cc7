"""No kernel of the same rank is nearer to the 2D kernel than the truncated decomposition."""

import functools

import numpy as np
import pytest

from sssfit.fit import METHODS
from sssfit.material import load_material
from sssfit.profile import full_kernel
from sssfit.simulate import simulate_dipole, simulate_exact, simulate_montecarlo

# Supports are short and pixels wide on purpose: fits say so, and the bound holds all the same.
pytestmark = pytest.mark.filterwarnings("ignore::sssfit.errors.SssfitWarning")

SUPPORT_MM = 6.0
GRID = {"dr_mm": 0.15, "radius_mm": 12.0}
PITCHES_MM = (0.3, 0.6)
# Method, settings, rank: a sum of N Gaussians has rank N, a kernel of one pass 1.
RIVALS = [
    *(("svd", {"rank": n}, n) for n in (1, 3)),
    *(("gaussians", {"terms": n}, n) for n in (1, 2, 4)),
    ("gaussians", {"terms": 3, "signed": True}, 3),
    ("gaussians", {"terms": 3, "free_energy": True}, 3),
    ("gaussians", {"terms": 2, "signed": True, "free_energy": True}, 2),
    *(("weighted", {"rank": n}, n) for n in (1, 3)),
    ("weighted", {"rank": 2, "spectrum": "white"}, 2),
    ("preintegrated", {}, 1),
    ("guided", {"k": 0.0}, 1),
    ("guided", {"k": 4.0}, 1),
    ("guided", {"centre_bound": 0.1}, 1),
    ("artist", {"target": "line"}, 1),
    ("artist", {"target": "kernel"}, 1),
    ("artist", {"near_mm2": 0.1, "far_mm2": 2.0, "weight": 0.5}, 1),
    ("falloff", {}, 1),
    ("falloff", {"width": 0.014, "strength": [0.8, 0.7, 0.7], "falloff": [0.6, 0.1, 0.1]}, 1),
    ("burley", {}, 1),
]


@functools.cache
def profile_of(kind):
    """skin1 on a coarse grid: with single scattering, smooth, or with noise."""
    skin1 = load_material("skin1")
    if kind == "montecarlo":
        return simulate_montecarlo(skin1, photons=2000, seed=1, **GRID)
    return (simulate_exact if kind == "exact" else simulate_dipole)(skin1, **GRID)


def fitted(kind, method, settings, pitch):
    return METHODS[method].fit(
        profile_of(kind), mm_per_pixel=pitch, support_mm=SUPPORT_MM, **settings
    )


@functools.cache
def least_errors(kind, pitch, rank):
    """The smallest errors that rank allows (C,): Eckart and Young, by numpy on the whole matrix."""
    half = round(SUPPORT_MM / pitch)
    errors = []
    for c in range(profile_of(kind).n_channels):
        quadrant = profile_of(kind).quadrant_kernel(pitch, half, channel=c)
        values = np.linalg.svd(full_kernel(quadrant), compute_uv=False)
        errors.append(np.linalg.norm(values[rank:]) / np.linalg.norm(values))
    return np.array(errors)


def literal_errors(kind, kernel):
    """||K - target|| / ||target|| of the whole matrices (C,)."""
    errors = []
    for c in range(len(kernel.channels)):
        quadrant = profile_of(kind).quadrant_kernel(
            kernel.mm_per_pixel, kernel.half_pixels, channel=c
        )
        wanted = full_kernel(quadrant)
        errors.append(np.linalg.norm(kernel.full(c) - wanted) / np.linalg.norm(wanted))
    return np.array(errors)


def test_every_method_is_among_the_rivals():
    assert {method for method, _, _ in RIVALS} == set(METHODS)


@pytest.mark.parametrize("pitch", PITCHES_MM)
@pytest.mark.parametrize("kind", ["exact", "dipole", "montecarlo"])
def test_keeping_the_optimal_energy_meets_the_bound(kind, pitch):
    for rank in (1, 2, 3, 4):
        kept = fitted(kind, "svd", {"rank": rank, "energy": "keep"}, pitch)
        np.testing.assert_allclose(
            kept.relative_frobenius_error, least_errors(kind, pitch, rank), rtol=1e-9, atol=1e-12
        )


@pytest.mark.parametrize("pitch", PITCHES_MM)
@pytest.mark.parametrize("kind", ["exact", "dipole", "montecarlo"])
@pytest.mark.parametrize(("method", "settings", "rank"), RIVALS, ids=str)
def test_no_kernel_of_the_same_rank_is_nearer(kind, pitch, method, settings, rank):
    kernel = fitted(kind, method, settings, pitch).kernel
    assert kernel.rank <= rank
    errors = literal_errors(kind, kernel)
    assert np.all(errors >= least_errors(kind, pitch, rank) * (1.0 - 1e-12))
    np.testing.assert_allclose(kernel.relative_frobenius_error, errors, rtol=1e-9)
