"""Steps of a trust region for least squares within bounds, of few unknowns.

Those of ``scipy.optimize.least_squares`` with the method "trf" (Branch, Coleman and Li 1999, "A
subspace, interior, and conjugate gradient method for large-scale bound-constrained minimization
problems"), whose calls of a library for each small matrix take 50 times as long. What ends with
``_h`` is in units of the trust region, d of the unknowns' own.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit._jit import jit
from sssfit._jit.small_matrices import dot, down_columns, orthogonalise, scaled, singular_values

FloatArray = npt.NDArray[np.floating[Any]]

SCALE = 1.5  # of a log variance, a factor of 4.5: the unit of the trust region
_EPS = 2.220446049250313e-16


@jit
def decomposed(
    j_h: FloatArray, residual: FloatArray, diagonal: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return U^T f (n,), the singular values (n,) and V (n, n) of the Jacobian with its bounds."""
    rows, n = j_h.shape
    columns, aim = np.zeros((rows + n, n)), np.zeros(rows + n)
    for i in range(rows):
        aim[i] = residual[i]
        for k in range(n):
            columns[i, k] = j_h[i, k]
    for k in range(n):
        columns[rows + k, k] = np.sqrt(diagonal[k])
    upper, values, right = np.empty((n, n)), np.empty(n), np.empty((n, n))
    orthogonalise(columns, upper)
    inside = down_columns(columns, aim)
    singular_values(upper, values, right)
    return down_columns(upper, inside), values, right


@jit
def coleman_li(
    x: FloatArray,
    gradient: FloatArray,
    low: float,
    high: float,
    v: FloatArray,
    dv: FloatArray,
    d: FloatArray,
) -> float:
    """Write distances to the bounds that the descent moves to, else 1, their slopes, and scales.

    Returns the largest slope times its distance.
    """
    steepest = 0.0
    for k in range(len(x)):
        v[k], dv[k] = 1.0, 0.0
        if gradient[k] < 0.0:
            v[k], dv[k] = high - x[k], -1.0
        elif gradient[k] > 0.0:
            v[k], dv[k] = x[k] - low, 1.0
        steepest = max(steepest, abs(gradient[k] * v[k]))
        d[k] = np.sqrt(v[k] / SCALE if dv[k] != 0.0 else v[k]) * SCALE
    return steepest


@jit
def feasible(x: FloatArray, low: float, high: float, apart: float) -> FloatArray:
    """Return x within the bounds, off them by a relative distance or by rounding."""
    found = x.copy()
    near_low, near_high = apart * max(1.0, abs(low)), apart * max(1.0, abs(high))
    for k in range(len(x)):
        below, above = x[k] - low, high - x[k]
        if below <= min(above, near_low):
            found[k] = low + near_low if apart > 0.0 else np.nextafter(low, high)
        elif above <= min(below, near_high):
            found[k] = high - near_high if apart > 0.0 else np.nextafter(high, low)
        if found[k] < low or found[k] > high:
            found[k] = 0.5 * (low + high)
    return found


@jit
def step_within(
    uf: FloatArray,
    values: FloatArray,
    right: FloatArray,
    radius: float,
    alpha: float,
    rows: int,
) -> tuple[FloatArray, float]:
    """Return the least squares step within a radius, and the Levenberg-Marquardt parameter."""
    least, most, whole = values[0], values[0], 0.0
    for k in range(len(values)):
        least, most = min(least, values[k]), max(most, values[k])
        whole += (values[k] * uf[k]) ** 2
    is_whole = least > _EPS * rows * most
    lower, upper = 0.0, np.sqrt(whole) / radius
    if is_whole:
        step = _damped(uf, values, right, 0.0)
        if np.sqrt(dot(step, step)) <= radius:
            return step, 0.0
        phi, slope = _excess(0.0, uf, values, radius)
        lower = -phi / slope
    if not is_whole and alpha == 0.0:
        alpha = max(0.001 * upper, np.sqrt(lower * upper))
    for _ in range(10):
        if alpha < lower or alpha > upper:
            alpha = max(0.001 * upper, np.sqrt(lower * upper))
        phi, slope = _excess(alpha, uf, values, radius)
        if phi < 0.0:
            upper = alpha
        lower = max(lower, alpha - phi / slope)
        alpha -= (phi + radius) * phi / slope / radius
        if abs(phi) < 0.01 * radius:
            break
    step = _damped(uf, values, right, alpha)
    return scaled(step, radius / np.sqrt(dot(step, step))), alpha


@jit
def _damped(uf: FloatArray, values: FloatArray, right: FloatArray, alpha: float) -> FloatArray:
    """Return the step of least squares with alpha times its square."""
    step = np.zeros(len(uf))
    for k in range(len(uf)):
        under = values[k] ** 2 + alpha
        if under > 0.0:
            for i in range(len(uf)):
                step[i] -= right[i, k] * values[k] * uf[k] / under
    return step


