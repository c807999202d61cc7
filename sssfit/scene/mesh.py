"""Triangle meshes with texture coordinates, in mm, and the checks of what people's files hold."""

import dataclasses
import warnings
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray, ReadOnly, check_label, number_array
from sssfit.errors import RenderError, SssfitWarning
from sssfit.messages import counted, shown

IndexArray = npt.NDArray[np.int64]

_FLAT = 1e-12  # of the longest edge's square: a triangle with less area has no normal


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class Mesh(ReadOnly):
    """Triangles with texture coordinates; arrays are stored as read-only float64.

    x points right, y up and z to the viewer. Seen from outside, corners of a triangle go round
    counterclockwise. Texture coordinates are those of OBJ files: u to the right and v up, 0 to 1.

    Parameters
    ----------
    name : str
        For reports.
    positions_mm : array (V, 3) [mm]
    uv : array (V, 2)
        A vertex on a seam is there once for each chart.
    faces : array (F, 3) of int
        Vertices of each triangle. Triangles without an area are left out, with a warning.
    normals : array (V, 3), optional
        Vectors of any length. By default the sum of the normals of the triangles around a place, by
        area, over seams.

    Raises
    ------
    RenderError
        A shape or a number is invalid, or texture coordinates are missing.
    """

    name: str
    positions_mm: FloatArray
    uv: FloatArray
    faces: IndexArray
    normals: FloatArray | None = None

    def __post_init__(self) -> None:
        check_label("name", self.name, RenderError)
        points = self._numbers("positions_mm", self.positions_mm, 3)
        if self.uv is None:
            raise RenderError(
                f"{self.name}: the mesh has no texture coordinates, and diffusion in texture space "
                "needs them; unwrap it and export them as well."
            )
        uv = self._numbers("uv", self.uv, 2, len(points))
        if uv.min() < 0.0 or uv.max() > 1.0:
            raise RenderError(
                f"{self.name}: uv reaches from {uv.min():.3g} to {uv.max():.3g}; expected one tile "
                "from 0 to 1."
            )
        faces = self._checked_faces(points)
        self._set("positions_mm", points)
        self._set("uv", uv)
        self._set("faces", faces)
        self._set("normals", self._unit_normals(points, faces))

    def __repr__(self) -> str:
        size = " x ".join(f"{each:.4g}" for each in np.ptp(self.positions_mm, axis=0))
        return f"<Mesh {shown(self.name)}: {counted(len(self.faces), 'triangle')} in {size} mm>"

    def _numbers(
        self, field: str, given: npt.ArrayLike, columns: int, rows: int | None = None
    ) -> FloatArray:
        values = number_array(f"{self.name}: {field}", given, RenderError)
        if values.ndim != 2 or values.shape[1] != columns or len(values) == 0:
            raise RenderError(
                f"{self.name}: {field} has shape {values.shape}; expected vertices and {columns} "
                "numbers of each."
            )
        if rows is not None and len(values) != rows:
            raise RenderError(
                f"{self.name}: {field} has {len(values)} rows; expected one for each of "
                f"{rows} vertices."
            )
        if bad := int((~np.isfinite(values)).any(axis=1).sum()):
            raise RenderError(
                f"{self.name}: {field} is NaN or infinite at {bad} of {len(values)} vertices; "
                "expected numbers."
            )
        return values

    def _checked_faces(self, points: FloatArray) -> IndexArray:
        try:
            given = np.asarray(self.faces)
        except ValueError:  # rows of different lengths
            given = np.array(None)
        if given.ndim != 2 or given.shape[1:] != (3,) or given.dtype.kind not in "iu":
            raise RenderError(
                f"{self.name}: faces has shape {given.shape} of {given.dtype}; expected triangles "
                "of three whole numbers."
            )
        faces = given.astype(np.int64)
        if len(faces) == 0 or faces.min() < 0 or faces.max() >= len(points):
            raise RenderError(
                f"{self.name}: {counted(len(faces), 'triangle')} of vertices "
                f"{faces.min(initial=0)} to {faces.max(initial=0)}; expected at least one triangle "
                f"of vertices 0 to {len(points) - 1}."
            )
        corners = points[faces]
        edges = np.stack([corners[:, k] - corners[:, k - 1] for k in range(3)])
        longest = (edges**2).sum(axis=-1).max(axis=0)
        is_flat = np.linalg.norm(_normals_by_area(points, faces), axis=1) <= _FLAT * longest
        if is_flat.all():
            raise RenderError(f"{self.name}: no triangle has an area; expected a surface.")
        if is_flat.any():
            warnings.warn(
                f"{self.name}: {counted(int(is_flat.sum()), 'triangle')} without an area left out.",
                SssfitWarning,
                stacklevel=4,
            )
        return np.ascontiguousarray(faces[~is_flat])

    def _unit_normals(self, points: FloatArray, faces: IndexArray) -> FloatArray:
        if self.normals is None:
            normals = smooth_normals(points, faces)
        else:
            normals = self._numbers("normals", self.normals, 3, len(points))
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        used = np.zeros(len(points), dtype=bool)
        used[faces] = True
        if bad := int(((length[:, 0] == 0.0) & used).sum()):
            raise RenderError(f"{self.name}: {bad} normals are 0; expected directions.")
        return normals / np.where(length > 0.0, length, 1.0)

    def _set(self, field: str, values: npt.NDArray[Any]) -> None:
        values.setflags(write=False)
        object.__setattr__(self, field, values)

    @property
    def face_normals(self) -> FloatArray:
        """Unit normals of the triangles (F, 3)."""
        normals = _normals_by_area(self.positions_mm, self.faces)
        unit: FloatArray = normals / np.linalg.norm(normals, axis=1, keepdims=True)
        return unit

    @property
    def area_mm2(self) -> FloatArray:
        """Areas of the triangles (F,) [mm^2]."""
        normals = _normals_by_area(self.positions_mm, self.faces)
        area: FloatArray = 0.5 * np.linalg.norm(normals, axis=1)
        return area

    @property
    def box_mm(self) -> FloatArray:
        """Corners of the bounding box (8, 3) [mm]."""
        ends = np.stack((self.positions_mm.min(axis=0), self.positions_mm.max(axis=0)))
        return np.array([[ends[i, 0], ends[j, 1], ends[k, 2]] for i, j, k in np.ndindex(2, 2, 2)])

    def stretch_mm(self) -> FloatArray:
        """Return mm of the surface that a whole side of the texture takes, by triangle (F, 2).

        |dP/du| and |dP/dv| (d'Eon and Luebke 2007, GPU Gems 3, chapter 14.5.5, has the same as a
        map); infinite where a triangle has no area in the texture.
        """
        p, t = self.positions_mm[self.faces], self.uv[self.faces]
        a, b = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
        (au, av), (bu, bv) = (t[:, 1] - t[:, 0]).T, (t[:, 2] - t[:, 0]).T
        determinant = au * bv - av * bu
        with np.errstate(divide="ignore", invalid="ignore"):
            by_u = (a * bv[:, None] - b * av[:, None]) / determinant[:, None]
            by_v = (b * au[:, None] - a * bu[:, None]) / determinant[:, None]
        lengths = np.stack((np.linalg.norm(by_u, axis=1), np.linalg.norm(by_v, axis=1)), axis=1)
        found: FloatArray = np.where(np.isfinite(lengths), lengths, np.inf)
        return found


def _normals_by_area(points: FloatArray, faces: IndexArray) -> FloatArray:
    """Return normals of the triangles as long as twice their area (F, 3)."""
    a, b, c = (points[faces[:, k]] for k in range(3))
    normals: FloatArray = np.cross(b - a, c - a)
    return normals


def smooth_normals(points: FloatArray, faces: IndexArray) -> FloatArray:
    """Return the sums of the triangles' normals around each place (V, 3)."""
    _, place = np.unique(points, axis=0, return_inverse=True)
    place = place.reshape(-1)
    sums = np.zeros((place.max() + 1, 3))
    normals = _normals_by_area(points, faces)
    for k in range(3):
        np.add.at(sums, place[faces[:, k]], normals)
    return sums[place]
