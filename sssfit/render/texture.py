"""Diffusion in texture space, and the computations that it can leave out.

After Jimenez and Gutierrez 2008, "Faster rendering of human skin" (figure 2): shadow maps, an
irradiance map of each head rasterised in its texture, a kernel's passes there, within each chart
(`sssfit.scene.charts`), and the final picture, with specular light added after the diffusion. Three
things may be left out of a map: texels that face away by more than 105 degrees (culled), texels too
fine for the distance (a map of the side T = T_max min(d_ref / d, 1), equations 3 and 4), and what
lies outside of the frustum (clipped, equation 6).
"""

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit.arrays import is_whole
from sssfit.errors import RenderError
from sssfit.kernel import Kernel
from sssfit.messages import shown
from sssfit.render.drawn import BoolArray, Drawn, draw_texture, draw_view
from sssfit.render.lights import (
    PointLight,
    ShadowMap,
    draw_shadows,
    irradiance_at,
    specular_at,
    unit,
)
from sssfit.render.screen_taps import check_no_disk
from sssfit.render.texture_blur import blur_texture
from sssfit.render.texture_level import Level
from sssfit.render.texture_lookup import look_up
from sssfit.scene.camera import Camera
from sssfit.scene.charts import IndexArray, charts_of
from sssfit.scene.mesh import Mesh

FloatArray = npt.NDArray[np.floating[Any]]

CULL_DEGREES = 105.0
REFERENCE_UNITS, UNIT_MM = 4.5, 100.0  # d_ref, for a map of its full size
CULLING = ("vertex", "face")


@dataclass(frozen=True, slots=True)
class Savings:
    """What a frame leaves out.

    Parameters
    ----------
    culled : {"vertex", "face"}, optional
        Texels that face away from the eye, by normals of vertices or of triangles.
    cull_degrees : float [degrees]
        Angle between normal and view from which a texel counts as such; 180 is none.
    by_depth : bool
        Smaller maps farther away.
    clipped : bool
        Texels outside of the frustum.
    margin : float
        D of the frustum's sides: 1 is the picture itself, more keeps a border around it.
    """

    culled: str | None = None
    cull_degrees: float = CULL_DEGREES
    by_depth: bool = False
    clipped: bool = False
    margin: float = 1.0

    def __post_init__(self) -> None:
        if self.culled not in (None, *CULLING):
            raise RenderError(f"culled = {shown(self.culled)}; expected {' or '.join(CULLING)}.")
        if not 90.0 <= self.cull_degrees <= 180.0:
            raise RenderError(
                f"cull_degrees = {shown(self.cull_degrees)}; expected 90 to 180 degrees."
            )
        if not 0.0 < self.margin < np.inf:
            raise RenderError(f"margin = {shown(self.margin)}; expected a number above 0.")


@dataclass(frozen=True, slots=True, eq=False)
class TextureFrame:
    """A frame and what it took.

    Parameters
    ----------
    picture : array (H, W, C)
        Linear light.
    drawn : Drawn
        What each pixel shows.
    map_sizes : tuple of int
        Side of each copy's map in texels.
    texels_lit, texels_convolved : int
        Whose irradiance was computed; and computed in all passes.
    seconds : dict
        By stage: shadows, irradiance, convolution, picture. The mesh's charts are no frame's work.
    """

    picture: FloatArray
    drawn: Drawn
    map_sizes: tuple[int, ...]
    texels_lit: int
    texels_convolved: int
    seconds: dict[str, float] = field(default_factory=dict)


