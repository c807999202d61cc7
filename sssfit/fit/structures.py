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
    "1": (30.9, 36.8),
    "*": (30.4, 32),
    "1|1": (16, 24),
    "1|1|1": (8.23, 17.3),
    "1|2": (13.7, 21.5),
    "1|1|2": (4.51, 14),
    "1|1|1|1|1": (0.611, 4.59),
    "1|1|1|1|1|1": (0.374, 1.88),
    "1|1|1|1-1": (0.718, 5.04),
    "1|1|1|1-1|1-1": (0.465, 0.896),
    "1|1|1-1": (2.98, 11.3),
    "1|1|1|1-1|1-1|1-1": (1.8, 0.271),
    "1|1|1|2-2": (0.665, 2.17),
    "1|1|2|1-1|1-1": (1.06, 0.753),
    "1|1|1-2": (1.46, 7.41),
    "1|1|2|2-2": (0.443, 1.77),
    "1|1|2|2-2|2-2": (0.653, 0.352),
    "1|1|1-1|1-1|1-1": (0.308, 0.381),
    "1|1|1-1|2-2": (0.887, 1.07),
    "1|*|*": (4.83, 17.4),
    "1|*|*|*": (2.06, 8.76),
    "1|*|*|*|*": (0.764, 4),
    "1|1|2-2|2-2": (0.618, 0.68),
    "1|2|2|2-2|2-2": (0.382, 0.295),
    "1|2|2-2|2-2": (0.313, 0.544),
    "*|*": (13.4, 19),
    "1|1-2|1-1|2-2|2-2": (0.282, 0.22),
    "*|*|*": (4.75, 13.9),
    "*|*|2": (3.96, 11.4),
    "1|1-2|2-2|2-2": (0.281, 0.433),
    "*|*|*|*": (1.67, 8.2),
    "*|*|*|2": (1.05, 6.31),
    "1|1-2|2-2|2-2|2-2": (0.277, 0.245),
    "*|*|*|*|*": (0.435, 3.98),
    "*|*|*|*|*|*": (1.88, 1.1),
    "1|*-*|*-*|*": (0.434, 2.81),
    "*|*|*|*-*|*": (0.306, 1.87),
    "*|*|*|*-*|*-*": (1.65, 0.888),
    "1|*-*|*-*|*-*": (0.325, 1.22),
    "1|2-2|1-1|2-2": (0.274, 0.609),
    "1-2": (15.8, 26.3),
    "*|*-*|*-*|*-*": (0.262, 1.22),
    "*|*-*|*-*|*-*|*": (0.444, 0.466),
    "1-1|1|1-1|2-2": (0.17, 0.839),
    "1-1|1|1-1|2-2|2-2": (0.138, 0.204),
    "*-*": (21.5, 27.2),
    "1-1|1|2-2|2-2": (0.222, 0.429),
    "1-1|1|2-2|2-2|2-2": (0.194, 0.118),
    "1-1|2|1-1|2-2|2-2": (0.157, 0.113),
    "1-1-1": (11.3, 22.9),
    "1-1|2|2-2|2-2": (0.126, 0.374),
    "1-1|1-1|1-1|1-1|1-1": (0.122, 0.151),
    "1-1|1-1|1-1|2-2": (0.119, 0.512),
    "1-1|1-1|1-1|2-2|2-2": (0.119, 0.113),
    "1-1|1-1|2-2|2-2": (0.118, 0.299),
    "1-1|1-2|1-1|2-2|2-2": (0.166, 0.104),
    "1-1|1-2|2-2|2-2": (0.113, 0.19),
    "1-1|2-2|1-1|2-2|2-2": (0.101, 0.104),
    "1-1-2": (7.87, 17.4),
    "1-1-1|1-1|1-1|1-1": (0.088, 0.475),
    "1-2-2": (4.32, 11.9),
    "1-1-1-2": (3.03, 8.87),
    "1-1-2-2": (1.93, 6.39),
    "1-2-1-2": (1.8, 6.68),
    "1-1-1-1-2": (1.41, 5.19),
    "1-1-1-1-1-1": (1.08, 3.93),
    "1-1-2-2-2": (0.796, 2.63),
    "1-1-1-2-2-2": (0.345, 1.45),
    "1-1-1-1-2-2-2": (0.288, 0.942),
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

    Of those that leave hardly more, the one of the fewest passes.

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
            costs[text] = cost.passes, cost.fetches, errors[text]
    as_good = (text for text in errors if errors[text] <= _AS_GOOD * min(errors.values()))
    return min(as_good, key=costs.__getitem__, default=None)
