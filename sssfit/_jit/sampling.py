"""Sampling for all photon walks: random streams, exponential paths, directions, Fresnel.

A walk keeps ``LANES`` photons in two flat blocks, one of single-precision numbers and one of 32-bit
words, with a row of ``LANES`` entries for each quantity. They are flat so that LLVM sees that rows
do not overlap. The first four rows of words hold the lanes' generators.

Every lane of a batch has its own random numbers (xoshiro128++, Blackman and Vigna 2021, seeded by
splitmix64 from seed, batch and lane): so a batch gives the same bits on any thread and in any
order. numba promotes uint32 + uint32 to uint64, hence the cast around every intermediate.
"""

import math

import numpy as np
import numpy.typing as npt

from sssfit._jit import jit, jit_inline
from sssfit._jit.lanes import LANES, LaneWords

_F32 = np.float32
_U32 = np.uint32
_U64 = np.uint64
_S0, _S1, _S2, _S3 = 0, LANES, 2 * LANES, 3 * LANES
_HALF, _ONE, _TWO = _F32(0.5), _F32(1.0), _F32(2.0)
_PI, _LN2 = _F32(math.pi), _F32(math.log(2.0))
_UNIT = _F32(2.0**-23)
_SQRT_HALF_BITS = _U32(0x3F3504F3)  # sqrt(1/2) as float32
_ONE_BITS = _U32(0x3F800000)
_MANTISSA = _U32(0x007FFFFF)


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

    A libm call would prevent the flight loop from being vectorised. Absolute error under 1e-7.
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
    """Return the unpolarised Fresnel reflectance from inside a medium of relative index ``eta``."""
    sin_outside = eta * math.sqrt(max(0.0, 1.0 - cos_inside * cos_inside))
    if sin_outside >= 1.0:
        return 1.0
    cos_outside = math.sqrt(1.0 - sin_outside * sin_outside)
    r_s = (eta * cos_inside - cos_outside) / (eta * cos_inside + cos_outside)
    r_p = (cos_inside - eta * cos_outside) / (cos_inside + eta * cos_outside)
    return 0.5 * (r_s * r_s + r_p * r_p)


@jit_inline
def falling_bin(cosine: float, cosines: npt.NDArray[np.float64]) -> int:
    """Return the bin of a cosine among falling ones that separate bins; 0 if there are none."""
    low, high = 0, cosines.size
    while low < high:
        middle = (low + high) >> 1
        if cosine <= cosines[middle]:
            low = middle + 1
        else:
            high = middle
    return low
