"""The photon walk through layers, in lanes: all of MCML (Wang, Jacques, Zheng 1995).

Any number of layers, Henyey-Greenstein scattering, Fresnel and total internal reflection at every
interface, clear layers, finite stacks or a semi-infinite last layer. As in
``sssfit._jit.semi_infinite``, ``LANES`` photons advance side by side without a branch: each flies
to its next collision or to the interface before it, whichever comes first, and then scatters or
waits for its Fresnel event. The events (interfaces, roulette, the collision cap) are then handled
lane by lane.

Channels may share a walk if they differ in absorption only. The walk follows the least absorbing
one (weight times albedo at a collision, implicit capture as published); the weights of the others
are reduced by exp(-delta L), with delta their excess absorption and L the path. This estimates the
same energy, with weights that never exceed the walk's own.

Lengths are in mm. Weights are tallied whenever a photon leaves a layer: the weight lost since it
entered is absorbed in the layer.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sssfit._jit import jit, jit_inline
from sssfit._jit.sampling import (
    GENERATOR_ROWS,
    LANES,
    LaneFloats,
    LaneWords,
    cos_sin_turn,
    fresnel_reflectance,
    negative_log,
    next_unit,
    seed_lanes,
)
from sssfit._jit.semi_infinite import COLLISION_CAP, ROULETTE_SPREAD

_F32 = np.float32
_U32 = np.uint32

_X, _Y, _Z = 0, LANES, 2 * LANES
_UX, _UY, _UZ = 3 * LANES, 4 * LANES, 5 * LANES
_DEPTH = 6 * LANES  # optical depth left to the next collision
_WEIGHT = 7 * LANES  # of the least absorbing channel; 1 at entry
_PATH = 8 * LANES  # path since the last tally, in one layer
# Copies of the coefficients of the lane's layer. Looking them up in the stack's arrays, which might
# alias this one for LLVM, would prevent ``advance`` from being vectorised.
_TOP, _BOTTOM = 9 * LANES, 10 * LANES
_SIGMA_T, _CAPTURE, _BACK = 11 * LANES, 12 * LANES, 13 * LANES
_FLOAT_ROWS = 14
_LAYER = GENERATOR_ROWS * LANES
_COLLISIONS = (GENERATOR_ROWS + 1) * LANES
_AT_INTERFACE = (GENERATOR_ROWS + 2) * LANES
_WORD_ROWS = GENERATOR_ROWS + 3

_ZERO, _HALF, _ONE, _TWO, _THREE = _F32(0.0), _F32(0.5), _F32(1.0), _F32(2.0), _F32(3.0)
_ZERO_WORD, _ONE_WORD = _U32(0), _U32(1)
# MCML's roulette threshold: below it, one in ten survives with ten times the weight.
_THRESHOLD = _F32(1e-4)
_SURVIVAL = _F32(0.1)
_GAIN = _F32(10.0)
_GRAZING = 1e-6  # least cosine after refraction: a photon along a clear layer would never end

FloatArray = npt.NDArray[np.float64]


class Stack(NamedTuple):
    """Layers from the top down, for a walk's least absorbing channel; L layers, K channels."""

    top_mm: LaneFloats  # (L,)
    bottom_mm: LaneFloats  # (L,): infinite for a semi-infinite last layer
    sigma_t_per_mm: LaneFloats  # (L,)
    capture: LaneFloats  # (L,): 1 - albedo, which float32 holds better than an albedo near 1
    back: LaneFloats  # (L,): 1 - g, which float32 holds better than a g near 1
    eta: FloatArray  # (L + 2,): above, the layers, below
    excess_per_mm: FloatArray  # (L, K): absorption beyond that of the least absorbing channel


class Bins(NamedTuple):
    """Positions of the walk's K channels among all channels of the ledger."""

    per_mm: float  # bins of the radial grid per mm
    last: int  # the bin that stands for "beyond the grid"
    channel: npt.NDArray[np.int64]  # (K,)


class Ledger(NamedTuple):
    """Sums over photons of weight and of weight squared; a photon enters with weight 1."""

    reflected: FloatArray  # (n + 1, C, 2)
    transmitted: FloatArray  # (n + 1, C, 2)
    absorbed: FloatArray  # (L, C)
    unfinished: FloatArray  # (C, 2)
    roulette: FloatArray  # (C, 2): what roulette added, zero on average, and its variance


