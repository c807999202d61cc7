"""Light through a solid between two height fields: path length inside, and point of entry.

A solid is the tuple (front, back, x0, y0, spacing, low, high): heights [mm] on the same nodes,
bilinear in between, with no part below ``low`` or above ``high``. It is the set back <= z <= front,
and empty where the back is above the front. Over a cell both distances are quadratic in the ray's
parameter, so lengths have no steps.
"""

import math

import numpy as np
import numpy.typing as npt

from sssfit._jit import jit, jit_inline
from sssfit._jit.heightfield import NUDGE_MM, Vector, bilinear, clip_axis, normal_at

FloatArray = npt.NDArray[np.float64]
# Largest gap of air between the visible surface, with its pores, and the smooth solid [mm].
GAP_MM = 0.5
Solid = tuple[FloatArray, FloatArray, float, float, float, float, float]


@jit_inline
def over_patch(
    heights: FloatArray, row: int, column: int, at: Vector, step: Vector
) -> tuple[float, float, float]:
    """Return the coefficients of the ray's height over a patch, C + B t + A t^2."""
    u, v = at[0] - column, at[1] - row
    dx, dy, dz = step
    corner = heights[row, column]
    b = heights[row, column + 1] - corner
    c = heights[row + 1, column] - corner
    e = heights[row + 1, column + 1] - corner - b - c
    linear = dz - (b * dx + c * dy + e * (u * dy + v * dx))
    return at[2] - (corner + b * u + c * v + e * u * v), linear, -e * dx * dy


@jit_inline
def add_roots(cuts: FloatArray, count: int, patch: Vector, length: float) -> int:
    """Sort the roots of C + B t + A t^2 within (0, length) into ``cuts``; return their number."""
    constant, linear, square = patch
    discriminant = linear * linear - 4.0 * square * constant
    if discriminant < 0.0:
        return count
    # The stable form, without differences of nearly equal numbers.
    q = -0.5 * (linear + math.copysign(math.sqrt(discriminant), linear))
    for which in range(2):
        above, below = (q, square) if which == 0 else (constant, q)
        if below == 0.0 or not 0.0 < above / below < length:
            continue
        place = count
        while place > 0 and cuts[place - 1] > above / below:
            cuts[place] = cuts[place - 1]
            place -= 1
        cuts[place] = above / below
        count += 1
    return count


@jit_inline
def value(patch: Vector, t: float) -> float:
    """C + B t + A t^2."""
    return patch[0] + t * (patch[1] + t * patch[2])


@jit
def first_run(
    solid: Solid, point: Vector, direction: Vector, cuts: FloatArray
) -> tuple[float, float, bool]:
    """Return start and end of a ray's first run inside a solid, in mm, and if it enters again.

    Both are -1 if it is never inside. Gaps under `GAP_MM` count as inside. ``cuts`` (6,) is work
    space.
    """
    front, back, x0, y0, spacing, low, high = solid
    x, y, z = (point[0] - x0) / spacing, (point[1] - y0) / spacing, point[2]
    step = (direction[0] / spacing, direction[1] / spacing, direction[2])
    near, far = clip_axis(x, step[0], front.shape[1] - 1.0, 0.0, 1e9)
    near, far = clip_axis(y, step[1], front.shape[0] - 1.0, near, far)
    near, far = clip_axis(z - low, step[2], high - low, near, far)
    start, stop, t = -1.0, -1.0, near
    while t < far:
        ahead = t + NUDGE_MM
        column = min(max(int(x + ahead * step[0]), 0), front.shape[1] - 2)
        row = min(max(int(y + ahead * step[1]), 0), front.shape[0] - 2)
        end = far
        if step[0] != 0.0:
            end = min(end, (column + (step[0] > 0.0) - x) / step[0])
        if step[1] != 0.0:
            end = min(end, (row + (step[1] > 0.0) - y) / step[1])
        end = max(end, ahead)
        at = (x + t * step[0], y + t * step[1], z + t * step[2])
        over = over_patch(front, row, column, at, step)
        under = over_patch(back, row, column, at, step)
        count = add_roots(cuts, 0, over, end - t)
        count = add_roots(cuts, count, under, end - t)
        cuts[count] = end - t
        before = 0.0
        for k in range(count + 1):
            middle = 0.5 * (before + cuts[k])
            if cuts[k] > before and value(over, middle) <= 0.0 <= value(under, middle):
                if stop >= 0.0 and t + before > stop + GAP_MM:
                    return start, stop, True
                start = t + before if stop < 0.0 else start
                stop = t + cuts[k]
            before = cuts[k]
        t = end
    return start, stop, False


@jit_inline
def outward(solid: Solid, point: Vector) -> Vector:
    """Return the normal of the front or the back, the nearer one, pointing out of the solid."""
    front, back, x0, y0, spacing = solid[:5]
    x, y = (point[0] - x0) / spacing, (point[1] - y0) / spacing
    over = abs(point[2] - bilinear(front, x, y))
    under = abs(point[2] - bilinear(back, x, y))
    if over <= under:
        return normal_at(front, spacing, x, y)
    normal = normal_at(back, spacing, x, y)
    return -normal[0], -normal[1], -normal[2]
