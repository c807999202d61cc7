"""Triangles on pixels: which one is seen, and where on it."""

import math

import numpy as np
import numpy.typing as npt

from sssfit._jit import jit

FloatArray = npt.NDArray[np.float64]
IndexArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]


@jit
def draw(
    corners: FloatArray,
    inverse_depth: FloatArray,
    drawn: BoolArray,
    first_number: int,
    owner: IndexArray,
    places: FloatArray,
    nearest: FloatArray,
) -> None:
    """Draw triangles over what is there; pixels whose middle they cover take the nearest.

    Parameters
    ----------
    corners : array (F, 3, 2)
        Pixels to the right and down; the middle of the upper left one is at (.5, .5).
    inverse_depth : array (F, 3)
        1 / depth of the corners; 1 where the picture is flat, and the last triangle wins.
    drawn : array (F,) of bool
    first_number : int
        Number of the first triangle in ``owner``.
    owner : array (H, W) of int
        The triangle of each pixel, -1 where there is none.
    places : array (H, W, 2)
        Shares of the second and third corner, in perspective.
    nearest : array (H, W)
        1 / depth of what is drawn; 0 where there is nothing.
    """
    height, width = owner.shape
    for f in range(corners.shape[0]):
        if not drawn[f]:
            continue
        ax, ay = corners[f, 0]
        bx, by = corners[f, 1]
        cx, cy = corners[f, 2]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area == 0.0 or not math.isfinite(area):
            continue
        low_x, high_x = min(ax, bx, cx), max(ax, bx, cx)
        low_y, high_y = min(ay, by, cy), max(ay, by, cy)
        if high_x < 0.0 or low_x > width or high_y < 0.0 or low_y > height:
            continue
        left, right = max(math.ceil(low_x - 0.5), 0), min(math.floor(high_x - 0.5), width - 1)
        top, bottom = max(math.ceil(low_y - 0.5), 0), min(math.floor(high_y - 0.5), height - 1)
        ia, ib, ic = inverse_depth[f]
        for row in range(top, bottom + 1):
            y = row + 0.5
            for column in range(left, right + 1):
                x = column + 0.5
                b = ((x - ax) * (cy - ay) - (y - ay) * (cx - ax)) / area
                c = ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / area
                if b < 0.0 or c < 0.0 or b + c > 1.0:
                    continue
                near = ia + b * (ib - ia) + c * (ic - ia)
                if near < nearest[row, column]:
                    continue
                nearest[row, column] = near
                owner[row, column] = first_number + f
                places[row, column, 0] = b * ib / near
                places[row, column, 1] = c * ic / near


@jit
def lit_share(x: float, y: float, inverse_depth: float, nearest: FloatArray) -> float:
    """Return the part of a light that reaches a place: 2 x 2 texels of its map, bilinear.

    ``inverse_depth`` is that of the place, ``nearest`` (H, W) the map. Beyond the map, and where it
    is empty, the light arrives.
    """
    height, width = nearest.shape
    left, top = math.floor(x - 0.5), math.floor(y - 0.5)
    right_share, down_share = x - 0.5 - left, y - 0.5 - top
    share = 0.0
    for i in range(2):
        for j in range(2):
            row, column = top + i, left + j
            weight = down_share if i == 1 else 1.0 - down_share
            weight *= right_share if j == 1 else 1.0 - right_share
            is_on_map = 0 <= row < height and 0 <= column < width
            if not is_on_map or inverse_depth >= nearest[row, column]:
                share += weight
    return share


@jit
def interpolate(
    out: FloatArray,
    faces: IndexArray,
    places: FloatArray,
    corners: IndexArray,
    values: FloatArray,
) -> None:
    """Write values (V, K) of corners (F, 3) at places (N, 2) of triangles (N,) into ``out``."""
    for p in range(faces.size):
        i, j, k = corners[faces[p]]
        b, c = places[p]
        a = 1.0 - b - c
        for n in range(values.shape[1]):
            out[p, n] = a * values[i, n] + b * values[j, n] + c * values[k, n]


@jit
def add_light(
    out: FloatArray,
    points: FloatArray,
    normals: FloatArray,
    place: FloatArray,
    power: FloatArray,
    axes: FloatArray,
    scale: float,
    nearest: FloatArray,
    bias: float,
) -> None:
    """Add the irradiance of a point light to places (N, 3) with unit normals; ``out`` (N, C).

    ``power`` (C,) is the irradiance at normal incidence times the square of the distance; the
    others are those of a shadow map.
    """
    size = nearest.shape[0]
    away, moved, view = np.empty(3), np.empty(3), np.empty(3)
    for p in range(points.shape[0]):
        square = cosine = 0.0
        for n in range(3):
            away[n] = place[n] - points[p, n]
            square += away[n] * away[n]
            cosine += away[n] * normals[p, n]
            moved[n] = bias * normals[p, n] - away[n]
        if cosine <= 0.0 or square == 0.0:
            continue
        for n in range(3):
            view[n] = axes[n, 0] * moved[0] + axes[n, 1] * moved[1] + axes[n, 2] * moved[2]
        share = 1.0
        if view[2] > 0.0:
            x = 0.5 * size + scale * view[0] / view[2]
            y = 0.5 * size + scale * view[1] / view[2]
            share = lit_share(x, y, 1.0 / view[2], nearest)
        lit = share * cosine / (square * math.sqrt(square))
        for c in range(power.size):
            out[p, c] += lit * power[c]
