"""F(r) of several stacks, with more and more directions until two numbers of them agree.

The error estimate is the difference between N and N - 4 directions, both on every other wavenumber,
and more of steep phase functions (`tails`), plus what their spline and the directions in azimuth
are off by (`quarter`). It belongs to the coarser of the two, and the finer one is returned: an
estimate, not a bound.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.simulate._deterministic import without_falls
from sssfit.simulate.stack.assembly import Assembly
from sssfit.simulate.stack.changes import Changes, ready
from sssfit.simulate.stack.quarter import Each, Quarter, without_rounding
from sssfit.simulate.stack.sampling import Family, Sampler
from sssfit.simulate.stack.single import single_cumulative
from sssfit.simulate.stack.spline import Spline
from sssfit.simulate.stack.tails import Tail
from sssfit.simulate.stack.transform import Wavenumbers

Both = tuple[FloatArray, FloatArray]

_MISS = 0.1  # of the tolerance, between two wavenumbers; F is then off by less
_DARK = 1e-300  # where no light leaves, no error has a share
_FEW_RADII, _PER_DECADE = 120, 40  # more radii than this are interpolated: 1e-7 of F


@dataclass(frozen=True, slots=True, eq=False)
class Side:
    """Light that leaves on one side: F at the radii asked for (n,), and altogether."""

    cumulative: FloatArray
    total: float

    @property
    def edges(self) -> FloatArray:
        """F at the radii and, last, altogether (n + 1,)."""
        return np.append(self.cumulative, self.total)

    @property
    def fall(self) -> float:
        """By how much F falls or exceeds the total anywhere, which no F does: a least error."""
        return float(np.max(np.abs(without_falls(self.edges) - self.edges)))


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """What one stack does with light from above, as shares of it, without specular reflection."""

    reflected: Side
    transmitted: Side | None
    absorbed: tuple[float, ...]

    @property
    def leaving(self) -> float:
        """All light that leaves on the two sides."""
        below = self.transmitted.total if self.transmitted is not None else 0.0
        return self.reflected.total + below

    @property
    def fall(self) -> float:
        """The larger fall of F on the two sides."""
        return max(each.fall for each in (self.reflected, self.transmitted) if each is not None)


@dataclass(frozen=True, slots=True, eq=False)
class SideErrors:
    """Errors of F at the radii and of the total (n + 1,), of the light in between (n + 1,).

    ``spline`` is the largest that comes from the wavenumbers, and ``apart`` by what F of two
    numbers of directions differs (n + 1,).
    """

    edges: FloatArray
    annuli: FloatArray
    spline: float
    apart: FloatArray | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Errors:
    """Errors of an answer above and, for slabs, below."""

    reflected: SideErrors
    transmitted: SideErrors | None

    @property
    def worst(self) -> float:
        """The largest error of F on either side."""
        return float(max(np.max(each.edges) for each in self._sides))

    @property
    def spline(self) -> float:
        """The largest that comes from the wavenumbers."""
        return max(each.spline for each in self._sides)

    @property
    def _sides(self) -> list[SideErrors]:
        return [each for each in (self.reflected, self.transmitted) if each is not None]


_NONE = Errors(SideErrors(np.zeros(0), np.zeros(0), 0.0), None)


def share_of(errors: Errors, answer: Answer) -> float:
    """Return the largest error of an answer, its own fall included, as a share of its light."""
    return max(errors.worst, answer.fall) / max(answer.leaving, _DARK)


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """Answers of all stacks with ``count`` directions, and their errors."""

    count: int
    answers: list[Answer]
    errors: list[Errors]

    def share(self, number: int) -> float:
        """Return the largest error of a stack as a share of the light that leaves it."""
        return share_of(self.errors[number], self.answers[number])

    def spline_share(self, number: int) -> float:
        """Return what comes from the wavenumbers, as a share of the light that leaves a stack."""
        return self.errors[number].spline / self.answers[number].leaving


def steps(
    family: Family,
    radii: list[FloatArray],
    specular: list[float],
    counts: Sequence[int],
    quarter: Quarter,
    tolerance: float,
    each: Each,
) -> Iterator[Step]:
    """Yield answers with more and more directions, from the second number on.

    Parameters
    ----------
    family : Family
    radii : list of (n,) [mm]
        Radii of each stack, above 0 and ascending.
    specular : list of float
        For each stack the share of the beam that returns and is not part of F.
    counts : sequence of int
        Numbers of directions.
    quarter : Quarter
        The directions in azimuth, and their errors.
    tolerance : float
        The error asked for, a share of the light; it sets how close the wavenumbers lie.
    each : callable
        Maps a function over wavenumbers, with threads.
    """
    coarse: list[Answer] | None = None
    last = [_NONE] * len(family.stacks)
    tails = [Tail.of(stack) for stack in family.stacks]
    changes: Changes | None = None
    miss = tolerance * _MISS
    for before, count in pairwise(counts):
        sampler = ready(family, count, quarter.count)
        changes = changes or Changes(family, counts[0], sampler, miss, each)
        fine, halved = (_answers(sampler, of, radii, specular) for of in changes.whole(sampler))
        if coarse is None:
            first = ready(family, before, quarter.count)
            coarse = _answers(first, changes.halved(first), radii, specular)
        each_stack = zip(fine, halved, coarse, quarter.errors, tails, last, strict=True)
        step = Step(count, fine, [_errors(*own) for own in each_stack])
        yield step
        if max(map(step.spline_share, range(len(fine)))) > 0.5 * tolerance:
            changes, miss = None, 0.1 * miss
        coarse, last = halved, step.errors


def _answers(
    sampler: Sampler, waves: Wavenumbers, radii: list[FloatArray], specular: list[float]
) -> list[Answer]:
    """Return each stack's answer from the transforms of all."""
    totals = sampler.at_zero()
    found = []
    for number, (assembly, own, mirror) in enumerate(
        zip(sampler.assemblies, radii, specular, strict=True)
    ):
        both = waves.values[:, 2 * number : 2 * number + 2]
        above = Wavenumbers(waves.k, both[:, :1], waves.bend)
        up = _side(assembly, above, own, assembly.beam.reflected - mirror)
        down = None
        if assembly.has_bottom:
            kept = without_rounding(both[:, 1:], totals[number].transmitted)
            below = Wavenumbers(waves.k, kept, waves.bend)
            down = _side(assembly.mirrored, below, own, assembly.beam.transmitted)
        found.append(Answer(up, down, totals[number].absorbed))
    return found


