"""Flights of the layered walk: every lane scatters and flies at once, without a branch.

A flight that ends inside its layer is flown; one that would leave it is not: the lane stays where
it is and is flagged, for ``layered_slots``. Depths are counted from the top of the lane's layer.

Rows are addressed by unsigned integers: numba tests every signed index for being negative, which
takes as long as the loops that copy lanes.
"""

import math

import numpy as np

from sssfit._jit import jit, jit_merged
from sssfit._jit.fused import fma, free_path, turn, uniform, with_sign
from sssfit._jit.lanes import GENERATOR_ROWS, STRIDE, Flags, Indices, LaneFloats, LaneWords

_F32 = np.float32
_U32 = np.uint32
_U64 = np.uint64

X, Y, Z, UX, UY, UZ = (_U64(k * STRIDE) for k in range(6))
WEIGHT = _U64(6 * STRIDE)  # of the least absorbing channel; 1 at entry
BOOKED = _U64(7 * STRIDE)  # the weight at the last tally
PATH = _U64(8 * STRIDE)  # since the last tally, in one layer
# Copies of the coefficients of the lane's layer
THICKNESS, FREE_PATH, CAPTURE, BACK = (_U64(k * STRIDE) for k in range(9, 13))
# What one sweep draws: 1 - cosine of a deflection, its azimuth and a flight
LESS, COS_PHI, SIN_PHI, FLIGHT = (_U64(k * STRIDE) for k in range(13, 17))
TILT = _U64(17 * STRIDE)  # 1 / (1 + |uz|); the last row
LAYER = _U64(GENERATOR_ROWS * STRIDE)  # 1 for the topmost, 0 above and L + 1 below the stack
BORN = _U64((GENERATOR_ROWS + 1) * STRIDE)  # the sweep of its entry; the last row

COLUMNS = _U64(4)  # of a table of layers: thickness, mean free path, capture, back
VECTOR = 16  # lanes of the widest vectors: loops run over multiples of it

_ZERO, _HALF, _ONE, _TWO = _F32(0.0), _F32(0.5), _F32(1.0), _F32(2.0)
_THREE_HALVES = _F32(1.5)


@jit
def hg_pdf(cos_theta: float, g: float) -> float:
    """Henyey-Greenstein density of the cosine: (1 - g^2) / (2 (1 + g^2 - 2 g cos)^(3/2))."""
    return 0.5 * (1.0 - g * g) / math.pow(1.0 + g * g - 2.0 * g * cos_theta, 1.5)


@jit_merged
def draw(floats: LaneFloats, words: LaneWords, count: int) -> None:
    """Draw a deflection, an azimuth and a flight for every lane.

    In several loops, because the processor overlaps short ones better, and their constants stay in
    registers: with ``rotate`` and ``fly`` 4.2 ns a flight in one loop, 2.8 ns in six (AVX2).
    """
    for k in range(count):
        lane = _U64(k)
        floats[LESS + lane] = uniform(words, lane)
        floats[COS_PHI + lane] = uniform(words, lane)
        floats[FLIGHT + lane] = uniform(words, lane)
    for k in range(count):
        lane = _U64(k)
        less, tilt = deflection(floats[BACK + lane], floats[LESS + lane], floats[UZ + lane])
        floats[LESS + lane] = less
        floats[TILT + lane] = tilt
    for k in range(count):
        lane = _U64(k)
        floats[COS_PHI + lane], floats[SIN_PHI + lane] = turn(floats[COS_PHI + lane])
    for k in range(count):
        lane = _U64(k)
        floats[FLIGHT + lane] = free_path(floats[FLIGHT + lane]) * floats[FREE_PATH + lane]


@jit_merged
def deflection(back: np.float32, u: np.float32, uz: np.float32) -> tuple[np.float32, np.float32]:
    """Return 1 - cosine of a Henyey-Greenstein deflection, and 1 / (1 + |uz|) for ``rotate``.

    With back = 1 - g and a uniform u, 1 - cosine is 2 back^2 (1 - u) (1 + g u) / (back + 2 g u)^2:
    the inverse of the cumulative density (1 + g^2 - ((1 - g^2)/(1 + g v))^2) / (2 g), v = 2u -
    1. Nothing cancels, and g = 0 needs no special case. A cosine, and 1 - g computed from g, would
    lose the forward peak in single precision: at g = .9999 half of all deflections are below 5e-9.
    One division serves both results.
    """
    gu = (_ONE - back) * u
    below = fma(_TWO, gu, back)
    below = below * below
    up = _ONE + abs(uz)
    inverse = _ONE / (below * up)
    above = (back * back) * ((_TWO - (u + u)) * (_ONE + gu))
    return min(above * (inverse * up), _TWO), inverse * below


