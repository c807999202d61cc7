"""Profile to kernel: one method, one file, one signature ``fit_x(profile, ...) -> FitResult``.

``METHODS`` has them by the names of the command line. Every ``fit_x`` takes a profile and
``mm_per_pixel``, ``support_mm`` and ``normalize`` by keyword, beside settings of its own.
"""

from collections.abc import Callable
from dataclasses import dataclass

from sssfit.fit._result import FitResult
from sssfit.fit._target import make_target, support_of
from sssfit.fit.artist import fit_artist
from sssfit.fit.falloff import fit_falloff
from sssfit.fit.guided import fit_guided
from sssfit.fit.preintegrated import fit_preintegrated

__all__ = [
    "METHODS",
    "FitMethod",
    "FitResult",
    "fit_artist",
    "fit_falloff",
    "fit_guided",
    "fit_preintegrated",
    "make_target",
    "support_of",
]


@dataclass(frozen=True, slots=True)
class FitMethod:
    """One way from a profile to a kernel."""

    fit: Callable[..., FitResult]
    summary: str


METHODS = {
    "artist": FitMethod(fit_artist, "one pass of two Gaussians per channel, fitted or set by hand"),
    "falloff": FitMethod(
        fit_falloff, "one pass, red skin stretched: width, strength and falloff, fitted or by hand"
    ),
    "guided": FitMethod(
        fit_guided, "one pass fitted under a guide function: near (k = 0) to far (k = 4) scattering"
    ),
    "preintegrated": FitMethod(
        fit_preintegrated, "one pass: the profile integrated along lines; exact for axis edges"
    ),
}
