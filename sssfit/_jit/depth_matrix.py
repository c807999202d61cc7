"""What the matrix of ``transport`` is made of, and its call; nothing here needs numba."""

from ctypes import c_double, c_int64

import numpy as np
import numpy.typing as npt

from sssfit._jit.machine_code import Array, Entry

FloatArray = npt.NDArray[np.float64]

# A table of K_d, the logarithm of its first distance and entries per unit of logarithm; a table of
# X from distance 0 and entries per mean free path.
Tables = tuple[FloatArray, float, float, FloatArray, float]

_ROW, _TABLE = Array(np.float64), Array(np.float64, 2)

ENTRY = Entry(
    "transport",
    (
        *(c_int64, c_int64, c_int64),  # panels, nodes of each, nodes of the rule
        *(c_double, c_int64),  # kappa, is_matched
        *(c_int64, c_double, c_double, c_int64, c_double),  # entries and numbers of Tables
        *(_ROW, _TABLE, _TABLE, _ROW, _TABLE),  # edges to rule
        *(_ROW, _ROW),  # of Tables
        *(_ROW, _TABLE),  # memory for a panel's shares, and the matrix
    ),
)


def kernel_matrix(
    edges: FloatArray,
    nodes: FloatArray,
    weights: FloatArray,
    barycentric: FloatArray,
    rule: FloatArray,
    kappa: float,
    is_matched: bool,
    tables: Tables,
) -> FloatArray:
    """Return the integrals over all panels for all nodes, (P p, P p).

    Parameters
    ----------
    edges : (P+1,) [MFP]
        Panel edges from 0 downwards.
    nodes, weights : (P, p) [MFP]
        Gauss nodes of the panels and their weights.
    barycentric : (p,)
        Barycentric weights of the nodes of a panel.
    rule : (q, 2)
        Nodes and weights of a Gauss rule on [0, 1].
    kappa : float
        sqrt(1 + k^2): K_d falls like exp(-kappa d).
    is_matched : bool
        Whether the refractive indices are equal, without a mirror path.
    tables : Tables
        Tables of K_d and X.
    """
    (panels, order), (direct, log_first, per_log, escape, per_mfp) = nodes.shape, tables
    matrix = np.zeros((panels * order, panels * order))
    ENTRY(
        *(panels, order, len(rule), kappa, is_matched),
        *(direct.size, log_first, per_log, escape.size, per_mfp),
        *(edges, nodes, weights, barycentric, rule, direct, escape),
        *(np.zeros(order), matrix),
    )
    return matrix
