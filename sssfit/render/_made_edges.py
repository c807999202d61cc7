"""White shapes on black whose border pixels hold the share of them that is covered, exactly."""

import numpy as np
import numpy.typing as npt

from sssfit.render._made_checks import check_above, check_finite, check_size
from sssfit.render.scene import Scene

FloatArray = npt.NDArray[np.float64]

# Whatever the picture, so that a kernel's error does not depend on the picture's size.
DISK_RADIUS_MM = 19.2


def middle_out(pixels: int) -> FloatArray:
    """Coordinates of pixel centres from the middle of the picture, in pixels."""
    return np.arange(pixels, dtype=np.float64) - 0.5 * (pixels - 1)


def _quarter(x: FloatArray, y: FloatArray, radius: float) -> FloatArray:
    """Area that a disk around 0 shares with [0, x] x [0, y]; odd in x and in y.

    x y where the corner is inside; beyond, y xa + int_xa^x sqrt(R^2 - t^2) dt, R^2 = xa^2 + y^2.
    """
    sign = np.sign(x) * np.sign(y)
    x, y = np.minimum(np.abs(x), radius), np.minimum(np.abs(y), radius)
    start = np.minimum(np.sqrt((radius - y) * (radius + y)), x)

    def under_arc(t: FloatArray) -> FloatArray:
        root = np.sqrt((radius - t) * (radius + t))
        return 0.5 * (t * root + radius * radius * np.arcsin(t / radius))

    area: FloatArray = sign * (y * start + under_arc(x) - under_arc(start))
    return area


def disk_coverage(x: FloatArray, y: FloatArray, radius: float) -> FloatArray:
    """Share of unit pixels, centred at x (W,) and y (H,), that a disk around 0 covers: (H, W).

    Pixels that its edge does not cut are 0 or 1 exactly; of the others, differences of areas as
    large as the disk leave an error of about 1e-16 R^2.
    """
    x, y = x[None, :], y[:, None]
    farthest = np.hypot(np.abs(x) + 0.5, np.abs(y) + 0.5)
    nearest = np.hypot(np.maximum(np.abs(x) - 0.5, 0.0), np.maximum(np.abs(y) - 0.5, 0.0))
    area = np.where(farthest <= radius, 1.0, 0.0)
    rows, columns = np.nonzero((nearest < radius) & (farthest > radius))
    px, py = x[0, columns], y[rows, 0]
    cut = np.zeros(px.size)
    for dx, dy in ((0.5, 0.5), (-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5)):
        cut += np.sign(dx * dy) * _quarter(px + dx, py + dy, radius)
    area[rows, columns] = np.clip(cut, 0.0, 1.0)
    return area


def half_plane_coverage(distance: FloatArray, angle_degrees: float) -> FloatArray:
    """Share of unit pixels on the lit side of a line; ``distance`` of their centres inside it.

    With c >= s the larger and smaller of |cos|, |sin|: 1/2 + d/c while the line cuts two opposite
    sides, (h^2/2) / (c s) where it cuts a corner off, h = (c + s)/2 - |d| deep.
    """
    turn = np.radians(angle_degrees)
    s, c = sorted((abs(np.cos(turn)), abs(np.sin(turn))))
    depth = np.maximum(0.5 * (c + s) - np.abs(distance), 0.0)
    # Where s = 0 there are no corners: depth / s is not used, so 1 will do.
    corner = depth * (depth / (s or 1.0)) / (2.0 * c)
    corner = np.where(distance > 0.0, 1.0 - corner, corner)
    area: FloatArray = np.where(np.abs(distance) < 0.5 * (c - s), 0.5 + distance / c, corner)
    return area


def disk(*, height: int, width: int, mm_per_pixel: float, radius_mm: float | None = None) -> Scene:
    """White disk in the middle of black.

    Its radius is 19.2 mm by default, and a quarter of the smaller side where that does not fit.
    """
    check_size("disk", height, width, mm_per_pixel)
    if radius_mm is None:
        side_mm = min(height, width) * mm_per_pixel
        radius_mm = DISK_RADIUS_MM if side_mm >= 2.0 * DISK_RADIUS_MM else 0.25 * side_mm
    check_above("disk", "radius_mm", radius_mm, 0.0)
    area = disk_coverage(middle_out(width), middle_out(height), radius_mm / mm_per_pixel)
    return Scene("disk", area[..., None], mm_per_pixel)


def edge(
    *,
    height: int,
    width: int,
    mm_per_pixel: float,
    angle_degrees: float = 0.0,
    offset_mm: float = 0.0,
) -> Scene:
    """White half plane x cos(angle) + y sin(angle) > offset, from the middle, y up.

    So 0 lights the right half, 90 the upper one.
    """
    check_size("edge", height, width, mm_per_pixel)
    check_finite("edge", "angle_degrees", angle_degrees)
    check_finite("edge", "offset_mm", offset_mm)
    turn = np.radians(angle_degrees)
    up = -middle_out(height)[:, None]
    distance = middle_out(width)[None, :] * np.cos(turn) + up * np.sin(turn)
    area = half_plane_coverage(distance - offset_mm / mm_per_pixel, angle_degrees)
    return Scene("edge", area[..., None], mm_per_pixel)
