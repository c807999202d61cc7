"""Profile to kernel: one method, one file, one signature ``fit_x(profile, ...) -> FitResult``.

``METHODS`` has them by the names of the command line. Every ``fit_x`` takes a profile and
``mm_per_pixel`` (0.3 by default), ``support_mm`` and ``normalize`` by keyword, beside settings of
its own.
"""

from collections.abc import Callable
from dataclasses import dataclass

from sssfit.fit._result import FitResult
from sssfit.fit._target import MM_PER_PIXEL, Pitch, make_target, pitch_of, support_of
from sssfit.fit.artist import fit_artist
from sssfit.fit.burley import fit_burley
from sssfit.fit.falloff import fit_falloff
from sssfit.fit.gaussians import fit_gaussians
from sssfit.fit.guided import fit_guided
from sssfit.fit.preintegrated import fit_preintegrated
from sssfit.fit.svd import fit_svd

__all__ = [
    "METHODS",
    "MM_PER_PIXEL",
    "FitMethod",
    "FitResult",
    "Pitch",
    "fit_artist",
    "fit_burley",
    "fit_falloff",
    "fit_gaussians",
    "fit_guided",
    "fit_preintegrated",
    "fit_svd",
    "make_target",
    "pitch_of",
    "support_of",
]


@dataclass(frozen=True, slots=True)
class FitMethod:
    """One way from a profile to a kernel."""

    fit: Callable[..., FitResult]
    summary: str


METHODS = {
    "svd": FitMethod(
        fit_svd, "rank N: the largest terms of the singular value decomposition; the smallest error"
    ),
    "gaussians": FitMethod(
        fit_gaussians, "1 to 10 passes: a sum of Gaussians, best for the profile, r-weighted"
    ),
    "preintegrated": FitMethod(
        fit_preintegrated, "one pass: the profile integrated along lines; exact for axis edges"
    ),
    "guided": FitMethod(
        fit_guided, "one pass fitted under a guide function: near (k = 0) to far (k = 4) scattering"
    ),
    "artist": FitMethod(fit_artist, "one pass of two Gaussians per channel, fitted or set by hand"),
    "falloff": FitMethod(
        fit_falloff, "one pass, red skin stretched: width, strength and falloff, fitted or by hand"
    ),
    "burley": FitMethod(
        fit_burley, "one pass: normalised diffusion, a shape per channel, as engines take it"
    ),
}
