"""Noise: kernels of profiles of few photons, beside the kernel of the exact profile.

The measure is what noise adds to a picture: the kernel of a walk beside that of the exact profile,
by the same method. A walk of few photons is the beginning of no longer one, so points are
independent; channels share their walks, as they do for users. Some methods are also fitted to the
walk's profile smoothed by its standard errors (`sssfit.profile.smooth`), and held to the same
kernels of the exact profile.
"""

import functools
import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import FitError, SssfitError
from sssfit.kernel import Kernel, Taps
from sssfit.profile import Profile
from sssfit.profile.smooth import smoothed
from sssfit.render.screen import second_moments
from sssfit.simulate import simulate_montecarlo
from sssfit.stability.curve import Axis, Curve
from sssfit.stability.panel import Panel
from sssfit.stability.seeds import bias_range, median_range, spread_range
from sssfit.stability.subject import Subject
from sssfit.stability.ways import WAYS, Way

LIMIT = 1.0  # Delta E: about what is just seen
WIDTH_LIMIT = 0.05  # of the width: a blur 5 % wider moves an edge's L* by 1
_FIRST, _LAST = 3, 7  # decades of photons
_SEEDS = 16
# Unless all is whole. A walk of 1e7 photons takes as long as all its fits, a cascade as all others.
_SEEDS_OF_MANY, _MANY = 4, 10**7
_SEEDS_OF_CASCADES, _PHOTONS_OF_CASCADES = 6, (10**3, 10**5)
_SMOOTHED = ("pre-integrated", "svd 3", "gaussians 4")
_ADVICE = {
    "svd": "fewer terms, smooth the profile, more photons or the exact method",
    "gaussians": "fewer Gaussians, smooth the profile, or more photons",
    "cascade": "more photons, or the exact method",
}


def stress(subject: Subject) -> list[Panel]:
    """Fit walks of 1e3 to 1e7 photons with every method, 16 seeds each.

    Unless all is whole, 1e7 photons have 4 seeds, and cascades are fitted to 1e3 and 1e5 photons
    with 6.

    Raises
    ------
    FitError
        The profile's material is unknown, and nothing can be walked.
    """
    if subject.material is None:
        raise FitError("noise: the profile does not say its material; give the material.")
    photons = [10**each for each in range(_FIRST, _LAST + 1)]
    subject.prepare(reversed(WAYS))
    cases = [_Case(each.label, each, _wanted(subject, each)) for each in WAYS]
    cases += [
        each._replace(label=f"{each.label}, smoothed", is_smoothed=True)
        for each in cases
        if each.label in _SMOOTHED
    ]
    work = [
        (count, number)
        for count in reversed(photons)
        for number in range(_seeds_of(subject, count))
    ]
    seen = subject.each(functools.partial(_measured, cases), work)
    found = dict(zip(work, seen, strict=True))
    figures = [_figures(each, found) for each in cases]
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


class _Seen(NamedTuple):
    """Of one kernel: the error of its pictures, and its width over the exact one's."""

    error: float
    width: float


class _Wanted(NamedTuple):
    """What one method makes of the exact profile."""

    pictures: list[FloatArray]
    width_mm: float


class _Case(NamedTuple):
    """A method, as charts name it, and whether it is given smoothed profiles."""

    label: str
    way: Way
    wanted: _Wanted
    is_smoothed: bool = False


def _wanted(subject: Subject, way: Way) -> _Wanted:
    kernel = subject.true_kernel(way)
    return _Wanted(subject.shows(kernel), width_mm(kernel))


def _seeds_of(subject: Subject, photons: int) -> int:
    return _SEEDS if subject.is_whole or photons < _MANY else min(_SEEDS, _SEEDS_OF_MANY)


def _measured(cases: Sequence[_Case], subject: Subject, given: tuple[int, int]) -> dict[str, _Seen]:
    """Fit one walk by all methods; sums of Gaussians begin with those of fewer."""
    photons, number = given
    profile = _walk(subject, photons, number)
    smooth = smoothed(profile)
    return {
        each.label: _seen(subject, each, smooth if each.is_smoothed else profile)
        for each in cases
        if _is_due(subject, each.way, photons, number)
    }


def _seen(subject: Subject, case: _Case, profile: Profile) -> _Seen:
    """Compare the kernel of a walk; infinite where too few annuli have light for a fit."""
    try:
        kernel = subject.fit(case.way, profile)
    except SssfitError:
        return _Seen(np.inf, np.inf)
    width = width_mm(kernel) / case.wanted.width_mm
    return _Seen(subject.error(kernel, case.wanted.pictures), width)


def _is_due(subject: Subject, way: Way, photons: int, number: int) -> bool:
    """Return whether a method is fitted to a walk; a cascade takes a hundred times as long."""
    if way.method != "cascade" or subject.is_whole:
        return True
    return number < _SEEDS_OF_CASCADES and photons in _PHOTONS_OF_CASCADES


class _Figures(NamedTuple):
    error: Curve
    spread: Curve
    bias: Curve


def _figures(case: _Case, found: Mapping[tuple[int, int], Mapping[str, _Seen]]) -> _Figures:
    """Return the median of the error, and spread and bias of the width, by numbers of photons."""
    seen: dict[int, list[_Seen]] = {}
    for (photons, _), by_label in sorted(found.items()):
        if case.label in by_label:
            seen.setdefault(photons, []).append(by_label[case.label])
    errors = [np.array([each.error for each in own]) for own in seen.values()]
    widths = [np.array([each.width for each in own]) - 1.0 for own in seen.values()]
    own = "more photons" if case.is_smoothed else _ADVICE.get(case.way.method)
    advice = own or "smooth the profile, or more photons"
    ranges = median_range(errors), spread_range(widths), bias_range(widths)
    return _Figures(*(Curve(case.label, np.array(list(seen)), *each, advice) for each in ranges))


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
