"""The head as a height field: the forms, the fine relief, and the grids they are sampled on."""

import functools
import math
from collections.abc import Callable

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.scene._field import HeightField, Solid
from sssfit.scene._head_shape import (
    FLOOR_MM,
    back,
    ellipsoid,
    gaussian,
    shape,
    smooth_max,
    smooth_step,
)

# Wavelength [mm] and height of the roughness, in depths of a pore.
ROUGH = ((7.0, 0.9), (3.1, 0.6), (1.4, 0.5), (0.62, 0.35), (0.27, 0.2))
PORE_CELL_MM, PORE_SIGMA_MM = 0.9, 0.14


def _resolution_weight(length_mm: float, spacing_mm: float) -> float:
    """Return 1 from six nodes per wavelength on, 0 below three."""
    return float(smooth_step(np.asarray((length_mm / spacing_mm - 3.0) / 3.0)))


def _noise(
    x: FloatArray, y: FloatArray, lengths: tuple[float, float], seed: int, lean: float = 0.0
) -> FloatArray:
    from sssfit._jit.skin_noise import fill_noise

    out = np.empty((y.size, x.size))
    fill_noise(x.ravel(), y.ravel(), lengths, lean, seed, out)
    return out


def _roughness(x: FloatArray, y: FloatArray, spacing_mm: float) -> FloatArray:
    """Noise of several lengths, and pores."""
    from sssfit._jit.skin_noise import fill_pores

    total = np.zeros((y.size, x.size))
    for seed, (length, height) in enumerate(ROUGH):
        if fade := _resolution_weight(length, spacing_mm):
            total += fade * height * _noise(x, y, (length, length), 10 + seed)
    if fade := _resolution_weight(4.0 * PORE_SIGMA_MM, spacing_mm):
        dents = np.empty_like(total)
        fill_pores(x.ravel(), y.ravel(), PORE_CELL_MM, PORE_SIGMA_MM, dents)
        total -= fade * dents
    return total


def _lips(x: FloatArray, y: FloatArray, spacing_mm: float) -> FloatArray:
    """Upright creases."""
    where = np.exp(-((x / 21.0) ** 4) - ((y - MOUTH_Y + 0.6) / 6.5) ** 4)
    fade = _resolution_weight(1.2, spacing_mm)
    return where * fade * 1.6 * _noise(x, y, (1.2, 9.0), 30) if fade else 0.0 * where


def _forehead(x: FloatArray, y: FloatArray) -> FloatArray:
    """Three shallow lines, higher over each brow than between them."""
    total = np.zeros((y.size, x.size))
    for height in (56.0, 65.0, 75.0):
        line = height + 2.0 * np.cos(x / 11.0) - 0.0018 * x * x + 0.6 * np.sin(0.31 * x + height)
        total -= 2.2 * gaussian(y - line, 0.9) * np.exp(-((x / 38.0) ** 4))
    return total


def _brows(x: FloatArray, y: FloatArray, spacing_mm: float) -> FloatArray:
    """Short hairs that lean outward, as relief."""
    half = np.abs(x)
    arc = 37.5 + 4.0 * gaussian(half - 38.0, 13.0) - 0.004 * (half - 30.0) ** 2
    thick = 3.6 - 0.055 * np.clip(half - 14.0, 0.0, 50.0)
    ends = smooth_step((half - 11.0) / 6.0) * smooth_step((58.0 - half) / 14.0)
    where = np.exp(-(((y - arc) / thick) ** 4)) * ends
    hairs = _resolution_weight(1.4, spacing_mm) * _noise(half, y, (0.7, 5.0), 40, lean=0.9)
    return where * (4.0 + 5.0 * hairs)


def _within(
    form: Callable[..., FloatArray],
    x: FloatArray,
    y: FloatArray,
    box: tuple[float, float, float, float],
    *more: float,
) -> FloatArray:
    """Evaluate a form on the columns and rows of its box only; outside it is 0 to 1e-6."""
    left, right, low, high = box
    columns = np.flatnonzero((x[0] >= left) & (x[0] <= right))
    rows = np.flatnonzero((y[:, 0] >= low) & (y[:, 0] <= high))
    total = np.zeros((y.size, x.size))
    if columns.size and rows.size:
        part = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
        total[part] = form(x[:, part[1]], y[part[0]], *more)
    return total


