"""Sums of Gaussians as profiles: what skin was published as, and anything of that form.

d'Eon, Luebke and Enderton 2007, "Efficient rendering of human skin", gave the skin of a face as six
Gaussians, and shaders have used them since. R_d(r) = sum_i w_i exp(-r^2 / 2 v_i) / (2 pi v_i) has
no coefficients behind it: the profile holds a name and a source in place of a material.
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

_MOST_TOTAL = 1.0 + 1e-6  # published weights are rounded, but not by more
_LEAST_VARIANCE, _MOST_VARIANCE = 1e-18, 1e18  # mm^2


def checked_name(name: str, source: str | None, channels: Sequence[str]) -> ProfileSource:
    """Return what stands for the material, or refuse names that a material could not have."""
    try:
        check_texts(name, "" if source is None else source)
        check_names(channels)
    except MaterialError as error:
        raise SimulationError(str(error)) from None
    return ProfileSource(name, source or "", tuple(channels))


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


DEON_SKIN = ProfileSource("deon-skin", "d'Eon, Luebke, Enderton 2007", ("R", "G", "B"))

_RINGS_PER_SIGMA = 10  # of the narrowest: pixels of 2.5 rings then have their energy to 3e-4
_MOST_BEYOND = 1e-9


def simulate_deon_skin(*, dr_mm: float | None = None, radius_mm: float | None = None) -> Profile:
    """Return the skin of a face, the six Gaussians of d'Eon, Luebke and Enderton 2007.

    Every channel returns all of the light: the model leaves the colour of skin to a texture. By
    default 2151 annuli of 0.008 mm, to 17.208 mm, beyond which lies 1.6e-10 of R. Takes the grid,
    and raises, as `simulate_gaussians`.

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
    """Return the profile that is a sum of Gaussians in the plane.

    Parameters
    ----------
    variances_mm2 : (N,) [mm^2]
        Per axis, above 0; the same for all channels.
    weights : (N, C)
        Energy of each Gaussian; negative ones may cancel others, but R_d may not go below 0.
    name : str
        What the profile is called, fit for a file name.
    channels : sequence of str
        Their C names.
    dr_mm : float, optional
        Width of an annulus [mm]; by default a tenth of the narrowest standard deviation.
    radius_mm : float, optional
        Radius to be covered [mm]; by default such that under 1e-9 of any channel lies beyond.
    source : str, optional
        Where the numbers come from.

    Returns
    -------
    Profile
        Exact to rounding of every annulus, however faint; standard errors are NaN, specular
        reflectance 0 and absorption unknown. ``meta["material"]`` has ``name`` and ``source``, and
        ``meta["settings"]`` the ``variances_mm2`` and ``weights``.

    Raises
    ------
    SimulationError
        Numbers that cannot be, light below 0 or of more than 1, names that cannot be used, a grid
        that cannot be.

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
    energies = _not_negative(np.vstack((annuli, beyond)), shares, named)
    settings = {"variances_mm2": variances.tolist(), "weights": shares.tolist()}
    return computed_profile(named, "gaussians", grid, energies, settings=settings)


def _not_negative(energies: FloatArray, weights: FloatArray, named: ProfileSource) -> FloatArray:
    """Refuse R_d below 0 where negative weights outdo the others; rounding becomes 0."""
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
    """Return the grid; by default each of N Gaussians leaves under 1e-9 / N beyond it."""
    sigmas_mm = np.sqrt(variances)
    if dr_mm is None:
        dr_mm = float(sigmas_mm.min()) / _RINGS_PER_SIGMA
    if radius_mm is None:
        most = np.abs(weights).max(axis=1) * len(variances) / _MOST_BEYOND
        reach_mm = sigmas_mm * np.sqrt(2.0 * np.log(np.maximum(most, 1.0)))
        radius_mm = float(max(reach_mm.max(), sigmas_mm.max()))
    return grid_of_lengths(dr_mm, radius_mm)
