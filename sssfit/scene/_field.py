"""Height fields with tables for fast ray intersection; threads light them in bands of rows."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray
from sssfit.process import thread_count

# Rows a thread takes at a time; thin bands, since the head is in the middle of the picture.
BAND = 16


@dataclass(frozen=True, slots=True, eq=False)
class HeightField:
    """Heights on nodes, bilinear in between.

    Parameters
    ----------
    heights : array (rows, columns) [mm]
        Heights of the nodes, toward the camera; rows go up, columns to the right.
    x0_mm, y0_mm : float [mm]
        Position of the first node.
    spacing_mm : float [mm]
        Spacing of the nodes, the same along rows and columns.
    inner : array (rows, columns), optional
        Above 0 where a separate object (label 2) lies in the surface; the rest is label 1.
    """

    heights: FloatArray
    x0_mm: float
    y0_mm: float
    spacing_mm: float
    inner: FloatArray | None = None
    tables: tuple[Any, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        heights = np.ascontiguousarray(self.heights, dtype=np.float64)
        inner = np.full_like(heights, -1.0) if self.inner is None else self.inner
        inner = np.ascontiguousarray(inner, dtype=np.float64)
        levels, maxima = _pyramid(heights)
        place = (float(self.x0_mm), float(self.y0_mm), float(self.spacing_mm))
        object.__setattr__(self, "tables", (heights, inner, levels, maxima, *place))


def _pyramid(heights: FloatArray) -> tuple[npt.NDArray[np.int64], FloatArray]:
    """Offset, rows and columns of each level, and the maxima of all levels in one array."""
    from sssfit._jit.heightfield import fill_maxima

    rows, columns = heights.shape[0] - 1, heights.shape[1] - 1
    levels, offset = [], 0
    while True:
        levels.append((offset, rows, columns))
        offset += rows * columns
        if rows == 1 and columns == 1:
            break
        rows, columns = (rows + 1) // 2, (columns + 1) // 2
    table, maxima = np.array(levels, dtype=np.int64), np.empty(offset)
    fill_maxima(heights, table, maxima)
    return table, maxima


@dataclass(frozen=True, slots=True, eq=False)
class Solid:
    """A solid between two height fields on the same nodes, as in `HeightField`.

    Parameters
    ----------
    front, back : array (rows, columns) [mm]
        Heights of its surface toward the camera and away from it; where the back is above the front
        there is no solid.
    x0_mm, y0_mm, spacing_mm : float [mm]
    """

    front: FloatArray
    back: FloatArray
    x0_mm: float
    y0_mm: float
    spacing_mm: float
    tables: tuple[Any, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        front = np.ascontiguousarray(self.front, dtype=np.float64)
        back = np.ascontiguousarray(self.back, dtype=np.float64)
        place = (float(self.x0_mm), float(self.y0_mm), float(self.spacing_mm))
        ends = (float(back.min()), float(front.max()))
        object.__setattr__(self, "tables", (front, back, *place, *ends))


@dataclass(frozen=True, slots=True)
class Lighting:
    """Lights on a field: directions to the light, and irradiance at normal incidence."""

    key: tuple[float, float, float]
    fill: tuple[float, float, float] = (0.0, 0.0, 1.0)
    strengths: tuple[float, float, float] = (1.0, 0.0, 0.0)
    exponent: float = 20.0
    face_on: float = 0.028


@dataclass(frozen=True, slots=True, eq=False)
class Buffers:
    """What the camera sees, (H, W) each; the background has depth inf, label 0 and no light."""

    depth_mm: FloatArray
    labels: npt.NDArray[np.int32]
    irradiance: FloatArray
    specular: FloatArray


def light_field(
    fine: HeightField,
    lighting: Lighting,
    *,
    shape: tuple[int, int],
    mm_per_pixel: float,
    distance_mm: float,
    floor_mm: float,
    coarse: HeightField | None = None,
    behind: Solid | None = None,
    smooth: bool = True,
    threads: int | None = None,
) -> Buffers:
    """Light a field and view it in perspective from ``distance_mm`` above its origin.

    ``coarse`` casts shadows from outside the fine field. ``behind`` is the solid that casts the
    shadows of a key light behind the field. ``smooth`` averages several samples per pixel; without
    it a pixel shows its centre.
    """
    from sssfit._jit import thread_pool
    from sssfit._jit.lit_field import light_rows

    buffers = Buffers(
        np.full(shape, np.inf), np.zeros(shape, np.int32), np.zeros(shape), np.zeros(shape)
    )
    body = (behind or Solid(fine.heights, fine.heights, 0.0, 0.0, 1.0)).tables
    tables = (fine.tables, (coarse or fine).tables, body, behind is not None)
    view = (float(mm_per_pixel), float(distance_mm), float(floor_mm))
    lamp = (lighting.key, lighting.fill, lighting.strengths, lighting.exponent, lighting.face_on)

    def band(first: int) -> None:
        rows = (first, min(first + BAND, shape[0]))
        light_rows(
            tables,
            view,
            lamp,
            smooth,
            rows,
            buffers.depth_mm,
            buffers.labels,
            buffers.irradiance,
            buffers.specular,
        )

    with thread_pool(thread_count(threads)) as pool:
        list(pool.map(band, range(0, shape[0], BAND)))
    return buffers


def light_through(
    fine: HeightField,
    solid: Solid,
    light: tuple[float, float, float],
    *,
    shape: tuple[int, int],
    mm_per_pixel: float,
    distance_mm: float,
    floor_mm: float,
    threads: int | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Return the path of light inside to each pixel's centre [mm], and its cosine at entry.

    Both are (H, W), and 0 where the surface faces the light and on the background; the cosine is
    also 0 in the shadow of another part. The view is that of `light_field`.
    """
    from sssfit._jit import thread_pool
    from sssfit._jit.lit_field import through_rows

    thickness, cosines = np.zeros(shape), np.zeros(shape)
    view = (float(mm_per_pixel), float(distance_mm), float(floor_mm))

    def band(first: int) -> None:
        rows = (first, min(first + BAND, shape[0]))
        through_rows(fine.tables, solid.tables, view, light, rows, thickness, cosines)

    with thread_pool(thread_count(threads)) as pool:
        list(pool.map(band, range(0, shape[0], BAND)))
    return thickness, cosines
