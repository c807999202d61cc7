"""Normalised diffusion as engines take it: an albedo and a distance d by channel.

Christensen and Burley 2015: R_d(r) = A (exp(-r/d) + exp(-r/3d)) / (8 pi d r), with d = 1/s. The
energy within r is A (1 - exp(-r/d)/4 - 3 exp(-r/3d)/4); engines sample radii by its inverse
(`sssfit.shapes.diffusion_radius`). What differs between engines is how d is written down.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray
from sssfit.export.presets.source import Source
from sssfit.grid import grid_of_lengths
from sssfit.messages import by_channel
from sssfit.profile import Profile
from sssfit.shapes import diffusion_beyond
from sssfit.simulate.closed_form import closed_form_profile

# Without an interface the memo's shape for perpendicular light misses F(r) by 2 % of A or less up
# to here, by 4 % at A = 0.8 and 10 % at 0.95; the best shape there is by 1, 2 and 6 %.
MOST_ALBEDO = 0.7
CHANNELS = ("R", "G", "B")
_RINGS_PER_DISTANCE = 20
_BEYOND = 1e-5  # share of the widest channel's light that may lie outside the grid


def burley_profile(
    title: str,
    preset: str,
    albedo: npt.ArrayLike,
    distance_mm: npt.ArrayLike,
    blurred: npt.ArrayLike = 1.0,
) -> Profile:
    """Return the profile of an albedo (3,) and a distance d (3,) [mm], by name and preset.

    The closed form to rounding; it has no material, and its ``meta["method"]`` is "burley". Of the
    light the share ``blurred`` is; the rest lies in the first annulus.
    """
    total = np.asarray(albedo, dtype=np.float64)
    shapes = 1.0 / np.asarray(distance_mm, dtype=np.float64)
    radius_mm = 3.0 * math.log(0.75 / _BEYOND) / float(shapes.min())
    grid = grid_of_lengths(1.0 / float(shapes.max()) / _RINGS_PER_DISTANCE, radius_mm)
    beyond = total * np.asarray(blurred) * diffusion_beyond(grid.r_edges_mm[:, None], shapes)
    beyond[0] = total
    return closed_form_profile(
        title,
        "burley",
        grid,
        beyond,
        source=f"preset {preset}",
        settings={"preset": preset, "s_per_mm": shapes.tolist()},
    )


def widest_and_shares(source: Source) -> tuple[float, tuple[float, ...]]:
    """Return the distance d of the widest channel [mm], and each channel's share of it.

    Of the shapes that fit the profile best.
    """
    distance_mm = 1.0 / source.shapes_per_mm
    widest = float(distance_mm.max())
    return widest, tuple((distance_mm / widest).tolist())


def range_warnings(albedo: Sequence[float] | FloatArray) -> tuple[str, ...]:
    """Return a warning if an albedo lies beyond the range of normalised diffusion."""
    values = np.asarray(albedo, dtype=np.float64)
    above = np.flatnonzero(values > MOST_ALBEDO)
    if not above.size:
        return ()
    said = by_channel([CHANNELS[c] for c in above], values[above].tolist(), ".3g")
    return (
        f"The albedo {said} lies above about {MOST_ALBEDO:g}, where normalised diffusion follows "
        "the light less well with every step: compare it with the exact profile.",
    )
