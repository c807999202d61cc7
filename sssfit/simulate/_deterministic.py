"""Profiles that are computed instead of sampled: from F(r) at the edges to a record.

Every method without photons ends here, so that its profiles have the same provenance and checks.
Energies are arranged like the walks' bins: (n + 1, C), one annulus per row, beyond the grid last.
Solvers that give F(r) use ``energies_from_cumulative``; closed forms for the energy beyond r use
``energies_from_beyond``, which keeps its digits down to 1e-300 where F(r) is 1 - 1e-16.
"""

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from sssfit import __version__
from sssfit.arrays import FloatArray
from sssfit.errors import SimulationError, SssfitWarning
from sssfit.grid import RadialGrid
from sssfit.material import Layer, Material
from sssfit.messages import shown
from sssfit.profile import FORMAT, Profile

ROUNDING = 1e-12  # F may fall by this share of the total: rounding of sums of a few thousand terms


@dataclass(frozen=True, slots=True)
class ProfileSource:
    """The origin of a profile without coefficients: a name and a source."""

    name: str
    source: str
    channels: tuple[str, ...]
    specular_reflectance: float = 0.0
    sha256: None = None

    @property
    def n_channels(self) -> int:
        """Number of channels."""
        return len(self.channels)

    def to_dict(self) -> dict[str, Any]:
        """Return the source as JSON values."""
        return {"name": self.name, "source": self.source}


def energies_from_cumulative(
    cumulative: FloatArray, total: FloatArray, *, tolerance: float = ROUNDING
) -> FloatArray:
    """Return the energy of each annulus and beyond the grid, all at least 0, (n + 1, C).

    F cannot fall. If it does, by no more than the method's own error, it is replaced by its running
    maximum, limited by the total: if |F - truth| <= e before, this still holds afterwards.

    Parameters
    ----------
    cumulative : (n + 1, C)
        F(r) at the annulus edges; the first row is 0.
    total : (C,)
        F at infinity.
    tolerance : float
        The amount by which F may fall or exceed the total, as a share of the largest total.

    Raises
    ------
    SimulationError
        A value is not finite, or F does not start at 0 or falls by more.
    """
    everywhere = np.vstack((cumulative, np.asarray(total, dtype=np.float64)))
    if not np.isfinite(everywhere).all():
        raise SimulationError("F(r) is not finite everywhere; this is a defect of the method.")
    if np.any(everywhere[0] != 0.0):
        raise SimulationError(f"F(0) = {everywhere[0].tolist()}; expected 0 in every channel.")
    rising = without_falls(everywhere)
    fall = float(np.max(np.abs(rising - everywhere)))
    if fall > tolerance * max(float(np.max(total)), ROUNDING):
        raise SimulationError(
            f"F(r) falls by {fall:.2g}, over the {tolerance:.2g} of the total that the method "
            "allows itself; this is a defect of the method."
        )
    energies: FloatArray = np.diff(rising, axis=0)
    return energies


def without_falls(everywhere: FloatArray) -> FloatArray:
    """Return F at radii and, last, altogether (n + 1, ...) as its running maximum up to the total.

    What this changes is the least error of F, which cannot fall.
    """
    total = np.maximum(everywhere[-1:], 0.0)
    rising = np.minimum(np.maximum.accumulate(everywhere[:-1], axis=0), total)
    return np.concatenate((rising, total))


def energies_from_beyond(beyond: FloatArray) -> FloatArray:
    """Return the energies of `energies_from_cumulative` from the energy beyond each edge.

    Takes (n + 1, C), whose first row is the total, and keeps the last row; the differences between
    rows are exact to rounding of the energy beyond, no matter how small. Raises SimulationError as
    above.
    """
    if not np.isfinite(beyond).all():
        raise SimulationError("energies are not finite everywhere; a defect of the method.")
    falling = np.maximum(np.minimum.accumulate(beyond, axis=0), 0.0)
    rise = float(np.max(np.abs(falling - beyond)))
    if rise > ROUNDING * max(float(np.max(beyond[0])), ROUNDING):
        raise SimulationError(f"energy beyond r rises by {rise:.2g}; a defect of the method.")
    return np.vstack((-np.diff(falling, axis=0), falling[-1:]))


