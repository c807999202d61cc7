"""Meshes with texture coordinates from OBJ, PLY and glTF files, by trimesh."""

import itertools
import math
from pathlib import Path
from typing import Any

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import FileError, RenderError
from sssfit.files import path_of, reason
from sssfit.messages import note, printable, shown
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

    Notes
    -----
    Texture coordinates are the file's. Only where those of several materials overlap, which then
    have a texture each, every material gets a tile of its own of the one map.
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
    uv = _texture([part for part, _ in parts], str(path))
    if uv is None and path.suffix.lower() in (".gltf", ".glb"):
        raise RenderError(
            f"{path}: no texture coordinates were found; trimesh reads those of a glTF only where "
            "the mesh has a material as well."
        )
    points = np.asarray(loaded.vertices, dtype=np.float64) * mm_per_unit
    faces = np.asarray(loaded.faces, dtype=np.int64)
    return Mesh(path.stem, points, uv, faces, _normals(parts, points, faces))


def _texture(parts: list[Any], origin: str) -> Any:
    """Return the texture coordinates (V, 2) of all parts in one map; None if one has none.

    trimesh would pack materials by the sizes of their images, and those without into a few texels.
    """
    own: list[Any] = [getattr(part.visual, "uv", None) for part in parts]
    if any(each is None or len(each) == 0 for each in own):
        return None
    found = [getattr(part.visual, "material", None) for part in parts]
    used = [(getattr(each, "name", None), hash(each)) for each in found]
    of_material = {
        each: np.concatenate([uv for uv, own_one in zip(own, used, strict=True) if own_one == each])
        for each in dict.fromkeys(used)
    }
    whole = np.concatenate(own)
    is_one_tile = bool((whole >= 0.0).all() and (whole <= 1.0).all())  # a mesh refuses others
    boxes = [(uv.min(axis=0), uv.max(axis=0)) for uv in of_material.values()]
    if not is_one_tile or not _overlap(boxes):
        return whole
    side = math.ceil(math.sqrt(len(boxes)))
    note(
        f"{printable(origin)}: {len(boxes)} materials overlap in the texture; each takes one of "
        f"{side} x {side} tiles of the map."
    )
    tiles = {each: np.array((k % side, k // side)) for k, each in enumerate(of_material)}
    return np.concatenate([(uv + tiles[each]) / side for uv, each in zip(own, used, strict=True)])


def _overlap(boxes: list[tuple[FloatArray, FloatArray]]) -> bool:
    """Return whether any two boxes (least, most) have an area in common."""
    return any(
        bool((np.minimum(a[1], b[1]) > np.maximum(a[0], b[0])).all())
        for a, b in itertools.combinations(boxes, 2)
    )


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
