"""Meshes with texture coordinates from OBJ, PLY and glTF files, by trimesh."""

from pathlib import Path
from typing import Any

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import FileError, RenderError
from sssfit.files import path_of, reason
from sssfit.messages import shown
from sssfit.scene.mesh import IndexArray, Mesh, smooth_normals

FORMATS = (".obj", ".ply", ".gltf", ".glb")


def load_mesh(path: str | Path, *, mm_per_unit: float = 1.0) -> Mesh:
    """Read the triangles of a file as one mesh.

    Parameters
    ----------
    path : str or Path
        With one of the endings in `FORMATS`.
    mm_per_unit : float [mm]
        Length of the file's unit.

    Raises
    ------
    FileError
        The file cannot be read, or trimesh is not installed.
    RenderError
        It has no triangles or no texture coordinates, or they are invalid.
    """
    path = path_of(path)
    if path.suffix.lower() not in FORMATS:
        raise FileError(f"{path}: expected a mesh of {', '.join(FORMATS)}.")
    if not 0.0 < mm_per_unit < np.inf:
        raise RenderError(f"mm_per_unit = {shown(mm_per_unit)}; expected a length above 0.")
    if not path.is_file():
        raise FileError(f"{path}: there is no such file.")
    try:
        import trimesh
    except ImportError:
        raise FileError(
            f'{path}: meshes from files need trimesh; install "sssfit[mesh]".'
        ) from None
    try:
        # Without merging: a vertex on a seam is there once for each chart.
        parts = _parts(trimesh.load(path, force="scene", process=False))
        loaded = trimesh.util.concatenate([part for part, _ in parts])
    except OSError as error:
        raise FileError(f"{path}: {reason(error)}.") from None
    except Exception as error:  # of a dozen readers
        raise FileError(
            f"{path}: not a mesh that can be read: {str(error).rstrip('.!')}."
        ) from None
    if not isinstance(loaded, trimesh.Trimesh) or len(loaded.faces) == 0:
        raise RenderError(f"{path}: there are no triangles in it.")
    visual = getattr(loaded, "visual", None)
    uv: Any = getattr(visual, "uv", None)
    if uv is None and path.suffix.lower() in (".gltf", ".glb"):
        raise RenderError(
            f"{path}: no texture coordinates were found; trimesh reads those of a glTF only where "
            "the mesh has a material as well."
        )
    points = np.asarray(loaded.vertices, dtype=np.float64) * mm_per_unit
    faces = np.asarray(loaded.faces, dtype=np.int64)
    return Mesh(path.stem, points, uv, faces, _normals(parts, points, faces))


def _parts(scene: Any) -> list[tuple[Any, FloatArray | None]]:
    """Return the meshes of trimesh's scene in their places, and the file's normals (V, 3) of each.

    Only the first object holds normals from a file, as a cached result; copies have lost them.
    """
    parts = []
    for node in scene.graph.nodes_geometry:
        place, name = scene.graph[node]
        found = scene.geometry[name]
        if not hasattr(found, "faces"):
            continue
        part = found.copy()
        is_given = "vertex_normals" in found._cache
        if is_given:
            part.vertex_normals = found.vertex_normals
        part.apply_transform(place)
        parts.append((part, part.vertex_normals if is_given else None))
    return parts


def _normals(
    parts: list[tuple[Any, FloatArray | None]], points: FloatArray, faces: IndexArray
) -> FloatArray | None:
    """Return the file's normals (V, 3), smooth ones for meshes without; None without any."""
    if all(given is None for _, given in parts):
        return None
    if faces.max() >= len(points):  # which a mesh refuses
        return None
    normals = smooth_normals(points, faces)
    first = 0
    for part, given in parts:
        past = first + len(part.vertices)
        if given is not None:
            normals[first:past] = given
        first = past
    return normals
