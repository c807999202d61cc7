"""How many directions in azimuth a family of stacks needs.

Light that crosses a layer of thickness d comes with a phase k d tan(theta) cos(phi), and what its
bottom returns with twice that. In a layer of many optical depths little of it comes through; in one
of .4, five directions a quarter leave an error of 6e-4 of F(r), which more polar directions keep,
and in a half space up to 1e-5. So azimuths are chosen on their own: with few polar directions, the
difference between two rules is the error of the smaller.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.simulate.stack.azimuth import FEWEST
from sssfit.simulate.stack.sampling import Family, Sampler
from sssfit.simulate.stack.transform import Wavenumbers

Each = Callable[[Callable[[float], FloatArray], FloatArray], FloatArray]

AZIMUTHS = (FEWEST, 7, 9, 13, 17)
_POLAR = 8  # directions on either side: the difference of two rules in azimuth hardly needs more
_POLAR_BACK = 16  # where a layer scatters back: with 8, g = -.7 seems off by a fifth of what it is
_SHORT = 1.4  # then the larger rule is off too, by a quarter of what the smaller is
_PER_DECADE = 6  # wavenumbers; with 4, a milk on glass got too few directions: F off by 9e-5
_HIGHEST = 20.0  # largest wavenumber, in the largest extinctions; F is off by 9e-5 with 10
_STEEPEST = 1e-2  # least 1 + g
_HIGHEST_BACK = 5.0  # of it times 1 + g: with 1, a half space of g = -.95 is off by 5e-4
_ALIKE = 1.0  # k of one mean free path below which rules differ by 1e-9, without clear layers
_RADII = 60  # at which the error of F is found, and taken as linear in log r in between
_ROUNDING = 1e-4  # of T(0): T(k) below this is rounding of the directions, and counts as 0
_PART = 0.3  # of the tolerance, which polar directions and wavenumbers share
_PART_BELOW = 1.0  # of it in light from below, where polar directions differ too: N - 4 sees those
_MOST_BELOW = 7  # directions that T asks for: with more, 8 polar ones leave the same difference


@dataclass(frozen=True, slots=True, eq=False)
class Quarter:
    """The number of directions in azimuth, and what F is off by with it.

    ``errors`` are those of F above and below at the radii of each stack, and of the total (n + 1,);
    ``share`` is the largest above as one of the light that leaves, and ``below`` that of light from
    below; ``worst`` is the number of the stack with the largest. Where light is scattered ahead,
    the errors below are zeros: N - 4 polar directions see them.
    """

    count: int
    errors: list[tuple[FloatArray, FloatArray]]
    share: float
    below: float
    worst: int

    def suits(self, tolerance: float) -> bool:
        """Return whether the errors are small beside a tolerance."""
        is_done = self.count >= _MOST_BELOW or self.below <= _PART_BELOW * tolerance
        return is_done and self.share <= _PART * tolerance


def quarter_of(family: Family, radii: list[FloatArray], tolerance: float, each: Each) -> Quarter:
    """Return the fewest directions in azimuth that leave 0.3 of a tolerance, or the most.

    Parameters
    ----------
    family, radii, tolerance, each
        As in ``solution.steps``.
    """
    polar = _POLAR_BACK if family.scatters_back else _POLAR
    samplers = (Sampler(family, polar, count) for count in AZIMUTHS)
    values = (_Sampled.of(sampler, each) for sampler in samplers)
    for fewer, more in pairwise(values):
        found = _compared(fewer, more, radii)
        if found.suits(tolerance):
            break
    return found


@dataclass(frozen=True, slots=True, eq=False)
class _Sampled:
    """R(k) and T(k) of all stacks in turn (n, 2 stacks), and the light that leaves each."""

    sampler: Sampler
    k: FloatArray
    values: FloatArray
    leaving: FloatArray

    @classmethod
    def of(cls, sampler: Sampler, each: Each) -> "_Sampled":
        family, most = sampler.family, highest_of(sampler)
        least = family.least_wavenumber if family.has_clear_layers else _ALIKE / family.longest
        many = math.ceil(_PER_DECADE * math.log10(most / least)) + 1
        k = np.geomspace(least, most, many)
        values, zero = each(sampler.at, k), sampler.at_zero()
        for number, total in enumerate(zero):
            below = values[:, 2 * number + 1 : 2 * number + 2]
            below[:] = without_rounding(below, total.transmitted)
        beams = [assembly.beam.transmitted for assembly in sampler.assemblies]
        leaving = [t.reflected + t.transmitted + b for t, b in zip(zero, beams, strict=True)]
        return cls(sampler, k, values, np.array(leaving))


def _compared(fewer: _Sampled, more: _Sampled, radii: list[FloatArray]) -> Quarter:
    """Return the errors of the smaller of two rules."""
    least = float(fewer.k[0])
    k = np.concatenate(([0.0, 0.5 * least], fewer.k))
    apart = Wavenumbers(k, np.pad(more.values - fewer.values, ((2, 0), (0, 0))), least)
    is_back = fewer.sampler.family.scatters_back
    errors = [(_SHORT if is_back else 1.0) * _at(apart, own) for own in radii]
    above = [error[:, 2 * number] for number, error in enumerate(errors)]
    below = [error[:, 2 * number + 1] for number, error in enumerate(errors)]
    shares = [np.array([np.abs(own).max() for own in side]) for side in (above, below)]
    up, down = (side / fewer.leaving for side in shares)
    if is_back:
        up = np.maximum(up, down)
    else:
        below = [np.zeros_like(own) for own in above]
    worst, both = int(up.argmax()), list(zip(above, below, strict=True))
    return Quarter(fewer.sampler.azimuths, both, float(up[worst]), float(down.max()), worst)


def highest_of(sampler: Sampler) -> float:
    """Return the largest wavenumber [1/mm]: light that turns back returns close to where it was."""
    least = min(slab.g for stack in sampler.family.stacks for slab in stack.scattering)
    steepness = _HIGHEST_BACK / max(1.0 + least, _STEEPEST) if least < 0.0 else 0.0
    return max(_HIGHEST, steepness) * sampler.most_sigma_t


def _at(apart: Wavenumbers, radii: FloatArray) -> FloatArray:
    """Return the difference of F at radii, and of the total (n + 1, 2 stacks)."""
    few = radii if radii.size <= _RADII else np.geomspace(radii[0], radii[-1], _RADII)
    columns = [np.interp(np.log(radii), np.log(few), own) for own in apart.cumulative(few).T]
    return np.vstack((np.stack(columns, axis=1), apart.values[:1]))


def without_rounding(values: FloatArray, total: float) -> FloatArray:
    """Return T(k) (n, 1) with zeros from the first on that is next to nothing."""
    low = np.flatnonzero(np.abs(values[:, 0]) < _ROUNDING * total)
    kept = values.copy()
    if low.size:
        kept[low[0] :] = 0.0
    return kept
