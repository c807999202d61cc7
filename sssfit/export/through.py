"""How much light comes through a thickness, as a small table of a shader.

The share is that of ``sssfit.render.transmittance.beyond``. It falls fast and with a kink at the
edge of each pixel of the kernel, so the thicknesses of the rows are chosen one by one, each where
straight lines between the rows so far are farthest off. Of skin1's cascade of 24 fetches 24 rows
leave .019 of the light, 32 .0073 and 40 .0054; 32 that are even in the square root of the thickness
leave .15.
"""

from typing import NamedTuple

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.kernel import Taps

ROWS = 32
_STEPS = 64  # thicknesses tried per pixel of the kernel


class Through(NamedTuple):
    """Shares of the light, linear between rows."""

    thickness_mm: FloatArray  # (ROWS,), from 0 to where nothing comes through
    share: FloatArray  # (ROWS, C)
    error: float  # the largest difference from `beyond`, of all thicknesses and channels


def through_table(taps: Taps) -> Through:
    """Return the share of light that comes through each thickness, for linear interpolation."""
    from sssfit.render.transmittance import beyond  # it needs numba

    pixels = ROWS
    while beyond(taps, pixels * taps.mm_per_pixel).any():
        pixels *= 2
    every_mm: FloatArray = np.linspace(0.0, pixels * taps.mm_per_pixel, pixels * _STEPS + 1)
    wanted = beyond(taps, every_mm)
    last = max(int(np.flatnonzero(wanted.any(axis=1))[-1:].sum()) + 1, ROWS)
    every_mm, wanted = every_mm[: last + 1], wanted[: last + 1]
    rows = [0, last]
    while len(rows) < ROWS:
        errors = _errors(every_mm, wanted, sorted(rows))
        errors[rows] = -1.0
        rows.append(int(errors.argmax()))
    rows.sort()
    return Through(
        every_mm[rows], wanted[rows], float(_errors(every_mm, wanted, rows).max(initial=0.0))
    )


def _errors(every_mm: FloatArray, wanted: FloatArray, rows: list[int]) -> FloatArray:
    """Return the largest error of all channels at each thickness (N,)."""
    channels = range(wanted.shape[1])
    lines = [np.interp(every_mm, every_mm[rows], wanted[rows, c]) for c in channels]
    errors: FloatArray = np.abs(np.column_stack(lines) - wanted).max(axis=1)
    return errors
