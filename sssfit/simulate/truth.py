"""The exact profile of a material, the truth that others are compared with."""

import math

import numpy as np

from sssfit.grid import MOST_ANNULI, RadialGrid
from sssfit.material import Material
from sssfit.profile import Profile
from sssfit.simulate.exact import simulate_exact

# Share of a channel's light that may lie beyond the truth's grid, where the place it falls on is
# not known: with .01 % of the energy wrong, Delta E is under .01.
_FAR_SHARE = 1e-4
_MOST_DOUBLINGS = 4  # at once


def true_profile(material: Material, *, threads: int | None = None) -> Profile:
    """Return the exact profile of any material on the paper's grid.

    Raises
    ------
    SimulationError
        The solver for layers does not come within a hundredth of a percent, as with thin slabs that
        scatter far ahead.
    """
    return simulate_exact(material, threads=threads)


def exact_with_all_light(
    material: Material, grid: RadialGrid, reach_mm: float, *, threads: int | None = None
) -> Profile:
    """Return the exact profile on a grid doubled until at most .01 % of the light lies beyond it.

    No further than ``reach_mm``, beyond which a picture ends.
    """
    exact = simulate_exact(material, radius_mm=radius_of(grid), threads=threads)
    most_mm = min(reach_mm, grid.dr_mm * (MOST_ANNULI - 1))
    while _far_share(exact) > _FAR_SHARE and exact.r_edges_mm[-1] < most_mm:
        wider_mm = min(2.0 ** _doublings(exact) * float(exact.r_edges_mm[-1]), most_mm)
        exact = simulate_exact(material, radius_mm=wider_mm, threads=threads)
    return exact


def _doublings(profile: Profile) -> int:
    """Return how often a grid is to be doubled at once, if the light fades as it did on its end.

    Stacks take seconds to solve, and some need a grid 8 times as wide.
    """
    r_mm, total = profile.r_edges_mm, profile.diffuse_reflectance
    middle = r_mm.size // 2
    needed = 1
    for beyond, all_light in zip((total - profile.cumulative).T, total, strict=True):
        if beyond[-1] > _FAR_SHARE * all_light:
            rate = math.log(beyond[middle] / beyond[-1]) / (r_mm[-1] - r_mm[middle])
            more_mm = math.log(beyond[-1] / (_FAR_SHARE * all_light)) / max(rate, 1e-9 / r_mm[-1])
            needed = max(needed, math.ceil(math.log2(1.0 + more_mm / r_mm[-1])))
    return min(needed, _MOST_DOUBLINGS)


def radius_of(grid: RadialGrid) -> float:
    """Return a radius that gives so many rings: half a one less, so that rounding adds none."""
    return grid.dr_mm * (grid.annuli - 0.5)


def _far_share(profile: Profile) -> float:
    """Largest share of a channel's light beyond the grid."""
    total = profile.diffuse_reflectance
    return float(np.max(np.divide(profile.beyond_grid, total, where=total > 0.0, out=0.0 * total)))
