"""Pictures made by a formula: edges and shapes, stripes, noise, points and small highlights.

Border pixels of a white shape on black hold exactly the covered share of their area.
"""

import numpy as np

from sssfit.arrays import FloatArray, is_number, is_whole
from sssfit.errors import RenderError
from sssfit.messages import shown
from sssfit.scene.record import Scene

# A render needs about 120 bytes per RGB pixel, and 8 GB is its limit. Checked before a head is
# made, which takes half a minute for 11000 x 11000.
_MAX = 1e12  # mm, degrees or pieces
_MIN_MM = 1e-12  # of a pixel, as in the fits: a made head of 1e-320 mm per pixel took minutes
MAX_PIXELS = 60_000_000


def check_seed(name: str, seed: int) -> None:
    """Check the seed of the random numbers."""
    if not is_whole(seed) or seed < 0:
        raise RenderError(f"{name}: seed = {shown(seed)}; expected a whole number from 0.")


def check_size(name: str, height: int, width: int, mm_per_pixel: float) -> None:
    """Check the number and the size of the pixels, and the memory they need."""
    for word, value in (("height", height), ("width", width)):
        if not is_whole(value) or value < 1:
            raise RenderError(
                f"{name}: {word} = {shown(value)}; expected a whole number, 1 or more."
            )
    if (many := min(height * width, 10**300)) > MAX_PIXELS:  # a float has no larger ones
        raise RenderError(
            f"{name}: {shown(width)} x {shown(height)} pixels would take {many * 120e-9:.3g} GB to "
            f"render; make it no larger than {MAX_PIXELS:.0e} pixels."
        )
    check_above(name, "mm_per_pixel", mm_per_pixel, 0.0)
    check_range(name, "mm_per_pixel", mm_per_pixel, _MIN_MM, _MAX)


def as_number(name: str, option: str, value: object) -> float:
    """Return a number as a float; refuse what is none."""
    if not is_number(value):
        raise RenderError(f"{name}: {option} = {shown(value)}; expected a number.")
    return float(value)


def check_above(name: str, option: str, value: float, least: float) -> None:
    """Check for a number above ``least`` that can be counted in pixels."""
    value = as_number(name, option, value)
    if not least < value <= _MAX:
        raise RenderError(
            f"{name}: {option} = {value:g}; expected a number above {least:g}, up to {_MAX:g}."
        )


def check_range(name: str, option: str, value: float, low: float, high: float) -> None:
    """Check for a number from ``low`` to ``high``."""
    value = as_number(name, option, value)
    if not low <= value <= high:
        raise RenderError(f"{name}: {option} = {value:g}; expected {low:g} to {high:g}.")


def check_finite(name: str, option: str, value: float) -> None:
    """Check for a finite number that can be counted in pixels."""
    value = as_number(name, option, value)
    if not abs(value) <= _MAX:
        raise RenderError(
            f"{name}: {option} = {value:g}; expected a finite number, up to {_MAX:g}."
        )


def check_period(name: str, period_mm: float, mm_per_pixel: float) -> None:
    """Check the period: pixels cannot show less than two of them (Nyquist)."""
    check_above(name, "period_mm", period_mm, 0.0)
    if period_mm < 2.0 * mm_per_pixel:
        raise RenderError(
            f"{name}: period_mm = {period_mm:g} is under two pixels of {mm_per_pixel:g} mm; "
            f"expected {2.0 * mm_per_pixel:g} or more, or smaller pixels."
        )


# A highlight and its surroundings: 1000 to 1.
BASE, HIGHLIGHT = 0.5, 500.0


