"""From transforms on a few wavenumbers to F(r): a spline in between, and a Hankel integral.

F(r) = r int_0^inf f(k) J1(k r) dk for a transform f with f(0) = F(inf).
"""

import functools
import math
from collections.abc import Callable

import numpy as np
from scipy.special import j0, j1

from sssfit.arrays import FloatArray
from sssfit.optics import gauss_legendre
from sssfit.simulate.stack.spline import Spline

_GROWTH = 1.15  # of panels in k near 0
_PANEL = 6.0  # largest width of a panel, in 1 / r: 8 nodes give J1 to 1e-9 on it
_NODES = 8
_LEAST_RATIO = 1.04  # of two wavenumbers with another in between
_SAME = 1e-6  # share by which two wavenumbers may differ and count as one
_FAR = 30.0  # from here on, the asymptotic series of the tail's integral is used
_ENDS = np.geomspace(1e-7, _FAR, 200)  # panels of its integral below, which grow by a tenth
_OF_A_PANEL = 12  # nodes


class Wavenumbers:
    """Samples (n,) of transforms (n, C) between wavenumbers 0 and K, C of them at once.

    The spline is one in asinh(k / k0), which is even in k near 0 and logarithmic above.
    """

    def __init__(self, k: FloatArray, values: FloatArray, bend: float) -> None:
        self.k, self.values, self.bend = k, values, bend
        self._spline = Spline.through(np.arcsinh(k / bend), values)

    def __call__(self, k: FloatArray) -> FloatArray:
        """Return the transforms at any wavenumbers up to K, (..., C)."""
        found: FloatArray = self._spline(np.arcsinh(k / self.bend))
        return found

    def halved(self) -> "Wavenumbers":
        """Return the same from every other wavenumber, and the two ends, to judge the spline."""
        kept = np.unique(np.append(np.arange(0, self.k.size, 2), self.k.size - 1))
        return Wavenumbers(self.k[kept], self.values[kept], self.bend)

    def plus(self, others: "Wavenumbers") -> "Wavenumbers":
        """Return the sum of two, on the wavenumbers of both; their ends are the same."""
        k = np.union1d(self.k, others.k)
        k = k[np.append(True, np.diff(k) > _SAME * k[1:])]
        return Wavenumbers(k, self(k) + others(k), self.bend)

    def cumulative(self, radii: FloatArray) -> FloatArray:
        """Return F at radii above 0, (n, C)."""
        inside = np.stack([self._inside(float(r)) for r in radii])
        return inside + self._tail(radii)

    def _inside(self, r: float) -> FloatArray:
        """Return r int_0^K f J1(k r) dk by Gauss's rule on panels of at most 6 / r."""
        k, weight = _panels(float(self.k[1]), float(self.k[-1]), _PANEL / r)
        found: FloatArray = r * ((weight * j1(k * r)) @ self(k))
        return found

    def _tail(self, radii: FloatArray) -> FloatArray:
        """Return r int_K^inf (c2 k^-2 + c3 k^-3) J1(k r) dk, fitted at K and K / 2."""
        last = float(self.k[-1])
        at_last, at_half = self.values[-1] * last**2, self(np.array(0.5 * last)) * 0.25 * last**2
        c2, c3 = 2.0 * at_last - at_half, (at_half - at_last) * last
        x = last * radii
        squares, cubes = radii**2 * bessel_tail(2, x), radii**3 * bessel_tail(3, x)
        found: FloatArray = squares[:, None] * c2 + cubes[:, None] * c3
        return found


