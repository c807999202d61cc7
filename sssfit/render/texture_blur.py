"""A kernel in texture space: every pass on the texels that hold light, in mm of the surface.

A fetch o mm beside a texel lies o / |dP/du| texels to the side (d'Eon, Luebke, Enderton 2007,
"Efficient rendering of human skin": stretch maps). A pass is sum w A E / sum w A over its fetches,
with the coverage A: charts end without dark borders, and light does not cross their seams. With
weights below 0 light and coverage are blurred apart, added up and divided once.
"""

import itertools
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit._jit import texture as compiled
from sssfit._jit import thread_pool
from sssfit.kernel import Kernel, SeparableKernel, Taps
from sssfit.process import thread_count
from sssfit.render.screen_taps import check_no_disk, fetches
from sssfit.render.taps import divided_once, four_texels

FloatArray = npt.NDArray[np.floating[Any]]

_BLOCK = 16_384
_Passes = Sequence[tuple[FloatArray, FloatArray]]  # places (F, 2) [mm] and weights (F, C)


@dataclass(frozen=True, slots=True, eq=False)
class Level:
    """A texture of one size.

    Parameters
    ----------
    cover : array (H, W)
        Part of each texel that holds light.
    per_mm : array (H, W, 2) [1/mm]
        Texels that a mm of the surface takes, down and right.
    """

    cover: FloatArray
    per_mm: FloatArray

    @property
    def compiled(self) -> compiled.Texture:
        """The same for the compiled passes."""
        height, width = self.cover.shape
        return compiled.Texture(
            np.ascontiguousarray(self.cover, dtype=np.float64).ravel(),
            np.ascontiguousarray(self.per_mm, dtype=np.float64).reshape(-1, 2),
            width,
            height,
        )

    @property
    def texels(self) -> int:
        """How many texels a pass computes."""
        return int(np.count_nonzero(self.cover))

    def halved(self) -> "Level":
        """Return it on texels of twice the size."""
        four = four_texels(self.cover, "zero")
        whole = four.sum(axis=0)
        rates = (four[..., None] * four_texels(self.per_mm, "zero")).sum(axis=0)
        per_mm = np.divide(
            0.5 * rates, whole[..., None], out=np.zeros_like(rates), where=whole[..., None] > 0.0
        )
        return Level(0.25 * whole, per_mm)


@dataclass(frozen=True, slots=True)
class _Step:
    """A blur and its share of the sum; ``from_light`` reads the light, others the step before."""

    level: int
    passes: _Passes
    share: FloatArray
    from_light: bool


def blur_texture(
    light: FloatArray, texture: Level, kernel: Kernel, *, threads: int | None = None
) -> tuple[FloatArray, int]:
    """Return a kernel's picture in texture space, and how many texels its passes computed.

    Parameters
    ----------
    light : array (H, W, C)
        Irradiance; it is not read where nothing is covered.
    texture : Level
        What is covered: of a pass only those texels are computed.
    kernel : SeparableKernel or Taps
    threads : int, optional
        By default one a core. The result does not depend on them.

    Returns
    -------
    array (H, W, C)
        Radiant exitance; 0 where nothing is covered.
    int
        Texels of all passes, those of halved textures included.

    Raises
    ------
    RenderError
        The kernel is a disk of fetches.
    """
    check_no_disk(kernel)
    own, steps = _steps_of(kernel)
    levels = [texture]
    for _ in range(max((each.level for each in steps), default=0)):
        levels.append(levels[-1].halved())
    count = sum(len(each.passes) * levels[each.level].texels for each in steps)
    divide = not _has_negative_weights(kernel)
    covered = texture.cover[..., None] > 0.0
    lit = np.where(covered, light, 0.0)
    with thread_pool(thread_count(threads)) as pool:
        chain = _Chain(levels, steps, own, pool, divide)
        picture = chain.of(lit)
        if divide:
            return np.where(covered, picture, 0.0), count
        part = chain.of(np.ones_like(lit))
    scale = kernel.scale if isinstance(kernel, SeparableKernel) else 1.0
    cover = texture.cover[..., None]
    return divided_once(picture, part, lit, cover, kernel.energy * scale), 2 * count