def _side(assembly: Assembly, waves: Wavenumbers, radii: FloatArray, beam: float) -> Side:
    """Return F above an assembly: single scattering, the rest, and the beam at r = 0."""

    def light(r: FloatArray) -> FloatArray:
        return single_cumulative(assembly, r) + waves.cumulative(r)[:, 0] + beam

    once = float(single_cumulative(assembly, np.array([np.inf]))[0])
    return Side(_interpolated(light, radii), once + float(waves.values[0, 0]) + beam)


def _interpolated(light: Callable[[FloatArray], FloatArray], radii: FloatArray) -> FloatArray:
    """Return a smooth function at the radii; of many, by a spline in log r."""
    if radii.size <= _FEW_RADII:
        return light(radii)
    decades = np.log10(radii[-1] / radii[0])
    knots = np.geomspace(radii[0], radii[-1], int(np.ceil(_PER_DECADE * decades)) + 1)
    return Spline.through(np.log(knots), light(knots)[:, None])(np.log(radii))[:, 0]


def _errors(
    fine: Answer, halved: Answer, coarse: Answer, azimuth: Both, tail: Tail, last: Errors
) -> Errors:
    """Return the errors of both sides; ``azimuth`` are those of light above and below."""
    above = fine.reflected, halved.reflected, coarse.reflected
    up = _side_errors(*above, azimuth[0], tail, last.reflected)
    if fine.transmitted is None or halved.transmitted is None or coarse.transmitted is None:
        return Errors(up, None)
    below = fine.transmitted, halved.transmitted, coarse.transmitted
    return Errors(up, _side_errors(*below, azimuth[1], tail, last.transmitted))


def _side_errors(
    fine: Side, halved: Side, coarse: Side, azimuth: FloatArray, tail: Tail, last: SideErrors | None
) -> SideErrors:
    """Compare the light within each radius, and altogether: N with N - 4, and both splines."""
    directions, others = halved.edges - coarse.edges, (fine.edges - halved.edges, azimuth)
    before = directions if last is None or last.apart is None else last.apart
    edges = [tail.left(directions, before), *others]
    annuli = [tail.left(_steps(directions), _steps(before)), *map(_steps, others)]
    return SideErrors(_summed(edges), _summed(annuli), float(np.max(np.abs(others[0]))), directions)


def _steps(edges: FloatArray) -> FloatArray:
    found: FloatArray = np.diff(np.append(0.0, edges))
    return found


def _summed(apart: list[FloatArray]) -> FloatArray:
    found: FloatArray = np.sum(np.abs(apart), axis=0)
    return found
