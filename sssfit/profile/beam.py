"""Profiles under a beam of finite width, as the program conv makes them of those of MCML.

Light that enters at a point returns around that point: under a beam the profile is the convolution
of both. Wang, Jacques and Zheng 1997, "CONV - convolution for responses to a finite diameter photon
beam incident on multi-layered tissues", has it in polar coordinates (equations 9 to 18).
"""

import itertools
from dataclasses import dataclass, replace
from numbers import Real
from typing import Any

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import ArgumentError, ProfileError
from sssfit.messages import did_you_mean, shown
from sssfit.profile.checks import TOTAL_ERRORS
from sssfit.profile.pixels import flat_annuli
from sssfit.profile.record import Profile
from sssfit.profile.spreads import SPREADS
from sssfit.text import length_mm

_REACH = 2.5  # 1/e^2 radii of a Gaussian beam beyond which it has 4e-6 of its light
_NARROWEST, _WIDEST = 1e-9, 1e9  # mm
_MOST_MORE = 20_000  # annuli beyond the profile's own, 16 times those of skin1
_COLUMNS = 512  # annuli whose shares are held at once


@dataclass(frozen=True, slots=True)
class Beam:
    """Light that falls on the surface around the origin, of total 1.

    Parameters
    ----------
    kind : str
        "gaussian" or "flat".
    radius_mm : float [mm]
        Radius at which a Gaussian's irradiance has fallen to 1/e^2, as in conv, or of a flat disk.

    Raises
    ------
    ProfileError
        The kind is unknown, or the radius is out of range.
    """

    kind: str
    radius_mm: float

    def __post_init__(self) -> None:
        if self.kind not in SPREADS:
            raise ProfileError(f"kind = {shown(self.kind)}; expected {' or '.join(SPREADS)}.")
        is_number = isinstance(self.radius_mm, Real)
        if not (is_number and _NARROWEST <= self.radius_mm <= _WIDEST):
            raise ProfileError(
                f"radius_mm = {shown(self.radius_mm)}; expected {_NARROWEST:g} to {_WIDEST:g} mm."
            )
        object.__setattr__(self, "radius_mm", float(self.radius_mm))

    def __str__(self) -> str:
        return f"{self.kind}:{self.radius_mm:g}"

    @property
    def reach_mm(self) -> float:
        """How far it spreads light that would return at its point of entry."""
        return self.radius_mm * (_REACH if self.kind == "gaussian" else 1.0)


def parse_beam(text: str) -> Beam:
    """Return the beam of "gaussian:0.5" or "flat:500um", a kind and its radius, in mm without unit.

    Raises
    ------
    ProfileError
        The kind is unknown, or the radius is no length above 0.
    """
    kind, _, words = text.partition(":")
    if kind not in SPREADS:
        hint = did_you_mean(kind, list(SPREADS))
        raise ProfileError(
            f"a beam {shown(text)}: {hint}expected gaussian:RADIUS or flat:RADIUS in mm."
        )
    try:
        return Beam(kind, float(length_mm(words)))
    except (ArgumentError, ProfileError):
        raise ProfileError(
            f"a beam {shown(text)}; its radius is a length from {_NARROWEST:g} to {_WIDEST:g} mm, "
            "such as 0.5, 500um or 0.1cm."
        ) from None


def under_beam(profile: Profile, beam: Beam) -> Profile:
    """Return a profile under a beam, on its grid and as far beyond as the beam reaches.

    Light beyond the profile's grid stays beyond. Errors are of the same walk; estimates of
    other methods add up. Those of all light stay as they are, and ``meta`` records them. Errors by
    angle are those of a walk whose photons enter all over the beam, so that they can be added up
    over the annuli; within an annulus they are too large.

    Parameters
    ----------
    profile : Profile
        The profile under a pencil beam.
    beam : Beam

    Raises
    ------
    ProfileError
        The profile is under a beam already, or the beam reaches too many annuli.
    """
    if "beam" in profile.meta:
        raise ProfileError(f"the profile is under a beam already: {profile.meta['beam']}.")
    edges = wider_edges(profile.r_edges_mm, beam.reach_mm)
    sides = profile.annulus_energy, profile.annulus_energy_stderr, profile.beyond_grid
    energy, stderr, beyond = _spread(profile, edges, *sides, beam)
    found: dict[str, Any] = {
        "r_edges_mm": edges,
        "annulus_energy": energy,
        "annulus_energy_stderr": stderr,
        "beyond_grid": beyond,
        "meta": {**profile.meta, "beam": str(beam), **_total_errors(profile)},
    }
    if profile.annulus_transmittance is not None:
        found |= _below(profile, edges, beam)
    for name in ("angle_reflected", "angle_transmitted"):
        found |= _by_angle(profile, edges, name, beam)
    return replace(profile, **found)


def _total_errors(profile: Profile) -> dict[str, list[float]]:
    """Return the standard errors of all light of a walk on either side, for ``meta``."""
    if profile.photons is None:
        return {}
    errors = {name: getattr(profile, name) for name in TOTAL_ERRORS}
    return {
        name: own.tolist()
        for name, own in errors.items()
        if own is not None and np.isfinite(own).all()
    }


