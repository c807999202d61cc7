"""Rules that warn of fits beyond where they are safe, each with the stress that found its limit.

`doubts` applies them to a kernel and its profile. A rule looks at `Facts` and returns what is
beyond its limit, in words, or nothing; what is unknown warns of nothing.
"""

import math
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import FitError, SssfitWarning
from sssfit.kernel import Kernel, Taps
from sssfit.messages import counted
from sssfit.profile import Profile
from sssfit.profile.pixels import annulus_areas

_ROUND_PIXELS = 4  # from which circle on asymmetry is told from the squareness of pixels
_TAIL = 1e-3  # of the energy: gaps beyond it are where a walk saw nothing


@dataclass(frozen=True, slots=True, eq=False)
class Facts:
    """What rules look at.

    Parameters
    ----------
    kernel : SeparableKernel or Taps
    profile : Profile, optional
        What it was fitted to, where it is known.
    """

    kernel: Kernel
    profile: Profile | None

    @property
    def settings(self) -> Mapping[str, Any]:
        """The settings of the fit."""
        settings: Mapping[str, Any] = self.kernel.meta.get("settings") or {}
        return settings

    @property
    def noise(self) -> FloatArray | None:
        """`noise_ratio` of the profile on the kernel's pixels (C,); None where nothing is noisy."""
        if self.profile is None or self.profile.photons is None:
            return None
        return noise_ratio(self.profile, self.kernel.mm_per_pixel)


@dataclass(frozen=True, slots=True)
class Rule:
    """A limit of a method.

    Parameters
    ----------
    name : str
    stress : str
        The one that found the limit: a name of ``sssfit.methods.STRESSES``.
    limit : float
    look : callable
        Takes the facts and the limit; returns what is wrong and what to do, or "".
    """

    name: str
    stress: str
    limit: float
    look: Callable[[Facts, float], str]


def doubts(kernel: Kernel, profile: Profile | None = None) -> list[str]:
    """Return a sentence for each rule that a kernel breaks.

    Parameters
    ----------
    kernel : SeparableKernel or Taps
    profile : Profile, optional
        What it was fitted to; without it only rules of the kernel alone are looked at.
    """
    facts = Facts(kernel, profile)
    found = ((each, each.look(facts, each.limit)) for each in RULES)
    return [f"{words} (stress {rule.stress})." for rule, words in found if words]


def warn_of_doubts(
    kernel: Kernel | Profile, profile: Profile | None = None, *, strict: bool = False
) -> None:
    """Warn of every rule that a kernel breaks, or with ``strict`` raise an error that names them.

    A profile alone breaks none.

    Raises
    ------
    FitError
        ``strict`` is set, and there is a doubt.

    Warns
    -----
    SssfitWarning
        One for each doubt.
    """
    found = [] if isinstance(kernel, Profile) else doubts(kernel, profile)
    if strict and found:
        raise FitError(f"{' '.join(found)} Without `strict` the kernel is written all the same.")
    for each in found:
        warnings.warn(f"{each[:1].upper()}{each[1:]}", SssfitWarning, stacklevel=2)


def noise_ratio(profile: Profile, mm_per_pixel: float) -> FloatArray:
    """Return the noise of the 2D kernel over the kernel, by Frobenius norms (C,).

    Annuli are gathered into rings of a pixel's width, whose errors add up in squares. A ring of
    energy E on the area A puts E p^2 / A into each of its A / p^2 pixels, all with one error, so
    the square of the norm is p^2 sum E^2 / A, of the noise as of the kernel.
    """
    edges_mm = profile.r_edges_mm
    rings = np.floor(edges_mm[:-1] / mm_per_pixel * (1.0 + 1e-12)).astype(np.intp)
    shape = rings[-1] + 1, len(profile.channels)
    variance, energy = np.zeros(shape), np.zeros(shape)
    np.add.at(variance, rings, np.nan_to_num(profile.annulus_energy_stderr) ** 2)
    np.add.at(energy, rings, profile.annulus_energy)
    areas = annulus_areas(mm_per_pixel * np.arange(rings[-1] + 2))[:, None]
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


