"""The photon walk in a homogeneous, semi-infinite, isotropically scattering medium, in lanes.

Lengths are in mean free paths, so the walk knows neither absorption nor channel: a photon that
leaves after n collisions at radius rho adds albedo^n at r = rho * mean_free_path to each channel
(implicit capture; Wang, Jacques, Zheng 1995, "MCML"). One walk therefore serves every channel, and
every material of the same refractive index.

``LANES`` photons walk side by side as a structure of arrays in single precision. ``advance`` moves
all of them by one flight without a branch, which LLVM vectorises; ``find_events`` then lists the
few lanes that leave or reach their roulette, and only those are handled one by one. A photon that
ends makes room for the next; when no more are to be launched the last live lane moves into the
gap, so that a few long walks at the end of a batch do not drag empty lanes along.

Random numbers belong to the lanes of a batch (xoshiro128++, Blackman and Vigna 2021, seeded by
splitmix64 from seed, batch and lane): the same batch gives the same bits on any thread, in any
order. numba promotes uint32 + uint32 to uint64, hence the cast around every intermediate.

The whole walk is in this one file on purpose: numba's cache does not follow helpers elsewhere.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sssfit._jit import jit, jit_inline

LANES = 256  # 128 to 1024 took the same time; fewer waste less at the end of a batch
COLLISION_CAP = 1_000_000  # walks end here unfinished; albedo 1 would otherwise walk for ever
POWER_BLOCK = 1024  # albedo^n = low[n % 1024] * high[n // 1024] reaches past the collision cap
_BLOCK_BITS, _BLOCK_MASK = 10, POWER_BLOCK - 1

_F32 = np.float32
_U32 = np.uint32
_U64 = np.uint64

# Rows of the two state blocks; one flat array each, so that LLVM sees that rows do not overlap.
_X, _Y, _Z = 0, LANES, 2 * LANES
_DX, _DY, _DZ = 3 * LANES, 4 * LANES, 5 * LANES  # the last flight, in mean free paths
_COS = 6 * LANES  # its direction cosine against the inward normal
_BOOST = 7 * LANES  # weight factor gained by surviving roulette
_FLOAT_ROWS = 8
_S0, _S1, _S2, _S3 = 0, LANES, 2 * LANES, 3 * LANES  # generator state
_COLLISIONS, _EVENT = 4 * LANES, 5 * LANES  # collisions so far; number that triggers roulette
_LEVEL, _SETTLED = 6 * LANES, 7 * LANES  # roulettes survived; collisions already in the ledger
_WORD_ROWS = 8

_HALF, _ONE, _TWO = _F32(0.5), _F32(1.0), _F32(2.0)
_PI, _LN2 = _F32(math.pi), _F32(math.log(2.0))
_UNIT = _F32(2.0**-23)
_SQRT_HALF_BITS = _U32(0x3F3504F3)  # sqrt(1/2) as float32
_ONE_BITS = _U32(0x3F800000)
_MANTISSA = _U32(0x007FFFFF)
_SURVIVAL = _F32(0.1)  # MCML's roulette: one in ten survives with ten times the weight
_GAIN = _F32(10.0)

FloatArray = npt.NDArray[np.float64]
LaneFloats = npt.NDArray[np.float32]
LaneWords = npt.NDArray[np.uint32]


class Channels(NamedTuple):
    """What turns a walk into energy per channel; C channels, all materials of one walk together."""

    power_low: FloatArray  # (POWER_BLOCK, C): albedo^k
    power_high: FloatArray  # (POWER_BLOCK, C): albedo^(POWER_BLOCK k)
    bins_per_mean_free_path: FloatArray  # (C,)
    last_bin: npt.NDArray[np.int64]  # (C,): the bin that stands for "beyond the grid"
    first_cell: npt.NDArray[np.int64]  # (C,): where the channel's bins begin in the tally


class Ledger(NamedTuple):
    """Sums over photons of weight and of weight squared; a photon enters with weight 1."""

    bins: FloatArray  # (cells, 2): energy leaving, per bin
    absorbed: FloatArray  # (C,)
    unfinished: FloatArray  # (C, 2): energy of walks stopped at the collision cap
    roulette: FloatArray  # (C, 2): what roulette added, zero on average


@jit
def splitmix64(state: np.uint64) -> np.uint64:
    """Return the finaliser of splitmix64: a bijection of 64-bit words without visible structure."""
    z = _U64(state)
    z = _U64((z ^ (z >> _U64(30))) * _U64(0xBF58476D1CE4E5B9))
    z = _U64((z ^ (z >> _U64(27))) * _U64(0x94D049BB133111EB))
    return _U64(z ^ (z >> _U64(31)))


@jit
def seed_lanes(words: LaneWords, seed: np.uint64, batch: np.int64) -> None:
    """Give every lane of a batch its own generator state: consecutive splitmix64 outputs."""
    start = splitmix64(_U64(seed))
    for lane in range(LANES):
        counter = _U64(2) * (_U64(batch) * _U64(LANES) + _U64(lane))
        first = splitmix64(_U64(start + (counter + _U64(1)) * _U64(0x9E3779B97F4A7C15)))
        second = splitmix64(_U64(start + (counter + _U64(2)) * _U64(0x9E3779B97F4A7C15)))
        words[_S0 + lane] = _U32(first)
        words[_S1 + lane] = _U32(first >> _U64(32))
        words[_S2 + lane] = _U32(second)
        words[_S3 + lane] = _U32(second >> _U64(32))


@jit
def rotate_left(word: np.uint32, bits: int) -> np.uint32:
    """Rotate a 32-bit word."""
    return _U32(_U32(word << _U32(bits)) | _U32(word >> _U32(32 - bits)))


@jit
def next_word(words: LaneWords, lane: int) -> np.uint32:
    """Advance one lane's xoshiro128++ and return 32 random bits."""
    s0, s1 = words[_S0 + lane], words[_S1 + lane]
    s2, s3 = words[_S2 + lane], words[_S3 + lane]
    result = _U32(rotate_left(_U32(s0 + s3), 7) + s0)
    shifted = _U32(s1 << _U32(9))
    s2 = _U32(s2 ^ s0)
    s3 = _U32(s3 ^ s1)
    words[_S1 + lane] = _U32(s1 ^ s2)
    words[_S0 + lane] = _U32(s0 ^ s3)
    words[_S2 + lane] = _U32(s2 ^ shifted)
    words[_S3 + lane] = rotate_left(s3, 11)
    return result


