"""The kernels that are compared: every method, rank and number of Gaussians."""

import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from sssfit.errors import SssfitWarning
from sssfit.fit import FitResult, fit_result
from sssfit.fit.guided import MOST_PIXELS
from sssfit.profile import Profile

MOST_TERMS = 6  # of the papers' comparisons


@dataclass(frozen=True, slots=True)
class Candidate:
    """A way to fit: a method of ``sssfit.fit.METHODS`` with its settings.

    Parameters
    ----------
    label : str
        For charts and tables: "svd 3", "guided k = 4".
    method : str
    terms : int
        Most separable terms it makes; two passes each.
    settings : mapping
        Keywords of the method's function.
    """

    label: str
    method: str
    terms: int
    settings: Mapping[str, Any] = field(default_factory=dict)

    def fit(self, profile: Profile, mm_per_pixel: float, support_mm: float | None) -> FitResult:
        """Fit a profile on pixels; what the fit would warn of, a comparison shows in figures."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SssfitWarning)
            pixels = {"mm_per_pixel": mm_per_pixel, "support_mm": support_mm}
            return fit_result(profile, self.method, **pixels, **self.settings)


def candidates(pixels: int, *, most_terms: int = MOST_TERMS) -> tuple[Candidate, ...]:
    """Return what can be fitted on a number of pixels, cheapest first.

    Parameters
    ----------
    pixels : int
        Of a pass: 2 h + 1. Over 513 the guided fit is left out, as over h + 1 terms the others.
    most_terms : int
        Of svd and gaussians.
    """
    most = min(most_terms, pixels // 2 + 1)
    found = [*_one_pass(pixels), *_several(most)]
    return tuple(sorted(found, key=lambda each: each.terms))


def _one_pass(pixels: int) -> Iterator[Candidate]:
    """Yield the kernels of one term, which every budget includes."""
    yield Candidate("pre-integrated", "preintegrated", 1)
    yield Candidate("artist", "artist", 1)
    yield Candidate("artist, 2D", "artist", 1, {"target": "kernel"})
    yield Candidate("falloff", "falloff", 1)
    yield Candidate("burley", "burley", 1)
    if 1 < pixels <= MOST_PIXELS:
        for k in (0.0, 1.55, 4.0):
            yield Candidate(f"guided k = {k:g}", "guided", 1, {"k": k})


def _several(most: int) -> Iterator[Candidate]:
    """Yield sums of Gaussians and truncated decompositions of 1 to ``most`` terms."""
    for n in range(1, most + 1):
        yield Candidate(f"svd {n}", "svd", n, {"rank": n})
        yield Candidate(f"svd {n}, kept", "svd", n, {"rank": n, "energy": "keep"})
        yield Candidate(f"gaussians {n}", "gaussians", n, {"terms": n})