@jit
def sample_hg(back: np.float32, u: np.float32) -> np.float32:
    """Return 1 - cosine of a Henyey-Greenstein deflection, g > 0 forward, from a uniform u.

    ``back`` is 1 - g. The inverse of the cumulative density, (1 + g^2 - ((1 - g^2)/(1 + g v))^2) /
    (2 g) with v = 2u - 1, gives 1 minus the cosine as 2 (1 - g)^2 (1 - u) (1 + g u) / (1 - g + 2 g
    u)^2: nothing cancels, and g = 0 needs no special case. A cosine, and 1 - g computed from g,
    would lose the forward peak in single precision: at g = .9999 half of all deflections are below
    5e-9.
    """
    g = _ONE - back
    below = back + _TWO * g * u
    return min(_TWO * back * back * (_ONE - u) * (_ONE + g * u) / (below * below), _TWO)


@jit
def hg_pdf(cos_theta: float, g: float) -> float:
    """Density of the cosine that ``sample_hg`` gives: (1 - g^2) / (2 (1 + g^2 - 2 g cos)^(3/2))."""
    return 0.5 * (1.0 - g * g) / math.pow(1.0 + g * g - 2.0 * g * cos_theta, 1.5)


@jit
def advance(floats: LaneFloats, words: LaneWords, live: int) -> None:
    """Move every live lane to its next collision or interface; scatter those that collide.

    The frame around the old direction is the branch-free one of Duff et al. 2017, "Building an
    Orthonormal Basis, Revisited". One Newton step keeps directions at unit length over thousands of
    collisions.
    """
    for lane in range(live):
        sigma_t = floats[_SIGMA_T + lane]
        z, depth, weight = floats[_Z + lane], floats[_DEPTH + lane], floats[_WEIGHT + lane]
        ux, uy, uz = floats[_UX + lane], floats[_UY + lane], floats[_UZ + lane]
        # Load both before the choice, because a load inside a branch is not vectorised.
        top, bottom = floats[_TOP + lane], floats[_BOTTOM + lane]
        interface = bottom if uz > _ZERO else top
        # abs: for a flight along the layer (uz = 0), 0/-0 must not give a length of -inf
        to_interface = abs((interface - z) / uz)
        to_collision = depth / sigma_t
        meets = to_interface < to_collision
        flight = to_interface if meets else to_collision
        floats[_X + lane] += flight * ux
        floats[_Y + lane] += flight * uy
        floats[_Z + lane] = interface if meets else z + flight * uz
        floats[_PATH + lane] += flight
        fresh = negative_log(next_unit(words, lane))
        floats[_DEPTH + lane] = max(depth - flight * sigma_t, _ZERO) if meets else fresh
        floats[_WEIGHT + lane] = weight if meets else weight - weight * floats[_CAPTURE + lane]
        words[_COLLISIONS + lane] += _ZERO_WORD if meets else _ONE_WORD
        words[_AT_INTERFACE + lane] = _ONE_WORD if meets else _ZERO_WORD

        less = sample_hg(floats[_BACK + lane], next_unit(words, lane))
        cos_theta = _ONE - less
        sin_theta = np.sqrt(less * (_TWO - less))
        cos_phi, sin_phi = cos_sin_turn(next_unit(words, lane))
        a, b = sin_theta * cos_phi, sin_theta * sin_phi
        sign = _ONE if uz >= _ZERO else -_ONE
        c = -_ONE / (sign + uz)
        d = ux * uy * c
        vx = a * (_ONE + sign * ux * ux * c) + b * d + cos_theta * ux
        vy = a * sign * d + b * (sign + uy * uy * c) + cos_theta * uy
        vz = -a * sign * ux - b * uy + cos_theta * uz
        unit = _HALF * (_THREE - (vx * vx + vy * vy + vz * vz))
        floats[_UX + lane] = ux if meets else vx * unit
        floats[_UY + lane] = uy if meets else vy * unit
        floats[_UZ + lane] = uz if meets else vz * unit


@jit
def find_events(
    floats: LaneFloats, words: LaneWords, live: int, events: npt.NDArray[np.int64]
) -> int:
    """List the lanes at an interface, below the roulette threshold or at the collision cap."""
    count = 0
    for lane in range(live):
        events[count] = lane
        count += (
            (words[_AT_INTERFACE + lane] != _ZERO_WORD)
            | (floats[_WEIGHT + lane] < _THRESHOLD)
            | (words[_COLLISIONS + lane] >= _U32(COLLISION_CAP))
        )
    return count


