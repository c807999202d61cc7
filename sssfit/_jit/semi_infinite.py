"""The photon walk in a homogeneous, semi-infinite, isotropically scattering medium, in lanes.

Lengths are in mean free paths, so the walk depends on neither absorption nor channel: a photon that
leaves after n collisions at radius rho adds albedo^n at r = rho * mean_free_path to each channel
(implicit capture; Wang, Jacques, Zheng 1995, "MCML"). One walk therefore gives every channel, and
every material of the same refractive index.

``LANES`` photons walk in parallel as a structure of arrays in single precision. ``advance`` moves
all of them by one flight without a branch, which LLVM vectorises; ``find_events`` then lists the
few lanes that leave or reach their roulette, and only those are handled one by one. A photon that
ends is replaced by the next; after the last launch the last live lane moves into the gap, so that a
few long walks at the end of a batch do not process empty lanes.

``sampling`` has the random streams and the samplers.
"""

import math

import numpy as np
import numpy.typing as npt
from numba import carray  # type: ignore[attr-defined]

from sssfit._jit import Address, jit, jit_inline
from sssfit._jit.half_space_walk import (
    COLLISION_CAP,
    FLOAT_ROWS,
    POWER_BLOCK,
    ROULETTE_SPREAD,
    WORD_ROWS,
    Channels,
    FloatArray,
    Ledger,
)
from sssfit._jit.lanes import GENERATOR_ROWS, LANES, LaneFloats, LaneWords
from sssfit._jit.sampling import (
    cos_sin_turn,
    falling_bin,
    fresnel_reflectance,
    negative_log,
    next_unit,
    seed_lanes,
)

_BLOCK_BITS, _BLOCK_MASK = 10, POWER_BLOCK - 1

_F32 = np.float32
_U32 = np.uint32

# Rows of the two state blocks; the words begin with the generators.
_X, _Y, _Z = 0, LANES, 2 * LANES
_DX, _DY, _DZ = 3 * LANES, 4 * LANES, 5 * LANES  # the last flight, in mean free paths
_COS = 6 * LANES  # its direction cosine against the inward normal
_BOOST = 7 * LANES  # weight factor gained by surviving roulette
_COLLISIONS = GENERATOR_ROWS * LANES  # path so far
_EVENT = (GENERATOR_ROWS + 1) * LANES  # number of collisions that triggers roulette
_LEVEL = (GENERATOR_ROWS + 2) * LANES  # roulettes survived
_SETTLED = (GENERATOR_ROWS + 3) * LANES  # collisions already tallied

_ONE, _TWO = _F32(1.0), _F32(2.0)
_SURVIVAL = _F32(0.1)  # MCML's roulette: one in ten survives with ten times the weight
_GAIN = _F32(10.0)


@jit
def launch(floats: LaneFloats, words: LaneWords, lane: int, first_event: np.uint32) -> None:
    """Put a new photon into a lane, at its first collision below the point of entry."""
    floats[_X + lane] = _F32(0.0)
    floats[_Y + lane] = _F32(0.0)
    floats[_Z + lane] = negative_log(next_unit(words, lane))
    floats[_BOOST + lane] = _ONE
    words[_COLLISIONS + lane] = _U32(1)
    words[_EVENT + lane] = first_event
    words[_LEVEL + lane] = _U32(0)
    words[_SETTLED + lane] = _U32(0)


@jit
def advance(floats: LaneFloats, words: LaneWords, live: int, critical_cos: np.float32) -> None:
    """Scatter every live lane isotropically and fly to its next collision, without a branch.

    A flight that meets the surface beyond the critical angle is mirrored here (z = |z|: after an
    isotropic collision only the position matters); one that meets it inside the cone is left at
    z < 0 for ``find_events``.
    """
    for lane in range(live):
        flight = negative_log(next_unit(words, lane))
        cos_theta = _ONE - _TWO * next_unit(words, lane)
        cos_phi, sin_phi = cos_sin_turn(next_unit(words, lane))
        sideways = flight * np.sqrt(_ONE - cos_theta * cos_theta)
        dx, dy, dz = sideways * cos_phi, sideways * sin_phi, flight * cos_theta
        z = floats[_Z + lane] + dz
        floats[_X + lane] += dx
        floats[_Y + lane] += dy
        floats[_Z + lane] = z if -cos_theta > critical_cos else abs(z)
        floats[_DX + lane] = dx
        floats[_DY + lane] = dy
        floats[_DZ + lane] = dz
        floats[_COS + lane] = cos_theta
        words[_COLLISIONS + lane] = _U32(words[_COLLISIONS + lane] + _U32(1))