@jit_merged
def rotate(floats: LaneFloats, count: int) -> None:
    """Turn every lane by its deflection and azimuth, and capture a share of its weight.

    The frame around the old direction is that of Duff et al. 2017, "Building an Orthonormal Basis,
    Revisited"; the uniform azimuth absorbs its signs.
    """
    for k in range(count):
        lane = _U64(k)
        ux, uy, uz = floats[UX + lane], floats[UY + lane], floats[UZ + lane]
        less = floats[LESS + lane]
        sideways = np.sqrt(less * (_TWO - less))
        a, b = sideways * floats[COS_PHI + lane], sideways * floats[SIN_PHI + lane]
        along = fma(a, ux, b * uy)
        old = (_ONE - less) - along * floats[TILT + lane]
        floats[UX + lane] = fma(old, ux, a)
        floats[UY + lane] = fma(old, uy, b)
        floats[UZ + lane] = fma(-less, uz, uz - with_sign(along, uz))
        weight = floats[WEIGHT + lane]
        floats[WEIGHT + lane] = fma(-weight, floats[CAPTURE + lane], weight)


@jit_merged
def fly(floats: LaneFloats, flags: Flags, count: int) -> None:
    """Fly every lane whose flight ends inside its layer, and flag the others."""
    for k in range(count):
        lane = _U64(k)
        flight, uz, z = floats[FLIGHT + lane], floats[UZ + lane], floats[Z + lane]
        end = fma(flight, uz, z)
        leaves = (end < _ZERO) | (end > floats[THICKNESS + lane])
        # A flight of length 0 instead of a choice at each store, which would be masked: slow on
        # processors that do this in microcode.
        flight = _ZERO if leaves else flight
        floats[Z + lane] = fma(flight, uz, z)
        floats[X + lane] = fma(flight, floats[UX + lane], floats[X + lane])
        floats[Y + lane] = fma(flight, floats[UY + lane], floats[Y + lane])
        floats[PATH + lane] = floats[PATH + lane] + flight
        flags[lane] = leaves


@jit_merged
def list_flagged(flags: Flags, eights: Indices, count: int, lanes: Indices) -> int:
    """List the flagged lanes; groups of 64 without any, as in most sweeps of a thick layer, cost 1.

    ``eights`` is the memory of the flags as words of eight.
    """
    groups = (count + 63) >> 6
    for k in range(count, 64 * groups):
        flags[_U64(k)] = 0
    found = 0
    for group in range(groups):
        some = _U64(0)
        for k in range(8):
            some = _U64(some | eights[_U64(8 * group + k)])
        if some != _U64(0):
            for k in range(64):
                lane = _U64(64 * group + k)
                lanes[_U64(found)] = lane
                found += int(flags[lane])
    return found


@jit_merged
def renormalise(floats: LaneFloats, count: int) -> None:
    """Bring directions back to unit length by one Newton step."""
    for k in range(count):
        lane = _U64(k)
        ux, uy, uz = floats[UX + lane], floats[UY + lane], floats[UZ + lane]
        unit = fma(-_HALF, fma(ux, ux, fma(uy, uy, uz * uz)), _THREE_HALVES)
        floats[UX + lane] = ux * unit
        floats[UY + lane] = uy * unit
        floats[UZ + lane] = uz * unit


@jit
def remove_lanes(
    floats: LaneFloats, words: LaneWords, shares: LaneFloats, gone: Flags, live: int
) -> int:
    """Move the last live lanes, generators included, into the gaps; return how many are left."""
    lane = 0
    while lane < live:
        while live > lane and gone[live - 1]:
            live -= 1
            gone[live] = 0
        if lane < live and gone[lane]:
            live -= 1
            for block in (floats, shares):
                for row in range(0, block.size, STRIDE):
                    block[row + lane] = block[row + live]
            for row in range(0, words.size, STRIDE):
                words[row + lane] = words[row + live]
            gone[lane] = 0
        lane += 1
    return live