@jit_inline
def enter_layer(floats: LaneFloats, words: LaneWords, lane: int, layer: int, stack: Stack) -> None:
    """Put a lane into a layer: set its number and copy the coefficients of the flight."""
    words[_LAYER + lane] = _U32(layer)
    floats[_TOP + lane] = stack.top_mm[layer]
    floats[_BOTTOM + lane] = stack.bottom_mm[layer]
    floats[_SIGMA_T + lane] = stack.sigma_t_per_mm[layer]
    floats[_CAPTURE + lane] = stack.capture[layer]
    floats[_BACK + lane] = stack.back[layer]


@jit
def launch(
    floats: LaneFloats,
    words: LaneWords,
    booked: FloatArray,
    lane: int,
    first_layer: int,
    diffuse: bool,
    stack: Stack,
) -> None:
    """Put a new photon into a lane, at the top of the first layer that is not clear.

    It enters along the normal or, ``diffuse``, with the cosine law of a uniformly lit surface.
    """
    uz = np.sqrt(next_unit(words, lane)) if diffuse else _ONE
    cos_phi, sin_phi = cos_sin_turn(next_unit(words, lane))
    sideways = np.sqrt(_ONE - uz * uz)
    floats[_X + lane] = _ZERO
    floats[_Y + lane] = _ZERO
    floats[_Z + lane] = stack.top_mm[first_layer]
    floats[_UX + lane] = sideways * cos_phi
    floats[_UY + lane] = sideways * sin_phi
    floats[_UZ + lane] = uz
    floats[_DEPTH + lane] = negative_log(next_unit(words, lane))
    floats[_WEIGHT + lane] = _ONE
    floats[_PATH + lane] = _ZERO
    enter_layer(floats, words, lane, first_layer, stack)
    words[_COLLISIONS + lane] = _ZERO_WORD
    words[_AT_INTERFACE + lane] = _ZERO_WORD
    for k in range(booked.shape[1]):
        booked[lane, k, 0] = 1.0  # share of the walk's weight that this channel still has
        booked[lane, k, 1] = 1.0  # its weight at the last tally


@jit_inline
def book_layer(
    floats: LaneFloats,
    words: LaneWords,
    booked: FloatArray,
    lane: int,
    stack: Stack,
    bins: Bins,
    absorbed: FloatArray,
) -> None:
    """Tally the weight that every channel lost in this layer since the last tally."""
    layer = int(words[_LAYER + lane])
    path = float(floats[_PATH + lane])
    weight = float(floats[_WEIGHT + lane])
    for k in range(booked.shape[1]):
        excess = stack.excess_per_mm[layer, k]
        if excess > 0.0:
            booked[lane, k, 0] *= math.exp(-excess * path)
        now = weight * booked[lane, k, 0]
        absorbed[layer, bins.channel[k]] += booked[lane, k, 1] - now
        booked[lane, k, 1] = now
    floats[_PATH + lane] = _ZERO


@jit_inline
def score_exit(
    floats: LaneFloats, booked: FloatArray, lane: int, bins: Bins, cells: FloatArray
) -> None:
    """Add a photon that has left the stack, in the bin of its radius at the surface."""
    x, y = float(floats[_X + lane]), float(floats[_Y + lane])
    radial_bin = min(int(math.sqrt(x * x + y * y) * bins.per_mm), bins.last)
    for k in range(booked.shape[1]):
        weight = booked[lane, k, 1]
        cells[radial_bin, bins.channel[k], 0] += weight
        cells[radial_bin, bins.channel[k], 1] += weight * weight


@jit_inline
def score_weight(
    booked: FloatArray, lane: int, bins: Bins, gain: float, spread: float, sums: FloatArray
) -> None:
    """Add every channel's weight w as gain w and, for the variance, spread w^2."""
    for k in range(booked.shape[1]):
        weight = booked[lane, k, 1]
        sums[bins.channel[k], 0] += gain * weight
        sums[bins.channel[k], 1] += spread * weight * weight


@jit_inline
def survives_roulette(
    floats: LaneFloats, words: LaneWords, booked: FloatArray, lane: int, bins: Bins, ledger: Ledger
) -> bool:
    """Play roulette for a tallied lane; the weight it adds or takes has mean zero."""
    if next_unit(words, lane) >= _SURVIVAL:
        score_weight(booked, lane, bins, -1.0, ROULETTE_SPREAD, ledger.roulette)
        return False
    score_weight(booked, lane, bins, float(_GAIN) - 1.0, ROULETTE_SPREAD, ledger.roulette)
    floats[_WEIGHT + lane] *= _GAIN
    for k in range(booked.shape[1]):
        booked[lane, k, 1] *= float(_GAIN)
    return True


