"""Gaussians: sums of 1 to 10, where variances fall together and searches end in local minima."""

import functools
import math
from collections.abc import Sequence

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.fit import FitResult, fit_gaussians
from sssfit.fit._gaussians_search import fitted_annuli, local_minimum, make_annuli
from sssfit.fit._target import make_target
from sssfit.stability.optics import CONDITION_LIMIT, condition_number
from sssfit.stability.record import Axis, Curve, Panel
from sssfit.stability.subject import Subject

ERROR_LIMIT = 0.01  # of the profile, r-weighted, as the literature has it
MISSED_LIMIT = 0.5  # of the starts
NEAR_LIMIT = 0.5  # 1 / ratio of neighbouring widths: nearer ones trade their weights
_COUNTS = tuple(range(1, 11))
_STARTED = (1, 2, 4, 6, 8, 10)
_STARTS, _AS_GOOD = 16, 1.01  # of the error of the best start
_NARROWEST = 0.25  # of the first annulus, as the fit has it
_ADVICE = "fewer Gaussians; six serve skin and marble"


def stress(subject: Subject) -> list[Panel]:
    """Fit 1 to 10 Gaussians, signed and not, and each number from 16 random starts."""
    signs = {"weights above 0": False, "signed weights": True}
    fits = {
        label: subject.each(functools.partial(_fit, subject, signed), _COUNTS)
        for label, signed in signs.items()
    }
    few, many = (Axis("Gaussians", float(_COUNTS[k]), is_log=False) for k in (0, -1))
    return [
        Panel(
            stress="gaussians",
            title="error of the profile",
            y_label="relative error",
            limit=ERROR_LIMIT,
            curves=[_curve(label, [_error(each) for each in own]) for label, own in fits.items()],
            fails="too few Gaussians near the beam",
            axis=many,
        ),
        Panel(
            stress="gaussians",
            title="starts that miss the best minimum",
            y_label="share of 16 random starts",
            limit=MISSED_LIMIT,
            curves=[_missing(subject, label, signed) for label, signed in signs.items()],
            fails="a single start ends in a local minimum",
            is_log=False,
            axis=few,
        ),
        Panel(
            stress="gaussians",
            title="how near neighbouring widths come",
            y_label="narrower / wider width",
            limit=NEAR_LIMIT,
            curves=[_curve(label, [_nearest(each) for each in own]) for label, own in fits.items()],
            fails="widths coalesce and weights trade",
            is_log=False,
            axis=few,
        ),
        Panel(
            stress="gaussians",
            title="condition of the normal matrix",
            y_label="condition number",
            limit=CONDITION_LIMIT,
            curves=[
                _curve(label, [condition_number(_variances(each)) for each in own])
                for label, own in fits.items()
            ],
            fails="weights are lost in rounding",
            axis=few,
        ),
    ]


def _curve(label: str, values: Sequence[float]) -> Curve:
    return Curve(label, np.array(_COUNTS), np.array(values), advice=_ADVICE)


def _missing(subject: Subject, label: str, signed: bool) -> Curve:
    missed = subject.each(functools.partial(_missed, subject, signed), _STARTED)
    return Curve(label, np.array(_STARTED), np.array(missed), advice=_ADVICE)


def _fit(subject: Subject, signed: bool, terms: int) -> FitResult:
    pitch = subject.mm_per_pixel
    return fit_gaussians(subject.profile, terms=terms, signed=signed, mm_per_pixel=pitch)


def _first(found: FitResult) -> dict[str, object]:
    kernel = found.kernel
    return dict(kernel.parameters[kernel.channels[0]])


def _error(found: FitResult) -> float:
    return float(np.asarray(_first(found)["relative_error"]))


def _variances(found: FitResult) -> FloatArray:
    variances: FloatArray = np.array(_first(found)["variances_mm2"], dtype=np.float64)
    return variances


def _nearest(found: FitResult) -> float:
    """Return the largest ratio of a width to the next wider one; 0 for a single Gaussian."""
    variances = _variances(found)
    return float(np.sqrt(variances[:-1] / variances[1:]).max(initial=0.0))


def _missed(subject: Subject, signed: bool, terms: int) -> float:
    """Return the share of random starts that end over 1 % above the best one's error."""
    target = make_target(subject.profile, subject.mm_per_pixel)
    edges_mm, energy = fitted_annuli(target, 0)
    annuli = make_annuli(edges_mm, energy, float(target.total[0] / energy.sum()), signed=signed)
    rng = np.random.default_rng((subject.seed, terms))
    bounds = 2.0 * math.log(_NARROWEST * edges_mm[1]), 2.0 * math.log(edges_mm[-1])
    starts = np.sort(rng.uniform(*bounds, (_STARTS, terms)), axis=1)
    errors = np.array([local_minimum(annuli, each, bounds).cost ** 0.5 for each in starts])
    return float(np.mean(errors > _AS_GOOD * errors.min()))
