"""Lengths of a profile that charts, fits and summaries are scaled by: radii and free paths."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sssfit import _disks
from sssfit._disks import FloatArray
from sssfit.errors import MaterialError
from sssfit.material import Material

if TYPE_CHECKING:
    from sssfit.profile import Profile

# F between 256 points of an annulus is straight to 2e-6 of the annulus' width.
_PARTS = 256


def energy_radii_mm(profile: "Profile", shares: Sequence[float]) -> FloatArray:
    """Return the radii within which ``shares`` of each channel's on-grid energy leave.

    F(r) is inverted inside the annulus that holds the share, by its smooth interpolation.

    Parameters
    ----------
    profile : Profile
    shares : sequence of float (k,) [1]
        Shares of `Profile.total_on_grid`, each in (0, 1].

    Returns
    -------
    array (k, C) [mm]
        NaN for a channel without energy on the grid.
    """
    cumulative = profile.cumulative
    total = cumulative[-1]
    radii_mm = np.full((len(shares), profile.n_channels), np.nan)
    for channel in np.flatnonzero(total > 0):
        for k, share in enumerate(shares):
            wanted = share * total[channel]
            annulus = int(np.argmax(cumulative[1:, channel] >= wanted))
            energy = profile.annulus_energy[:, channel]
            radii_mm[k, channel] = _radius_in(
                profile.r_edges_mm, energy, annulus, wanted - cumulative[annulus, channel]
            )
    return radii_mm


def _radius_in(r_edges_mm: FloatArray, energy: FloatArray, annulus: int, wanted: float) -> float:
    """Radius in an annulus where F has grown by ``wanted`` since its inner edge [mm]."""
    # The slopes at its edges depend on its neighbours; two on either side make them those of F.
    first, last = max(annulus - 2, 0), min(annulus + 3, len(energy))
    near = r_edges_mm[first : last + 1], energy[first:last, None]
    radii_mm = np.linspace(r_edges_mm[annulus], r_edges_mm[annulus + 1], _PARTS + 1)
    grown = _disks.cumulative_at(*near, radii_mm)[:, 0] - energy[first:annulus].sum()
    return float(np.interp(wanted, grown, radii_mm))


def mean_free_paths_mm(profile: "Profile") -> FloatArray | None:
    """Mean free path of each channel (C,) [mm] in the material's top layer; None if unknown."""
    material = material_of(profile)
    if material is None or material.n_channels != profile.n_channels:
        return None
    if len(material.layers) > 1:
        return None  # there is no one mean free path
    paths_mm = material.layers[0].mean_free_path_mm
    return paths_mm if np.isfinite(paths_mm).all() else None


def material_of(profile: "Profile") -> Material | None:
    """Return the material a profile says it was made from; None where it holds none."""
    record = profile.meta.get("material")
    if not isinstance(record, dict):
        return None
    try:
        return Material.from_dict(record)
    except MaterialError:
        return None
