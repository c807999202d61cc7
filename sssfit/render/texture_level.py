"""The texels of a map that hold light, by place and chart, and those of half its size.

A texel of a halved map may hold texels of several charts. It is there once for each of them, with a
coverage and a stretch of its own, so light never leaves its chart.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit._jit import texture as compiled

FloatArray = npt.NDArray[np.floating[Any]]
IndexArray = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Level:
    """Texels of one size; pictures of them are (N, C).

    Parameters
    ----------
    texture : sssfit._jit.texture.Texture
        Where they are, their charts, coverage and stretch.
    """

    texture: compiled.Texture

    @classmethod
    def of_map(
        cls, cover: FloatArray, per_mm: FloatArray, charts: IndexArray | None = None
    ) -> "Level":
        """Return the texels of a map, each of one chart.

        Parameters
        ----------
        cover : array (H, W)
            Part of each texel that holds light.
        per_mm : array (H, W, 2) [1/mm]
            Texels that a mm of the surface takes, down and right.
        charts : array (H, W) of int, optional
            By default all is one chart.
        """
        (height, width), here = cover.shape, cover > 0.0
        places = np.flatnonzero(here)
        at = np.full(height * width, -1)
        at[places] = np.arange(len(places))
        of_texels = np.zeros_like(places) if charts is None else charts[here]
        there = np.asarray(cover[here], dtype=np.float64)
        rates = np.asarray(per_mm[here], dtype=np.float64)
        alone = np.full_like(places, -1)
        return cls(compiled.Texture(at, alone, places, of_texels, there, rates, width, height))

    @property
    def texels(self) -> int:
        """How many texels a pass computes."""
        return len(self.texture.places)

    @property
    def rows_columns(self) -> IndexArray:
        """Places of the texels (N, 2)."""
        return np.stack(np.divmod(self.texture.places, self.texture.width), axis=-1)

    @cached_property
    def _halved(self) -> tuple["Level", IndexArray]:
        own, count = self.texture, self.texels
        width, height = (own.width + 1) // 2, (own.height + 1) // 2
        half = own._replace(
            at=np.empty(height * width, np.int64),
            following=np.empty(count, np.int64),
            places=np.empty(count, np.int64),
            charts=np.empty(count, np.int64),
            width=width,
            height=height,
        )
        wholes = np.empty(count, np.int64)
        count = compiled.halve(half, wholes, own)
        whole = np.bincount(wholes, own.cover, count)
        rates = _sums(own.cover[:, None] * own.per_mm, wholes, count)
        there = half._replace(
            following=half.following[:count],
            places=half.places[:count],
            charts=half.charts[:count],
            cover=0.25 * whole,
            per_mm=0.5 * rates / whole[:, None],
        )
        return Level(there), wholes

    def halved(self) -> "Level":
        """Return it on texels of twice the size."""
        return self._halved[0]

    def mean(self, light: FloatArray) -> FloatArray:
        """Return a picture on texels of twice the size (M, C), means by coverage."""
        smaller, wholes = self._halved
        cover, count = self.texture.cover, smaller.texels
        whole = np.bincount(wholes, cover, count)
        return _sums(cover[:, None] * light, wholes, count) / whole[:, None]

    def as_one_chart(self) -> "Level":
        """Return a map's texels as if all were of one chart."""
        return Level(self.texture._replace(charts=np.zeros_like(self.texture.charts)))

    def picked(self, picture: FloatArray) -> FloatArray:
        """Return the texels (N, C) of a map's picture (H, W, C)."""
        return picture.reshape(-1, picture.shape[-1])[self.texture.places]

    def spread(self, light: FloatArray) -> FloatArray:
        """Return a map's picture (H, W, C) of its texels (N, C); 0 where there are none."""
        picture = np.zeros((self.texture.height, self.texture.width, light.shape[-1]))
        picture.reshape(-1, light.shape[-1])[self.texture.places] = light
        return picture


def _sums(values: FloatArray, wholes: IndexArray, count: int) -> FloatArray:
    """Return the sums (M, C) of values (N, C) in each of what holds them (N,)."""
    return np.stack([np.bincount(wholes, each, count) for each in values.T], axis=1)