@jit
def _excess(alpha: float, uf: FloatArray, values: FloatArray, radius: float) -> tuple[float, float]:
    """Return by how much a step is longer than the radius, and the slope over alpha."""
    square, slope = 0.0, 0.0
    for k in range(len(uf)):
        under = values[k] ** 2 + alpha
        own = (values[k] * uf[k] / under) ** 2
        square += own
        slope -= own / under
    length = np.sqrt(square)
    return length - radius, slope / length


@jit
def selected(
    x: FloatArray,
    j_h: FloatArray,
    diagonal: FloatArray,
    g_h: FloatArray,
    p_h: FloatArray,
    d: FloatArray,
    radius: float,
    low: float,
    high: float,
    theta: float,
) -> tuple[FloatArray, float]:
    """Return the best of the step, its reflection at a bound and steepest descent; and its gain."""
    n = len(x)
    origin = np.zeros(n)
    stride = _to_bound(x, origin, p_h, d, low, high)
    if stride >= 1.0:
        return p_h, -_along(j_h, g_h, p_h, origin, diagonal, 1.0, 1.0)[1]
    reflected = p_h.copy()
    for k in range(n):
        if p_h[k] != 0.0 and _stride(x[k], d[k] * p_h[k], low, high) == stride:
            reflected[k] = -p_h[k]
    p_h = scaled(p_h, stride)
    inside, outside = _to_radius(p_h, reflected, radius), _to_bound(x, p_h, reflected, d, low, high)
    most = min(outside, inside)
    least, longest = 0.0, -1.0
    if most > 0.0:
        least = (1.0 - theta) * stride / most
        longest = theta * outside if most == outside else inside
    gain_r = np.inf
    if least <= longest:
        t, gain_r = _along(j_h, g_h, reflected, p_h, diagonal, least, longest)
        for k in range(n):
            reflected[k] = t * reflected[k] + p_h[k]
    p_h = scaled(p_h, theta)
    gain_p = _along(j_h, g_h, p_h, origin, diagonal, 1.0, 1.0)[1]
    down = scaled(g_h, -1.0)
    inside, outside = radius / np.sqrt(dot(down, down)), _to_bound(x, origin, down, d, low, high)
    longest = theta * outside if outside < inside else inside
    t, gain_d = _along(j_h, g_h, down, origin, diagonal, 0.0, longest)
    if gain_p < gain_r and gain_p < gain_d:
        return p_h, -gain_p
    if gain_r < gain_p and gain_r < gain_d:
        return reflected, -gain_r
    return scaled(down, t), -gain_d


@jit
def _stride(x: float, step: float, low: float, high: float) -> float:
    """Return how often a step other than 0 reaches to a bound."""
    found: float = max((low - x) / step, (high - x) / step)
    return found


@jit
def _to_bound(
    x: FloatArray, origin: FloatArray, step: FloatArray, d: FloatArray, low: float, high: float
) -> float:
    """Return how often a step from x and an origin, both over d, reaches to the first bound."""
    found = np.inf
    for k in range(len(x)):
        if step[k] != 0.0:
            found = min(found, _stride(x[k] + d[k] * origin[k], d[k] * step[k], low, high))
    return found


@jit
def _to_radius(x: FloatArray, step: FloatArray, radius: float) -> float:
    """Return how often a step from x reaches to the radius."""
    a, b, c = dot(step, step), dot(x, step), dot(x, x) - radius**2
    q = -(b + np.copysign(np.sqrt(max(b * b - a * c, 0.0)), b))
    found: float = max(q / a, c / q)
    return found


@jit
def _along(
    j_h: FloatArray,
    g_h: FloatArray,
    step: FloatArray,
    origin: FloatArray,
    diagonal: FloatArray,
    least: float,
    most: float,
) -> tuple[float, float]:
    """Return where along a step from an origin the model is least, and its change there."""
    a, b, c = 0.0, dot(g_h, step), dot(g_h, origin)
    for i in range(len(j_h)):
        moved, before = dot(j_h[i], step), dot(j_h[i], origin)
        a, b, c = a + 0.5 * moved**2, b + before * moved, c + 0.5 * before**2
    for k in range(len(step)):
        a += 0.5 * step[k] ** 2 * diagonal[k]
        b += origin[k] * diagonal[k] * step[k]
        c += 0.5 * origin[k] ** 2 * diagonal[k]
    best, value = least, least * (a * least + b) + c
    if most * (a * most + b) + c < value:
        best, value = most, most * (a * most + b) + c
    if a != 0.0 and least < -0.5 * b / a < most:
        t = -0.5 * b / a
        if t * (a * t + b) + c < value:
            best, value = t, t * (a * t + b) + c
    return best, value
