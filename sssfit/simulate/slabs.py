"""Slabs whose reflectance and transmittance are sums of Gaussians, put on one another.

Section 2 of Jimenez and Gutierrez 2008, "Faster rendering of human skin", after d'Eon, Luebke and
Enderton 2007: the radial convolution of two Gaussians is G(v1) * G(v2) = G(v1 + v2), so the
convolutions and sums of Donner and Jensen 2005 are products and sums of polynomials:

    R = R1 + T1 R2 T1' (1 + R1' R2 + (R1' R2)^2 + ...),    T = T1 T2 (1 + R1' R2 + ...)

R1' and T1' are for light from below. Light that comes to a slab from another one is treated as if
it came along the normal, like the beam that the slab's own profile is of.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray
from sssfit.errors import SimulationError
from sssfit.optics import lagrange_shares
from sssfit.shapes import gaussian_cdf, gaussian_density

_MOST = 250  # Gaussians of a sum; more are put on a grid of variances
_STEP = 0.03  # of the grid, in log v: with eight neighbours a transform is off by 2e-13
_NEIGHBOURS = np.arange(-3, 5)
_SPOT = 1e-200  # mm^2, in place of the variance 0
_LEAST = 1e-14  # share of the light in a further reflection that is left out
_PER_DECADE = 8  # variances that a profile is fitted with


@dataclass(frozen=True, slots=True, eq=False)
class GaussianSum:
    """A radial profile sum_i w_i G(v_i, r) with G(v, r) = exp(-r^2 / 2v) / (2 pi v).

    Parameters
    ----------
    weights : (n,) [1]
        Energy of each Gaussian; any sign.
    variances : (n,) [mm^2]
        Variance per axis, 0 or more; 0 is light at r = 0.
    """

    weights: FloatArray
    variances: FloatArray

    @classmethod
    def of(cls, weights: npt.ArrayLike, variances: npt.ArrayLike) -> GaussianSum:
        """Check the values, and put more than 250 Gaussians on a grid of variances.

        Raises
        ------
        SimulationError
            The numbers of both differ, or one is not finite, or a variance is below 0.
        """
        w, v = (np.atleast_1d(np.asarray(each, np.float64)) for each in (weights, variances))
        if w.shape != v.shape or w.ndim != 1:
            raise SimulationError(f"{w.size} weights and {v.size} variances; expected as many.")
        if not (np.isfinite(w).all() and np.isfinite(v).all() and (v >= 0.0).all()):
            raise SimulationError("weights and variances are finite, and no variance is below 0.")
        return cls(*_merged(w, v))

    @classmethod
    def fitted(cls, edges_mm: FloatArray, energy: FloatArray, beyond: float = 0.0) -> GaussianSum:
        """Fit positive weights of Gaussians, eight a decade of variance, to energies of annuli.

        Parameters
        ----------
        edges_mm : (m + 1,) [mm]
            Edges, the first 0.
        energy : (m,)
            Energy of each annulus.
        beyond : float
            Energy beyond the last edge.
        """
        from scipy.optimize import nnls

        low, high = (0.1 * edges_mm[1]) ** 2, edges_mm[-1] ** 2
        count = int(np.ceil(_PER_DECADE * np.log10(high / low))) + 1
        variances = np.geomspace(low, high, count)
        inside = np.diff(gaussian_cdf(edges_mm[:, None], variances), axis=0)
        rows = np.vstack((inside, 1.0 - inside.sum(axis=0)))
        # Unit error of R_d, weighted with r: an annulus's energy by the root of its radius.
        middle = 0.5 * (edges_mm[1:] + edges_mm[:-1])
        scale = np.sqrt(np.append(1.0 / middle, 1.0 / edges_mm[-1]))
        energies = np.append(energy, beyond)
        weights, _ = nnls(rows * scale[:, None], energies * scale, maxiter=100 * count)
        weights *= energies.sum() / max(float(weights.sum()), 1e-300)
        return cls.of(weights[weights > 0.0], variances[weights > 0.0])

    @property
    def total(self) -> float:
        """All of its energy."""
        return float(self.weights.sum())

    def __add__(self, other: GaussianSum) -> GaussianSum:
        """Return the sum of two profiles."""
        return GaussianSum(
            *_merged(
                np.append(self.weights, other.weights), np.append(self.variances, other.variances)
            )
        )

    def __mul__(self, other: GaussianSum) -> GaussianSum:
        """Return the convolution in the plane: weights multiply, variances add."""
        weights = np.outer(self.weights, other.weights).ravel()
        variances = np.add.outer(self.variances, other.variances).ravel()
        return GaussianSum(*_merged(weights, variances))

    def density(self, r_mm: npt.ArrayLike) -> FloatArray:
        """Return the profile at radii above 0 [1/mm^2]."""
        is_wide = self.variances > 0.0
        wide = gaussian_density(np.asarray(r_mm)[..., None], self.variances[is_wide])
        return wide @ self.weights[is_wide]

    def cumulative(self, r_mm: npt.ArrayLike) -> FloatArray:
        """Return the energy within radii."""
        return (
            gaussian_cdf(np.asarray(r_mm)[..., None], np.maximum(self.variances, _SPOT))
            @ self.weights
        )

    def transform(self, k_per_mm: npt.ArrayLike) -> FloatArray:
        """Return the integral of 2 pi r R(r) J0(k r): sum_i w_i exp(-v_i k^2 / 2)."""
        k2 = np.square(np.asarray(k_per_mm, np.float64))[..., None]
        found: FloatArray = np.exp(-0.5 * k2 * self.variances) @ self.weights
        return found


@dataclass(frozen=True, slots=True, eq=False)
class GaussianSlab:
    """A slab by what it does with a beam from above, and (``_up``) with one from below."""

    reflected: GaussianSum
    transmitted: GaussianSum
    reflected_up: GaussianSum
    transmitted_up: GaussianSum

    @classmethod
    def symmetric(cls, reflected: GaussianSum, transmitted: GaussianSum) -> GaussianSlab:
        """Return a slab that is the same upside down, as one layer between equal media is."""
        return cls(reflected, transmitted, reflected, transmitted)


def combined(upper: GaussianSlab, lower: GaussianSlab) -> GaussianSlab:
    """Put one slab on another.

    Raises
    ------
    SimulationError
        The two return all light to each other, R1' R2 >= 1, and the sum does not end.

    Examples
    --------
    >>> half = GaussianSlab.symmetric(GaussianSum.of(0.5, 1.0), GaussianSum.of(0.5, 2.0))
    >>> whole = combined(half, half)
    >>> round(whole.reflected.total, 12), round(whole.transmitted.total, 12)
    (0.666666666667, 0.333333333333)
    """
    between = _repeated(upper.reflected_up * lower.reflected)
    down, up = upper.transmitted * between, lower.transmitted_up * between
    return GaussianSlab(
        upper.reflected + down * lower.reflected * upper.transmitted_up,
        down * lower.transmitted,
        lower.reflected_up + up * upper.reflected_up * lower.transmitted,
        up * upper.transmitted_up,
    )


def _repeated(once: GaussianSum) -> GaussianSum:
    """Return 1 + x + x^2 + ... of a product of two reflectances."""
    size = _largest(once)
    if size >= 1.0:
        raise SimulationError(
            f"two slabs return {size:.6g} of the light between them to it; expected less than 1."
        )
    found, power = GaussianSum(np.ones(1), np.zeros(1)), once
    left, returned = size / (1.0 - size), size
    while left > _LEAST:  # (1 + x) (1 + x^2) (1 + x^4) ...
        found = found + found * power
        left *= returned
        power, returned = power * power, returned * returned
    return found


def _largest(profile: GaussianSum) -> float:
    """Return the largest value of a transform; weights on a grid of variances have both signs."""
    widths = np.sqrt(profile.variances[profile.variances > 0.0])
    low, high = (0.01 / widths.max(), 10.0 / widths.min()) if widths.size else (1.0, 1.0)
    at = np.append(0.0, np.geomspace(low, high, 200))
    return float(np.abs(profile.transform(at)).max())


def _merged(weights: FloatArray, variances: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Put many Gaussians on a grid of log v, each on its eight neighbours by Lagrange's formula."""
    is_spot = variances == 0.0
    if variances.size <= _MOST or is_spot.all():
        return weights, variances
    spot = float(weights[is_spot].sum())
    w, x = weights[~is_spot], np.log(variances[~is_spot]) / _STEP
    first = np.floor(x).astype(np.intp)
    origin = int(first.min()) + int(_NEIGHBOURS[0])
    size = int(first.max()) + int(_NEIGHBOURS[-1]) - origin + 1
    grid = np.zeros(size)
    for at, share in zip(_NEIGHBOURS, lagrange_shares(_NEIGHBOURS, x - first), strict=True):
        grid += np.bincount(first - origin + at, w * share, minlength=size)
    held = np.flatnonzero(grid)
    return np.append(spot, grid[held]), np.append(0.0, np.exp(_STEP * (held + origin)))
