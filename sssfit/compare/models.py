"""Profile models against the exact solution: where each goes wrong, and by how much.

Every method is computed on one grid. Densities are compared over bins: annuli merged until the
photon walk has 100 hits in each, so that the walk says something about every bin and vouches for
the exact solution there. Totals, F(r) and the L2 error use the annuli as they are.
``sssfit.chart`` draws the record.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray, check_record, plain
from sssfit.compare.covered import model_profiles
from sssfit.errors import ProfileError, SimulationError
from sssfit.material import Material
from sssfit.messages import note
from sssfit.profile import Profile
from sssfit.profile.bins import merged
from sssfit.simulate import (
    Progress,
    simulate_exact,
    simulate_montecarlo,
)


@dataclass(frozen=True, slots=True, eq=False)
class ModelCurve:
    """One method's profile and its distance from the exact one, for C channels.

    Parameters
    ----------
    profile : Profile
    energy, energy_stderr : tuple of C arrays (m_c,) [1]
        Energy in each bin, and its standard error: the walk's noise, the exact solver's estimate,
        NaN where there is none.
    relative_error, relative_error_stderr : tuple of C arrays (m_c,) [1]
        Energy over the exact one's - 1, and that of the standard error; NaN where the exact one
        is 0. 0 for the exact profile itself.
    total_error : (C,) [1]
        Total diffuse reflectance over the exact one - 1.
    cumulative_error : (C,) [1]
        Largest |F(r) - F_exact(r)| at an annulus edge, as a share of the exact total.
    l2_error : (C,) [1]
        sqrt(int r (R_d - exact)^2 dr / int r exact^2 dr) over annuli; it depends on their width,
        since R_d ~ 1/r.
    """

    profile: Profile
    energy: tuple[FloatArray, ...]
    energy_stderr: tuple[FloatArray, ...]
    relative_error: tuple[FloatArray, ...]
    relative_error_stderr: tuple[FloatArray, ...]
    total_error: FloatArray
    cumulative_error: FloatArray
    l2_error: FloatArray

    @property
    def method(self) -> str:
        """Name of the method."""
        return str(self.profile.meta["method"])

    def to_dict(self) -> dict[str, Any]:
        """Return the method's figures; errors are shares, against the exact solution."""
        return plain(
            {
                "method": self.method,
                "diffuse_reflectance": self.profile.diffuse_reflectance,
                "diffuse_reflectance_stderr": self.profile.diffuse_reflectance_stderr,
                "total_error": self.total_error,
                "cumulative_error": self.cumulative_error,
                "l2_error": self.l2_error,
            }
        )


@dataclass(frozen=True, slots=True, eq=False)
class ModelComparison:
    """A material by every method: the curves, exact first and the walk second, and their bins.

    Parameters
    ----------
    material : Material
    edges_mm : tuple of C arrays (m_c + 1,) [mm]
        Edges of each channel's bins; they end where the walk has too few photons.
    curves : tuple of ModelCurve
    left_out : tuple of str
        Lines about models that do not cover the material.
    """

    material: Material
    edges_mm: tuple[FloatArray, ...]
    curves: tuple[ModelCurve, ...]
    left_out: tuple[str, ...] = ()

    @property
    def exact(self) -> ModelCurve:
        """The exact solution."""
        return self.curves[0]

    @property
    def walk(self) -> ModelCurve:
        """The photon walk."""
        return self.curves[1]

    def to_dict(self) -> dict[str, Any]:
        """Return the figures of ``sssfit chart --models --json``, a row for each method."""
        walk = self.walk.profile
        return plain(
            {
                "material": self.material.name,
                "channels": self.material.channels,
                "photons": walk.photons,
                "seed": walk.meta.get("seed"),
                "annuli": walk.n_annuli,
                "dr_mm": float(walk.r_edges_mm[1]),
                "radius_mm": float(walk.r_edges_mm[-1]),
                "rows": [each.to_dict() for each in self.curves],
            }
        )


