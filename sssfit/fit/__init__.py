"""Profile to kernel: one method, one file, one signature ``fit_x(profile, ...) -> FitResult``.

``METHODS`` has them by the names of the command line, from the entries in ``sssfit.methods``. Every
``fit_x`` takes a profile and ``mm_per_pixel``, ``support_mm`` and ``normalize`` by keyword, beside
settings of its own.
"""

from collections.abc import Callable
from dataclasses import dataclass

from sssfit.fit._result import FitResult
from sssfit.fit._target import make_target, support_of
from sssfit.fit.artist import fit_artist
from sssfit.fit.burley import fit_burley
from sssfit.fit.falloff import fit_falloff
from sssfit.fit.gaussians import fit_gaussians
from sssfit.fit.guided import fit_guided
from sssfit.fit.preintegrated import fit_preintegrated
from sssfit.fit.svd import fit_svd
from sssfit.methods import FITS

__all__ = [
    "METHODS",
    "FitMethod",
    "FitResult",
    "fit_artist",
    "fit_burley",
    "fit_falloff",
    "fit_gaussians",
    "fit_guided",
    "fit_preintegrated",
    "fit_svd",
    "make_target",
    "support_of",
]


@dataclass(frozen=True, slots=True)
class FitMethod:
    """One way from a profile to a kernel."""

    fit: Callable[..., FitResult]
    summary: str


METHODS = {name: FitMethod(each.load(), each.summary) for name, each in FITS.items()}