def detail(x: FloatArray, y: FloatArray, inside: FloatArray, spacing_mm: float) -> FloatArray:
    """Return the relief in depths of a pore; none on the eyes, which are smooth and wet."""
    skin = _roughness(x, y, spacing_mm)
    skin += _within(_lips, x, y, (-42.0, 42.0, -68.0, -42.0), spacing_mm)
    skin += _within(_brows, x, y, (-58.0, 58.0, 26.0, 49.0), spacing_mm)
    skin += _within(_forehead, x, y, (-75.0, 75.0, 40.0, 84.0))
    return skin * smooth_step(-inside / 0.8)


EYE_X, EYE_Y, EYE_Z = 32.0, 20.0, -23.0
MOUTH_Y = -54.0

# The nose along its ridge: y, height above the face, half width.
NOSE = np.array(
    [
        (-42.0, 0.0, 12.0),
        (-36.0, 0.2, 11.0),
        (-32.0, 2.0, 9.5),
        (-29.0, 5.0, 10.0),
        (-26.0, 9.5, 10.2),
        (-22.0, 13.0, 10.2),
        (-16.0, 14.5, 9.8),
        (-8.0, 14.0, 9.4),
        (0.0, 12.0, 9.0),
        (8.0, 8.8, 8.8),
        (16.0, 5.6, 8.6),
        (22.0, 4.2, 9.0),
        (30.0, 4.0, 12.0),
        (38.0, 2.0, 16.0),
        (46.0, 0.0, 20.0),
        (52.0, 0.0, 22.0),
    ]
)


def pair(x: FloatArray, at: float, sigma: float) -> FloatArray:
    """Add a Gaussian on either side, without a crease where the halves meet."""
    return gaussian(x - at, sigma) + gaussian(x + at, sigma)


def planes(x: FloatArray, y: FloatArray) -> FloatArray:
    """Return the broad forms, added to the head before nose, eyes and mouth."""
    add = (
        5.0 * pair(x, 27.0, 15.0) * gaussian(y - 37.0 + 0.006 * (np.hypot(x, 8.0) - 25.0) ** 2, 6.0)
    )
    add += 3.0 * gaussian(x, 10.0) * gaussian(y - 36.0, 8.0)
    add += 1.5 * pair(x, 24.0, 18.0) * gaussian(y - 72.0, 16.0)  # frontal bones
    add -= 4.0 * pair(x, 66.0, 10.0) * gaussian(y - 44.0, 20.0)  # temples
    add += 6.0 * pair(x, 46.0, 13.0) * gaussian(y + 6.0 + 0.1 * (x - 46.0), 11.0)  # cheekbones
    add -= 5.0 * pair(x, 47.0, 12.0) * gaussian(y + 42.0, 16.0)  # hollows below
    add += 6.5 * gaussian(x, 25.0) * gaussian(y + 50.0, 20.0)  # the teeth's arch
    add += 8.0 * gaussian(x, 13.0) * gaussian(y + 85.0, 9.5)  # chin
    add -= 3.5 * gaussian(x, 18.0) * gaussian(y + 70.5, 4.2)  # under the lip
    return add


def nose(x: FloatArray, y: FloatArray, z: FloatArray) -> FloatArray:
    """Bridge, tip, wings and nostrils on the surface z."""
    from scipy.interpolate import CubicSpline

    stand = CubicSpline(NOSE[:, 0], NOSE[:, 1])(np.clip(y, -42.0, 52.0))
    width = CubicSpline(NOSE[:, 0], NOSE[:, 2])(np.clip(y, -42.0, 52.0))
    z = z + np.maximum(stand, 0.0) * np.exp(-((x / width) ** 2))
    z = z + 7.5 * np.exp(-(np.hypot(x / 10.2, (y + 18.0) / 8.6) ** 3.2))
    # The wings are rounder than Gaussians; both, so that they meet without a crease.
    for sign in (-1.0, 1.0):
        wing = np.hypot((x - sign * 12.6) / 6.8, (y + 23.5) / 7.6)
        z = z + 8.0 * np.exp(-(wing**2.7))
    # The groove behind the wings, and the hole.
    behind = np.hypot(x - 12.0, (y + 24.0) / 1.05)
    side = smooth_step((x - 10.0) / 8.0) * smooth_step((y + 36.0) / 10.0)
    z = z - 0.9 * gaussian(behind - 8.6, 1.8) * side
    return z - 7.0 * pair(x, 6.6, 2.5) * gaussian(y + 29.0, 1.6)


