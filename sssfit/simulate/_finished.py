"""What a profile says of how it was asked for, and whether a run has nothing left to do."""

import math
import operator
from collections.abc import Sequence
from typing import Any

from sssfit import __version__
from sssfit.errors import SimulationError
from sssfit.grid import make_grid
from sssfit.material import Material
from sssfit.profile import Profile
from sssfit.simulate._batches import MAX_PHOTONS
from sssfit.simulate._run import Ending

# A total of R is left with sqrt((1/R - 1) / N) by N photons: 1e-7 for .99 and the most photons.
LEAST_TARGET = 1e-7
DEFAULT_PHOTONS = 10_000_000


def ending_of(photons: int | None, target_error: float | None) -> Ending:
    """When to end; without a number of photons a target alone decides.

    Raises
    ------
    SimulationError
        A number or a target out of range.
    """
    if photons is None:
        photons = DEFAULT_PHOTONS if target_error is None else MAX_PHOTONS
    photons = whole("photons", photons)
    if not 2 <= photons <= MAX_PHOTONS:
        raise SimulationError(f"photons = {photons}; give a whole number from 2 to 1e12.")
    if target_error is not None and not LEAST_TARGET <= target_error < 1.0:
        raise SimulationError(
            f"target_error = {target_error}; give a share from {LEAST_TARGET:g}, which takes 1e12 "
            "photons or more, to 1."
        )
    return Ending(photons, target_error)


def whole(name: str, value: int) -> int:
    """Take any kind of whole number (numpy's too) for a plain int, or refuse it in one line."""
    try:
        return operator.index(value)
    except TypeError:
        raise SimulationError(f"{name} = {value!r}; give a whole number.") from None


def provenance(
    materials: Sequence[Material], dr_mm: float, ending: Ending, *, auto: bool
) -> dict[str, Any]:
    """Return the settings of a run as a profile's meta keeps them.

    All materials of the walk are named: roulette follows the largest albedo, so a profile's last
    bits depend on its company.
    """
    return {
        "dr_mm": dr_mm,
        "radius": "auto" if auto else "given",
        "photons": ending.photons,
        "target_error": ending.target_error,
        "walk_materials_sha256": [each.sha256 for each in materials],
    }


def is_complete(profile: Profile) -> bool:
    """Whether the run behind a profile of this method came to its end, and was not stopped."""
    settings, error = profile.meta["settings"], profile.meta["relative_error"]
    ending = Ending(settings["photons"], settings["target_error"])
    return ending.is_reached(profile.photons or 0, math.inf if error is None else error)


def is_finished(
    profile: Profile,
    index: int,
    materials: Sequence[Material],
    *,
    photons: int | None = None,
    seed: int = 1,
    dr_mm: float | None = None,
    radius_mm: float | str | None = None,
    target_error: float | None = None,
) -> bool:
    """Whether ``simulate_montecarlo_many`` with these arguments would give this profile again.

    ``index`` is the place of the profile's material among ``materials``.
    """
    meta, material = profile.meta, materials[index]
    auto = radius_mm == "auto"
    grid = make_grid(
        material, dr_mm=dr_mm, radius_mm=None if isinstance(radius_mm, str) else radius_mm
    )
    expected = provenance(materials, grid.dr_mm, ending_of(photons, target_error), auto=auto)
    return (
        meta.get("method") == "montecarlo"
        and meta.get("settings") == expected
        and meta.get("material_sha256") == material.sha256
        and profile.material_name == material.name
        and {"relative_error", "energy_balance_stderr"} <= meta.keys()
        and (meta.get("seed"), meta.get("version")) == (seed, __version__)
        and (auto or profile.n_annuli == grid.annuli)
        and is_complete(profile)
    )
