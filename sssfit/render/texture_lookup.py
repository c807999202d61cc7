"""What pixels show of a map: a trilinear look-up, as a shader's.

A pixel that covers many texels takes their mean, from a map of half, a quarter ... the size, and
between two of them by the binary logarithm of the texels that it is wide. Otherwise a distant pixel
would show one texel of a hundred, and a smaller map, which holds their mean, would give a different
picture. Unlike a shader's, a pixel shows the texels of its own chart alone, so that a lit chart
does not shine on its neighbours in the map.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit._jit import texture as compiled
from sssfit.render.texture_level import Level

FloatArray = npt.NDArray[np.floating[Any]]
IndexArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]


def look_up(
    light: FloatArray,
    level: Level,
    places: FloatArray,
    texels_wide: FloatArray,
    charts: IndexArray | None = None,
) -> FloatArray:
    """Return light (P, C) at places of a map.

    Parameters
    ----------
    light : array (H, W, C)
    level : Level
        The map's texels; what is not covered adds nothing.
    places : array (P, 2)
        Down and right, in texels from the first one's middle.
    texels_wide : array (P,)
        Texels across a pixel; up to 1 it takes those of the map itself.
    charts : array (P,) of int, optional
        The chart that each pixel shows. Where it has no texel in reach, as of a chart smaller than
        a texel, the others' count; by default they do everywhere.
    """
    sizes = np.log2(np.maximum(texels_wide, 1.0))
    seen: FloatArray = np.zeros((len(places), light.shape[-1]))
    bare = np.ones(len(places), dtype=bool)
    if charts is not None:
        seen, bare = _trilinear(light, level, places, sizes, charts)
    if bare.any():
        everything = level.as_one_chart()
        chart = np.zeros(int(bare.sum()), np.int64)
        seen[bare], _ = _trilinear(light, everything, places[bare], sizes[bare], chart)
    return seen


def _trilinear(
    light: FloatArray, level: Level, places: FloatArray, sizes: FloatArray, charts: IndexArray
) -> tuple[FloatArray, BoolArray]:
    """Return the light of maps each half as large as the one before, and where there is none."""
    texels = level.picked(light)
    total, whole = np.zeros((len(places), texels.shape[-1])), np.zeros(len(places))
    for n in range(int(np.ceil(sizes.max(initial=0.0))) + 1):
        if n > 0:
            texels, level = level.mean(texels), level.halved()
            places = 0.5 * (places + 0.5) - 0.5
        part = np.maximum(1.0 - np.abs(sizes - n), 0.0)
        found, share = np.empty_like(total), np.empty(len(places))
        compiled.look_up(found, share, texels, level.texture, places, charts)
        part = np.where(share > 0.0, part, 0.0)
        total, whole = total + part[:, None] * found, whole + part
    bare = whole == 0.0
    seen: FloatArray = np.divide(
        total, whole[:, None], out=np.zeros_like(total), where=~bare[:, None]
    )
    return seen, bare