def mouth(x: FloatArray, y: FloatArray, z: FloatArray) -> FloatArray:
    """Philtrum, lips, the line between them and the corners."""
    philtrum = smooth_step((y + 50.0) / 6.0) * smooth_step((-33.0 - y) / 6.0)
    z = z + philtrum * (0.9 * pair(x, 5.0, 1.9) - 1.2 * gaussian(x, 2.6))
    wide = np.maximum(1.0 - (x / 27.0) ** 2, 0.0)
    line = MOUTH_Y - 1.0 * gaussian(x, 5.0) + 0.8 * pair(x, 12.0, 6.0)
    bow = (7.6 - 1.6 * gaussian(x, 3.4)) * wide**0.75
    low = 9.8 * wide**0.6
    t, s = y - line, line - y
    upper = 3.0 * gaussian(t - 0.5 * bow, 2.6) * wide
    upper += 0.9 * smooth_step((bow - t + 0.6) / 1.6) * (t > 0.0) * wide
    lower = 4.4 * gaussian(s - 0.47 * low, 3.3) * wide
    lower += 0.7 * smooth_step((low - s + 0.8) / 2.4) * (s >= 0.0) * wide
    z = z + upper + lower - 2.8 * gaussian(t, 0.95) * smooth_step((28.0 - x) / 6.0)
    return z - 2.2 * gaussian(x - 27.0, 3.5) * gaussian(t, 3.5)


def fold(x: FloatArray, y: FloatArray, z: FloatArray) -> FloatArray:
    """From the wings of the nose to beside the mouth."""
    along = np.clip((-22.0 - y) / 36.0, 0.0, 1.0)
    at = 20.0 + 14.5 * along**1.2
    fade = smooth_step((-16.0 - y) / 20.0) * smooth_step((y + 62.0) / 18.0)
    d = x - at
    return z + fade * (1.3 * gaussian(d - 6.0, 5.0) - 1.1 * gaussian(d, 2.6))


