"""Statistics over seeds, each with the range in which that of as many other seeds lies.

Ranges are of three standard deviations of the difference between two sets of seeds, so that a
boundary taken from them holds against another seed.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sssfit.arrays import FloatArray

_NEARLY_ALL = 0.99865  # the share of a normal distribution below three standard deviations
_MEDIAN = 1.2533  # sqrt(pi / 2): standard error of a median over that of a mean
_LEAST = 1e-12  # for logarithms


class Range(NamedTuple):
    """A statistic (N,) of N samples, and between what other seeds' lies."""

    at: FloatArray
    low: FloatArray
    high: FloatArray


def median_range(samples: Sequence[FloatArray]) -> Range:
    """Return the medians of positive samples of seeds, each (seeds,); refused fits are infinite.

    Logarithms are taken as normal, with a standard deviation that all samples share: it has the
    degrees of freedom of all. Where a fit was refused, others may be: the range has no upper end.
    """
    from scipy.stats import t

    logs = [np.log(np.maximum(each[np.isfinite(each)], _LEAST)) for each in samples]
    freedom = sum(max(len(each) - 1, 0) for each in logs)
    squares = sum(float(((each - each.mean()) ** 2).sum()) for each in logs if len(each) > 1)
    deviation = np.sqrt(squares / max(freedom, 1))
    sigmas = float(t.ppf(_NEARLY_ALL, max(freedom, 1)))
    apart = [sigmas * deviation * _MEDIAN * np.sqrt(2.0 / len(each)) for each in samples]
    factor = np.exp(apart)
    middle = np.array([np.median(each) for each in samples])
    least = np.array([each.min() for each in samples])
    is_whole = np.array([bool(np.isfinite(each).all()) for each in samples])
    low = np.where(np.isfinite(middle), middle / factor, least)
    return Range(middle, low, np.where(is_whole, middle * factor, np.inf))


def spread_range(samples: Sequence[FloatArray]) -> Range:
    """Return standard deviations; of two sets of seeds their squares have an F ratio."""
    from scipy.stats import f

    spread = np.array([_deviation(each) for each in samples])
    freedom = np.array([len(each) - 1 for each in samples])
    ratio = np.sqrt(f.ppf(_NEARLY_ALL, freedom, freedom))
    return Range(spread, spread / ratio, spread * ratio)


def bias_range(samples: Sequence[FloatArray]) -> Range:
    """Return absolute means; those of two sets of n seeds differ by sqrt(2 / n) of the spread.

    The spread is that of the seeds themselves, so the difference has a t distribution.
    """
    from scipy.stats import t

    whole = [bool(np.isfinite(each).all()) for each in samples]
    bias = np.array(
        [
            abs(each.mean()) if is_whole else np.inf
            for each, is_whole in zip(samples, whole, strict=True)
        ]
    )
    counts = np.array([len(each) for each in samples])
    spread = np.array([_deviation(each) for each in samples])
    apart = t.ppf(_NEARLY_ALL, counts - 1) * np.sqrt(2.0 / counts) * spread
    low = np.where(
        whole, np.maximum(np.where(whole, bias, 0.0) - np.where(whole, apart, 0.0), 0.0), np.inf
    )
    return Range(bias, low, bias + apart)


def _deviation(sample: FloatArray) -> float:
    """Return the standard deviation over seeds, infinite where a fit was refused."""
    return float(np.std(sample, ddof=1)) if np.isfinite(sample).all() else np.inf
