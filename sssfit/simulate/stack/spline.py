"""A cubic spline through samples of several curves at once.

The one of ``scipy.interpolate`` without what is imported with it, 0.5 s: more than a tenth of what
a two-layer skin takes.
"""

from dataclasses import dataclass

import numpy as np

from sssfit.arrays import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Spline:
    """Cubic polynomials between ``knots`` (n,), ``coefficients`` (4, n - 1, C), highest first."""

    knots: FloatArray
    coefficients: FloatArray

    @classmethod
    def through(cls, x: FloatArray, values: FloatArray) -> "Spline":
        """Return the spline with two continuous derivatives through (n,) and (n, C), n from 4 up.

        At either end two intervals have one polynomial ("not-a-knot"; de Boor 1978, "A Practical
        Guide to Splines", chapter IV, eq. 8).
        """
        h = np.diff(x)
        rise = np.diff(values, axis=0) / h[:, None]
        slopes = np.linalg.solve(_continuity(h), _jumps(h, rise))
        second = (3.0 * rise - 2.0 * slopes[:-1] - slopes[1:]) / h[:, None]
        third = (slopes[:-1] + slopes[1:] - 2.0 * rise) / h[:, None] ** 2
        return cls(x, np.stack((third, second, slopes[:-1], values[:-1])))

    def __call__(self, x: FloatArray) -> FloatArray:
        """Return the curves (..., C) at any x (...); outside, those of the outermost intervals."""
        place = np.clip(np.searchsorted(self.knots, x) - 1, 0, self.knots.size - 2)
        third, second, first, value = self.coefficients[:, place]
        t = (x - self.knots[place])[..., None]
        found: FloatArray = ((third * t + second) * t + first) * t + value
        return found


def _continuity(h: FloatArray) -> FloatArray:
    """Return the matrix (n, n) of the slopes: continuous second derivatives, and the two ends."""
    n, inner = h.size + 1, np.arange(1, h.size)
    found = np.zeros((n, n))
    found[inner, inner - 1], found[inner, inner + 1] = h[1:], h[:-1]
    found[inner, inner] = 2.0 * (h[:-1] + h[1:])
    found[0, :2] = h[1], h[0] + h[1]
    found[-1, -2:] = h[-1] + h[-2], h[-2]
    return found


def _jumps(h: FloatArray, rise: FloatArray) -> FloatArray:
    """Return the right-hand sides (n, C) for the steepness (n - 1, C) between the knots."""
    found = np.empty((h.size + 1, rise.shape[1]))
    found[1:-1] = 3.0 * (h[1:, None] * rise[:-1] + h[:-1, None] * rise[1:])
    for end, near, far in ((0, 0, 1), (-1, -1, -2)):
        both = h[near] + h[far]
        found[end] = (h[near] + 2.0 * both) * h[far] * rise[near] + h[near] ** 2 * rise[far]
        found[end] /= both
    return found
