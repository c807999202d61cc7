"""Transforms with many directions: those with few, and what more directions change.

R(k) bends, and wants some 70 wavenumbers. What more directions change is small and smooth, and a
third of them shows it: F(r) of a two-layer skin is off by 3e-6 of the light for it. Below a clear
layer neither is smooth, as some directions cross it for ever; all wavenumbers then get all of them.
"""

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.simulate.stack.azimuth import FEWEST
from sssfit.simulate.stack.quarter import Each, highest_of
from sssfit.simulate.stack.sampling import Family, Sampler
from sssfit.simulate.stack.transform import Wavenumbers, refined

_PER_DECADE = 3  # wavenumbers of a change at first, half of those of a transform


def ready(family: Family, count: int, azimuths: int) -> Sampler:
    """Return a sampler whose stacks are made before several threads ask for them."""
    sampler = Sampler(family, count, azimuths)
    sampler.assemblies  # noqa: B018
    return sampler


class Changes:
    """Transforms of a family with any directions, on wavenumbers that two samplers choose.

    Parameters
    ----------
    family : Family
    few : int
        Directions that most wavenumbers are solved for, with the fewest in azimuth.
    more : Sampler
        The first one that is asked for.
    miss : float
        Largest miss of a spline between two wavenumbers, of the transforms and of the change.
    each : callable
        Maps a function over wavenumbers.
    """

    def __init__(self, family: Family, few: int, more: Sampler, miss: float, each: Each) -> None:
        most, careful = highest_of(more), 2.0 / family.longest
        span = family.least_wavenumber, most, miss, careful
        self._each, self._more = each, more
        self._few = more if family.has_clear_layers else ready(family, few, FEWEST)
        self._waves = refined(lambda k: each(self._few.at, k), *span)
        if self._few is more:
            self._first = self._on(more, self._waves.k)
        else:
            self._first = refined(lambda k: self._change(more, k), *span, _PER_DECADE)

    def whole(self, sampler: Sampler) -> tuple[Wavenumbers, Wavenumbers]:
        """Return the transforms, and what every other wavenumber makes of them."""
        first = self._first
        change = first if sampler is self._more else self._on(sampler, first.k)
        return self._waves.plus(change), self._waves.halved().plus(change.halved())

    def halved(self, sampler: Sampler) -> Wavenumbers:
        """Return the second of `whole` alone."""
        return self._waves.halved().plus(self._on(sampler, self._first.halved().k))

    def _on(self, sampler: Sampler, k: FloatArray) -> Wavenumbers:
        return Wavenumbers(k, self._change(sampler, k), self._waves.bend)

    def _change(self, sampler: Sampler, k: FloatArray) -> FloatArray:
        """Return what a sampler's transforms differ by from those with few directions (n, C)."""
        if sampler == self._few:
            return np.zeros((k.size, self._waves.values.shape[1]))
        return self._each(sampler.at, k) - self._waves(k)
