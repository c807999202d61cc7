"""Rays and height fields: the first intersection of a ray with bilinear patches, and its normal.

A field is heights z [mm] on nodes (row, column) ``spacing`` mm apart, bilinear in between. Rays are
given in cells across (x along columns, y along rows) and mm up (z), with parameter t in mm. A
pyramid of maxima lets a ray skip blocks that it cannot touch (Tevs, Ihrke, Seidel 2008, "Maximum
mipmaps for fast, accurate, and scalable dynamic height field rendering"); within a cell the
intersection is the root of a quadratic, so there are no step-size errors.
"""

import math

import numpy as np
import numpy.typing as npt

from sssfit._jit import jit, jit_inline

FloatArray = npt.NDArray[np.float64]
Levels = npt.NDArray[np.int64]
Vector = tuple[float, float, float]

# Step past the border of a cell, so that the ray is inside the next cell [mm].
NUDGE_MM = 1e-7
START_LEVEL = 4


@jit
def fill_maxima(heights: FloatArray, levels: Levels, maxima: FloatArray) -> None:
    """Fill the pyramid; ``levels`` (L, 3) holds offset, rows, columns; level 0 is one cell each."""
    rows, columns = levels[0, 1], levels[0, 2]
    for i in range(rows):
        for j in range(columns):
            left = max(heights[i, j], heights[i + 1, j])
            right = max(heights[i, j + 1], heights[i + 1, j + 1])
            maxima[i * columns + j] = max(left, right)
    for level in range(1, levels.shape[0]):
        below, above = levels[level - 1], levels[level]
        for i in range(above[1]):
            for j in range(above[2]):
                largest = -np.inf
                for k in range(2 * i, min(2 * i + 2, below[1])):
                    for m in range(2 * j, min(2 * j + 2, below[2])):
                        largest = max(largest, maxima[below[0] + k * below[2] + m])
                maxima[above[0] + i * above[2] + j] = largest


@jit_inline
def clip_axis(
    start: float, slope: float, end: float, near: float, far: float
) -> tuple[float, float]:
    """Clip [near, far] to 0 <= start + t slope <= end."""
    if slope == 0.0:
        return (near, far) if 0.0 <= start <= end else (1.0, 0.0)
    first, second = -start / slope, (end - start) / slope
    return max(near, min(first, second)), min(far, max(first, second))


@jit_inline
def patch_root(
    heights: FloatArray, row: int, column: int, at: Vector, step: Vector, length: float
) -> float:
    """Return the first t in [0, length] where the ray is on or under the patch; -1 if above.

    Height over the patch is f(t) = C + B t + A t^2, because the patch is a + b u + c v + e u v.
    """
    u, v = at[0] - column, at[1] - row
    dx, dy, dz = step
    corner = heights[row, column]
    b = heights[row, column + 1] - corner
    c = heights[row + 1, column] - corner
    e = heights[row + 1, column + 1] - corner - b - c
    constant = at[2] - (corner + b * u + c * v + e * u * v)
    if constant <= 0.0:
        return 0.0
    linear = dz - (b * dx + c * dy + e * (u * dy + v * dx))
    square = -e * dx * dy
    root = math.inf
    discriminant = linear * linear - 4.0 * square * constant
    if discriminant >= 0.0:
        # The stable form, without differences of nearly equal numbers.
        q = -0.5 * (linear + math.copysign(math.sqrt(discriminant), linear))
        if square != 0.0 and q / square >= 0.0:
            root = q / square
        if q != 0.0 and 0.0 <= constant / q < root:
            root = constant / q
    return root if root <= length else -1.0


@jit
def first_hit(
    heights: FloatArray,
    levels: Levels,
    maxima: FloatArray,
    start: Vector,
    step: Vector,
    near: float,
    far: float,
) -> float:
    """Return parameter t [mm] in [near, far] of the first intersection; -1 if there is none."""
    x, y, z = start
    dx, dy, dz = step
    near, far = clip_axis(x, dx, heights.shape[1] - 1.0, near, far)
    near, far = clip_axis(y, dy, heights.shape[0] - 1.0, near, far)
    top = levels.shape[0] - 1
    highest = maxima[levels[top, 0]]
    if dz < 0.0:
        near = max(near, (highest - z) / dz)
    elif dz > 0.0:
        far = min(far, (highest - z) / dz)
    # Rays start or end near the surface, where large blocks are rarely skipped: 16 cells.
    level, t = min(top, START_LEVEL), near
    while t < far:
        size = 1 << level
        inside = t + NUDGE_MM
        column = min(max(int((x + inside * dx) / size), 0), levels[level, 2] - 1)
        row = min(max(int((y + inside * dy) / size), 0), levels[level, 1] - 1)
        end = far
        if dx != 0.0:
            end = min(end, ((column + (dx > 0.0)) * size - x) / dx)
        if dy != 0.0:
            end = min(end, ((row + (dy > 0.0)) * size - y) / dy)
        end = max(end, inside)
        lowest = z + (end if dz < 0.0 else t) * dz
        if lowest > maxima[levels[level, 0] + row * levels[level, 2] + column]:
            t = end
            level = min(level + 1, top)
        elif level > 0:
            level -= 1
        else:
            at = (x + t * dx, y + t * dy, z + t * dz)
            root = patch_root(heights, row, column, at, step, end - t)
            if root >= 0.0:
                return t + root
            t = end
    return -1.0


@jit_inline
def bilinear(values: FloatArray, x: float, y: float) -> float:
    """Return the value between nodes; x and y in cells."""
    column = min(max(int(x), 0), values.shape[1] - 2)
    row = min(max(int(y), 0), values.shape[0] - 2)
    u, v = x - column, y - row
    upper = values[row, column] * (1.0 - u) + values[row, column + 1] * u
    lower = values[row + 1, column] * (1.0 - u) + values[row + 1, column + 1] * u
    value: float = upper * (1.0 - v) + lower * v
    return value


@jit_inline
def slope_at(heights: FloatArray, row: int, column: int) -> tuple[float, float]:
    """Return central differences at a node [mm per cell]; one-sided at the border."""
    rows, columns = heights.shape
    left, right = max(column - 1, 0), min(column + 1, columns - 1)
    before, after = max(row - 1, 0), min(row + 1, rows - 1)
    across = (heights[row, right] - heights[row, left]) / (right - left)
    along = (heights[after, column] - heights[before, column]) / (after - before)
    return across, along


@jit_inline
def normal_at(heights: FloatArray, spacing: float, x: float, y: float) -> Vector:
    """Interpolate the unit normal from four nodes' slopes, so that no cell shows as a facet."""
    column = min(max(int(x), 0), heights.shape[1] - 2)
    row = min(max(int(y), 0), heights.shape[0] - 2)
    u, v = x - column, y - row
    across, along = 0.0, 0.0
    for i in range(2):
        for j in range(2):
            weight = (v if i else 1.0 - v) * (u if j else 1.0 - u)
            a, b = slope_at(heights, row + i, column + j)
            across += weight * a
            along += weight * b
    nx, ny = -across / spacing, -along / spacing
    length = math.sqrt(nx * nx + ny * ny + 1.0)
    return nx / length, ny / length, 1.0 / length
