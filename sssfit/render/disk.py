"""A disk of fetches on a flat picture, turned for each pixel and frame, and frames averaged.

The k-th fetch, from 0, lies at the k-th radius and the angle

    a + 2 pi k / phi,    phi = (1 + sqrt(5)) / 2,

and the pixel in row y and column x turns all of its fetches by

    a = 2 pi ((h(x, y) + 2654435769 frame) mod 2^32) / 2^32,

with h the first word of the hash pcg2d (Jarzynski and Olano 2020, "Hash Functions for GPU
Rendering", JCGT 9(3)), and 2654435769 = 2^32 / phi. All are whole numbers of 32 bits, the same on
every machine: neighbours turn without pattern, and the frames of a pixel fill the circle evenly.
"""

import functools
import itertools
import math
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit.arrays import is_whole
from sssfit.errors import RenderError
from sssfit.kernel.taps import Stage
from sssfit.messages import shown
from sssfit.process import thread_count
from sssfit.render.borders import check_memory, source_indices

FloatArray = npt.NDArray[np.floating[Any]]
WordArray = npt.NDArray[np.uint32]

_GOLDEN = (1.0 + math.sqrt(5.0)) / 2.0
_STEP = 2654435769
_KEPT_PIXELS = 2**18  # 1 MB
_ROWS = 16  # of a block: 16 rows of 2048 RGB pixels take 20 ms with 24 fetches
NEWEST = 1.0 / 8.0  # share of the newest frame; filters for stable pictures take 1/8 to 1/16


def turns(height: int, width: int, frame: int) -> npt.NDArray[np.float64]:
    """Return the angle of each pixel (H, W), from 0 to 2 pi."""
    if not is_whole(frame) or frame < 0:
        raise RenderError(f"frame = {shown(frame)}; expected a whole number from 0.")
    words = _words if height * width <= _KEPT_PIXELS else _words.__wrapped__
    word = words(height, width) + np.uint32(int(frame) * _STEP % 2**32)
    return word.astype(np.float64) * (2.0 * math.pi / 2.0**32)


# Frames, passes and pictures of one size share them; a cascade with jitter has eight sizes.
@functools.lru_cache(maxsize=16)
def _words(height: int, width: int) -> WordArray:
    """Return each pixel's word of its place (H, W)."""
    y, x = np.indices((height, width), dtype=np.uint32)
    return _hash(x, y)


def _hash(x: WordArray, y: WordArray) -> WordArray:
    """Return the first word of pcg2d; sums and products are those of 32 bits."""
    factor, summand, half = np.uint32(1664525), np.uint32(1013904223), np.uint32(16)
    x, y = x * factor + summand, y * factor + summand
    for _ in range(2):
        x = x + y * factor
        y = y + x * factor
        x, y = x ^ (x >> half), y ^ (y >> half)
    return x


def spiral(stage: Stage) -> npt.NDArray[np.float64]:
    """Return the fetches of a disk that is not turned (n, 2) [mm], down and right."""
    angles = 2.0 * math.pi * (np.arange(len(stage.offsets_mm)) / _GOLDEN % 1.0)
    return np.stack((np.sin(angles), np.cos(angles)), axis=1) * stage.offsets_mm[:, None]


def apply_disk(
    pixels: FloatArray,
    stage: Stage,
    mm_per_pixel: float,
    *,
    frame: int = 0,
    border: str = "mirror",
    threads: int | None = None,
) -> FloatArray:
    """Return the sum of a disk's weights times fetches.

    Parameters
    ----------
    pixels : array (H, W, 1) or (H, W, C)
        float32 or float64, the precision of all sums.
    stage : Stage
        A stage of the kind "disk".
    mm_per_pixel : float [mm]
    frame : int
        From 0; each frame turns the fetches differently.
    border : str
        One of ``sssfit.render.borders.BORDERS``.
    threads : int, optional
        Threads to use, by default all cores; the result does not depend on them.

    Returns
    -------
    array (H, W, C)

    Raises
    ------
    RenderError
        The frame is not a whole number from 0, or the fetches reach too far.
    """
    angles = turns(pixels.shape[0], pixels.shape[1], frame)
    # The pixel itself comes first; a shader does not fetch it where its weight is 0.
    places = np.concatenate((np.zeros((1, 2)), spiral(stage) / mm_per_pixel))
    weights = stage.weights.astype(pixels.dtype)
    if not weights[0].any():
        places, weights = places[1:], weights[1:]
    turn = np.stack((np.cos(angles), np.sin(angles)))
    return gathered(pixels, places, weights, turn, border=border, threads=threads)


