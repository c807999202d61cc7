"""A table of taps on a flat picture, as a shader runs it.

Bilinear fetches on a grid of texels are fixed weights, so a stage's pass is a short convolution.
Halving takes the mean of 2 x 2 texels, one bilinear fetch at their corner; the sum of a halved
level comes back by one bilinear fetch a pixel, which sees its texels with 3/4 and 1/4.

With coverage A (1 on the object, averaged on the halved pictures) every pass and every change of
level is sum w A E / sum w A: constant light stays constant to the object's border, and nothing
comes in from outside it. The blend is not touched. Weights below 0 could make a pass's sum vanish:
with them A E and A are blurred apart, added up and divided once.
"""

import functools
import math
from collections.abc import Callable
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from sssfit.arrays import check_record
from sssfit.errors import RenderError
from sssfit.formats.colours import as_light
from sssfit.kernel.taps import Stage, Taps
from sssfit.messages import shown
from sssfit.render.borders import check_memory, check_sums, precision_for, scene_for, source_indices
from sssfit.render.cascade import apply_cascade, is_quick
from sssfit.render.disk import all_turns, apply_disk
from sssfit.render.jitter import Jitter, apply_jittered
from sssfit.render.separable import apply_passes
from sssfit.render.texels import Store, store_of
from sssfit.scene.record import Scene

FloatArray = npt.NDArray[np.floating[Any]]

_Mode = Literal["reflect", "nearest", "constant"]
_MODES: dict[str, _Mode] = {
    "mirror": "reflect",
    "clamp": "nearest",
    "zero": "constant",
}  # of scipy.ndimage


def render_taps(
    scene: Scene,
    taps: Taps,
    *,
    border: str = "mirror",
    coverage: npt.ArrayLike | None = None,
    intermediate: str | None = None,
    frame: int = 0,
    jitter: Jitter | None = None,
    threads: int | None = None,
    dtype: npt.DTypeLike = np.float64,
) -> FloatArray:
    """Blur irradiance by a table of taps.

    Parameters
    ----------
    scene : Scene
        A flat picture: only its irradiance and pixel size are used. Offsets in mm serve any pixel
        size; the table is best at its own.
    taps : Taps
    border : str
        One of ``sssfit.render.borders.BORDERS``.
    coverage : array (H, W), optional
        Part of each pixel that the object covers, 0 to 1; other pixels neither give nor show light.
    intermediate : str, optional
        Format of the pictures between the passes, as `sssfit.render.texels` has them; by default
        they keep the precision of ``dtype``. Irradiance, coverage and result keep it always, and so
        does a picture that is added up by the pass that made it.
    frame : int
        From 0; a disk of fetches is turned differently in each frame (`sssfit.render.disk`), and
        so are jittered taps; else nothing depends on it.
    jitter : Jitter, optional
        Moves the outer taps of each pass by pixel and frame (`sssfit.render.jitter`); of pairs and
        lines.
    threads : int, optional
        Threads to use, by default all cores; the result does not depend on them.
    dtype : float64 or float32
        Precision of all sums.

    Returns
    -------
    array (H, W, C)
        Radiant exitance, in the irradiance's unit.

    Raises
    ------
    RenderError
        Channels or coverage do not fit the picture, a setting is invalid, or the light exceeds what
        the intermediate format holds.
    """
    check_record("taps", taps, Taps, RenderError)
    channels = len(taps.channels)
    scene = scene_for(scene, taps.channels)
    precision = precision_for(dtype, scene)
    size = scene.height, scene.width
    check_memory(
        6.0 * scene.height * scene.width * channels * precision.itemsize,
        f"{scene.name}: {scene.height} x {scene.width} pixels",
        "render a part of the picture",
    )
    if not isinstance(jitter, Jitter | None):
        raise RenderError(f"jitter = {shown(jitter)}; expected a Jitter or None.")
    pixels = np.empty((*size, channels), precision)
    pixels[...] = scene.irradiance
    store = store_of(intermediate, taps)
    covered = _checked(coverage, size, precision)

    def blurred(picture: FloatArray, within: FloatArray | None) -> FloatArray:
        add_up = _chained if taps.chained else _unchained
        passes = _Passes(border, threads, within, store, frame, jitter)
        return add_up(passes, picture, taps, taps.blend.astype(precision), scene.mm_per_pixel)

    if covered is None or not taps.has_negative_weights:
        return check_sums(blurred(pixels, covered), scene, _gain(taps))
    light = blurred(pixels * covered, None)
    part = blurred(np.broadcast_to(covered, pixels.shape), None)
    whole = divided_once(light, part, pixels, covered, taps.energy.astype(precision))
    return check_sums(whole, scene, _gain(taps))