def compare_models(
    material: Material,
    *,
    walk: Profile | None = None,
    exact: Profile | None = None,
    photons: int | None = None,
    seed: int = 1,
    threads: int | None = None,
    dr_mm: float | None = None,
    radius_mm: float | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> ModelComparison:
    """Compute a material by the exact solver, the photon walk and its diffusion models.

    Normalised diffusion has the total as a parameter, the reflectance that an artist wants; it is
    given the exact one, so that what is left is the error of its shape.

    Parameters
    ----------
    material : Material
        For layers there is the multipole, if it covers them; for half spaces with g other than 0
        the models warn that it is reduced.
    walk : Profile, optional
        The material's photon walk, if there is one already; its grid then serves all.
    exact : Profile, optional
        Its exact profile on the grid of the others, if there is one already.
    photons, seed, threads, progress
        Those of the walk otherwise; see `simulate_montecarlo`.
    dr_mm, radius_mm : float, optional
        The grid [mm]; by default the paper's.

    Returns
    -------
    ModelComparison

    Raises
    ------
    SimulationError
        The exact solver refuses the material; settings are out of range; or a ``walk`` on a grid
        that is not uniform.

    Examples
    --------
    >>> from sssfit.material import load_material
    >>> found = compare_models(load_material("skin1"), photons=100_000)
    >>> [each.method for each in found.curves]
    ['exact', 'montecarlo', 'dipole', 'dipole-grosjean', 'burley']
    """
    if walk is not None:
        dr_mm, radius_mm = _grid_of(walk)
    if exact is None:
        exact = simulate_exact(material, dr_mm=dr_mm, radius_mm=radius_mm, threads=threads)
    if walk is None:
        walk = simulate_montecarlo(
            material,
            photons=photons,
            seed=seed,
            threads=threads,
            dr_mm=dr_mm,
            radius_mm=radius_mm,
            progress=progress,
        )
    total, grid = exact.diffuse_reflectance, {"dr_mm": dr_mm, "radius_mm": radius_mm}
    models, left_out = model_profiles(material, total, **grid)
    for line in left_out:
        note(line)
    profiles = [exact, walk, *models.values()]
    cuts = [_cuts(walk, channel) for channel in range(material.n_channels)]
    return ModelComparison(
        material=material,
        edges_mm=tuple(walk.r_edges_mm[each] for each in cuts),
        curves=tuple(_curve(each, exact, cuts) for each in profiles),
        left_out=left_out,
    )


def material_of_walk(profile: Profile) -> Material:
    """Return the material that a profile is a photon walk of.

    Raises
    ------
    ProfileError
        It is of another method, under a beam, or does not say its material.
    """
    check_record("profile", profile, Profile, ProfileError)
    if "beam" in profile.meta:
        raise ProfileError(
            f"the profile of {profile.label} is under a beam, {profile.meta['beam']}; name the "
            "material, or a walk of a pencil beam."
        )
    material = profile.material
    is_walk = profile.meta.get("method") == "montecarlo" and profile.photons is not None
    if material is None or not is_walk or profile.channels != material.channels:
        raise ProfileError(
            f"the profile of {profile.label} is not a photon walk of a known material; name a "
            "material, or the profile of its walk."
        )
    return material


def _grid_of(walk: Profile) -> tuple[float, float]:
    """Width and radius [mm] of a profile's annuli."""
    width_mm = np.diff(walk.r_edges_mm)
    if walk.photons is None or not np.allclose(width_mm, width_mm[0], rtol=1e-6):
        raise SimulationError(
            "models are compared on a photon walk's grid, and this profile has no photons or "
            "annuli of varying width; simulate the material again."
        )
    return float(walk.r_edges_mm[1]), float(walk.r_edges_mm[-1])


def _cuts(walk: Profile, channel: int) -> npt.NDArray[np.intp]:
    """Return which annulus edges bound the bins in which the walk has enough photons."""
    bins = merged(walk, channel)
    edges_mm = bins.edges_mm[: int(bins.is_drawn.sum()) + 1]
    cuts: npt.NDArray[np.intp] = np.searchsorted(walk.r_edges_mm, edges_mm)
    return cuts


def _curve(profile: Profile, exact: Profile, cuts: list[npt.NDArray[np.intp]]) -> ModelCurve:
    """Compare one profile with the exact one."""
    energy = [np.diff(profile.cumulative[cut, c]) for c, cut in enumerate(cuts)]
    truth = [np.diff(exact.cumulative[cut, c]) for c, cut in enumerate(cuts)]
    stderr = [_stderr_of_bins(profile, c, cut) for c, cut in enumerate(cuts)]
    pairs = list(zip(energy, truth, strict=True))
    total, apart = exact.diffuse_reflectance, np.abs(profile.cumulative - exact.cumulative)
    return ModelCurve(
        profile=profile,
        energy=tuple(energy),
        energy_stderr=tuple(stderr),
        relative_error=tuple(_share(ours - theirs, theirs) for ours, theirs in pairs),
        relative_error_stderr=tuple(map(_share, stderr, truth)),
        total_error=_share(profile.diffuse_reflectance - total, total),
        cumulative_error=_share(apart.max(axis=0), total),
        l2_error=_l2_error(profile, exact),
    )


def _stderr_of_bins(profile: Profile, channel: int, cuts: npt.NDArray[np.intp]) -> FloatArray:
    """Return the standard error of each bin (m,): a walk's as merged, others' squares added."""
    if profile.photons is not None:
        return merged(profile, channel).stderr[: cuts.size - 1]
    annuli = profile.annulus_energy_stderr[:, channel]
    summed: FloatArray = np.sqrt(np.diff(np.append(0.0, np.cumsum(annuli**2))[cuts]))
    return summed


def _share(value: FloatArray, whole: FloatArray) -> FloatArray:
    """Value over whole; NaN where the whole is 0."""
    return np.divide(value, whole, out=np.full_like(value, np.nan), where=whole > 0.0)


def _l2_error(profile: Profile, exact: Profile) -> FloatArray:
    """Relative L2 error of R_d (C,); the weights r dr of an annulus are its area / 2 pi."""
    area_mm2 = np.pi * np.diff(exact.r_edges_mm**2)[:, None]
    apart = profile.reflectance_per_mm2 - exact.reflectance_per_mm2
    of_exact = (area_mm2 * exact.reflectance_per_mm2**2).sum(axis=0)
    return np.sqrt(_share((area_mm2 * apart**2).sum(axis=0), of_exact))
