"""Light through thin slabs (ears, nostrils), from the kernel that blurs it.

T(s) is the share of the light entering on the far side that arrives after a distance s inside. For
a sum of Gaussians

    T(s) = sum_i w_i exp(-s^2 / (2 v_i)),

where each Gaussian is the one of the plane, with variance v_i per axis, and the exponent is its
part for the depth (Jimenez, Jarabo, Gutierrez 2012, "Separable subsurface scattering", section 4).
That exponent is ours: the listing of Jimenez, Whelan, Sundstedt, Gutierrez 2010, "Real-time
realistic skin translucency", has exp(-s^2 / v_i) over the same variances, and its light reaches 1 /
sqrt 2 as far (``PUBLISHED``).

The sum is also the share of the reflected light that leaves farther than s from where it enters:
exp(-s^2 / (2 v)) is the energy of one Gaussian beyond the radius s. So every kernel has a T, even
if it is not made of Gaussians: `beyond`.

The weights are shares: they add up to 1 and T(0) = 1. The blur that follows has the energy of the
diffuse reflectance; energies as weights would count it twice.
"""

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray, check_record
from sssfit.errors import RenderError
from sssfit.formats.colours import as_light, positive
from sssfit.kernel import Kernel, SeparableKernel, Taps
from sssfit.messages import counted
from sssfit.render.taps import response
from sssfit.scene.record import Scene

# c of exp(-s^2 / (c v)): for the energy of a Gaussian beyond s, and for the 2010 listing.
OURS, PUBLISHED = 2.0, 1.0


def transmittance(
    thickness_mm: npt.ArrayLike,
    variances_mm2: npt.ArrayLike,
    weights: npt.ArrayLike,
    *,
    widths: float = OURS,
) -> FloatArray:
    """Return T(s) = sum_i w_i exp(-s^2 / (2 v_i)) for each thickness and channel.

    Parameters
    ----------
    thickness_mm : array (...) [mm]
        Distance s inside, at least 0; infinite where no light comes through.
    variances_mm2 : array (G, C) [mm^2]
        Variances of G Gaussians per axis, above 0.
    weights : array (G, C)
        Shares of the light; those of `gaussians_of` have the sum 1.
    widths : float
        c of exp(-s^2 / (c v_i)), above 0: ``OURS``, 2, or for comparison ``PUBLISHED``, 1.

    Returns
    -------
    array (..., C)

    Raises
    ------
    RenderError
        Shapes do not fit, a variance is not above 0, or a thickness is below 0 or NaN.
    """
    s = _thickness(thickness_mm)
    variances = as_light(variances_mm2, "variances_mm2")
    shares = as_light(weights, "weights")
    if variances.ndim != 2 or variances.shape != shares.shape:
        raise RenderError(
            f"variances of shape {variances.shape} and weights of shape {shares.shape}; expected "
            "the same (Gaussians, channels) for both."
        )
    if not ((variances > 0.0) & np.isfinite(variances) & np.isfinite(shares)).all():
        raise RenderError("variances must be above 0, and weights must be finite numbers.")
    widths = positive(widths, "widths")
    total = np.zeros((*s.shape, shares.shape[1]))
    for variance, share in zip(variances, shares, strict=True):
        total += share * np.exp(-np.square(s)[..., None] / (widths * variance))
    return total


def _thickness(thickness_mm: npt.ArrayLike) -> FloatArray:
    """Return thicknesses as float64, or raise an error."""
    s = as_light(thickness_mm, "thickness_mm")
    if not (s >= 0.0).all():
        raise RenderError("thickness_mm has values that are negative or NaN; expected 0 and up.")
    return s


def beyond(kernel: Kernel, thickness_mm: npt.ArrayLike) -> FloatArray:
    """Return the share of a round kernel's light beyond the radius s, from its line integral.

    With a(x) the integral of R_d over y, Abel's transform gives for the plane outside s

        T(s) = 2 int_s^inf a(x) x / sqrt(x^2 - s^2) dx / int a dx,

    in closed form for a line of pixels, with a(x) constant in each. This is exact for a
    pre-integrated pass; a kernel that is not round has the T of the round one with the same line
    integral. Negative values become 0.

    Parameters
    ----------
    kernel : SeparableKernel or Taps
    thickness_mm : array (...) [mm]
        Distances, at least 0; infinite where no light comes through.

    Returns
    -------
    array (..., C)
        Channels without light are 0.

    Raises
    ------
    RenderError
        A thickness is below 0 or NaN.
    """
    check_record("kernel", kernel, Kernel, RenderError)
    s = _thickness(thickness_mm)[..., None]
    line = _half_line(kernel)
    edges_mm = kernel.mm_per_pixel * (np.arange(len(line)) + 0.5)
    # Integrated by parts: a falls by a step at each outer edge of a pixel, times sqrt(x^2 - s^2).
    steps = line - np.concatenate((line[1:], np.zeros((1, line.shape[1]))))
    total = np.zeros((*s.shape[:-1], line.shape[1]))
    for edge_mm, step in zip(edges_mm, steps, strict=True):
        within = np.minimum(s, edge_mm)
        total += step * np.sqrt((edge_mm - within) * (edge_mm + within))
    energy = kernel.mm_per_pixel * (2.0 * line.sum(axis=0) - line[0])
    share = np.divide(2.0 * total, energy, out=np.zeros_like(total), where=energy > 0.0)
    lit: FloatArray = np.maximum(share, 0.0)
    return lit


