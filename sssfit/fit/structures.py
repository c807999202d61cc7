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
_AS_GOOD = 1.15  # errors that one cannot tell apart: the search leaves 5 to 10 % to chance
# The mean over eight pictures of the 99th percentile of Delta E that each leaves of the two; made
# by docs/make_cascades.py structures.
STRUCTURES: Mapping[str, tuple[float, float]] = {
    "1": (30.9, 36.4),
    "*": (30.6, 32.5),
    "1|1": (16, 23.7),
    "1|1|1": (8.23, 16.5),
    "1|2": (13.7, 22.2),
    "1|1|2": (4.53, 12.4),
    "1|1|1|1|1": (0.611, 4.61),
    "1|1|1|1|1|1": (0.409, 1.88),
    "1|1|1|1-1": (0.718, 5.04),
    "1|1|1|1-1|1-1": (0.339, 0.792),
    "1|1|1-1": (2.98, 11.3),
    "1|1|1|1-1|1-1|1-1": (0.358, 0.272),
    "1|1|1|2-2": (0.442, 2.17),
    "1|1|2|1-1|1-1": (0.326, 0.753),
    "1|1|1-2": (1.46, 7.3),
    "1|1|2|2-2": (0.373, 1.77),
    "1|1|2|2-2|2-2": (0.312, 0.282),
    "1|1|1-1|1-1|1-1": (0.335, 0.381),
    "1|1|1-1|2-2": (0.342, 1.07),
    "1|*|*": (4.83, 14.1),
    "1|*|*|*": (1.89, 8.19),
    "1|*|*|*|*": (0.51, 3.6),
    "1|1|2-2|2-2": (0.315, 0.678),
    "1|2|2|2-2|2-2": (0.314, 0.268),
    "1|2|2-2|2-2": (0.311, 0.543),
    "*|*": (13.2, 22.8),
    "1|1-2|1-1|2-2|2-2": (0.262, 0.235),
    "*|*|*": (4.77, 12.5),
    "*|*|2": (3.92, 11.6),
    "1|1-2|2-2|2-2": (0.264, 0.295),
    "*|*|*|*": (1.74, 7.11),
    "*|*|*|2": (1.06, 6.42),
    "1|1-2|2-2|2-2|2-2": (0.258, 0.232),
    "*|*|*|*|*": (0.446, 3.92),
    "*|*|*|*|*|*": (0.36, 1.28),
    "1|*-*|*-*|*": (0.498, 2.6),
    "*|*|*|*-*|*": (0.311, 1.74),
    "*|*|*|*-*|*-*": (0.29, 0.88),
    "1|*-*|*-*|*-*": (0.422, 1.29),
    "1|2-2|1-1|2-2": (0.262, 0.56),
    "1-2": (15.2, 26.5),
    "*|*-*|*-*|*-*": (0.28, 1.14),
    "*|*-*|*-*|*-*|*": (0.21, 0.491),
    "1-1|1|1-1|2-2": (0.169, 1.06),
    "1-1|1|1-1|2-2|2-2": (0.134, 0.137),
    "*-*": (15.3, 25.1),
    "1-1|1|2-2|2-2": (0.13, 0.429),
    "1-1|1|2-2|2-2|2-2": (0.126, 0.117),
    "1-1|2|1-1|2-2|2-2": (0.13, 0.118),
    "1-1-1": (11.3, 22.6),
    "1-1|2|2-2|2-2": (0.158, 0.369),
    "1-1|1-1|1-1|1-1|1-1": (0.122, 0.149),
    "1-1|1-1|1-1|2-2": (0.124, 0.512),
    "1-1|1-1|1-1|2-2|2-2": (0.106, 0.108),
    "1-1|1-1|2-2|2-2": (0.107, 0.408),
    "1-1|1-2|1-1|2-2|2-2": (0.101, 0.103),
    "1-1|1-2|2-2|2-2": (0.0981, 0.175),
    "1-1|2-2|1-1|2-2|2-2": (0.101, 0.103),
    "1-1-2": (7.87, 17.2),
    "1-1-1|1-1|1-1|1-1": (0.0887, 0.477),
    "1-2-2": (4.32, 11.9),
    "1-1-1-2": (3.03, 8.53),
    "1-1-2-2": (1.93, 6.43),
    "1-2-1-2": (1.8, 6.68),
    "1-1-1-1-2": (1.41, 5.23),
    "1-1-1-1-1-1": (1.08, 3.95),
    "1-1-2-2-2": (0.667, 2.63),
    "1-1-1-2-2-2": (0.401, 1.45),
    "1-1-1-1-2-2-2": (0.261, 0.974),
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
        Of the kernel, in pixels; see `width_pixels`.
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
