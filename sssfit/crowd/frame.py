"""One picture of a row of heads: work, time and error with savings, beside those without."""

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from sssfit.arrays import BoolArray, plain
from sssfit.crowd.row import Row
from sssfit.errors import RenderError
from sssfit.formats.pictures import image_format, save_image
from sssfit.kernel import Kernel, Taps
from sssfit.measure.delta_e import delta_e_2000, exposure_of
from sssfit.messages import counted, table
from sssfit.render.bloom import bloomed
from sssfit.render.drawn import Drawn
from sssfit.render.screen import render_screen
from sssfit.render.screen_taps import render_screen_taps
from sssfit.render.texture import Savings, TextureFrame, render_texture
from sssfit.render.view import view_of

Picture = npt.NDArray[np.floating[Any]]
_Errors = tuple[float, float, float, int]

MAP_SIZE = 1024
# Of a pixel's width: neighbours further apart in depth are on either side of a contour, or on a
# surface seen at less than 14 degrees.
_DEPTH_STEP = 4.0


@dataclass(frozen=True, slots=True, eq=False)
class Work:
    """What a picture took, and how far it is from the picture without savings.

    Parameters
    ----------
    texels_lit, texels_convolved : int
        Of maps, or pixels of a picture in screen space; of all passes.
    seconds : mapping of str to float
        By stage.
    mean_delta_e, largest_delta_e : float
        Over visible pixels, at the exposure of the picture without savings.
    largest_inside : float
        The largest one farther than the kernel reaches from outlines and from the picture's border.
    inside_pixels : int
        How many lie there.
    """

    texels_lit: int
    texels_convolved: int
    seconds: Mapping[str, float]
    mean_delta_e: float = 0.0
    largest_delta_e: float = 0.0
    largest_inside: float = 0.0
    inside_pixels: int = 0

    @property
    def total_seconds(self) -> float:
        """Of all stages."""
        return sum(self.seconds.values())

    def to_dict(self) -> dict[str, Any]:
        """Return the figures of ``sssfit scene --json``."""
        return {
            "texels_lit": self.texels_lit,
            "texels_convolved": self.texels_convolved,
            "milliseconds": {name: 1e3 * each for name, each in self.seconds.items()},
            "total_milliseconds": 1e3 * self.total_seconds,
            "mean_delta_e": self.mean_delta_e,
            "largest_delta_e": self.largest_delta_e,
            "largest_inside": self.largest_inside,
            "inside_pixels": self.inside_pixels,
        }


@dataclass(frozen=True, slots=True, eq=False)
class CrowdFrame:
    """A picture with savings, without them, and in screen space.

    Parameters
    ----------
    row : Row
    savings : Savings
    map_size : int
    map_sizes : tuple of int
        Of each head, with savings.
    picture : array (H, W, C)
        With savings.
    work : mapping of str to Work
        "saved", "whole" and "screen".
    """

    row: Row
    savings: Savings
    map_size: int
    map_sizes: tuple[int, ...]
    picture: Picture
    work: Mapping[str, Work]

    def save(
        self, target: str | Path | BinaryIO, *, format: str | None = None, bloom: float = 0.0
    ) -> None:
        """Write the picture with savings, a share ``bloom`` of its light spread by glare.

        ``format`` is "exr", "tiff" or "png", by default from the ending. A PNG has the exposure at
        which errors are measured.
        """
        form = format or image_format(target)
        lit = np.asarray(self.picture[self.picture.max(axis=-1) > 0.0], dtype=np.float64)
        save_image(
            target,
            bloomed(self.picture, bloom),
            format=form,
            exposure=exposure_of(lit) if form == "png" and lit.size else 1.0,
            mm_per_pixel=self.row.camera.mm_per_pixel,
        )

    @property
    def speed_up(self) -> tuple[float, float]:
        """How many times fewer texels are convolved, and how much less time is taken."""
        whole, saved = self.work["whole"], self.work["saved"]
        texels = whole.texels_convolved / max(saved.texels_convolved, 1)
        return texels, whole.total_seconds / saved.total_seconds

    def to_dict(self) -> dict[str, Any]:
        """Return the figures of ``sssfit scene --json``."""
        row, savings = self.row, self.savings
        texels, seconds = self.speed_up
        return plain(
            {
                "heads": row.heads,
                "distance_units": row.distance_units,
                "head_units": row.head_units,
                "spacing_units": row.spacing_units,
                "fov_degrees": row.fov_degrees,
                "height": row.resolution[0],
                "width": row.resolution[1],
                "culled": savings.culled,
                "by_depth": savings.by_depth,
                "clipped": savings.clipped,
                "margin": savings.margin,
                "map_size": self.map_size,
                "map_sizes": list(self.map_sizes),
                "speed_up_texels": texels,
                "speed_up_seconds": seconds,
                "work": {name: each.to_dict() for name, each in self.work.items()},
            }
        )

    def text(self) -> str:
        """Return the same for a terminal."""
        row = self.row
        texels, seconds = self.speed_up
        head = (
            f"{counted(row.heads, 'head')} of {row.head_units:g} units, {row.spacing_units:g} "
            f"apart, from {row.distance_units:g} units (100 mm each); {row.fov_degrees:g} degrees, "
            f"{row.resolution[1]} x {row.resolution[0]} pixels, maps of {self.map_size} texels"
        )
        every = self.work.values()
        rows = [
            ["texels lit", *(f"{each.texels_lit:,}" for each in every)],
            ["texels convolved", *(f"{each.texels_convolved:,}" for each in every)],
            *(
                [
                    f"{name} (ms)",
                    *(f"{1000.0 * each.seconds.get(name, 0.0):,.0f}" for each in every),
                ]
                for name in _STAGES
            ),
            ["all stages (ms)", *(f"{1e3 * each.total_seconds:,.0f}" for each in every)],
            ["mean Delta E", *(f"{each.mean_delta_e:.3f}" for each in every)],
            ["largest Delta E inside", *(f"{each.largest_inside:.3f}" for each in every)],
        ]
        heads = ["", *(_NAMES[name] for name in self.work)]
        ends = f"{texels:.2f} times fewer texels convolved, {seconds:.2f} times as fast"
        return f"{head}\n{table(heads, rows)}\n{ends}"


_NAMES = {"whole": "nothing left out", "saved": "with savings", "screen": "screen space"}
_STAGES = ("shadows", "irradiance", "convolution", "picture")


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
