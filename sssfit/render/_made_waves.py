"""Stripes, and a pattern that is a sum of a function of x and one of y."""

import numpy as np

from sssfit.render._made_checks import check_finite, check_period, check_size
from sssfit.render._made_edges import FloatArray, half_plane_coverage, middle_out
from sssfit.render.scene import Scene


def wave(phase: FloatArray, across: float, along: float) -> FloatArray:
    """(1 + cos(2 pi phase)) / 2, averaged over pixels ``across`` and ``along`` periods wide.

    Averaged over a box, a cosine is multiplied by the sinc of the box in periods, once an axis.
    """
    contrast = float(np.sinc(across) * np.sinc(along))
    return 0.5 + 0.5 * contrast * np.cos(2.0 * np.pi * phase)


def stripes(
    *,
    height: int,
    width: int,
    mm_per_pixel: float,
    period_mm: float = 10.0,
    angle_degrees: float = 0.0,
) -> Scene:
    """Cosine from 0 to 1 and back in ``period_mm``; bright in the middle of the picture.

    The angle is the direction in which it varies: 0 is to the right, 90 up.
    """
    check_size("stripes", height, width, mm_per_pixel)
    check_period("stripes", period_mm, mm_per_pixel)
    check_finite("stripes", "angle_degrees", angle_degrees)
    turn = np.radians(angle_degrees)
    across, along = np.array((np.cos(turn), np.sin(turn))) * mm_per_pixel / period_mm
    phase = across * middle_out(width)[None, :] - along * middle_out(height)[:, None]
    return Scene("stripes", wave(phase, across, along)[..., None], mm_per_pixel)


def separable(
    *, height: int, width: int, mm_per_pixel: float, period_mm: float | None = None
) -> Scene:
    """E1(x) + E2(y): half the light by an upright edge in the middle, half by level stripes.

    The stripes' period is half the height by default, at least two pixels.
    """
    check_size("separable", height, width, mm_per_pixel)
    if period_mm is None:
        period_mm = max(0.5 * height, 2.0) * mm_per_pixel
    check_period("separable", period_mm, mm_per_pixel)
    step = mm_per_pixel / period_mm
    across = half_plane_coverage(middle_out(width), 0.0)[None, :]
    down = wave(step * middle_out(height)[:, None], 0.0, step)
    return Scene("separable", 0.5 * (across + down)[..., None], mm_per_pixel)
