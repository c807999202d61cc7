"""Wavenumbers at which a slab's T(k) cannot be computed, and a curve across them.

Light that crosses a slab of thickness d in direction theta comes with a phase k d tan(theta), which
turns from one of N directions to the next by more than half a circle where k d > N: sums over
directions then are noise, of 1e-3 of a thin slab's T, and likewise in azimuth. Further up only the
lowest layer is seen, and it may go on without end, which needs no such phase. Between the two,
T(k) k^2 is a smooth curve.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.optics import lagrange_shares

_RESOLVED = 0.8  # k d / N up to which polar directions resolve the phase: T is off by 1e-5 there
_AZIMUTHS = 2.2  # k d up to which directions in azimuth do, for each of a quarter, 5 or more
_BESIDE = 1.25  # ratio of the wavenumbers on either side, two each, that the curve goes through


def resolved(count: int, azimuths: int) -> float:
    """Return k d up to which so many directions are enough for light that crosses a slab."""
    return min(_RESOLVED * count, _AZIMUTHS * azimuths)


@dataclass(frozen=True)
class Gap:
    """A range of wavenumbers [1/mm], and the transform beside it."""

    first: float
    last: float
    transform: Callable[[float], float]

    def __contains__(self, k: float) -> bool:
        return self.first < k < self.last

    def __call__(self, k: float) -> float:
        """Return the transform by Lagrange's cubic for T k^2 in log k."""
        at, values = self._known
        shares = lagrange_shares(at, np.array([math.log(k)]))[:, 0]
        return float(sum(values * shares)) / k**2

    @cached_property
    def _known(self) -> tuple[FloatArray, FloatArray]:
        k = (self.first / _BESIDE, self.first, self.last, self.last * _BESIDE)
        values = np.array([self.transform(each) * each**2 for each in k])
        return np.log(k), values
