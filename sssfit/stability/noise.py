"""Noise: kernels of profiles of few photons, beside the kernel of the exact profile.

The measure is what noise adds to a picture: the kernel of a walk beside that of the exact profile,
by the same method. A walk of few photons is the beginning of no longer one, so points are
independent; channels share their walks, as they do for users.
"""

import functools
import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

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
_SEEDS, _SEEDS_OF_CASCADES = 16, 4  # of a cascade a fit takes 50 times as long
_FIRST, _LAST = 3, 7  # decades of photons
_ADVICE = {
    "svd": "fewer terms or more photons; the exact method has no noise",
    "gaussians": "fewer Gaussians or more photons",
    "cascade": "more photons, or the exact method",
}


def stress(subject: Subject) -> list[Panel]:
    """Fit walks of 1e3 to 1e7 photons with every method, 16 seeds each, 4 of a cascade.

    Raises
    ------
    FitError
        The profile's material is unknown, and nothing can be walked.
    """
    if subject.material is None:
        raise FitError("noise: the profile does not say its material; give the material.")
    photons = 10 ** np.arange(_FIRST, _LAST + 1)
    found = [_fits(subject, way, photons) for way in WAYS]
    axis = Axis("photons", mild=float(photons[-1]), form=".2g")
    return [
        Panel(
            stress="noise",
            axis=axis,
            title="what noise adds to a picture",
            y_label="p99 of Delta E 2000",
            limit=LIMIT,
            curves=[each.error for each in found],
            fails="colours change with the seed",
        ),
        Panel(
            stress="noise",
            axis=axis,
            title="spread of the kernel's width",
            y_label="standard deviation / width",
            limit=WIDTH_LIMIT,
            curves=[each.spread for each in found],
            fails="the blur changes with the seed",
        ),
        Panel(
            stress="noise",
            axis=axis,
            title="bias of the kernel's width",
            y_label="|mean - exact| / width",
            limit=WIDTH_LIMIT,
            curves=[each.bias for each in found],
            fails="the fit chases the noise of the tail",
        ),
    ]


@dataclass(frozen=True, slots=True)
class _Found:
    error: Curve
    spread: Curve
    bias: Curve


def _fits(subject: Subject, way: Way, photons: npt.NDArray[np.intp]) -> _Found:
    """Return quartiles of the error, and spread and bias of the width."""
    exact = subject.true_kernel(way)
    wanted, width = subject.shows(exact), width_mm(exact)
    seeds = _SEEDS if way.method != "cascade" or subject.is_whole else _SEEDS_OF_CASCADES
    work = [(int(count), seed) for count in photons for seed in range(seeds)]

    def measured(given: tuple[int, int]) -> tuple[float, float]:
        try:
            kernel = way.fit(_walk(subject, *given), subject.mm_per_pixel)
        except SssfitError:  # too few annuli have light
            return np.inf, np.inf
        return subject.error(kernel, wanted), width_mm(kernel)

    values: FloatArray = np.array(subject.each(measured, work)).reshape(len(photons), seeds, 2)
    errors, widths = values[..., 0], values[..., 1] / width - 1.0
    low, middle, high = np.quantile(errors, (0.25, 0.5, 0.75), axis=1, method="nearest")
    with np.errstate(invalid="ignore"):  # infinite where a fit was refused
        spread, mean = np.std(widths, axis=1, ddof=1), np.mean(widths, axis=1)
    spread, bias = (np.where(np.isfinite(each), np.abs(each), np.inf) for each in (spread, mean))
    # A standard deviation of n seeds is known to 1 / sqrt(2 n - 2), a mean to spread / sqrt(n).
    share, of_mean = 1.0 / np.sqrt(2.0 * seeds - 2.0), spread / np.sqrt(seeds)
    advice = _ADVICE.get(way.method, "more photons")

    def curve(y: FloatArray, low: FloatArray, high: FloatArray) -> Curve:
        return Curve(way.label, photons, y, low, high, advice)

    return _Found(
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


@functools.lru_cache(maxsize=128)
def _walk(subject: Subject, photons: int, number: int) -> Profile:
    """Return one walk on the exact profile's radius, so that the grid's edge is no difference."""
    assert subject.material is not None
    return simulate_montecarlo(
        subject.material,
        photons=photons,
        seed=subject.seed + 1000 * number,
        radius_mm=float(subject.profile.r_edges_mm[-1]),
        threads=1,
    )
