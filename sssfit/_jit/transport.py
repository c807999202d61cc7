"""The depth integral equation as a matrix: product quadrature over graded panels.

Row i holds the integrals over depth z' of [K_d(|z_i - z'|) + K_r(z_i + z')] l_j(z'), l_j being the
polynomial of a panel that is 1 at its node j and 0 at its others. The mirror path is
K_r(s) = K_d(s) - X(s), and the mirror image of a node lies at -z_i. ``sssfit.simulate._depth`` has
the formulas and makes the tables of K_d and X. Lengths are in mean free paths.
"""

import math

import numpy as np
from numba import carray  # type: ignore[attr-defined]

from sssfit._jit import Address, jit, jit_inline
from sssfit._jit.depth_matrix import FloatArray, Tables

# Nodes, weights and barycentric weights of one panel; nodes and weights of a rule on [0, 1]; and
# memory for the shares of the panel's nodes in one source.
Panel = tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]

FALL = 3.0  # K_d falls like exp(-kappa d): no interval of the quadrature spans more than exp(-3)
NEGLIGIBLE = 36.0  # exp(-36) = 2e-16
# Next to the target, distances are x^6, so that d log d of K_d becomes smooth enough for 12 Gauss
# nodes to reach 1e-9 of a row's sum (x^4: 1e-7).
POWER = 6


@jit_inline
def interpolated(table: FloatArray, position: float) -> float:
    """Value of a uniform table between its entries, by four-point Lagrange."""
    i = min(max(int(position), 1), table.size - 3)
    t = position - i
    u, v, w = t + 1.0, t - 1.0, t - 2.0
    outer: float = (table[i + 2] * u * v * t - table[i - 1] * t * v * w) / 6.0
    inner: float = 0.5 * (table[i] * u * v * w - table[i + 1] * u * t * w)
    return outer + inner


@jit_inline
def kernel(distance: float, is_mirrored: bool, tables: Tables) -> float:
    """Return K_d, or K_r = K_d - X for a mirrored target: 0 beyond the table of X."""
    direct, log_first, per_log, escape, per_mfp = tables
    position = distance * per_mfp
    if is_mirrored and position > escape.size - 2:
        return 0.0
    # Nearer than the table's first distance K_d is constant: x^6 gives such sources no weight.
    value = interpolated(direct, max((math.log(distance) - log_first) * per_log, 1.0))
    if is_mirrored:
        value -= interpolated(escape, position)
    return value


@jit
def add_stretch(
    row: FloatArray,
    inner: float,
    outer: float,
    power: int,
    side: tuple[float, float],
    panel: Panel,
    tables: Tables,
) -> None:
    """Add the integral over a panel at distances ``inner`` to ``outer`` from the target.

    ``side`` is the target's depth and the direction (-1 or 1) of the interval.
    """
    target, sign = side
    nodes, _, barycentric, rule, shares = panel
    for q in range(rule.shape[0]):
        x = rule[q, 0]
        distance = inner + (outer - inner) * x**power
        weight = rule[q, 1] * (outer - inner) * power * x ** (power - 1)
        source = target + sign * distance
        for j in range(nodes.size):  # apart from their sum: several divisions at once
            # 1e-300 for a source on a node: its share is then 1 and those of the others 0
            shares[j] = barycentric[j] / (source - nodes[j] + 1e-300)
        total = 0.0
        for j in range(nodes.size):
            total += shares[j]
        scale = weight * kernel(distance, target < 0.0, tables) / total
        for j in range(nodes.size):
            row[j] += scale * shares[j]


@jit
def add_side(
    row: FloatArray,
    inner: float,
    outer: float,
    kappa: float,
    side: tuple[float, float],
    panel: Panel,
    tables: Tables,
) -> None:
    """Add the integral on one side of the target, in intervals that double with distance."""
    outer = min(outer, NEGLIGIBLE / kappa)
    start = inner
    while start < outer:
        step = outer if start == 0.0 else start
        end = min(start + min(step, FALL / kappa), outer)
        power = POWER if start == 0.0 else 1
        add_stretch(row, start, end, power, side, panel, tables)
        start = end


@jit
def add_panel(
    row: FloatArray,
    lower: float,
    upper: float,
    target: float,
    kappa: float,
    panel: Panel,
    tables: Tables,
) -> None:
    """Add one panel's integrals for one target inside, beside or mirrored above it."""
    if lower < target < upper:
        add_side(row, 0.0, target - lower, kappa, (target, -1.0), panel, tables)
        add_side(row, 0.0, upper - target, kappa, (target, 1.0), panel, tables)
        return
    is_above = target <= lower
    near = lower - target if is_above else target - upper
    width = upper - lower
    if near * kappa > NEGLIGIBLE:
        return
    if near < width or width * kappa > FALL:
        sign = 1.0 if is_above else -1.0
        add_side(row, near, near + width, kappa, (target, sign), panel, tables)
        return
    nodes, weights, _, _, _ = panel
    for j in range(nodes.size):
        row[j] += weights[j] * kernel(abs(target - nodes[j]), target < 0.0, tables)


@jit
def fill(
    matrix: FloatArray,
    edges: FloatArray,
    nodes: FloatArray,
    weights: FloatArray,
    barycentric: FloatArray,
    rule: FloatArray,
    kappa: float,
    is_matched: bool,
    tables: Tables,
    shares: FloatArray,
) -> None:
    """See ``depth_matrix.kernel_matrix``; the matrix is 0 before."""
    panels, order = nodes.shape
    for p in range(panels):
        panel = (nodes[p], weights[p], barycentric, rule, shares)
        for i in range(panels * order):
            target = nodes[i // order, i % order]
            row = matrix[i, p * order : (p + 1) * order]
            add_panel(row, edges[p], edges[p + 1], target, kappa, panel, tables)
            if not is_matched:
                add_panel(row, edges[p], edges[p + 1], -target, kappa, panel, tables)


def enter(
    panels: int,
    order: int,
    rules: int,
    kappa: float,
    is_matched: int,
    near_entries: int,
    log_first: float,
    per_log: float,
    far_entries: int,
    per_mfp: float,
    edges: Address,
    nodes: Address,
    weights: Address,
    barycentric: Address,
    rule: Address,
    direct: Address,
    escape: Address,
    shares: Address,
    matrix: Address,
) -> int:
    """Call `fill` with arrays at the addresses that ``depth_matrix.ENTRY`` passes."""
    rows = panels * order
    tables = (
        carray(direct, (near_entries,), np.float64),
        log_first,
        per_log,
        carray(escape, (far_entries,), np.float64),
        per_mfp,
    )
    fill(
        carray(matrix, (rows, rows), np.float64),
        carray(edges, (panels + 1,), np.float64),
        carray(nodes, (panels, order), np.float64),
        carray(weights, (panels, order), np.float64),
        carray(barycentric, (order,), np.float64),
        carray(rule, (rules, 2), np.float64),
        kappa,
        is_matched != 0,
        tables,
        carray(shares, (order,), np.float64),
    )
    return 0
