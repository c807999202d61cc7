"""Profiles under a beam of finite width, as the program conv makes them of those of MCML.

Light that enters at a point returns around that point: under a beam the profile is the convolution
of both. Wang, Jacques and Zheng 1997, "CONV - convolution for responses to a finite diameter photon
beam incident on multi-layered tissues", has it in polar coordinates (equations 9 to 18).
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from numbers import Real
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray, check_record
from sssfit.errors import ArgumentError, ProfileError
from sssfit.messages import did_you_mean, shown
from sssfit.profile.checks import TOTAL_ERRORS
from sssfit.profile.pixels import cumulative_at, flat_annuli
from sssfit.profile.record import Profile
from sssfit.profile.spreads import SPREADS
from sssfit.text import length_mm

_REACH = 2.5  # 1/e^2 radii of a Gaussian beam beyond which it has 4e-6 of its light
_NARROWEST, _WIDEST = 1e-9, 1e9  # mm
_MOST_MORE = 20_000  # annuli beyond the profile's own, 16 times those of skin1
_COLUMNS = 512  # annuli whose shares are held at once
# Of differences to annuli twice as wide: 28 beams on skin1 and marble were off by less,
# where that is over 1e-5 of the light.
_OF_LIGHT, _OF_EFFECT = 0.25, 2.0


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


class _Side(NamedTuple):
    """Energies (n, C) by annulus, their errors, and what is beyond (C,).

    Of energies that are parts of a ``whole``, this says how they lie within an annulus.
    """

    energy: FloatArray
    stderr: FloatArray
    beyond: FloatArray
    whole: FloatArray | None = None


def parse_beam(text: str) -> Beam:
    """Return the beam of "gaussian:0.5" or "flat:500um", a kind and its radius, in mm without unit.

    Raises
    ------
    ProfileError
        The kind is unknown, or the radius is no length above 0.
    """
    kind, _, words = text.partition(":") if isinstance(text, str) else ("", "", "")
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
    other methods add up, and contain how little annuli tell of the light within them. Those of
    all light stay as they are, and ``meta`` records them. Errors by angle are those of a walk
    whose photons enter all over the beam, so that they can be added up over the annuli; within an
    annulus they are too large.

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
    check_record("profile", profile, Profile, ProfileError)
    check_record("beam", beam, Beam, ProfileError)
    if "beam" in profile.meta:
        raise ProfileError(f"the profile is under a beam already: {profile.meta['beam']}.")
    edges = wider_edges(profile.r_edges_mm, beam.reach_mm)
    sides = _sides(profile)
    found: dict[str, Any] = {
        "r_edges_mm": edges,
        "meta": {**profile.meta, "beam": str(beam), **_total_errors(profile)},
    }
    for name, each in zip(sides, _spread(profile, edges, list(sides.values()), beam), strict=True):
        found |= _fields(profile, name, each)
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


def _sides(profile: Profile) -> dict[str, _Side]:
    """Return all energies by annulus, by the names of their fields."""
    found = {
        "annulus_energy": _Side(
            profile.annulus_energy, profile.annulus_energy_stderr, profile.beyond_grid
        )
    }
    through, stderr = profile.annulus_transmittance, profile.annulus_transmittance_stderr
    if through is not None:
        beyond = profile.beyond_grid_transmittance
        found["annulus_transmittance"] = _Side(
            through,
            np.full(through.shape, np.nan) if stderr is None else stderr,
            np.zeros(through.shape[1]) if beyond is None else beyond,
        )
    wholes = {"angle_reflected": profile.annulus_energy, "angle_transmitted": through}
    for name, whole in wholes.items():
        energy, error = getattr(profile, name), getattr(profile, f"{name}_stderr")
        if energy is not None and len(energy) > 1:
            flat = [each.reshape(len(energy), -1) for each in (energy, error)]
            found[name] = _Side(flat[0][:-1], flat[1][:-1], flat[0][-1], whole)
    return found


def _fields(profile: Profile, name: str, spread: _Side) -> dict[str, FloatArray | None]:
    """Return the fields of a profile that hold a side; what was unknown of it stays so."""
    energy, stderr, beyond, _ = spread
    if name == "annulus_energy":
        return {name: energy, f"{name}_stderr": stderr, "beyond_grid": beyond}
    before = getattr(profile, f"{name}_stderr")
    if name == "annulus_transmittance":
        is_known = profile.beyond_grid_transmittance is not None
        return {
            name: energy,
            f"{name}_stderr": None if before is None else stderr,
            "beyond_grid_transmittance": beyond if is_known else None,
        }
    shape = (len(energy) + 1, *before.shape[1:])
    rows = {name: (energy, beyond), f"{name}_stderr": (stderr, before[-1].ravel())}
    return {key: np.vstack(each).reshape(shape) for key, each in rows.items()}


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


def _spread(profile: Profile, wider: FloatArray, sides: Sequence[_Side], beam: Beam) -> list[_Side]:
    """Return sides in wider annuli, with their errors; the rest is beyond."""
    edges, photons = profile.r_edges_mm, profile.photons
    sums = _sums(edges, profile.annulus_energy, photons, wider, sides, beam)
    found = [_with_rest(*each, photons) for each in zip(sides, *sums, strict=True)]
    if photons is not None:  # whose noise is larger
        return found
    pairs = [_of_pairs(edges, *each, wider, beam) for each in zip(sides, found, strict=True)]
    return [
        side._replace(stderr=np.hypot(side.stderr, each))
        for side, each in zip(found, pairs, strict=True)
    ]


def _of_pairs(
    edges: FloatArray, side: _Side, spread: _Side, wider: FloatArray, beam: Beam
) -> FloatArray:
    """Return the errors of how light lies within annuli, from what pairs of them make of it.

    The smaller of what the light differs by, where a beam is wide, and what the beam's effect on it
    does, where it is narrow.
    """
    firsts = np.arange(0, len(edges) - 1, 2)
    in_pairs, energy = np.append(edges[firsts], edges[-1]), np.add.reduceat(side.energy, firsts)
    light = _Side(energy, np.zeros_like(energy), side.beyond)
    apart = _sums(in_pairs, energy, None, wider, [light], beam)[0][0] - spread.energy
    pencils = [
        cumulative_at(ends, own, wider) for ends, own in ((in_pairs, energy), (edges, side.energy))
    ]
    effects = apart - np.diff(pencils[0] - pencils[1], axis=0)
    found: FloatArray = np.minimum(_OF_LIGHT * np.abs(apart), _OF_EFFECT * np.abs(effects))
    return found


def _sums(
    edges: FloatArray,
    energy: FloatArray,
    photons: int | None,
    wider: FloatArray,
    sides: Sequence[_Side],
    beam: Beam,
) -> tuple[list[FloatArray], list[FloatArray]]:
    """Return energies of sides in wider annuli, and sums of errors, from those between ``edges``.

    Where a beam takes an annulus' light is found once for all of them.
    """
    fine = flat_annuli(edges, energy)[0]
    areas = np.pi * np.diff(fine**2)
    annulus = np.searchsorted(edges[1:-1], fine[:-1], side="right")
    part = areas / np.bincount(annulus, areas)[annulus]  # of its annulus
    sources = [_in_parts(each, edges, areas, annulus) for each in sides]
    squares = [_squares(each.energy, each.stderr, photons) for each in sides]
    found = [np.zeros((len(wider) - 1, each.energy.shape[1])) for each in sides]
    error = [np.zeros_like(each) for each in found]
    ends = np.searchsorted(annulus, np.arange(0, len(edges) - 1 + _COLUMNS, _COLUMNS))
    for begin, end in itertools.pairwise(ends):
        within = SPREADS[beam.kind](wider, fine[begin : end + 1], beam.radius_mm)
        shares = np.diff(within, axis=0)
        firsts = np.flatnonzero(np.diff(annulus[begin:end], prepend=-1))
        of_annuli = np.add.reduceat(shares * part[begin:end], firsts, axis=1)
        for k, side in enumerate(sides):
            # A photon leaves at one place, but by angle as one of many over the whole beam.
            power = 2 if photons is not None and side.whole is None else 1
            found[k] += shares @ sources[k][begin:end]
            error[k] += of_annuli**power @ squares[k][annulus[begin:end][firsts]]
    return found, error


def _in_parts(
    side: _Side, edges: FloatArray, areas: FloatArray, annulus: npt.NDArray[np.intp]
) -> FloatArray:
    """Return the energy of the flat parts of annuli, by their area and annulus."""
    whole = side.energy if side.whole is None else side.whole
    energy = flat_annuli(edges, whole)[1] * areas[:, None]
    if side.whole is None:
        return energy
    of_annulus = np.where(whole > 0.0, whole, 1.0)[annulus]
    times = side.energy.shape[1] // whole.shape[1]
    found: FloatArray = side.energy[annulus] * np.tile(energy / of_annulus, times)
    return found


def _with_rest(side: _Side, found: FloatArray, error: FloatArray, photons: int | None) -> _Side:
    """Return a side from its energies and sums of errors in wider annuli; the rest is beyond."""
    if side.energy.min() >= 0.0:  # rounding, 1e-13 of the total, would give negative light
        found = np.maximum(found, 0.0)
    left = side.beyond + side.energy.sum(axis=0) - found.sum(axis=0)
    if (side.beyond >= 0.0).all():
        left = np.maximum(left, 0.0)
    return _Side(found, _errors(error, found, side.stderr, photons), left)


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
