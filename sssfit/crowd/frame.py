"""One picture of a row of heads: work, time and error with savings, beside those without."""

import math
import time
from typing import Any

import numpy as np

from sssfit.arrays import BoolArray
from sssfit.crowd.record import CrowdFrame, Picture, Work
from sssfit.crowd.row import Row
from sssfit.errors import RenderError
from sssfit.kernel import Kernel, Taps
from sssfit.measure.delta_e import delta_e_2000, exposure_of
from sssfit.render.drawn import Drawn
from sssfit.render.screen import render_screen
from sssfit.render.screen_taps import render_screen_taps
from sssfit.render.texture import Savings, TextureFrame, render_texture
from sssfit.render.view import view_of
from sssfit.scene.mesh import Mesh

_Errors = tuple[float, float, float, int]

MAP_SIZE = 1024
# Of a pixel's width: neighbours further apart in depth are on either side of a contour, or on a
# surface seen at less than 14 degrees.
_DEPTH_STEP = 4.0


def measure_frame(
    row: Row,
    kernel: Kernel,
    *,
    savings: Savings,
    map_size: int = MAP_SIZE,
    whole: TextureFrame | None = None,
    screen: bool = True,
    threads: int | None = None,
) -> CrowdFrame:
    """Render a row with savings, without them, and in screen space.

    Parameters
    ----------
    row : Row
    kernel : SeparableKernel or Taps
    savings : Savings
    map_size : int
        Side of a whole map in texels.
    whole : TextureFrame, optional
        The picture without savings, where it is known.
    screen : bool
        Also in screen space.
    threads : int, optional

    Raises
    ------
    RenderError
        The kernel has other channels than red, green and blue or a single one.
    """
    if len(kernel.channels) not in (1, 3):
        raise RenderError(
            f"The kernel has {len(kernel.channels)} channels; a frame is judged as a picture of "
            "1 or 3."
        )
    _warm_up(kernel, screen=screen, threads=threads)
    given = row.shape, row.offsets_mm, row.camera, row.lights, kernel
    how: dict[str, Any] = {"map_size": map_size, "threads": threads}
    if whole is None:
        whole = render_texture(*given, **how)
    saved = render_texture(*given, savings=savings, **how)
    visible = whole.drawn.covered
    inside = visible & _is_inside(whole.drawn, row, kernel, map_size)
    work = {
        "whole": _work_of(whole),
        "saved": _work_of(saved, _errors(saved.picture, whole.picture, visible, inside)),
    }
    if screen:
        work["screen"] = _in_screen_space(row, kernel, whole, visible, inside, threads)
    return CrowdFrame(row, savings, map_size, saved.map_sizes, saved.picture, work)


def _warm_up(kernel: Kernel, *, screen: bool, threads: int | None) -> None:
    """Render a square on 8 x 8 pixels: the first run loads compiled code, and that is not timed.

    Without it the frame without savings, which is the first, took four times as long.
    """
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    points = np.column_stack((corners - 0.5, np.zeros(4)))
    square = Mesh("square", points, corners, np.array([[0, 1, 2], [0, 2, 3]]))
    row = Row(1, 10.0, resolution=(8, 8), mesh=square)
    given = row.shape, row.offsets_mm, row.camera, row.lights, kernel
    whole = render_texture(*given, map_size=8, shadow_size=8, threads=threads)
    if screen:
        visible = whole.drawn.covered
        _in_screen_space(row, kernel, whole, visible, visible, threads)


def _work_of(frame: TextureFrame, errors: _Errors = (0.0, 0.0, 0.0, 0)) -> Work:
    return Work(frame.texels_lit, frame.texels_convolved, frame.seconds, *errors)


def _in_screen_space(
    row: Row,
    kernel: Kernel,
    whole: TextureFrame,
    visible: BoolArray,
    inside: BoolArray,
    threads: int | None,
) -> Work:
    """Return what the same picture takes in screen space, and how far it is from the other."""
    seconds: dict[str, float] = {}
    begun = time.perf_counter()
    channels = len(kernel.channels)
    scene, _ = view_of(row.shape, row.offsets_mm, row.camera, row.lights, channels=channels)
    seconds["picture"] = time.perf_counter() - begun
    begun = time.perf_counter()
    if isinstance(kernel, Taps):
        picture = render_screen_taps(scene, kernel, threads=threads)
        passes = int(kernel.figures()["all_passes"])
    else:
        picture = render_screen(scene, kernel, threads=threads)
        passes = 2 * len(kernel.signs)
    seconds["convolution"] = time.perf_counter() - begun
    pixels = int(visible.sum())
    errors = _errors(picture, whole.picture, visible, inside)
    return Work(pixels, passes * pixels, seconds, *errors)


def _errors(picture: Picture, truth: Picture, visible: BoolArray, inside: BoolArray) -> _Errors:
    """Return mean and largest Delta E over visible pixels, and the largest inside of how many."""
    if not visible.any():
        return 0.0, 0.0, 0.0, 0
    ours, true = (np.asarray(each[visible], np.float64) for each in (picture, truth))
    errors = delta_e_2000(ours, true, exposure_of(true))
    within = errors[inside[visible]]
    return float(errors.mean()), float(errors.max()), float(within.max(initial=0.0)), within.size


def _is_inside(drawn: Drawn, row: Row, kernel: Kernel, map_size: int) -> BoolArray:
    """Return whether a pixel is farther from outlines and borders than the kernel reaches."""
    from scipy.ndimage import distance_transform_edt

    mesh, camera = row.shape, row.camera
    depth = np.full(drawn.copies.shape, 10.0 * camera.distance_mm)
    here = drawn.covered
    points = drawn.interpolated(mesh, mesh.positions_mm) + row.offsets_mm[drawn.copies[here]]
    depth[here] = camera.distance_mm - points[:, 2]
    edge = np.ones(depth.shape, dtype=bool)
    edge[1:-1, 1:-1] = False
    step = _DEPTH_STEP * camera.mm_per_pixel * depth / camera.distance_mm
    for axis in (0, 1):
        for shift in (-1, 1):
            edge |= np.abs(np.roll(depth, shift, axis) - depth) > step
    reach_mm = _reach_mm(kernel, float(np.percentile(mesh.stretch_mm(), 95.0)) / map_size)
    nearest = depth[here].min(initial=camera.distance_mm)
    pixels = reach_mm / camera.mm_per_pixel * camera.distance_mm / nearest
    away: BoolArray = distance_transform_edt(~edge) > pixels + 1.0
    return away


def _reach_mm(kernel: Kernel, texel_mm: float) -> float:
    """Return how far a kernel reaches; each of its bilinear passes a texel farther."""
    if isinstance(kernel, Taps):
        farthest = [float(each.offsets_mm.max()) for each in kernel.stages]
        passes = sum(2**each.level for each in kernel.stages) if kernel.chained else 1
        along = sum(farthest) if kernel.chained else max(farthest)
    else:
        passes, along = 1, float(kernel.half_pixels * kernel.mm_per_pixel)
    return math.sqrt(2.0) * (along + passes * texel_mm)
