"""One pass of a screen-space blur: samples along a row or a column, as a shader takes them.

Pictures are (N, C), N = H W pixels row after row. A sample lies between two pixels and is
interpolated linearly. Its weight is split into three parts: light that counts; light lost by depth,
replaced as `View.lost` says; and the share of other objects, which the middle pixel replaces.

Helpers are called and not inlined (``jit_inline``): this takes 25 ns per sample of three channels,
against 60 inlined.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sssfit._jit import jit

FloatArray = npt.NDArray[np.float64]

MIRROR, CLAMP, ZERO = 0, 1, 2
FLAT, LERP, GAUSSIAN = 0, 1, 2
NOWHERE, MIDDLE, MEAN = 0, 1, 2

# Rows of the sums over samples, (5, C).
SEEN, LOST, FOREIGN, NEAR, MASS = 0, 1, 2, 3, 4


class View(NamedTuple):
    """The other inputs of a pass, and its settings."""

    depth_mm: FloatArray  # (N,)
    mask: npt.NDArray[np.int32]  # (N,) number of the object; 0 is not blurred
    step: FloatArray  # (N,) pixels from one sample to the next
    stretch: FloatArray  # (N,) factor on differences of depth
    rate: FloatArray  # (C,) 1/mm of the lerp, 1/mm^2 of the Gaussian factor
    width: int
    height: int
    follow: int
    lost: int
    border: int


@jit
def blur(
    out: FloatArray,
    picture: FloatArray,
    weights: FloatArray,
    view: View,
    vertical: bool,
    first: int,
    last: int,
) -> None:
    """Write pixels ``first`` to ``last`` of the pass with ``weights`` (P, C) into ``out`` (N, C).

    Pixels of no object are left unchanged in ``out``.
    """
    # Each read of an array from the tuple counts its references, so read them once.
    depth_mm, mask, step, stretch, rate = (
        view.depth_mm,
        view.mask,
        view.step,
        view.stretch,
        view.rate,
    )
    follow, lost, border = view.follow, view.lost, view.border
    half = weights.shape[0] // 2
    stride = view.width if vertical else 1
    length = view.height if vertical else view.width
    sums = np.empty((5, weights.shape[1]))
    light = np.empty(weights.shape[1])
    for p in range(first, last):
        if mask[p] == 0:
            continue
        along = p // view.width if vertical else p % view.width
        base = p - along * stride
        clear(sums)
        for k in range(weights.shape[0]):
            x = along + (k - half) * step[p]
            share, dz = sample(light, picture, depth_mm, mask, p, base, stride, length, border, x)
            for c in range(light.size):
                keep = kept(dz * stretch[p], rate[c], follow)
                add(sums, c, weights[k, c], keep, share, light[c])
        for c in range(light.size):
            out[p, c] = total(sums, c, picture[p, c], lost)


@jit
def clear(sums: FloatArray) -> None:
    """Set to 0 in a loop: a slice costs 20 ns per call, as much as a sample."""
    for row in range(sums.shape[0]):
        for c in range(sums.shape[1]):
            sums[row, c] = 0.0


@jit
def sample(
    light: FloatArray,
    picture: FloatArray,
    depth_mm: FloatArray,
    mask: npt.NDArray[np.int32],
    p: int,
    base: int,
    stride: int,
    length: int,
    border: int,
    x: float,
) -> tuple[float, float]:
    """Read the picture at ``x`` on the line of pixel p into ``light`` (C,), only from its object.

    Returns the share of the two pixels that belongs to p's object, and their depth minus that of p.
    ``light`` is already multiplied by the share.
    """
    left = math.floor(x)
    part = x - left
    share, dz = 0.0, 0.0
    for c in range(light.size):
        light[c] = 0.0
    for end in range(2):
        weight = part if end == 1 else 1.0 - part
        if weight == 0.0:
            continue
        j = inside(left + end, length, border)
        if j < 0:  # beyond a dark border: black, at the depth of the middle
            share += weight
            continue
        q = base + j * stride
        if mask[q] == mask[p]:
            share += weight
            dz += weight * (depth_mm[q] - depth_mm[p])
            for c in range(light.size):
                light[c] += weight * picture[q, c]
    if share > 0.0:
        dz /= share
    return share, dz


@jit
def inside(j: int, length: int, border: int) -> int:
    """Return the source pixel for pixel j of the continued line; -1 for none."""
    index = j
    if j < 0 or j >= length:
        if border == ZERO:
            index = -1
        elif border == CLAMP:
            index = 0 if j < 0 else length - 1
        else:
            index = j % (2 * length)
            if index >= length:
                index = 2 * length - 1 - index
    return index


@jit
def kept(dz: float, rate: float, follow: int) -> float:
    """Return the share of a sample's light that remains, ``dz`` deeper than the middle."""
    share = 1.0
    if dz != 0.0:
        if follow == LERP:
            share = max(1.0 - rate * abs(dz), 0.0)
        elif follow == GAUSSIAN:
            share = math.exp(-rate * dz * dz)
    return share


@jit
def add(sums: FloatArray, c: int, weight: float, keep: float, share: float, light: float) -> None:
    """Add a sample to the sums of channel c."""
    sums[SEEN, c] += weight * keep * light
    sums[LOST, c] += weight * (1.0 - keep) * share
    sums[FOREIGN, c] += weight * (1.0 - share)
    sums[NEAR, c] += abs(weight) * keep * light
    sums[MASS, c] += abs(weight) * keep * share


@jit
def total(sums: FloatArray, c: int, middle: float, lost: int) -> float:
    """Return a pixel of the pass: seen light, foreign from the middle, lost as chosen."""
    instead = 0.0
    if lost == MIDDLE or (lost == MEAN and sums[MASS, c] == 0.0):
        instead = middle
    elif lost == MEAN:
        instead = sums[NEAR, c] / sums[MASS, c]
    left: float = sums[SEEN, c] + sums[FOREIGN, c] * middle + sums[LOST, c] * instead
    return left
