"""Gaussians: sums of 1 to 10, where variances fall together and searches end in local minima."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from sssfit.fit._gaussians_objective import Annuli, make_annuli
from sssfit.fit._gaussians_search import GaussianSum, fitted_annuli, local_minimum, search
from sssfit.fit._target import make_target
from sssfit.stability.curve import Axis, Curve
from sssfit.stability.optics import CONDITION_LIMIT, condition_number
from sssfit.stability.panel import Panel
from sssfit.stability.subject import Subject

ERROR_LIMIT = 0.01  # of the profile, r-weighted, as the literature has it
MISSED_LIMIT = 0.5  # of the starts
NEAR_LIMIT = 0.5  # 1 / ratio of neighbouring widths: nearer ones trade their weights
_COUNTS = tuple(range(1, 11))
_STARTED = (1, 2, 4, 6, 8, 10)
_STARTS, _AS_GOOD = 16, 1.01  # of the error of the best start
_NARROWEST = 0.25  # of the first annulus, as the fit has it
_ADVICE = "fewer Gaussians; six serve skin and marble"
_ADVICE_ERROR = "more Gaussians; six serve skin and marble"


def stress(subject: Subject) -> list[Panel]:
    """Fit 1 to 10 Gaussians, signed and not, and each number from 16 random starts."""
    signs = {"weights above 0": False, "signed weights": True}
    work = [(signed, terms) for terms in reversed(_STARTED) for signed in signs.values()]
    missed = dict(zip(work, subject.each(_missed, work), strict=True))
    fits = dict(zip(signs, subject.each(sums, signs.values()), strict=True))
    few, many = (Axis("Gaussians", float(_COUNTS[k]), is_log=False) for k in (0, -1))
    return [
        Panel(
            stress="gaussians",
            title="error of the profile",
            y_label="relative error",
            limit=ERROR_LIMIT,
            curves=[
                _curve(label, [each.error for each in own], _ADVICE_ERROR)
                for label, own in fits.items()
            ],
            fails="too few Gaussians near the beam",
            axis=many,
        ),
        Panel(
            stress="gaussians",
            title="starts that miss the best minimum",
            y_label="share of 16 random starts",
            limit=MISSED_LIMIT,
            curves=[_missing(label, signed, missed) for label, signed in signs.items()],
            fails="a single start ends in a local minimum",
            is_log=False,
            axis=few,
        ),
        Panel(
            stress="gaussians",
            title="how near neighbouring widths come",
            y_label="narrower / wider width",
            limit=NEAR_LIMIT,
            curves=[_curve(label, [nearest(each) for each in own]) for label, own in fits.items()],
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
                _curve(label, [condition_number(each.variances_mm2) for each in own])
                for label, own in fits.items()
            ],
            fails="weights are lost in rounding",
            axis=few,
        ),
    ]


def _curve(label: str, values: Sequence[float], advice: str = _ADVICE) -> Curve:
    return Curve(label, np.array(_COUNTS), np.array(values), advice=advice)


def sums(subject: Subject, signed: bool) -> list[GaussianSum]:
    """Return the best sums of 1 to 10 Gaussians for the first channel."""
    annuli, (least, most) = _objective(subject, signed)
    return [search(annuli, each, math.exp(least), math.exp(most)) for each in _COUNTS]


def nearest(found: GaussianSum) -> float:
    """Return the largest ratio of a width to the next wider one; 0 for a single Gaussian."""
    variances = found.variances_mm2
    return float(np.sqrt(variances[:-1] / variances[1:]).max(initial=0.0))


def _objective(subject: Subject, signed: bool) -> tuple[Annuli, tuple[float, float]]:
    """Return what `fit_gaussians` minimises for the first channel, and bounds of log variances."""
    target = make_target(subject.profile, subject.mm_per_pixel)
    edges_mm, energy = fitted_annuli(target, 0)
    annuli = make_annuli(edges_mm, energy, float(target.total[0] / energy.sum()), signed=signed)
    return annuli, (2.0 * math.log(_NARROWEST * edges_mm[1]), 2.0 * math.log(edges_mm[-1]))


def _missing(label: str, signed: bool, missed: Mapping[tuple[bool, int], float]) -> Curve:
    """Return the shares by numbers of terms, and between what those of other starts lie."""
    shares = np.array([missed[signed, terms] for terms in _STARTED])
    # Of two sets of starts; a share of 0 or 1 is taken as one start from it.
    likely = (shares * _STARTS + 1.0) / (_STARTS + 2.0)
    apart = 3.0 * np.sqrt(2.0 * likely * (1.0 - likely) / _STARTS)
    low, high = np.maximum(shares - apart, 0.0), np.minimum(shares + apart, 1.0)
    return Curve(label, np.array(_STARTED), shares, low, high, _ADVICE)


def _missed(subject: Subject, given: tuple[bool, int]) -> float:
    """Return the share of random starts that end over 1 % above the best one's error."""
    signed, terms = given
    annuli, bounds = _objective(subject, signed)
    rng = np.random.default_rng((subject.seed, terms))
    starts = np.sort(rng.uniform(*bounds, (_STARTS, terms)), axis=1)
    errors = np.array([local_minimum(annuli, each, bounds).cost ** 0.5 for each in starts])
    return float(np.mean(errors > _AS_GOOD * errors.min()))