@jit
def next_unit(words: LaneWords, lane: int) -> np.float32:
    """Uniform in the open interval (0, 1): the middle of one of 2^23 equal parts."""
    return (_F32(np.int32(next_word(words, lane) >> _U32(9))) + _HALF) * _UNIT


@jit
def negative_log(x: np.float32) -> np.float32:
    """-ln x for x in (0, 1): x = 2^e m, sqrt(1/2) <= m < sqrt(2), Cephes' polynomial for ln m.

    A libm call would keep the flight loop from being vectorised. Absolute error under 1e-7.
    """
    bits = _U32(_F32(x).view(np.uint32) + _U32(_ONE_BITS - _SQRT_HALF_BITS))
    exponent = _F32(np.int32(bits >> _U32(23))) - _F32(127.0)
    m = _U32(_U32(bits & _MANTISSA) + _SQRT_HALF_BITS).view(np.float32) - _ONE
    y = _F32(7.0376836292e-2)
    y = y * m + _F32(-1.1514610310e-1)
    y = y * m + _F32(1.1676998740e-1)
    y = y * m + _F32(-1.2420140846e-1)
    y = y * m + _F32(1.4249322787e-1)
    y = y * m + _F32(-1.6668057665e-1)
    y = y * m + _F32(2.0000714765e-1)
    y = y * m + _F32(-2.4999993993e-1)
    y = y * m + _F32(3.3333331174e-1)
    square = m * m
    return -(y * m * square - _HALF * square + m + exponent * _LN2)


@jit
def cos_sin_turn(u: np.float32) -> tuple[np.float32, np.float32]:
    """Cosine and sine of 2 pi u - pi for u in (0, 1), from the half angle t in (-pi/2, pi/2).

    Taylor polynomials of t would need more terms; these are minimax, absolute error under 1e-6.
    """
    t = (u - _HALF) * _PI
    q = t * t
    s = _F32(-2.3889859e-08)
    s = s * q + _F32(2.7525562e-06)
    s = s * q + _F32(-1.9840874e-04)
    s = s * q + _F32(8.3333310e-03)
    s = s * q + _F32(-1.6666667e-01)
    s = s * q * t + t
    c = _F32(-2.6051615e-07)
    c = c * q + _F32(2.4760495e-05)
    c = c * q + _F32(-1.3888378e-03)
    c = c * q + _F32(4.1666638e-02)
    c = c * q + _F32(-5.0000000e-01)
    c = c * q + _ONE
    return _ONE - _TWO * s * s, _TWO * s * c


