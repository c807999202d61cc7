"""The head's large forms: skull, jaw, neck and ears, front and back, lofted from outlines [mm].

x points right, y up, z toward the camera; the origin lies between nose and eyes on the plane
through the front of the face. Sizes are those of an adult: crown to chin 232 mm, cheekbone to
cheekbone 143 mm.
"""

import functools
from typing import TYPE_CHECKING

import numpy as np

from sssfit.arrays import FloatArray

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

Outline = tuple[tuple[float, float, float, float], ...]

# Nothing behind this is visible.
FLOOR_MM = -150.0

# Height y, half width, front z, z at the sides. Squares are interpolated, so the ends are round.
HEAD = (
    (132.0, 0.0, -100.0, -100.0),
    (126.0, 31.0, -74.0, -98.0),
    (115.0, 49.0, -51.0, -96.0),
    (100.0, 62.5, -30.0, -95.0),
    (85.0, 70.5, -16.5, -94.0),
    (70.0, 74.5, -8.5, -93.0),
    (55.0, 75.5, -3.5, -92.0),
    (40.0, 73.5, -1.5, -90.0),
    (22.0, 71.5, -2.5, -86.0),
    (5.0, 70.5, -3.0, -81.0),
    (-15.0, 68.0, -2.0, -75.0),
    (-35.0, 63.0, 0.0, -69.0),
    (-55.0, 57.0, 0.0, -61.0),
    (-70.0, 50.0, -2.0, -52.0),
    (-82.0, 41.0, -5.0, -45.0),
    (-90.0, 31.5, -9.0, -40.0),
    (-96.0, 19.5, -17.0, -37.0),
    (-100.0, 0.0, -34.0, -34.0),
)
NECK = (
    (-60.0, 52.0, -62.0, -105.0),
    (-95.0, 53.0, -54.0, -105.0),
    (-115.0, 54.5, -50.0, -106.0),
    (-132.0, 60.0, -48.0, -108.0),
    (-146.0, 78.0, -46.0, -110.0),
    (-158.0, 118.0, -44.0, -112.0),
    (-172.0, 165.0, -42.0, -114.0),
    (-190.0, 200.0, -40.0, -116.0),
    (-240.0, 225.0, -40.0, -118.0),
    (-400.0, 230.0, -40.0, -118.0),
)
# The same for the back: height y, half width, back z, z at the sides. The jaw ends in the neck.
HEAD_BACK = (
    (132.0, 0.0, -100.0, -100.0),
    (126.0, 31.0, -123.0, -98.0),
    (115.0, 49.0, -148.0, -96.0),
    (100.0, 62.5, -168.0, -95.0),
    (85.0, 70.5, -180.0, -94.0),
    (70.0, 74.5, -187.0, -93.0),
    (55.0, 75.5, -190.0, -92.0),
    (40.0, 73.5, -191.0, -90.0),
    (22.0, 71.5, -189.0, -86.0),
    (5.0, 70.5, -184.0, -81.0),
    (-15.0, 68.0, -174.0, -75.0),
    (-35.0, 63.0, -158.0, -69.0),
    (-55.0, 57.0, -140.0, -61.0),
    (-70.0, 50.0, -112.0, -52.0),
    (-82.0, 41.0, -90.0, -45.0),
    (-90.0, 31.5, -74.0, -40.0),
    (-96.0, 19.5, -57.0, -37.0),
    (-100.0, 0.0, -34.0, -34.0),
)
NECK_BACK = (
    (-60.0, 52.0, -154.0, -105.0),
    (-95.0, 53.0, -152.0, -105.0),
    (-115.0, 54.5, -152.0, -106.0),
    (-132.0, 60.0, -153.0, -108.0),
    (-146.0, 78.0, -157.0, -110.0),
    (-158.0, 118.0, -166.0, -112.0),
    (-172.0, 165.0, -176.0, -114.0),
    (-190.0, 200.0, -184.0, -116.0),
    (-240.0, 225.0, -190.0, -118.0),
    (-400.0, 230.0, -190.0, -118.0),
)
# Thickness of an ear (skin, cartilage, skin), and how much thicker its lobe is.
EAR_MM, LOBE_MM = 3.0, 1.5


def smooth_max(a: FloatArray, b: FloatArray, blend_mm: float) -> FloatArray:
    """Return the larger of two heights, rounded where they differ by less than ``blend_mm``."""
    near = np.maximum(blend_mm - np.abs(a - b), 0.0)
    return np.maximum(a, b) + near * near / (4.0 * blend_mm)


