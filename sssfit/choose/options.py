"""The options of a choice: every candidate on several supports, with its cost."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from operator import attrgetter

import numpy as np

from sssfit.compare.candidates import Candidate, candidates
from sssfit.fit import FitResult
from sssfit.profile import Profile

# Of every channel's energy. skin1 keeps 70 % within 4.6 mm and 99.9 % within 21.4: where 70 % will
# do, a pass has a fifth of the weights.
SHARES = (0.5, 0.7, 0.8, 0.9, 0.95, 0.99, 0.999)
MOST_TERMS = 10
# A guided fit of 57 pixels takes 0.08 s, one of 287 pixels 0.65 s, of which there are three a
# support; on skin1 none came nearer than the pre-integrated pass.
GUIDED_PIXELS = 57


@dataclass(frozen=True, slots=True)
class Option:
    """A candidate on a support that keeps ``share`` of every channel's energy.

    Parameters
    ----------
    candidate : Candidate
    share : float
        Of the energy on the profile's grid.
    support_mm : float [mm]
        Half width of the kernel.
    pixels : int
        Of a pass, at the pitch asked for.
    mm_per_pixel : float [mm]
        The pitch asked for; wider views have other pixels.
    """

    candidate: Candidate
    share: float
    support_mm: float
    pixels: int
    mm_per_pixel: float

    @property
    def half_mm(self) -> float:
        """Distance of the outermost pixel from the middle one, at the pitch asked for [mm]."""
        return self.pixels // 2 * self.mm_per_pixel

    @property
    def taps_per_pixel(self) -> int:
        """Weights applied to a pixel: two passes a term. What decides."""
        return 2 * self.candidate.terms * self.pixels

    def fit(self, profile: Profile, mm_per_pixel: float) -> FitResult | None:
        """Fit a profile; on pixels wider than the support there is no kernel, None."""
        half = half_pixels(self.support_mm, mm_per_pixel)
        if half == 0:
            return None
        # On wider pixels a kernel has fewer terms: no more than pixels of a quadrant's edge.
        settings = {
            key: min(value, half + 1) if key in ("rank", "terms") else value
            for key, value in self.candidate.settings.items()
        }
        candidate = replace(self.candidate, settings=settings)
        return candidate.fit_dense(profile, mm_per_pixel, self.support_mm)


def half_pixels(support_mm: float, mm_per_pixel: float) -> int:
    """Pixels on either side of the middle, as the fits count them."""
    return math.floor(support_mm / mm_per_pixel + 1e-9)


def supports(profile: Profile, mm_per_pixel: float) -> list[tuple[float, float]]:
    """Shares of energy and the radii [mm] that keep them, narrowest first, each of other pixels."""
    cumulative = profile.cumulative
    found: dict[int, tuple[float, float]] = {}
    for share in SHARES:
        kept = (cumulative >= share * cumulative[-1]).all(axis=1)
        radius = float(profile.r_edges_mm[int(np.argmax(kept))])
        half = half_pixels(radius, mm_per_pixel)
        if half > 0:
            found[half] = share, radius
    return [found[half] for half in sorted(found)]


def options(kept: Sequence[tuple[float, float]], mm_per_pixel: float) -> list[Option]:
    """Return what can be fitted on these supports; fits that lose energy are left out."""
    found = []
    for share, radius in kept:
        pixels = 2 * half_pixels(radius, mm_per_pixel) + 1
        found += [
            Option(candidate, share, radius, pixels, mm_per_pixel)
            for candidate in candidates(pixels, most_terms=MOST_TERMS)
            if candidate.settings.get("energy") != "keep"
        ]
    return found


def by_cost(found: Sequence[Option]) -> Iterator[list[Option]]:
    """Yield options of the same cost, cheapest first."""
    cost = attrgetter("taps_per_pixel")
    for _, group in groupby(sorted(found, key=cost), key=cost):
        yield list(group)


def split_guided(group: Sequence[Option]) -> tuple[list[Option], list[Option]]:
    """Return the quick fits of a cost, and the guided ones that are not too slow to try."""
    quick = [each for each in group if each.candidate.method != "guided"]
    slow = [each for each in group if each.candidate.method == "guided"]
    return quick, [each for each in slow if each.pixels <= GUIDED_PIXELS]
