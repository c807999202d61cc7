"""The directions in which light leaves: R_d by exit angle, and what a detector does not see.

MCML's conventions (Wang, Jacques, Zheng 1995; its manual, section 4.3): alpha is the angle to the
normal outside; a bin from a to b covers 2 pi (cos a - cos b) sr. R_d(alpha) [1/sr] is energy over
solid angle; R_d(r, alpha) [1/(mm^2 sr)] is energy over solid angle and the area as it is seen,
which is smaller by cos alpha: a radiance.

A Lambertian surface has R_d(alpha) in proportion to cos alpha. Below a smooth one of another index
it is cos alpha times Fresnel's transmittance: what every shader with a diffusion profile takes the
light that leaves for.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from sssfit.arrays import FloatArray, plain
from sssfit.errors import ProfileError
from sssfit.optics import fresnel_transmittance, gauss_legendre

if TYPE_CHECKING:
    from sssfit.profile.record import Profile

_PAIRS = (("angle_reflected", "annulus_energy"), ("angle_transmitted", "annulus_transmittance"))
_ROUNDING = 1e-9  # of a sum over angles against its annulus; a beam rounds to 1e-13
_NODES = 8  # of Gauss and Legendre in a bin


@dataclass(frozen=True, slots=True, eq=False)
class AngularReflectance:
    """R_d(alpha) of a profile, with what it would be for a Lambertian medium under Fresnel.

    Parameters
    ----------
    profile : Profile
    edges_rad : array (A+1,) [rad]
    per_sr, per_sr_stderr : array (A, C) [1/sr]
        R_d(alpha) and its standard error.
    lambertian : array (A, C) [1/sr]
        The same energy with the directions of cos alpha times Fresnel's transmittance.
    misplaced, misplaced_stderr : array (C,) [1]
        Half the sum of the differences of energies by angle, as a share of the whole; and what
        noise alone would make of it.
    """

    profile: Profile
    edges_rad: FloatArray
    per_sr: FloatArray
    per_sr_stderr: FloatArray
    lambertian: FloatArray
    misplaced: FloatArray
    misplaced_stderr: FloatArray

    @property
    def angles_deg(self) -> FloatArray:
        """Middles of the bins (A,) [degrees]."""
        middles: FloatArray = np.degrees(0.5 * (self.edges_rad[1:] + self.edges_rad[:-1]))
        return middles

    @property
    def ratio(self) -> FloatArray:
        """R_d(alpha) over that of the Lambertian medium (A, C); NaN without light."""
        some = self.lambertian > 0.0
        empty = np.full_like(self.per_sr, np.nan)
        return np.divide(self.per_sr, self.lambertian, out=empty, where=some)

    def to_dict(self) -> dict[str, Any]:
        """Return a row for each bin of angles."""
        ends = np.degrees(self.edges_rad)
        columns = (ends[:-1], ends[1:], self.per_sr, self.per_sr_stderr, self.lambertian)
        keys = ("from_deg", "to_deg", "per_sr", "stderr", "lambertian")
        rows = [dict(zip(keys, row, strict=True)) for row in zip(*columns, strict=True)]
        own = {"misplaced": self.misplaced, "misplaced_stderr": self.misplaced_stderr}
        made_of, names = self.profile.material_name, self.profile.channels
        return plain({"material": made_of, "channels": names, **own, "rows": rows})


def angular_reflectance(profile: Profile) -> AngularReflectance:
    """Return R_d(alpha) of a profile, and how far it is from Lambert's law under Fresnel's.

    Raises
    ------
    ProfileError
        The profile was computed without angles.
    """
    edges, energy = _angles_of(profile)
    total, solid = energy.sum(axis=0), solid_angles(edges)[:, None]
    mean = total / solid
    stderr = _stderr(profile, energy) / solid
    shares = lambertian_shares(edges, _relative_eta(profile))[:, None]
    diffuse = total.sum(axis=0)
    apart = 0.5 * np.abs(total - shares * diffuse).sum(axis=0)
    noise = 0.5 * np.sqrt(2.0 / np.pi) * (stderr * solid).sum(axis=0)  # E|x| of a normal x
    with np.errstate(invalid="ignore", divide="ignore"):
        found = (apart / diffuse, noise / diffuse)
    return AngularReflectance(profile, edges, mean, stderr, shares * diffuse / solid, *found)


def radiance(profile: Profile) -> FloatArray:
    """Return R_d(r, alpha) (n, A, C) [1/(mm^2 sr)], the mean radiance of each annulus and bin.

    Raises
    ------
    ProfileError
        The profile was computed without angles, or its annuli are not told apart.
    """
    edges, energy = _angles_of(profile)
    if len(energy) == 1:
        raise ProfileError("the profile has angles for all annuli together only.")
    areas = np.pi * np.diff(profile.r_edges_mm**2)
    projected = np.pi * np.diff(np.sin(edges) ** 2)  # int cos alpha dOmega
    return energy[:-1] / (areas[:, None, None] * projected[:, None])


def solid_angles(edges_rad: FloatArray) -> FloatArray:
    """Return the solid angles (A,) [sr] of bins of angles around the normal."""
    # cos a - cos b as a product, which does not cancel near the normal
    middle, half = 0.5 * (edges_rad[1:] + edges_rad[:-1]), 0.5 * np.diff(edges_rad)
    found: FloatArray = 4.0 * np.pi * np.sin(middle) * np.sin(half)
    return found


def lambertian_shares(edges_rad: FloatArray, eta: float) -> FloatArray:
    """Return the shares (A,) of light that a Lambertian medium sends out through its surface.

    In proportion to int cos alpha T(alpha) dOmega, with Fresnel's transmittance T through the
    surface of a medium of relative index ``eta``.
    """
    x, weight = gauss_legendre(_NODES)
    angle = edges_rad[:-1, None] + np.diff(edges_rad)[:, None] * x
    square = 1.0 - (np.sin(angle) / eta) ** 2  # of the cosine inside
    through = np.where(square > 0.0, fresnel_transmittance(np.sqrt(np.abs(square)), eta), 0.0)
    bins = (np.sin(2.0 * angle) * through) @ weight * np.diff(edges_rad)
    shares: FloatArray = bins / bins.sum()
    return shares


def directed_figures(profile: Profile) -> dict[str, Any]:
    """Return the figures of directions of ``sssfit show --json``; none without directions."""
    found: dict[str, Any] = {}
    if profile.outside_aperture is not None:
        found["numerical_aperture"] = profile.meta.get("settings", {}).get("numerical_aperture")
        found["outside_aperture"] = profile.outside_aperture
    if profile.angle_reflected is not None:
        found["exit_angles"] = angular_reflectance(profile).to_dict()["rows"]
    return found


def directed_shapes(fields: Mapping[str, Any]) -> dict[str, tuple[int, ...]]:
    """Return the expected shapes of the arrays by angle; those of one row keep it."""
    edges, energy = fields["exit_angle_edges_rad"], fields["annulus_energy"]
    if edges is None:
        return {}
    bins, channels = edges.size - 1, energy.shape[1]
    found: dict[str, tuple[int, ...]] = {"exit_angle_edges_rad": (bins + 1,)}
    for name, _ in _PAIRS:
        value = fields[name]
        rows = 1 if value is not None and value.shape[:1] == (1,) else len(energy) + 1
        found |= dict.fromkeys((name, f"{name}_stderr"), (rows, bins, channels))
    return found


def check_directions(fields: Mapping[str, Any]) -> None:
    """Raise ProfileError for angles that do not rise, lack a partner, or do not add up."""
    edges = fields["exit_angle_edges_rad"]
    given = [name for pair in _PAIRS for name in (pair[0], f"{pair[0]}_stderr")]
    given = [name for name in given if fields[name] is not None]
    if edges is None and given:
        raise ProfileError(f"{given[0]} is given without exit_angle_edges_rad.")
    if edges is None:
        return
    if edges.ndim != 1 or len(edges) < 2:
        raise ProfileError(f"exit_angle_edges_rad has shape {edges.shape}; expected (angles + 1,).")
    if edges[0] != 0.0 or (np.diff(edges) <= 0.0).any() or abs(edges[-1] - 0.5 * np.pi) > 1e-12:
        raise ProfileError("exit_angle_edges_rad; expected angles that rise from 0 to pi/2.")
    for name, whole in _PAIRS:
        value, error = fields[name], fields[f"{name}_stderr"]
        if (value is None) is not (error is None) or (value is None) is not (fields[whole] is None):
            raise ProfileError(f"{name}, its standard error and {whole} go together; one is not.")
        if value is not None and len(value) > 1:
            apart = np.abs(value[:-1].sum(axis=1) - fields[whole]).max()
            if apart > _ROUNDING:
                raise ProfileError(
                    f"{name} adds up to other energies than {whole}, by {apart:.2g}."
                )


def of_all_annuli(profile: Profile) -> dict[str, FloatArray]:
    """Return the fields of reflected light by angle as one row, of all annuli; none without."""
    if profile.angle_reflected is None:
        return {}
    energy, stderr = profile.angle_reflected.sum(axis=0), _stderr(profile, profile.angle_reflected)
    return {"angle_reflected": energy[None], "angle_reflected_stderr": stderr[None]}


def _angles_of(profile: Profile) -> tuple[FloatArray, FloatArray]:
    if profile.exit_angle_edges_rad is None or profile.angle_reflected is None:
        raise ProfileError(
            f"the profile of {profile.label} has no exit angles; a material's walk and its exact "
            "profile have them with `angles = 30`."
        )
    return profile.exit_angle_edges_rad, profile.angle_reflected


def _stderr(profile: Profile, energy: FloatArray) -> FloatArray:
    """Return the standard errors of sums over annuli (A, C); see `Profile.cumulative_stderr`."""
    stderr = profile.angle_reflected_stderr
    assert stderr is not None
    if profile.photons is None:
        variance = (stderr**2).sum(axis=0)
    else:
        more = profile.photons - 1
        square = (more * stderr**2 + energy**2).sum(axis=0)
        variance = np.maximum(square - energy.sum(axis=0) ** 2, 0.0) / max(more, 1)
    found: FloatArray = np.sqrt(variance)
    return found


def _relative_eta(profile: Profile) -> float:
    """Return the index of the top layer over that above; of an unknown material it is 1."""
    material = profile.material
    return 1.0 if material is None else material.layers[0].eta / material.eta_above
