"""A table of taps in screen space, as a shader runs it: by depth, and within each object.

Offsets in mm become texels by each pixel's own depth, as in `sssfit.render.screen`. Every pass is
sum w A D E / sum w A D over its fetches, with the coverage A of the object and the depth factor

    D = exp(-dz^2 / (2 v)),

dz the fetch's depth minus the texel's, v the stage's own variance along an axis, by channel. So
constant light stays constant on every object and surface, no light crosses an outline, and little
crosses a step that is deep beside the blur. Stages that read the irradiance take for v that of the
whole kernel, of its widest channel: single ones may have weights below 0. With such weights light
and coverage are blurred apart, added up and divided once.

Changes of size take four texels one by one, each with a D of its own, v that of the first stage on
the smaller picture. Down, dz is against the nearest of the four (v of the widest channel), so that
a texel across a step shows its near side alone, and its depth is the mean of what it shows; up, it
is against the pixel, relative to the least of the four. docs/decisions.md says what means do.
"""

import itertools
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit._jit import screen_taps as compiled
from sssfit._jit import thread_pool
from sssfit.arrays import check_record, read_only
from sssfit.errors import RenderError
from sssfit.kernel import Kernel
from sssfit.kernel.taps import Stage, Taps
from sssfit.messages import shown
from sssfit.process import thread_count
from sssfit.render.screen import (
    BORDER,
    FARTHEST,
    check_buffers,
    depths,
    object_mask,
    second_moments,
)
from sssfit.render.taps import divided_once, four_texels
from sssfit.render.texels import Store, store_of
from sssfit.render.transmittance import transmitted
from sssfit.scene.record import Scene

FloatArray = npt.NDArray[np.floating[Any]]

FOLLOW = ("gaussian", "none")
_BLOCK = 16_384  # texels a thread takes at a time


def render_screen_taps(
    scene: Scene,
    taps: Taps,
    *,
    follow: str = "gaussian",
    border: str = "mirror",
    intermediate: str | None = None,
    threads: int | None = None,
) -> FloatArray:
    """Return the radiant exitance of a scene in perspective, specular light included.

    Masks, light through the object and specular light are treated as by
    `sssfit.render.screen.render_screen`.

    Parameters
    ----------
    scene : Scene
        A scene with ``depth_mm`` and ``distance_mm``.
    taps : Taps
        Made for any pixel size; best at that of the object on the screen.
    follow : {"gaussian", "none"}
        Whether fetches lose weight by their depth difference.
    border : str
        Beyond the picture: "mirror", "clamp", or "zero" (dark, at the texel's own depth).
    intermediate : str, optional
        Format of the pictures between the passes, as of `render_taps`.
    threads : int, optional
        Threads to use, by default one per core. The result does not depend on them.

    Returns
    -------
    array (H, W, C)
        Blurred irradiance, times the table's energy, plus specular light.

    Raises
    ------
    RenderError
        The scene has no depth or other channels than the table, a setting is invalid, or the light
        exceeds what the intermediate format holds.
    """
    check_record("scene", scene, Scene, RenderError)
    check_record("taps", taps, Taps, RenderError)
    channels = len(taps.channels)
    check_no_disk(taps)
    scene = scene.for_channels(taps.channels)
    check_buffers(scene, channels)
    if follow not in FOLLOW:
        raise RenderError(f"follow = {shown(follow)}; a table of taps has {' or '.join(FOLLOW)}.")
    if border not in BORDER:
        raise RenderError(f"border = {shown(border)}; expected {', '.join(BORDER)}.")
    store = store_of(intermediate, taps)
    workers = thread_count(threads)
    mask = object_mask(scene)
    depth_mm = depths(scene, mask)
    _check_reach(scene, taps, depth_mm)
    through = transmitted(scene, taps)
    lit = scene.irradiance if through is None else scene.irradiance + through
    lit = np.ascontiguousarray(np.broadcast_to(lit, (*mask.shape, channels)))
    rates = [
        0.5 / each if follow == "gaussian" else 0.0 * each for each in followed_variances(taps)
    ]
    picture = np.array(np.broadcast_to(scene.irradiance, lit.shape))
    with thread_pool(workers) as pool:
        for number in np.unique(mask[mask > 0]):
            covered = np.where(mask == number, 1.0, 0.0)
            full = _Level(covered, depth_mm, _mm_per_texel(scene), border)
            picture = np.where(
                covered[..., None] > 0.0, _Chain(taps, rates, pool, store).of(lit, full), picture
            )
    return picture if scene.specular is None else picture + scene.specular


