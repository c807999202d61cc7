"""Samplers in single precision with explicit fused multiply-adds, for the layered walk.

Polynomials and rotations take about half as many instructions with fused multiply-adds. They are
asked for one by one: a compiler that may fuse where it likes (``fastmath``) would give other bits
on processors without the instruction, where an explicit one is computed exactly in software.

The generator is xoshiro128+ (Blackman and Vigna 2021): its lowest bits are weak, and ``uniform``
takes the upper 23 only. Four rows of a block of words, ``STRIDE`` apart, hold the states of its
lanes.
"""

import math

import numpy as np
from numba.core import types
from numba.extending import intrinsic, overload

from sssfit._jit import jit, jit_merged
from sssfit._jit.lanes import LANES, STRIDE, LaneWords
from sssfit._jit.sampling import splitmix64

_F32 = np.float32
_U32 = np.uint32
_U64 = np.uint64
_S0, _S1, _S2, _S3 = (_U64(k * STRIDE) for k in range(4))
_GOLDEN = _U64(0x9E3779B97F4A7C15)
_HALF, _ONE, _TWO = _F32(0.5), _F32(1.0), _F32(2.0)
_ONE_BITS, _SIGN_BIT, _MANTISSA = _U32(0x3F800000), _U32(0x80000000), _U32(0x007FFFFF)
_SQRT_HALF_BITS = _U32(0x3F3504F3)  # sqrt(1/2) as float32
_BELOW_ONE = _F32(1.0 - 2.0**-24)  # turns 1 to 2 into the middles of 2^23 equal parts of (0, 1)
_PI, _LN2, _BIAS = _F32(math.pi), _F32(math.log(2.0)), _F32(127.0)
_MINUS_PER_LN2 = _F32(-1.0 / math.log(2.0))
_LN2_HIGH, _LN2_LOW = _F32(0.693359375), _F32(2.12194440e-4)  # Cephes' split: their difference
_UNDERFLOW = _F32(87.0)  # exp(-87) = 1.6e-38 is the last but one power of e that is normal


def fma(a: np.float32, b: np.float32, c: np.float32) -> np.float32:
    """Return a b + c, rounded once."""
    return _F32(float(a) * float(b) + float(c))


@intrinsic
def _fused(_context, a, b, c):  # type: ignore[no-untyped-def]
    def generate(_context, builder, _signature, args):  # type: ignore[no-untyped-def]
        return builder.fma(*args)

    return types.float32(a, b, c), generate


@overload(fma, inline="always")
def _compiled_fma(a, b, c):  # type: ignore[no-untyped-def]  # noqa: ARG001
    return lambda a, b, c: _fused(a, b, c)  # type: ignore[call-arg]


@jit
def seed_streams(words: LaneWords, seed: np.uint64, stream: np.uint64) -> None:
    """Give every lane of a block its own generator state: consecutive splitmix64 outputs."""
    start = splitmix64(_U64(seed))
    for k in range(LANES):
        lane = _U64(k)
        counter = _U64(2) * _U64(_U64(stream) * _U64(LANES) + lane)
        first = splitmix64(_U64(start + _U64(counter + _U64(1)) * _GOLDEN))
        second = splitmix64(_U64(start + _U64(counter + _U64(2)) * _GOLDEN))
        words[_S0 + lane] = _U32(first)
        words[_S1 + lane] = _U32(first >> _U64(32))
        words[_S2 + lane] = _U32(second)
        words[_S3 + lane] = _U32(second >> _U64(32))


