"""Profiles of layered materials by the solver for layers."""

import math
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import StoppedError
from sssfit.grid import RadialGrid
from sssfit.material import Material
from sssfit.profile import Profile
from sssfit.simulate.stack.azimuth import FEWEST
from sssfit.simulate.stack.beam import attenuation, beam_of
from sssfit.simulate.stack.families import families_of
from sssfit.simulate.stack.limits import (
    Channel,
    azimuths_cannot,
    cannot_meet,
    check_memory,
    check_time,
    check_tolerance,
    fits,
    note_time,
)
from sssfit.simulate.stack.quarter import Quarter, quarter_of
from sssfit.simulate.stack.sampling import Family
from sssfit.simulate.stack.slabs import stacks_of
from sssfit.simulate.stack.solution import Answer, Errors, Side, SideErrors, Step, steps
from sssfit.simulate.stack.solved import Solved, profile_of
from sssfit.simulate.stack.tails import Tail

COUNTS = (8, 12, 16, 20, 24, 28, 32, 36, 40)
_QUICK = 2e-3  # a tolerance from which 8 and 12 directions may do
_MOST_AZIMUTH = 0.5  # of a tolerance that directions in azimuth may take
_MANY = 9  # directions in azimuth
_PATIENCE = 10.0  # with few directions in azimuth: their errors differ between polar ones
_LEAST_GAIN = 2.0  # by which four more directions reduce an error, if it was not more before
_STEEP_GAIN = 3.0  # of steep scattering, whose estimates fall slowly at first (`tails`)


def solve_stacks(
    materials: Sequence[Material],
    grids: Sequence[RadialGrid],
    tolerance: float,
    pool: ThreadPoolExecutor,
    threads: int,
    *,
    reduced: Sequence[Material] | None = None,
    stop: Callable[[], bool] | None = None,
) -> list[Profile]:
    """Solve for the profiles of layered materials, any g and indices.

    Parameters
    ----------
    materials, grids : sequences
        Those that share a layer share its modes.
    tolerance : float
        Largest error of F(r) at an edge, above and below, and of the totals, as a share of the
        light that leaves on both sides.
    pool : ThreadPoolExecutor
        A pool of ``threads`` threads; the result does not depend on them.
    reduced : sequence of Material, optional
        What is solved for in place of each material, by the similarity relation.
    stop : callable, optional
        StoppedError is raised when it returns true.

    Raises
    ------
    SimulationError
        The tolerance cannot be met, or the matrices do not fit into memory.
    """
    given_up = threading.Event()

    def each(sample: Callable[[float], FloatArray], k: FloatArray) -> FloatArray:
        def one(wavenumber: float) -> FloatArray:
            if given_up.is_set() or (stop is not None and stop()):
                raise StoppedError("stopped before the equation was solved.")
            return sample(wavenumber)

        return np.stack(list(pool.map(one, k.tolist())))

    channels = [
        Channel(f"{material.name} {name}", stack, material.specular_reflectance, grid.r_edges_mm)
        for material, grid in zip(reduced or materials, grids, strict=True)
        for name, stack in zip(material.channels, stacks_of(material), strict=True)
    ]
    solved: dict[int, Solved] = {
        number: _beam_only(channel)
        for number, channel in enumerate(channels)
        if not channel.stack.scattering
    }
    others = [number for number in range(len(channels)) if number not in solved]

    def of_family(members: list[int]) -> list[tuple[int, Solved]]:
        numbers = [others[member] for member in members]
        own = [channels[number] for number in numbers]
        return list(zip(numbers, _solve_family(own, tolerance, threads, each), strict=True))

    # What a family does between its wavenumbers goes on beside those of another: skin, 5.4 s to 4.
    with ThreadPoolExecutor(threads) as solvers:
        try:
            for pairs in solvers.map(of_family, families_of([channels[k].stack for k in others])):
                solved |= pairs
        except BaseException:  # an interrupt too: the other families end at their next wavenumber
            given_up.set()
            solvers.shutdown(cancel_futures=True)
            raise
    found, first = [], 0
    for material, solved_for, grid in zip(materials, reduced or materials, grids, strict=True):
        answers = [solved[k] for k in range(first, first + material.n_channels)]
        is_similar = material != solved_for
        found.append(profile_of(material, grid, answers, tolerance, similarity=is_similar))
        first += material.n_channels
    return found


