"""Checks that the made pictures share: one line each, with what arrived and what to do."""

import math

from sssfit.errors import RenderError

# A render holds some 120 bytes a pixel of RGB, and 8 GB is its limit: said before a head is made,
# which takes half a minute for 11000 x 11000.
_MOST = 1e12  # mm, degrees or pieces
_LEAST_MM = 1e-12  # of a pixel, as in the fits: a made head of 1e-320 mm a pixel took minutes
MAX_PIXELS = 60_000_000


def is_whole(value: float) -> bool:
    """Whether a number is finite and has no fraction."""
    return math.isfinite(value) and value == int(value)


def check_seed(name: str, seed: float) -> None:
    """Refuse what the random numbers cannot start from."""
    if not is_whole(seed) or seed < 0:
        raise RenderError(f"{name}: seed = {seed}; expected a whole number from 0.")


def check_size(name: str, height: int, width: int, mm_per_pixel: float) -> None:
    """Refuse pictures without pixels, pixels without size and what no memory holds."""
    for word, value in (("height", height), ("width", width)):
        if not is_whole(value) or value < 1:
            raise RenderError(f"{name}: {word} = {value}; expected a whole number, 1 or more.")
    if height * width > MAX_PIXELS:
        raise RenderError(
            f"{name}: {width} x {height} pixels would take {height * width * 120e-9:.3g} GB to "
            f"render; make it no larger than {MAX_PIXELS:.0e} pixels."
        )
    check_above(name, "mm_per_pixel", mm_per_pixel, 0.0)
    check_range(name, "mm_per_pixel", mm_per_pixel, _LEAST_MM, _MOST)


def check_above(name: str, option: str, value: float, least: float) -> None:
    """Refuse all but a number above ``least``, within what pixels can be counted in."""
    if not least < value <= _MOST:
        raise RenderError(
            f"{name}: {option} = {value:g}; expected a number above {least:g}, up to {_MOST:g}."
        )


def check_range(name: str, option: str, value: float, low: float, high: float) -> None:
    """Refuse all but a number from ``low`` to ``high``."""
    if not low <= value <= high:
        raise RenderError(f"{name}: {option} = {value:g}; expected {low:g} to {high:g}.")


def check_finite(name: str, option: str, value: float) -> None:
    """Refuse NaN, infinity, and what no pixels can be counted in."""
    if not abs(value) <= _MOST:
        raise RenderError(
            f"{name}: {option} = {value:g}; expected a finite number, up to {_MOST:g}."
        )


def check_period(name: str, period_mm: float, mm_per_pixel: float) -> None:
    """No pixels can show a period of less than two of them (Nyquist)."""
    check_above(name, "period_mm", period_mm, 0.0)
    if period_mm < 2.0 * mm_per_pixel:
        raise RenderError(
            f"{name}: period_mm = {period_mm:g} is under two pixels of {mm_per_pixel:g} mm; "
            f"expected {2.0 * mm_per_pixel:g} or more, or smaller pixels."
        )