def points(
    *, height: int, width: int, mm_per_pixel: float, spacing_mm: float | None = None
) -> Scene:
    """Pixels of 1 on black, one in the middle and others ``spacing_mm`` apart in all directions.

    The spacing is 32 pixels by default and is rounded to whole pixels, so no point is spread.
    """
    check_size("points", height, width, mm_per_pixel)
    if spacing_mm is None:
        spacing_mm = 32.0 * mm_per_pixel
    check_finite("points", "spacing_mm", spacing_mm)
    step = round(spacing_mm / mm_per_pixel)
    if step < 2:
        raise RenderError(
            f"points: spacing_mm = {spacing_mm:g} is under two pixels of {mm_per_pixel:g} mm; "
            f"expected {2.0 * mm_per_pixel:g} or more, or smaller pixels."
        )
    light = np.zeros((height, width, 1))
    light[(height // 2) % step :: step, (width // 2) % step :: step] = 1.0
    return Scene("points", light, mm_per_pixel)


def highlights(
    *,
    height: int,
    width: int,
    mm_per_pixel: float,
    radius_mm: float | None = None,
    count: int = 12,
    seed: int = 1,
) -> Scene:
    """Disks of 500 on 0.5, each around the centre of a pixel drawn by ``seed``.

    The radius is 1.5 pixels by default; overlapping disks are not brighter.
    """
    check_size("highlights", height, width, mm_per_pixel)
    if radius_mm is None:
        radius_mm = 1.5 * mm_per_pixel
    check_above("highlights", "radius_mm", radius_mm, 0.0)
    check_above("highlights", "count", count, 0.0)
    check_seed("highlights", seed)
    draws = np.random.default_rng(seed)
    covered = np.zeros((height, width))
    reach = int(np.ceil(radius_mm / mm_per_pixel)) + 1
    for _ in range(int(count)):
        row, column = int(draws.integers(height)), int(draws.integers(width))
        rows = np.arange(max(row - reach, 0), min(row + reach + 1, height), dtype=np.float64)
        columns = np.arange(
            max(column - reach, 0), min(column + reach + 1, width), dtype=np.float64
        )
        spot = disk_coverage(columns - column, rows - row, radius_mm / mm_per_pixel)
        part = np.ix_(rows.astype(int), columns.astype(int))
        covered[part] = np.maximum(covered[part], spot)
    light = BASE + (HIGHLIGHT - BASE) * covered
    return Scene("highlights", light[..., None], mm_per_pixel)


def noise(*, height: int, width: int, mm_per_pixel: float, seed: int = 1) -> Scene:
    """Random light from 0 to 1 with amplitudes that fall as 1/f; its mean is 1/2.

    White noise is filtered in the Fourier domain (Field 1987, "Relations between the statistics of
    natural images and the response properties of cortical cells": 1/f in amplitude), so it is
    periodic across the borders. Then it is scaled so that its farthest value from 1/2 is 0 or 1.
    """
    from scipy.fft import irfft2, rfft2

    check_size("noise", height, width, mm_per_pixel)
    check_seed("noise", seed)
    white = np.random.default_rng(seed).standard_normal((height, width))
    down = np.fft.fftfreq(height)[:, None]
    across = np.fft.rfftfreq(width)[None, :]
    frequency = np.hypot(down, across)
    frequency[0, 0] = np.inf  # the mean is set below
    pink = irfft2(rfft2(white) / frequency, s=(height, width))
    farthest = float(np.abs(pink).max()) or 1.0
    return Scene("noise", np.clip(0.5 + 0.5 * pink / farthest, 0.0, 1.0)[..., None], mm_per_pixel)


def wave(phase: FloatArray, across: float, along: float) -> FloatArray:
    """Return (1 + cos(2 pi phase)) / 2, averaged over pixels ``across`` and ``along`` periods wide.

    The average over a box multiplies a cosine by the sinc of the box in periods, for each axis.
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
    phase = across * centred(width)[None, :] - along * centred(height)[:, None]
    return Scene("stripes", wave(phase, across, along)[..., None], mm_per_pixel)


def separable(
    *, height: int, width: int, mm_per_pixel: float, period_mm: float | None = None
) -> Scene:
    """E1(x) + E2(y): half the light from a vertical edge in the middle, half from stripes.

    The stripes' period is half the height by default, at least two pixels.
    """
    check_size("separable", height, width, mm_per_pixel)
    if period_mm is None:
        period_mm = max(0.5 * height, 2.0) * mm_per_pixel
    check_period("separable", period_mm, mm_per_pixel)
    step = mm_per_pixel / period_mm
    across = half_plane_coverage(centred(width), 0.0)[None, :]
    down = wave(step * centred(height)[:, None], 0.0, step)
    return Scene("separable", 0.5 * (across + down)[..., None], mm_per_pixel)


# The same for every picture, so that a kernel's error does not depend on its size.
DISK_RADIUS_MM = 19.2


def centred(pixels: int) -> FloatArray:
    """Return coordinates of pixel centres from the middle of the picture, in pixels."""
    return np.arange(pixels, dtype=np.float64) - 0.5 * (pixels - 1)


def _quarter(x: FloatArray, y: FloatArray, radius: float) -> FloatArray:
    """Return the area that a disk around 0 shares with [0, x] x [0, y]; odd in x and in y.

    x y if the corner is inside; otherwise y xa + int_xa^x sqrt(R^2 - t^2) dt, R^2 = xa^2 + y^2.
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
    """Return the share of unit pixels centred at x (W,), y (H,) covered by a disk around 0.

    Pixels not cut by its edge are exactly 0 or 1; the others are differences of areas as large as
    the disk, with an error of about 1e-16 R^2.
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
    """Return the share of unit pixels on the lit side of a line, at ``distance`` d inside it.

    With c >= s, the larger and smaller of |cos| and |sin|, it is 1/2 + d/c if the line cuts two
    opposite sides, and (h^2/2) / (c s) if it cuts off a corner of depth h = (c + s)/2 - |d|.
    """
    turn = np.radians(angle_degrees)
    s, c = sorted((abs(np.cos(turn)), abs(np.sin(turn))))
    depth = np.maximum(0.5 * (c + s) - np.abs(distance), 0.0)
    # For s = 0 there are no corners and depth / s is not used, so any s works.
    corner = depth * (depth / (s or 1.0)) / (2.0 * c)
    corner = np.where(distance > 0.0, 1.0 - corner, corner)
    area: FloatArray = np.where(np.abs(distance) < 0.5 * (c - s), 0.5 + distance / c, corner)
    return area


def disk(*, height: int, width: int, mm_per_pixel: float, radius_mm: float | None = None) -> Scene:
    """White disk in the middle of black.

    Its radius is 19.2 mm by default, or a quarter of the smaller side if that does not fit.
    """
    check_size("disk", height, width, mm_per_pixel)
    if radius_mm is None:
        side_mm = min(height, width) * mm_per_pixel
        radius_mm = DISK_RADIUS_MM if side_mm >= 2.0 * DISK_RADIUS_MM else 0.25 * side_mm
    check_above("disk", "radius_mm", radius_mm, 0.0)
    area = disk_coverage(centred(width), centred(height), radius_mm / mm_per_pixel)
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

    So 0 lights the right half, 90 the upper half.
    """
    check_size("edge", height, width, mm_per_pixel)
    check_finite("edge", "angle_degrees", angle_degrees)
    check_finite("edge", "offset_mm", offset_mm)
    turn = np.radians(angle_degrees)
    up = -centred(height)[:, None]
    distance = centred(width)[None, :] * np.cos(turn) + up * np.sin(turn)
    area = half_plane_coverage(distance - offset_mm / mm_per_pixel, angle_degrees)
    return Scene("edge", area[..., None], mm_per_pixel)