def render_texture(
    mesh: Mesh,
    offsets_mm: npt.ArrayLike,
    camera: Camera,
    lights: Sequence[PointLight],
    kernel: Kernel,
    *,
    savings: Savings = Savings(),
    map_size: int = 2048,
    shadow_size: int = 1024,
    ambient: float = 0.05,
    specular: bool = True,
    threads: int | None = None,
) -> TextureFrame:
    """Render copies of a mesh with diffusion in texture space.

    Parameters
    ----------
    mesh : Mesh
    offsets_mm : array (K, 3) [mm]
        Offset of each copy.
    camera : Camera
    lights : sequence of PointLight
    kernel : SeparableKernel or Taps
    savings : Savings
    map_size, shadow_size : int
        T_max, the side of a whole irradiance map in texels, and that of shadow maps.
    ambient : float
        Irradiance from all sides.
    specular : bool
        Add specular light.
    threads : int, optional

    Raises
    ------
    RenderError
        There is no light, a setting is invalid, or the kernel is a disk of fetches.
    """
    check_no_disk(kernel)
    _check_light(lights, ambient)
    for name, value in (("map_size", map_size), ("shadow_size", shadow_size)):
        if not (is_whole(value) and 8 <= value <= 16384):
            raise RenderError(f"{name} = {shown(value)}; expected 8 to 16384 texels.")
    offsets = np.asarray(offsets_mm, dtype=np.float64).reshape(-1, 3)
    seconds: dict[str, float] = {}
    with _clock(seconds, "shadows"):
        shadows = [draw_shadows(each, mesh, offsets, shadow_size) for each in lights]
    with _clock(seconds, "picture"):
        drawn = draw_view(mesh, offsets, camera)
    channels = len(kernel.channels)
    picture = np.zeros((camera.height, camera.width, channels))
    lit, convolved, sizes = 0, 0, list[int]()
    charts = charts_of(mesh)
    for k, offset in enumerate(offsets):
        size = _map_size(mesh, offset, camera, map_size) if savings.by_depth else map_size
        with _clock(seconds, "irradiance"):
            needed, level = _map_of(mesh, charts, offset, camera, savings, size)
            light = _irradiance(mesh, offset, needed, shadows, ambient, channels)
        with _clock(seconds, "convolution"):
            blurred, count = blur_texture(light, level, kernel, threads=threads)
        with _clock(seconds, "picture"):
            _show(picture, drawn, k, mesh, charts, offset, camera, blurred, level)
        lit, convolved, sizes = lit + level.texels, convolved + count, [*sizes, size]
    with _clock(seconds, "picture"):
        if specular:
            _add_specular(picture, drawn, mesh, offsets, shadows, camera)
    return TextureFrame(picture, drawn, tuple(sizes), lit, convolved, seconds)


def _check_light(lights: Sequence[PointLight], ambient: float) -> None:
    if not 0.0 <= ambient < np.inf:
        raise RenderError(f"ambient = {shown(ambient)}; expected a number from 0.")
    if not any(max(each.power) > 0.0 for each in lights) and ambient == 0.0:
        raise RenderError("The scene has no light; add a point light or ambient light.")


def _map_size(mesh: Mesh, offset: FloatArray, camera: Camera, most: int) -> int:
    """Return T = T_max min(d_ref / d, 1), d to the nearest corner of the bounding box."""
    distance = float(np.linalg.norm(mesh.box_mm + offset - camera.eye_mm, axis=1).min())
    return max(round(most * min(REFERENCE_UNITS * UNIT_MM / distance, 1.0)), 8)


def _map_of(
    mesh: Mesh,
    charts: IndexArray,
    offset: FloatArray,
    camera: Camera,
    savings: Savings,
    size: int,
) -> tuple[Drawn, Level]:
    """Return the texels of a map that are to be lit and convolved, twice."""
    texels = draw_texture(mesh, size)
    here = texels.covered
    cover = np.zeros(here.shape)
    cover[here] = _is_needed(mesh, offset, camera, savings, texels)
    per_mm = np.zeros((*here.shape, 2))
    # Down is along v, right along u.
    per_mm[here] = size / mesh.stretch_mm()[texels.faces[here]][:, ::-1]
    needed = Drawn(np.where(cover > 0.0, 0, -1), texels.faces, texels.places)
    return needed, Level.of_map(cover, per_mm, charts[texels.faces])


