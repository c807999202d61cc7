"""A kernel in texture space: every pass on the texels that hold light, in mm of the surface.

A fetch o mm beside a texel lies o / |dP/du| texels to the side (d'Eon, Luebke, Enderton 2007,
"Efficient rendering of human skin": stretch maps). It takes the texels of its own chart alone,
however near others lie in the map and in its halved ones (`sssfit.render.texture_level`): no light
crosses from chart to chart, not even where they are neighbours on the surface, but it does jump a
gap between two arms of one chart. A pass is sum w A E / sum w A over its fetches, with the chart's
coverage A, so charts end without dark borders. With weights below 0 light and coverage are blurred
apart, added up and divided once.
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
from sssfit.render.taps import divided_once
from sssfit.render.texture_level import Level

FloatArray = npt.NDArray[np.floating[Any]]

_BLOCK = 16_384
_Passes = Sequence[tuple[FloatArray, FloatArray]]  # places (F, 2) [mm] and weights (F, C)


@dataclass(frozen=True, slots=True)
class _Step:
    """A blur and its share of the sum; ``from_light`` reads the light, others the step before."""

    level: int
    passes: _Passes
    share: FloatArray
    from_light: bool


def blur_texture(
    light: FloatArray, level: Level, kernel: Kernel, *, threads: int | None = None
) -> tuple[FloatArray, int]:
    """Return a kernel's picture in texture space, and how many texels its passes computed.

    Parameters
    ----------
    light : array (H, W, C)
        Irradiance; it is not read where nothing is covered.
    level : Level
        What is covered: of a pass only those texels are computed.
    kernel : SeparableKernel or Taps
    threads : int, optional
        By default one a core. The result does not depend on them.

    Returns
    -------
    array (H, W, C)
        Radiant exitance; 0 where nothing is covered.
    int
        Texels of all passes, those of halved textures included, which are there once for each
        chart in them.

    Raises
    ------
    RenderError
        The kernel is a disk of fetches.
    """
    check_no_disk(kernel)
    own, steps = _steps_of(kernel)
    levels = [level]
    for _ in range(max((each.level for each in steps), default=0)):
        levels.append(levels[-1].halved())
    count = sum(len(each.passes) * levels[each.level].texels for each in steps)
    divide = not _has_negative_weights(kernel)
    lit = level.picked(light)
    with thread_pool(thread_count(threads)) as pool:
        chain = _Chain(levels, steps, own, pool, divide)
        picture = chain.of(lit)
        if divide:
            return level.spread(picture), count
        part = chain.of(np.ones_like(lit))
    scale = kernel.scale if isinstance(kernel, SeparableKernel) else 1.0
    cover = level.texture.cover[:, None]
    divided = divided_once(picture, part, lit, cover, kernel.energy * scale)
    return level.spread(divided), 2 * count


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

    def of(self, light: FloatArray) -> FloatArray:
        """Return the sum of all blurs of light (N, C)."""
        sums = [light * self.own]
        current, level = light, 0
        for step in self.steps:
            source = light if step.from_light else current
            if step.from_light:
                level = 0
            while level < step.level:
                source = self.levels[level].mean(source)
                level += 1
            while len(sums) <= level:
                sums.append(np.zeros((self.levels[len(sums)].texels, light.shape[-1])))
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
        out = np.empty(picture.shape)
        given = picture, places, weights, self.levels[level].texture, self.divide
        jobs = [
            self.pool.submit(compiled.gather, out, *given, begin, end)
            for begin, end in itertools.pairwise(_edges(len(out)))
        ]
        for each in jobs:
            each.result()
        return out

    def _enlarged(self, picture: FloatArray, fine: int) -> FloatArray:
        """Return a picture of half the size by bilinear fetches."""
        level, smaller = self.levels[fine], self.levels[fine + 1]
        places = level.rows_columns * 0.5 - 0.25
        out, share = np.empty((level.texels, picture.shape[-1])), np.empty(level.texels)
        compiled.look_up(out, share, picture, smaller.texture, places, level.texture.charts)
        return out


def _edges(count: int) -> Iterator[int]:
    yield from range(0, count, _BLOCK)
    yield count