def check_no_disk(kernel: Kernel) -> None:
    """Raise an error for a disk, which has no fetches on a surface that is not flat."""
    if isinstance(kernel, Taps) and kernel.is_disk:
        raise RenderError("a disk of fetches serves flat pictures only; give another table.")


def _mm_per_texel(scene: Scene) -> float:
    """Return mm of the surface a texel of a picture takes, per mm of depth."""
    assert scene.distance_mm is not None  # checked by `depths`
    return scene.mm_per_pixel / scene.distance_mm


def _check_reach(scene: Scene, taps: Taps, depth_mm: FloatArray) -> None:
    """Raise an error for fetches so far away that their indices would overflow."""
    farthest_mm = max(float(each.offsets_mm.max()) for each in taps.stages)
    with np.errstate(over="ignore"):
        reach = farthest_mm / (depth_mm.min() * _mm_per_texel(scene))
    if not reach < FARTHEST:
        raise RenderError(
            f"{scene.name}: at depth {depth_mm.min():g} mm the taps would reach {reach:.3g} "
            "pixels; expected mm in depth_mm."
        )


def followed_variances(taps: Taps) -> list[FloatArray]:
    """Return v of each stage's depth factor (C,) [mm^2]; at least that of a texel, p^2 / 12."""
    if not taps.chained:
        widest = second_moments(taps.separable_kernel()).max()
        return [np.full(len(taps.channels), widest)] * len(taps.stages)
    least = taps.mm_per_pixel**2 / 12.0
    return [np.maximum(each.variance_mm2, least * 4.0**each.level) for each in taps.stages]


@dataclass
class _Level:
    """An object on the texels of one resolution, (H, W)."""

    covered: FloatArray
    depth_mm: FloatArray
    mm_per_texel: float  # per mm of depth
    border: str

    @property
    def texels(self) -> compiled.Texels:
        """The same for the compiled passes."""
        height, width = self.covered.shape
        depth_mm = self.depth_mm.ravel().astype(np.float64, copy=False)
        return compiled.Texels(
            self.covered.ravel().astype(np.float64, copy=False),
            depth_mm,
            1.0 / (depth_mm * self.mm_per_texel),
            width,
            height,
            BORDER[self.border],
        )

    def halved(self, rate: float) -> tuple["_Level", FloatArray]:
        """Return the object on texels of twice the size, and what each takes of its four texels.

        The latter (4, H', W') are coverage times the depth factor of ``rate`` [1/mm^2], relative to
        the nearest of the four.
        """
        # Coverage and depth of an odd last texel continue even where light does not.
        four, depth_mm = (four_texels(each, "clamp") for each in (self.covered, self.depth_mm))
        nearest_mm = np.where(four > 0.0, depth_mm, np.inf).min(axis=0)
        dz = np.where(four > 0.0, depth_mm - nearest_mm, 0.0)
        taken = four * np.exp(-rate * dz**2)
        whole = taken.sum(axis=0)
        depth_mm = (taken * depth_mm).sum(axis=0)
        depth_mm = np.divide(depth_mm, whole, out=np.ones_like(whole), where=whole > 0.0)
        return _Level(0.25 * whole, depth_mm, 2.0 * self.mm_per_texel, self.border), taken


