"""The optimisers: nlopt's SLSQP and scipy's simplex, with their stop reasons as text.

SLSQP is sequential quadratic programming (Kraft 1988, "A software package for sequential quadratic
programming"), as NLopt ships it. Objectives should be scaled to values near 1 at the start and
second derivatives near 1 in every parameter, because its first step assumes the identity as
Hessian. This module handles four properties of nlopt: an objective that is NaN is reported as
success; rounding near an optimum of 0 raises; a start outside the bounds is refused; an exception
loses the result.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import FitError

Function = Callable[[FloatArray], tuple[float, FloatArray]]

FEASIBLE = 1e-9  # a point is feasible if the equality holds to this
_TO_ZERO = 1e-26  # absolute change that counts as none, for objectives whose optimum is 0
_MAX_EVALUATIONS = 2000

# By nlopt's names, because the numbers differ between releases.
_WORDS = {
    "SUCCESS": "converged",
    "FTOL_REACHED": "converged: the objective no longer changes",
    "XTOL_REACHED": "converged: the parameters no longer change",
    "MAXEVAL_REACHED": f"stopped after {_MAX_EVALUATIONS} evaluations, the best of them kept",
    "ROUNDOFF_LIMITED": "converged as far as rounding allows",
    "FORCED_STOP": "stopped where the objective was not a number; the best point before is kept",
    "FAILURE": "stopped without progress, the best point kept",
    "INVALID_ARGS": "the optimiser refused the problem",
    "OUT_OF_MEMORY": "out of memory",
}


@dataclass(frozen=True, slots=True, eq=False)
class Minimum:
    """The minimum of an objective: ``x`` (n,), its ``value``, and how it was found."""

    x: FloatArray
    value: float
    evaluations: int
    stop_reason: str


class _TrackedObjective:
    """Calls the objective, and keeps the best feasible point and the count."""

    def __init__(self, objective: Function, equality: Function | None) -> None:
        self.objective, self.equality = objective, equality
        self.evaluations = 0
        self.value = np.inf
        self.x: FloatArray | None = None

    def __call__(self, x: FloatArray, gradient: FloatArray) -> float:
        import nlopt

        self.evaluations += 1
        value, slope = self.objective(x)
        if not (np.isfinite(value) and np.isfinite(slope).all()):
            raise nlopt.ForcedStop
        if value < self.value and (self.equality is None or abs(self.equality(x)[0]) <= FEASIBLE):
            self.value, self.x = value, x.copy()
        if gradient.size:
            gradient[:] = slope
        return value


def minimise(
    objective: Function,
    start: FloatArray,
    *,
    lower: FloatArray,
    upper: FloatArray,
    equality: Function | None = None,
    relative_change: float = 1e-12,
) -> Minimum:
    """Minimise a smooth function within bounds and, if given, subject to equality(x) = 0.

    Parameters
    ----------
    objective, equality : callable
        From x (n,) to a value and its gradient (n,).
    start : array (n,)
        Moved into the bounds.
    lower, upper : array (n,)
        May be infinite.
    relative_change : float
        Change of the objective from one step to the next below which the search ends.

    Returns
    -------
    Minimum
        The best feasible point found, even if nlopt gave up; the stop reason says so.

    Raises
    ------
    FitError
        No point found was both feasible and finite.
    """
    import nlopt  # only fits need it

    tracked = _TrackedObjective(objective, equality)
    solver = nlopt.opt(nlopt.LD_SLSQP, start.size)
    solver.set_min_objective(tracked)
    if equality is not None:
        solver.add_equality_constraint(_filling(equality), FEASIBLE)
    solver.set_lower_bounds(lower)
    solver.set_upper_bounds(upper)
    solver.set_ftol_rel(relative_change)
    solver.set_ftol_abs(_TO_ZERO)
    solver.set_maxeval(_MAX_EVALUATIONS)
    reason = _run(solver, np.clip(start, lower, upper))
    if tracked.x is None:
        raise FitError(
            f"the optimiser met no usable point ({reason}); expected finite energies and settings: "
            "try a larger `mm_per_pixel` or another method."
        )
    return Minimum(tracked.x, tracked.value, tracked.evaluations, reason)


def minimise_by_simplex(
    objective: Callable[[FloatArray], float],
    start: FloatArray,
    *,
    step: float,
    lower: FloatArray,
    upper: FloatArray,
    change: float,
    value_change: float,
    most_evaluations: int,
) -> Minimum:
    """Minimise a function without a gradient within bounds: Nelder and Mead 1965.

    Parameters
    ----------
    objective : callable
        From x (n,) to a finite value.
    start : array (n,)
        Moved into the bounds; the other corners of the first simplex are ``step`` away, inwards.
    lower, upper : array (n,)
    change, value_change : float
        Ranges of the parameters and of the objective across the simplex; the search ends below
        both.
    most_evaluations : int
    """
    from scipy.optimize import Bounds, minimize  # 0.8 s that other methods do not need

    start = np.clip(start, lower, upper)
    inwards = np.where(start + step <= upper, step, -step)
    found = minimize(
        objective,
        start,
        method="Nelder-Mead",
        bounds=Bounds(lower, upper),
        options={
            "initial_simplex": np.vstack((start, start + np.diag(inwards))),
            "xatol": change,
            "fatol": value_change,
            "maxfev": most_evaluations,
            "adaptive": True,  # Gao and Han 2012: steps that suit many parameters
        },
    )
    reason = (
        "converged: the simplex has shrunk to a point"
        if found.success
        else f"stopped after {found.nfev} evaluations, the best of them kept"
    )
    return Minimum(found.x, float(found.fun), int(found.nfev), reason)


def root(function: Callable[[float], float], low: float, high: float) -> tuple[float, int, str]:
    """Find a zero of a function between two points where its signs differ (Brent's method).

    Returns
    -------
    float, int, str
        The zero, the evaluations, and the stop reason in words.
    """
    from scipy.optimize import brentq  # 0.2 s that other methods do not need

    x, found = brentq(function, low, high, xtol=1e-14, full_output=True, disp=False)
    if found.converged:
        return float(x), found.function_calls, "converged as far as rounding allows"
    return float(x), found.function_calls, f"stopped after {found.iterations} steps, the last kept"


def _filling(function: Function) -> Callable[[FloatArray, FloatArray], float]:
    """Return a function with nlopt's interface, which writes the gradient if requested."""

    def call(x: FloatArray, gradient: FloatArray) -> float:
        value, slope = function(x)
        if gradient.size:
            gradient[:] = slope
        return value

    return call


def _run(solver: Any, start: FloatArray) -> str:
    """Run the optimiser and return the stop reason in words."""
    import nlopt

    try:
        solver.optimize(start)
    except nlopt.ForcedStop:
        return _WORDS["FORCED_STOP"]
    except nlopt.RoundoffLimited:
        return _WORDS["ROUNDOFF_LIMITED"]
    except MemoryError:
        return _WORDS["OUT_OF_MEMORY"]
    except ValueError:
        return _WORDS["INVALID_ARGS"]
    except RuntimeError:
        return _WORDS["FAILURE"]
    code = solver.last_optimize_result()
    names = (name for name in _WORDS if getattr(nlopt, name, None) == code)
    return _WORDS.get(next(names, ""), f"ended with nlopt's code {code}")
