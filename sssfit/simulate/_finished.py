"""What a profile records about its run, and whether a run is already finished."""

import math
import operator
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from sssfit import __version__
from sssfit.arrays import FloatArray, is_number, plain
from sssfit.errors import SimulationError, SssfitWarning
from sssfit.grid import make_grid
from sssfit.material import Material
from sssfit.messages import shown
from sssfit.methods import SIMULATIONS
from sssfit.profile import Profile
from sssfit.profile.beam import Beam, wider_edges
from sssfit.simulate._directions import Directions, by_angle, mean_and_error
from sssfit.simulate._run import EndCondition
from sssfit.simulate._walks import MAX_PHOTONS, Sums, Tally, Walk

AUTO_BEYOND = 1e-3  # radius "auto": less than this share of any channel lies beyond the grid


def share_beyond(sums: Sums) -> FloatArray:
    """Return the share of each channel's energy beyond every annulus, both sides, (n, C)."""
    energy = sums.reflected[..., 0]
    if sums.transmitted is not None:
        energy = energy + sums.transmitted[..., 0]
    total = np.sum(energy, axis=0)
    beyond = np.cumsum(energy[::-1], axis=0)[::-1][1:]
    share: FloatArray = np.divide(beyond, total, out=np.zeros_like(beyond), where=total > 0.0)
    return share


def _trimmed(sums: Sums) -> Sums:
    """Move the outermost annuli beyond the grid while less than the share lies there."""
    outside = np.max(share_beyond(sums), axis=1)
    if outside[-1] >= AUTO_BEYOND:
        return sums
    annuli = int(np.argmax(outside < AUTO_BEYOND)) + 1

    def cut(bins: FloatArray) -> FloatArray:
        return np.concatenate([bins[:annuli], np.sum(bins[annuli:], axis=0, keepdims=True)])

    names = ("reflected", "transmitted", "above_by_angle", "below_by_angle")
    bins = {name: getattr(sums, name) for name in names}
    kept: dict[str, Any] = {name: cut(each) for name, each in bins.items() if each is not None}
    return replace(sums, **kept)


def profile_of(
    task: Walk, tally: Tally, index: int, ending: EndCondition, error: float, *, trim: bool
) -> Profile:
    """Turn one material's part of the tally into a profile; weights start at 1 - specular."""
    material, grid = task.materials[index], task.grids[index]
    entering = 1.0 - material.specular_reflectance
    sums = task.sums(tally, index)
    if trim:
        sums = _trimmed(sums)
    angles: dict[str, Any] = by_angle(sums, entering, task.directions)
    energy, stderr = (entering * each for each in mean_and_error(sums.reflected, sums.photons))
    if "angle_reflected" in angles:
        energy = angles["angle_reflected"].sum(axis=1)  # equal to the last bit
    _, balance_error = mean_and_error(sums.roulette, sums.photons)
    profile = Profile(
        r_edges_mm=grid.r_edges_mm[: len(energy)],
        annulus_energy=energy[:-1],
        annulus_energy_stderr=stderr[:-1],
        beyond_grid=energy[-1],
        beyond_grid_stderr=stderr[-1],
        specular_reflectance=material.specular_reflectance,
        absorbed=entering * sums.absorbed / sums.photons,
        unfinished=entering * sums.unfinished[:, 0] / sums.photons,
        annulus_transmittance=None,
        meta={
            "format": task.directions.profile_format,
            "method": "montecarlo",
            "material": material.to_dict(),
            "material_sha256": material.sha256,
            "channels": list(material.channels),
            "photons": sums.photons,
            "seed": task.seed,
            "version": __version__,
            "settings": provenance(task.materials, grid.dr_mm, ending, task.directions, auto=trim),
            "relative_error": error if math.isfinite(error) else None,
            "energy_balance_stderr": [entering * float(each) for each in balance_error],
        },
        **{} if sums.transmitted is not None else angles,
        outside_aperture=None if sums.unseen is None else entering * sums.unseen / sums.photons,
    )
    _warn_unfinished(material, profile)
    if sums.transmitted is None:
        return profile
    energy, stderr = (entering * each for each in mean_and_error(sums.transmitted, sums.photons))
    if "angle_transmitted" in angles:
        energy = angles["angle_transmitted"].sum(axis=1)
    return replace(
        profile,
        **angles,
        annulus_transmittance=energy[:-1],
        annulus_transmittance_stderr=stderr[:-1],
        beyond_grid_transmittance=energy[-1],
        beyond_grid_transmittance_stderr=stderr[-1],
    )


def _warn_unfinished(material: Material, profile: Profile) -> None:
    """Warn if walks stopped at the collision cap hold more energy than the run's own error."""
    if np.any(profile.unfinished > profile.diffuse_reflectance_stderr):
        warnings.warn(
            f"{material.name}: {100.0 * float(np.max(profile.unfinished)):.2g} % of the light was "
            "still inside after a million collisions; it is kept apart as `unfinished` and not "
            "part of the reflectance. Almost nothing absorbs here: if that is not meant, check "
            "sigma_a_per_mm.",
            SssfitWarning,
            stacklevel=4,
        )


# N photons give a total R a relative error of sqrt((1/R - 1) / N): 1e-7 for .99 and the most
# photons.
MIN_TARGET = 1e-7
DEFAULT_PHOTONS = 10_000_000


