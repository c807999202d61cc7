"""Photon walks: the diffuse reflectance profile by Monte Carlo, with standard errors.

The walks are compiled (``sssfit._jit.semi_infinite`` and ``layered``, after Wang, Jacques and Zheng
1995, "MCML"); this file picks one and turns its sums into profiles. Photons are split into batches
of ``BATCH_PHOTONS``; every batch has its own random streams and its own tallies, and the tallies
are added in the order of the batches. The same seed therefore gives the same bits on any number of
threads, and a run stopped after k batches equals one of k ``BATCH_PHOTONS`` photons.

Standard errors come from squared weights: a photon leaves through one annulus at most, so with
weights w the energy of an annulus is sum(w)/N and its variance (sum(w^2)/N - energy^2)/(N - 1).
"""

import contextlib
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from sssfit._jit import half_space_walk, layered_walk
from sssfit.errors import SimulationError, SssfitWarning, StoppedError
from sssfit.grid import RadialGrid, make_grid
from sssfit.material import Material
from sssfit.messages import shown
from sssfit.process import available_cores
from sssfit.profile import Profile
from sssfit.simulate._checkpoint import Checkpoint, settings_of
from sssfit.simulate._directions import EVERYWHERE, Directions
from sssfit.simulate._elsewhere import Elsewhere
from sssfit.simulate._finished import (
    AUTO_BEYOND,
    end_condition,
    profile_of,
    share_beyond,
    whole_number,
)
from sssfit.simulate._run import EndCondition, Progress, run
from sssfit.simulate._walks import (
    Sums,
    Walk,
    note_compiling,
    relative_errors,
    relative_eta,
)

# With fewer, a channel may have a handful of hits, and its error estimate is unreliable.
HONEST_PHOTONS = 1000
PILOT_PHOTONS = 200_000
PILOT_DOUBLINGS = 3  # of the radius, which one pilot walk sees
# Beyond these, single precision does not resolve the peak (see ``sample_hg``, which is made for a
# forward one).
MIN_G, MAX_G = -0.99, 0.9999


