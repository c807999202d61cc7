"""Photon walks: the diffuse reflectance profile by Monte Carlo, with standard errors.

The walk itself is compiled (``sssfit._jit.semi_infinite``, after Wang, Jacques and Zheng 1995,
"MCML"); this file deals it out and turns what comes back into profiles. Photons are split into
batches of ``BATCH_PHOTONS``; every batch has its own random streams and its own tallies, and the
tallies are added in the order of the batches. So the same seed gives the same bits on any number
of threads, and a run that was stopped after k batches equals one of k ``BATCH_PHOTONS`` photons.

Standard errors come from squared weights: a photon leaves through one annulus at most, so with
weights w the energy of an annulus is sum(w)/N and its variance (sum(w^2)/N - energy^2)/(N - 1).
"""

import math
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sssfit import __version__
from sssfit.errors import SimulationError, SssfitWarning, StoppedError
from sssfit.grid import RadialGrid, make_grid
from sssfit.material import Material
from sssfit.profile import Profile
from sssfit.simulate._batches import Tally, Walk, available_cores, relative_errors, relative_eta
from sssfit.simulate._checkpoint import Checkpoint, settings_of
from sssfit.simulate._finished import ending_of, provenance
from sssfit.simulate._run import Ending, Progress, run

FloatArray = npt.NDArray[np.float64]

HONEST_PHOTONS = 1000  # below, a channel may rest on a handful of hits and its error on luck
AUTO_BEYOND = 1e-3  # radius "auto": less than this share of any channel lies beyond the grid
PILOT_PHOTONS = 200_000


def simulate_montecarlo(
    material: Material,
    *,
    photons: int | None = None,
    seed: int = 1,
    threads: int | None = None,
    dr_mm: float | None = None,
    radius_mm: float | str | None = None,
    target_error: float | None = None,
    checkpoint: Checkpoint | str | Path | None = None,
    progress: Callable[[Progress], None] | None = None,
    stop: Callable[[], bool] | None = None,
) -> Profile:
    """Trace photons through a homogeneous semi-infinite medium with g = 0, all channels at once.

    Parameters
    ----------
    material : Material
        One layer of infinite thickness, g = 0, index at least that of the outside.
    photons : int, optional
        Number of walks, 2 to 1e12; by default the paper's 1e7, with a target error 1e12.
    seed : int
        Same seed, same bits, whatever the number of threads.
    threads : int, optional
        Threads to use; all cores by default.
    dr_mm : float, optional
        Width of an annulus [mm]; by default the shortest mean free path / 20.
    radius_mm : float or "auto", optional
        Outer radius of the grid [mm]; by default 32 times the longest mean free path. "auto"
        grows it until less than 0.1 % of any channel's diffuse reflectance lies beyond.
    target_error : float, optional
        End when, for every channel, the largest standard error of F(r) over the annulus edges is
        under this share (0 to 1) of F at the last edge. Looked at after numbers of batches fixed
        beforehand, 1/64 to 1/32 apart: the end depends on the seed alone. Channels that do not
        scatter are left out.
    checkpoint : Checkpoint or Path, optional
        Where to save the sums now and then, so that a run killed at any moment can go on and end
        in the same bits; a path stands for ``Checkpoint(path)``, which goes on from what is there.
        The file stays until the caller has saved the profile and calls ``Checkpoint.remove``.
    progress : callable, optional
        Called with a ``Progress`` some ten times a second.
    stop : callable, optional
        Asked after every batch; once true the run ends with the photons done so far.

    Returns
    -------
    Profile
        With energies relative to the incident light and ``meta["photons"]`` the walks in it.

    Raises
    ------
    SimulationError
        A medium this walk does not cover, settings out of range or other than those of the
        checkpoint, or a target error with a channel that returns nothing within the grid.
    FileError
        The checkpoint to go on from cannot be read, or is damaged or foreign.
    StoppedError
        ``stop`` said so before a batch was done.

    Warns
    -----
    SssfitWarning
        The photons were done before the target error was met, or a checkpoint cannot be written
        (the run goes on).

    References
    ----------
    Wang, Jacques, Zheng 1995, "MCML", Computer Methods and Programs in Biomedicine 47;
    grid: Jimenez et al. 2015, "Separable Subsurface Scattering", supplementary section F.

    Examples
    --------
    >>> from sssfit.material import load_material
    >>> profile = simulate_montecarlo(load_material("skin1"), photons=100_000)
    >>> profile.diffuse_reflectance.round(2)
    array([0.43, 0.21, 0.11])
    """
    return simulate_montecarlo_many(
        [material],
        photons=photons,
        seed=seed,
        threads=threads,
        dr_mm=dr_mm,
        radius_mm=radius_mm,
        target_error=target_error,
        checkpoint=checkpoint,
        progress=progress,
        stop=stop,
    )[0]


