"""Noise: kernels of profiles of few photons, beside the kernel of the exact profile.

The measure is what noise adds to a picture: the kernel of a walk beside that of the exact profile,
by the same method. A walk of few photons is the beginning of no longer one, so points are
independent but for the last, whose profiles are the exact one with the noise of a walk of a tenth
of the photons over sqrt(10): its annuli and channels vary together as those of 1e7 photons do,
which take as long to walk as all their fits. Channels share their walks, as they do for users. A
cascade is followed from the exact profile's optimum (``_cascade_again``): that is what noise does
to it, without the luck of a search. Some methods are also fitted to the walk's profile smoothed by
its standard errors (`sssfit.profile.smooth`), and held to the same kernels of the exact profile.
"""

import dataclasses
import functools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import FitError, SssfitError
from sssfit.fit._cascade_again import followed
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
# Unless all is whole.
_MOST_WALKED = 10**6
_PHOTONS_OF_CASCADES = (10**3, 10**4, 10**5)
KERNELS = WAYS
_SMOOTHED = ("pre-integrated", "svd 3", "gaussians 4")
_ADVICE = {
    "svd": "fewer terms, smooth the profile, more photons or the exact method",
    "gaussians": "fewer Gaussians, smooth the profile, or more photons",
    "cascade": "more photons, or the exact method",
}


def check(subject: Subject) -> None:
    """Raise FitError if the profile's material is unknown, so that nothing can be walked."""
    if subject.material is None:
        raise FitError("noise: the profile does not say its material; give the material.")


def stress(subject: Subject) -> list[Panel]:
    """Fit walks of 1e3 to 1e7 photons with every method, 16 seeds each.

    Unless all is whole, profiles of 1e7 photons have the noise of 1e6, and cascades start at that
    of the exact profile, with 1e3, 1e4 and 1e5 photons.

    """
    photons = [10**each for each in range(_FIRST, _LAST + 1)]
    cases = [_Case(each.label, each, _wanted(subject, each)) for each in WAYS]
    cases += [
        each._replace(label=f"{each.label}, smoothed", is_smoothed=True)
        for each in cases
        if each.label in _SMOOTHED
    ]
    work = [(own, number) for own in _together(subject, photons) for number in range(_SEEDS)]
    seen = subject.each(functools.partial(_measured, cases), work)
    found = [each for own in seen for each in own]
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

    label: str
    photons: int
    error: float
    width: float


class _Wanted(NamedTuple):
    """What one method makes of the exact profile."""

    kernel: Kernel
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
    return _Wanted(kernel, subject.shows(kernel), width_mm(kernel))


def _together(subject: Subject, photons: Sequence[int]) -> list[tuple[int, ...]]:
    """Return the numbers of photons that share a walk, what takes longest first."""
    walked = [each for each in photons if subject.is_whole or each <= _MOST_WALKED]
    scaled = [each for each in photons if each not in walked]
    return [(*walked[-1:], *scaled), *((each,) for each in walked[-2::-1])]


def _measured(
    cases: Sequence[_Case], subject: Subject, given: tuple[Sequence[int], int]
) -> list[_Seen]:
    """Fit one walk by all methods; sums of Gaussians begin with those of fewer."""
    (walked, *scaled), number = given
    walk = _walk(subject, walked, number)
    profiles = [walk, *(with_noise_of(subject.profile, walk, each) for each in scaled)]
    found = []
    for photons, profile in zip((walked, *scaled), profiles, strict=True):
        due = [each for each in cases if _is_due(subject, each.way, photons)]
        # Smoothing takes longer than most fits.
        smooth = smoothed(profile) if any(each.is_smoothed for each in due) else profile
        found += [
            _seen(subject, each, smooth if each.is_smoothed else profile, photons) for each in due
        ]
    return found


def _seen(subject: Subject, case: _Case, profile: Profile, photons: int) -> _Seen:
    """Compare the kernel of a walk; infinite where too few annuli have light for a fit."""
    try:
        kernel = _fit(subject, case, profile)
    except SssfitError:
        return _Seen(case.label, photons, np.inf, np.inf)
    width = width_mm(kernel) / case.wanted.width_mm
    return _Seen(case.label, photons, subject.error(kernel, case.wanted.pictures), width)


def _fit(subject: Subject, case: _Case, profile: Profile) -> Kernel:
    if case.way.method == "cascade" and not subject.is_whole:
        assert isinstance(case.wanted.kernel, Taps)
        return followed(case.wanted.kernel, profile)
    return subject.fit(case.way, profile)


def _is_due(subject: Subject, way: Way, photons: int) -> bool:
    """Return whether a method is fitted to a walk; a cascade takes as long as all others."""
    return way.method != "cascade" or subject.is_whole or photons in _PHOTONS_OF_CASCADES


class _Figures(NamedTuple):
    error: Curve
    spread: Curve
    bias: Curve


def _figures(case: _Case, found: Sequence[_Seen]) -> _Figures:
    """Return the median of the error, and spread and bias of the width, by numbers of photons."""
    own = [each for each in found if each.label == case.label]
    counts = sorted({each.photons for each in own})
    seen = [[each for each in own if each.photons == count] for count in counts]
    errors = [np.array([each.error for each in some]) for some in seen]
    widths = [np.array([each.width for each in some]) - 1.0 for some in seen]
    usual = "more photons" if case.is_smoothed else _ADVICE.get(case.way.method)
    advice = usual or "smooth the profile, or more photons"
    ranges = median_range(errors), spread_range(widths), bias_range(widths)
    return _Figures(*(Curve(case.label, np.array(counts), *each, advice) for each in ranges))


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


def with_noise_of(exact: Profile, walk: Profile, photons: int) -> Profile:
    """Return a profile of more photons than were walked: exact, with a walk's noise made smaller.

    Covariances are those of so many photons; where annuli have few hits, they are more of smaller
    weight than a walk has.
    """
    assert walk.photons is not None
    share = math.sqrt(walk.photons / photons)
    energy = np.diff(exact.cumulative_at(walk.r_edges_mm), axis=0)
    return dataclasses.replace(
        walk,
        annulus_energy=energy + share * (walk.annulus_energy - energy),
        annulus_energy_stderr=share * walk.annulus_energy_stderr,
        beyond_grid=exact.beyond_grid + share * (walk.beyond_grid - exact.beyond_grid),
        beyond_grid_stderr=share * walk.beyond_grid_stderr,
        meta={**walk.meta, "photons": photons},
    )
