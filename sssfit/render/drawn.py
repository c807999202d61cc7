"""Meshes drawn on pixels: what a camera sees, and what each texel of a texture is."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit._jit import raster as compiled
from sssfit.arrays import FloatArray
from sssfit.scene.camera import Camera
from sssfit.scene.mesh import Mesh

IndexArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Drawn:
    """Triangles on pixels (H, W).

    Parameters
    ----------
    copies : array (H, W) of int
        The copy of the mesh that a pixel shows; -1 where there is none.
    faces : array (H, W) of int
        The triangle of that copy; 0 where there is none.
    places : array (H, W, 2)
        Shares of the second and third corner.
    """

    copies: IndexArray
    faces: IndexArray
    places: FloatArray

    @property
    def covered(self) -> BoolArray:
        """Whether a pixel shows the mesh (H, W)."""
        return self.copies >= 0

    def interpolated(self, mesh: Mesh, values: FloatArray) -> FloatArray:
        """Return values of vertices (V, ...) where the mesh is covered (N, ...)."""
        here = self.covered
        flat = np.ascontiguousarray(values.reshape(len(values), -1), dtype=np.float64)
        faces, places = self.faces[here], self.places[here]
        out = np.empty((len(faces), flat.shape[1]))
        compiled.interpolate(out, faces, places, mesh.faces, flat)
        return out.reshape(len(faces), *values.shape[1:])


def draw_view(mesh: Mesh, offsets_mm: npt.ArrayLike, camera: Camera) -> Drawn:
    """Draw copies of a mesh as a camera sees them.

    Triangles that reach behind ``camera.near_mm`` are left out as a whole.

    Parameters
    ----------
    mesh : Mesh
    offsets_mm : array (K, 3) [mm]
        Offset of each copy.
    camera : Camera
    """
    shape = camera.height, camera.width
    owner, places = np.full(shape, -1, dtype=np.int64), np.zeros((*shape, 2))
    nearest = np.full(shape, 1.0 / camera.far_mm)
    count = len(mesh.faces)
    for k, offset in enumerate(np.asarray(offsets_mm, dtype=np.float64).reshape(-1, 3)):
        screen = camera.to_screen(mesh.positions_mm + offset)
        corners = screen[mesh.faces]
        in_front: BoolArray = np.all(corners[..., 2] > camera.near_mm, axis=1)
        with np.errstate(divide="ignore"):
            inverse = 1.0 / corners[..., 2]
        compiled.draw(
            np.ascontiguousarray(corners[..., :2]),
            inverse,
            in_front,
            k * count,
            owner,
            places,
            nearest,
        )
    return _drawn(owner, places, count)


def draw_texture(mesh: Mesh, size: int, drawn: BoolArray | None = None) -> Drawn:
    """Draw the mesh into its texture of ``size`` texels a side, the first row at v = 1.

    ``drawn`` (F,) says which triangles; by default all.
    """
    uv = mesh.uv[mesh.faces] * size
    corners = np.stack((uv[..., 0], size - uv[..., 1]), axis=-1)
    owner, places = np.full((size, size), -1, dtype=np.int64), np.zeros((size, size, 2))
    which = np.ones(len(corners), dtype=bool) if drawn is None else drawn
    flat = np.ones(corners.shape[:2])
    compiled.draw(corners, flat, which, 0, owner, places, np.zeros((size, size)))
    return _drawn(owner, places, len(corners))


def _drawn(owner: IndexArray, places: FloatArray, count: int) -> Drawn:
    there = owner >= 0
    copies: npt.NDArray[Any] = np.where(there, owner // count, -1)
    return Drawn(copies, np.where(there, owner % count, 0), places)
