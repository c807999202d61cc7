"""Interfaces of the layered walk: the lanes that meet one do so together, in slots.

``gather`` copies the flagged lanes into slots, ``meet`` lets all of them reflect or refract without
a branch, and ``settle`` copies them back. A photon that goes on has a fresh free path, which is as
good as the rest of the old one: free paths have no memory.
"""

import numpy as np

from sssfit._jit import jit_merged
from sssfit._jit.fused import fma, free_path, uniform, with_sign
from sssfit._jit.lanes import GENERATOR_ROWS, STRIDE, SUMS, Indices, LaneFloats, LaneWords
from sssfit._jit.layered_lanes import (
    BACK,
    CAPTURE,
    COLUMNS,
    FREE_PATH,
    LAYER,
    PATH,
    THICKNESS,
    UX,
    UY,
    UZ,
    X,
    Y,
    Z,
)

_F32 = np.float32
_U32 = np.uint32
_U64 = np.uint64

# Rows of a slot; those of position and direction are those of a lane.
LENGTH = _U64(6 * STRIDE)  # the path in the layer so far, then to the interface
_FRESH = _U64(7 * STRIDE)  # the path flown after the event
_OWN_THICKNESS, _OWN_FREE_PATH = _U64(8 * STRIDE), _U64(9 * STRIDE)
_RATIO = _U64(10 * STRIDE)  # refractive index over that beyond the interface
_NEXT_THICKNESS, _NEXT_FREE_PATH = _U64(11 * STRIDE), _U64(12 * STRIDE)
_CROSSES = _U64(GENERATOR_ROWS * STRIDE)
_MEETS_AGAIN = _U64((GENERATOR_ROWS + 1) * STRIDE)

CROSSING_COLUMNS = _U64(3)  # of a table of interfaces: ratio, thickness and mean free path beyond
SUM_MASK = _U64(SUMS - 1)

_ZERO, _HALF, _ONE = _F32(0.0), _F32(0.5), _F32(1.0)
_NO, _YES = _U32(0), _U32(1)
_U0, _U1, _U2, _U3 = (_U64(k) for k in range(4))
_SIGN = _U64(31)
_GRAZING = _F32(1e-6)  # least cosine after refraction: a photon along a clear layer would never end


@jit_merged
def gather(
    source: LaneWords,
    words: LaneWords,
    events: Indices,
    count: int,
    target: LaneWords,
    crossings: LaneWords,
) -> None:
    """Copy the listed lanes into slots, with the interface ahead of each.

    Lanes, slots and interfaces are floats that are copied as words, in ordinary registers.
    """
    for k in range(count):
        slot = _U64(k)
        lane = events[slot]
        uz = source[UZ + lane]
        upward = _U64(_U64(uz) >> _SIGN)
        row = _U64(_U64(_U64(words[LAYER + lane]) * _U2 + upward) * CROSSING_COLUMNS)
        target[X + slot] = source[X + lane]
        target[Y + slot] = source[Y + lane]
        target[Z + slot] = source[Z + lane]
        target[UX + slot] = source[UX + lane]
        target[UY + slot] = source[UY + lane]
        target[UZ + slot] = uz
        target[LENGTH + slot] = source[PATH + lane]
        target[_OWN_THICKNESS + slot] = source[THICKNESS + lane]
        target[_OWN_FREE_PATH + slot] = source[FREE_PATH + lane]
        target[_RATIO + slot] = crossings[row]
        target[_NEXT_THICKNESS + slot] = crossings[row + _U1]
        target[_NEXT_FREE_PATH + slot] = crossings[row + _U2]


