"""The head as a height field: the forms, the fine relief, and the grids they are sampled on."""

import math

import numpy as np

from sssfit.render._field import HeightField, Solid
from sssfit.render._head_detail import detail
from sssfit.render._head_face import face
from sssfit.render._head_shape import FLOOR_MM, FloatArray, back

# Half width of the bust, its lower end and the crown: nothing outside is modelled [mm].
BUST_WIDTH_MM, BUST_LOW_MM, BUST_HIGH_MM = 230.0, -260.0, 136.0
# Of the grid that casts shadows from outside the picture.
COARSE_MM = 0.8
# Of the body that light runs through: an ear is 3 mm thick and its rim 3 mm wide.
SOLID_MM = 0.5
# Nodes of the picture's own grid at most: 8e6 take about 0.3 GB with their tables.
MAX_NODES = 8e6
STRIP = 32


def nodes(low: float, high: float, spacing: float) -> FloatArray:
    """Whole multiples of the spacing that hold [low, high]; symmetric if that is."""
    values: FloatArray = spacing * np.arange(
        math.floor(low / spacing), math.ceil(high / spacing) + 1, dtype=np.float64
    )
    return values


def head_field(
    x: FloatArray, y: FloatArray, spacing_mm: float, detail_mm: float, threads: int
) -> HeightField:
    """Heights at nodes x (columns,), y (rows,); the eyes' openings as the inner object."""
    heights, eyes = np.empty((y.size, x.size)), np.empty((y.size, x.size))

    def strip(first: int) -> None:
        part = slice(first, first + STRIP)
        z, inside = face(x[None, :], y[part, None])
        if detail_mm > 0.0:
            z = z + detail_mm * detail(x[None, :], y[part, None], inside, spacing_mm)
        # A little below the floor, so that no ray comes to rest on it.
        heights[part], eyes[part] = np.maximum(z, FLOOR_MM - 10.0), inside

    # Before the threads, which need them all.
    import scipy.interpolate
    import scipy.ndimage  # noqa: F401

    from sssfit._jit import skin_noise, thread_pool  # noqa: F401

    with thread_pool(threads) as pool:
        list(pool.map(strip, range(0, y.size, STRIP)))
    return HeightField(heights, float(x[0]), float(y[0]), spacing_mm, eyes)


def bust(spacing_mm: float, detail_mm: float, threads: int) -> HeightField:
    """All that is modelled."""
    x = nodes(-BUST_WIDTH_MM, BUST_WIDTH_MM, spacing_mm)
    y = nodes(BUST_LOW_MM, BUST_HIGH_MM, spacing_mm)
    return head_field(x, y, spacing_mm, detail_mm, threads)


def body(threads: int) -> Solid:
    """Return all that is modelled with its back, smooth: what light runs through."""
    front = bust(SOLID_MM, 0.0, threads)
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


def seen_part(
    height: int,
    width: int,
    mm_per_pixel: float,
    distance_mm: float,
    detail_mm: float,
    threads: int,
) -> tuple[HeightField, bool]:
    """Sample what the rays can meet, three quarters of a pixel a cell; say whether that is all."""
    # Rays spread on from the plane z = 0 to the floor.
    spread = 0.5 * mm_per_pixel * (distance_mm - FLOOR_MM) / distance_mm
    across = min(spread * width, BUST_WIDTH_MM)
    low, high = max(-spread * height, BUST_LOW_MM), min(spread * height, BUST_HIGH_MM)
    spacing = min(max(0.75 * mm_per_pixel, 0.02), 0.4)
    spacing = max(spacing, math.sqrt(2.0 * across * (high - low) / MAX_NODES))
    x, y = nodes(-across, across, spacing), nodes(low, high, spacing)
    whole = across == BUST_WIDTH_MM and low == BUST_LOW_MM and high == BUST_HIGH_MM
    return head_field(x, y, spacing, detail_mm, threads), whole
