"""Point lights with shadow maps: irradiance, and the specular light of skin."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sssfit._jit import raster as compiled
from sssfit.arrays import FloatArray
from sssfit.errors import RenderError
from sssfit.messages import shown
from sssfit.scene.mesh import Mesh

_BIAS_MM = 1.5  # by which a place is moved along its normal: half a triangle of the made head
_NEAR_MM = 1.0
# Skin at normal incidence, its roughness and its strength (d'Eon and Luebke 2007, GPU Gems 3,
# chapter 14.3).
F0, ROUGHNESS, SPECULAR = 0.028, 0.3, 0.18


@dataclass(frozen=True, slots=True)
class PointLight:
    """A light in one place.

    Parameters
    ----------
    place_mm : (float, float, float) [mm]
    power : tuple of float (C,)
        Irradiance at normal incidence at ``reference_mm``.
    reference_mm : float [mm]
    """

    place_mm: tuple[float, float, float]
    power: tuple[float, ...]
    reference_mm: float = 1000.0

    def __post_init__(self) -> None:
        if len(self.place_mm) != 3 or not np.isfinite(self.place_mm).all():
            raise RenderError(f"place_mm = {shown(self.place_mm)}; expected three lengths in mm.")
        power = np.asarray(self.power, dtype=np.float64)
        if power.ndim != 1 or not (np.isfinite(power) & (power >= 0.0)).all():
            raise RenderError(f"power = {shown(self.power)}; expected numbers from 0, by channel.")
        if not 0.0 < self.reference_mm < math.inf:
            raise RenderError(f"reference_mm = {shown(self.reference_mm)}; expected a length.")


@dataclass(frozen=True, slots=True, eq=False)
class ShadowMap:
    """What a light sees first: 1 / depth (H, W), of a square view around copies of a mesh."""

    light: PointLight
    axes: FloatArray  # (3, 3) right, down and forward
    scale: float  # pixels of a tangent of 1
    nearest: FloatArray

    def add_irradiance(self, total: FloatArray, points_mm: FloatArray, normals: FloatArray) -> None:
        """Add what arrives at places (N, 3) with unit normals (N, 3) to ``total`` (N, C)."""
        light = self.light
        power = np.asarray(light.power, dtype=np.float64) * light.reference_mm**2
        compiled.add_light(
            total,
            points_mm,
            normals,
            np.array(light.place_mm, dtype=np.float64),
            np.array(np.broadcast_to(power, total.shape[1:])),
            self.axes,
            self.scale,
            self.nearest,
            _BIAS_MM,
        )


def draw_shadows(light: PointLight, mesh: Mesh, offsets_mm: npt.ArrayLike, size: int) -> ShadowMap:
    """Draw copies of a mesh as a light sees them, on ``size`` x ``size`` pixels."""
    offsets = np.asarray(offsets_mm, dtype=np.float64).reshape(-1, 3)
    ends = np.concatenate([mesh.box_mm + each for each in offsets])
    place = np.array(light.place_mm)
    axes = _axes_toward(0.5 * (ends.min(axis=0) + ends.max(axis=0)) - place)
    corners = (ends - place) @ axes.T
    if corners[:, 2].min() <= _NEAR_MM:
        raise RenderError(
            f"The light at {shown(light.place_mm)} mm lies among the objects; move it away by "
            "more than their size."
        )
    widest = float(np.abs(corners[:, :2] / corners[:, 2:]).max())
    scale = 0.5 * size / (1.02 * widest)
    nearest = np.zeros((size, size))
    owner, places = np.full((size, size), -1, dtype=np.int64), np.zeros((size, size, 2))
    for offset in offsets:
        view = (mesh.positions_mm + offset - place) @ axes.T
        screen = 0.5 * size + scale * view[:, :2] / view[:, 2:]
        which = np.ones(len(mesh.faces), dtype=bool)
        compiled.draw(
            np.ascontiguousarray(screen[mesh.faces]),
            1.0 / view[:, 2][mesh.faces],
            which,
            0,
            owner,
            places,
            nearest,
        )
    return ShadowMap(light, axes, scale, nearest)


def _axes_toward(direction: FloatArray) -> FloatArray:
    """Return right, down and forward (3, 3) of a view in a direction."""
    forward = direction / np.linalg.norm(direction)
    up = np.array([0.0, 1.0, 0.0]) if abs(forward[1]) < 0.99 else np.array([0.0, 0.0, 1.0])
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    return np.stack((right, np.cross(forward, right), forward))


def irradiance_at(
    points_mm: FloatArray,
    normals: FloatArray,
    shadows: Sequence[ShadowMap],
    ambient: npt.ArrayLike,
    channels: int,
) -> FloatArray:
    """Return the irradiance (N, C) of places (N, 3) [mm] with unit normals (N, 3)."""
    total = np.zeros((len(points_mm), channels)) + np.asarray(ambient, dtype=np.float64)
    for each in shadows:
        each.add_irradiance(total, points_mm, normals)
    return total


def specular_at(
    points_mm: FloatArray,
    normals: FloatArray,
    shadows: Sequence[ShadowMap],
    eye_mm: FloatArray,
    channels: int,
) -> FloatArray:
    """Return the light (N, C) that skin reflects at its surface to an eye.

    Kelemen and Szirmay-Kalos 2001, "A microfacet based coupled specular-matte BRDF model with
    importance sampling", as in GPU Gems 3, chapter 14.3: Beckmann's distribution, Schlick's
    reflectance of the half angle and the geometry term 1 / (h . h). As a radiant exitance: times
    pi.
    """
    to_eye = unit(eye_mm - points_mm)
    total = np.zeros((len(points_mm), channels))
    for each in shadows:
        arriving = np.zeros_like(total)
        each.add_irradiance(arriving, points_mm, normals)
        to_light = unit(np.array(each.light.place_mm) - points_mm)
        half = to_light + to_eye
        middle = unit(half)
        at_normal = np.clip(np.einsum("nk,nk->n", middle, normals), 1e-4, 1.0)
        tangent2 = (1.0 - at_normal**2) / at_normal**2
        beckmann = np.exp(-tangent2 / ROUGHNESS**2) / (np.pi * ROUGHNESS**2 * at_normal**4)
        schlick = F0 + (1.0 - F0) * (1.0 - np.einsum("nk,nk->n", middle, to_eye)) ** 5
        strength = beckmann * schlick / np.maximum(np.einsum("nk,nk->n", half, half), 1e-9)
        total += (np.pi * SPECULAR * np.maximum(strength, 0.0))[:, None] * arriving
    return total


def unit(vectors: FloatArray) -> FloatArray:
    """Return vectors (..., 3) of length 1; those of length 0 stay."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    found: FloatArray = vectors / np.where(length > 0.0, length, 1.0)
    return found
