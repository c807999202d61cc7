"""The response of a medium to a sinusoid of light: R(k), the Hankel transform of its profile.

R(k) = 2 pi int R_d(r) J0(k r) r dr is the amplitude of what returns under light that varies as
cos(k x); R(0) is the diffuse reflectance. k is in radians per mm: a pattern of f cycles per mm, as
in spatial frequency domain imaging, has k = 2 pi f.

Annuli are cut into flat parts as the integrals over pixels cut them (``sssfit.profile.pixels``), of
which the transform has a closed form.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray, check_record, number_array, plain
from sssfit.errors import ProfileError
from sssfit.profile.pixels import flat_annuli
from sssfit.profile.record import Profile

_PER_DECADE = 24
_LOWEST = 0.05  # of the inverse radius that 90 % of the widest channel's light is within
_AT_ONCE = 4e6  # numbers of an array of waves: 32 MB


@dataclass(frozen=True, slots=True, eq=False)
class FrequencyResponse:
    """R(k) of a profile.

    Parameters
    ----------
    profile : Profile
    k_per_mm : array (K,) [rad/mm]
    response : array (K, C) [1]
        Light beyond the profile's grid counts at k = 0 only.
    stderr : array (K, C) [1]
        Its standard error; nan where the annuli have none.
    """

    profile: Profile
    k_per_mm: FloatArray
    response: FloatArray
    stderr: FloatArray

    def to_dict(self) -> dict[str, Any]:
        """Return a row for each frequency."""
        columns = (self.k_per_mm, self.response, self.stderr)
        keys = ("k_per_mm", "response", "stderr")
        rows = [dict(zip(keys, row, strict=True)) for row in zip(*columns, strict=True)]
        made_of, names = self.profile.material_name, self.profile.channels
        return plain({"material": made_of, "channels": names, "rows": rows})


def frequency_response(
    profile: Profile, k_per_mm: npt.ArrayLike | None = None
) -> FrequencyResponse:
    """Compute R(k) from a profile's energies.

    A flat part of an annulus, from a to b, holds [2 / k (b J1(k b) - a J1(k a))] / (b^2 - a^2) of
    its energy at k. The parts, 64 for each of the first ten annuli and then fewer, are those that
    `Profile.quadrant_kernel` integrates. Standard errors are of whole annuli, taken as flat.

    Parameters
    ----------
    profile : Profile
    k_per_mm : array (K,), optional [rad/mm]
        From 0 up; by default 0, and 24 a decade from where R(k) begins to fall to the inverse of
        the first annulus.

    Raises
    ------
    ProfileError
        A frequency is no number, negative or not finite.
    """
    check_record("profile", profile, Profile, ProfileError)
    given = _frequencies(profile) if k_per_mm is None else k_per_mm
    k = np.atleast_1d(number_array("k_per_mm", given, ProfileError))
    if k.ndim != 1 or not (np.isfinite(k).all() and (k >= 0.0).all()):
        raise ProfileError("k_per_mm holds a frequency that is not a number from 0 up.")
    edges, densities = flat_annuli(profile.r_edges_mm, profile.annulus_energy)
    energy = densities * (np.pi * np.diff(edges**2))[:, None]
    response = _summed(k, edges, energy)
    variance = _variance(profile, k)
    still = k == 0.0
    response[still] = profile.diffuse_reflectance
    stderr = np.sqrt(variance)
    stderr[still] = profile.diffuse_reflectance_stderr
    return FrequencyResponse(profile, k, response, stderr)


def _variance(profile: Profile, k: FloatArray) -> FloatArray:
    """Return the variance of R(k); annuli of a walk are anticorrelated.

    As `Profile.cumulative_stderr`: of N photons, mean squares add up, less the square of the mean.
    Unknown under a beam.
    """
    stderr, edges, photons = profile.annulus_energy_stderr, profile.r_edges_mm, profile.photons
    if photons is None:
        return _summed(k, edges, stderr**2, squared=True)
    if profile.shares_photons:
        return np.full((len(k), profile.n_channels), np.nan)
    squares = (photons - 1) * stderr**2 + profile.annulus_energy**2
    mean = _summed(k, edges, profile.annulus_energy)
    found = _summed(k, edges, squares, squared=True) - mean**2
    variance: FloatArray = np.maximum(found, 0.0) / (photons - 1)
    return variance


def annulus_waves(k: FloatArray, edges: FloatArray) -> FloatArray:
    """Return the share (K, n) of the energy of flat annuli that a frequency has; 1 at k = 0."""
    from scipy import special

    with np.errstate(divide="ignore", invalid="ignore"):
        parts = 2.0 * edges * special.j1(k[:, None] * edges) / k[:, None]
    parts = np.where(k[:, None] == 0.0, edges**2, parts)
    waves: FloatArray = np.diff(parts, axis=1) / np.diff(edges**2)
    return waves


def _summed(
    k: FloatArray, edges: FloatArray, values: FloatArray, *, squared: bool = False
) -> FloatArray:
    """Return waves, or their squares, times values (n, C), in blocks of frequencies."""
    found = np.empty((len(k), values.shape[1]))
    step = max(1, int(_AT_ONCE / len(edges)))
    for begin in range(0, len(k), step):
        waves = annulus_waves(k[begin : begin + step], edges)
        found[begin : begin + step] = (waves**2 if squared else waves) @ values
    return found


def _frequencies(profile: Profile) -> FloatArray:
    """Return 0, and frequencies from where the response begins to fall."""
    radii = profile.energy_radii_mm([0.9])[0]
    known = radii[np.isfinite(radii) & (radii > 0.0)]
    widest = float(known.max()) if len(known) else float(profile.r_edges_mm[-1])
    ends = np.log10([_LOWEST / widest, 1.0 / float(profile.r_edges_mm[1])])
    count = max(2, round(_PER_DECADE * float(ends[1] - ends[0])) + 1)
    return np.concatenate(([0.0], np.logspace(float(ends[0]), float(ends[1]), count)))