def _is_needed(
    mesh: Mesh, offset: FloatArray, camera: Camera, savings: Savings, texels: Drawn
) -> BoolArray:
    """Return whether covered texels (N,) face the eye and lie in the frustum."""
    points = texels.interpolated(mesh, mesh.positions_mm) + offset
    needed = np.ones(len(points), dtype=bool)
    if savings.culled is not None:
        to_eye = camera.eye_mm - points
        if savings.culled == "face":
            normals = mesh.face_normals[texels.faces[texels.covered]]
        else:
            normals = texels.interpolated(mesh, np.asarray(mesh.normals))
        cosine = np.einsum("nk,nk->n", normals, to_eye)
        length = np.linalg.norm(normals, axis=1) * np.linalg.norm(to_eye, axis=1)
        needed &= cosine >= np.cos(np.radians(savings.cull_degrees)) * length
    if savings.clipped:
        eye = camera.to_eye(points)
        homogeneous = np.concatenate((eye, np.ones((len(eye), 1))), axis=1)
        needed &= (homogeneous @ camera.eye_planes(savings.margin).T >= 0.0).all(axis=1)
    return needed


def _irradiance(
    mesh: Mesh,
    offset: FloatArray,
    needed: Drawn,
    shadows: Sequence[ShadowMap],
    ambient: float,
    channels: int,
) -> FloatArray:
    """Return the irradiance map (T, T, C); only needed texels are computed."""
    light = np.zeros((*needed.copies.shape, channels))
    points = needed.interpolated(mesh, mesh.positions_mm) + offset
    normals = unit(needed.interpolated(mesh, np.asarray(mesh.normals)))
    light[needed.covered] = irradiance_at(points, normals, shadows, ambient, channels)
    return light


def _add_specular(
    picture: FloatArray,
    drawn: Drawn,
    mesh: Mesh,
    offsets: FloatArray,
    shadows: Sequence[ShadowMap],
    camera: Camera,
) -> None:
    """Add the light that pixels reflect at the surface."""
    here = drawn.covered
    points = drawn.interpolated(mesh, mesh.positions_mm) + offsets[drawn.copies[here]]
    normals = unit(drawn.interpolated(mesh, np.asarray(mesh.normals)))
    channels = picture.shape[2]
    picture[here] += specular_at(points, normals, shadows, camera.eye_mm, channels)


def _show(
    picture: FloatArray,
    drawn: Drawn,
    copy: int,
    mesh: Mesh,
    charts: IndexArray,
    offset: FloatArray,
    camera: Camera,
    blurred: FloatArray,
    level: Level,
) -> None:
    """Write the pixels that show a copy from its map."""
    here = drawn.copies == copy
    if not here.any():
        return
    own = Drawn(np.where(here, copy, -1), drawn.faces, drawn.places)
    height, width = level.texture.height, level.texture.width
    uv = own.interpolated(mesh, mesh.uv)
    places = np.stack((height * (1.0 - uv[:, 1]) - 0.5, width * uv[:, 0] - 0.5), axis=1)
    depth = camera.distance_mm - (own.interpolated(mesh, mesh.positions_mm) + offset)[:, 2]
    pixel_mm = camera.mm_per_pixel * depth / camera.distance_mm
    # An anisotropic filter's: the texels of a pixel that looks straight at the surface.
    faces = drawn.faces[here]
    across = np.sqrt(height * width / mesh.stretch_mm()[faces].prod(axis=1))
    picture[here] = look_up(blurred, level, places, across * pixel_mm, charts[faces])


@contextmanager
def _clock(seconds: dict[str, float], stage: str) -> Iterator[None]:
    begun = time.perf_counter()
    try:
        yield
    finally:
        seconds[stage] = seconds.get(stage, 0.0) + time.perf_counter() - begun
