"""Profile to kernel: one method, one file, one signature ``fit_x(profile, ...) -> FitResult``.

``METHODS`` has them by the names of the command line. Every ``fit_x`` takes a profile and
``mm_per_pixel``, ``support_mm`` and ``normalize`` by keyword, beside settings of its own.
"""

from collections.abc import Callable
from dataclasses import dataclass

from sssfit.fit._result import FitResult
from sssfit.fit._target import make_target, support_of
from sssfit.fit.gaussians import fit_gaussians
from sssfit.fit.preintegrated import fit_preintegrated

__all__ = [
    "METHODS",
    "FitMethod",
    "FitResult",
    "fit_gaussians",
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
    "gaussians": FitMethod(
        fit_gaussians, "1 to 10 passes: a sum of Gaussians, best for the profile, r-weighted"
    ),
    "preintegrated": FitMethod(
        fit_preintegrated, "one pass: the profile integrated along lines; exact for axis edges"
    ),
}