def _has_negative_weights(kernel: Kernel) -> bool:
    if isinstance(kernel, Taps):
        return bool(kernel.has_negative_weights)
    return bool((kernel.signs < 0.0).any() or (kernel.weights < 0.0).any())


def _steps_of(kernel: Kernel) -> tuple[FloatArray, list[_Step]]:
    """Return the light's own share of the sum (C,), and the blurs."""
    if isinstance(kernel, Taps):
        stages = [
            _Step(stage.level, list(fetches(stage)), share, k == 0 or not kernel.chained)
            for k, (stage, share) in enumerate(zip(kernel.stages, kernel.blend[1:], strict=True))
        ]
        return kernel.blend[0], stages
    places = kernel.mm_per_pixel * np.arange(-kernel.half_pixels, kernel.half_pixels + 1.0)
    nowhere = np.zeros_like(places)
    directions = [np.stack((nowhere, places), axis=1), np.stack((places, nowhere), axis=1)]
    steps = []
    for signs, weights in zip(kernel.signs, kernel.weights, strict=True):
        sums = weights.sum(axis=0)
        even = np.divide(weights, sums, out=np.zeros_like(weights), where=sums != 0.0)
        share = signs * sums**2 * kernel.scale
        steps.append(_Step(0, [(each, even) for each in directions], share, from_light=True))
    return np.zeros(len(kernel.channels)), steps


class _Chain:
    """A kernel's passes on a texture."""

    def __init__(
        self,
        levels: list[Level],
        steps: list[_Step],
        own: FloatArray,
        pool: ThreadPoolExecutor,
        divide: bool,
    ) -> None:
        self.levels, self.steps, self.own, self.pool = levels, steps, own, pool
        self.divide = divide
        self.textures = [each.compiled for each in levels]

    def of(self, light: FloatArray) -> FloatArray:
        """Return the sum of all blurs of light (H, W, C)."""
        sums = [light * self.own]
        current, level = light, 0
        for step in self.steps:
            source = light if step.from_light else current
            if step.from_light:
                level = 0
            while level < step.level:
                source = halved(source, self.levels[level].cover)
                level += 1
            while len(sums) <= level:
                shape = (*self.levels[len(sums)].cover.shape, light.shape[-1])
                sums.append(np.zeros(shape))
            for places, weights in step.passes:
                source = self._pass(source, places, weights, level)
            current = source
            sums[level] = sums[level] + step.share * current
        for fine in range(len(sums) - 2, -1, -1):
            sums[fine] = sums[fine] + self._enlarged(sums[fine + 1], fine)
        return sums[0]

    def _pass(
        self, picture: FloatArray, places: FloatArray, weights: FloatArray, level: int
    ) -> FloatArray:
        out = np.zeros(picture.shape)
        flat = out.reshape(-1, picture.shape[-1])
        texture = self.textures[level]
        given = np.ascontiguousarray(picture).reshape(flat.shape), places, weights, texture
        blocks = itertools.pairwise(_edges(len(flat)))
        jobs = [
            self.pool.submit(compiled.gather, flat, *given, self.divide, first, last)
            for first, last in blocks
        ]
        for each in jobs:
            each.result()
        return out

    def _enlarged(self, picture: FloatArray, fine: int) -> FloatArray:
        """Return a picture of half the size by bilinear fetches."""
        height, width = self.levels[fine].cover.shape
        rows, columns = np.indices((height, width))
        places = np.stack((rows, columns), axis=-1).reshape(-1, 2) * 0.5 - 0.25
        channels = picture.shape[-1]
        out, share = np.zeros((height * width, channels)), np.zeros(height * width)
        flat = np.ascontiguousarray(picture).reshape(-1, channels)
        compiled.look_up(out, share, flat, self.textures[fine + 1], places)
        return out.reshape(height, width, channels)


def halved(light: FloatArray, cover: FloatArray) -> FloatArray:
    """Return means of 2 x 2 texels by coverage; 0 where nothing is covered."""
    four = four_texels(cover, "zero")[..., None]
    whole = four.sum(axis=0)
    sums = (four * four_texels(light, "zero")).sum(axis=0)
    mean: FloatArray = np.divide(sums, whole, out=np.zeros_like(sums), where=whole > 0.0)
    return mean


def _edges(count: int) -> Iterator[int]:
    yield from range(0, count, _BLOCK)
    yield count
