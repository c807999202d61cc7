"""Control variates under light that changes: equations 28 to 44 on sampled data, and Table 1.

F = 1 / (1 + y), G = 1 - y, y even in [0, 1], as in section 3 of the supplement; T independent.
"""

import json
import math

import numpy as np
import pytest

from sssfit.errors import ArgumentError
from sssfit.motion.table import (
    COLUMNS,
    PUBLISHED,
    PUBLISHED_COEFFICIENTS,
    measure_table,
    residual_integral,
)
from sssfit.motion.variate import (
    coefficient,
    estimator_variance,
    in_frame_coefficient,
    least_squares_coefficient,
    variance_split,
)

LN2 = math.log(2.0)
# Integrals over [0, 1].
MEAN_F, MEAN_G = LN2, 0.5
MEAN_FF, MEAN_GG, MEAN_FG = 0.5, 1.0 / 3.0, 2.0 * LN2 - 1.0
VAR_F, VAR_G = MEAN_FF - MEAN_F**2, MEAN_GG - MEAN_G**2
COV_FG = MEAN_FG - MEAN_F * MEAN_G
SIGMAS = 4.5


@pytest.fixture(scope="module")
def sampled():
    """T, F and G of 400 000 draws."""
    rng = np.random.default_rng(18)
    y = rng.random(400_000)
    return 1.0 + 2.0 * rng.standard_exponential(y.size), 1.0 / (1.0 + y), 1.0 - y


def with_stderr(values, statistic, batches=40):
    """A statistic (of columns) of all, and its standard error from 40 batches."""
    parts = [statistic(each) for each in np.array_split(values, batches, axis=1)]
    return statistic(values), np.std(parts, ddof=1) / math.sqrt(batches)


def assert_found(sampled, statistic, wanted):
    found, stderr = with_stderr(np.stack(sampled), statistic)
    assert abs(found - wanted) < SIGMAS * stderr, (found, wanted, stderr)


def test_the_estimator_is_unbiased_for_any_coefficient(sampled):
    """Equation 28, E(TG) known."""
    mean_tg = 3.0 * MEAN_G
    for alpha in (0.0, 0.477, 1.388):
        estimate = lambda v, a=alpha: a * mean_tg + (v[0] * v[1] - a * v[0] * v[2]).mean()  # noqa: E731
        assert_found(sampled, estimate, 3.0 * MEAN_F)


def test_the_optimum_under_stable_light(sampled):
    """Equations 29 and 31: .477."""
    optimum = COV_FG / VAR_G
    assert optimum == pytest.approx(0.4766, abs=5e-5)

    def found(v):
        matrix = np.cov(v[1], v[2])
        return float(coefficient(matrix[0, 1], matrix[1, 1]))

    assert_found(sampled, found, COV_FG / VAR_G)
    best = float(coefficient(COV_FG, VAR_G))
    variances = [
        float(estimator_variance(a, VAR_F, VAR_G, COV_FG)) for a in (best - 0.01, best, best + 0.01)
    ]
    assert variances[1] < min(variances[0], variances[2])


def test_the_variance_of_the_estimator(sampled):
    """Equation 30, for the products TF and TG."""
    for alpha in (0.0, 0.5, 1.388):

        def difference(v, a=alpha):
            tf, tg = v[0] * v[1], v[0] * v[2]
            matrix = np.cov(tf, tg)
            wanted = estimator_variance(a, matrix[0, 0], matrix[1, 1], matrix[0, 1])
            return np.var(tf - a * tg, ddof=1) / wanted - 1.0

        assert abs(difference(np.stack(sampled))) < 1e-10


@pytest.mark.parametrize("alpha", [0.0, 0.4766, 1.388])
def test_the_split_of_the_variance(sampled, alpha):
    """Equations 32 and 33."""
    mean = MEAN_F - alpha * MEAN_G
    variance = float(estimator_variance(alpha, VAR_F, VAR_G, COV_FG))
    split = variance_split(3.0, 4.0, mean, variance)
    assert split.total == pytest.approx(split.stable + split.crossed + split.temporal)
    assert_found(sampled, lambda v: np.var(v[0] * (v[1] - alpha * v[2])), split.total)


def test_stable_light_leaves_the_first_part(sampled):
    """Equation 34: Var(T) = 0."""
    split = variance_split(3.0, 0.0, 0.7, 0.2)
    assert (split.stable, split.crossed, split.temporal) == (pytest.approx(1.8), 0.0, 0.0)
    assert_found(
        sampled,
        lambda v: np.var(3.0 * (v[1] - 0.4 * v[2])),
        variance_split(
            3.0, 0.0, MEAN_F - 0.4 * MEAN_G, float(estimator_variance(0.4, VAR_F, VAR_G, COV_FG))
        ).total,
    )


def test_wild_light_asks_for_least_squares(sampled):
    """Equations 35 to 37: where Var(T) >> E(T)^2."""
    mean, variance = 0.3, 0.05
    split = variance_split(1e-4, 1.0, mean, variance)
    assert split.total == pytest.approx(variance + mean**2, rel=1e-6)  # equation 36
    best = float(least_squares_coefficient(MEAN_FG, MEAN_GG))
    assert_found(
        sampled,
        lambda v: float(least_squares_coefficient((v[1] * v[2]).mean(), (v[2] ** 2).mean())),
        best,
    )
    square = lambda a: MEAN_FF - 2.0 * a * MEAN_FG + a * a * MEAN_GG  # noqa: E731
    assert square(best) < min(square(best - 0.01), square(best + 0.01))


