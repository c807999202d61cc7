"""The profiles of an error budget: the truth, the photon walk and the models beside it."""

import dataclasses
import math
from collections.abc import Callable

import numpy as np

from sssfit.compare._all_light import exact_with_all_light, radius_of
from sssfit.errors import SimulationError
from sssfit.grid import RadialGrid, make_grid
from sssfit.material import Material
from sssfit.profile import Profile
from sssfit.simulate import (
    Progress,
    simulate_burley,
    simulate_dipole,
    simulate_dipole_grosjean,
    simulate_montecarlo,
)

MODELS = ("dipole", "dipole-grosjean", "burley")


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class Sources:
    """Profiles of one material on the same wide annuli; the first ``annuli`` are the grid.

    Parameters
    ----------
    exact, walk : Profile
        The truth, and the photon walk.
    models : mapping of str to Profile
        By the names in `MODELS`.
    annuli : int
        Annuli of the grid that a user's simulation has; the others hold what lies beyond it.
    """

    exact: Profile
    walk: Profile
    models: dict[str, Profile]
    annuli: int

    def on_grid(self, profile: Profile) -> Profile:
        """Return the profile as simulated on the grid: what is further out is but a sum."""
        far, kept = slice(self.annuli, None), slice(self.annuli)
        stderr = np.vstack((profile.annulus_energy_stderr[far], profile.beyond_grid_stderr))
        return dataclasses.replace(
            profile,
            r_edges_mm=profile.r_edges_mm[: self.annuli + 1],
            annulus_energy=profile.annulus_energy[kept],
            annulus_energy_stderr=profile.annulus_energy_stderr[kept],
            beyond_grid=profile.annulus_energy[far].sum(axis=0) + profile.beyond_grid,
            beyond_grid_stderr=np.sqrt((stderr**2).sum(axis=0)),
        )

    def cut(self, profile: Profile) -> Profile:
        """Return the profile without the light beyond the grid."""
        return dataclasses.replace(
            self.on_grid(profile),
            beyond_grid=np.zeros(profile.n_channels),
            beyond_grid_stderr=np.zeros(profile.n_channels),
        )


def make_sources(
    material: Material,
    reach_mm: float,
    *,
    photons: int,
    seed: int = 1,
    radius_mm: float | None = None,
    threads: int | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Sources:
    """Simulate a half space by the exact solver, the photon walk and the models.

    The truth's grid is doubled until at most 0.01 % of any channel's light lies beyond it, or the
    picture ends: light beyond the user's grid then falls where it belongs.

    Parameters
    ----------
    material : Material
    reach_mm : float [mm]
        How far apart two pixels of the picture can be along an axis.
    photons, seed, threads, progress
        Of the walk; see ``simulate_montecarlo``.
    radius_mm : float, optional [mm]
        The grid of which the budget says what it loses; by default the paper's.

    Raises
    ------
    SimulationError
        A material that the exact solver does not cover, or settings out of range.
    """
    _check_solvable(material)
    grid = make_grid(material, radius_mm=radius_mm)
    exact = exact_with_all_light(material, grid, reach_mm, threads=threads)
    wide_mm = radius_of(RadialGrid(grid.dr_mm, exact.n_annuli))
    walk = simulate_montecarlo(
        material,
        photons=photons,
        seed=seed,
        radius_mm=wide_mm,
        threads=threads,
        progress=progress,
    )
    models = {
        "dipole": simulate_dipole(material, radius_mm=wide_mm),
        "dipole-grosjean": simulate_dipole_grosjean(material, radius_mm=wide_mm),
        "burley": simulate_burley(
            material, reflectance=exact.diffuse_reflectance, radius_mm=wide_mm
        ),
    }
    return Sources(exact, walk, models, grid.annuli)


def _check_solvable(material: Material) -> None:
    """Refuse what has no exact solution; one with g is reduced, and the walk's is not."""
    if not material.is_semi_infinite:
        raise SimulationError(
            f"{material.name} is not one half space, and an error budget needs the exact solution, "
            "which others do not have: compare kernels on the profile of its photon walk instead."
        )
    g = material.layers[0].g
    if np.any(g != 0.0):
        raise SimulationError(
            f"{material.name}: g = {g[np.argmax(np.abs(g))]:g}; an error budget needs a truth, and "
            "the exact solver has one for g = 0: give sigma_s (1 - g) as sigma_s_per_mm and leave "
            "g out."
        )


def picture_reach_mm(height: int, width: int, mm_per_pixel: float) -> float:
    """Return how far two pixels of a picture can be apart [mm], corner to corner."""
    return mm_per_pixel * math.hypot(height - 1, width - 1)
