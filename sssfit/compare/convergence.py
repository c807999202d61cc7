"""What accuracy costs a simulation: error of F(r) against photons and seconds.

F(r) is the energy that leaves within r. The photon walk's error falls as photons^(-1/2); the exact
method's is set by its resolution.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray, plain
from sssfit.errors import SimulationError
from sssfit.material import Material
from sssfit.profile import Profile
from sssfit.simulate import simulate_exact, simulate_montecarlo

PHOTONS = (10_000, 31_623, 100_000, 316_228, 1_000_000, 3_162_278, 10_000_000)
SEEDS = 6  # the slope's standard error is then .025
# One for each of the exact method's resolutions that take seconds; the last is what others are
# compared with. The next one, 3e-7, takes 15 s.
TOLERANCES = (1e-4, 5e-6, 2e-6)


@dataclass(frozen=True, slots=True)
class WalkRun:
    """One photon walk.

    Parameters
    ----------
    photons, seed : int
    seconds : float [s]
        Without compiling.
    error : float [1]
        The largest |F - F_exact| at an annulus edge, as a share of the exact total; of the worst
        channel.
    """

    photons: int
    seed: int
    seconds: float
    error: float


@dataclass(frozen=True, slots=True)
class ExactRun:
    """One resolution of the exact method.

    Parameters
    ----------
    tolerance : float [1]
        What was asked for.
    seconds : float [s]
        Without compiling.
    estimate : float [1]
        The method's own: its difference to the next coarser resolution.
    error : float, optional [1]
        As that of a walk; None for the finest resolution, which the others are compared with.
    """

    tolerance: float
    seconds: float
    estimate: float
    error: float | None


@dataclass(frozen=True, slots=True)
class Line:
    """log10(error) = intercept + slope log10(photons), by least squares.

    Parameters
    ----------
    slope, intercept, slope_stderr : float
        The standard error is from what is left over; NaN with fewer than three points.
    """

    slope: float
    intercept: float
    slope_stderr: float

    def at(self, photons: npt.ArrayLike) -> FloatArray:
        """Return the line's error."""
        exponent = self.intercept + self.slope * np.log10(np.asarray(photons, dtype=np.float64))
        return np.asarray(10.0**exponent)


@dataclass(frozen=True, slots=True, eq=False)
class Convergence:
    """Walks and resolutions of one material.

    Parameters
    ----------
    exact : Profile
        The reference for all.
    walks : tuple of WalkRun
    resolutions : tuple of ExactRun
    line : Line
        Through the walks.
    """

    exact: Profile
    walks: tuple[WalkRun, ...]
    resolutions: tuple[ExactRun, ...]
    line: Line

    def to_dict(self) -> dict[str, Any]:
        """Return the slope and the figures of every walk and resolution."""
        return plain(
            {
                "material": self.exact.material_name,
                "slope": self.line.slope,
                "slope_stderr": self.line.slope_stderr,
                "rows": [asdict(each) for each in self.walks],
                "exact": [asdict(each) for each in self.resolutions],
            }
        )


LEAST_PHOTONS = 10_000
_PER_DECADE = 2


def photon_numbers(most: int) -> tuple[int, ...]:
    """Return two numbers of photons a decade, from 1e4 up to ``most``.

    Raises
    ------
    SimulationError
        Fewer than 1e5: no slope could be seen.
    """
    if most < 10 * LEAST_PHOTONS:
        raise SimulationError(f"{most:,} photons are too few for a slope; expected 1e5 or more.")
    numbers: list[int] = []
    while (number := round(LEAST_PHOTONS * 10 ** (len(numbers) / _PER_DECADE))) <= most:
        numbers.append(number)
    return tuple(numbers)


def compute_convergence(
    material: Material,
    *,
    photons: Sequence[int] = PHOTONS,
    seeds: int = SEEDS,
    first_seed: int = 1,
    tolerances: Sequence[float] = TOLERANCES,
    threads: int | None = None,
    clock: Callable[[], float] = time.perf_counter,
) -> Convergence:
    """Run both methods at several prices.

    Parameters
    ----------
    material : Material
        One half space, as `simulate_exact` wants it.
    photons : sequence of int
        At least two numbers of photons.
    seeds : int
        Walks for each number; no two share a seed, so that all are independent.
    first_seed : int
    tolerances : sequence of float
        Falling; one that the method cannot meet ends them.
    threads : int, optional
    clock : callable
        Seconds now.

    Raises
    ------
    SimulationError
        Fewer than two numbers of photons, a medium for which there is no exact solution, or the
        first tolerance cannot be met.
    """
    if len(set(photons)) < 2 or seeds < 1:
        raise SimulationError(
            f"{len(set(photons))} numbers of photons and {seeds} seeds; expected two of the "
            "former and one of the latter at least, for a slope."
        )
    resolutions, exact = _resolutions(material, tolerances, threads, clock)
    simulate_montecarlo(material, photons=1000, threads=threads)  # compiles
    walks = []
    for k, number in enumerate(np.repeat(photons, seeds)):
        begun = clock()
        walk = simulate_montecarlo(
            material, photons=int(number), seed=first_seed + k, threads=threads
        )
        seconds = clock() - begun
        walks.append(WalkRun(int(number), first_seed + k, seconds, error_of(walk, exact)))
    line = fit_line([each.photons for each in walks], [each.error for each in walks])
    return Convergence(exact, tuple(walks), resolutions, line)


def error_of(profile: Profile, exact: Profile) -> float:
    """Return the largest |F - F_exact| at an annulus edge as a share of the total, worst channel.

    Channels that return nothing are left out.
    """
    total = exact.diffuse_reflectance
    lit = total > 0.0
    difference = np.abs(profile.cumulative - exact.cumulative)[:, lit]
    return float(np.max(difference / total[lit], initial=0.0))


def fit_line(photons: Sequence[int], errors: Sequence[float]) -> Line:
    """Put a line through logarithms; every point counts alike.

    The largest deviation of F has, over its expectation, the same distribution for any number
    of photons: its logarithm scatters alike everywhere, and plain least squares is right.
    """
    x, y = np.log10(np.asarray(photons, dtype=np.float64)), np.log10(errors)
    away = x - x.mean()
    slope = float(away @ y / (away @ away))
    intercept = float(y.mean() - slope * x.mean())
    left = y - intercept - slope * x
    free = len(x) - 2
    stderr = math.sqrt(float(left @ left) / free / float(away @ away)) if free else math.nan
    return Line(slope, intercept, stderr)


def _resolutions(
    material: Material,
    tolerances: Sequence[float],
    threads: int | None,
    clock: Callable[[], float],
) -> tuple[tuple[ExactRun, ...], Profile]:
    """Run the exact method at falling tolerances, each resolution once; the finest is the truth."""
    simulate_exact(material, tolerance=tolerances[0], threads=threads)  # compiles
    found: list[tuple[float, float, Profile]] = []
    for tolerance in tolerances:
        begun = clock()
        try:
            profile = simulate_exact(material, tolerance=tolerance, threads=threads)
        except SimulationError:
            break
        is_new = not found or _estimate(profile) != _estimate(found[-1][2])
        if is_new:
            found.append((tolerance, clock() - begun, profile))
    finest = found[-1][2]
    runs = [
        ExactRun(
            tolerance,
            seconds,
            _estimate(profile),
            None if profile is finest else error_of(profile, finest),
        )
        for tolerance, seconds, profile in found
    ]
    return tuple(runs), finest


def _estimate(profile: Profile) -> float:
    """Return the exact method's own estimate of its error, as a share of the total."""
    return float(profile.meta["relative_error"])
