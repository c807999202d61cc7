"""What `simulate_gaussians` is given, checked: names, variances, weights; one line says why not."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from sssfit._material_checks import check_channels, check_texts, shown
from sssfit.errors import MaterialError, SimulationError
from sssfit.simulate._deterministic import Named

FloatArray = npt.NDArray[np.float64]

_MOST_TOTAL = 1.0 + 1e-6  # published weights are rounded, but not by more
_LEAST_VARIANCE, _MOST_VARIANCE = 1e-18, 1e18  # mm^2


def checked_name(name: str, source: str | None, channels: Sequence[str]) -> Named:
    """Return what stands for the material, or refuse names that a material could not have."""
    try:
        check_texts(name, "" if source is None else source)
        check_channels(channels)
    except MaterialError as error:
        raise SimulationError(str(error)) from None
    return Named(name, source or "", tuple(channels))


def checked_numbers(
    variances_mm2: npt.ArrayLike, weights: npt.ArrayLike, n_channels: int
) -> tuple[FloatArray, FloatArray]:
    """Return variances (N,) and weights (N, C), or say in one line what is wrong with them."""
    variances, shares = _numbers("variances_mm2", variances_mm2), _numbers("weights", weights)
    if variances.ndim != 1 or variances.size == 0:
        raise SimulationError(
            f"variances_mm2 has the shape {variances.shape}; expected a list of one or more."
        )
    if shares.shape != (variances.size, n_channels):
        raise SimulationError(
            f"weights has the shape {shares.shape}; expected {(variances.size, n_channels)}: a row "
            "for each variance, a column for each channel."
        )
    is_right = (variances >= _LEAST_VARIANCE) & (variances <= _MOST_VARIANCE)
    if not is_right.all():
        k = int(np.argmin(is_right))
        raise SimulationError(
            f"variances_mm2[{k}] = {shown(variances[k])}; expected a number from "
            f"{_LEAST_VARIANCE:g} to {_MOST_VARIANCE:g}, in mm^2."
        )
    if not np.isfinite(shares).all():
        k, c = (int(each[0]) for each in np.nonzero(~np.isfinite(shares)))
        raise SimulationError(f"weights[{k}][{c}] = {shown(shares[k, c])}; expected a finite one.")
    total = float(shares.sum(axis=0).max())
    if total > _MOST_TOTAL:
        raise SimulationError(
            f"weights add up to {total:.7g} in a channel; expected 1 at most: no more light leaves "
            "than arrives."
        )
    return variances, shares


def _numbers(key: str, values: npt.ArrayLike) -> FloatArray:
    try:
        return np.asarray(values, dtype=np.float64, order="C")
    except (TypeError, ValueError):
        raise SimulationError(
            f"{key} = {shown(values)} are not numbers; expected rows of equal length."
        ) from None