def computed_profile(
    material: Material | ProfileSource,
    method: str,
    grid: RadialGrid,
    reflected: FloatArray,
    *,
    stderr: FloatArray | None = None,
    transmitted: FloatArray | None = None,
    transmitted_stderr: FloatArray | None = None,
    absorbed: FloatArray | None = None,
    relative_error: float | None = None,
    settings: Mapping[str, Any] | None = None,
    energy_balance_stderr: list[float] | None = None,
) -> Profile:
    """Make a profile from computed energies, without photons and seed.

    Parameters
    ----------
    material : Material or ProfileSource
    method : str
        Its name on the command line; becomes ``meta["method"]``.
    grid : RadialGrid
        n annuli.
    reflected : (n + 1, C)
        Energies of the annuli and beyond the grid, shares of the incident light.
    stderr : (n + 1, C), optional
        The method's own estimate of their errors; NaN if there is none.
    transmitted : (n + 1, C), optional
        Energy that leaves through the bottom of a slab.
    transmitted_stderr : (n + 1, C), optional
        The method's own estimate of their errors.
    absorbed : (layers, C), optional
        Absorbed energy by layer; unknown by default, and then the energy balance is NaN.
    relative_error : float, optional
        The error that was reached, in the terms of the method's tolerance.
    settings : mapping, optional
        The method's own settings, for provenance; those of the grid are added.
    energy_balance_stderr : list of float, optional
        Error of the sum of the energies of each channel, which should be 1.

    Returns
    -------
    Profile
        With ``meta["photons"]`` and ``meta["seed"]`` None.
    """
    n, channels = grid.annuli, material.n_channels
    error = np.full((n + 1, channels), np.nan) if stderr is None else stderr
    return Profile(
        r_edges_mm=grid.r_edges_mm,
        annulus_energy=reflected[:n],
        annulus_energy_stderr=error[:n],
        beyond_grid=reflected[n],
        beyond_grid_stderr=error[n],
        specular_reflectance=material.specular_reflectance,
        absorbed=np.zeros((0, channels)) if absorbed is None else absorbed,
        unfinished=np.zeros(channels),
        annulus_transmittance=None if transmitted is None else transmitted[:n],
        beyond_grid_transmittance=None if transmitted is None else transmitted[n],
        annulus_transmittance_stderr=None if transmitted_stderr is None else transmitted_stderr[:n],
        beyond_grid_transmittance_stderr=(
            None if transmitted_stderr is None else transmitted_stderr[n]
        ),
        meta={
            "format": FORMAT,
            "method": method,
            "material": material.to_dict(),
            "material_sha256": material.sha256,
            "channels": list(material.channels),
            "photons": None,
            "seed": None,
            "version": __version__,
            "settings": {"dr_mm": grid.dr_mm, "radius": "given", **(settings or {})},
            "relative_error": relative_error,
            "energy_balance_stderr": energy_balance_stderr,
        },
    )


def half_space(material: Material, method: str) -> Layer:
    """Return the layer of a homogeneous half space; the error names methods for other materials.

    Raises
    ------
    SimulationError
        The argument is not a material, or it is a stack or a slab.
    """
    check_is_material(material)
    if not material.is_semi_infinite:
        what = "has several layers" if len(material.layers) > 1 else "has a finite thickness"
        raise SimulationError(
            f"{material.name} {what}; the method {method} covers one layer without a bottom: use "
            "multipole or montecarlo."
        )
    return material.layers[0]


def warn_of_similarity(material: Material, method: str) -> None:
    """Warn if scattering with g other than 0 is treated as isotropic."""
    steepest = float(np.max(np.abs(material.layers[0].g)))
    if steepest > 0.0:
        warnings.warn(
            f"{material.name}: g = {steepest:g} in absolute value; the method {method} takes "
            "scattering as isotropic with sigma_s' = (1 - g) sigma_s, which is an approximation: "
            "montecarlo does not need it.",
            SssfitWarning,
            stacklevel=5,
        )


def check_is_material(material: object) -> None:
    """Raise an error for a name or a path, which must be loaded first."""
    if not isinstance(material, Material):
        raise SimulationError(
            f"{shown(material)} is not a Material; load one with sssfit.material.load_material."
        )
