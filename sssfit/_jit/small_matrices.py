"""Linear algebra of matrices with few columns: QR, singular values, weights that are not negative.

A call of LAPACK takes longer than the work on ten columns does.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit._jit import jit

FloatArray = npt.NDArray[np.floating[Any]]
BoolArray = npt.NDArray[np.bool_]

_SWEEPS = 60  # of rotations; 5 to 8 are usual
_ORTHOGONAL = 1e-15  # cosine of two columns
_INDEPENDENT = 2e-14  # of a column, what those before it leave


@jit
def dot(first: FloatArray, second: FloatArray) -> float:
    """Return the sum of products."""
    total = 0.0
    for k in range(len(first)):
        total += first[k] * second[k]
    return total


@jit
def scaled(vector: FloatArray, factor: float) -> FloatArray:
    """Return a vector times a factor."""
    found = np.empty(len(vector))
    for k in range(len(vector)):
        found[k] = factor * vector[k]
    return found


@jit
def down_columns(matrix: FloatArray, vector: FloatArray) -> FloatArray:
    """Return the products (n,) of the columns of a matrix (m, n) with a vector (m,)."""
    found = np.zeros(matrix.shape[1])
    for i in range(len(matrix)):
        for k in range(matrix.shape[1]):
            found[k] += matrix[i, k] * vector[i]
    return found


@jit
def orthogonalise(columns: FloatArray, upper: FloatArray) -> None:
    """Replace columns (m, n) by an orthonormal basis, and write R (n, n) of their QR decomposition.

    Gram and Schmidt's way, done twice, which is as accurate as Householder's. What is left of a
    column that depends on those before it is 0.
    """
    m, n = columns.shape
    for j in range(n):
        for k in range(n):
            upper[k, j] = 0.0
        for _ in range(2):
            for k in range(j):
                product = 0.0
                for i in range(m):
                    product += columns[i, k] * columns[i, j]
                upper[k, j] += product
                for i in range(m):
                    columns[i, j] -= product * columns[i, k]
        square = 0.0
        for i in range(m):
            square += columns[i, j] ** 2
        upper[j, j] = np.sqrt(square)
        if square > 0.0:
            for i in range(m):
                columns[i, j] /= upper[j, j]


@jit
def singular_values(matrix: FloatArray, values: FloatArray, right: FloatArray) -> None:
    """Replace a matrix (n, n) by its left singular vectors, and write values (n,) and V (n, n).

    By one-sided Jacobi rotations; values are in no order, and vectors of the value 0 are 0.
    """
    n = len(matrix)
    for i in range(n):
        for k in range(n):
            right[i, k] = 1.0 if i == k else 0.0
    for _ in range(_SWEEPS):
        is_done = True
        for p in range(n - 1):
            for q in range(p + 1, n):
                pp, qq, pq = 0.0, 0.0, 0.0
                for i in range(n):
                    pp += matrix[i, p] ** 2
                    qq += matrix[i, q] ** 2
                    pq += matrix[i, p] * matrix[i, q]
                if abs(pq) <= _ORTHOGONAL * np.sqrt(pp * qq):
                    continue
                is_done = False
                ratio = (qq - pp) / (2.0 * pq)
                tangent = 1.0 / (abs(ratio) + np.sqrt(1.0 + ratio * ratio))
                tangent = tangent if ratio >= 0.0 else -tangent
                cosine = 1.0 / np.sqrt(1.0 + tangent * tangent)
                sine = cosine * tangent
                for i in range(n):
                    x, y = matrix[i, p], matrix[i, q]
                    matrix[i, p], matrix[i, q] = cosine * x - sine * y, sine * x + cosine * y
                    x, y = right[i, p], right[i, q]
                    right[i, p], right[i, q] = cosine * x - sine * y, sine * x + cosine * y
        if is_done:
            break
    for k in range(n):
        square = 0.0
        for i in range(n):
            square += matrix[i, k] ** 2
        values[k] = np.sqrt(square)
        if square > 0.0:
            for i in range(n):
                matrix[i, k] /= values[k]


@jit
def least_squares(matrix: FloatArray, aim: FloatArray, rank: float) -> FloatArray:
    """Return x (n,) of least norm that minimises |matrix x - aim| for a matrix (n, n).

    Singular values below ``rank`` times the largest count as 0. The matrix is overwritten.
    """
    n = len(matrix)
    values, right, found = np.empty(n), np.empty((n, n)), np.zeros(n)
    singular_values(matrix, values, right)
    largest = 0.0
    for k in range(n):
        largest = max(largest, values[k])
    for k in range(n):
        if values[k] > rank * largest:
            share = 0.0
            for i in range(n):
                share += matrix[i, k] * aim[i]
            share /= values[k]
            for i in range(n):
                found[i] += share * right[i, k]
    return found


@jit
def positive(matrix: FloatArray, aim: FloatArray, is_free: BoolArray) -> bool:
    """Mark which x (n,) are above 0 where x >= 0 minimises |matrix x - aim|, matrix (m, n).

    Lawson and Hanson's active sets. False if they come to no end, as sets of columns that are equal
    to rounding may.
    """
    m, n = matrix.shape
    x, left = np.zeros(n), np.empty(m)
    for j in range(n):
        is_free[j] = False
    for _ in range(3 * n + 1):
        for i in range(m):
            left[i] = aim[i] - dot(matrix[i], x)
        if not _freed_one(matrix, aim, down_columns(matrix, left), is_free):
            return True
        while True:
            z = _solved(matrix, aim, is_free)
            share, first = 1.0, -1
            for j in range(n):
                if is_free[j] and z[j] <= 0.0:
                    own = x[j] / (x[j] - z[j])
                    if first < 0 or own < share:
                        share, first = own, j
            for j in range(n):
                if is_free[j]:
                    x[j] += share * (z[j] - x[j])
                    if first >= 0 and (j == first or x[j] <= 0.0):
                        x[j], is_free[j] = 0.0, False
            if first < 0:
                break
    return False


@jit
def _freed_one(matrix: FloatArray, aim: FloatArray, pull: FloatArray, is_free: BoolArray) -> bool:
    """Free the x of the largest pull that would grow from 0; False if there is none."""
    while True:
        best = -1
        for j in range(len(pull)):
            if not is_free[j] and pull[j] > 0.0 and (best < 0 or pull[j] > pull[best]):
                best = j
        if best < 0:
            return False
        is_free[best] = True
        if _solved(matrix, aim, is_free)[best] > 0.0:
            return True
        is_free[best] = False
        pull[best] = 0.0


@jit
def _solved(matrix: FloatArray, aim: FloatArray, is_free: BoolArray) -> FloatArray:
    """Return the least squares of the free columns, 0 for the others and for dependent ones."""
    m, n = matrix.shape
    free = np.flatnonzero(is_free)
    columns, upper, x = np.empty((m, len(free))), np.empty((len(free), len(free))), np.zeros(n)
    for k in range(len(free)):
        for i in range(m):
            columns[i, k] = matrix[i, free[k]]
    orthogonalise(columns, upper)
    left = np.zeros(len(free))
    for k in range(len(free) - 1, -1, -1):
        whole = 0.0
        for j in range(k + 1):
            whole += upper[j, k] ** 2
        if upper[k, k] <= _INDEPENDENT * np.sqrt(whole):
            continue
        value = 0.0
        for i in range(m):
            value += columns[i, k] * aim[i]
        for j in range(k + 1, len(free)):
            value -= upper[k, j] * left[j]
        left[k] = value / upper[k, k]
        x[free[k]] = left[k]
    return x