def eye(x: FloatArray, y: FloatArray, z: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return socket, lids and ball, and how far inside the opening of the lids a point is."""
    u, v = x - EYE_X, y - EYE_Y
    z = z - 10.0 * pair(x, EYE_X, 12.7) * gaussian(v - 1.0, 8.5)
    z = z - 3.5 * gaussian(x - 17.0, 4.5) * gaussian(v - 3.0, 6.0)
    lids = ellipsoid(x, y, (EYE_X, EYE_Y, EYE_Z), (16.5, 13.2, 13.6))
    z = smooth_max(z, lids, 8.0)
    a = u / 14.8
    tilt = v - 1.0 * a
    open_ = np.maximum(1.0 - a * a, 0.0)
    top = 4.6 * open_**0.75 * (1.0 - 0.12 * a)
    bottom = -4.6 * open_**0.8 * (1.0 + 0.1 * a)
    crease = tilt - 9.0 * np.maximum(1.0 - (u / 19.0) ** 2, 0.0) ** 0.6
    z = z - 1.1 * gaussian(crease, 0.9) * smooth_step((18.5 - np.abs(u)) / 6.0)
    under = tilt + 10.5 * np.maximum(1.0 - (u / 21.0) ** 2, 0.0) ** 0.6
    z = z - 0.6 * gaussian(under, 1.6) * smooth_step((20.0 - np.abs(u)) / 8.0)
    inside = np.minimum(top - tilt, tilt - bottom)
    inside = np.minimum(inside, 14.8 - np.abs(u))
    ball = ellipsoid(x, y, (EYE_X, EYE_Y, EYE_Z), (15.6, 12.2, 12.2))
    # The cornea rises above the ball.
    ball = smooth_max(
        ball, ellipsoid(x, y, (EYE_X, EYE_Y + 0.3, EYE_Z + 5.6), (7.4, 7.4, 7.6)), 0.6
    )
    z = z + (np.minimum(ball, z - 0.3) - z) * smooth_step((inside + 0.35) / 0.7)
    return z, inside


def face(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the heights [mm] of the smooth head, and the eyes (above 0)."""
    half = np.abs(x)
    z = shape(x, y)
    z = z + planes(half, y)
    z = fold(half, y, z)
    z = mouth(half, y, z)
    z = nose(half, y, z)
    return eye(half, y, z)


# Half width of the bust, its lower end and the crown [mm]; the model ends there.
BUST_WIDTH_MM, BUST_LOW_MM, BUST_HIGH_MM = 230.0, -260.0, 136.0
# Spacing of the grid that casts shadows from outside the picture.
COARSE_MM = 0.8
# Spacing of the solid that light crosses: an ear is 3 mm thick and its rim 3 mm wide.
SOLID_MM = 0.5
# Most nodes of the picture's own grid: 8e6 take about 0.3 GB with their tables.
MAX_NODES = 8e6
STRIP = 32


def nodes(low: float, high: float, spacing: float) -> FloatArray:
    """Return multiples of the spacing that contain [low, high]; symmetric if the interval is."""
    values: FloatArray = spacing * np.arange(
        math.floor(low / spacing), math.ceil(high / spacing) + 1, dtype=np.float64
    )
    return values


def head_field(
    x: FloatArray, y: FloatArray, spacing_mm: float, detail_mm: float, threads: int
) -> HeightField:
    """Return the heights at nodes x (columns,), y (rows,), with the eyes as the inner object."""
    heights, eyes = np.empty((y.size, x.size)), np.empty((y.size, x.size))

    def strip(first: int) -> None:
        part = slice(first, first + STRIP)
        z, inside = face(x[None, :], y[part, None])
        if detail_mm > 0.0:
            z = z + detail_mm * detail(x[None, :], y[part, None], inside, spacing_mm)
        # A little below the floor, so that no ray ends on it.
        heights[part], eyes[part] = np.maximum(z, FLOOR_MM - 10.0), inside

    # Import before the threads, which need them all.
    import scipy.interpolate
    import scipy.ndimage  # noqa: F401

    from sssfit._jit import skin_noise, thread_pool  # noqa: F401

    with thread_pool(threads) as pool:
        list(pool.map(strip, range(0, y.size, STRIP)))
    return HeightField(heights, float(x[0]), float(y[0]), spacing_mm, eyes)


def bust(spacing_mm: float, threads: int) -> HeightField:
    """Return the whole model, smooth."""
    x = nodes(-BUST_WIDTH_MM, BUST_WIDTH_MM, spacing_mm)
    y = nodes(BUST_LOW_MM, BUST_HIGH_MM, spacing_mm)
    return head_field(x, y, spacing_mm, 0.0, threads)


@functools.lru_cache(1)  # it was half of the time of a small picture, and is the same in all
def coarse_bust(threads: int) -> HeightField:
    """Return the model that casts shadows from outside a picture."""
    return bust(COARSE_MM, threads)


@functools.lru_cache(1)
def solid_head(threads: int) -> Solid:
    """Return the smooth model with its back, the solid that light crosses."""
    front = bust(SOLID_MM, threads)
    rows, columns = front.heights.shape
    x = front.x0_mm + SOLID_MM * np.arange(columns, dtype=np.float64)
    y = front.y0_mm + SOLID_MM * np.arange(rows, dtype=np.float64)
    behind = np.empty_like(front.heights)

    def strip(first: int) -> None:
        part = slice(first, first + STRIP)
        behind[part] = back(x[None, :], y[part, None])

    from sssfit._jit import thread_pool

    with thread_pool(threads) as pool:
        list(pool.map(strip, range(0, rows, STRIP)))
    return Solid(front.heights, behind, front.x0_mm, front.y0_mm, SOLID_MM)


def visible_part(
    height: int,
    width: int,
    mm_per_pixel: float,
    distance_mm: float,
    detail_mm: float,
    threads: int,
) -> tuple[HeightField, bool]:
    """Sample the part that rays can meet, 3/4 pixel per cell; also return whether that is all."""
    # Rays continue to spread from the plane z = 0 to the floor.
    spread = 0.5 * mm_per_pixel * (distance_mm - FLOOR_MM) / distance_mm
    across = min(spread * width, BUST_WIDTH_MM)
    low, high = max(-spread * height, BUST_LOW_MM), min(spread * height, BUST_HIGH_MM)
    spacing = min(max(0.75 * mm_per_pixel, 0.02), 0.4)
    spacing = max(spacing, math.sqrt(2.0 * across * (high - low) / MAX_NODES))
    x, y = nodes(-across, across, spacing), nodes(low, high, spacing)
    whole = across == BUST_WIDTH_MM and low == BUST_LOW_MM and high == BUST_HIGH_MM
    return head_field(x, y, spacing, detail_mm, threads), whole
