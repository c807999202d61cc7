"""Sums of Gaussians in the coordinates of their grid: best weights, and descents."""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sssfit._jit import jit
from sssfit._jit.small_matrices import dot, down_columns, least_squares, orthogonalise, positive
from sssfit._jit.trust_region import (
    SCALE,
    coleman_li,
    decomposed,
    feasible,
    selected,
    step_within,
)

FloatArray = npt.NDArray[np.floating[Any]]
BoolArray = npt.NDArray[np.bool_]

_RANK = 1e-12  # columns closer than this, such as Gaussians of equal variance, count as one
_LARGEST_SUM = 10.0
_MIN_STEP = 1e-9  # shorter ones are rounding


class Sum(NamedTuple):
    """A channel's sum of squares: ``sssfit.fit._gaussians_search.Annuli`` in few coordinates."""

    series: FloatArray  # (2, parts, K, D) of ``sssfit.fit._gaussians_basis.Basis``
    low: float  # bounds of log variances
    high: float
    scale: float  # by which coordinates are divided
    wanted: FloatArray  # (K+1,)
    total: float  # required sum of the weights, NaN where it is free
    signed: bool


@jit
def coordinates(objective: Sum, log_variances: FloatArray, out: FloatArray) -> None:
    """Write unit Gaussians' coordinates and log derivatives, (2, K+1, N)."""
    _, parts, size, nodes = objective.series.shape
    each = (objective.high - objective.low) / parts
    waves = np.empty(nodes)
    out[:] = 0.0
    for n in range(len(log_variances)):
        t = min(max(log_variances[n], objective.low), objective.high)
        part = min(int((t - objective.low) / each), parts - 1)
        x = 2.0 * (t - objective.low - part * each) / each - 1.0
        waves[0], waves[1] = 1.0, x
        for k in range(2, nodes):
            waves[k] = 2.0 * x * waves[k - 1] - waves[k - 2]
        over = np.exp(-0.5 * t) / objective.scale
        for kind in range(2):
            for row in range(size):
                value = 0.0
                for k in range(nodes):
                    value += objective.series[kind, part, row, k] * waves[k]
                out[kind, row, n] = over * value


@jit
def best_weights(
    objective: Sum,
    log_variances: FloatArray,
    weights: FloatArray,
    residual: FloatArray,
    jacobian: FloatArray,
) -> bool:
    """Write the best weights (N,) for given variances, the residual (K+1,) and its Jacobian.

    The Jacobian is (K+1, N). False if there is no solution; see ``Annuli.at``.
    """
    rows, terms = len(objective.wanted), len(log_variances)
    columns = np.empty((2, rows, terms))
    coordinates(objective, log_variances, columns)
    is_free, free = np.ones(terms, np.bool_), np.empty(terms, np.intp)
    is_tied = not np.isnan(objective.total)
    if not objective.signed and not _mark_positive(objective, columns, is_free):
        return False
    count = 0
    for k in range(terms):
        weights[k] = 0.0
        if is_free[k]:
            free[count] = k
            count += 1
    if is_tied:
        count -= 1  # the last weight follows from the total
    if count < 0:
        return False
    basis, aim, norms = np.empty((rows, count)), np.empty(rows), np.zeros(count)
    for i in range(rows):
        last = columns[0, i, free[count]] if is_tied else 0.0
        aim[i] = objective.wanted[i] - (objective.total * last if is_tied else 0.0)
        for k in range(count):
            basis[i, k] = columns[0, i, free[k]] - last
            norms[k] += basis[i, k] ** 2
    for k in range(count):
        norms[k] = np.sqrt(norms[k]) if norms[k] > 0.0 else 1.0  # 0: equal variances
        for i in range(rows):
            basis[i, k] /= norms[k]
    upper = np.empty((count, count))
    orthogonalise(basis, upper)
    found = least_squares(upper, down_columns(basis, aim), _RANK)
    left, size = objective.total, 0.0
    for k in range(count):
        weights[free[k]] = found[k] / norms[k]
        left -= weights[free[k]]
    if is_tied:
        weights[free[count]] = left
    for k in range(terms):
        size += abs(weights[k])
    if size > _LARGEST_SUM * max(1.0, objective.total if is_tied else 0.0):
        return False
    for i in range(rows):
        residual[i] = objective.wanted[i]
        for k in range(terms):
            residual[i] -= columns[0, i, k] * weights[k]
            jacobian[i, k] = -columns[1, i, k] * weights[k]
    for k in range(terms):
        for j in range(count):
            product = 0.0
            for i in range(rows):
                product += basis[i, j] * jacobian[i, k]
            for i in range(rows):
                jacobian[i, k] -= product * basis[i, j]
    return True