def simulate_montecarlo_many(
    materials: Sequence[Material],
    *,
    photons: int | None = None,
    seed: int = 1,
    threads: int | None = None,
    dr_mm: float | None = None,
    radius_mm: float | str | None = None,
    target_error: float | None = None,
    checkpoint: Checkpoint | str | Path | None = None,
    progress: Callable[[Progress], None] | None = None,
    stop: Callable[[], bool] | None = None,
) -> list[Profile]:
    """Trace several materials of one relative refractive index with one and the same walk.

    Parameters and errors are those of ``simulate_montecarlo``; a profile may differ from that of
    a single run in its last bits, since roulette follows the largest albedo of all channels.

    Returns
    -------
    list of Profile
        In the order of ``materials``; their noise is correlated.
    """
    _check_media(materials)
    ending = ending_of(photons, target_error)
    _check_settings(ending.photons, seed, threads)
    threads = threads or available_cores()
    auto = radius_mm == "auto"
    if isinstance(radius_mm, str):
        if not auto:
            raise SimulationError(f'radius_mm = {radius_mm!r}; give a length in mm or "auto".')
        grids = _auto_grids(materials, dr_mm, seed, threads, stop)
    else:
        grids = [make_grid(each, dr_mm=dr_mm, radius_mm=radius_mm) for each in materials]
    task = Walk(tuple(materials), tuple(grids), seed, ending.photons)
    tally = run(
        task,
        threads,
        progress,
        stop,
        target_error=target_error,
        checkpoint=Checkpoint(Path(checkpoint))
        if isinstance(checkpoint, str | Path)
        else checkpoint,
        settings=settings_of(materials, grids, seed),
    )
    if tally.photons < 2:
        raise StoppedError("stopped before a single batch of photons was done.")
    error = float(relative_errors(task, tally).max())
    _warn_target(ending, tally.photons, error)
    return [_profile(task, tally, k, ending, error, trim=auto) for k in range(len(materials))]


def _check_media(materials: Sequence[Material]) -> None:
    """Refuse what this walk does not model, naming what would do."""
    if not materials:
        raise SimulationError("no material given; name at least one.")
    for material in materials:
        if not material.is_semi_infinite:
            raise SimulationError(
                f"{material.name} is layered or of finite thickness; this version's photon walk "
                "covers one semi-infinite layer: leave thickness_mm and [[layers]] out."
            )
        layer = material.layers[0]
        if np.any(layer.g != 0.0):
            raise SimulationError(
                f"{material.name}: g = {_short(layer.g)}; this version's photon walk is for g = 0: "
                "give the reduced sigma_s' = (1 - g) sigma_s as sigma_s_per_mm, with g = 0."
            )
        if relative_eta(material) < 1.0:
            raise SimulationError(
                f"{material.name}: eta = {layer.eta} is under eta_above = {material.eta_above}; "
                "this version's photon walk expects the medium to be the denser side."
            )
    if len({relative_eta(each) for each in materials}) != 1:
        raise SimulationError("one walk serves one refractive index; group the materials by eta.")


def _check_settings(photons: int, seed: int, threads: int | None) -> None:
    """Refuse settings out of range, one line each."""
    if not 0 <= seed < 2**64:
        raise SimulationError(f"seed = {seed}; give a whole number from 0 to 2^64 - 1.")
    if threads is not None and threads < 1:
        raise SimulationError(f"threads = {threads}; give at least 1.")
    if photons < HONEST_PHOTONS:
        warnings.warn(
            f"{photons} photons are too few for the standard errors to be trusted; "
            f"use {HONEST_PHOTONS} or more.",
            SssfitWarning,
            stacklevel=3,
        )


def _auto_grids(
    materials: Sequence[Material],
    dr_mm: float | None,
    seed: int,
    threads: int,
    stop: Callable[[], bool] | None,
) -> list[RadialGrid]:
    """Double each material's radius until a pilot walk loses half the allowed share or less.

    Half, so that the run itself, with other noise, stays under the share; what the doubling gave
    too much is trimmed off its result.
    """
    grids = [make_grid(each, dr_mm=dr_mm) for each in materials]
    while True:
        task = Walk(tuple(materials), tuple(grids), seed, PILOT_PHOTONS)
        tally = run(task, threads, stop=stop)
        if tally.photons < 2:
            raise StoppedError("stopped before a single batch of photons was done.")
        wide = [
            np.max(_share_beyond(_material_bins(task, tally, k))[-1]) < AUTO_BEYOND / 2
            for k in range(len(materials))
        ]
        if all(wide):
            return grids
        grids = [
            grid if done else make_grid(each, dr_mm=grid.dr_mm, radius_mm=2.0 * grid.radius_mm)
            for each, grid, done in zip(materials, grids, wide, strict=True)
        ]


