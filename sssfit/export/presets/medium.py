"""Engines that take a medium: extinction, albedo, anisotropy and index, in their own words.

The look is the exact profile of the medium that the parameters describe, lit along the normal.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray
from sssfit.errors import KernelError
from sssfit.export.presets.record import Parameters
from sssfit.export.presets.source import Source
from sssfit.material import Layer, Material
from sssfit.messages import by_channel
from sssfit.optics import normal_transmittance
from sssfit.process import one_blas_thread
from sssfit.profile import Profile
from sssfit.simulate import simulate_exact
from sssfit.simulate.half_space import diffuse_reflectance
from sssfit.simulate.inversion import invert_reflectance
from sssfit.simulate.stack.angles import energies_by_angle

CHANNELS = ("R", "G", "B")
_STEP, _LEAST, _NEAR_ONE = 1e-4, 1e-300, 1e-4  # of albedos
_HEMISPHERE = np.array([0.0, 0.5 * math.pi])
_TOLERANCE = 1e-4  # of R_d
_ROUNDING = 5  # decimals of a relative change of R_d; two solvers differ by 1e-7


def medium_of(source: Source) -> tuple[FloatArray, FloatArray, float, float]:
    """Return mean free paths (3,) [mm], albedos (3,), g and the relative index of a material.

    One g for all channels is kept. Where channels differ, and where a renderer has one number, the
    reduced coefficients of g = 0 stand in for them (similarity relation).

    Raises
    ------
    KernelError
        There is no such medium, or a channel does not scatter or has no extinction.
    """
    layer = source.layer("the engine asks for coefficients")
    g = float(layer.g[0])
    is_reduced = bool((layer.g != g).any())
    sigma_s = layer.reduced_sigma_s_per_mm if is_reduced else layer.sigma_s_per_mm
    sigma_t = layer.sigma_a_per_mm + sigma_s
    if not (sigma_s > 0.0).all():
        said = by_channel(source.profile.channels, sigma_s.tolist(), ".3g")
        raise KernelError(f"{source.title} does not scatter in every channel ({said} per mm).")
    return 1.0 / sigma_t, sigma_s / sigma_t, 0.0 if is_reduced else g, source.eta


def losses(source: Source) -> tuple[str, ...]:
    """Return a warning where `medium_of` replaces channels of several g by a medium of g = 0."""
    layer = source.layer("the engine asks for coefficients")
    if source.material is None or (layer.g == layer.g[0]).all():
        return ()
    _, albedo, g, eta = medium_of(source)
    seen = entering_colour(albedo, g, eta) * normal_transmittance(eta)
    change = np.round(seen / total_reflectance(source.material) - 1.0, _ROUNDING)
    if not change.any():
        return ()
    said = by_channel(source.profile.channels, change.tolist(), "+.2g%")
    return (
        f"The channels of {source.title} differ in g and the engine takes one: sigma_s' = (1 - g) "
        f"sigma_s with g = 0 stands in for them, which changes R_d: {said}.",
    )


def total_reflectance(material: Material) -> FloatArray:
    """Return R_d (C,) of any material under normal light, exactly, in hundredths of a second."""
    with one_blas_thread():
        by_angle = energies_by_angle(material, _HEMISPHERE, _TOLERANCE)["angle_reflected"]
    return np.asarray(by_angle.sum(axis=(0, 1)))


def full_albedo(reduced: npt.ArrayLike, g: float) -> FloatArray:
    """Return alpha = alpha' / (1 - g + g alpha'), where alpha' = alpha (1 - g) / (1 - alpha g)."""
    a = np.asarray(reduced, dtype=np.float64)
    return np.asarray(a / (1.0 - g + g * a))


def entering_colour(albedo: FloatArray, g: float, eta: float) -> FloatArray:
    """Return the share of the entering light that comes back, R_d / (1 - R_sp), normal light."""
    if g == 0.0:
        total = diffuse_reflectance(albedo, eta)
    else:
        layer = Layer(eta, np.full(albedo.size, g), 1.0 - albedo, albedo)
        names = tuple(f"c{k}" for k in range(albedo.size))
        total = total_reflectance(Material("colour", names, (layer,)))
    return np.asarray(total / normal_transmittance(eta))


def albedo_of_colour(colour: npt.ArrayLike, g: float, eta: float) -> FloatArray:
    """Return the albedos (3,) whose `entering_colour` is a colour, 0 to 1.

    Exact for every g: the similarity relation is off by 1 % of bright colours and half of dark
    ones, whose few collisions do not make the light isotropic.
    """
    asked = np.asarray(colour, dtype=np.float64)
    if g == 0.0:
        return _isotropic_albedo(asked, eta)
    return np.array([_searched_albedo(each, g, eta) for each in asked.tolist()])


def _isotropic_albedo(asked: FloatArray, eta: float) -> FloatArray:
    """Return the albedos (3,) of colours for g = 0.

    The exact inversion, good to 1e-8 of the incident light, and a secant step, by which dark
    colours come back to six digits too.
    """
    found = invert_reflectance(normal_transmittance(eta) * asked, eta).albedo
    moved = found * (1.0 - _STEP)
    first, second = (entering_colour(each, 0.0, eta) for each in (found, moved))
    slope = np.where(found > 0.0, (first - second) / np.maximum(found - moved, _LEAST), 1.0)
    # The slope is infinite at albedo 1, where the inversion has all digits.
    step = np.where(found < 1.0 - _NEAR_ONE, (asked - first) / slope, 0.0)
    return np.clip(found + step, 0.0, 1.0)


def _searched_albedo(asked: float, g: float, eta: float) -> float:
    """Return the albedo of a colour, searched in s = sqrt(1 - albedo'), where it is smooth."""
    from scipy.optimize import brentq

    def albedo(s: float) -> float:
        return min(float(full_albedo(1.0 - s * s, g)), 1.0)  # rounding

    def excess(s: float) -> float:
        return float(entering_colour(np.array([albedo(s)]), g, eta)[0]) - asked

    if excess(0.0) <= 0.0:  # of albedo 1, whose colour is 1 less rounding
        return 1.0
    return albedo(float(brentq(excess, 0.0, 1.0, xtol=1e-15)))


def half_space(
    title: str,
    preset: str,
    path_mm: npt.ArrayLike,
    albedo: npt.ArrayLike,
    *,
    g: float = 0.0,
    eta: float = 1.4,
) -> Material:
    """Return the material of mean free paths (3,) [mm] and albedos (3,)."""
    sigma_t = 1.0 / np.asarray(path_mm, dtype=np.float64)
    alpha = np.asarray(albedo, dtype=np.float64)
    layer = Layer(eta, np.full(sigma_t.size, g), (1.0 - alpha) * sigma_t, alpha * sigma_t)
    return Material(title, CHANNELS, (layer,), source=f"preset {preset}")


def exact_look(material: Callable[[Parameters], Material]) -> Callable[[Parameters], Profile]:
    """Return the look of a preset that describes a medium: its exact profile."""

    def look(parameters: Parameters) -> Profile:
        return simulate_exact(material(parameters))

    return look
