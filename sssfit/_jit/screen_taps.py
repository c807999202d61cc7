"""Passes of a table of taps in screen space: bilinear fetches that reach as far as depth says.

Pictures are (N, C), N = H W texels row after row, of one resolution and one object. A fetch takes
coverage times light, coverage, and the mean depth of what it covers; the depth factor exp(-rate
dz^2) multiplies its coverage, and a pass is divided by the sum of that.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sssfit._jit import jit
from sssfit._jit.screen import inside

FloatArray = npt.NDArray[np.float64]


class Texels(NamedTuple):
    """The object on the texels of one resolution."""

    cover: FloatArray  # (N,) part that the object covers; where it is 0 nothing is read or written
    depth_mm: FloatArray  # (N,)
    per_mm: FloatArray  # (N,) texels that a mm of the surface takes
    width: int
    height: int
    border: int


@jit
def gather(
    out: FloatArray,
    picture: FloatArray,
    places_mm: FloatArray,
    weights: FloatArray,
    rate: FloatArray,
    texels: Texels,
    divide: bool,
    first: int,
    last: int,
) -> None:
    """Write texels ``first`` to ``last`` of a pass of fetches into ``out`` (N, C).

    Parameters
    ----------
    places_mm : array (F, 2) [mm]
        Places of the fetches beside the texel, down and right.
    weights : array (F, C)
    rate : array (C,) [1/mm^2]
    divide : bool
        By the sum of weights times what was covered and near. Where that is 0, and there is a
        division, the texel stays as it was.
    """
    # Each read of an array from the tuple counts its references, so read them once.
    cover, depth_mm, per_mm = texels.cover, texels.depth_mm, texels.per_mm
    width, height, border = texels.width, texels.height, texels.border
    channels = weights.shape[1]
    light = np.empty(channels)
    total, mass = np.empty(channels), np.empty(channels)
    for p in range(first, last):
        if cover[p] == 0.0:
            continue
        for c in range(channels):
            total[c] = mass[c] = 0.0
        row, column, own_mm = p // width, p % width, depth_mm[p]
        for k in range(weights.shape[0]):
            y, x = places_mm[k, 0] * per_mm[p], places_mm[k, 1] * per_mm[p]
            share, dz = fetch(
                light, picture, cover, depth_mm, own_mm, row, column, y, x, width, height, border
            )
            for c in range(channels):
                weight = weights[k, c]
                if dz != 0.0:
                    weight *= math.exp(-rate[c] * dz * dz)
                total[c] += weight * light[c]
                mass[c] += weight * share
        for c in range(channels):
            if not divide:
                out[p, c] = total[c]
            else:
                out[p, c] = total[c] / mass[c] if mass[c] > 0.0 else picture[p, c]


@jit
def fetch(
    light: FloatArray,
    picture: FloatArray,
    cover: FloatArray,
    depth_mm: FloatArray,
    own_mm: float,
    row: int,
    column: int,
    y: float,
    x: float,
    width: int,
    height: int,
    border: int,
) -> tuple[float, float]:
    """Fetch y down and x right of a texel: coverage times light into ``light`` (C,).

    Returns the coverage and the mean depth of what is covered, minus ``own_mm``. Beyond a dark
    border everything is covered and black, at the texel's own depth.
    """
    top, left = math.floor(y), math.floor(x)
    down, right = y - top, x - left
    share, dz = 0.0, 0.0
    for c in range(light.size):
        light[c] = 0.0
    for i in range(2):
        part = down if i == 1 else 1.0 - down
        if part == 0.0:
            continue
        r = inside(row + top + i, height, border)
        for j in range(2):
            weight = part * (right if j == 1 else 1.0 - right)
            if weight == 0.0:
                continue
            s = inside(column + left + j, width, border)
            if r < 0 or s < 0:
                share += weight
                continue
            q = r * width + s
            weight *= cover[q]
            if weight == 0.0:
                continue
            share += weight
            dz += weight * (depth_mm[q] - own_mm)
            for c in range(light.size):
                light[c] += weight * picture[q, c]
    if share > 0.0:
        dz /= share
    return share, dz


@jit
def enlarge(
    out: FloatArray,
    picture: FloatArray,
    rate: FloatArray,
    coarse: Texels,
    fine: Texels,
    first: int,
    last: int,
) -> None:
    """Add the picture (M, C) of half the size to texels ``first`` to ``last`` of ``out`` (N, C).

    A bilinear fetch sees four texels with 3/4 and 1/4 each way. Each has a depth factor of its own,
    relative to that of the nearest in depth, so that their sum never vanishes.
    """
    channels = picture.shape[1]
    places = np.empty(4, np.int64)
    shares, squares = np.empty(4), np.empty(4)
    cover, depth_mm = coarse.cover, coarse.depth_mm
    fine_cover, fine_depth_mm = fine.cover, fine.depth_mm
    for p in range(first, last):
        if fine_cover[p] == 0.0:
            continue
        row, column = p // fine.width, p % fine.width
        least = np.inf
        for i in range(2):
            # Its own texel, then the neighbour on its side.
            r = inside(row // 2 + i * (2 * (row % 2) - 1), coarse.height, coarse.border)
            for j in range(2):
                s = inside(column // 2 + j * (2 * (column % 2) - 1), coarse.width, coarse.border)
                k = 2 * i + j
                shares[k] = (0.25 if i == 1 else 0.75) * (0.25 if j == 1 else 0.75)
                places[k], squares[k] = -1, 0.0
                if r >= 0 and s >= 0:
                    q = r * coarse.width + s
                    shares[k] *= cover[q]
                    dz = depth_mm[q] - fine_depth_mm[p]
                    places[k], squares[k] = q, dz * dz
                if shares[k] > 0.0:
                    least = min(least, squares[k])
        for c in range(channels):
            light, mass = 0.0, 0.0
            for k in range(4):
                weight = shares[k]
                if weight > 0.0 and squares[k] != least:
                    weight *= math.exp(-rate[c] * (squares[k] - least))
                mass += weight
                if places[k] >= 0 and weight > 0.0:
                    light += weight * picture[places[k], c]
            out[p, c] += light / mass