@jit
def find_events(
    floats: LaneFloats, words: LaneWords, live: int, events: npt.NDArray[np.int64]
) -> int:
    """List the lanes above the surface or due for roulette; return their number."""
    count = 0
    for lane in range(live):
        events[count] = lane
        count += (floats[_Z + lane] < _F32(0.0)) | (
            words[_COLLISIONS + lane] >= words[_EVENT + lane]
        )
    return count


@jit_inline
def power(channels: Channels, n: int, c: int) -> float:
    """albedo^n of channel c from the two tables."""
    low, high = channels.power_low[n & _BLOCK_MASK, c], channels.power_high[n >> _BLOCK_BITS, c]
    return float(low * high)


@jit_inline
def score_exit(
    floats: LaneFloats, words: LaneWords, lane: int, channels: Channels, ledger: Ledger
) -> None:
    """Add a photon that leaves: boost albedo^n in the bin of its radius and direction.

    The weight absorbed since the last tally is boost (albedo^settled - albedo^n).
    """
    settled = int(words[_SETTLED + lane])
    collisions = int(words[_COLLISIONS + lane]) - 1  # ``advance`` counted one that it did not reach
    boost = float(floats[_BOOST + lane])
    overshoot = floats[_Z + lane] / floats[_DZ + lane]  # share of the flight above the surface
    x = floats[_X + lane] - overshoot * floats[_DX + lane]
    y = floats[_Y + lane] - overshoot * floats[_DY + lane]
    rho = math.sqrt(float(x) * float(x) + float(y) * float(y))
    directions = channels.cosines.size + 1
    direction = falling_bin(-float(floats[_COS + lane]), channels.cosines)
    for c in range(channels.last_bin.size):
        weight = boost * power(channels, collisions, c)
        ledger.absorbed[c] += boost * power(channels, settled, c) - weight
        # The least of two floats: a whole number cannot hold the bin of mean free paths of 1e9 mm.
        last = float(channels.last_bin[c])
        radial_bin = int(min(rho * channels.bins_per_mean_free_path[c], last))
        cell = channels.first_cell[c] + radial_bin * directions + direction
        ledger.bins[cell, 0] += weight
        ledger.bins[cell, 1] += weight * weight


@jit_inline
def score_event(
    sums: FloatArray,
    gain: float,
    spread: float,
    words: LaneWords,
    lane: int,
    boost: float,
    channels: Channels,
    absorbed: FloatArray,
) -> None:
    """Tally absorption up to the lane's collision n, and w = boost albedo^n in ``sums``.

    Added as gain w and, for the variance, spread w^2.
    """
    settled = int(words[_SETTLED + lane])
    collisions = int(words[_COLLISIONS + lane])
    for c in range(absorbed.size):
        weight = boost * power(channels, collisions, c)
        absorbed[c] += boost * power(channels, settled, c) - weight
        sums[c, 0] += gain * weight
        sums[c, 1] += spread * weight * weight
    words[_SETTLED + lane] = _U32(collisions)


@jit_inline
def survives_event(
    floats: LaneFloats,
    words: LaneWords,
    lane: int,
    roulette_at: LaneWords,
    channels: Channels,
    ledger: Ledger,
) -> bool:
    """Play roulette, or stop at the collision cap; return whether the walk goes on.

    The weights that roulette takes and gives are uncorrelated with mean zero (a martingale), so
    their variances add up in the run's energy balance.
    """
    boost = float(floats[_BOOST + lane])
    absorbed = ledger.absorbed
    if words[_COLLISIONS + lane] >= COLLISION_CAP:
        score_event(ledger.unfinished, 1.0, 1.0, words, lane, boost, channels, absorbed)
        return False
    if next_unit(words, lane) >= _SURVIVAL:
        score_event(ledger.roulette, -1.0, ROULETTE_SPREAD, words, lane, boost, channels, absorbed)
        return False
    gain = float(_GAIN) - 1.0
    score_event(ledger.roulette, gain, ROULETTE_SPREAD, words, lane, boost, channels, absorbed)
    level = words[_LEVEL + lane] + _U32(1)
    words[_LEVEL + lane] = _U32(level)
    words[_EVENT + lane] = roulette_at[level]
    floats[_BOOST + lane] *= _GAIN
    return True