def simulate_montecarlo(
    material: Material,
    *,
    photons: int | None = None,
    seed: int = 1,
    threads: int | None = None,
    dr_mm: float | None = None,
    radius_mm: float | str | None = None,
    target_error: float | None = None,
    angles: int | None = None,
    numerical_aperture: float | None = None,
    checkpoint: Checkpoint | str | Path | None = None,
    progress: Callable[[Progress], None] | None = None,
    stop: Callable[[], bool] | None = None,
) -> Profile:
    """Trace photons through a material: a half space, a slab or a stack of layers.

    A homogeneous half space with g = 0 uses the fast walk, which gives all channels at once;
    everything else uses the layered walk, where channels share a walk if they differ in absorption
    only.

    Parameters
    ----------
    material : Material
        Any stack of layers that ``Material`` accepts, g from -0.99 to 0.9999.
    photons : int, optional
        Number of walks, 2 to 1e12; by default the paper's 1e7, or 1e12 with a target error.
    seed : int
        Random seed, 0 or above. It gives the same bits on any number of threads.
    threads : int, optional
        Threads to use; all cores by default.
    dr_mm : float, optional
        Width of an annulus [mm]; by default the shortest mean free path / 20.
    radius_mm : float or "auto", optional
        Outer radius of the grid [mm]; by default 32 times the longest mean free path. "auto"
        enlarges it until less than 0.1 % of any channel's diffuse reflectance lies beyond.
    target_error : float, optional
        End when, for every channel, the largest standard error of F(r) over the annulus edges is
        under this share (0 to 1) of F at the last edge. Checked after fixed numbers of batches,
        1/64 to 1/32 apart, so the end depends only on the seed. Channels that do not scatter are
        ignored.
    angles : int, optional
        Bins of the exit angle, 1 to 180, from 0 to pi/2 from the normal; the profile then also has
        R_d(r, angle), and takes as many times the memory.
    numerical_aperture : float, optional
        That of a detector above the surface, which sees the light within asin(NA / n_above) of the
        normal; the rest is ``outside_aperture``. In place of ``angles``.
    checkpoint : Checkpoint or Path, optional
        Where to save the sums at intervals, so that a killed run can continue and end in the same
        bits. A path means ``Checkpoint(path)``, which continues an existing checkpoint. The file
        stays until the caller has saved the profile and calls ``Checkpoint.remove``.
    progress : callable, optional
        Called with a ``Progress`` about ten times a second.
    stop : callable, optional
        Called after every batch; when it returns true, the run ends with the photons so far.

    Returns
    -------
    Profile
        Energies are relative to the incident light; ``meta["photons"]`` is the number of walks.

    Raises
    ------
    SimulationError
        g is outside the range of the walk; settings are out of range or differ from those of the
        checkpoint; or there is a target error and a channel returns no light within the grid.
    FileError
        The checkpoint to continue from cannot be read, is damaged, or is not a checkpoint.
    StoppedError
        ``stop`` returned true before the first batch was done.

    Warns
    -----
    SssfitWarning
        The run reached its last photon before the target error, or a checkpoint cannot be written
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
        angles=angles,
        numerical_aperture=numerical_aperture,
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
    angles: int | None = None,
    numerical_aperture: float | None = None,
    checkpoint: Checkpoint | str | Path | None = None,
    progress: Callable[[Progress], None] | None = None,
    stop: Callable[[], bool] | None = None,
    elsewhere: Elsewhere | None = None,
) -> list[Profile]:
    """Trace several materials of one relative refractive index with a single walk.

    Parameters and errors are those of ``simulate_montecarlo``; a profile may differ from that of
    a single run in its last bits, since roulette follows the largest albedo of all channels.
    ``elsewhere`` traces the batches in place of threads: `sssfit.sweep.cluster.Batches`.

    Returns
    -------
    list of Profile
        In the order of ``materials``; their noise is correlated.
    """
    check_media(materials)
    ending = end_condition(photons, target_error)
    seed = whole_number("seed", seed)
    directions = Directions(
        None if angles is None else whole_number("angles", angles), numerical_aperture
    )
    directions.note_wide(materials[0])
    threads = available_cores() if threads is None else whole_number("threads", threads)
    _check_settings(ending.photons, seed, threads)
    note_compiling("photon walk", 10, is_compiled(materials[0]))
    auto = radius_mm == "auto"
    if isinstance(radius_mm, str):
        if not auto:
            raise SimulationError(f'radius_mm = {shown(radius_mm)}; give a length in mm or "auto".')
        grids = _auto_grids(materials, dr_mm, seed, threads, stop)
    else:
        grids = [make_grid(each, dr_mm=dr_mm, radius_mm=radius_mm) for each in materials]
    task = make_walk(materials, grids, seed, ending.photons, directions)
    tally = run(
        task,
        threads,
        progress,
        stop,
        target_error=target_error,
        checkpoint=Checkpoint(Path(checkpoint))
        if isinstance(checkpoint, str | Path)
        else checkpoint,
        settings=settings_of(materials, grids, seed, directions),
        elsewhere=elsewhere,
    )
    if tally.photons < 2:
        raise StoppedError("stopped before a single batch of photons was done.")
    error = float(relative_errors(task, tally).max())
    _warn_target(ending, tally.photons, error)
    return [profile_of(task, tally, k, ending, error, trim=auto) for k in range(len(materials))]


def check_media(materials: Sequence[Material]) -> None:
    """Raise an error that names another method if no walk models the material."""
    if not materials:
        raise SimulationError("no material given; name at least one.")
    for material in materials:
        if not isinstance(material, Material):
            raise SimulationError(
                f"{shown(material)} is not a Material; load one with sssfit.material.load_material."
            )
        every_g = np.concatenate([layer.g for layer in material.layers])
        for g in every_g[(every_g < MIN_G) | (every_g > MAX_G)].tolist():
            raise SimulationError(
                f"{material.name}: g = {g:.9g}; the photon walk covers {MIN_G} to {MAX_G}: give "
                "a g between them, with sigma_s such that (1 - g) sigma_s stays as it is."
            )
    if len(materials) == 1:
        return
    for material in materials:
        if not has_fast_walk(material):
            raise SimulationError(
                f"{material.name} is layered, of finite thickness or has g other than 0: "
                "it cannot share a walk with other materials; simulate it by itself."
            )
    if len({relative_eta(each) for each in materials}) != 1:
        raise SimulationError("a walk takes one refractive index; group the materials by eta.")


def has_fast_walk(material: Material) -> bool:
    """Whether the fast walk applies: a half space, g = 0, index at least that of the top medium."""
    layer = material.layers[0]
    plain = material.is_semi_infinite and not np.any(layer.g)
    return plain and relative_eta(material) >= 1.0


def shared_walks(materials: Sequence[Material]) -> list[list[int]]:
    """Group the materials that can share a walk; returns indices in order of first members.

    Half spaces with g = 0 and equal relative refractive index share one; the others do not.
    """
    groups: dict[object, list[int]] = {}
    for k, material in enumerate(materials):
        groups.setdefault(
            relative_eta(material) if has_fast_walk(material) else ("alone", k), []
        ).append(k)
    return list(groups.values())


def is_compiled(material: Material) -> bool:
    """Whether the walk of a material can start at once; otherwise it compiles first, about 10 s."""
    entry = half_space_walk.ENTRY if has_fast_walk(material) else layered_walk.ENTRY
    return entry.is_ready()


def make_walk(
    materials: Sequence[Material],
    grids: Sequence[RadialGrid],
    seed: int,
    photons: int,
    directions: Directions = EVERYWHERE,
) -> Walk:
    """Choose the simplest walk for the material."""
    given = tuple(materials), tuple(grids), seed, photons
    if has_fast_walk(materials[0]):
        from sssfit.simulate.walk_half_space import SemiInfiniteWalk

        return SemiInfiniteWalk(*given, directions=directions)
    from sssfit.simulate.walk_layered import LayeredWalk

    return LayeredWalk(*given, directions=directions)


def _check_settings(photons: int, seed: int, threads: int) -> None:
    """Check the settings; each error is one line."""
    if not 0 <= seed < 2**64:
        raise SimulationError(f"seed = {seed}; give a whole number from 0 to 2^64 - 1.")
    if threads < 1:
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

    Half, so that the run itself, whose first photons are those of the pilot, stays under the share.
    The excess of the doubling is trimmed off the result. One pilot sees three doublings at once:
    cream needs four, and each of them took a pilot of 3 s.
    """
    grids = [make_grid(each, dr_mm=dr_mm) for each in materials]
    while True:
        tried = [_doubled(*each) for each in zip(materials, grids, strict=True)]
        task = make_walk(materials, [each[-1] for each in tried], seed, PILOT_PHOTONS)
        tally = run(task, threads, stop=stop)
        if tally.photons < 2:
            raise StoppedError("stopped before a single batch of photons was done.")
        found = [_wide_enough(task.sums(tally, k), each) for k, each in enumerate(tried)]
        wide = [grid for grid in found if grid is not None]
        if len(wide) == len(found):
            return wide
        grids = [
            grid or _twice_as_wide(material, each[-1])
            for material, each, grid in zip(materials, tried, found, strict=True)
        ]


