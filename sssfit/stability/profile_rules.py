"""Rules of a kernel beside its profile: noise, light beyond the grid, gaps and coarse annuli."""

import numpy as np

from sssfit.kernel import Taps
from sssfit.messages import counted
from sssfit.stability.facts import Facts
from sssfit.stability.noise_floor import rank_of_noise

_TAIL = 1e-3  # of the energy: gaps beyond it are where a walk saw nothing


def rank_in_noise(facts: Facts, limit: float) -> str:
    """Name a rank whose last terms are smaller than the noise."""
    kernel, profile = facts.kernel, facts.profile
    if profile is None or isinstance(kernel, Taps) or kernel.method != "svd" or kernel.rank == 1:
        return ""
    if facts.is_smoothed:  # what is left of the noise is not known
        return ""
    enough = rank_of_noise(profile, kernel.mm_per_pixel, kernel.half_pixels)
    if enough is None or kernel.rank <= enough * limit:
        return ""
    return (
        f"rank {kernel.rank} lies under this profile's noise floor: rank {enough} is as good; more "
        "photons or the exact method would help"
    )


# Where noise adds a Delta E of 1 to skin1: photons by the stress, as `noise_ratio` of those walks.
_NOISE_LIMITS = {
    "artist": 0.061,
    "preintegrated": 0.052,
    "guided": 0.052,
    "svd": 0.025,
    "gaussians": 0.0125,
    "cascade": 0.0375,
}
# The same of smoothed walks, for the methods that smoothing helps.
_SMOOTHED_LIMITS = {"preintegrated": 0.068, "svd": 0.05}


def too_few_photons(facts: Facts, limit: float) -> str:
    """Name a walk whose noise adds a Delta E of 1."""
    method, noise = facts.kernel.method, facts.noise
    if noise is None or method not in _NOISE_LIMITS:
        return ""
    plain = _NOISE_LIMITS[method]
    of_smoothed = _SMOOTHED_LIMITS.get(method, plain)
    most = of_smoothed if facts.is_smoothed else plain
    if not noise.max() > limit * most:
        return ""
    assert facts.profile is not None
    photons = facts.profile.photons or 0
    wanted = photons * float(noise.max() / most) ** 2
    smooth = "a smoothed profile, " if most < noise.max() <= of_smoothed else ""
    return (
        f"{counted(photons, 'photon', ',')} leave noise of {100.0 * noise.max():.2g} % in the "
        f"kernel, more than a Delta E of 1 by {facts.kernel.method}; {smooth}about {wanted:.1g} "
        "photons or the exact method would do"
    )


def light_beyond(facts: Facts, limit: float) -> str:
    """Name light that the grid does not hold."""
    profile = facts.profile
    if profile is None:
        return ""
    whole = profile.diffuse_reflectance
    share = np.divide(profile.beyond_grid, whole, out=np.zeros_like(whole), where=whole > 0.0)
    if not share.max() > limit:
        return ""
    c = int(share.argmax())
    return (
        f"{100.0 * share[c]:.2g} % of channel {profile.channels[c]}'s light lies beyond the "
        f"profile's {profile.r_edges_mm[-1]:.4g} mm, and no kernel has its place; simulate a "
        "larger radius"
    )


def gaps(facts: Facts, limit: float) -> str:
    """Name annuli without light before light."""
    profile = facts.profile
    if profile is None or profile.photons is not None:  # a walk has empty annuli by chance
        return ""
    cumulative = profile.cumulative[1:]
    inside = cumulative < (1.0 - _TAIL) * cumulative[-1]
    empty = inside & (profile.annulus_energy == 0.0)
    share = empty.sum(axis=0) / np.maximum(inside.sum(axis=0), 1)
    if not share.max() > limit:
        return ""
    c = int(share.argmax())
    return (
        f"{100.0 * share[c]:.2g} % of channel {profile.channels[c]}'s annuli hold no light, with "
        "light farther out: gaps in the data show as rings; fill them first"
    )


def coarse_annuli(facts: Facts, limit: float) -> str:
    """Name annuli too wide for the narrowest Gaussians."""
    profile = facts.profile
    if profile is None or facts.kernel.method not in ("gaussians", "gaussian-chain"):
        return ""
    ratio = float(profile.r_edges_mm[1]) / facts.kernel.mm_per_pixel
    if not ratio > limit:
        return ""
    return (
        f"the first annulus is {ratio:.2g} pixels wide, and the narrowest Gaussians depend on it; "
        "use finer annuli"
    )