def _share_beyond(bins: FloatArray) -> FloatArray:
    """Share of each channel's energy beyond every annulus, (annuli, C), from bins (n + 1, C, 2)."""
    energy = bins[..., 0]
    total = np.sum(energy, axis=0)
    beyond = np.cumsum(energy[::-1], axis=0)[::-1][1:]
    share: FloatArray = np.divide(beyond, total, out=np.zeros_like(beyond), where=total > 0.0)
    return share


def _material_channels(task: Walk, index: int) -> range:
    """Which channels of the walk are those of material ``index``."""
    first = sum(each.n_channels for each in task.materials[:index])
    return range(first, first + task.materials[index].n_channels)


def _material_bins(task: Walk, tally: Tally, index: int) -> FloatArray:
    """One material's bins, (n + 1, C, 2), the one beyond the grid last."""
    channels = _material_channels(task, index)
    return np.stack([tally.ledger.bins[task.cells(c)] for c in channels], axis=1)


def _trimmed(bins: FloatArray) -> FloatArray:
    """Move the outermost annuli beyond the grid for as long as less than the share lies there."""
    outside = np.max(_share_beyond(bins), axis=1)
    annuli = (
        int(np.argmax(outside < AUTO_BEYOND)) + 1 if outside[-1] < AUTO_BEYOND else len(outside)
    )
    return np.concatenate([bins[:annuli], np.sum(bins[annuli:], axis=0, keepdims=True)])


def _mean_and_error(sums: FloatArray, photons: int) -> tuple[FloatArray, FloatArray]:
    """Mean over photons and its standard error from sums of w and w^2, (..., 2)."""
    mean, mean_square = sums[..., 0] / photons, sums[..., 1] / photons
    # Rounding may leave a variance of -1e-17 where all photons carry the same weight.
    return mean, np.sqrt(np.maximum(mean_square - mean**2, 0.0) / (photons - 1))


def _profile(
    task: Walk, tally: Tally, index: int, ending: Ending, error: float, *, trim: bool
) -> Profile:
    """Turn one material's share of the tally into a profile; weights begin at 1 - specular."""
    material, grid = task.materials[index], task.grids[index]
    entering = 1.0 - material.specular_reflectance
    bins = _material_bins(task, tally, index)
    if trim:
        bins = _trimmed(bins)
    energy, stderr = (entering * each for each in _mean_and_error(bins, tally.photons))
    own = slice(_material_channels(task, index).start, _material_channels(task, index).stop)
    unfinished = entering * tally.ledger.unfinished[own, 0] / tally.photons
    _, balance_error = _mean_and_error(tally.ledger.roulette[own], tally.photons)
    profile = Profile(
        r_edges_mm=grid.r_edges_mm[: len(bins)],
        annulus_energy=energy[:-1],
        annulus_energy_stderr=stderr[:-1],
        beyond_grid=energy[-1],
        beyond_grid_stderr=stderr[-1],
        specular_reflectance=material.specular_reflectance,
        absorbed=entering * tally.ledger.absorbed[None, own] / tally.photons,
        unfinished=unfinished,
        annulus_transmittance=None,
        meta={
            "format": "sssfit.profile/1",
            "method": "montecarlo",
            "material": material.to_dict(),
            "material_sha256": material.sha256,
            "channels": list(material.channels),
            "photons": tally.photons,
            "seed": task.seed,
            "version": __version__,
            "settings": provenance(task.materials, grid.dr_mm, ending, auto=trim),
            "relative_error": error if math.isfinite(error) else None,
            "energy_balance_stderr": [entering * float(each) for each in balance_error],
        },
    )
    _warn_unfinished(material, profile)
    return profile


def _warn_target(ending: Ending, photons: int, error: float) -> None:
    """Say so when a run came to its last photon before its target error."""
    target = ending.target_error
    if target is not None and photons == ending.photons and error >= target:
        warnings.warn(
            f"{photons:,} photons were done before the target error of {100.0 * target:g} % was "
            f"met; {100.0 * error:.2g} % was reached: give more --photons, or leave them out.",
            SssfitWarning,
            stacklevel=4,
        )


def _warn_unfinished(material: Material, profile: Profile) -> None:
    """Say so when walks stopped at the collision cap carry more than the run's own error."""
    if np.any(profile.unfinished > profile.diffuse_reflectance_stderr):
        warnings.warn(
            f"{material.name}: {100.0 * float(np.max(profile.unfinished)):.2g} % of the light was "
            "still inside after a million collisions; it is kept apart as `unfinished` and not "
            "part of the reflectance (almost no absorption: give sigma_a_per_mm its true value).",
            SssfitWarning,
            stacklevel=4,
        )


def _short(values: FloatArray) -> str:
    """Show a channel's values in brief; one number where all are equal."""
    return f"{values[0]:g}" if np.ptp(values) == 0.0 else f"{values.tolist()}"