def _doubled(material: Material, grid: RadialGrid) -> list[RadialGrid]:
    """Return the grid and its doublings, as many as a grid can have annuli for."""
    grids = [grid]
    with contextlib.suppress(SimulationError):
        while len(grids) <= PILOT_DOUBLINGS:
            grids.append(_twice_as_wide(material, grids[-1]))
    return grids


def _twice_as_wide(material: Material, grid: RadialGrid) -> RadialGrid:
    return make_grid(material, dr_mm=grid.dr_mm, radius_mm=2.0 * grid.radius_mm)


def _wide_enough(sums: Sums, grids: Sequence[RadialGrid]) -> RadialGrid | None:
    """Return the first grid beyond which little of the light of a walk on the last one lies."""
    lost = np.max(share_beyond(sums), axis=1)
    return next((each for each in grids if lost[each.annuli - 1] < AUTO_BEYOND / 2), None)


def _warn_target(ending: EndCondition, photons: int, error: float) -> None:
    """Warn if a run reached its last photon before its target error."""
    target = ending.target_error
    if target is not None and photons == ending.photons and error >= target:
        warnings.warn(
            f"{photons:,} photons were done before the target error of {100.0 * target:g} % was "
            f"met; {100.0 * error:.2g} % was reached: give more `photons`, or leave them out.",
            SssfitWarning,
            stacklevel=4,
        )
