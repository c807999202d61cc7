"""Known structures of cascades, and which of them a budget buys for a kernel so many pixels wide.

A structure that serves one kernel serves others of about the same width in pixels. The table holds
what each leaves of two: of skin1 and of chicken1, whose red reaches four times as far. Between them
the logarithm of the error is taken to change evenly with that of the width.
"""

import math
from collections.abc import Mapping

import numpy as np

from sssfit.kernel.structure import cost_of_chain, parse
from sssfit.profile import Profile

# Radii of 90 % of the widest channel's energy on pixels of .3 mm: skin1, chicken1.
WIDTHS_PIXELS = (22.6, 80.5)
_SHARE = 0.9
_AS_GOOD = (
    1.15  # errors that one cannot tell apart: two versions of the search, in 121 of 138 cases
)
# The mean over eight pictures of the 99th percentile of Delta E that each leaves of the two; made
# by docs/make_cascades.py structures.
STRUCTURES: Mapping[str, tuple[float, float]] = {
    "1": (30.9, 36.8),
    "*": (29.8, 34.6),
    "1|1": (16, 23.7),
    "1|1|1": (8.23, 17.3),
    "1|2": (13.7, 22.4),
    "1|1|2": (4.53, 12.4),
    "1|1|1|1|1": (0.611, 4.61),
    "1|1|1|1|1|1": (0.409, 1.88),
    "1|1|1|1-1": (0.718, 5.04),
    "1|1|1|1-1|1-1": (0.337, 0.895),
    "1|1|1-1": (2.98, 11.3),
    "1|1|1|1-1|1-1|1-1": (0.336, 0.272),
    "1|1|1|2-2": (0.439, 2.17),
    "1|1|2|1-1|1-1": (0.332, 0.753),
    "1|1|1-2": (1.46, 7.3),
    "1|1|2|2-2": (0.373, 1.77),
    "1|1|2|2-2|2-2": (0.31, 0.283),
    "1|1|1-1|1-1|1-1": (0.333, 0.382),
    "1|1|1-1|2-2": (0.342, 1.07),
    "1|*|*": (4.83, 14),
    "1|*|*|*": (1.89, 8.78),
    "1|*|*|*|*": (0.511, 3.6),
    "1|1|2-2|2-2": (0.31, 0.696),
    "1|2|2|2-2|2-2": (0.308, 0.273),
    "1|2|2-2|2-2": (0.308, 0.543),
    "*|*": (12.1, 20.7),
    "1|1-2|1-1|2-2|2-2": (0.263, 0.235),
    "*|*|*": (4.77, 14.7),
    "*|*|2": (3.92, 12.7),
    "1|1-2|2-2|2-2": (0.258, 0.34),
    "*|*|*|*": (1.74, 8.73),
    "*|*|*|2": (1.06, 6.42),
    "1|1-2|2-2|2-2|2-2": (0.259, 0.229),
    "*|*|*|*|*": (0.446, 3.67),
    "*|*|*|*|*|*": (0.36, 1.11),
    "1|*-*|*-*|*": (0.43, 2.73),
    "*|*|*|*-*|*": (0.31, 1.71),
    "*|*|*|*-*|*-*": (0.288, 0.521),
    "1|*-*|*-*|*-*": (0.291, 0.905),
    "1|2-2|1-1|2-2": (0.261, 0.502),
    "1-2": (15.2, 26.7),
    "*|*-*|*-*|*-*": (0.237, 1.14),
    "*|*-*|*-*|*-*|*": (0.244, 0.365),
    "1-1|1|1-1|2-2": (0.169, 0.877),
    "1-1|1|1-1|2-2|2-2": (0.134, 0.113),
    "*-*": (18.5, 22.6),
    "1-1|1|2-2|2-2": (0.13, 0.438),
    "1-1|1|2-2|2-2|2-2": (0.127, 0.114),
    "1-1|2|1-1|2-2|2-2": (0.13, 0.118),
    "1-1-1": (11.3, 22.6),
    "1-1|2|2-2|2-2": (0.166, 0.362),
    "1-1|1-1|1-1|1-1|1-1": (0.109, 0.149),
    "1-1|1-1|1-1|2-2": (0.118, 0.507),
    "1-1|1-1|1-1|2-2|2-2": (0.107, 0.108),
    "1-1|1-1|2-2|2-2": (0.109, 0.281),
    "1-1|1-2|1-1|2-2|2-2": (0.1, 0.103),
    "1-1|1-2|2-2|2-2": (0.0983, 0.178),
    "1-1|2-2|1-1|2-2|2-2": (0.105, 0.0995),
    "1-1-2": (7.87, 17.6),
    "1-1-1|1-1|1-1|1-1": (0.0887, 0.558),
    "1-2-2": (4.3, 12),
    "1-1-1-2": (3.03, 8.52),
    "1-1-2-2": (1.93, 6.39),
    "1-2-1-2": (1.76, 6.73),
    "1-1-1-1-2": (1.42, 5.24),
    "1-1-1-1-1-1": (1.08, 3.93),
    "1-1-2-2-2": (0.667, 2.57),
    "1-1-1-2-2-2": (0.345, 1.45),
    "1-1-1-1-2-2-2": (0.261, 0.942),
}


def width_pixels(profile: Profile, mm_per_pixel: float) -> float:
    """Return the radius that holds 90 % of the widest channel's energy, in pixels."""
    cumulative = profile.cumulative
    inside = (cumulative >= _SHARE * cumulative[-1]).all(axis=1)
    return float(profile.r_edges_mm[int(np.argmax(inside))]) / mm_per_pixel


def between(known: tuple[float, float], width: float) -> float:
    """Return the error to expect of a kernel so many pixels wide, from those of the two known.

    Beyond them it is that of the nearer.
    """
    narrow, wide = np.log(WIDTHS_PIXELS)
    place = (math.log(max(width, 1e-9)) - narrow) / (wide - narrow)
    return float(np.exp(np.interp(place, (0.0, 1.0), np.log(known))))


def best_structure(
    width: float, fetches: float, passes: int | None, *, full_resolution: bool
) -> str | None:
    """Return the known structure that leaves the least within a budget; None if there is none.

    Of those that leave hardly more, the one of the fewest passes, and of these the best.

    Parameters
    ----------
    width : float
        Width of the kernel, in pixels; see `width_pixels`.
    fetches : float
        The most a pixel.
    passes : int, optional
        The most of the stages.
    full_resolution : bool
        Whether none may halve the picture.
    """
    errors, costs = {}, {}
    for text, known in STRUCTURES.items():
        shapes = parse(text)
        cost = cost_of_chain(shapes)
        is_within = cost.fetches <= fetches and (passes is None or cost.passes <= passes)
        if is_within and not (full_resolution and shapes[-1].level):
            errors[text] = between(known, width)
            costs[text] = cost.passes, errors[text]
    as_good = (text for text in errors if errors[text] <= _AS_GOOD * min(errors.values()))
    return min(as_good, key=costs.__getitem__, default=None)
