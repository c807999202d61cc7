"""What pixels show of a map: a trilinear look-up, as a shader's.

A pixel that covers many texels takes their mean, from a map of half, a quarter ... the size, and
between two of them by the binary logarithm of the texels that it is wide. Otherwise a distant pixel
would show one texel of a hundred, and a smaller map, which holds their mean, would give a different
picture.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit._jit import texture as compiled
from sssfit.render.texture_blur import Level, halved

FloatArray = npt.NDArray[np.floating[Any]]


def look_up(
    light: FloatArray, level: Level, places: FloatArray, texels_wide: FloatArray
) -> FloatArray:
    """Return light (N, C) at places of a map.

    Parameters
    ----------
    light : array (H, W, C)
    level : Level
        The map's coverage; what is not covered adds nothing.
    places : array (N, 2)
        Down and right, in texels from the first one's middle.
    texels_wide : array (N,)
        Texels across a pixel; up to 1 it takes those of the map itself.
    """
    sizes = np.log2(np.maximum(texels_wide, 1.0))
    total, whole = np.zeros((len(places), light.shape[-1])), np.zeros(len(places))
    own = places
    for n in range(int(np.ceil(sizes.max(initial=0.0))) + 1):
        part = np.maximum(1.0 - np.abs(sizes - n), 0.0)
        found, share = np.zeros_like(total), np.zeros(len(places))
        flat = np.ascontiguousarray(light).reshape(-1, light.shape[-1])
        compiled.look_up(found, share, flat, level.compiled, own)
        part = np.where(share > 0.0, part, 0.0)
        total, whole = total + part[:, None] * found, whole + part
        light, level, own = halved(light, level.cover), level.halved(), 0.5 * (own + 0.5) - 0.5
    seen: FloatArray = np.divide(
        total, whole[:, None], out=np.zeros_like(total), where=whole[:, None] > 0.0
    )
    return seen
