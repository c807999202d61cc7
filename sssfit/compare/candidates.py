"""The kernels that are compared: every method, dense and on taps; cascades and relatives.

Dense kernels have a weight for every pixel of a pass, which no shader applies; on taps they are
thinned to the bilinear fetches of a budget. A method of ``FITS`` for which nothing is said here is
compared with its defaults.
"""

import functools
import time
import warnings
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from sssfit.errors import SssfitWarning
from sssfit.fit import FitResult, TapsFit, fit_separable, fit_taps
from sssfit.fit.guided import MOST_PIXELS
from sssfit.fit.on_taps import on_taps
from sssfit.methods import FITS, TAPS
from sssfit.profile import Profile

MOST_TERMS = 6  # of the papers' comparisons
CASCADES = (12, 14, 17, 24)  # fetches a pixel; more than 24 change nothing that can be seen
DISKS = (16, 24, 40)  # fetches a pixel and frame
# The relatives of cascades by fetches a pixel: as published, and as good as they were made.
RELATIVES = {
    "gaussian chain 90": ("gaussian-chain", "3-3-3-3-3-3"),
    "gaussian chain 42": ("gaussian-chain", "3-3|3-3|3-3"),
    "pyramid 12": ("pyramid", "1|1|1|1|1"),
    "pyramid 21": ("pyramid", "1-1|1-1|1-1|1-1|1-1"),
}
ROTATED = {
    "hexagonal 34": {"directions": 3, "taps": 11},
    "octagonal 37": {"directions": 4, "taps": 9},
}
BUDGETS = (12, 24, 50, 100)  # fetches a pixel of the kernels on taps
LEAST_TAPS = 3  # a pass: the middle and one pair
# What is thinned: of each method the kernels that need few taps, or show the least.
_THINNED = (
    *("pre-integrated", "artist", "falloff", "guided k = 1.55", "svd 2", "svd 3"),
    *("gaussians 2", "gaussians 3", "weighted 1", "weighted 2"),
)