@jit
def move_lane(floats: LaneFloats, words: LaneWords, source: int, target: int) -> None:
    """Copy one lane's whole state, generator included, over another's."""
    for row in range(FLOAT_ROWS):
        floats[row * LANES + target] = floats[row * LANES + source]
    for row in range(WORD_ROWS):
        words[row * LANES + target] = words[row * LANES + source]


@jit_inline
def handle_event(
    floats: LaneFloats,
    words: LaneWords,
    lane: int,
    eta: float,
    roulette_at: LaneWords,
    channels: Channels,
    ledger: Ledger,
) -> bool:
    """Let a photon leave, reflect or play roulette; return whether its walk goes on."""
    if floats[_Z + lane] < _F32(0.0):
        reflectance = fresnel_reflectance(-float(floats[_COS + lane]), eta)
        if next_unit(words, lane) >= reflectance:
            score_exit(floats, words, lane, channels, ledger)
            return False
        floats[_Z + lane] = -floats[_Z + lane]
    if words[_COLLISIONS + lane] >= words[_EVENT + lane]:
        return survives_event(floats, words, lane, roulette_at, channels, ledger)
    return True


@jit
def trace_batch(
    seed: np.uint64,
    batch: np.int64,
    photons: int,
    eta: float,
    roulette_at: LaneWords,
    channels: Channels,
    ledger: Ledger,
    floats: LaneFloats,
    words: LaneWords,
    events: npt.NDArray[np.int64],
) -> int:
    """See ``half_space_walk.trace_batch``; the last three are the memory of the lanes."""
    seed_lanes(words, seed, batch)
    critical_cos = _F32(math.sqrt(max(0.0, 1.0 - 1.0 / (eta * eta))))
    live = min(LANES, photons)
    waiting = photons - live
    for lane in range(live):
        launch(floats, words, lane, roulette_at[0])
    flights = 0
    while live > 0:
        advance(floats, words, live, critical_cos)
        flights += live
        # From the last lane down, so that a lane moved into a gap has already had its event
        # handled.
        for k in range(find_events(floats, words, live, events) - 1, -1, -1):
            lane = events[k]
            if handle_event(floats, words, lane, eta, roulette_at, channels, ledger):
                continue
            if waiting > 0:
                waiting -= 1
                launch(floats, words, lane, roulette_at[0])
            else:
                live -= 1
                move_lane(floats, words, live, lane)
    return flights


def enter(
    seed: np.uint64,
    batch: np.int64,
    photons: int,
    eta: float,
    roulettes: int,
    count: int,
    cosine_count: int,
    cells: int,
    roulette_at: Address,
    power_low: Address,
    power_high: Address,
    bins_per_mean_free_path: Address,
    last_bin: Address,
    first_cell: Address,
    cosines: Address,
    bins: Address,
    absorbed: Address,
    unfinished: Address,
    roulette: Address,
    floats: Address,
    words: Address,
    events: Address,
) -> int:
    """Call `trace_batch` with arrays at the addresses that ``half_space_walk.ENTRY`` passes."""
    channels = Channels(
        carray(power_low, (POWER_BLOCK, count), np.float64),
        carray(power_high, (POWER_BLOCK, count), np.float64),
        carray(bins_per_mean_free_path, (count,), np.float64),
        carray(last_bin, (count,), np.int64),
        carray(first_cell, (count,), np.int64),
        carray(cosines, (cosine_count,), np.float64),
    )
    ledger = Ledger(
        carray(bins, (cells, 2), np.float64),
        carray(absorbed, (count,), np.float64),
        carray(unfinished, (count, 2), np.float64),
        carray(roulette, (count, 2), np.float64),
    )
    return trace_batch(
        seed,
        batch,
        photons,
        eta,
        carray(roulette_at, (roulettes,), np.uint32),
        channels,
        ledger,
        carray(floats, (FLOAT_ROWS * LANES,), np.float32),
        carray(words, (WORD_ROWS * LANES,), np.uint32),
        carray(events, (LANES,), np.int64),
    )