def _solve_family(
    channels: Sequence[Channel],
    tolerance: float,
    threads: int,
    each: Callable[[Callable[[float], FloatArray], FloatArray], FloatArray],
) -> list[Solved]:
    """Add directions until every channel meets the tolerance."""
    counts: tuple[int, ...] = COUNTS if tolerance >= _QUICK else COUNTS[1:]
    check_tolerance(channels, tolerance)
    for count in counts[:2]:
        check_memory(channels, count, FEWEST, threads)
    check_time(channels, counts[1], tolerance)
    family = Family(tuple(channel.stack for channel in channels))
    radii, specular = ([getattr(each, key) for each in channels] for key in ("radii", "specular"))
    radii = [each[1:] for each in radii]
    quarter = quarter_of(family, radii, tolerance, each)

    def solution(counts: Sequence[int], quarter: Quarter, patience: float) -> Step:
        under_way = steps(family, radii, specular, counts, quarter, tolerance, each)
        return _last(channels, under_way, counts, quarter, threads, tolerance, patience)

    if quarter.count > _MANY:  # in a tenth of the time, few show how many polar ones are needed
        needed = solution(counts, replace(quarter, count=FEWEST), _PATIENCE).count
        counts = counts[counts.index(needed) - 1 :]
        if quarter.share > _MOST_AZIMUTH * tolerance:
            raise azimuths_cannot(channels[quarter.worst], quarter, _MOST_AZIMUTH, tolerance)
        check_memory(channels, counts[1], quarter.count, threads)
        note_time(channels, needed, quarter.count, tolerance)
    step = solution(counts, quarter, 1.0)
    pairs = zip(step.answers, step.errors, strict=True)
    return [Solved(*pair, step.count) for pair in pairs]


def _last(
    channels: Sequence[Channel],
    under_way: Iterator[Step],
    counts: Sequence[int],
    quarter: Quarter,
    threads: int,
    tolerance: float,
    patience: float,
) -> Step:
    """Return the first step that meets the tolerance.

    One that no more directions would help is refused, or returned if it is within ``patience``
    times the tolerance.
    """
    before = math.inf
    is_steep = any(Tail.of(each.stack).ratio > 0.0 for each in channels)
    least = _STEEP_GAIN if is_steep else _LEAST_GAIN
    for step in under_way:
        shares = [step.share(number) for number in range(len(channels))]
        worst = max(shares)
        if worst <= tolerance:
            return step
        left = counts[counts.index(step.count) + 1 :]
        gain = max(before / worst, least)
        is_hopeless = worst > tolerance * gain ** len(left)
        if is_hopeless or not fits(channels, left[0], quarter.count, threads):
            if worst <= patience * tolerance:
                return step
            raise cannot_meet(channels, shares.index(worst), step, tolerance)
        before = worst
    raise AssertionError("steps end with the last number of directions")


def _beam_only(channel: Channel) -> Solved:
    """Return the answer where nothing scatters, which the beam alone gives without error."""
    stack, edges = channel.stack, channel.radii[1:]
    sigma_t = [each.sigma_a for each in stack.slabs]
    beam = beam_of(stack, sigma_t)
    fading = [attenuation(s, each.thickness) for s, each in zip(sigma_t, stack.slabs, strict=True)]

    def spot(power: float) -> Side:
        return Side(np.full(edges.size, power), power)

    none = SideErrors(np.zeros(edges.size + 1), np.zeros(edges.size + 1), 0.0)
    below = spot(beam.transmitted) if stack.has_bottom else None
    answer = Answer(spot(beam.reflected - channel.specular), below, beam.absorbed(fading))
    return Solved(answer, Errors(none, none if stack.has_bottom else None), 0)