def divided_once(
    light: FloatArray,
    part: FloatArray,
    unblurred: FloatArray,
    covered: FloatArray,
    energy: FloatArray,
) -> FloatArray:
    """Return blurred light times coverage over blurred coverage, for weights below 0.

    Their sums over a pass may vanish, those over the whole kernel hardly: where less than a
    millionth of the kernel is on the object, the pixel stays unblurred. Black outside the object.

    Parameters
    ----------
    light, part, unblurred : array (..., C)
    covered : array (..., 1)
    energy : array (C,)
        What ``part`` is far inside the object.
    """
    enough = part * np.sign(energy) > 1e-6 * np.abs(energy)
    shown = np.divide(light, part, out=np.array(unblurred), where=enough)
    return np.where(covered > 0.0, shown * energy, 0.0)


def four_texels(pixels: FloatArray, border: str) -> FloatArray:
    """Return the 2 x 2 texels of a picture (H, W, ...) that a texel of half the size covers.

    (4, ceil(H / 2), ceil(W / 2), ...). The row or column that an odd size lacks is the border's.
    """
    rows, columns = (
        source_indices(size, 1, border)[1 : size + 1 + size % 2] for size in pixels.shape[:2]
    )
    black = np.pad(pixels, [(0, 1), (0, 1), *[(0, 0)] * (pixels.ndim - 2)])  # places n of a border
    return np.stack([black[rows[i::2]][:, columns[j::2]] for i in (0, 1) for j in (0, 1)])


def reach_pixels(taps: Taps, mm_per_pixel: float | None = None) -> int:
    """Return how far light moves along an axis [pixels], with all changes of size."""
    check_record("taps", taps, Taps, RenderError)
    pitch_mm = mm_per_pixel or taps.mm_per_pixel
    each = [
        float(stage.offsets_mm.max()) / pitch_mm + 3.0 * 2.0**stage.level for stage in taps.stages
    ]
    return math.ceil(sum(each) if taps.chained else max(each))


def response(taps: Taps, mm_per_pixel: float | None = None) -> npt.NDArray[np.float64]:
    """Return what one lit pixel becomes, (2h+1, 2h+1, C), the pixel in the middle.

    With halved pictures it depends on the pixel's place among their texels; this is the place of
    the middle. Of a disk of fetches it is the mean over all turns.
    """
    half, pitch_mm = reach_pixels(taps, mm_per_pixel), mm_per_pixel or taps.mm_per_pixel
    if taps.is_disk:
        of_disk = all_turns(taps.stages[0], pitch_mm, half)
        of_disk *= taps.blend[1]
        of_disk[half, half] += taps.blend[0]
        return of_disk
    point = np.zeros((2 * half + 1, 2 * half + 1, 1))
    point[half, half] = 1.0
    seen = render_taps(Scene("a point", point, pitch_mm), taps)
    return np.asarray(seen, dtype=np.float64)


def _checked(
    coverage: npt.ArrayLike | None, size: tuple[int, int], precision: np.dtype[Any]
) -> FloatArray | None:
    if coverage is None:
        return None
    covered = as_light(coverage, "coverage").astype(precision, copy=False)
    if covered.shape != size or not ((covered >= 0.0) & (covered <= 1.0)).all():
        raise RenderError(
            f"coverage of shape {covered.shape}; expected {size}, with numbers from 0 to 1."
        )
    return covered[..., None]


def _unchained(
    passes: "_Passes", pixels: FloatArray, taps: Taps, blend: FloatArray, pitch_mm: float
) -> FloatArray:
    """Add up stages that all read the irradiance."""
    found: FloatArray = pixels * blend[0]
    for stage, share in zip(taps.stages, blend[1:], strict=True):
        found += share * passes.blurred(pixels, stage, pitch_mm)
    return passes.shown(found)


def _gain(taps: Taps) -> float:
    """Return how many times the light the sums of a picture's passes can be."""
    gain = 2.0 * max(1.0, float(np.abs(taps.blend).sum(axis=0).max()))
    for each in taps.stages:
        sums = np.abs(each.weights[0]) + each.copies * np.abs(each.weights[1:]).sum(axis=0)
        gain *= max(1.0, float(sums.max())) ** 2  # of both passes of a pair
    return gain