def smooth_step(t: FloatArray) -> FloatArray:
    """Smooth step: 0 below 0, 1 above 1, 3 t^2 - 2 t^3 in between."""
    t = np.clip(t, 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


@functools.cache
def _curves(outline: Outline, smooth_mm: float) -> "list[CubicSpline[np.float64]]":
    """Return squared half width, squared depth and z of the sides as smooth functions of y."""
    from scipy.interpolate import CubicSpline, PchipInterpolator
    from scipy.ndimage import gaussian_filter1d

    knots = np.array(sorted(outline))
    y = np.arange(knots[0, 0] - 20.0, knots[-1, 0] + 20.0, 0.5)
    columns = (knots[:, 1] ** 2, (knots[:, 2] - knots[:, 3]) ** 2, knots[:, 3])
    curves = []
    for column in columns:
        known = PchipInterpolator(knots[:, 0], column)
        low = column[0] + known.derivative()(knots[0, 0]) * (y - knots[0, 0])
        high = column[-1] + known.derivative()(knots[-1, 0]) * (y - knots[-1, 0])
        values = np.where(y < knots[0, 0], low, np.where(y > knots[-1, 0], high, known(y)))
        curves.append(CubicSpline(y, gaussian_filter1d(values, smooth_mm / 0.5)))
    return curves


def loft(
    outline: Outline, x: FloatArray, y: FloatArray, power: float, smooth_mm: float
) -> FloatArray:
    """Return heights of slices |x / w|^p + |(z - side) / depth|^p = 1; a cliff outside them."""
    known = np.clip(y, min(knot[0] for knot in outline) - 15.0, outline[0][0] + 15.0)
    squares, depths, sides = (curve(known) for curve in _curves(outline, smooth_mm))
    # Past the round ends the squares are negative, and the cliff continues from there.
    width = np.sign(squares) * np.sqrt(np.abs(squares))
    depth = np.sqrt(np.maximum(depths, 0.0))
    across = np.abs(x) / np.maximum(width, 1e-3)
    inside = np.maximum(1.0 - across**power, 0.0) ** (1.0 / power)
    front: FloatArray = sides + depth * inside
    cliff: FloatArray = 40.0 * np.maximum(np.abs(x) - width, 0.0)
    return front - cliff


def gaussian(d: FloatArray, sigma: float) -> FloatArray:
    """Return exp(-d^2 / 2 sigma^2)."""
    return np.exp(-0.5 * (d / sigma) ** 2)


def ellipsoid(
    x: FloatArray, y: FloatArray, centre: tuple[float, float, float], radii: tuple[float, ...]
) -> FloatArray:
    """Front of an ellipsoid; a cone of slope 8 falls off outside it, so that unions stay smooth."""
    r2 = ((x - centre[0]) / radii[0]) ** 2 + ((y - centre[1]) / radii[1]) ** 2
    dome = np.sqrt(np.maximum(1.0 - r2, 0.0))
    return centre[2] + radii[2] * dome - 8.0 * radii[2] * np.maximum(np.sqrt(r2) - 1.0, 0.0)


def ear(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return front and back of a slab with a rim, a bowl and a lobe, apart from the head's side."""
    # Tilted back at the top, like ears.
    v = y - 3.0
    u = x - 75.5 - 0.16 * v
    r = np.hypot(u / 12.0, v / 31.0)
    body = -82.0 + 0.25 * u
    rim = 4.5 * np.exp(-(((r - 0.86) / 0.13) ** 2)) * smooth_step((v + 22.0) / 14.0)
    bowl = -5.0 * np.exp(-(((u + 2.5) / 5.0) ** 2) - ((v + 5.0) / 10.0) ** 2)
    fold = 3.0 * np.exp(-(((u + 0.5 - 0.1 * v) / 2.2) ** 2)) * smooth_step((v + 2.0) / 10.0)
    lobe = 2.0 * np.exp(-(((u + 3.0) / 6.0) ** 2) - ((v + 24.0) / 7.0) ** 2)
    edge = 9.0 * np.maximum(r - 0.93, 0.0) * 12.0
    middle = body + rim + bowl + fold * (r < 1.2) + lobe
    # Both sides fall to the edge, where they meet.
    back = middle - EAR_MM - 0.5 * LOBE_MM * lobe + edge * edge * 0.02 + edge
    return middle - edge * edge * 0.02 - edge, back


def shape(x: FloatArray, y: FloatArray) -> FloatArray:
    """Return head, neck and ears without a face."""
    z = loft(HEAD, x, y, 2.25, 3.0)
    z = smooth_max(z, ear(np.abs(x), y)[0], 3.0)
    neck = loft(NECK, x, y, 2.0, 4.0)
    # The muscles from behind the ears to the pit of the neck.
    ridge = np.abs(x) - (14.0 + 0.42 * np.clip(y + 165.0, 0.0, 90.0))
    neck = neck + 4.0 * gaussian(ridge, 8.0) * smooth_step((y + 178.0) / 20.0)
    neck = neck - 4.0 * gaussian(x, 7.0) * gaussian(y + 160.0, 9.0)
    # It ends inside the head.
    return smooth_max(z, neck - 6.0 * np.maximum(y + 62.0, 0.0), 7.0)


def back(x: FloatArray, y: FloatArray) -> FloatArray:
    """Return the back of head, neck and ears; above the front outside them."""
    z = loft(_seen_from_behind(HEAD_BACK), x, y, 2.25, 3.0)
    z = smooth_max(z, -ear(np.abs(x), y)[1], 3.0)
    neck = loft(_seen_from_behind(NECK_BACK), x, y, 2.0, 4.0)
    return -smooth_max(z, neck - 6.0 * np.maximum(y + 62.0, 0.0), 7.0)


def _seen_from_behind(outline: Outline) -> Outline:
    """Return an outline seen from behind."""
    return tuple((y, width, -end, -side) for y, width, end, side in outline)
