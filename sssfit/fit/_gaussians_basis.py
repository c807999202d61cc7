"""The Gaussians of one grid of annuli in a few coordinates, in place of its thousand annuli.

Energies of Gaussians in annuli vary smoothly with the logarithm of the variance, so all those of a
grid lie, to rounding, in a space of some fifty dimensions. Sums of squares keep their value in any
orthonormal basis of it, and what the target has outside of the space no Gaussian changes: that is
one more coordinate, of its norm.

The coordinates of a Gaussian of variance v are e^(-t/2) P(t), t = log v, with a Chebyshev series P
on each of equal parts of the range: the factor e^(t/2) makes norms of Gaussians nearly equal, so
each has the same relative error. As functions of t they are bounded as far as pi / 2 off the real
axis, so a series of 20 on a part 1 wide is exact to 1e-16.
"""

import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev

from sssfit.arrays import FloatArray

_NODES = 20
_RANK = 1e-16  # singular values over the largest


@dataclass(frozen=True, slots=True, eq=False)
class Basis:
    """A basis of the Gaussians of a grid, within bounds of the logarithm of variance.

    Parameters
    ----------
    vectors : array (n, K)
        Orthonormal; Gaussians' energies over the roots of annuli's areas lie in their space.
    series : array (2, parts, K, 20)
        Chebyshev coefficients, on equal parts of the range, of the coordinates times the root of
        the variance, and of their derivatives by its logarithm.
    bounds : (float, float)
    """

    vectors: FloatArray
    series: FloatArray
    bounds: tuple[float, float]

    def split(self, wanted: FloatArray) -> FloatArray:
        """Return a target's coordinates, and the norm of what lies outside of the space (K+1,)."""
        inside = self.vectors.T @ wanted
        return np.append(inside, np.linalg.norm(wanted - self.vectors @ inside))

    def columns(self, log_variances: FloatArray) -> FloatArray:
        """Return coordinates of unit Gaussians and their log derivatives (2, K+1, N)."""
        parts = self.series.shape[1]
        low, high = self.bounds
        inside_bounds = np.clip(log_variances, low, high)  # steps may end a rounding beyond
        places = parts * (inside_bounds - low) / (high - low)
        part = np.minimum(places.astype(int), parts - 1)
        angles = np.arccos(np.clip(2.0 * (places - part) - 1.0, -1.0, 1.0))
        waves = np.cos(angles[:, None] * np.arange(_NODES))
        inside = np.einsum("cnkd,nd->ckn", self.series[:, part], waves)
        out = np.zeros((2, inside.shape[1] + 1, part.size))
        out[:, :-1] = inside * np.exp(-0.5 * inside_bounds)
        return out


def basis_of(inner: FloatArray, width: FloatArray, bounds: tuple[float, float]) -> Basis:
    """Return the basis of a grid.

    Parameters
    ----------
    inner, width : array (n, 1) [mm^2]
        r0^2 / 2 and (r1^2 - r0^2) / 2 of each annulus.
    bounds : (float, float)
        Bounds of the logarithm of variance.
    """
    return _basis_of(inner.tobytes(), width.tobytes(), bounds)


@functools.lru_cache(maxsize=8)  # 1 MB each; channels share theirs, as walks on one grid do
def _basis_of(inner: bytes, width: bytes, bounds: tuple[float, float]) -> Basis:
    a, step = (np.frombuffer(each, dtype=np.float64)[:, None] for each in (inner, width))
    low, high = bounds
    parts = max(math.ceil(high - low), 1)
    each = (high - low) / parts
    angles = np.pi * (np.arange(_NODES) + 0.5) / _NODES
    middles = low + each * (np.arange(parts) + 0.5)
    energy = _energy(a, step, (middles[:, None] + 0.5 * each * np.cos(angles)).ravel())
    # Every second node: they lie .08 apart at most, and Gaussians change by a few percent.
    vectors, sizes, _ = np.linalg.svd(energy[:, ::2], full_matrices=False)
    vectors = vectors[:, sizes > _RANK * sizes[0]]
    values = (vectors.T @ energy).reshape(-1, parts, _NODES)
    waves = np.cos(np.arange(_NODES)[:, None] * angles) * (2.0 / _NODES)
    waves[0] *= 0.5
    series = values @ waves.T
    slopes = np.zeros_like(series)
    slopes[..., :-1] = chebyshev.chebder(series, axis=2, scl=2.0 / each)
    both = np.stack((series, slopes - 0.5 * series))
    return Basis(vectors, np.ascontiguousarray(both.transpose(0, 2, 1, 3)), bounds)


def _energy(a: FloatArray, step: FloatArray, log_variances: FloatArray) -> FloatArray:
    """Return energies over roots of areas, times the roots of the variances (n, N)."""
    inverse = np.exp(-log_variances)
    energy: FloatArray = -np.exp(-a * inverse) * np.expm1(-step * inverse)
    energy /= np.sqrt(2.0 * np.pi * step * inverse)
    return energy