@jit
def _mark_positive(objective: Sum, columns: FloatArray, is_free: BoolArray) -> bool:
    """Mark the weights that are not 0 at the optimum; see ``Annuli._positive_weights``."""
    rows, terms = columns.shape[1:]
    is_tied = not np.isnan(objective.total)
    both, upper = np.empty((rows, terms + 1)), np.empty((terms + 1, terms + 1))
    for i in range(rows):
        for k in range(terms):
            own = columns[0, i, k]
            both[i, k] = objective.total * own - objective.wanted[i] if is_tied else own
        both[i, terms] = 0.0 if is_tied else objective.wanted[i]
    orthogonalise(both, upper)
    under, aim = np.empty((terms + 1, terms)), np.empty(terms + 1)
    for i in range(terms + 1):
        aim[i] = upper[i, terms]
        for k in range(terms):
            under[i, k] = 1.0 if is_tied and i == terms else upper[i, k]
    if is_tied:
        aim[terms] = 1.0
    return positive(under, aim, is_free)


@jit
def descend(
    objective: Sum, start: FloatArray, tolerance: float, most: int
) -> tuple[FloatArray, bool, int]:
    """Descend from log variances; return those of the end, if it converged, and evaluations.

    ``tolerance`` is the relative gain of a step at which a descent has converged, ``most`` the
    largest number of evaluations.
    """
    low, high, n, rows = objective.low, objective.high, len(start), len(objective.wanted)
    x, weights = feasible(start, low, high, 1e-10), np.empty(n)
    residual, jacobian = np.empty(rows), np.empty((rows, n))
    new_residual, new_jacobian, j_h = np.empty(rows), np.empty((rows, n)), np.empty((rows, n))
    if not best_weights(objective, x, weights, residual, jacobian):
        return x, True, 1
    gradient = down_columns(jacobian, residual)
    cost = 0.5 * dot(residual, residual)
    v, dv, d, diagonal, g_h = np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    coleman_li(x, gradient, low, high, v, dv, d)
    square = 0.0
    for k in range(n):
        square += (x[k] / d[k]) ** 2
    radius = np.sqrt(square) if square > 0.0 else 1.0
    alpha, count = 0.0, 1
    while count < most:
        steepest = coleman_li(x, gradient, low, high, v, dv, d)
        theta = max(0.995, 1.0 - steepest)
        for k in range(n):
            diagonal[k], g_h[k] = gradient[k] * dv[k] * SCALE, d[k] * gradient[k]
            for i in range(rows):
                j_h[i, k] = d[k] * jacobian[i, k]
        uf, values, right = decomposed(j_h, residual, diagonal)
        reduction, is_done = -1.0, False
        while reduction <= 0.0 and count < most:
            p_h, alpha = step_within(uf, values, right, radius, alpha, rows)
            step_h, predicted = selected(x, j_h, diagonal, g_h, p_h, d, radius, low, high, theta)
            x_new = x.copy()
            for k in range(n):
                x_new[k] += d[k] * step_h[k]
            moved = 0.0
            for k in range(n):
                moved += (d[k] * step_h[k]) ** 2
            x_new = feasible(x_new, low, high, 0.0)
            is_feasible = best_weights(objective, x_new, weights, new_residual, new_jacobian)
            count += 1
            length = np.sqrt(dot(step_h, step_h))
            if not is_feasible:
                radius = 0.25 * length
                continue
            cost_new = 0.5 * dot(new_residual, new_residual)
            reduction = cost - cost_new
            ratio = 1.0 if predicted == 0.0 and reduction == 0.0 else 0.0
            if predicted > 0.0:
                ratio = reduction / predicted
            before = radius
            if ratio < 0.25:
                radius = 0.25 * length
            elif ratio > 0.75 and length > 0.95 * radius:
                radius *= 2.0
            small = _MIN_STEP * (_MIN_STEP + np.sqrt(dot(x, x)))
            is_done = (reduction < tolerance * cost and ratio > 0.25) or np.sqrt(moved) < small
            if is_done:
                break
            alpha *= before / radius
        if reduction > 0.0:
            x, cost = x_new, cost_new
            residual, new_residual = new_residual, residual
            jacobian, new_jacobian = new_jacobian, jacobian
            gradient = down_columns(jacobian, residual)
        if is_done:
            return x, True, count
    return x, False, count
