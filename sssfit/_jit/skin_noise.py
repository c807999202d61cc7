"""Fine relief of skin: smooth noise and pores, the same at each position on every grid."""

import math

import numpy as np
import numpy.typing as npt

from sssfit._jit import jit, jit_inline

FloatArray = npt.NDArray[np.float64]


@jit_inline
def hashed(column: int, row: int, seed: int) -> float:
    """Return a uniform number in [0, 1) for a lattice point, by a 32-bit hash."""
    h = (column * 374761393 + row * 668265263 + seed * 974711) & 0xFFFFFFFF
    h = ((h ^ (h >> 13)) * 1274126177) & 0xFFFFFFFF
    return (h ^ (h >> 16)) / 4294967296.0


@jit
def smooth_noise(x: float, y: float, seed: int) -> float:
    """Return noise between -1 and 1, with weights 6 t^5 - 15 t^4 + 10 t^3 (Perlin 2002)."""
    column, row = math.floor(x), math.floor(y)
    u, v = x - column, y - row
    u = u * u * u * (u * (6.0 * u - 15.0) + 10.0)
    v = v * v * v * (v * (6.0 * v - 15.0) + 10.0)
    left = hashed(column, row, seed) * (1.0 - v) + hashed(column, row + 1, seed) * v
    right = hashed(column + 1, row, seed) * (1.0 - v) + hashed(column + 1, row + 1, seed) * v
    return 2.0 * (left * (1.0 - u) + right * u) - 1.0


@jit
def pores(x: float, y: float, sigma: float) -> float:
    """Return a sum of round dents, one at a random position in each unit cell, of random depth."""
    column, row = math.floor(x), math.floor(y)
    total = 0.0
    for j in range(row - 1, row + 2):
        for i in range(column - 1, column + 2):
            dx = x - i - hashed(i, j, 1)
            dy = y - j - hashed(i, j, 2)
            depth = 0.4 + 0.6 * hashed(i, j, 3)
            total += depth * math.exp(-0.5 * (dx * dx + dy * dy) / (sigma * sigma))
    return total


@jit
def fill_noise(
    x: FloatArray,
    y: FloatArray,
    lengths: tuple[float, float],
    lean: float,
    seed: int,
    out: FloatArray,
) -> None:
    """Noise on the grid x (columns,), y (rows,): lengths across and along lines that lean in x."""
    for i in range(y.size):
        for j in range(x.size):
            out[i, j] = smooth_noise((x[j] - lean * y[i]) / lengths[0], y[i] / lengths[1], seed)


@jit
def fill_pores(x: FloatArray, y: FloatArray, cell: float, sigma: float, out: FloatArray) -> None:
    """Return pores on the grid, in cells of ``cell`` mm."""
    for i in range(y.size):
        for j in range(x.size):
            out[i, j] = pores(x[j] / cell, y[i] / cell, sigma / cell)