@dataclass(frozen=True, slots=True)
class Candidate:
    """A way to fit: a method of ``sssfit.methods.FITS`` with its settings.

    Parameters
    ----------
    label : str
        For charts and tables: "svd 3", "guided k = 4", "svd 3 on 25 taps", "cascade 24".
    method : str
    terms : int
        Most separable terms it makes, two passes each; 0 for chains of stages and disks.
    settings : mapping
        Keywords of the method's function.
    taps : int, optional
        Fetches of a pass that a dense kernel is thinned to.
    """

    label: str
    method: str
    terms: int
    settings: Mapping[str, Any] = field(default_factory=dict)
    taps: int | None = None

    def fit(
        self,
        profile: Profile,
        mm_per_pixel: float,
        support_mm: float | None,
        dense: FitResult | None = None,
    ) -> FitResult | TapsFit:
        """Fit a profile on pixels; what the fit would warn of, a comparison shows in figures.

        Parameters
        ----------
        profile : Profile
        mm_per_pixel, support_mm : float [mm]
            As `sssfit.fit.make_target`. Chains of stages reach as far as the profile's light.
        dense : FitResult, optional
            The kernel that is thinned, where it is fitted already.

        Raises
        ------
        FitError
        """
        if self.method in TAPS:
            reach = {"support_mm": support_mm} if self.method == "disk" else {}
            pixels = {"mm_per_pixel": mm_per_pixel, **reach}
            return fit_taps(profile, self.method, **pixels, **self.settings)
        if dense is None or self.taps is None:
            dense = self.fit_dense(profile, mm_per_pixel, support_mm)
        if self.taps is None:
            return dense
        begun = time.perf_counter()
        thinned = on_taps(dense.kernel, self.taps)  # its error is seen on pictures
        return TapsFit(thinned, 0, time.perf_counter() - begun)

    def fit_dense(
        self, profile: Profile, mm_per_pixel: float, support_mm: float | None
    ) -> FitResult:
        """Fit the separable kernel with a weight for every pixel."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SssfitWarning)
            pixels = {"mm_per_pixel": mm_per_pixel, "support_mm": support_mm}
            return fit_separable(profile, self.method, **pixels, **self.settings)

    @property
    def dense_label(self) -> str:
        """The label of the kernel that is thinned."""
        return self.label.partition(" on ")[0]


def candidates(pixels: int, *, most_terms: int = MOST_TERMS) -> tuple[Candidate, ...]:
    """Return the dense kernels that can be fitted on a number of pixels, cheapest first.

    Parameters
    ----------
    pixels : int
        Pixels of a pass: 2 h + 1. Over 513 the guided fit is left out, as over h + 1 terms the
        others.
    most_terms : int
        Most terms of svd and gaussians.
    """
    most = min(most_terms, pixels // 2 + 1)
    found = [*_one_pass(pixels), *_several(most), *_by_default(makes_taps=False)]
    return tuple(sorted(found, key=lambda each: each.terms))


def every_candidate(pixels: int, only: Collection[str] | None = None) -> tuple[Candidate, ...]:
    """Return all that is compared on a number of pixels: dense, on taps, chains and disks.

    Parameters
    ----------
    pixels : int
        As `candidates`.
    only : collection of str, optional
        Names of methods.
    """
    dense = [*candidates(pixels), *_weighted(pixels)]
    few = {*_THINNED, *(each.label for each in _by_default(makes_taps=False))}
    thinned = on_budgets([each for each in dense if each.label in few], pixels)
    chains = [*_cascades(), *_relatives(), *_disks(pixels), *_by_default(makes_taps=True)]
    found = [*dense, *thinned, *chains]
    return tuple(each for each in found if only is None or each.method in only)


def missing(
    pixels: int, mm_per_pixel: float, only: Collection[str] | None
) -> list[tuple[str, str]]:
    """Return the methods asked for of which no kernel is compared, and why.

    Parameters
    ----------
    pixels : int
    mm_per_pixel : float [mm]
        Of the pixels of a pass.
    only : collection of str, optional
        As `every_candidate`; by default nothing is missing.
    """
    found = {each.method for each in every_candidate(pixels, only)}
    here = f"and the kernel is of {pixels} x {pixels} pixels of {mm_per_pixel:.4g} mm"
    reasons = {
        "guided": f"the guided fit takes 3 to {MOST_PIXELS} pixels a pass, {here}; give another "
        "`mm_per_pixel`.",
        "disk": f"disks have {min(DISKS)} fetches or more, each in a pixel of its own, {here}; "
        "give a smaller `mm_per_pixel`.",
    }
    lacking = [each for each in sorted(only or ()) if each not in found]
    return [(each, reasons.get(each, f"no kernel of {each} is compared.")) for each in lacking]


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


def _weighted(pixels: int) -> Iterator[Candidate]:
    """Yield the terms that are fitted as pictures see them."""
    for n in range(1, min(3, pixels // 2 + 1) + 1):
        yield Candidate(f"weighted {n}", "weighted", n, {"rank": n})


def on_budgets(dense: Iterable[Candidate], pixels: int) -> Iterator[Candidate]:
    """Yield dense kernels thinned to each of `BUDGETS`: terms share their first pass.

    Parameters
    ----------
    dense : iterable of Candidate
    pixels : int
        Pixels of a pass, the most taps that it can have.
    """
    for each in dense:
        budgeted = (int(budget / (each.terms + 1) - 1) // 2 * 2 + 1 for budget in BUDGETS)
        for taps in dict.fromkeys(budgeted):
            if LEAST_TAPS <= taps <= pixels:
                yield replace(each, label=f"{each.label} on {taps} taps", taps=taps)


def _cascades() -> Iterator[Candidate]:
    """Yield a cascade for each budget."""
    for fetches in CASCADES:
        yield Candidate(f"cascade {fetches}", "cascade", 0, {"fetches": fetches})


def _relatives() -> Iterator[Candidate]:
    """Yield chains of Gaussians, convolution pyramids and chains of passes in many directions."""
    for label, (method, stages) in RELATIVES.items():
        yield Candidate(label, method, 0, {"stages": stages})
    for label, settings in ROTATED.items():
        yield Candidate(label, "rotated", 0, settings)


def _disks(pixels: int) -> Iterator[Candidate]:
    """Yield fetches on a disk, as one frame shows them."""
    for taps in DISKS:
        if taps <= pixels**2:
            yield Candidate(f"disk {taps}", "disk", 0, {"taps": taps})


def _by_default(*, makes_taps: bool) -> Iterator[Candidate]:
    """Yield a kernel with default settings by each method of ``FITS`` that has none above."""
    for name, each in FITS.items():
        if each.makes_taps == makes_taps and name not in _with_settings():
            terms = each.count_of({})
            yield Candidate(name, name, 0 if makes_taps else int(terms or 1))


@functools.cache
def _with_settings() -> frozenset[str]:
    """Return the methods of which this file says what is compared."""
    room = MOST_PIXELS  # for each of them
    dense = [*_one_pass(room), *_several(1), *_weighted(room)]
    return frozenset(each.method for each in (*dense, *_cascades(), *_relatives(), *_disks(room)))
