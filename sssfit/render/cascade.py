"""A cascade of pairs on a flat, mirrored picture, level by level: quick, and the same to rounding.

`sssfit.render.taps` runs any table pass by pass; ``sssfit._jit.cascade`` runs the stages of a level
together.
"""

import itertools
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit.arrays import read_only
from sssfit.kernel.taps import Stage, Taps
from sssfit.process import thread_count
from sssfit.render.borders import source_indices

FloatArray = npt.NDArray[np.floating[Any]]

_ROWS = 256  # of a block, even; a block computes twice its stages' reach of rows more


def is_quick(taps: Taps) -> bool:
    """Return whether `apply_cascade` can run a table: a chain of pairs along the axes."""
    return taps.chained and all(each.is_upright for each in taps.stages)


def apply_cascade(
    pixels: FloatArray, taps: Taps, mm_per_pixel: float, *, threads: int | None = None
) -> FloatArray:
    """Return the sum of the stages' pictures, with mirrored borders.

    Parameters
    ----------
    pixels : array (H, W, C)
        float32 or float64, the precision of all sums.
    taps : Taps
        A chain of pairs.
    mm_per_pixel : float [mm]
    threads : int, optional
        Threads to use, by default all cores; the result does not depend on them.

    Returns
    -------
    array (H, W, C)
    """
    from sssfit._jit import thread_pool
    from sssfit._jit.cascade import add_doubled, run_level  # numba: 0.4 s

    channels = pixels.shape[2]
    picture = np.ascontiguousarray(pixels).reshape(len(pixels), -1)
    smaller = _smaller(pixels.shape, taps.stages[-1].level, picture.dtype)
    pictures, sums = [picture, *smaller[::2]], [np.empty_like(picture), *smaller[1::2]]
    with thread_pool(thread_count(threads), "sssfit-cascade") as pool:
        for level, (read, total) in enumerate(zip(pictures, sums, strict=True)):
            half = pictures[level + 1] if level + 1 < len(sums) else total[:0, :0]
            given = _numbers(taps, level, mm_per_pixel, read, channels)
            planes = read_only(read), total, half
            _run_blocks(pool, len(read), run_level, *planes, *given, level == 0)
        for fine in range(len(sums) - 2, -1, -1):
            total, coarse = sums[fine : fine + 2]
            height, width = coarse.shape[0], coarse.shape[1] // channels
            places = (source_indices(n, 1, "mirror") for n in (height, width))
            both = total, read_only(coarse), *places
            _run_blocks(pool, len(total), add_doubled, *both, channels, fine == 0)
    return sums[0].reshape(pixels.shape)


def _smaller(shape: tuple[int, ...], levels: int, precision: np.dtype[Any]) -> list[FloatArray]:
    """Return room for picture and sum of each halved level, in turn, in planes (h, C w).

    They share one array: C libraries keep one of up to 32 MB for the next call, where several are
    fetched from the system page by page, up to 6 of 51 ms.
    """
    height, width, channels = shape
    sizes = []
    for _ in range(levels):
        height, width = -(-height // 2), -(-width // 2)
        sizes += [(height, width * channels)] * 2
    ends = np.cumsum([0, *(h * w for h, w in sizes)])
    room = np.empty(ends[-1], precision)
    parts = zip(itertools.pairwise(ends), sizes, strict=True)
    return [room[begin:end].reshape(size) for (begin, end), size in parts]


def _numbers(
    taps: Taps, level: int, mm_per_pixel: float, picture: FloatArray, channels: int
) -> tuple[np.ndarray[Any, Any], ...]:
    """Return the arrays of `run_level` from ``rows`` to ``shares``, in its order."""
    stages = [each for each in taps.stages if each.level == level]
    before = sum(each.level < level for each in taps.stages)
    lines = [_line(each, mm_per_pixel * 2.0**level) for each in stages]
    reach = np.array([at.max() for at, _ in lines])
    many = np.array([len(at) for at, _ in lines])
    margin = reach.sum() - np.cumsum([0, *reach])  # here: numba takes 2 s to compile these two
    kept = 2 + np.maximum(margin, 2 * np.array([*reach, 0]))
    at = np.zeros((len(stages), many.max()), np.intp)
    weights = np.zeros((len(stages), channels, many.max() + 1), picture.dtype)
    for s, (own, each) in enumerate(lines):
        at[s, : len(own)] = own
        weights[s, :, : len(each)] = each.T
    blend = taps.blend[before : before + len(stages) + 1]
    shares = np.array(blend.T, picture.dtype, order="C")  # as one channel has: compiled once
    if level > 0:  # what it is halved from is part of the finer sum
        shares[:, 0] = 0.0
    far, size = int(reach.sum()), (picture.shape[0], picture.shape[1] // channels)
    # An odd row or column has a partner past the border, for halving.
    rows, columns = (
        source_indices(n, far + 1, "mirror")[1 : n + 2 * far + 1 + n % 2] for n in size
    )
    return rows, columns, reach, margin, kept, many, at, weights, shares


def _line(stage: Stage, mm_per_texel: float) -> tuple[npt.NDArray[np.intp], FloatArray]:
    """Return distances (K) of a pass's pairs that are not 0, and weights (1 + K, C)."""
    line = stage.pass_weights(mm_per_texel)
    half = line[len(line) // 2 :]
    at = np.flatnonzero(half[1:].any(axis=1)) + 1
    if at.size == 0:
        at = np.array([1])
    return at, half[np.concatenate(([0], at))]


def _run_blocks(
    pool: ThreadPoolExecutor, rows: int, work: Callable[..., None], *given: object
) -> None:
    """Run ``work(*given, first, last)`` on blocks of rows and wait for all of them."""
    edges = [*range(0, rows, _ROWS), rows]
    for done in [pool.submit(work, *given, *block) for block in itertools.pairwise(edges)]:
        done.result()