def end_condition(photons: int | None, target_error: float | None) -> EndCondition:
    """Return the end condition of a run; without a number of photons, the target alone decides.

    Raises
    ------
    SimulationError
        The number or the target is out of range.
    """
    if photons is None:
        photons = DEFAULT_PHOTONS if target_error is None else MAX_PHOTONS
    photons = whole_number("photons", photons)
    if not 2 <= photons <= MAX_PHOTONS:
        raise SimulationError(f"photons = {photons}; give a whole number from 2 to 1e12.")
    is_valid = is_number(target_error) and MIN_TARGET <= target_error < 1.0
    if target_error is not None and not is_valid:
        raise SimulationError(
            f"target_error = {shown(target_error)}; give a share from {MIN_TARGET:g}, which takes "
            "1e12 photons or more, to 1."
        )
    return EndCondition(photons, target_error)


def whole_number(name: str, value: int) -> int:
    """Convert any whole number (numpy's too) to int, or raise an error."""
    try:
        return operator.index(value)
    except TypeError:
        raise SimulationError(f"{name} = {shown(value)}; give a whole number.") from None


def provenance(
    materials: Sequence[Material],
    dr_mm: float,
    ending: EndCondition,
    directions: Directions,
    *,
    auto: bool,
) -> dict[str, Any]:
    """Return the settings of a run as stored in a profile's meta.

    All materials of the walk are named: roulette follows the largest albedo, so the last bits of a
    profile depend on the others.
    """
    return {
        "dr_mm": dr_mm,
        "radius": "auto" if auto else "given",
        "photons": ending.photons,
        "target_error": ending.target_error,
        "walk_materials_sha256": [each.sha256 for each in materials],
        **directions.given(),
    }


def is_complete(profile: Profile) -> bool:
    """Whether the run of a profile of this method reached its end and was not stopped."""
    settings, error = profile.meta["settings"], profile.meta["relative_error"]
    ending = EndCondition(settings["photons"], settings["target_error"])
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
    angles: int | None = None,
    numerical_aperture: float | None = None,
    beam: Beam | None = None,
) -> bool:
    """Whether ``simulate_montecarlo_many`` with these arguments, and a beam, makes this profile.

    ``index`` is the index of the profile's material in ``materials``.
    """
    meta, material = profile.meta, materials[index]
    auto = radius_mm == "auto"
    grid = make_grid(
        material, dr_mm=dr_mm, radius_mm=None if isinstance(radius_mm, str) else radius_mm
    )
    edges = grid.r_edges_mm if beam is None else wider_edges(grid.r_edges_mm, beam.reach_mm)
    ending, directions = (
        end_condition(photons, target_error),
        Directions(angles, numerical_aperture),
    )
    expected = provenance(materials, grid.dr_mm, ending, directions, auto=auto)
    return (
        meta.get("method") == "montecarlo"
        and meta.get("settings") == expected
        and meta.get("material_sha256") == material.sha256
        and profile.material_name == material.name
        and {"relative_error", "energy_balance_stderr"} <= meta.keys()
        and (meta.get("seed"), meta.get("version")) == (seed, __version__)
        and (auto or profile.n_annuli == len(edges) - 1)
        and meta.get("beam") == (None if beam is None else str(beam))
        and is_complete(profile)
    )


_CHOSEN = {"solver", "directions"}  # by the exact solver, with its settings
_ASKED = {"photons", "target_error"}  # which are told beside what they came to


def _own_settings(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return those of a profile's settings that methods have in ``sssfit.methods.SIMULATIONS``."""
    entries = [each for method in SIMULATIONS.values() for each in method.settings]
    own = {name for each in entries for name in (each.name, each.keyword)} | _CHOSEN
    return {key: value for key, value in settings.items() if key in own - _ASKED}


def run_figures(profile: Profile, seconds: float | None) -> dict[str, Any]:
    """Return the figures of one run that ``sssfit simulate --json`` prints, as lists and numbers.

    Figures that a method does not have are None, such as photons if nothing is sampled.

    Parameters
    ----------
    profile : Profile
        From any method of this room.
    seconds : float, optional [s]
        Duration of the run; None if it was already finished.
    """
    meta, settings = profile.meta, profile.meta["settings"]
    is_known, unseen = len(profile.absorbed) > 0, profile.outside_aperture
    return plain(
        {
            "material": meta["material"]["name"],
            "method": meta["method"],
            "channels": profile.channels,
            "diffuse_reflectance": profile.diffuse_reflectance,
            "diffuse_reflectance_stderr": profile.diffuse_reflectance_stderr,
            "specular_reflectance": profile.specular_reflectance,
            "transmittance": profile.transmittance,
            "transmittance_stderr": profile.transmittance_stderr,
            "absorbed": profile.absorbed.sum(axis=0) if is_known else None,
            "absorbed_by_layer": profile.absorbed if is_known else None,
            "beyond_grid": profile.beyond_grid,
            "unfinished": profile.unfinished,
            "energy_balance": profile.energy_balance,
            "energy_balance_stderr": meta["energy_balance_stderr"],
            "dr_mm": float(profile.r_edges_mm[1]),
            "annuli": profile.n_annuli,
            "photons": profile.photons,
            "seed": meta["seed"],
            "seconds": seconds,
            "photons_per_second": (
                profile.photons / seconds if profile.photons and seconds else None
            ),
            "target_error": settings.get("target_error"),
            "relative_error": meta["relative_error"],
            "finished_before": seconds is None,
            **({"beam": meta["beam"]} if "beam" in meta else {}),
            **_own_settings(settings),
            **({} if unseen is None else {"outside_aperture": unseen}),
        }
    )
