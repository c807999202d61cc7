"""A walk's profile without most of its noise: a penalised spline of log R_d over log r.

Annuli hold hits, so noise is known to be Poisson's, and R_d is known to be smooth. The spline's
coefficients maximise the likelihood of the hits less a penalty on their second differences (Eilers
and Marx 1996, "Flexible smoothing with B-splines and penalties"). No penalty falls on powers of r,
so 1/r near the beam stays; the strength with the least AIC lets as much structure through as the
noise leaves room for. A constant is not penalised either, so each channel keeps its energy.
"""

import dataclasses
from typing import NamedTuple

import numpy as np
from scipy import linalg
from scipy.interpolate import BSpline

from sssfit.arrays import FloatArray, check_record
from sssfit.errors import ProfileError
from sssfit.process import one_blas_thread
from sssfit.profile import Profile
from sssfit.profile.directions import of_all_annuli
from sssfit.profile.pixels import annulus_areas

_PIECES, _DEGREE = 40, 3  # of four decades of radius: ten a decade
_STRENGTHS = 10.0 ** np.arange(-3.0, 5.1, 0.5)
_STEPS, _CHANGE = 60, 1e-8  # of Newton's method; 5 to 15 are usual
_LARGEST_STEP = 3.0  # of a logarithm
_FEWEST = 1e-9  # hits: below, a logarithm means nothing


class _Spline(NamedTuple):
    """Hits (n,) that a spline expects, its coefficients, and its AIC less a constant."""

    hits: FloatArray
    coefficients: FloatArray
    aic: float


def smoothed(profile: Profile) -> Profile:
    """Return a walk's profile with its energies smoothed by their standard errors.

    Parameters
    ----------
    profile : Profile
        With photons and standard errors.

    Returns
    -------
    Profile
        On the same annuli; its standard errors are unknown, because annuli share their noise now.
        Light by exit angle is that of all annuli together.
        Its ``meta`` names the walk's fingerprint as ``smoothed_sha256``.

    Raises
    ------
    ProfileError
        The profile has no standard errors, or is under a beam, where annuli share photons.
    """
    check_record("profile", profile, Profile, ProfileError)
    stderr = profile.annulus_energy_stderr
    if profile.shares_photons:
        raise ProfileError(
            f"{profile.label}: the profile is under a beam, where each photon counts in many "
            "annuli, and their noise is not Poisson's; smooth the pencil beam's profile."
        )
    if profile.photons is None or not np.isfinite(stderr).all():
        lacks = "is of no photons" if profile.photons is None else "has no standard errors"
        raise ProfileError(
            f"{profile.label}: the profile {lacks}, and only a walk's noise can be smoothed; "
            "expected one of photons with standard errors."
        )
    with one_blas_thread():
        channels = [
            _smooth(profile.r_edges_mm, profile.annulus_energy[:, c], stderr[:, c] ** 2)
            for c in range(profile.n_channels)
        ]
    energy = np.stack(channels, axis=1)
    unknown = np.full(energy.shape, np.nan)
    meta = {**profile.meta, "smoothed_sha256": profile.sha256}
    # Energy by annulus and angle is not smoothed, so it would not add up to that of annuli.
    fields = of_all_annuli(profile) | {"annulus_energy": energy, "annulus_energy_stderr": unknown}
    return dataclasses.replace(profile, **fields, meta=meta)


def _smooth(edges_mm: FloatArray, energy: FloatArray, variance: FloatArray) -> FloatArray:
    """Return smooth energies of a channel, of the same sum."""
    if not variance.any():
        return energy
    per_hit = float(variance.sum() / energy.sum())
    hits, areas = energy / per_hit, annulus_areas(edges_mm)
    basis = _basis(edges_mm)
    start = np.full(basis.shape[1], np.log(hits.sum() / areas.sum()))
    best: _Spline | None = None
    for strength in _STRENGTHS[::-1]:  # each begins at the next stronger one's end
        found = _fitted(basis, hits, areas, strength, start)
        start = found.coefficients
        if best is None or found.aic < best.aic:
            best = found
    assert best is not None
    smooth: FloatArray = best.hits * (energy.sum() / best.hits.sum())
    return smooth


def _basis(edges_mm: FloatArray) -> FloatArray:
    """Return cubic B-splines over the logarithm of annuli's middle radii (n, J)."""
    middle = np.log(0.5 * (edges_mm[1:] + edges_mm[:-1]))
    step = (middle[-1] - middle[0]) / _PIECES
    knots = middle[0] + step * np.arange(-_DEGREE, _PIECES + _DEGREE + 1)
    knots[-_DEGREE - 1] = max(knots[-_DEGREE - 1], middle[-1])  # but for rounding
    return np.asarray(BSpline.design_matrix(middle, knots, _DEGREE).toarray())


def _fitted(
    basis: FloatArray, hits: FloatArray, areas: FloatArray, strength: float, start: FloatArray
) -> _Spline:
    """Maximise the penalised likelihood by Newton's method."""
    differences = np.diff(np.eye(basis.shape[1]), 2, axis=0)
    penalty = strength * differences.T @ differences
    penalty += _FEWEST * np.eye(len(penalty))  # where no annulus has a hit
    x = start
    for _ in range(_STEPS):
        expected = areas * np.exp(np.clip(basis @ x, -700.0, 700.0))
        slope = basis.T @ (hits - expected) - penalty @ x
        weighted = basis.T @ (expected[:, None] * basis)
        step = linalg.solve(weighted + penalty, slope, assume_a="pos")
        step *= min(1.0, _LARGEST_STEP / max(float(np.abs(step).max()), 1e-300))
        x = x + step
        if float(np.abs(step).max()) < _CHANGE:
            break
    expected = areas * np.exp(np.clip(basis @ x, -700.0, 700.0))
    freedom = float(np.trace(linalg.solve(weighted + penalty, weighted, assume_a="pos")))
    likelihood = float(hits @ np.log(np.maximum(expected, _FEWEST)) - expected.sum())
    return _Spline(expected, x, 2.0 * (freedom - likelihood))
