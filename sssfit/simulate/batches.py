"""Batches of a walk as work that another process or machine can do, with the same bits.

A walk's batches depend on its materials, grids and seed only, so a process that has these traces
any range of them. Sums of floats depend on their order: whoever adds the batches up does so in the
order of their numbers.
"""

from collections.abc import Sequence

from sssfit._jit import source_key
from sssfit.grid import RadialGrid
from sssfit.material import Material
from sssfit.profile import Profile
from sssfit.simulate._finished import end_condition, profile_of
from sssfit.simulate._steps import steps_per_photon
from sssfit.simulate._walks import BATCH_PHOTONS, Tally, Walk, relative_errors
from sssfit.simulate.montecarlo import is_compiled, make_walk

__all__ = [
    "BATCH_PHOTONS",
    "Tally",
    "Walk",
    "code_version",
    "is_compiled",
    "make_walk",
    "profile_of_tally",
    "steps_per_photon",
    "trace_each",
    "trace_range",
    "walk_of",
]


def code_version() -> str:
    """Return what two machines must share to make the same bits: version and hash of the walks."""
    return source_key()


def walk_of(material: Material, grid: RadialGrid, seed: int, photons: int) -> Walk:
    """Return the walk of one material.

    Parameters
    ----------
    material : Material
    grid : RadialGrid
    seed : int
    photons : int
        Number of photons in all batches.
    """
    return make_walk([material], [grid], seed, photons)


def trace_range(walk: Walk, first: int, last: int) -> Tally:
    """Return the sum of the batches from ``first`` to before ``last``, added in order."""
    total = walk.empty_tally()
    for batch in range(first, last):
        total.add(walk.trace(batch))
    return total


def trace_each(walk: Walk, first: int, last: int) -> Sequence[Tally]:
    """Return the batches from ``first`` to before ``last`` one by one."""
    return [walk.trace(batch) for batch in range(first, last)]


def profile_of_tally(walk: Walk, tally: Tally) -> Profile:
    """Return the profile of a walk of one material whose batches are all in the tally."""
    error = float(relative_errors(walk, tally).max())
    return profile_of(walk, tally, 0, end_condition(walk.photons, None), error, trim=False)
