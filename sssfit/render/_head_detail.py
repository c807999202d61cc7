"""Fine relief on the head: pores, roughness, creases of the lips and forehead, brows [mm].

Each kind fades out before the grid gets too coarse for it: relief shorter than three nodes would
come out as noise of the grid, not of the skin.
"""

from collections.abc import Callable

import numpy as np

from sssfit.render._head_face import MOUTH_Y
from sssfit.render._head_shape import FloatArray, gaussian, smooth_step

# Wavelength and height of the roughness, in mm and in pores' depths.
ROUGH = ((7.0, 0.9), (3.1, 0.6), (1.4, 0.5), (0.62, 0.35), (0.27, 0.2))
PORE_CELL_MM, PORE_SIGMA_MM = 0.9, 0.14


def _fade(length_mm: float, spacing_mm: float) -> float:
    """1 from six nodes a wavelength on, 0 below three."""
    return float(smooth_step(np.asarray((length_mm / spacing_mm - 3.0) / 3.0)))


def _noise(
    x: FloatArray, y: FloatArray, lengths: tuple[float, float], seed: int, lean: float = 0.0
) -> FloatArray:
    from sssfit._jit.skin_noise import fill_noise

    out = np.empty((y.size, x.size))
    fill_noise(x.ravel(), y.ravel(), lengths, lean, seed, out)
    return out


def _roughness(x: FloatArray, y: FloatArray, spacing_mm: float) -> FloatArray:
    """Noise of several lengths, and pores."""
    from sssfit._jit.skin_noise import fill_pores

    total = np.zeros((y.size, x.size))
    for seed, (length, height) in enumerate(ROUGH):
        if fade := _fade(length, spacing_mm):
            total += fade * height * _noise(x, y, (length, length), 10 + seed)
    if fade := _fade(4.0 * PORE_SIGMA_MM, spacing_mm):
        dents = np.empty_like(total)
        fill_pores(x.ravel(), y.ravel(), PORE_CELL_MM, PORE_SIGMA_MM, dents)
        total -= fade * dents
    return total


def _lips(x: FloatArray, y: FloatArray, spacing_mm: float) -> FloatArray:
    """Upright creases."""
    where = np.exp(-((x / 21.0) ** 4) - ((y - MOUTH_Y + 0.6) / 6.5) ** 4)
    fade = _fade(1.2, spacing_mm)
    return where * fade * 1.6 * _noise(x, y, (1.2, 9.0), 30) if fade else 0.0 * where


def _forehead(x: FloatArray, y: FloatArray) -> FloatArray:
    """Three shallow lines, higher over each brow than between them."""
    total = np.zeros((y.size, x.size))
    for height in (56.0, 65.0, 75.0):
        line = height + 2.0 * np.cos(x / 11.0) - 0.0018 * x * x + 0.6 * np.sin(0.31 * x + height)
        total -= 2.2 * gaussian(y - line, 0.9) * np.exp(-((x / 38.0) ** 4))
    return total


def _brows(x: FloatArray, y: FloatArray, spacing_mm: float) -> FloatArray:
    """Short hairs that lean outward, as relief."""
    half = np.abs(x)
    arc = 37.5 + 4.0 * gaussian(half - 38.0, 13.0) - 0.004 * (half - 30.0) ** 2
    thick = 3.6 - 0.055 * np.clip(half - 14.0, 0.0, 50.0)
    ends = smooth_step((half - 11.0) / 6.0) * smooth_step((58.0 - half) / 14.0)
    where = np.exp(-(((y - arc) / thick) ** 4)) * ends
    hairs = _fade(1.4, spacing_mm) * _noise(half, y, (0.7, 5.0), 40, lean=0.9)
    return where * (4.0 + 5.0 * hairs)


def _within(
    form: Callable[..., FloatArray],
    x: FloatArray,
    y: FloatArray,
    box: tuple[float, float, float, float],
    *more: float,
) -> FloatArray:
    """Lay a form on the columns and rows of its box only; what lies outside is 0 to 1e-6."""
    left, right, low, high = box
    columns = np.flatnonzero((x[0] >= left) & (x[0] <= right))
    rows = np.flatnonzero((y[:, 0] >= low) & (y[:, 0] <= high))
    total = np.zeros((y.size, x.size))
    if columns.size and rows.size:
        part = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
        total[part] = form(x[:, part[1]], y[part[0]], *more)
    return total


def detail(x: FloatArray, y: FloatArray, inside: FloatArray, spacing_mm: float) -> FloatArray:
    """Relief in depths of a pore; none on the eyes, which are smooth and wet."""
    skin = _roughness(x, y, spacing_mm)
    skin += _within(_lips, x, y, (-42.0, 42.0, -68.0, -42.0), spacing_mm)
    skin += _within(_brows, x, y, (-58.0, 58.0, 26.0, 49.0), spacing_mm)
    skin += _within(_forehead, x, y, (-75.0, 75.0, 40.0, 84.0))
    return skin * smooth_step(-inside / 0.8)
