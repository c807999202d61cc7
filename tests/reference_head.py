"""Slow and literal: a bilinear height field met by marching in tiny steps, and a bisection."""

import numpy as np


def height_at(heights, x0, y0, spacing, x, y):
    """Bilinear, node by node; nothing outside the nodes."""
    u, v = (np.asarray(x) - x0) / spacing, (np.asarray(y) - y0) / spacing
    j = np.clip(np.floor(u).astype(int), 0, heights.shape[1] - 2)
    i = np.clip(np.floor(v).astype(int), 0, heights.shape[0] - 2)
    a, b = u - j, v - i
    z = (1 - a) * (1 - b) * heights[i, j] + a * (1 - b) * heights[i, j + 1]
    z = z + (1 - a) * b * heights[i + 1, j] + a * b * heights[i + 1, j + 1]
    outside = (u < 0) | (v < 0) | (u > heights.shape[1] - 1) | (v > heights.shape[0] - 1)
    return np.where(outside, -np.inf, z)


def blocked(field, point, light, step):
    """Whether any of many points on the way to the light lies below the surface."""
    length = (field[0].max() - point[2]) / light[2] + step
    t = np.arange(2.0 * step, length, step)
    x, y, z = (point[k] + t * light[k] for k in range(3))
    return bool((z < height_at(*field, x, y)).any())


def first_meeting(field, distance, x, y, step):
    """Depth below the eye at which the ray through (x, y, 0) first goes under, or inf."""
    length = np.sqrt(x * x + y * y + distance * distance)
    ray = np.array((x, y, -distance)) / length

    def above(t):
        point = np.array((0.0, 0.0, distance))[:, None] + ray[:, None] * np.atleast_1d(t)
        return point[2] - height_at(*field, point[0], point[1])

    start = (distance - field[0].max()) / -ray[2]
    t = np.arange(start - step, (distance - field[0].min()) / -ray[2] + step, step)
    under = np.flatnonzero(above(t) <= 0.0)
    if under.size == 0:
        return np.inf
    low, high = t[under[0] - 1], t[under[0]]
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if above(middle)[0] <= 0.0 else (middle, high)
    return -ray[2] * high


def first_run(front, back, point, light, step, gap):
    """Where a march from a point is first between two fields, from and to, and whether again."""
    t = np.arange(0.5 * step, 600.0, step)
    x, y, z = (point[k] + t * light[k] for k in range(3))
    inside = np.flatnonzero((z <= height_at(*front, x, y)) & (z >= height_at(*back, x, y)))
    if inside.size == 0:
        return -1.0, -1.0, False
    breaks = np.flatnonzero(np.diff(inside) * step > gap)
    last = inside[breaks[0]] if breaks.size else inside[-1]
    return t[inside[0]] - 0.5 * step, t[last] + 0.5 * step, breaks.size > 0
