"""Light through thin slabs (ears, nostrils), from the Gaussians that a kernel was fitted with.

T(s) = sum_i w_i exp(-s^2 / (2 v_i)) is the share that arrives of what enters on the far side, s
the distance it travels inside (Jimenez, Whelan, Sundstedt, Gutierrez 2010, "Real-time realistic
skin translucency"; Jimenez, Jarabo, Gutierrez 2012, "Separable subsurface scattering", section 4).
Each Gaussian is its own over the plane, with the part of its exponent that belongs to the depth.

The weights are shares: they add up to 1 and T(0) = 1. The blur that follows has the energy of the
diffuse reflectance; with energies as weights that would be counted twice.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit.errors import RenderError
from sssfit.kernel import SeparableKernel
from sssfit.render.scene import Scene

FloatArray = npt.NDArray[np.float64]


def transmittance(
    thickness_mm: npt.ArrayLike, variances_mm2: npt.ArrayLike, weights: npt.ArrayLike
) -> FloatArray:
    """Return T(s) = sum_i w_i exp(-s^2 / (2 v_i)) for each thickness and channel.

    Parameters
    ----------
    thickness_mm : array (...) [mm]
        Distance s inside; from 0 up, infinite where nothing comes through.
    variances_mm2 : array (G, C) [mm^2]
        Of G Gaussians, per axis, above 0.
    weights : array (G, C)
        Shares of the light; `gaussians_of` has them with sum 1.

    Returns
    -------
    array (..., C)

    Raises
    ------
    RenderError
        Shapes that do not fit, a variance that is not above 0, a thickness below 0 or NaN.
    """
    s = np.asarray(thickness_mm, dtype=np.float64)
    variances = np.asarray(variances_mm2, dtype=np.float64)
    shares = np.asarray(weights, dtype=np.float64)
    if variances.ndim != 2 or variances.shape != shares.shape:
        raise RenderError(
            f"variances of shape {variances.shape} and weights of shape {shares.shape}; expected "
            "the same (Gaussians, channels) for both."
        )
    if not ((variances > 0.0) & np.isfinite(variances) & np.isfinite(shares)).all():
        raise RenderError("variances have to be above 0 and weights numbers, and some are not.")
    if not (s >= 0.0).all():
        raise RenderError("thickness_mm has values that are negative or NaN; expected 0 and up.")
    total = np.zeros((*s.shape, shares.shape[1]))
    for variance, share in zip(variances, shares, strict=True):
        total += share * np.exp(-np.square(s)[..., None] / (2.0 * variance))
    return total


def gaussians_of(kernel: SeparableKernel) -> tuple[FloatArray, FloatArray]:
    """Return the kernel's Gaussians: variances (G, C) [mm^2] and shares (G, C), of sum 1.

    A sum of Gaussians has its own; the artist's kernel the near and the far one of its pass. A
    channel that returns no light has shares of 0.

    Raises
    ------
    RenderError
        The kernel was not made of Gaussians, or a channel's weights have no positive sum.
    """
    found = [_gaussians(kernel.parameters.get(name)) for name in kernel.channels]
    terms = max((len(each[0]) for each in found), default=0)
    if terms == 0:
        raise RenderError(
            f'a kernel of method "{kernel.method}" has no Gaussians to find the transmittance '
            'from; fit one with "gaussians" or "artist".'
        )
    variances, shares = np.ones((terms, len(found))), np.zeros((terms, len(found)))
    for c, (own_variances, own_weights) in enumerate(found):
        if len(own_variances) == 0 and not kernel.weights[:, :, c].any():
            continue
        if not np.sum(own_weights) > 0.0:
            raise RenderError(
                f"channel {kernel.channels[c]}: the Gaussians' weights {list(own_weights)} have "
                "no sum above 0; fit the kernel again."
            )
        variances[: len(own_variances), c] = own_variances
        shares[: len(own_weights), c] = np.divide(own_weights, np.sum(own_weights))
    return variances, shares


def _gaussians(parameters: Mapping[str, Any] | None) -> tuple[list[float], list[float]]:
    """Return a channel's variances and weights; none where it has no Gaussians."""
    parameters = parameters or {}
    if {"variances_mm2", "weights"} <= parameters.keys():
        return list(parameters["variances_mm2"]), list(parameters["weights"])
    if {"near_mm2", "far_mm2", "weight"} <= parameters.keys():
        weight = float(parameters["weight"])
        return [parameters["near_mm2"], parameters["far_mm2"]], [weight, 1.0 - weight]
    return [], []


def transmitted(scene: Scene, kernel: SeparableKernel) -> FloatArray | None:
    """Return what arrives through the object, back_irradiance T(thickness) (H, W, C).

    It is added to the irradiance before the blur. None for a scene without these buffers.

    Raises
    ------
    RenderError
        One of the two buffers is missing, or the kernel has no Gaussians.
    """
    if scene.thickness_mm is None and scene.back_irradiance is None:
        return None
    if scene.thickness_mm is None or scene.back_irradiance is None:
        missing = "thickness_mm" if scene.thickness_mm is None else "back_irradiance"
        raise RenderError(
            f"{scene.name}: light through the object needs thickness_mm and back_irradiance, and "
            f"{missing} is missing; give both or neither."
        )
    return scene.back_irradiance * transmittance(scene.thickness_mm, *gaussians_of(kernel))
