"""Sums of Gaussians as profiles: the published skin, and any other sum.

d'Eon, Luebke and Enderton 2007, "Efficient rendering of human skin", described the skin of a face
by six Gaussians, which shaders have used since. R_d(r) = sum_i w_i exp(-r^2 / 2 v_i) / (2 pi v_i)
has no coefficients; the profile holds a name and a source in place of a material.
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray, check_names
from sssfit.errors import MaterialError, SimulationError
from sssfit.grid import RadialGrid, grid_of_lengths
from sssfit.material.checks import check_texts
from sssfit.messages import shown
from sssfit.profile import Profile
from sssfit.shapes import SKIN_VARIANCES_MM2, SKIN_WEIGHTS, gaussian_between, gaussian_beyond
from sssfit.simulate._deterministic import ROUNDING, ProfileSource, computed_profile

_MAX_TOTAL = 1.0 + 1e-6  # published weights are rounded, but by no more than this
_MIN_VARIANCE, _MAX_VARIANCE = 1e-18, 1e18  # mm^2


def checked_name(name: str, source: str | None, channels: Sequence[str]) -> ProfileSource:
    """Return the record that replaces the material; raises an error for invalid names."""
    try:
        check_texts(name, "" if source is None else source)
        check_names(channels)
    except MaterialError as error:
        raise SimulationError(str(error)) from None
    return ProfileSource(name, source or "", tuple(channels))


def checked_numbers(
    variances_mm2: npt.ArrayLike, weights: npt.ArrayLike, n_channels: int
) -> tuple[FloatArray, FloatArray]:
    """Return variances (N,) and weights (N, C) as arrays, or raise a one-line error."""
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
    is_right = (variances >= _MIN_VARIANCE) & (variances <= _MAX_VARIANCE)
    if not is_right.all():
        k = int(np.argmin(is_right))
        raise SimulationError(
            f"variances_mm2[{k}] = {shown(variances[k])}; expected a number from "
            f"{_MIN_VARIANCE:g} to {_MAX_VARIANCE:g}, in mm^2."
        )
    if not np.isfinite(shares).all():
        k, c = (int(each[0]) for each in np.nonzero(~np.isfinite(shares)))
        raise SimulationError(f"weights[{k}][{c}] = {shown(shares[k, c])}; expected a finite one.")
    total = float(shares.sum(axis=0).max())
    if total > _MAX_TOTAL:
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


DEON_SKIN = ProfileSource("deon-skin", "d'Eon, Luebke, Enderton 2007", ("R", "G", "B"))

_RINGS_PER_SIGMA = 10  # of the narrowest: the energy of pixels of 2.5 annuli is then right to 3e-4
_MAX_BEYOND = 1e-9


def simulate_deon_skin(*, dr_mm: float | None = None, radius_mm: float | None = None) -> Profile:
    """Return the skin of a face, the six Gaussians of d'Eon, Luebke and Enderton 2007.

    Every channel returns all of the light: the model takes the colour of skin from a texture. By
    default 2151 annuli of 0.008 mm, to 17.208 mm, beyond which lies 1.6e-10 of R. Grid and errors
    are those of `simulate_gaussians`.

    Examples
    --------
    >>> simulate_deon_skin().diffuse_reflectance.round(12).tolist()
    [1.0, 1.0, 1.0]
    """
    return simulate_gaussians(
        SKIN_VARIANCES_MM2,
        SKIN_WEIGHTS,
        name=DEON_SKIN.name,
        channels=DEON_SKIN.channels,
        source=DEON_SKIN.source,
        dr_mm=dr_mm,
        radius_mm=radius_mm,
    )


def simulate_gaussians(
    variances_mm2: npt.ArrayLike,
    weights: npt.ArrayLike,
    *,
    name: str,
    channels: Sequence[str] = ("R", "G", "B"),
    dr_mm: float | None = None,
    radius_mm: float | None = None,
    source: str | None = None,
) -> Profile:
    """Return the profile of a sum of Gaussians in the plane.

    Parameters
    ----------
    variances_mm2 : (N,) [mm^2]
        Variances per axis, above 0; the same for all channels.
    weights : (N, C)
        Energy of each Gaussian. Negative ones may cancel others, but R_d must not be negative.
    name : str
        Name of the profile, suitable as a file name.
    channels : sequence of str
        Names of the C channels.
    dr_mm : float, optional
        Width of an annulus [mm]; by default a tenth of the narrowest standard deviation.
    radius_mm : float, optional
        Outer radius of the grid [mm]; by default under 1e-9 of any channel lies beyond it.
    source : str, optional
        Source of the numbers.

    Returns
    -------
    Profile
        Exact to rounding in every annulus, even in faint ones; standard errors are NaN, specular
        reflectance 0 and absorption unknown. ``meta["material"]`` has ``name`` and ``source``, and
        ``meta["settings"]`` the ``variances_mm2`` and ``weights``.

    Raises
    ------
    SimulationError
        Numbers, names or the grid are invalid, or the light is below 0 or above 1.

    Examples
    --------
    >>> one = simulate_gaussians([0.5], [[0.3]], name="blob", channels=["red"], dr_mm=0.5)
    >>> one.cumulative_at(1.0).round(6).tolist()  # 0.3 (1 - exp(-1))
    [0.189636]
    """
    named = checked_name(name, source, channels)
    variances, shares = checked_numbers(variances_mm2, weights, named.n_channels)
    grid = _grid(variances, shares, dr_mm, radius_mm)
    inner, outer = grid.r_edges_mm[:-1, None], grid.r_edges_mm[1:, None]
    annuli = gaussian_between(inner, outer, variances) @ shares
    beyond = gaussian_beyond(outer[-1:], variances) @ shares
    energies = _check_not_negative(np.vstack((annuli, beyond)), shares, named)
    settings = {"variances_mm2": variances.tolist(), "weights": shares.tolist()}
    return computed_profile(named, "gaussians", grid, energies, settings=settings)


def _check_not_negative(
    energies: FloatArray, weights: FloatArray, named: ProfileSource
) -> FloatArray:
    """Raise an error if R_d is negative; rounding errors become 0."""
    is_wrong = energies < -ROUNDING * np.abs(weights).max()
    if is_wrong.any():
        k, c = (int(each[0]) for each in np.nonzero(is_wrong))
        raise SimulationError(
            f"{named.name}: annulus {k} of channel {named.channels[c]} has the energy "
            f"{energies[k, c]:.3g}; expected 0 or more: the negative weights outdo the others."
        )
    return np.maximum(energies, 0.0)


def _grid(
    variances: FloatArray, weights: FloatArray, dr_mm: float | None, radius_mm: float | None
) -> RadialGrid:
    """Return the grid; by default each of N Gaussians has under 1e-9 / N beyond it."""
    sigmas_mm = np.sqrt(variances)
    if dr_mm is None:
        dr_mm = float(sigmas_mm.min()) / _RINGS_PER_SIGMA
    if radius_mm is None:
        most = np.abs(weights).max(axis=1) * len(variances) / _MAX_BEYOND
        reach_mm = sigmas_mm * np.sqrt(2.0 * np.log(np.maximum(most, 1.0)))
        radius_mm = float(max(reach_mm.max(), sigmas_mm.max()))
    return grid_of_lengths(dr_mm, radius_mm)