def _below(profile: Profile, edges: FloatArray, beam: Beam) -> dict[str, FloatArray | None]:
    """Return the light that leaves through the bottom; what is unknown of it stays so."""
    energy, stderr = profile.annulus_transmittance, profile.annulus_transmittance_stderr
    beyond = profile.beyond_grid_transmittance
    assert energy is not None
    known = np.full(energy.shape, np.nan) if stderr is None else stderr
    outside = np.zeros(energy.shape[1]) if beyond is None else beyond
    found, error, left = _spread(profile, edges, energy, known, outside, beam)
    return {
        "annulus_transmittance": found,
        "annulus_transmittance_stderr": None if stderr is None else error,
        "beyond_grid_transmittance": None if beyond is None else left,
    }


def _by_angle(profile: Profile, edges: FloatArray, name: str, beam: Beam) -> dict[str, FloatArray]:
    """Return energies by angle; within an annulus all angles are spread like their sum."""
    energy, stderr = getattr(profile, name), getattr(profile, f"{name}_stderr")
    if energy is None or len(energy) == 1:
        return {}
    bins, channels = energy.shape[1:]
    flat = [each.reshape(len(energy), -1) for each in (energy, stderr)]
    whole = profile.annulus_energy if name == "angle_reflected" else profile.annulus_transmittance
    sides = flat[0][:-1], flat[1][:-1], flat[0][-1]
    found, error, left = _spread(profile, edges, *sides, beam, whole=whole)
    shape = (len(edges), bins, channels)
    values = {name: (found, left), f"{name}_stderr": (error, flat[1][-1])}
    return {key: np.vstack(each).reshape(shape) for key, each in values.items()}


def wider_edges(edges: FloatArray, reach_mm: float) -> FloatArray:
    """Return edges, continued by annuli as wide as the last until they reach so much farther.

    Raises
    ------
    ProfileError
        There would be too many.
    """
    width = float(edges[-1] - edges[-2])
    count = int(np.ceil(reach_mm / width))
    if count > _MOST_MORE:
        raise ProfileError(
            f"a beam that reaches {reach_mm:g} mm takes {count:,} more annuli {width:.4g} mm wide, "
            f"and {_MOST_MORE:,} is the limit; use wider annuli or a narrower beam."
        )
    return np.concatenate((edges, edges[-1] + width * np.arange(1, count + 1)))


def _spread(
    profile: Profile,
    wider: FloatArray,
    energy: FloatArray,
    stderr: FloatArray,
    beyond: FloatArray,
    beam: Beam,
    *,
    whole: FloatArray | None = None,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return energies (m, C) in wider annuli, their standard errors, and what is beyond (C,).

    Of energies that are parts of a ``whole``, this says how they lie within an annulus.
    """
    edges, photons = profile.r_edges_mm, profile.photons
    square = _squares(energy, stderr, photons)
    power = 2 if photons is not None and whole is None else 1  # one photon a place, by angle
    fine, densities = flat_annuli(edges, energy if whole is None else whole)
    areas = np.pi * np.diff(fine**2)
    annulus = np.searchsorted(edges[1:-1], fine[:-1], side="right")
    fine_energy = densities * areas[:, None]
    if whole is not None:
        of_annulus = np.where(whole > 0.0, whole, 1.0)[annulus]
        times = energy.shape[1] // whole.shape[1]
        fine_energy = energy[annulus] * np.tile(fine_energy / of_annulus, times)
    part = areas / np.bincount(annulus, areas)[annulus]  # of its annulus
    found = np.zeros((len(wider) - 1, energy.shape[1]))
    error = np.zeros_like(found)
    ends = np.searchsorted(annulus, np.arange(0, len(energy) + _COLUMNS, _COLUMNS))
    for begin, end in itertools.pairwise(ends):
        within = SPREADS[beam.kind](wider, fine[begin : end + 1], beam.radius_mm)
        shares = np.diff(within, axis=0)
        found += shares @ fine_energy[begin:end]
        firsts = np.flatnonzero(np.diff(annulus[begin:end], prepend=-1))
        of_annuli = np.add.reduceat(shares * part[begin:end], firsts, axis=1)
        error += of_annuli**power @ square[annulus[begin:end][firsts]]
    if energy.min() >= 0.0:  # rounding, 1e-13 of the total, would give negative light
        found = np.maximum(found, 0.0)
    left = beyond + energy.sum(axis=0) - found.sum(axis=0)
    if (beyond >= 0.0).all():
        left = np.maximum(left, 0.0)
    return found, _errors(error, found, stderr, photons), left


def _squares(energy: FloatArray, stderr: FloatArray, photons: int | None) -> FloatArray:
    """Return what a spread adds up: of a walk the mean squares of its photons, else the errors."""
    return stderr if photons is None else (photons - 1) * stderr**2 + energy**2


def _errors(
    spread: FloatArray, energy: FloatArray, stderr: FloatArray, photons: int | None
) -> FloatArray:
    """Return the errors of a spread; estimates of a total keep theirs.

    A photon lands in one annulus, so that annuli are anticorrelated; see
    `Profile.cumulative_stderr`. Estimates of other methods are alike in neighbours, and add up.
    """
    if photons is not None:
        return np.sqrt(np.maximum(spread - energy**2, 0.0) / (photons - 1))
    before, after = (np.sqrt((each**2).sum(axis=0)) for each in (stderr, spread))
    scale = np.divide(before, after, out=np.ones_like(after), where=after > 0.0)
    found: FloatArray = np.maximum(spread, 0.0) * scale  # rounding, as of the energy
    return found
