"""Newton steps in a trust region, held against those of scipy."""

import numpy as np
import pytest
from scipy import optimize

from sssfit.fit._trust_region import minimise


def saddle(x):
    """A function that curves down at its start, as the chains' true second derivatives may."""
    return float(np.cos(x).sum() + 0.05 * x @ x + 0.3 * x[0] * x[1]), (
        -np.sin(x) + 0.1 * x + 0.3 * np.array([x[1], x[0], *np.zeros(x.size - 2)])
    )


def saddle_curvature(x):
    found = np.diag(0.1 - np.cos(x))
    found[0, 1] = found[1, 0] = 0.3
    return found


def _never(_value):
    return False


CASES = {
    "a curved valley": (
        lambda x: (float(optimize.rosen(x)), optimize.rosen_der(x)),
        optimize.rosen_hess,
        np.array([-1.2, 1.0, 2.5, -0.7, 8.0]),
    ),
    "a saddle": (saddle, saddle_curvature, np.array([0.2, -0.1, 0.3, 3.0])),
    "a far bowl": (
        lambda x: (float(x @ x), 2.0 * x),
        lambda x: 2.0 * np.eye(x.size),
        np.full(3, 4000.0),
    ),
}


@pytest.mark.parametrize("most", [1, 3, 60])
@pytest.mark.parametrize("case", CASES)
def test_every_step_is_that_of_scipy(case, most):
    function, hessian, x = CASES[case]
    theirs = optimize.minimize(
        function,
        x,
        jac=True,
        hess=hessian,
        method="trust-ncg",
        options={"maxiter": most, "gtol": 1e-14},
    )
    ours = minimise(function, hessian, x, most=most, has_ended=_never)
    assert ours.x.tolist() == theirs.x.tolist()
    assert (ours.fun, ours.nfev) == (theirs.fun, theirs.nfev)


def test_it_ends_when_it_is_told_to():
    values = []

    def has_ended(value):
        values.append(value)
        return len(values) == 4

    function, hessian, x = CASES["a curved valley"]
    found = minimise(function, hessian, x, most=60, has_ended=has_ended)
    assert found.nfev == 5
    assert found.fun == values[-1]


@pytest.mark.parametrize("which", ["gradient", "curvature"])
def test_what_is_not_finite_ends_in_an_error_not_in_endless_steps(which):
    function, hessian, x = CASES["a far bowl"]
    bad = {
        "gradient": (lambda x: (0.0, x * np.nan), hessian),
        "curvature": (function, lambda x: np.full((x.size, x.size), np.nan)),
    }[which]
    with pytest.raises(ValueError, match="infs or NaNs"):
        minimise(*bad, x, most=5, has_ended=_never)
