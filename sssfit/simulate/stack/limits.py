"""What the solver for layers cannot do, and what it says then."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from sssfit.arrays import FloatArray
from sssfit.errors import SimulationError
from sssfit.messages import counted, note
from sssfit.simulate.stack.azimuth import FEWEST
from sssfit.simulate.stack.nodes import Nodes
from sssfit.simulate.stack.quarter import AZIMUTHS, Quarter
from sssfit.simulate.stack.slabs import SlabStack
from sssfit.simulate.stack.solution import Step
from sssfit.simulate.stack.tails import Tail

_LEAST_TOLERANCE = 1e-6  # 40 directions reach 5e-8 of a half space and 1e-6 of most stacks
_LARGEST_ADVISED = 0.5
_OF_DIRECTIONS = 0.5  # of a tolerance: what their difference may take beside the wavenumbers
_MOST_BYTES = 2_000_000_000  # of matrices at once
_MOST_SECONDS = 600.0  # of one processor, for the first number of directions
_SECONDS = 2.1e-9  # of a layer at one wavenumber, for each cube of an unknown; measured
_WORTH_A_NOTE = 20.0  # seconds
_OF_MANY = 0.5  # of that time, with many directions in azimuth: not every wavenumber has them all
_NAMED = 4  # channels in a note
_WAVENUMBERS = 70.0  # at a tolerance of 1e-4; a spline's error goes with the fourth power
_MATRICES = 6  # complex ones for each layer of a stack, and the modes of each


@dataclass(frozen=True, slots=True, eq=False)
class Channel:
    """One channel of one material."""

    name: str
    stack: SlabStack
    specular: float
    radii: FloatArray


def azimuths_cannot(
    channel: Channel, quarter: Quarter, part: float, tolerance: float
) -> SimulationError:
    """Say which channel is too thin for the directions in azimuth, and what to do."""
    return SimulationError(
        f"{channel.name}, which light crosses without being scattered: the tolerance of "
        f"{tolerance:g} cannot be met: {AZIMUTHS[-1]} and {quarter.count} directions in azimuth "
        f"differ by {quarter.share:.2g} of the light; {_advised(quarter.share / part)}."
    )


def _rounded_up(value: float) -> float:
    """Return the next number of one digit."""
    digit = 10.0 ** math.floor(math.log10(value))
    return math.ceil(value / digit) * digit


def _advised(tolerance: float) -> str:
    """Say what to do where this tolerance can be met."""
    if tolerance > _LARGEST_ADVISED:
        return "use `method = montecarlo`"
    return f"give `tolerance = {_rounded_up(tolerance):g}` or more, or use `method = montecarlo`"


def cannot_meet(
    channels: Sequence[Channel], number: int, step: Step, tolerance: float
) -> SimulationError:
    """Say which channel is too hard, why, and what to do.

    Wavenumbers lie farther apart for the tolerance that is advised, and may take half of it.
    """
    channel, worst = channels[number], step.share(number)
    steepest = max(each.g for each in channel.stack.scattering)
    is_thin = channel.stack.is_seen_through and steepest > 0.5
    why = f" (a thin slab of g = {steepest:g}, which the walk does well)" if is_thin else ""
    by = f"{step.count} and {step.count - 4} directions differ by {worst:.2g}"
    if Tail.of(channel.stack).ratio > 0.0:
        by = f"with {step.count} directions errors may be {worst:.2g}"
    by_directions = worst - step.spline_share(number)
    return SimulationError(
        f"{channel.name}{why}: the tolerance of {tolerance:g} cannot be met: {by} of the light; "
        f"{_advised(max(worst, by_directions / _OF_DIRECTIONS))}."
    )


def _bytes(channels: Sequence[Channel], count: int, azimuths: int, threads: int) -> float:
    """Return the memory that matrices of all threads take at once."""
    needs = []
    for channel in channels:
        size = 2 * azimuths * Nodes.of(channel.stack.indices, count).invariant.size
        needs.append(16.0 * size**2 * _MATRICES * (len(channel.stack.slabs) + 2))
    return threads * max(needs)


def fits(channels: Sequence[Channel], count: int, azimuths: int, threads: int) -> bool:
    """Return whether the matrices of so many directions fit into memory."""
    return _bytes(channels, count, azimuths, threads) <= _MOST_BYTES


def check_tolerance(channels: Sequence[Channel], tolerance: float) -> None:
    """Raise an error for a tolerance that no stack meets, before any time is spent on it."""
    if tolerance < _LEAST_TOLERANCE:
        raise SimulationError(
            f"{channels[0].name}: the tolerance of {tolerance:g} cannot be met by the solver for "
            f"layers; {_advised(_LEAST_TOLERANCE)}."
        )


def _seconds(channels: Sequence[Channel], count: int, azimuths: int, tolerance: float) -> float:
    """Return the processor time that so many polar directions and directions in azimuth take."""
    cubes = sum(
        len(each.stack.slabs)
        * (2 * azimuths * Nodes.of(each.stack.indices, count).invariant.size) ** 3
        for each in channels
    )
    return float(_SECONDS * cubes * _WAVENUMBERS * (1e-4 / tolerance) ** 0.25)


def check_time(channels: Sequence[Channel], count: int, tolerance: float) -> None:
    """Raise an error for stacks of many layers to a small tolerance, before an hour is spent.

    The time is that of the fewest directions: how many are needed is not known yet.
    """
    seconds = _seconds(channels, count, FEWEST, tolerance)
    if seconds > _MOST_SECONDS:
        most = max(channels, key=lambda each: len(each.stack.slabs))
        raise SimulationError(
            f"{most.name} has {len(most.stack.slabs)} layers, which to a tolerance of "
            f"{tolerance:g} would take over {seconds / 60.0:.0f} minutes of a processor, more than "
            f"{_MOST_SECONDS / 60.0:g}; merge layers, give a larger `tolerance`, or use "
            "`method = montecarlo`."
        )


def note_time(channels: Sequence[Channel], count: int, azimuths: int, tolerance: float) -> None:
    """Say that the directions that turned out to be needed take long.

    Estimates were 0.8 to 1.7 times the time that three stacks then took.
    """
    seconds = _OF_MANY * _seconds(channels, count, azimuths, tolerance)
    if seconds > _WORTH_A_NOTE:
        names = ", ".join(each.name for each in channels[:_NAMED])
        more = f" and {len(channels) - _NAMED} more" if len(channels) > _NAMED else ""
        note(
            f"{names}{more}: a tolerance of {tolerance:g} needs {azimuths} directions in azimuth, "
            f"which take some {_rounded_up(seconds):g} s of a processor. A larger tolerance takes "
            "less, and so may `method = montecarlo`."
        )


def check_memory(channels: Sequence[Channel], count: int, azimuths: int, threads: int) -> None:
    """Raise an error for stacks of too many layers."""
    if not fits(channels, count, azimuths, threads):
        most = max(channels, key=lambda each: len(each.stack.slabs))
        needed = _bytes(channels, count, azimuths, threads) / 1e9
        raise SimulationError(
            f"{most.name} has {len(most.stack.slabs)} layers, whose matrices would take "
            f"{needed:.1f} GB on {counted(threads, 'thread')}, over the limit of "
            f"{_MOST_BYTES / 1e9:g} GB; merge layers, use fewer threads, or "
            "`method = montecarlo`."
        )
