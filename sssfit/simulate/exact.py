"""The exact profile of any material: solves the transport equation instead of sampling it.

One choice between two solvers, which profiles record in their settings. A half space with g = 0 is
the task of ``half_space``, which solves an integral equation in depth, is faster there and keeps
the digits of R_d far out. Everything else - layers, slabs, forward scattering, a medium thinner
optically than what is above it - is the task of ``stack``, which solves for radiance in discrete
directions. Both add to their resolution until two of them agree within the tolerance.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import compress
from typing import Any

from sssfit._jit import depth_matrix, thread_pool
from sssfit.arrays import is_number, is_whole
from sssfit.errors import SimulationError
from sssfit.grid import RadialGrid, make_grid
from sssfit.material import Layer, Material
from sssfit.messages import shown
from sssfit.process import available_cores, one_blas_thread
from sssfit.profile import Profile
from sssfit.simulate import half_space
from sssfit.simulate._deterministic import check_is_material
from sssfit.simulate._directions import Directions

DEFAULT_TOLERANCE = 1e-4


def simulate_exact(
    material: Material,
    *,
    dr_mm: float | None = None,
    radius_mm: float | None = None,
    tolerance: float = DEFAULT_TOLERANCE,
    similarity: bool = False,
    angles: int | None = None,
    threads: int | None = None,
    stop: Callable[[], bool] | None = None,
) -> Profile:
    """Solve for the diffuse reflectance profile of a material, and the transmittance of a slab.

    Parameters
    ----------
    material : Material
        Any; g of .9 or more may not meet the tolerance, above all in thin slabs.
    dr_mm, radius_mm : float, optional
        Grid, as in ``sssfit.grid.make_grid``.
    tolerance : float
        Largest error of F(r) at an annulus edge, and of the total, as a share of the light that
        leaves above and below; above 0 and below 1.
    similarity : bool
        Whether scattering with g other than 0 is replaced by isotropic scattering of (1 - g)
        sigma_s, an approximation that is faster.
    angles : int, optional
        Bins of the exit angle, 1 to 180: R_d(angle), of all annuli together.
    threads : int, optional
        Threads to use; all cores by default. The result does not depend on them.
    stop : callable, optional
        Called at intervals; StoppedError is raised when it returns true.

    Returns
    -------
    Profile
        ``annulus_energy_stderr`` holds the error estimate; ``meta["photons"]`` is None, and
        ``meta["settings"]["solver"]`` is "half-space" or "layer".

    Raises
    ------
    SimulationError
        Settings are out of range, the finest resolution does not meet the tolerance, or a stack has
        too many layers for the memory.
    StoppedError
        ``stop`` returned true.

    References
    ----------
    Case and Zweifel 1967, "Linear Transport Theory"; Chandrasekhar 1960, "Radiative Transfer".
    """
    return simulate_exact_many(
        [material],
        dr_mm=dr_mm,
        radius_mm=radius_mm,
        tolerance=tolerance,
        similarity=similarity,
        angles=angles,
        threads=threads,
        stop=stop,
    )[0]


def simulate_exact_many(
    materials: Sequence[Material],
    *,
    dr_mm: float | None = None,
    radius_mm: float | None = None,
    tolerance: float = DEFAULT_TOLERANCE,
    similarity: bool = False,
    angles: int | None = None,
    threads: int | None = None,
    stop: Callable[[], bool] | None = None,
) -> list[Profile]:
    """Solve for several materials, which share what they have in common.

    Half spaces of one relative refractive index share all work; stacks share the modes of the
    layers they have in common. Parameters and errors are those of ``simulate_exact``. Returns the
    profiles in the order of ``materials``; they differ from those of single runs by less than their
    error estimates.
    """
    threads = available_cores() if threads is None else threads
    _check_settings(materials, tolerance, threads)
    directions = Directions(angles)
    grids = [make_grid(each, dr_mm=dr_mm, radius_mm=radius_mm) for each in materials]
    is_plain = [half_space.covers(each, similarity=similarity) for each in materials]
    from sssfit.simulate import stack

    # One BLAS thread for each of ours: matrices of 100 to 400 rows do not profit from more, and
    # with another process on one core BLAS's waiting threads made skin1 take 14 s instead of 1.8.
    with _workers(threads, is_plain=any(is_plain)) as pool, one_blas_thread():
        plain = half_space.solve_half_spaces(
            *_chosen(materials, grids, is_plain), tolerance, pool, stop
        )
        others, their_grids = _chosen(materials, grids, [not each for each in is_plain])
        layered = stack.solve_stacks(
            others,
            their_grids,
            tolerance,
            pool,
            threads,
            reduced=[_isotropic(each) if similarity else each for each in others],
            stop=stop,
        )
        answers = {True: iter(plain), False: iter(layered)}
        found = [next(answers[each]) for each in is_plain]
        if angles is None:
            return found
        solved_for = [_isotropic(each) if similarity else each for each in materials]
        pairs = zip(found, solved_for, strict=True)
        return [_with_angles(each, material, directions, tolerance) for each, material in pairs]


def _workers(threads: int, *, is_plain: bool) -> ThreadPoolExecutor:
    """Return threads, before which what half spaces need is imported and loaded."""
    if not is_plain:
        return ThreadPoolExecutor(threads, thread_name_prefix="sssfit")
    from scipy import optimize, special  # noqa: F401 (before the threads, which need them)

    return thread_pool(threads, first=depth_matrix.ENTRY.load)


def _with_angles(
    profile: Profile, material: Material, directions: Directions, tolerance: float
) -> Profile:
    """Add R_d(angle), which the solver for layers has at k = 0, whichever made the profile."""
    from sssfit.simulate.stack.angles import energies_by_angle

    settings = {**profile.meta["settings"], **directions.given()}
    meta = {**profile.meta, "format": directions.profile_format, "settings": settings}
    fields: dict[str, Any] = dict(energies_by_angle(material, directions.edges_rad, tolerance))
    return replace(profile, meta=meta, **fields)


def _chosen(
    materials: Sequence[Material], grids: Sequence[RadialGrid], which: Sequence[bool]
) -> tuple[list[Material], list[RadialGrid]]:
    """Return the materials that a solver gets, and their grids."""
    return list(compress(materials, which)), list(compress(grids, which))


def _isotropic(material: Material) -> Material:
    """Return the material with sigma_s' = (1 - g) sigma_s and g = 0 in every layer."""
    layers = tuple(
        Layer(
            each.eta,
            0.0 * each.g,
            each.sigma_a_per_mm,
            each.reduced_sigma_s_per_mm,
            each.thickness_mm,
        )
        for each in material.layers
    )
    return replace(material, layers=layers)


def _check_settings(materials: Sequence[Material], tolerance: float, threads: int) -> None:
    """Check the settings; each error is one line."""
    if not is_number(tolerance) or not 0.0 < tolerance < 1.0:
        raise SimulationError(f"tolerance = {shown(tolerance)}; give a share of the total, 0 to 1.")
    if not is_whole(threads) or threads < 1:
        raise SimulationError(f"threads = {shown(threads)}; give at least 1.")
    for material in materials:
        check_is_material(material)