@jit_merged
def uniform(words: LaneWords, lane: np.uint64) -> np.float32:
    """Uniform in the open interval (0, 1): the middle of one of 2^23 equal parts."""
    s0, s1 = words[_S0 + lane], words[_S1 + lane]
    s2, s3 = words[_S2 + lane], words[_S3 + lane]
    word = _U32(s0 + s3)
    shifted = _U32(s1 << _U32(9))
    s2 = _U32(s2 ^ s0)
    s3 = _U32(s3 ^ s1)
    words[_S1 + lane] = _U32(s1 ^ s2)
    words[_S0 + lane] = _U32(s0 ^ s3)
    words[_S2 + lane] = _U32(s2 ^ shifted)
    words[_S3 + lane] = _U32(_U32(s3 << _U32(11)) | _U32(s3 >> _U32(21)))
    return _U32(_U32(word >> _U32(9)) | _ONE_BITS).view(np.float32) - _BELOW_ONE


@jit_merged
def free_path(u: np.float32) -> np.float32:
    """-ln u for u in (0, 1), in mean free paths: u = 2^e (1 + m), ln(1 + m) = m + m^2 P(m).

    P is a least-squares fit of degree 6 for sqrt(1/2) <= 1 + m < sqrt(2); absolute error 1e-7.
    """
    bits = _U32(_F32(u).view(np.uint32) + _U32(_ONE_BITS - _SQRT_HALF_BITS))
    biased = _F32(np.int32(bits >> _U32(23)))
    m = _U32(_U32(bits & _MANTISSA) + _SQRT_HALF_BITS).view(np.float32) - _ONE
    y = fma(_F32(-9.744327515e-02), m, _F32(1.623019278e-01))
    y = fma(y, m, _F32(-1.737986654e-01))
    y = fma(y, m, _F32(1.990389824e-01))
    y = fma(y, m, _F32(-2.495786846e-01))
    y = fma(y, m, _F32(3.333470821e-01))
    y = fma(y, m, _F32(-5.000067353e-01))
    return fma(_BIAS - biased, _LN2, -fma(y, m * m, m))


@jit_merged
def turn(u: np.float32) -> tuple[np.float32, np.float32]:
    """Cosine and sine of 2 pi u - pi for u in (0, 1), from the half angle in (-pi/2, pi/2).

    The polynomials are those of ``sampling.cos_sin_turn``.
    """
    t = (u - _HALF) * _PI
    q = t * t
    s = fma(_F32(-2.3889859e-08), q, _F32(2.7525562e-06))
    s = fma(s, q, _F32(-1.9840874e-04))
    s = fma(s, q, _F32(8.3333310e-03))
    s = fma(s, q, _F32(-1.6666667e-01))
    s = fma(s * q, t, t)
    c = fma(_F32(-2.6051615e-07), q, _F32(2.4760495e-05))
    c = fma(c, q, _F32(-1.3888378e-03))
    c = fma(c, q, _F32(4.1666638e-02))
    c = fma(c, q, _F32(-5.0000000e-01))
    c = fma(c, q, _ONE)
    twice = s + s
    return fma(-twice, s, _ONE), twice * c


@jit_merged
def decay(x: np.float32) -> np.float32:
    """exp(-x) for x >= 0, by 2^n and Cephes' polynomial; relative error 2e-7, never above 1.

    A libm call would not be vectorised, and its last bit differs between machines.
    """
    x = min(x, _UNDERFLOW)
    n = np.floor(fma(x, _MINUS_PER_LN2, _HALF))
    r = fma(n, _LN2_LOW, fma(n, -_LN2_HIGH, -x))
    p = fma(_F32(1.9875691500e-4), r, _F32(1.3981999507e-3))
    p = fma(p, r, _F32(8.3334519073e-3))
    p = fma(p, r, _F32(4.1665795894e-2))
    p = fma(p, r, _F32(1.6666665459e-1))
    p = fma(p, r, _HALF)
    power = _U32(_U32(np.int32(n) + np.int32(127)) << _U32(23)).view(np.float32)
    return fma(p, r * r, r + _ONE) * power


@jit_merged
def with_sign(magnitude: np.float32, sign: np.float32) -> np.float32:
    """Return a number with its sign changed where that of the second is minus."""
    flip = _U32(_F32(sign).view(np.uint32) & _SIGN_BIT)
    return _U32(_F32(magnitude).view(np.uint32) ^ flip).view(np.float32)