@jit_merged
def meet(e: LaneFloats, words: LaneWords, count: int) -> None:
    """Fly to the interface, reflect or refract there by Fresnel and Snell, and fly on.

    A flight that would meet another interface ends at this one.
    """
    for k in range(count):
        slot = _U64(k)
        ux, uy, uz = e[UX + slot], e[UY + slot], e[UZ + slot]
        own, beyond, ratio = e[_OWN_THICKNESS + slot], e[_NEXT_THICKNESS + slot], e[_RATIO + slot]
        own_path, next_path = e[_OWN_FREE_PATH + slot], e[_NEXT_FREE_PATH + slot]
        length = abs(((own if uz > _ZERO else _ZERO) - e[Z + slot]) / uz)
        x, y = fma(length, ux, e[X + slot]), fma(length, uy, e[Y + slot])
        e[LENGTH + slot] = e[LENGTH + slot] + length
        cosine = abs(uz)
        # 1 - ratio^2 (1 - cosine^2): exactly cosine^2 at ratio 1, where nothing may be reflected
        square = fma(ratio * ratio, cosine * cosine, (_ONE - ratio) * (_ONE + ratio))
        refracted = np.sqrt(max(square, _ZERO))
        # The squared amplitudes s^2 and q^2 over (p t)^2: the choice needs no division.
        scaled, scaled_next = ratio * cosine, ratio * refracted
        p, t = scaled + refracted, cosine + scaled_next
        s, q = (scaled - refracted) * t, (cosine - scaled_next) * p
        whole = p * t
        crosses = uniform(words, slot) * (whole * whole) >= _HALF * (s * s + q * q)
        vx, vy = (ux * ratio if crosses else ux), (uy * ratio if crosses else uy)
        vz = with_sign(max(refracted, _GRAZING), uz) if crosses else -uz
        thickness = beyond if crosses else own
        flight = free_path(uniform(words, slot)) * (next_path if crosses else own_path)
        start = _ZERO if vz > _ZERO else thickness
        end = fma(flight, vz, start)
        again = (end < _ZERO) | (end > thickness)
        flight = _ZERO if again else flight
        e[X + slot], e[Y + slot] = fma(flight, vx, x), fma(flight, vy, y)
        e[Z + slot] = start if again else end
        e[UX + slot], e[UY + slot], e[UZ + slot] = vx, vy, vz
        e[_FRESH + slot] = flight
        words[_CROSSES + slot] = _YES if crosses else _NO
        words[_MEETS_AGAIN + slot] = _YES if again else _NO


@jit_merged
def settle(
    target: LaneWords,
    words: LaneWords,
    source: LaneWords,
    slot_words: LaneWords,
    events: Indices,
    count: int,
    layers: LaneWords,
    exits: Indices,
) -> tuple[int, int]:
    """Copy slots back into their lanes, with the coefficients of the layer that each is in now.

    Lists those that meet another interface in ``events`` and those that have left in ``exits``;
    returns their numbers.
    """
    below = _U64(_U64(layers.size) // COLUMNS - _U1)
    again, left = 0, 0
    for k in range(count):
        slot = _U64(k)
        lane = events[slot]
        uz = source[UZ + slot]
        upward = _U64(_U64(uz) >> _SIGN)
        # one layer down, or up: 1 - 2 of unsigned words wraps and comes back
        step = _U64(slot_words[_CROSSES + slot])
        layer = _U64(_U64(words[LAYER + lane]) + _U64(step * _U64(_U1 - _U64(_U2 * upward))))
        target[X + lane] = source[X + slot]
        target[Y + lane] = source[Y + slot]
        target[Z + lane] = source[Z + slot]
        target[UX + lane] = source[UX + slot]
        target[UY + lane] = source[UY + slot]
        target[UZ + lane] = uz
        target[PATH + lane] = source[_FRESH + slot]
        words[LAYER + lane] = _U32(layer)
        row = _U64(layer * COLUMNS)
        target[THICKNESS + lane] = layers[row]
        target[FREE_PATH + lane] = layers[row + _U1]
        target[CAPTURE + lane] = layers[row + _U2]
        target[BACK + lane] = layers[row + _U3]
        events[_U64(again)] = lane
        exits[_U64(left)] = lane
        again += int(slot_words[_MEETS_AGAIN + slot])
        left += int((layer == _U0) | (layer == below))
    return again, left
