"""The face on the head: brows, eyes, nose, mouth, cheeks and chin, all symmetric in x [mm]."""

import numpy as np

from sssfit.render._head_shape import (
    FloatArray,
    ellipsoid,
    gaussian,
    shape,
    smooth_max,
    smooth_step,
)

EYE_X, EYE_Y, EYE_Z = 32.0, 20.0, -23.0
MOUTH_Y = -54.0

# The nose along its ridge: y, how far it stands out, half width.
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
    """Add a Gaussian on either side: no crease where the halves meet."""
    return gaussian(x - at, sigma) + gaussian(x + at, sigma)


def planes(x: FloatArray, y: FloatArray) -> FloatArray:
    """Broad forms: what is added to the head before nose, eyes and mouth."""
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
    """Socket, lids and the ball between them; also how far inside the lids' opening a point is."""
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
    # The cornea stands out of the ball.
    ball = smooth_max(
        ball, ellipsoid(x, y, (EYE_X, EYE_Y + 0.3, EYE_Z + 5.6), (7.4, 7.4, 7.6)), 0.6
    )
    z = z + (np.minimum(ball, z - 0.3) - z) * smooth_step((inside + 0.35) / 0.7)
    return z, inside


def face(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Heights [mm] of the smooth head, and where the eyes are (above 0)."""
    half = np.abs(x)
    z = shape(x, y)
    z = z + planes(half, y)
    z = fold(half, y, z)
    z = mouth(half, y, z)
    z = nose(half, y, z)
    return eye(half, y, z)
