"""Passes of a kernel in texture space: bilinear fetches that the surface's stretch places.

Pictures are (N, C), N = H W texels row after row, of the texture or of one of half its size.
"""

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sssfit._jit import jit

FloatArray = npt.NDArray[np.floating[Any]]


class Texture(NamedTuple):
    """What of a texture is there, and how far its texels lie apart."""

    cover: FloatArray  # (N,) part of a texel that holds light; where it is 0 nothing is written
    per_mm: FloatArray  # (N, 2) texels that a mm takes, down and right
    width: int
    height: int


@jit
def fetch(
    light: FloatArray,
    picture: FloatArray,
    cover: FloatArray,
    width: int,
    height: int,
    y: float,
    x: float,
) -> float:
    """Fetch at a place in texels from the first one's middle; return coverage.

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
            column = left + j
            if column < 0 or column >= width:
                continue
            q = row * width + column
            weight = part * (right if j == 1 else 1.0 - right) * cover[q]
            if weight == 0.0:
                continue
            share += weight
            for c in range(light.size):
                light[c] += weight * picture[q, c]
    return share


@jit
def gather(
    out: FloatArray,
    picture: FloatArray,
    places_mm: FloatArray,
    weights: FloatArray,
    texture: Texture,
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
    divide : bool
        By the sum of weights times coverage. Where that is 0 the texel stays as it was.
    """
    # Each read of an array from the tuple counts its references, so read them once.
    cover, per_mm = texture.cover, texture.per_mm
    width, height = texture.width, texture.height
    channels = weights.shape[1]
    light, total, mass = np.empty(channels), np.empty(channels), np.empty(channels)
    for p in range(first, last):
        if cover[p] == 0.0:
            continue
        row, column = p // width, p % width
        down, right = per_mm[p, 0], per_mm[p, 1]
        for c in range(channels):
            total[c] = mass[c] = 0.0
        for k in range(weights.shape[0]):
            y, x = row + places_mm[k, 0] * down, column + places_mm[k, 1] * right
            share = fetch(light, picture, cover, width, height, y, x)
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
    out: FloatArray, share: FloatArray, picture: FloatArray, texture: Texture, places: FloatArray
) -> None:
    """Write light (M, C) and coverage (M,) at places (M, 2) in texels down and right."""
    light, cover = np.empty(picture.shape[1]), texture.cover
    width, height = texture.width, texture.height
    for p in range(places.shape[0]):
        share[p] = fetch(light, picture, cover, width, height, places[p, 0], places[p, 1])
        for c in range(light.size):
            out[p, c] = light[c] / share[p] if share[p] > 0.0 else 0.0