def test_a_variate_that_is_constant_in_a_frame(sampled):
    """Equations 38 to 43: alpha is 2 ln 2 = 1.386, and the residual has no mean."""
    optimum = MEAN_F / MEAN_G
    assert optimum == pytest.approx(1.386, abs=5e-4)

    def found(v):
        matrix = np.cov(v[0] * v[1], v[0])
        return float(in_frame_coefficient(matrix[0, 1], MEAN_G, matrix[1, 1]))

    assert_found(sampled, found, MEAN_F / MEAN_G)
    assert residual_integral(MEAN_F / MEAN_G) == pytest.approx(0.0, abs=1e-15)
    # Equation 40: under stable light any coefficient leaves E(T)^2 Var(F).
    for alpha in (0.0, 5.0):
        assert_found(sampled, lambda v, a=alpha: np.var(3.0 * v[1] - a * 3.0 * MEAN_G), 9.0 * VAR_F)


def test_the_optimum_leaves_the_variance_of_the_sampling(sampled):
    """Equation 44, with the variate constant in a frame."""
    alpha = MEAN_F / MEAN_G
    split = variance_split(3.0, 4.0, MEAN_F - alpha * MEAN_G, VAR_F)
    assert split.total == pytest.approx((4.0 + 9.0) * VAR_F)
    assert_found(sampled, lambda v: np.var(v[0] * (v[1] - alpha * MEAN_G)), split.total)
    worse = variance_split(3.0, 4.0, MEAN_F, VAR_F).total
    assert worse > 7.0 * split.total  # without a variate: the changes of light on top


def test_the_integral_of_the_residual():
    """The supplement, section 4.1.2."""
    assert residual_integral(1.388) == pytest.approx(-8.53e-4, abs=5e-7)


def test_a_constant_variate_has_no_coefficient():
    np.testing.assert_array_equal(coefficient([1.0, 2.0], [0.0, 4.0]), [0.0, 0.5])
    assert float(in_frame_coefficient(1.0, 0.0, 2.0)) == 0.0
    assert float(in_frame_coefficient(1.0, 2.0, 0.0)) == 0.0


@pytest.fixture(scope="module")
def measured():
    """Of 40 seeds; the 200 of the documents run under ``slow``."""
    return measure_table(seeds=40)


def assert_published(found):
    """Every value of the supplement's Table 1 within 20 %, and its coefficients."""
    told = json.loads(json.dumps(found.to_dict()))
    for light, row in PUBLISHED.items():
        assert list(told["table"][light]) == list(COLUMNS)
        assert list(told["published"][light].values()) == list(row)
        for name, published in zip(COLUMNS, row, strict=True):
            assert told["table"][light][name] == pytest.approx(published, rel=0.2)
            low, high = told["quartiles"][light][name]
            assert low < told["table"][light][name] < high
    for name, published in PUBLISHED_COEFFICIENTS.items():
        assert told["coefficients"][name] == pytest.approx(published, abs=0.003)
    assert told["largest_deviation"] < 0.2


def test_table_1_is_the_published_one(measured):
    assert_published(measured)


@pytest.mark.slow
def test_table_1_of_200_seeds():
    assert_published(measure_table())


def test_what_the_table_is_for(measured):
    """Its two criteria: as much variance as without a variate when still, less when moving."""
    medians = {
        k: dict(zip(COLUMNS, np.median(v, axis=0), strict=True)) for k, v in measured.errors.items()
    }
    still, moving = medians["still"], medians["moving"]
    assert still["Res_hat_EMCM"] == pytest.approx(still["Res_f"], rel=0.1)
    assert still["Res_EMCM"] < 0.5 * still["Res_f"]  # too few samples where nothing moves
    assert still["Res_f"] < moving["Res_hat_EMCM"] < 0.2 * moving["Res_f"]


def test_a_table_is_that_of_its_seeds(measured):
    again = measure_table(seeds=3, seed=2)
    np.testing.assert_array_equal(again.errors["moving"], measured.errors["moving"][1:4])
    assert measured.traces["moving"].residual.shape == (6, 100)
    np.testing.assert_array_equal(measured.traces["still"].coefficient[0], 0.0)
    assert len({*measured.traces["moving"].coefficient[5]}) == 1


def test_the_text_has_every_figure(measured):
    text = measured.text()
    assert "Medians over 40 seeds" in text
    assert "coefficient, in-frame: 1.386" in text
    assert all(name in text for name in COLUMNS)


@pytest.mark.parametrize("seeds", [0, -1, 10_001, 2.0, True, "3", None])
def test_a_bad_number_of_seeds_is_refused_in_one_line(seeds):
    with pytest.raises(ArgumentError) as caught:
        measure_table(seeds=seeds)
    assert str(caught.value).startswith("seeds = ")
    assert "\n" not in str(caught.value)