def _half_line(kernel: Kernel) -> FloatArray:
    """Return the line integral from the middle outwards (h+1, C); of taps that of a lit point."""
    if isinstance(kernel, SeparableKernel):
        return kernel.line[kernel.half_pixels :]
    line = response(kernel).sum(axis=0)
    half_line: FloatArray = 0.5 * (line + line[::-1])[len(line) // 2 :]
    return half_line


def through(kernel: Kernel, thickness_mm: npt.ArrayLike) -> FloatArray:
    """Return T(s) of a kernel (..., C): from its Gaussians if it has any, else from `beyond`."""
    check_record("kernel", kernel, Kernel, RenderError)
    if isinstance(kernel, Taps):
        return beyond(kernel, thickness_mm)
    if any(_gaussians(kernel.parameters.get(name))[0] for name in kernel.channels):
        return transmittance(thickness_mm, *gaussians_of(kernel))
    return beyond(kernel, thickness_mm)


def gaussians_of(kernel: SeparableKernel) -> tuple[FloatArray, FloatArray]:
    """Return the kernel's Gaussians: variances (G, C) [mm^2] and shares (G, C) of sum 1.

    A sum of Gaussians has its own; the artist's kernel has the near and far one of its pass. A
    channel that returns no light has shares of 0.

    Raises
    ------
    RenderError
        The kernel was not made of Gaussians, or a channel's weights have no positive sum.
    """
    check_record("kernel", kernel, SeparableKernel, RenderError)
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
    """Return a channel's variances and weights; empty if it has no Gaussians."""
    parameters = parameters or {}
    if {"variances_mm2", "weights"} <= parameters.keys():
        return list(parameters["variances_mm2"]), list(parameters["weights"])
    if {"near_mm2", "far_mm2", "weight"} <= parameters.keys():
        weight = float(parameters["weight"])
        return [parameters["near_mm2"], parameters["far_mm2"]], [weight, 1.0 - weight]
    return [], []


def transmitted(scene: Scene, kernel: Kernel) -> FloatArray | None:
    """Return the light through the object, back_irradiance T(thickness) (H, W, C).

    To be added to the irradiance before the blur. None for a scene without these buffers.

    Raises
    ------
    RenderError
        One of the two buffers is missing, the light behind has other channels than one or the
        kernel's, or a channel's Gaussians have no positive sum.
    """
    check_record("scene", scene, Scene, RenderError)
    check_record("kernel", kernel, Kernel, RenderError)
    if scene.thickness_mm is None and scene.back_irradiance is None:
        return None
    if scene.thickness_mm is None or scene.back_irradiance is None:
        missing = "thickness_mm" if scene.thickness_mm is None else "back_irradiance"
        raise RenderError(
            f"{scene.name}: light through the object needs thickness_mm and back_irradiance, and "
            f"{missing} is missing; give both or neither."
        )
    channels = len(kernel.channels)
    if scene.back_irradiance.shape[2] not in (1, channels):
        raise RenderError(
            f"{scene.name}: back_irradiance of shape {scene.back_irradiance.shape} for a kernel of "
            f"{counted(channels, 'channel')}; expected as many channels, or one."
        )
    arrives = np.zeros((scene.height, scene.width, channels))
    lit = (scene.back_irradiance > 0.0).any(axis=2)  # most pixels have no light behind them
    arrives[lit] = scene.back_irradiance[lit] * through(kernel, scene.thickness_mm[lit])
    return arrives


def with_transmitted(scene: Scene, kernel: Kernel) -> Scene:
    """Return the scene with the light through the object added to its irradiance, (H, W, C).

    For renderers that use the irradiance alone; thickness and back irradiance are removed.

    Raises
    ------
    RenderError
        The scene has neither buffer, or as `transmitted`.
    """
    arrives = transmitted(scene, kernel)
    if arrives is None:
        raise RenderError(
            f"{scene.name} has no thickness and no light behind it; transmitted light needs both."
        )
    return dataclasses.replace(
        scene, irradiance=scene.irradiance + arrives, thickness_mm=None, back_irradiance=None
    )