def _chained(
    passes: "_Passes", pixels: FloatArray, taps: Taps, blend: FloatArray, pitch_mm: float
) -> FloatArray:
    """Add up stages that each read the one before, level by level."""
    if passes.is_plain and is_quick(taps):
        return apply_cascade(pixels, taps, pitch_mm, threads=passes.threads)
    sums = [pixels * blend[0]]
    levels = [passes]
    current = pixels
    for stage, share in zip(taps.stages, blend[1:], strict=True):
        while len(levels) <= stage.level:
            current, halved = levels[-1].halved(current)
            levels.append(halved)
            sums.append(np.zeros_like(current))
        current = levels[-1].blurred(current, stage, pitch_mm * 2.0**stage.level)
        if stage is not taps.stages[-1]:  # that one is added up by the pass that makes it
            current = passes.stored(current)
        sums[-1] += share * current
    for fine in range(len(levels) - 2, -1, -1):
        coarse = passes.stored(sums[fine + 1])
        sums[fine] += levels[fine + 1].doubled(coarse, sums[fine].shape[:2])
    return passes.shown(sums[0])


Texels = dict[tuple[int, int], npt.NDArray[np.float64]]  # weights (C,) of places (down, right)


def texels_of(stage: Stage, direction: tuple[float, float], mm_per_texel: float) -> Texels:
    """Return the weights that the bilinear fetches of a pass give to the texels around one."""
    places = np.outer(stage.offsets_mm / mm_per_texel, direction)
    found: Texels = {(0, 0): stage.weights[0]}
    for place, weights in zip((*places, *-places), (*stage.weights[1:],) * 2, strict=True):
        corner = np.floor(place).astype(int)
        part = place - corner
        for i, j in np.ndindex(2, 2):
            share = abs(1 - i - part[0]) * abs(1 - j - part[1])
            if share > 0.0:
                at = int(corner[0] + i), int(corner[1] + j)
                found[at] = found.get(at, 0.0) + share * weights
    return found