@jit_inline
def refract(floats: LaneFloats, lane: int, ratio: float) -> None:
    """Turn a direction into the next medium by Snell's law; ratio = n_from / n_to."""
    ux, uy = ratio * float(floats[_UX + lane]), ratio * float(floats[_UY + lane])
    cosine = max(math.sqrt(max(0.0, 1.0 - ux * ux - uy * uy)), _GRAZING)
    floats[_UX + lane] = _F32(ux)
    floats[_UY + lane] = _F32(uy)
    floats[_UZ + lane] = _F32(cosine if floats[_UZ + lane] > _ZERO else -cosine)


@jit_inline
def cross_interface(
    floats: LaneFloats,
    words: LaneWords,
    booked: FloatArray,
    lane: int,
    stack: Stack,
    bins: Bins,
    ledger: Ledger,
) -> bool:
    """Reflect at or pass the interface ahead; return whether the photon is still inside."""
    layer = int(words[_LAYER + lane])
    down = floats[_UZ + lane] > _ZERO
    ratio = stack.eta[layer + 1] / (stack.eta[layer + 2] if down else stack.eta[layer])
    if ratio != 1.0:
        reflectance = fresnel_reflectance(abs(float(floats[_UZ + lane])), ratio)
        if next_unit(words, lane) < reflectance:
            floats[_UZ + lane] = -floats[_UZ + lane]
            return True
    book_layer(floats, words, booked, lane, stack, bins, ledger.absorbed)
    if down and layer == stack.top_mm.size - 1:
        score_exit(floats, booked, lane, bins, ledger.transmitted)
        return False
    if not down and layer == 0:
        score_exit(floats, booked, lane, bins, ledger.reflected)
        return False
    if ratio != 1.0:
        refract(floats, lane, ratio)
    enter_layer(floats, words, lane, layer + 1 if down else layer - 1, stack)
    return True


@jit_inline
def handle_event(
    floats: LaneFloats,
    words: LaneWords,
    booked: FloatArray,
    lane: int,
    stack: Stack,
    bins: Bins,
    ledger: Ledger,
) -> bool:
    """Let a photon pass an interface, play roulette or stop; return whether its walk goes on."""
    if words[_AT_INTERFACE + lane] != _ZERO_WORD:
        return cross_interface(floats, words, booked, lane, stack, bins, ledger)
    book_layer(floats, words, booked, lane, stack, bins, ledger.absorbed)
    if words[_COLLISIONS + lane] >= _U32(COLLISION_CAP):
        score_weight(booked, lane, bins, 1.0, 1.0, ledger.unfinished)
        return False
    return survives_roulette(floats, words, booked, lane, bins, ledger)


@jit
def move_lane(
    floats: LaneFloats, words: LaneWords, booked: FloatArray, source: int, target: int
) -> None:
    """Copy one lane's whole state, generator included, over another's."""
    for row in range(_FLOAT_ROWS):
        floats[row * LANES + target] = floats[row * LANES + source]
    for row in range(_WORD_ROWS):
        words[row * LANES + target] = words[row * LANES + source]
    booked[target] = booked[source]


@jit
def trace_batch(
    seed: np.uint64,
    batch: np.int64,
    photons: int,
    first_layer: int,
    diffuse: bool,
    stack: Stack,
    bins: Bins,
    ledger: Ledger,
) -> int:
    """Walk ``photons`` photons of one batch into ``ledger``; return the number of flights.

    ``first_layer`` is the first that is not clear; the reflection of the beam by the clear ones
    above it counts as specular.
    """
    floats = np.zeros(_FLOAT_ROWS * LANES, np.float32)
    words = np.zeros(_WORD_ROWS * LANES, np.uint32)
    booked = np.zeros((LANES, bins.channel.size, 2))
    events = np.empty(LANES, np.int64)
    seed_lanes(words, seed, batch)
    live = min(LANES, photons)
    waiting = photons - live
    for lane in range(live):
        launch(floats, words, booked, lane, first_layer, diffuse, stack)
    flights = 0
    while live > 0:
        advance(floats, words, live)
        flights += live
        # From the last lane down, so that a lane moved into a gap has already had its event
        # handled.
        for k in range(find_events(floats, words, live, events) - 1, -1, -1):
            lane = events[k]
            if handle_event(floats, words, booked, lane, stack, bins, ledger):
                continue
            if waiting > 0:
                waiting -= 1
                launch(floats, words, booked, lane, first_layer, diffuse, stack)
            else:
                live -= 1
                move_lane(floats, words, booked, live, lane)
    return flights