def refined(
    sample: Callable[[FloatArray], FloatArray],
    least: float,
    most: float,
    tolerance: float,
    careful_below: float,
    per_decade: int = 6,
) -> Wavenumbers:
    """Sample transforms on wavenumbers that are bisected where the spline misses the middle.

    Parameters
    ----------
    sample : callable
        From wavenumbers (m,) to transforms (m, C); called with many at once.
    least, most : float [1/mm]
        The first wavenumber above 0, and the last.
    tolerance : float
        Largest miss; below ``careful_below`` [1/mm], where a transform is cheap to compute and the
        far tail of R_d(r) is made, in proportion to k, down to a 30th of it.
    """
    count = math.ceil(per_decade * math.log10(most / least)) + 1
    k = np.append(0.0, np.geomspace(least, most, count))
    values, bend = sample(k), 3.0 * least
    open_ends = list(zip(k[1:-1].tolist(), k[2:].tolist(), strict=True))
    while open_ends:
        spline = Wavenumbers(k, values, bend)
        middles = np.sqrt([a * b for a, b in open_ends])
        found = sample(middles)
        miss = np.max(np.abs(found - spline(middles)), axis=1)
        allowed = tolerance * np.clip(middles / careful_below, 1.0 / 30.0, 1.0)
        k, values = np.append(k, middles), np.concatenate((values, found))
        order = np.argsort(k)
        k, values = k[order], values[order]
        # The rule in phi changes its order at some k; bisection would not end at such a step.
        wide = [b / a > _LEAST_RATIO for a, b in open_ends]
        open_ends = [
            half
            for (a, b), m, again in zip(open_ends, middles, (miss > allowed) & wide, strict=True)
            if again
            for half in ((a, float(m)), (float(m), b))
        ]
    return Wavenumbers(k, values, bend)


def bessel_tail(p: int, x: FloatArray) -> FloatArray:
    """Return int_x^inf J1(t) t^-p dt."""
    inside = np.clip(x, _ENDS[0], _FAR)
    place = np.clip(np.searchsorted(_ENDS, inside), 1, _ENDS.size - 1)
    near = _tails(p)[place] + _between(p, inside, _ENDS[place])
    return np.where(x < _FAR, near, _far_tail(p, np.maximum(x, _FAR)))


@functools.cache
def _tails(p: int) -> FloatArray:
    """Return the integral from each end of a panel to infinity."""
    parts = np.append(_between(p, _ENDS[:-1], _ENDS[1:]), _far_tail(p, _ENDS[-1:]))
    found: FloatArray = np.cumsum(parts[::-1])[::-1]
    return found


def _between(p: int, a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the integral from a to b (n,), which lie on one panel, to rounding."""
    t, weight = gauss_legendre(_OF_A_PANEL)
    width = (b - a)[:, None]
    nodes = a[:, None] + width * t
    found: FloatArray = np.sum(width * weight * j1(nodes) / nodes**p, axis=1)
    return found


def _far_tail(p: int, x: FloatArray, terms: int = 6) -> FloatArray:
    """Return the integral by I_p = x^-p J0 + p x^-(p + 1) J1 - p (p + 2) I_(p + 2), repeated."""
    if terms == 0:
        return np.zeros_like(x)
    rest = _far_tail(p + 2, x, terms - 1)
    found: FloatArray = x**-p * j0(x) + p * x ** (-p - 1.0) * j1(x) - p * (p + 2) * rest
    return found


def _panels(first: float, last: float, widest: float) -> tuple[FloatArray, FloatArray]:
    """Return nodes and weights over [0, last]: panels grow by 15 %, then are as wide as allowed."""
    first = min(first, last)
    near = np.linspace(0.0, first, math.ceil(first / widest) + 1)
    to = min(max(widest / (_GROWTH - 1.0), first), last)
    growing = np.geomspace(first, to, math.ceil(math.log(to / first) / math.log(_GROWTH)) + 1)
    far = np.linspace(to, last, math.ceil((last - to) / widest) + 1)
    ends = np.concatenate((near, growing[1:], far[1:]))
    t, weight = gauss_legendre(_NODES)
    width = np.diff(ends)[:, None]
    return (ends[:-1, None] + width * t).ravel(), (width * weight).ravel()