@jit
def fresnel_reflectance(cos_inside: float, eta: float) -> float:
    """Unpolarised Fresnel reflectance from inside a medium of relative index ``eta``."""
    sin_outside = eta * math.sqrt(max(0.0, 1.0 - cos_inside * cos_inside))
    if sin_outside >= 1.0:
        return 1.0
    cos_outside = math.sqrt(1.0 - sin_outside * sin_outside)
    r_s = (eta * cos_inside - cos_outside) / (eta * cos_inside + cos_outside)
    r_p = (cos_inside - eta * cos_outside) / (cos_inside + eta * cos_outside)
    return 0.5 * (r_s * r_s + r_p * r_p)


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
    """List the lanes above the surface or due for roulette; return how many there are."""
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
    """Add a photon that leaves: boost albedo^n in the bin of its radius at the surface.

    What it left inside since the last booking is boost (albedo^settled - albedo^n).
    """
    settled = int(words[_SETTLED + lane])
    collisions = int(words[_COLLISIONS + lane]) - 1  # ``advance`` counted one it did not reach
    boost = float(floats[_BOOST + lane])
    overshoot = floats[_Z + lane] / floats[_DZ + lane]  # share of the flight above the surface
    x = floats[_X + lane] - overshoot * floats[_DX + lane]
    y = floats[_Y + lane] - overshoot * floats[_DY + lane]
    rho = math.sqrt(float(x) * float(x) + float(y) * float(y))
    for c in range(channels.last_bin.size):
        weight = boost * power(channels, collisions, c)
        ledger.absorbed[c] += boost * power(channels, settled, c) - weight
        radial_bin = min(int(rho * channels.bins_per_mean_free_path[c]), channels.last_bin[c])
        cell = channels.first_cell[c] + radial_bin
        ledger.bins[cell, 0] += weight
        ledger.bins[cell, 1] += weight * weight


@jit_inline
def score_event(
    sums: FloatArray,
    gain: float,
    words: LaneWords,
    lane: int,
    boost: float,
    channels: Channels,
    absorbed: FloatArray,
) -> None:
    """Book absorption up to the lane's present collision n, and gain boost albedo^n in ``sums``."""
    settled = int(words[_SETTLED + lane])
    collisions = int(words[_COLLISIONS + lane])
    for c in range(absorbed.size):
        weight = boost * power(channels, collisions, c)
        absorbed[c] += boost * power(channels, settled, c) - weight
        sums[c, 0] += gain * weight
        sums[c, 1] += (gain * weight) ** 2
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
    """Play roulette, or stop at the collision cap; book either and say whether the walk goes on.

    The weights roulette takes and gives are uncorrelated with mean zero (a martingale), so their
    squares sum to the variance of the run's energy balance.
    """
    boost = float(floats[_BOOST + lane])
    absorbed = ledger.absorbed
    if words[_COLLISIONS + lane] >= COLLISION_CAP:
        score_event(ledger.unfinished, 1.0, words, lane, boost, channels, absorbed)
        return False
    if next_unit(words, lane) >= _SURVIVAL:
        score_event(ledger.roulette, -1.0, words, lane, boost, channels, absorbed)
        return False
    score_event(ledger.roulette, float(_GAIN) - 1.0, words, lane, boost, channels, absorbed)
    level = words[_LEVEL + lane] + _U32(1)
    words[_LEVEL + lane] = _U32(level)
    words[_EVENT + lane] = roulette_at[level]
    floats[_BOOST + lane] *= _GAIN
    return True


@jit
def move_lane(floats: LaneFloats, words: LaneWords, source: int, target: int) -> None:
    """Copy one lane's whole state, generator included, over another's."""
    for row in range(_FLOAT_ROWS):
        floats[row * LANES + target] = floats[row * LANES + source]
    for row in range(_WORD_ROWS):
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
    """Let a photon leave, reflect or play roulette; say whether its walk goes on."""
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
) -> int:
    """Walk ``photons`` photons of one batch into ``ledger``; return the number of flights.

    ``eta`` is the index of the medium relative to the outside, at least 1. ``roulette_at[k]`` is
    the number of collisions at which a walk that survived k roulettes plays the next.
    """
    floats = np.zeros(_FLOAT_ROWS * LANES, np.float32)
    words = np.zeros(_WORD_ROWS * LANES, np.uint32)
    events = np.empty(LANES, np.int64)
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
        # From the last lane down, so that the lane moved into a gap has had its event handled.
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
