"""Passes of a kernel in texture space: bilinear fetches that the surface's stretch places.

Pictures are (N, C): the texels of a map that hold light, row after row, of the map itself or of one
of half its size. Where charts meet in a texel, it is there once for each of them.
"""

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sssfit._jit import jit

FloatArray = npt.NDArray[np.floating[Any]]
IndexArray = npt.NDArray[np.int64]


class Texture(NamedTuple):
    """The texels of a map that hold light, and how far they lie apart."""

    at: IndexArray  # (height width,) a texel of each place; -1 where there is none
    following: IndexArray  # (N,) another texel of the same place, -1 behind the last
    places: IndexArray  # (N,) row times width plus column
    charts: IndexArray  # (N,)
    cover: FloatArray  # (N,) part of a texel that the chart covers
    per_mm: FloatArray  # (N, 2) texels that a mm takes, down and right
    width: int
    height: int


@jit
def fetch(
    light: FloatArray,
    picture: FloatArray,
    at: IndexArray,
    following: IndexArray,
    charts: IndexArray,
    cover: FloatArray,
    width: int,
    height: int,
    chart: int,
    y: float,
    x: float,
) -> float:
    """Fetch from a chart at a place in texels from the first one's middle; return coverage.

    ``light`` (C,) becomes coverage times light. Beyond the texture there is none.
    """
    top, left = math.floor(y), math.floor(x)
    down, right = y - top, x - left
    share = 0.0
    for c in range(light.size):
        light[c] = 0.0
    for i in range(2):
        row, part = top + i, down if i == 1 else 1.0 - down
        if part == 0.0 or row < 0 or row >= height:
            continue
        for j in range(2):
            column, side = left + j, right if j == 1 else 1.0 - right
            if side == 0.0 or column < 0 or column >= width:
                continue
            n = at[row * width + column]
            while n >= 0 and charts[n] != chart:
                n = following[n]
            if n < 0:
                continue
            weight = part * side * cover[n]
            share += weight
            for c in range(light.size):
                light[c] += weight * picture[n, c]
    return share


@jit
def gather(
    out: FloatArray,
    picture: FloatArray,
    places_mm: FloatArray,
    weights: FloatArray,
    texture: Texture,
    divide: bool,
    begin: int,
    end: int,
) -> None:
    """Write texels ``begin`` to ``end`` of a pass of fetches, each within its chart.

    Parameters
    ----------
    out : array (N, C)
    picture : array (N, C)
    places_mm : array (F, 2) [mm]
        Places of the fetches beside the texel, down and right.
    weights : array (F, C)
    texture : Texture
    divide : bool
        By the sum of weights times coverage. Where that is 0 the texel stays as it was.
    begin, end : int
    """
    # Each read of an array from the tuple counts its references, so read them once.
    at, following, places = texture.at, texture.following, texture.places
    charts, cover, per_mm = texture.charts, texture.cover, texture.per_mm
    width, height = texture.width, texture.height
    channels = weights.shape[1]
    light, total, mass = np.empty(channels), np.empty(channels), np.empty(channels)
    for p in range(begin, end):
        row, column, chart = places[p] // width, places[p] % width, charts[p]
        down, right = per_mm[p, 0], per_mm[p, 1]
        for c in range(channels):
            total[c] = mass[c] = 0.0
        for k in range(weights.shape[0]):
            y, x = row + places_mm[k, 0] * down, column + places_mm[k, 1] * right
            share = fetch(light, picture, at, following, charts, cover, width, height, chart, y, x)
            for c in range(channels):
                total[c] += weights[k, c] * light[c]
                mass[c] += weights[k, c] * share
        for c in range(channels):
            if not divide:
                out[p, c] = total[c]
            elif mass[c] != 0.0:
                out[p, c] = total[c] / mass[c]
            else:
                out[p, c] = picture[p, c]


@jit
def look_up(
    out: FloatArray,
    share: FloatArray,
    picture: FloatArray,
    texture: Texture,
    places: FloatArray,
    chart: IndexArray,
) -> None:
    """Write light (M, C) and coverage (M,) of a chart each (M,), at places in texels (M, 2)."""
    light = np.empty(picture.shape[1])
    at, following, charts, cover = texture.at, texture.following, texture.charts, texture.cover
    width, height = texture.width, texture.height
    for p in range(places.shape[0]):
        y, x = places[p]
        share[p] = fetch(
            light, picture, at, following, charts, cover, width, height, chart[p], y, x
        )
        for c in range(light.size):
            out[p, c] = light[c] / share[p] if share[p] > 0.0 else 0.0


@jit
def halve(half: Texture, wholes: IndexArray, texture: Texture) -> int:
    """Find the texels of twice the size, one for each chart at a place; return their count.

    ``at``, ``following``, ``places`` and ``charts`` of ``half`` become theirs, ``wholes`` (N,) the
    number of that which holds each texel.
    """
    count = 0
    for place in range(half.width * half.height):
        half.at[place] = -1
        for i in range(2):
            row = 2 * (place // half.width) + i
            for j in range(2):
                column = 2 * (place % half.width) + j
                if row >= texture.height or column >= texture.width:
                    continue
                n = texture.at[row * texture.width + column]
                while n >= 0:
                    whole = half.at[place]
                    while whole >= 0 and half.charts[whole] != texture.charts[n]:
                        whole = half.following[whole]
                    if whole < 0:
                        whole, count = count, count + 1
                        half.places[whole], half.charts[whole] = place, texture.charts[n]
                        half.at[place], half.following[whole] = whole, half.at[place]
                    wholes[n] = whole
                    n = texture.following[n]
    return count