class _Chain:
    """A table's passes on one object."""

    def __init__(
        self, taps: Taps, rates: list[FloatArray], pool: ThreadPoolExecutor, store: Store | None
    ) -> None:
        self.taps, self.rates, self.pool = taps, rates, pool
        self.store = store or (lambda pixels: pixels)
        self.divide = not taps.has_negative_weights

    def of(self, lit: FloatArray, full: _Level) -> FloatArray:
        """Return the kernel on the light (H, W, C) of one object."""
        light: FloatArray = self._added_up(lit, full)
        if self.divide:
            return light
        part = self._added_up(np.ones_like(lit), full)
        return divided_once(light, part, lit, full.covered[..., None], self.taps.energy)

    def _added_up(self, lit: FloatArray, full: _Level) -> FloatArray:
        """Add up the stages' pictures, level by level."""
        stages, blend = self.taps.stages, self.taps.blend
        levels, current = [full], lit
        sums: list[FloatArray] = [lit * blend[0]]
        for stage, share, rate in zip(stages, blend[1:], self.rates, strict=True):
            if stage.level == len(levels):
                smaller, taken = levels[-1].halved(float(rate.min()))
                current = self._halved(current, taken, full.border)
                levels.append(smaller)
                sums.append(np.zeros(current.shape))
            source = current if self.taps.chained else lit
            current = self._blurred(source, stage, rate, levels[-1])
            if self.taps.chained and stage is not stages[-1]:
                current = self.store(current)
            sums[-1] += share * current
        for fine in range(len(levels) - 2, -1, -1):
            self._add_coarser(sums, fine, levels)
        return sums[0]

    def _halved(self, picture: FloatArray, taken: FloatArray, border: str) -> FloatArray:
        """Return the means of 2 x 2 texels with weights (4, H', W')."""
        light = (taken[..., None] * four_texels(picture, border)).sum(axis=0)
        whole = taken.sum(axis=0)[..., None]
        return self.store(np.divide(light, whole, out=np.zeros(light.shape), where=whole > 0.0))

    def _add_coarser(self, sums: list[FloatArray], fine: int, levels: list[_Level]) -> None:
        """Add the sum of the next level to that of level ``fine``."""
        first = next(k for k, each in enumerate(self.taps.stages) if each.level == fine + 1)
        rate, coarse = self.rates[first], self.store(sums[fine + 1])
        small, large = levels[fine + 1].texels, levels[fine].texels
        self._run(compiled.enlarge, sums[fine], read_only(_flat(coarse)), rate, small, large)

    def _blurred(
        self, picture: FloatArray, stage: Stage, rate: FloatArray, level: _Level
    ) -> FloatArray:
        """Return the passes of a stage, one after the other."""
        texels, passes = level.texels, list(fetches(stage))
        for k, (places_mm, weights) in enumerate(passes):
            out = np.zeros(picture.shape)
            given = read_only(_flat(picture)), places_mm, weights, rate, texels, self.divide
            self._run(compiled.gather, out, *given)
            picture = out if k == len(passes) - 1 else self.store(out)
        return picture

    def _run(self, work: Callable[..., None], out: FloatArray, *given: object) -> None:
        """Let threads write blocks of ``out`` (H, W, C)."""
        flat = _flat(out)
        edges = [*range(0, len(flat), _BLOCK), len(flat)]
        jobs = [self.pool.submit(work, flat, *given, *each) for each in itertools.pairwise(edges)]
        for each in jobs:
            each.result()


def _flat(picture: FloatArray) -> FloatArray:
    """Return a view (N, C) of a picture in the order of its rows."""
    assert picture.flags.c_contiguous  # a copy would lose what is written into it
    return picture.reshape(-1, picture.shape[-1])


def fetches(stage: Stage) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Return places (F, 2) [mm], down and right, and weights (F, C) of each pass of a stage."""
    if stage.kind == "star":
        o, a = stage.offsets_mm
        corners = [(y, x) for y in (-o, o) for x in (-o, o)]
        places = [(0.0, 0.0), *corners, (0.0, -a), (0.0, a), (-a, 0.0), (a, 0.0)]
        yield np.array(places), np.repeat(stage.weights, (1, 4, 4), axis=0)
        return
    line = np.concatenate(([0.0], np.column_stack((-stage.offsets_mm, stage.offsets_mm)).ravel()))
    weights = np.concatenate((stage.weights[:1], np.repeat(stage.weights[1:], 2, axis=0)))
    for direction in stage.directions:
        yield np.outer(line, direction), weights
