"""A walk's sums to a profile: energies, their standard errors, provenance."""

import math
import warnings
from dataclasses import replace

import numpy as np

from sssfit import __version__
from sssfit.errors import SssfitWarning
from sssfit.material import Material
from sssfit.profile import Profile
from sssfit.simulate._batches import FloatArray, Sums, Tally, Walk
from sssfit.simulate._finished import provenance
from sssfit.simulate._run import Ending

AUTO_BEYOND = 1e-3  # radius "auto": less than this share of any channel lies beyond the grid


def share_beyond(sums: Sums) -> FloatArray:
    """Share of each channel's energy, reflected and transmitted, beyond every annulus, (n, C)."""
    energy = sums.reflected[..., 0]
    if sums.transmitted is not None:
        energy = energy + sums.transmitted[..., 0]
    total = np.sum(energy, axis=0)
    beyond = np.cumsum(energy[::-1], axis=0)[::-1][1:]
    share: FloatArray = np.divide(beyond, total, out=np.zeros_like(beyond), where=total > 0.0)
    return share


def _trimmed(sums: Sums) -> Sums:
    """Move the outermost annuli beyond the grid for as long as less than the share lies there."""
    outside = np.max(share_beyond(sums), axis=1)
    if outside[-1] >= AUTO_BEYOND:
        return sums
    annuli = int(np.argmax(outside < AUTO_BEYOND)) + 1

    def cut(bins: FloatArray) -> FloatArray:
        return np.concatenate([bins[:annuli], np.sum(bins[annuli:], axis=0, keepdims=True)])

    transmitted = None if sums.transmitted is None else cut(sums.transmitted)
    return replace(sums, reflected=cut(sums.reflected), transmitted=transmitted)


def _mean_and_error(sums: FloatArray, photons: int) -> tuple[FloatArray, FloatArray]:
    """Mean over photons and its standard error from sums of w and w^2, (..., 2)."""
    mean, mean_square = sums[..., 0] / photons, sums[..., 1] / photons
    # Rounding may leave a variance of -1e-17 where all photons carry the same weight.
    return mean, np.sqrt(np.maximum(mean_square - mean**2, 0.0) / (photons - 1))


def profile_of(
    task: Walk, tally: Tally, index: int, ending: Ending, error: float, *, trim: bool
) -> Profile:
    """Turn one material's share of the tally into a profile; weights begin at 1 - specular."""
    material, grid = task.materials[index], task.grids[index]
    entering = 1.0 - material.specular_reflectance
    sums = task.sums(tally, index)
    if trim:
        sums = _trimmed(sums)
    energy, stderr = (entering * each for each in _mean_and_error(sums.reflected, sums.photons))
    _, balance_error = _mean_and_error(sums.roulette, sums.photons)
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
            "format": "sssfit.profile/1",
            "method": "montecarlo",
            "material": material.to_dict(),
            "material_sha256": material.sha256,
            "channels": list(material.channels),
            "photons": sums.photons,
            "seed": task.seed,
            "version": __version__,
            "settings": provenance(task.materials, grid.dr_mm, ending, auto=trim),
            "relative_error": error if math.isfinite(error) else None,
            "energy_balance_stderr": [entering * float(each) for each in balance_error],
        },
    )
    _warn_unfinished(material, profile)
    if sums.transmitted is None:
        return profile
    energy, stderr = (entering * each for each in _mean_and_error(sums.transmitted, sums.photons))
    return replace(
        profile,
        annulus_transmittance=energy[:-1],
        annulus_transmittance_stderr=stderr[:-1],
        beyond_grid_transmittance=energy[-1],
        beyond_grid_transmittance_stderr=stderr[-1],
    )


def _warn_unfinished(material: Material, profile: Profile) -> None:
    """Say so when walks stopped at the collision cap carry more than the run's own error."""
    if np.any(profile.unfinished > profile.diffuse_reflectance_stderr):
        warnings.warn(
            f"{material.name}: {100.0 * float(np.max(profile.unfinished)):.2g} % of the light was "
            "still inside after a million collisions; it is kept apart as `unfinished` and not "
            "part of the reflectance. Almost nothing absorbs here: if that is not meant, check "
            "sigma_a_per_mm.",
            SssfitWarning,
            stacklevel=4,
        )