_MOST_RANK = 16


def _rank_in_noise(facts: Facts, limit: float) -> str:
    kernel, profile = facts.kernel, facts.profile
    if profile is None or isinstance(kernel, Taps) or kernel.method != "svd" or kernel.rank == 1:
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
    "artist": 0.054,
    "preintegrated": 0.046,
    "guided": 0.046,
    "svd": 0.022,
    "gaussians": 0.011,
    "cascade": 0.033,
}


def _too_few_photons(facts: Facts, limit: float) -> str:
    noise, most = facts.noise, _NOISE_LIMITS.get(facts.kernel.method)
    if noise is None or most is None or not noise.max() > limit * most:
        return ""
    assert facts.profile is not None
    photons = facts.profile.photons or 0
    wanted = photons * float(noise.max() / most) ** 2
    return (
        f"{counted(photons, 'photon', ',')} leave noise of {100.0 * noise.max():.2g} % in the "
        f"kernel, more than a Delta E of 1 by {facts.kernel.method}; about {wanted:.1g} photons or "
        "the exact method would do"
    )


def _light_beyond(facts: Facts, limit: float) -> str:
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


def _gaps(facts: Facts, limit: float) -> str:
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


def _coarse_annuli(facts: Facts, limit: float) -> str:
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


def _not_round(facts: Facts, limit: float) -> str:
    kernel = facts.kernel
    if isinstance(kernel, Taps) or kernel.method != "svd" or kernel.rank >= limit:
        return ""
    if kernel.half_pixels < _ROUND_PIXELS:  # a few pixels are square in any case
        return ""
    return (
        f"a point of light becomes a cross or a diamond by {counted(kernel.rank, 'term')}, with "
        f"over a tenth of asymmetry; {limit:.0f} terms or a cascade show a disk"
    )


def _guide_b(facts: Facts, limit: float) -> str:
    b = facts.settings.get("b")
    if facts.kernel.method != "guided" or not isinstance(b, int | float):
        return ""
    if abs(math.log2(b / 50.0)) <= limit:
        return ""
    return (
        f"b = {b:g} changes points of light by more than a Delta E of 1 from b = 50, as nearly a "
        "factor of 2 does; keep b near 50"
    )


def _crawling(facts: Facts, limit: float) -> str:
    kernel = facts.kernel
    if not isinstance(kernel, Taps) or not kernel.chained or facts.settings.get("still"):
        return ""
    before = sum(each.level == 0 for each in kernel.stages)
    if before >= limit or kernel.stages[-1].level == 0:
        return ""
    return (
        f"light may crawl as the camera moves, with {counted(before, 'stage')} before the first "
        f"halving; {limit:.0f} stages do not show it, and `still` weighs it in"
    )


def _few_taps(facts: Facts, limit: float) -> str:
    kernel = facts.kernel
    if not isinstance(kernel, Taps) or kernel.chained or kernel.is_disk:
        return ""
    fetches = min(2 * len(each.offsets_mm) + 1 for each in kernel.stages)
    if fetches >= limit:
        return ""
    return (
        f"{fetches} taps a pass take points of light apart for every method; take {limit:.0f} or "
        "more, or a cascade of as many fetches"
    )


RULES = (
    Rule("rank-in-noise", "noise", 1.0, _rank_in_noise),
    Rule("few-photons", "noise", 1.0, _too_few_photons),
    Rule("light-beyond", "optics", 1e-3, _light_beyond),
    Rule("gaps", "imports", 0.03, _gaps),
    Rule("coarse-annuli", "grid", 0.4, _coarse_annuli),
    Rule("not-round", "hard-light", 3.0, _not_round),
    Rule("guide-b", "guided", 0.9, _guide_b),
    Rule("crawling", "motion", 2.0, _crawling),
    Rule("few-taps", "taps", 17.0, _few_taps),
)
