"""Heads side by side before a camera: what the paper leaves open, pinned."""

import functools
import math
from dataclasses import dataclass, field

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import ArgumentError, RenderError
from sssfit.messages import shown
from sssfit.render.lights import PointLight
from sssfit.render.texture import UNIT_MM
from sssfit.scene.camera import FOV_DEGREES, Camera
from sssfit.scene.head_mesh import head_mesh
from sssfit.scene.mesh import Mesh

HEAD_UNITS, SPACING_UNITS = 2.5, 2.0  # of 100 mm; the paper gives neither
DISTANCE_UNITS = 10.0
RESOLUTION = (1200, 1920)  # the paper's, rows and columns
MOST_HEADS = 64
# Two lights far before the row, on both sides, so that all heads are lit alike: direction, power.
_LIGHTS = (((-0.5, 0.45, 0.75), 0.9), ((0.75, 0.1, 0.65), 0.45))
_LIGHT_UNITS = 100.0
_FLAT = 1e-6  # of width or depth: a mesh of less height cannot be scaled by it


@dataclass(frozen=True, slots=True)
class Row:
    """Heads in a row that looks at the camera, its middle at the origin.

    Parameters
    ----------
    heads : int
        1 to 64.
    distance_units : float [100 mm]
        Distance of the camera from the row's middle.
    head_units, spacing_units : float [100 mm]
        Height of a head, and from one's middle to the next.
    fov_degrees : float [degrees]
        Vertical field of view.
    resolution : (int, int)
        Rows and columns of the picture.
    mesh : Mesh, optional
        In place of the made head, scaled to ``head_units``.

    Raises
    ------
    ArgumentError, RenderError
        A setting is out of range, the mesh is flat, or the camera stands among the heads.
    """

    heads: int
    distance_units: float
    head_units: float = HEAD_UNITS
    spacing_units: float = SPACING_UNITS
    fov_degrees: float = FOV_DEGREES
    resolution: tuple[int, int] = RESOLUTION
    mesh: Mesh | None = field(default=None)

    def __post_init__(self) -> None:
        if isinstance(self.heads, bool) or not isinstance(self.heads, int):
            raise ArgumentError(f"`heads = {shown(self.heads)}`: expected a whole number.")
        if not 1 <= self.heads <= MOST_HEADS:
            raise ArgumentError(f"`heads = {self.heads}`: expected 1 to {MOST_HEADS}.")
        for name in ("distance_units", "head_units", "spacing_units"):
            value = getattr(self, name)
            if not 0.0 < value < math.inf:
                raise ArgumentError(f"{name} = {shown(value)}; expected a number above 0.")
        if self.distance_units <= 0.5 * self.head_units:
            raise ArgumentError(
                f"`distance_units = {self.distance_units:g}`: expected more than half a head's "
                f"height of {self.head_units:g} units."
            )
        if self.mesh is not None:
            self._check_front(self.mesh)

    def _check_front(self, mesh: Mesh) -> None:
        """Raise an error for a camera that the mesh is not before, at its height in the row."""
        front_mm = self.shape.positions_mm[:, 2].max() + self.camera.near_mm
        if self.camera.distance_mm <= front_mm:
            raise ArgumentError(
                f"`distance_units = {self.distance_units:g}`: expected more than "
                f"{math.ceil(1000.0 * front_mm / UNIT_MM) / 1000.0:g}, as {mesh.name} at a height "
                f"of {self.head_units:g} units reaches that far towards the camera."
            )

    @property
    def shape(self) -> Mesh:
        """The mesh of one head, its middle at the origin."""
        height_mm = self.head_units * UNIT_MM
        return head_mesh(height_mm) if self.mesh is None else _scaled(self.mesh, height_mm)

    @property
    def offsets_mm(self) -> FloatArray:
        """Middles of the heads (N, 3) [mm]."""
        x = (np.arange(self.heads) - 0.5 * (self.heads - 1)) * self.spacing_units * UNIT_MM
        return np.stack((x, np.zeros_like(x), np.zeros_like(x)), axis=1)

    @property
    def camera(self) -> Camera:
        """The camera."""
        height, width = self.resolution
        return Camera(self.distance_units * UNIT_MM, height, width, self.fov_degrees)

    @property
    def lights(self) -> tuple[PointLight, ...]:
        """Two lights, 100 units away."""
        far = _LIGHT_UNITS * UNIT_MM
        return tuple(
            PointLight((far * x, far * y, far * z), (power,), far) for (x, y, z), power in _LIGHTS
        )


@functools.lru_cache(maxsize=2)
def _scaled(mesh: Mesh, height_mm: float) -> Mesh:
    """Return a mesh of a height, its middle at the origin."""
    low, high = mesh.positions_mm.min(axis=0), mesh.positions_mm.max(axis=0)
    width, height, depth = high - low
    if height <= _FLAT * max(width, depth):
        raise RenderError(
            f"{mesh.name}: the mesh is {height:.3g} mm high (along y), {width:.3g} wide and "
            f"{depth:.3g} deep; expected a height, by which it is scaled. Turn it upright."
        )
    points = (mesh.positions_mm - 0.5 * (low + high)) * (height_mm / height)
    return Mesh(mesh.name, points, mesh.uv, mesh.faces, mesh.normals)