def gathered(
    pixels: FloatArray,
    places: npt.NDArray[np.float64],
    weights: FloatArray,
    turn: npt.NDArray[np.float64],
    *,
    border: str,
    threads: int | None,
) -> FloatArray:
    """Return the sum of weights times bilinear fetches at places that each pixel turns.

    Parameters
    ----------
    pixels : array (H, W, 1) or (H, W, C)
    places : array (n, 2) [pixels]
        Down and right.
    weights : array (n, C)
    turn : array (2, H, W)
        Cosine and sine of each pixel's turn, times what it scales distances by.
    border : str
    threads : int, optional

    Raises
    ------
    RenderError
        The fetches reach too far.
    """
    from sssfit._jit import thread_pool
    from sssfit._jit.disk import gather  # numba: 0.4 s

    height, width = pixels.shape[:2]
    reach = float(np.hypot(*places.T).max() * np.hypot(*turn).max())
    check_memory(16.0 * reach, f"fetches {reach:.3g} pixels away", "use larger pixels")
    beyond = math.ceil(reach) + 1
    rows, columns = (source_indices(size, beyond, border) for size in (height, width))
    given = np.pad(pixels, ((0, 1), (0, 1), (0, 0))), rows, columns, places, weights, turn
    out = np.empty((height, width, weights.shape[1]), pixels.dtype)
    edges = [*range(0, height, _ROWS), height]
    with thread_pool(thread_count(threads), "sssfit-disk") as pool:
        blocks = itertools.pairwise(edges)
        for done in [pool.submit(gather, *given, out, *block) for block in blocks]:
            done.result()
    return out


def all_turns(stage: Stage, mm_per_pixel: float, half: int) -> npt.NDArray[np.float64]:
    """Return the mean over all turns of what one lit pixel becomes (2h+1, 2h+1, C).

    Bilinear fetches of each ring at steps of 1/32 of a pixel or less along it.
    """
    size, channels = 2 * half + 1, stage.weights.shape[1]
    found = np.zeros((size * size, channels))
    found[half * size + half] = stage.weights[0]
    for radius, weights in zip(stage.offsets_mm / mm_per_pixel, stage.weights[1:], strict=True):
        count = 64 * math.ceil(math.pi * radius + 1.0)
        angles = (np.arange(count) + 0.5) * (2.0 * math.pi / count)
        places = half + radius * np.stack((np.sin(angles), np.cos(angles)))
        whole = np.floor(places).astype(np.intp)
        part = places - whole
        for i, j in np.ndindex(2, 2):
            at = (whole[0] + i) * size + whole[1] + j
            shares = np.abs(1 - i - part[0]) * np.abs(1 - j - part[1])
            ring = np.bincount(at, shares / count, size * size)
            found += ring[:, None] * weights
    return found.reshape(size, size, channels)


def averaged(frames: Iterable[FloatArray], newest: float = NEWEST) -> Iterator[FloatArray]:
    """Yield the picture that a filter over time shows after each frame.

    The newest of k frames has the share 1/k until that would be less than ``newest``, and that
    share from then on (an exponential average that starts as the mean).

    Parameters
    ----------
    frames : iterable of array (H, W, C)
    newest : float
        Share of the newest frame, above 0 and at most 1.

    Raises
    ------
    RenderError
        The share is out of range.
    """
    if not 0.0 < newest <= 1.0:
        raise RenderError(f"newest = {shown(newest)}; expected a share above 0 and at most 1.")
    past: FloatArray | None = None
    for k, frame in enumerate(frames, 1):
        past = frame if past is None else past + max(1.0 / k, newest) * (frame - past)
        yield past
