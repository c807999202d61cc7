"""Profiles of a closed form for the energy beyond a radius, with a name in place of a material."""

from collections.abc import Mapping, Sequence
from typing import Any

from sssfit.arrays import FloatArray
from sssfit.grid import RadialGrid
from sssfit.profile import Profile
from sssfit.simulate._deterministic import ProfileSource, computed_profile, energies_from_beyond


def closed_form_profile(
    name: str,
    method: str,
    grid: RadialGrid,
    beyond: FloatArray,
    *,
    channels: Sequence[str] = ("R", "G", "B"),
    source: str = "",
    settings: Mapping[str, Any] | None = None,
) -> Profile:
    """Return a profile from the energy beyond each edge.

    Parameters
    ----------
    name, source : str
        What stands for a material: a name suitable for files, and its origin.
    method : str
        Becomes ``meta["method"]``.
    grid : RadialGrid
    beyond : (n + 1, C) [1]
        Energy beyond each edge of the grid, falling; the first row is the total.
    channels : sequence of str
    settings : mapping, optional
        The form's own numbers, for provenance.

    Raises
    ------
    SimulationError
        The energies are not finite, or they rise.
    """
    named = ProfileSource(name, source, tuple(channels))
    return computed_profile(named, method, grid, energies_from_beyond(beyond), settings=settings)
