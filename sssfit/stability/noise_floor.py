"""The noise floor of a walk: how noisy its 2D kernel is, and which rank lies above that."""

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.profile import Profile
from sssfit.profile.pixels import annulus_areas

_MOST_RANK = 16
_DISK = 1.0 / np.sqrt(np.pi)  # radius of a disk of one pixel's area, in pixels


def noise_ratio(profile: Profile, mm_per_pixel: float) -> FloatArray:
    """Return the noise of the 2D kernel over the kernel, by Frobenius norms (C,).

    Annuli are gathered into a disk of one pixel's area and rings of a pixel's width around it,
    whose errors add up in squares. A ring of energy E on the area A puts E p^2 / A into each of its
    A / p^2 pixels, all with one error, so the square of the norm is p^2 sum E^2 / A, of the noise
    as of the kernel. With the true parts of pixels both ratios differ by at most 4 % (skin1, .15 to
    1.2 mm); with rings from 0, p, 2 p on they differed by 20 %. Under a beam annuli share photons,
    and the error of a ring is at most the sum of theirs: an upper limit.
    """
    edges_mm = profile.r_edges_mm
    middle_pixels = 0.5 * (edges_mm[1:] + edges_mm[:-1]) / mm_per_pixel
    rings = np.floor(middle_pixels + 1.0 - _DISK).astype(np.intp)
    shape = rings[-1] + 1, len(profile.channels)
    variance, energy = np.zeros(shape), np.zeros(shape)
    power = 1 if profile.shares_photons else 2
    np.add.at(variance, rings, np.nan_to_num(profile.annulus_energy_stderr) ** power)
    variance **= 2 // power
    np.add.at(energy, rings, profile.annulus_energy)
    outer = np.arange(rings[-1] + 1) + _DISK
    areas = annulus_areas(mm_per_pixel * np.concatenate(([0.0], outer)))[:, None]
    noise, whole = (variance / areas).sum(axis=0), (energy**2 / areas).sum(axis=0)
    ratio: FloatArray = np.sqrt(noise / np.where(whole > 0.0, whole, 1.0))
    return ratio


def rank_of_noise(profile: Profile, mm_per_pixel: float, half_pixels: int) -> int | None:
    """Return the rank whose residual is no larger than the noise, in the channel that needs most.

    None where the profile has no standard errors, or no rank up to 16 comes that near.
    """
    from sssfit.fit._target import Target  # scipy's linear algebra, which exports do not need
    from sssfit.fit.svd import eigenpairs

    if profile.photons is None:
        return None
    noise, needed = noise_ratio(profile, mm_per_pixel), []
    target = Target(profile, mm_per_pixel, half_pixels)
    for c in np.flatnonzero(profile.annulus_energy.any(axis=0)):
        quadrant = target.quadrant(int(c))
        values, _ = eigenpairs(quadrant, min(_MOST_RANK, len(quadrant)))
        whole = target.copies @ quadrant**2 @ target.copies
        left = np.sqrt(np.maximum(1.0 - np.cumsum(values**2) / whole, 0.0))
        enough = np.flatnonzero(left <= noise[c])
        if enough.size == 0:
            return None
        needed.append(int(enough[0]) + 1)
    return max(needed, default=None)