class _Passes:
    """The passes on pictures of one size, with their border and coverage (H, W, 1)."""

    def __init__(
        self,
        border: str,
        threads: int | None,
        coverage: FloatArray | None,
        store: Store | None,
        frame: int,
        jitter: Jitter | None,
    ) -> None:
        source_indices(1, 0, border)  # raises for an unknown border
        self.border, self.threads, self.coverage, self.store = border, threads, coverage, store
        self.frame, self.jitter = frame, jitter

    @property
    def is_plain(self) -> bool:
        """Whether the picture is mirrored and all of it is there, and none is rounded."""
        unchanged = self.coverage is None and self.store is None and self.jitter is None
        return self.border == "mirror" and unchanged

    def stored(self, pixels: FloatArray) -> FloatArray:
        """Return a picture as the next pass reads it."""
        return pixels if self.store is None else self.store(pixels)

    def blurred(self, pixels: FloatArray, stage: Stage, mm_per_texel: float) -> FloatArray:
        """Return the picture of a stage that reads ``pixels``."""
        if stage.kind == "star":
            return self._star(pixels, stage, mm_per_texel)
        if stage.kind == "disk":
            return self._divided(pixels, lambda each: self._disk(each, stage, mm_per_texel))
        if not stage.is_upright or self.jitter is not None:
            return self._turned(pixels, stage, mm_per_texel)
        weights = stage.pass_weights(mm_per_texel)
        if self.coverage is None and self.store is None:
            ones = np.ones((1, weights.shape[1]))
            return apply_passes(
                pixels, weights[None], ones, border=self.border, threads=self.threads
            )
        across = self.stored(self._divided(pixels, lambda each: self._line(each, weights, 1)))
        return self._divided(across, lambda each: self._line(each, weights, 0))

    def _star(self, pixels: FloatArray, stage: Stage, mm_per_texel: float) -> FloatArray:
        """Nine fetches in one pass: four diagonal ones are the product of two mirrored pairs."""
        one = np.ones((1, stage.weights.shape[1]))
        diagonal, axis = (stage.line(each[None], one, mm_per_texel) for each in stage.offsets_mm)
        middle, corners, beside = stage.weights.astype(pixels.dtype)

        def fetch(picture: FloatArray) -> FloatArray:
            on_axes = self._line(picture, axis, 0) + self._line(picture, axis, 1)
            on_diagonals = self._line(self._line(picture, diagonal, 1), diagonal, 0)
            found: FloatArray = middle * picture + corners * on_diagonals + beside * on_axes
            return found

        return self._divided(pixels, fetch)

    def _turned(self, pixels: FloatArray, stage: Stage, mm_per_texel: float) -> FloatArray:
        """Run the passes along a stage's own directions, one after the other."""
        for k, direction in enumerate(stage.directions):
            fetch = self._pass(stage, direction, mm_per_texel)
            source = pixels if k == 0 else self.stored(pixels)
            pixels = self._divided(source, fetch)
        return pixels

    def _pass(
        self, stage: Stage, direction: tuple[float, float], mm_per_texel: float
    ) -> Callable[[FloatArray], FloatArray]:
        """Return the sum of a pass's fetches as a function of a picture."""
        if self.jitter is None:
            texels = texels_of(stage, direction, mm_per_texel)
            return lambda picture: self._gathered(picture, texels)
        return functools.partial(
            apply_jittered,
            stage=stage,
            direction=direction,
            mm_per_texel=mm_per_texel,
            jitter=self.jitter,
            frame=self.frame,
            border=self.border,
            threads=self.threads,
        )

    def _gathered(self, pixels: FloatArray, texels: Texels) -> FloatArray:
        """Return the sum of weights times the texels at places around each one."""
        beyond = max(abs(place) for at in texels for place in at)
        rows, columns = (source_indices(n, beyond, self.border) for n in pixels.shape[:2])
        black = np.pad(pixels, ((0, 1), (0, 1), (0, 0)))
        wide = black[rows][:, columns]
        height, width = pixels.shape[:2]
        found = np.zeros((height, width, len(next(iter(texels.values())))), pixels.dtype)
        for (y, x), weights in texels.items():
            own = wide[beyond + y : beyond + y + height, beyond + x : beyond + x + width]
            found += weights.astype(pixels.dtype) * own
        return found

    def _disk(self, pixels: FloatArray, stage: Stage, mm_per_texel: float) -> FloatArray:
        """Single fetches around each pixel, turned by its own angle."""
        return apply_disk(
            pixels,
            stage,
            mm_per_texel,
            frame=self.frame,
            border=self.border,
            threads=self.threads,
        )

    def _line(self, pixels: FloatArray, weights: FloatArray, axis: int) -> FloatArray:
        """Convolve every channel along an axis with weights (P, C)."""
        from scipy import ndimage  # .1 s that most tables of taps do not need

        found = np.empty((*pixels.shape[:2], weights.shape[1]), pixels.dtype)
        for c in range(weights.shape[1]):
            source = pixels[..., min(c, pixels.shape[2] - 1)]
            ndimage.correlate1d(
                source, weights[:, c], axis, found[..., c], mode=_MODES[self.border]
            )
        return found

    def _divided(self, pixels: FloatArray, fetch: Callable[[FloatArray], FloatArray]) -> FloatArray:
        """Return fetches of light times coverage over those of coverage; 0 where it is 0."""
        if self.coverage is None:
            return fetch(pixels)
        covered = np.broadcast_to(self.coverage, pixels.shape)
        light, part = fetch(pixels * covered), fetch(covered)
        return np.divide(light, part, out=np.zeros_like(light), where=part > 0.0)

    def halved(self, pixels: FloatArray) -> tuple[FloatArray, "_Passes"]:
        """Return the picture of means of 2 x 2 texels, and the passes of its size.

        The row or column that an odd size lacks is the border's.
        """
        part = (
            None if self.coverage is None else four_texels(self.coverage, self.border).mean(axis=0)
        )
        smaller = _Passes(self.border, self.threads, part, self.store, self.frame, self.jitter)
        return self.stored(
            self._divided(pixels, lambda each: four_texels(each, self.border).mean(axis=0))
        ), smaller

    def doubled(self, pixels: FloatArray, size: tuple[int, int]) -> FloatArray:
        """Return a picture of twice the size by bilinear fetches."""
        return self._divided(pixels, lambda each: self._enlarged(each, size))

    def _enlarged(self, pixels: FloatArray, size: tuple[int, int]) -> FloatArray:
        for axis in (0, 1):
            count = pixels.shape[axis]
            places = source_indices(count, 1, self.border)
            continued = np.concatenate((pixels, np.zeros_like(pixels.take([0], axis))), axis)
            lower, upper = (continued.take(places[k : k + count], axis) for k in (0, 2))
            fine = np.stack((0.75 * pixels + 0.25 * lower, 0.75 * pixels + 0.25 * upper), axis + 1)
            shape = list(pixels.shape)
            shape[axis] = 2 * count
            pixels = fine.reshape(shape).take(np.arange(size[axis]), axis)
        return pixels

    def shown(self, pixels: FloatArray) -> FloatArray:
        """Return the sum, black outside the object."""
        return pixels if self.coverage is None else np.where(self.coverage > 0.0, pixels, 0.0)
