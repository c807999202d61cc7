"""Noise: kernels of profiles of few photons, beside the kernel of the exact profile.

The measure is what noise adds to a picture: the kernel of a walk beside that of the exact profile,
by the same method. A walk of few photons is the beginning of no longer one, so points are
independent; channels share their walks, as they do for users.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import FitError, SssfitError
from sssfit.kernel import Kernel, Taps
from sssfit.profile import Profile
from sssfit.render.screen import second_moments
from sssfit.simulate import simulate_montecarlo
from sssfit.stability.record import Axis, Curve, Panel
from sssfit.stability.subject import WAYS, Subject, Way

LIMIT = 1.0  # Delta E: about what is just seen
WIDTH_LIMIT = 0.05  # of the width: a blur 5 % wider moves an edge's L* by 1
_SEEDS, _SEEDS_OF_CASCADES = 16, 4
_FIRST, _LAST = 3, 7  # decades of photons
_ADVICE = {
    "svd": "fewer terms or more photons; the exact method has no noise",
    "gaussians": "fewer Gaussians or more photons",
    "cascade": "more photons, or the exact method",
}


def stress(subject: Subject) -> list[Panel]:
    """Fit walks of 1e3 to 1e7 photons with every method, 16 seeds each.

    Cascades are fitted for every other number of photons and for 4 seeds, unless all is whole.

    Raises
    ------
    FitError
        The profile's material is unknown, and nothing can be walked.
    """
    if subject.material is None:
        raise FitError("noise: the profile does not say its material; give the material.")
    photons = [10**each for each in range(_FIRST, _LAST + 1)]
    wanted = {each.label: _Wanted(subject, each) for each in WAYS}

    def measured(given: tuple[int, int]) -> dict[str, _Seen]:
        """Fit one walk by all methods; sums of Gaussians begin with those of fewer."""
        profile = _walk(subject, *given)
        ways = [each for each in WAYS if _is_due(subject, each, *given)]
        return {each.label: wanted[each.label].seen(subject, each, profile) for each in ways}

    work = [(count, seed) for count in photons for seed in range(_SEEDS)]
    found = dict(zip(work, subject.each(measured, work), strict=True))
    figures = [_figures(each, found) for each in WAYS]
    axis = Axis("photons", mild=float(photons[-1]), form=".2g")
    return [
        Panel(
            stress="noise",
            title="what noise adds to a picture",
            axis=axis,
            y_label="p99 of Delta E 2000",
            limit=LIMIT,
            curves=[each.error for each in figures],
            fails="colours change with the seed",
        ),
        Panel(
            stress="noise",
            title="spread of the kernel's width",
            axis=axis,
            y_label="standard deviation / width",
            limit=WIDTH_LIMIT,
            curves=[each.spread for each in figures],
            fails="the blur changes with the seed",
        ),
        Panel(
            stress="noise",
            title="bias of the kernel's width",
            axis=axis,
            y_label="|mean - exact| / width",
            limit=WIDTH_LIMIT,
            curves=[each.bias for each in figures],
            fails="the fit chases the noise of the tail",
        ),
    ]


def _is_due(subject: Subject, way: Way, photons: int, seed: int) -> bool:
    """Return whether a method is fitted to a walk; a cascade takes a hundred times as long."""
    if way.method != "cascade" or subject.is_whole:
        return True
    return seed < _SEEDS_OF_CASCADES and round(math.log10(photons) - _FIRST) % 2 == 0


class _Seen(NamedTuple):
    """Of one kernel: the error of its pictures, and its width over the exact one's."""

    error: float
    width: float


class _Wanted:
    """What one method makes of the exact profile."""

    def __init__(self, subject: Subject, way: Way) -> None:
        kernel = subject.true_kernel(way)
        self._pictures, self._width_mm = subject.shows(kernel), width_mm(kernel)

    def seen(self, subject: Subject, way: Way, profile: Profile) -> _Seen:
        """Compare the kernel of a walk; infinite where too few annuli have light for a fit."""
        try:
            kernel = way.fit(profile, subject.mm_per_pixel)
        except SssfitError:
            return _Seen(np.inf, np.inf)
        return _Seen(subject.error(kernel, self._pictures), width_mm(kernel) / self._width_mm)


class _Figures(NamedTuple):
    error: Curve
    spread: Curve
    bias: Curve


def _figures(way: Way, found: Mapping[tuple[int, int], Mapping[str, _Seen]]) -> _Figures:
    """Return quartiles of the error, and spread and bias of the width, by numbers of photons."""
    seen: dict[int, list[_Seen]] = {}
    for (photons, _), by_label in found.items():
        if way.label in by_label:
            seen.setdefault(photons, []).append(by_label[way.label])
    errors = np.array([[each.error for each in own] for own in seen.values()])
    widths = np.array([[each.width for each in own] for own in seen.values()]) - 1.0
    low, middle, high = np.quantile(errors, (0.25, 0.5, 0.75), axis=1, method="nearest")
    with np.errstate(invalid="ignore"):  # infinite where a fit was refused
        spread, mean = np.std(widths, axis=1, ddof=1), np.mean(widths, axis=1)
    spread, bias = (np.where(np.isfinite(each), np.abs(each), np.inf) for each in (spread, mean))
    # A standard deviation of n seeds is known to 1 / sqrt(2 n - 2), a mean to spread / sqrt(n).
    seeds = errors.shape[1]
    share, of_mean = 1.0 / np.sqrt(2.0 * seeds - 2.0), spread / np.sqrt(seeds)

    def curve(y: FloatArray, low: FloatArray, high: FloatArray) -> Curve:
        advice = _ADVICE.get(way.method, "more photons")
        return Curve(way.label, np.array(list(seen)), y, low, high, advice)

    return _Figures(
        curve(middle, low, high),
        curve(spread, (1.0 - share) * spread, (1.0 + share) * spread),
        curve(bias, np.maximum(bias - of_mean, 0.0), bias + of_mean),
    )


def width_mm(kernel: Kernel) -> float:
    """Return the standard deviation of the first channel's kernel along an axis [mm]."""
    if isinstance(kernel, Taps):
        variances = np.array([each.variance_mm2[0] for each in kernel.stages])
        total = np.cumsum(variances) if kernel.chained else variances
        second = float(kernel.blend[1:, 0] @ total) / kernel.energy[0]
    else:
        second = float(second_moments(kernel)[0])
    return math.sqrt(max(second, 0.0))


def _walk(subject: Subject, photons: int, number: int) -> Profile:
    """Walk on the exact profile's radius, so that the grid's edge is no difference."""
    assert subject.material is not None
    return simulate_montecarlo(
        subject.material,
        photons=photons,
        seed=subject.seed + 1000 * number,
        radius_mm=float(subject.profile.r_edges_mm[-1]),
        threads=1,
    )
