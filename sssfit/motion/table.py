"""Table 1 of the supplement, measured: five residuals and the true one, still and moving light.

Xie and Olano 2021, "Supplementary: Real-time Subsurface Control Variates", section 3. A frame
estimates the integral of f = h(t) / (1 + y) over [0, 1] from 16 samples, beside the control variate
g = h(t) (1 - y) with the known integral G = h(t) / 2. Light stands still, h = 1, or moves,
h = 1 + 3 sin(t / 10). The figure is the root of the moving variance of each residual, averaged over
the frames 25 to 100.

Medians over seeds: a coefficient of few frames is a ratio whose mean over seeds does not exist.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from sssfit.arrays import FloatArray, is_whole, plain
from sssfit.errors import ArgumentError
from sssfit.messages import shown, table
from sssfit.motion.moving import MovingCovariance, MovingMean, MovingVariance
from sssfit.motion.variate import coefficient, in_frame_coefficient

COLUMNS = ("Res_f", "Res_SF", "Res_SF_EMA", "Res_EMCM", "Res_hat_EMCM", "Res_GT")
_INTENSITY: Mapping[str, Callable[[int], float]] = {
    "still": lambda _: 1.0,
    "moving": lambda t: 1.0 + 3.0 * math.sin(t / 10.0),
}
PUBLISHED: Mapping[str, tuple[float, ...]] = {
    "still": (0.0325, 0.0160, 0.0058, 0.0070, 0.0324, 0.0055),
    "moving": (0.5585, 0.3797, 0.3742, 0.1295, 0.0732, 0.1243),
}
# Of the optimum under still light, under moving light, and with the variate constant in a frame.
PUBLISHED_COEFFICIENTS: Mapping[str, float] = {"still": 0.477, "moving": 1.388, "in_frame": 1.386}
LAST_FRAME, FIRST_COUNTED = 100, 25
BLEND_COVARIANCE, BLEND_RESIDUAL = 0.05, 0.2
_SAMPLES = 16
_TRUE_SAMPLES = {"still": 100_000, "moving": 1024}  # of all frames at once, or of a frame
_MOST_SEEDS = 10_000


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """A run over frames, of the first seed; a row for each of ``COLUMNS``.

    Parameters
    ----------
    coefficient, residual, error : array (6, 100)
        Values in the frames 1 to 100; the error is the root of the residual's moving variance.
    true_coefficient : float
    """

    coefficient: FloatArray
    residual: FloatArray
    error: FloatArray
    true_coefficient: float


@dataclass(frozen=True, slots=True, eq=False)
class VariateTable:
    """The measured table.

    Parameters
    ----------
    seeds : int
        Number of seeds.
    seed : int
        The first of them.
    errors : mapping of str to array (seeds, 6)
        Errors of "still" and "moving".
    coefficients : mapping of str to array (seeds,)
        Coefficients of "still", "moving" and "in_frame".
    traces : mapping of str to Trace
        Traces of "still" and "moving".
    """

    seeds: int
    seed: int
    errors: Mapping[str, FloatArray]
    coefficients: Mapping[str, FloatArray]
    traces: Mapping[str, Trace]

    @property
    def largest_deviation(self) -> float:
        """Largest relative deviation of a median from its published value."""
        return max(
            float(np.abs(np.median(errors, axis=0) / PUBLISHED[light] - 1.0).max())
            for light, errors in self.errors.items()
        )

    def to_dict(self) -> dict[str, Any]:
        """Return medians, quartiles and published values as ``sssfit motion --table --json``."""
        return plain(
            {
                "seeds": self.seeds,
                "seed": self.seed,
                "table": {k: _named(np.median(v, axis=0)) for k, v in self.errors.items()},
                "quartiles": {k: _named(_quartiles(v)) for k, v in self.errors.items()},
                "published": {k: _named(np.array(v)) for k, v in PUBLISHED.items()},
                "largest_deviation": self.largest_deviation,
                "coefficients": {k: float(np.median(v)) for k, v in self.coefficients.items()},
                "coefficient_quartiles": {k: _quartiles(v) for k, v in self.coefficients.items()},
                "published_coefficients": dict(PUBLISHED_COEFFICIENTS),
            }
        )

    def text(self) -> str:
        """Return the table as columns of text."""
        rows = []
        for light, errors in self.errors.items():
            low, high = _quartiles(errors).T
            rows.append([light, *(f"{each:.4f}" for each in np.median(errors, axis=0))])
            rows.append(
                ["  quartiles", *(f"{a:.4f}-{b:.4f}" for a, b in zip(low, high, strict=True))]
            )
            rows.append(["  published", *(f"{each:.4f}" for each in PUBLISHED[light])])
        lines = [
            f"Medians over {self.seeds} seeds of the root of the residual's moving variance",
            table(["light", *COLUMNS], rows),
            f"largest deviation from a published value {100.0 * self.largest_deviation:.1f} %",
        ]
        for name, found in self.coefficients.items():
            low, high = _quartiles(found)
            lines.append(
                f"coefficient, {name.replace('_', '-')}: {np.median(found):.4f} "
                f"({low:.4f} to {high:.4f}), published {PUBLISHED_COEFFICIENTS[name]}"
            )
        return "\n".join(lines)


def measure_table(*, seeds: int = 200, seed: int = 1) -> VariateTable:
    """Measure the table.

    Parameters
    ----------
    seeds : int
        Number of runs, 1 to 10 000; their random numbers do not depend on each other.
    seed : int
        Seed of the first; the others follow it.

    Raises
    ------
    ArgumentError
        The number of seeds is out of range.
    """
    if not (is_whole(seeds) and 1 <= seeds <= _MOST_SEEDS):
        raise ArgumentError(
            f"seeds = {shown(seeds)}; expected a whole number from 1 to {_MOST_SEEDS}."
        )
    errors, coefficients, traces = {}, {}, {}
    for k, light in enumerate(_INTENSITY):
        generators = [np.random.default_rng([seed + each, k]) for each in range(seeds)]
        true = np.array([_true_coefficients(each, light) for each in generators])
        coefficients[light] = true[:, 0]
        if light == "moving":
            coefficients["in_frame"] = true[:, 1]
        errors[light], traces[light] = _run(generators, _INTENSITY[light], true[:, 0])
    return VariateTable(seeds, seed, errors, coefficients, traces)


def residual_integral(alpha: float) -> float:
    """Return the integral of 1 / (1 + y) - alpha (1 - y) over [0, 1]: ln 2 - alpha / 2."""
    return math.log(2.0) - 0.5 * alpha


def _true_coefficients(random: np.random.Generator, light: str) -> tuple[float, float]:
    """Return the optimum by many samples, and that with the variate constant in a frame.

    Under still light the samples of one frame; under moving light the means of all frames, as
    covariances are those over time (section 3.2). The second is unknown under still light.
    """
    count = _TRUE_SAMPLES[light]
    if light == "still":
        y = random.random(count)
        matrix = np.cov(1.0 / (1.0 + y), 1.0 - y)
        return float(coefficient(matrix[0, 1], matrix[1, 1])), math.nan
    h = np.array([_INTENSITY[light](t) for t in range(LAST_FRAME + 1)])
    y = random.random((h.size, count))
    f, g = h * (1.0 / (1.0 + y)).mean(axis=1), h * (1.0 - y).mean(axis=1)
    matrix, with_t = np.cov(f, g), np.cov(f, h)
    in_frame = in_frame_coefficient(with_t[0, 1], 0.5, with_t[1, 1])
    return float(coefficient(matrix[0, 1], matrix[1, 1])), float(in_frame)


def _run(
    generators: list[np.random.Generator], light: Callable[[int], float], true: FloatArray
) -> tuple[FloatArray, Trace]:
    """Return the errors (seeds, 6), and the first seed's run, of one light.

    Frame 0 begins the histories; the coefficients after a frame serve the next one.
    """
    matrix = MovingCovariance(BLEND_COVARIANCE)
    smooth = MovingMean(BLEND_COVARIANCE)
    variances = [MovingVariance(BLEND_RESIDUAL) for _ in COLUMNS]
    before: tuple[FloatArray, ...] = ()
    total = np.zeros((len(COLUMNS), len(generators)))
    seen: list[FloatArray] = []
    for t in range(LAST_FRAME + 1):
        h = light(t)
        y = np.stack([each.random(_SAMPLES) for each in generators])
        f, g = h / (1.0 + y), h * (1.0 - y)
        f_mean, g_mean = f.mean(axis=1), g.mean(axis=1)
        if before:
            alphas = np.stack((np.zeros_like(true), *before, before[-1], true))
            variate = np.stack([g_mean] * len(COLUMNS))
            variate[COLUMNS.index("Res_hat_EMCM")] = 0.5 * h
            residuals = f_mean - alphas * variate
            errors = np.sqrt([v.update(r) for v, r in zip(variances, residuals, strict=True)])
            seen.append(np.stack((alphas, residuals, errors))[:, :, 0])
            total += errors * (t >= FIRST_COUNTED)
        single = _in_one_frame(f, g)
        matrix.update(f_mean, g_mean)
        moving = coefficient(matrix.covariance[0, 1], matrix.covariance[1, 1])
        before = single, smooth.update(single), moving
    alpha, residual, error = np.stack(seen, axis=2)
    return total.T / (LAST_FRAME + 1 - FIRST_COUNTED), Trace(alpha, residual, error, float(true[0]))


def _in_one_frame(f: FloatArray, g: FloatArray) -> FloatArray:
    """Return the coefficient of one frame's samples (seeds, 16)."""
    df, dg = (each - each.mean(axis=1, keepdims=True) for each in (f, g))
    return coefficient((df * dg).sum(axis=1), (dg * dg).sum(axis=1))


def _named(values: FloatArray) -> dict[str, Any]:
    return dict(zip(COLUMNS, values.tolist(), strict=True))


def _quartiles(values: FloatArray) -> FloatArray:
    """Return lower and upper quartile over seeds (..., 2)."""
    found: FloatArray = np.percentile(values, [25.0, 75.0], axis=0).T
    return found
