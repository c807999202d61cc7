"""The wrapper around nlopt: what it finds, and what it says where there is nothing to find."""

import nlopt
import numpy as np
import pytest

from sssfit.errors import FitError
from sssfit.fit._nlopt import _WORDS, minimise, minimise_by_simplex

ANYWHERE = {"lower": np.full(2, -np.inf), "upper": np.full(2, np.inf)}


def bowl(x):
    """(x0 - 1)^2 + 4 (x1 + 2)^2 and its gradient: lowest at (1, -2)."""
    return float((x[0] - 1) ** 2 + 4 * (x[1] + 2) ** 2), np.array((2 * x[0] - 2, 8 * x[1] + 16))


def test_it_finds_the_bottom_and_says_so():
    found = minimise(bowl, np.array((5.0, 5.0)), **ANYWHERE)
    np.testing.assert_allclose(found.x, (1, -2), atol=1e-8)
    assert found.stop_reason.startswith("converged")
    assert 0 < found.evaluations < 100
    assert found.value == bowl(found.x)[0]


def test_bounds_and_an_equality_hold():
    # On x0 + x1 = 3 the lowest point is (4.2, -1.2), by hand; where x0 <= 2 it is (2, 1).
    def equality(x):
        return float(x[0] + x[1] - 3), np.ones(2)

    upper = np.array((2.0, np.inf))
    lower = np.full(2, -np.inf)
    found = minimise(bowl, np.array((9.0, 9.0)), lower=lower, upper=upper, equality=equality)
    np.testing.assert_allclose(found.x, (2, 1), atol=1e-8)
    free = minimise(bowl, np.zeros(2), **ANYWHERE, equality=equality)
    np.testing.assert_allclose(free.x, (4.2, -1.2), atol=1e-8)


def test_an_optimum_of_zero_is_no_failure():
    found = minimise(lambda x: (float(x @ x), 2 * x), np.array((3.0, 4.0)), **ANYWHERE)
    np.testing.assert_allclose(found.x, 0, atol=1e-8)
    assert found.stop_reason.startswith("converged")


def test_an_objective_that_is_nan_from_the_start_is_an_error():
    with pytest.raises(FitError, match=r"no usable point .*not a number"):
        minimise(lambda x: (np.nan, x), np.ones(2), **ANYWHERE)


def test_where_the_objective_becomes_nan_the_best_point_before_is_kept():
    def wall(x):
        return bowl(x) if x[1] > -1 else (np.nan, x)

    found = minimise(wall, np.array((5.0, 5.0)), **ANYWHERE)
    assert "not a number" in found.stop_reason
    assert found.value == bowl(found.x)[0] <= bowl(np.array((5.0, 5.0)))[0]
    assert found.x[1] > -1


def test_an_equality_that_cannot_hold_is_an_error():
    bounds = {"lower": np.zeros(2), "upper": np.ones(2)}
    with pytest.raises(FitError, match="no usable point"):
        minimise(bowl, np.ones(2), **bounds, equality=lambda x: (float(x.sum() - 9), np.ones(2)))


def test_an_error_of_the_objective_itself_is_not_swallowed():
    def broken(x):
        raise KeyError("mistake")

    with pytest.raises(KeyError, match="mistake"):
        minimise(broken, np.ones(2), **ANYWHERE)


def test_every_status_of_nlopt_has_words():
    named = {name for name in _WORDS if isinstance(getattr(nlopt, name, None), int)}
    assert named == set(_WORDS)


SIMPLEX = {"step": 0.5, "change": 1e-6, "value_change": 1e-12, "most_evaluations": 2000}


def valley(x):
    """Rosenbrock's, 0 at (1, 1)."""
    return float(100.0 * (x[1] - x[0] ** 2) ** 2 + (1.0 - x[0]) ** 2)


def test_the_simplex_finds_the_end_of_a_valley_without_a_gradient():
    wide = {"lower": np.full(2, -np.inf), "upper": np.full(2, np.inf)}
    found = minimise_by_simplex(valley, np.array((-1.2, 1.0)), **wide, **SIMPLEX)
    np.testing.assert_allclose(found.x, 1.0, atol=1e-5)
    assert found.value == valley(found.x)
    assert found.stop_reason == "converged: the simplex has shrunk to a point"


def test_the_simplex_stays_within_bounds():
    seen = []

    def watched(x):
        seen.append(x.copy())
        return valley(x)

    lower, upper = np.array((-2.0, -0.5)), np.array((0.5, 3.0))
    found = minimise_by_simplex(watched, np.array((9.0, 9.0)), lower=lower, upper=upper, **SIMPLEX)
    assert (np.array(seen) >= lower).all()
    assert (np.array(seen) <= upper).all()
    np.testing.assert_allclose(found.x, (0.5, 0.25), atol=1e-5)
    assert found.evaluations == len(seen)


def test_the_simplex_says_where_it_was_stopped():
    wide = {"lower": np.full(2, -np.inf), "upper": np.full(2, np.inf)}
    few = SIMPLEX | {"most_evaluations": 25}
    found = minimise_by_simplex(valley, np.array((-1.2, 1.0)), **wide, **few)
    assert (
        found.stop_reason == f"stopped after {found.evaluations} evaluations, the best of them kept"
    )
    assert found.evaluations < 30
