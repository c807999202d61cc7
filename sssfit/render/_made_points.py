"""Single lit pixels, and small highlights a thousand times as bright as what is around them."""

import numpy as np

from sssfit.errors import RenderError
from sssfit.render._made_checks import check_above, check_finite, check_seed, check_size
from sssfit.render._made_edges import disk_coverage
from sssfit.render.scene import Scene

# A highlight and what is around it: 1000 to 1.
BASE, HIGHLIGHT = 0.5, 500.0


def points(
    *, height: int, width: int, mm_per_pixel: float, spacing_mm: float | None = None
) -> Scene:
    """Pixels of 1 on black, one in the middle and others ``spacing_mm`` apart to all sides.

    The spacing is 32 pixels by default and is rounded to whole pixels, so that no point is spread.
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

    The radius is 1.5 pixels by default; disks that overlap are no brighter for it.
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
