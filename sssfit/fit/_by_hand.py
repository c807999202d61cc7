"""Helpers of the fits whose parameters may also be set by hand."""

from collections.abc import Mapping, Sequence

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import FitError
from sssfit.shapes import gaussian_line_integral


def gaussian_pixels(edges_mm: FloatArray, sigmas_mm: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Integrate 1D Gaussians of unit energy over pixels.

    Parameters
    ----------
    edges_mm : array (h+2,) [mm]
        `Target.edges_mm`.
    sigmas_mm : array (g,) [mm]
        Standard deviations per axis.

    Returns
    -------
    array (g, h+1), array (g, h+1)
        Energies, and their derivatives with respect to log(sigma).
    """
    energy = gaussian_line_integral(edges_mm[:-1], edges_mm[1:], sigmas_mm[:, None] ** 2)
    t = edges_mm / sigmas_mm[:, None]
    slope = t * np.exp(-0.5 * t**2) / np.sqrt(2.0 * np.pi)
    return energy, slope[:, :-1] - slope[:, 1:]


def normalised(half: FloatArray, slopes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Scale a half line (h+1,) and its derivatives (m, h+1) to a whole pass of sum 1.

    Raises
    ------
    FitError
        The line is so wide that its pixels hold no energy.
    """
    copies = np.where(np.arange(half.size) == 0, 1.0, 2.0)
    total = copies @ half
    if total == 0.0:
        raise FitError("the pass is so wide that its pixels hold nothing of it; make it narrower.")
    half = half / total
    return half, (slopes - np.outer(slopes @ copies, half)) / total


def line_misfit(
    half: FloatArray, wanted: FloatArray, weights: FloatArray
) -> tuple[float, FloatArray]:
    """Return sum weights (half - wanted)^2 relative to half = 0, and its gradient."""
    norm = float(weights @ wanted**2) or 1.0
    left = half - wanted
    return float(weights @ left**2) / norm, 2.0 / norm * weights * left


def kernel_misfit(
    half: FloatArray, wanted: FloatArray, weights: FloatArray
) -> tuple[float, FloatArray]:
    """Return sum_ij w_i w_j (half_i half_j - wanted_ij)^2 relative to half = 0, and its gradient.

    ``wanted`` (n, n) are the pixels of a quadrant, ``weights`` (n,) the number of copies of each
    row.
    """
    norm = float(weights @ (wanted**2 @ weights)) or 1.0
    left = half[:, None] * half - wanted
    value = float(weights @ (left**2 @ weights)) / norm
    return value, 4.0 / norm * weights * (left @ (weights * half))


def per_channel(
    given: Mapping[str, float | Sequence[float] | None], channels: tuple[str, ...]
) -> FloatArray | None:
    """Return parameters by channel (parameters, C), or None if none is given.

    Raises
    ------
    FitError
        Some are missing or not finite, or their number is neither one nor C.
    """
    missing = [name for name, value in given.items() if value is None]
    if len(missing) == len(given):
        return None
    if missing:
        raise FitError(
            f"{' and '.join(missing)} missing: set {', '.join(given)} all by hand, or none to have "
            "them fitted."
        )
    rows = []
    for name, value in given.items():
        row = np.atleast_1d(np.asarray(value, dtype=np.float64))
        if row.shape not in ((1,), (len(channels),)) or not np.isfinite(row).all():
            raise FitError(
                f"{name} = {value}; expected one finite number, or one for each of "
                f"{', '.join(channels)}."
            )
        rows.append(np.broadcast_to(row, (len(channels),)))
    return np.array(rows)
