"""Moving means, variances and covariances: the weighted two-pass formula, and its ends."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reference_motion import ewma_covariance, weighted_covariance, weighted_mean, weights

from sssfit.errors import ArgumentError
from sssfit.motion.moving import (
    MovingCovariance,
    MovingMean,
    MovingVariance,
    batch_covariance,
)
from sssfit.motion.reproject import reprojected
from sssfit.motion.residual import MovingResidual, squared_weights
from sssfit.motion.variate import coefficient

NAN = float("nan")


def frames(seed, count=60, shape=(3, 4)):
    """Two dependent variables with a drift and jumps, as images over frames."""
    rng = np.random.default_rng(seed)
    x = rng.standard_normal((count, *shape)).cumsum(axis=0)
    x[rng.random(count) < 0.2] += 5.0
    return x, 0.3 * x + rng.standard_normal(x.shape)


@pytest.mark.parametrize("blend", [0.0, 0.05, 0.2, 0.5, 0.9, 1.0])
def test_every_estimate_is_the_weighted_two_pass_formula(blend):
    """Equations 1 to 21, after every frame."""
    x, y = frames(1)
    mean, variance, matrix = MovingMean(blend), MovingVariance(blend), MovingCovariance(blend)
    for n in range(len(x)):
        mean.update(x[n])
        variance.update(x[n])
        matrix.update(x[n], y[n])
        if n not in (0, 1, 7, 59):
            continue
        for at in np.ndindex(x.shape[1:]):
            past_x, past_y = ([*each[(slice(n + 1), *at)]] for each in (x, y))
            wanted = weighted_covariance(past_x, past_x, blend)
            both = weighted_covariance(past_x, past_y, blend)
            assert mean.mean[at] == pytest.approx(
                weighted_mean(past_x, blend), rel=1e-12, abs=1e-12
            )
            assert variance.variance[at] == pytest.approx(wanted, rel=1e-12, abs=1e-12)
            assert matrix.covariance[(0, 0, *at)] == pytest.approx(wanted, rel=1e-12, abs=1e-12)
            assert matrix.covariance[(0, 1, *at)] == pytest.approx(both, rel=1e-12, abs=1e-12)
            assert matrix.covariance[(1, 0, *at)] == matrix.covariance[(0, 1, *at)]
            assert matrix.mean[(1, *at)] == pytest.approx(weighted_mean(past_y, blend), rel=1e-12)


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.floats(-1e3, 1e3), min_size=1, max_size=30),
    st.floats(0.0, 1.0),
    st.floats(-5.0, 5.0),
)
def test_of_any_numbers_too(values, blend, slope):
    matrix = MovingCovariance(blend)
    for x in values:
        matrix.update(x, slope * x + 1.0)
    wanted = weighted_covariance(values, values, blend)
    size = 1e-12 * max(abs(x) for x in values) ** 2
    assert matrix.covariance[0, 0] == pytest.approx(wanted, rel=1e-12, abs=size + 1e-300)
    assert matrix.covariance[0, 1] == pytest.approx(
        slope * wanted, rel=1e-12, abs=8.0 * size + 1e-12
    )


@pytest.mark.parametrize("blend", [0.05, 0.2, 0.7])
def test_ewma_is_the_same_without_a_factor(blend):
    """Equations 22 and 23; so both give the same coefficients."""
    x, y = frames(2, count=25, shape=(2, 1))
    exact, ewma = MovingCovariance(blend), MovingCovariance(blend, is_ewma=True)
    single = MovingVariance(blend, is_ewma=True)
    for n in range(len(x)):
        exact.update(x[n], y[n])
        ewma.update(x[n], y[n])
        single.update(x[n])
    wanted = ewma_covariance([*x[:, 1, 0]], [*y[:, 1, 0]], blend)
    assert ewma.covariance[0, 1, 1, 0] == pytest.approx(wanted, rel=1e-12)
    np.testing.assert_allclose(exact.covariance, (1.0 - blend) * ewma.covariance, rtol=1e-12)
    np.testing.assert_array_equal(single.variance, ewma.covariance[0, 0])


def test_three_variables_have_a_matrix_that_is_not_negative():
    rng = np.random.default_rng(3)
    matrix = MovingCovariance(0.1)
    for _ in range(40):
        matrix.update(*rng.standard_normal((3, 5, 6)))
    assert matrix.covariance.shape == (3, 3, 5, 6)
    values = np.linalg.eigvalsh(matrix.covariance.transpose(2, 3, 0, 1))
    assert (values > 0.0).all()


def test_a_blend_of_zero_keeps_the_first_frame():
    x, y = frames(4, count=5)
    mean, matrix = MovingMean(0.0), MovingCovariance(0.0)
    for n in range(5):
        mean.update(x[n])
        matrix.update(x[n], y[n])
    np.testing.assert_array_equal(mean.mean, x[0])
    np.testing.assert_array_equal(matrix.covariance, 0.0)


def test_a_blend_of_one_keeps_the_newest_frame():
    x, y = frames(5, count=5)
    mean, matrix, ewma = MovingMean(1.0), MovingCovariance(1.0), MovingCovariance(1.0, is_ewma=True)
    for n in range(5):
        mean.update(x[n])
        matrix.update(x[n], y[n])
        ewma.update(x[n], y[n])
    np.testing.assert_allclose(mean.mean, x[-1], rtol=1e-12)
    np.testing.assert_array_equal(matrix.covariance, 0.0)
    step = (x[-1] - x[-2]) * (y[-1] - y[-2])
    np.testing.assert_allclose(ewma.covariance[0, 1], step, rtol=1e-9, atol=1e-12)


def test_before_and_after_the_first_frame():
    mean, variance, matrix = MovingMean(0.2), MovingVariance(0.2), MovingCovariance(0.2)
    assert np.isnan(mean.mean)
    assert np.isnan(variance.mean)
    assert variance.variance == 0.0
    assert matrix.covariance == 0.0
    mean.update([1.0, 2.0])
    variance.update([1.0, 2.0])
    np.testing.assert_array_equal(mean.mean, [1.0, 2.0])
    np.testing.assert_array_equal(variance.mean, [1.0, 2.0])
    np.testing.assert_array_equal(variance.variance, [0.0, 0.0])


@pytest.mark.parametrize("gap", [NAN, np.inf, -np.inf])
def test_a_frame_that_is_no_number_leaves_a_pixel_as_it_was(gap):
    """As if the pixel had not had the frame; other pixels go on."""
    x, y = frames(6, count=12, shape=(2,))
    seen, whole = MovingCovariance(0.3), MovingCovariance(0.3)
    mean, variance = MovingMean(0.3), MovingVariance(0.3)
    for n in range(12):
        given_x = x[n].copy()
        if n in (0, 4, 5):
            given_x[0] = gap
        seen.update(given_x, y[n])
        mean.update(given_x)
        variance.update(given_x)
        whole.update(x[n], y[n])
    np.testing.assert_array_equal(seen.covariance[..., 1], whole.covariance[..., 1])
    kept = [n for n in range(12) if n not in (0, 4, 5)]
    wanted = weighted_covariance([*x[kept, 0]], [*y[kept, 0]], 0.3)
    assert seen.covariance[0, 1, 0] == pytest.approx(wanted, rel=1e-12)
    assert mean.mean[0] == pytest.approx(weighted_mean([*x[kept, 0]], 0.3), rel=1e-12)
    assert variance.variance[0] == pytest.approx(
        weighted_covariance([*x[kept, 0]], [*x[kept, 0]], 0.3), rel=1e-12
    )


def test_black_frames_and_still_ones_have_no_variance_and_no_coefficient():
    matrix = MovingCovariance(0.05)
    for _ in range(200):
        matrix.update(np.array([0.0, 0.1, 0.3]), np.array([0.0, 0.7, 1.0 / 3.0]))
    np.testing.assert_array_equal(matrix.covariance, 0.0)  # no rounding either
    np.testing.assert_array_equal(
        coefficient(matrix.covariance[0, 1], matrix.covariance[1, 1]), 0.0
    )


def test_the_covariance_of_means_is_that_of_a_sample_over_their_number():
    """Equation 27, within 4.5 of its standard errors, by 20 000 batches of nine."""
    rng = np.random.default_rng(7)
    x = rng.exponential(size=(9, 20_000))
    y = 0.5 * x + rng.standard_normal(x.shape)
    between = (x.mean(axis=0) - 1.0) * (y.mean(axis=0) - 0.5)  # of the known means
    within = batch_covariance(x, y)
    for found in (between, within):
        stderr = found.std(ddof=1) / np.sqrt(found.size)
        assert abs(found.mean() - 0.5 / 9.0) < 4.5 * stderr
    assert batch_covariance([1.0, 3.0], [2.0, 8.0]) == pytest.approx(6.0 / 2.0)


def test_the_sum_of_squared_weights():
    for blend in (0.0, 0.05, 0.2, 1.0):
        for last in (0, 1, 2, 30):
            wanted = sum(w * w for w in weights(last, blend))
            assert squared_weights(blend, last) == pytest.approx(wanted, rel=1e-12)


def residual_of(frames_of, counts, blend=0.2, alpha=0.0):
    moving = MovingResidual(blend)
    for f, g, n in zip(*frames_of, counts, strict=True):
        moving.update(f, g, alpha, n)
    return moving


def test_a_residual_without_variate_is_the_moving_variance():
    x, y = frames(8, count=20)
    moving = residual_of((x, y), [1] * 20)
    plain = MovingVariance(0.2)
    for each in x:
        plain.update(each)
    kept = 1.0 - sum(w * w for w in weights(19, 0.2))
    np.testing.assert_allclose(moving.variance, plain.variance / kept, rtol=1e-12)


def test_a_constant_coefficient_gives_the_moving_variance_of_the_residual():
    x, y = frames(9, count=20)
    moving = residual_of((x, y), [1] * 20, alpha=0.7)
    plain = MovingVariance(0.2)
    for a, b in zip(x, y, strict=True):
        plain.update(a - 0.7 * b)
    kept = 1.0 - sum(w * w for w in weights(19, 0.2))
    np.testing.assert_allclose(moving.variance, plain.variance / kept, rtol=1e-11)


@pytest.mark.parametrize("count", [1, 5, 64])
def test_frames_of_means_show_the_variance_of_one_sample(count):
    rng = np.random.default_rng(10)
    f = 0.3 + 0.5 * rng.standard_normal((30, 4000)) / np.sqrt(count)
    found = residual_of((f, np.ones_like(f)), [count] * 30).variance
    assert abs(found.mean() - 0.25) < 4.5 * found.std(ddof=1) / np.sqrt(found.size)


def test_a_frame_of_other_light_is_expected_to_vary_as_its_square():
    """Equation 44: over the frames E(T^2) Var(F), in one of them T^2 Var(F)."""
    rng = np.random.default_rng(11)
    t = np.where(np.arange(40) % 8 < 4, 1.0, 0.25)[:, None]
    f = t * (0.3 + 0.5 * rng.standard_normal((40, 4000)))
    moving = residual_of((f, 2.0 * t * np.ones_like(f)), [1] * 40, alpha=0.15)
    for ahead in (1.0, 0.25):
        found = moving.variance_at(2.0 * ahead * np.ones(4000))
        # The deviations of the mean carry light of other frames: 1/9 of the variance.
        assert found.mean() == pytest.approx(0.25 * ahead**2, rel=0.1)
    still = residual_of((f / t, np.full_like(f, 1.0 / 3.0)), [1] * 40)
    np.testing.assert_array_equal(still.variance_at(np.full(4000, 1.0 / 3.0)), still.variance)


def test_where_no_light_was_seen_the_variance_stays():
    moving = residual_of((np.array([[0.0], [1.0], [0.5]]), np.zeros((3, 1))), [1] * 3)
    np.testing.assert_array_equal(moving.variance_at(np.ones(1)), moving.variance)


@pytest.mark.parametrize("blend", [0.0, 1.0])
def test_a_residual_of_one_frame_has_no_variance(blend):
    x, y = frames(12, count=6)
    assert np.isnan(residual_of((x, y), [1] * 6, blend=blend).variance).all()
    assert np.isnan(residual_of((x, y), [1] * 6, blend=blend).variance_at(y[0])).all()


def test_a_residual_passes_over_frames_that_are_no_numbers():
    x, y = frames(13, count=9, shape=(2,))
    gap = x.copy()
    gap[[0, 5], 0] = NAN
    seen, whole = residual_of((gap, y), [3] * 9), residual_of((x, y), [3] * 9)
    kept = residual_of((np.delete(x, [0, 5], 0), np.delete(y, [0, 5], 0)), [3] * 7)
    assert seen.variance[1] == whole.variance[1]
    assert seen.variance[0] == kept.variance[0]
    np.testing.assert_array_equal(seen.frames, [7, 9])


def test_histories_move_with_the_picture():
    x, y = frames(14, count=8, shape=(5, 6))
    moved, still = MovingCovariance(0.2), MovingCovariance(0.2)
    mean, variance, residual = MovingMean(0.2), MovingVariance(0.2), MovingResidual(0.2)
    resting = residual_of((x, y), [2] * 8)
    for n in range(8):
        still.update(x[n], y[n])
        moved.update(x[n], y[n])
        mean.update(x[n])
        variance.update(x[n])
        residual.update(x[n], y[n], 0.0, 2)
    for each in (moved, mean, variance, residual):
        each.move((2, -1))
    np.testing.assert_array_equal(moved.covariance[..., 2:, :-1], still.covariance[..., :-2, 1:])
    np.testing.assert_array_equal(mean.mean[2:, :-1], still.mean[0, :-2, 1:])
    np.testing.assert_array_equal(variance.variance[2:, :-1], still.covariance[0, 0, :-2, 1:])
    np.testing.assert_array_equal(residual.variance[2:, :-1], resting.variance[:-2, 1:])
    is_new = np.ones((5, 6), dtype=bool)
    is_new[2:, :-1] = False
    assert np.isnan(mean.mean[is_new]).all()
    assert np.isnan(residual.variance[is_new]).all()
    assert (residual.frames[is_new] == 0).all()
    moved.update(x[0], y[0])  # a new pixel begins with its first frame
    np.testing.assert_array_equal(moved.mean[0][is_new], x[0][is_new])
    np.testing.assert_array_equal(moved.covariance[..., is_new], 0.0)


@pytest.mark.parametrize("shift", [(0, 0), (1, 0), (-2, 3), (5, 0), (0, -9)])
def test_reprojection_is_a_slice(shift):
    history = np.arange(60.0).reshape(2, 5, 6)
    found = reprojected(history, shift, -1.0)
    for y, x in np.ndindex(5, 6):
        before = y - shift[0], x - shift[1]
        is_inside = 0 <= before[0] < 5 and 0 <= before[1] < 6
        wanted = history[(slice(None), *before)] if is_inside else -1.0
        np.testing.assert_array_equal(found[:, y, x], wanted)


@pytest.mark.parametrize("blend", [-0.1, 1.1, NAN, None, "0.2", True, np.array([0.1])])
@pytest.mark.parametrize("kind", [MovingMean, MovingVariance, MovingCovariance, MovingResidual])
def test_a_bad_rate_is_refused_in_one_line(kind, blend):
    with pytest.raises(ArgumentError) as caught:
        kind(blend)
    assert str(caught.value).startswith("blend = ")
    assert str(caught.value).endswith("expected a rate from 0 to 1.")
    assert "\n" not in str(caught.value)


def test_frames_of_another_size_are_refused_in_one_line():
    for moving, first, second in (
        (MovingMean(0.1), (np.zeros(3),), (np.zeros(4),)),
        (MovingCovariance(0.1), (np.zeros(3), np.zeros(3)), (np.zeros(2), np.zeros(2))),
        (MovingResidual(0.1), (np.zeros(3), np.zeros(3), 0, 1), (np.zeros(2), np.zeros(2), 0, 1)),
    ):
        moving.update(*first)
        with pytest.raises(ArgumentError, match=r"a frame of shape .* after frames of"):
            moving.update(*second)
    with pytest.raises(ArgumentError, match="expected the same two or more"):
        batch_covariance([1.0], [2.0])
    with pytest.raises(ArgumentError, match="expected the same two or more"):
        batch_covariance([1.0, 2.0], [2.0, 3.0, 4.0])


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: MovingMean(0.1).update("x"), "a frame is not an array of numbers"),
        (lambda: MovingMean(0.1).update([[1.0], [2.0, 3.0]]), "a frame is not an array of numbers"),
        (lambda: MovingVariance(0.1).update(None), "a frame is not an array of numbers"),
        (
            lambda: MovingCovariance(0.1).update(np.ones((4, 4)), np.ones(3)),
            r"frames of the shapes \(4, 4\), \(3,\); expected the same of each",
        ),
        (lambda: MovingCovariance(0.1).update(), "frames of the shapes none"),
        (lambda: batch_covariance("x", "x"), "x is not an array of numbers"),
        (lambda: batch_covariance(1.0, 2.0), "expected the same two or more"),
    ],
)
def test_what_is_no_frame_is_refused_in_one_line(call, said):
    with pytest.raises(ArgumentError, match=said) as caught:
        call()
    assert "\n" not in str(caught.value)
