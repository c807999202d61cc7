"""Normalised diffusion: a profile from reflectance and mean free path, as engines use it.

Christensen and Burley 2015, "Approximate reflectance profiles for efficient subsurface scattering":
R_d(r) = A s (exp(-s r) + exp(-s r/3)) / (8 pi r) for every material, with s from one of three fits
to photon walks (`sssfit.shapes`). A is the diffuse reflectance, which artists call the albedo of
the surface; it is not the single-scattering albedo. The profile holds all of A's energy.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray
from sssfit.errors import SimulationError
from sssfit.grid import make_grid
from sssfit.material import Layer, Material
from sssfit.messages import counted, shown
from sssfit.profile import Profile
from sssfit.shapes import (
    diffusion_beyond,
    s_diffuse,
    s_diffuse_mean_free_path,
    s_perpendicular,
)
from sssfit.simulate._deterministic import (
    computed_profile,
    energies_from_beyond,
    half_space,
    warn_of_similarity,
)
from sssfit.simulate._walks import relative_eta
from sssfit.simulate.half_space import diffuse_reflectance

MAPPINGS: Mapping[str, Callable[[npt.ArrayLike], FloatArray]] = MappingProxyType(
    {
        "perpendicular": s_perpendicular,
        "diffuse": s_diffuse,
        "diffuse-mfp": s_diffuse_mean_free_path,
    }
)


def simulate_burley(
    material: Material,
    *,
    mapping: str = "perpendicular",
    reflectance: npt.ArrayLike | None = None,
    dr_mm: float | None = None,
    radius_mm: float | None = None,
) -> Profile:
    """Return the profile of normalised diffusion.

    Parameters
    ----------
    material : Material
        A homogeneous half space; any g (through sigma_s').
    mapping : str
        The fit that gives s: "perpendicular" (light along the normal, as in the other methods) or
        "diffuse" (light from all directions), both relative to the mean free path 1 / sigma_t'; or
        "diffuse-mfp", relative to the diffuse mean free path 1 / sqrt(3 sigma_a sigma_t').
    reflectance : (C,) or float, optional
        A, the diffuse reflectance, 0 to 1; by default the exact one of the material (half a
        second), whose index must then not be below that of the medium above.
    dr_mm, radius_mm : float, optional
        Grid, as in `sssfit.grid.make_grid` [mm].

    Returns
    -------
    Profile
        The model to rounding; standard errors are NaN. ``meta["settings"]`` holds ``mapping``,
        ``reflectance`` and ``s_per_mm``.

    Raises
    ------
    SimulationError
        The material is a slab or a stack, the mapping is unknown, the reflectance is out of range,
        "diffuse-mfp" is used without absorption, or the grid is invalid.

    Examples
    --------
    >>> from sssfit.material import load_material
    >>> profile = simulate_burley(load_material("skin1"), reflectance=[0.44, 0.22, 0.13])
    >>> profile.diffuse_reflectance.round(12).tolist()
    [0.44, 0.22, 0.13]
    """
    layer = half_space(material, "burley")
    if not isinstance(mapping, str) or mapping not in MAPPINGS:
        raise SimulationError(f"mapping = {shown(mapping)}; expected one of {', '.join(MAPPINGS)}.")
    total = _reflectance(material, layer, reflectance)
    s_per_mm = MAPPINGS[mapping](total) * _scale_per_mm(material, layer, mapping)
    grid = make_grid(material, dr_mm=dr_mm, radius_mm=radius_mm)
    beyond = total * diffusion_beyond(grid.r_edges_mm[:, None], s_per_mm)
    settings = {
        "mapping": mapping,
        "reflectance": total.tolist(),
        "s_per_mm": s_per_mm.tolist(),
    }
    return computed_profile(
        material, "burley", grid, energies_from_beyond(beyond), settings=settings
    )


def _reflectance(material: Material, layer: Layer, given: npt.ArrayLike | None) -> FloatArray:
    """Return A of each channel (C,)."""
    if given is None:
        return _own_reflectance(material, layer)
    try:
        total = np.broadcast_to(np.asarray(given, dtype=np.float64), (material.n_channels,))
    except (TypeError, ValueError, OverflowError):  # an integer of 400 digits
        total = np.full(1, np.nan)
    if not ((total >= 0.0) & (total <= 1.0)).all():
        raise SimulationError(
            f"reflectance = {shown(given)}; expected a number from 0 to 1 for each of "
            f"{counted(material.n_channels, 'channel')}."
        )
    return total


def _own_reflectance(material: Material, layer: Layer) -> FloatArray:
    """Return the exact diffuse reflectance (C,), for g other than 0 by the similarity relation."""
    eta = relative_eta(material)
    if eta < 1.0:
        raise SimulationError(
            f"{material.name}: what is above is denser, by {1.0 / eta:.4g}, and burley has no "
            "reflectance of its own for that; use `method = exact`."
        )
    warn_of_similarity(material, "burley")
    return diffuse_reflectance(layer.reduced_sigma_s_per_mm / layer.reduced_sigma_t_per_mm, eta)


def _scale_per_mm(material: Material, layer: Layer, mapping: str) -> FloatArray:
    """Return the unit of s (C,) [1/mm]: the inverse of the mean free path that a mapping uses."""
    sigma_t = layer.reduced_sigma_t_per_mm
    if mapping != "diffuse-mfp":
        return sigma_t
    for channel, sigma_a in zip(material.channels, layer.sigma_a_per_mm, strict=True):
        if sigma_a == 0.0:
            raise SimulationError(
                f"{material.name}: nothing absorbs in channel {channel}, so its diffuse mean free "
                "path is infinite; use the mapping perpendicular or diffuse."
            )
    return np.asarray(np.sqrt(3.0 * layer.sigma_a_per_mm * sigma_t), dtype=np.float64)
