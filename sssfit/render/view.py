"""What a camera sees of lit meshes, as the buffers of a renderer in screen space."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from sssfit.render.drawn import Drawn, draw_view
from sssfit.render.lights import PointLight, draw_shadows, irradiance_at, specular_at, unit
from sssfit.scene.camera import Camera
from sssfit.scene.mesh import Mesh
from sssfit.scene.record import Scene


def view_of(
    mesh: Mesh,
    offsets_mm: npt.ArrayLike,
    camera: Camera,
    lights: Sequence[PointLight],
    *,
    channels: int = 3,
    shadow_size: int = 1024,
    ambient: float = 0.05,
    specular: bool = True,
) -> tuple[Scene, Drawn]:
    """Return irradiance, depth, mask and specular light of each pixel, and what it shows.

    Each copy of the mesh is an object of its own, whose number in the mask is its place among the
    copies, from 1. `sssfit.render.screen` blurs the scene.
    """
    offsets = np.asarray(offsets_mm, dtype=np.float64).reshape(-1, 3)
    shadows = [draw_shadows(each, mesh, offsets, shadow_size) for each in lights]
    drawn = draw_view(mesh, offsets, camera)
    here = drawn.covered
    points = drawn.interpolated(mesh, mesh.positions_mm) + offsets[drawn.copies[here]]
    normals = unit(drawn.interpolated(mesh, np.asarray(mesh.normals)))
    light, gloss = (np.zeros((*here.shape, channels)) for _ in range(2))
    light[here] = irradiance_at(points, normals, shadows, ambient, channels)
    if specular:
        gloss[here] = specular_at(points, normals, shadows, camera.eye_mm, channels)
    depth = np.full(here.shape, np.inf)
    depth[here] = camera.distance_mm - points[:, 2]
    scene = Scene(
        mesh.name,
        light,
        camera.mm_per_pixel,
        distance_mm=camera.distance_mm,
        depth_mm=depth,
        mask=(drawn.copies + 1).astype(np.int32),
        specular=gloss,
    )
    return scene, drawn
