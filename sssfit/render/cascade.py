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
    current = np.ascontiguousarray(pixels).reshape(len(pixels), -1)
    sums: list[FloatArray] = []
    with thread_pool(thread_count(threads), "sssfit-cascade") as pool:
        for level in range(taps.stages[-1].level + 1):
            total = np.empty_like(current)
            half = _half_of(current, channels, wanted=level < taps.stages[-1].level)
            given = _numbers(taps, level, mm_per_pixel, current, channels)
            is_packed = level == 0
            _run_blocks(pool, len(current), run_level, current, total, half, *given, is_packed)
            sums.append(total)
            current = half
        for fine in range(len(sums) - 2, -1, -1):
            height, width = sums[fine + 1].shape
            places = (source_indices(n, 1, "mirror") for n in (height, width // channels))
            both = sums[fine], sums[fine + 1]
            whole, is_packed = len(sums[fine]), fine == 0
            _run_blocks(pool, whole, add_doubled, *both, *places, channels, is_packed)
    return sums[0].reshape(pixels.shape)


def _half_of(picture: FloatArray, channels: int, *, wanted: bool) -> FloatArray:
    """Return room for a picture of half the size, or none."""
    if not wanted:
        return np.empty((0, 0), picture.dtype)
    height, width = picture.shape[0], picture.shape[1] // channels
    return np.empty((-(-height // 2), -(-width // 2) * channels), picture.dtype)


def _numbers(
    taps: Taps, level: int, mm_per_pixel: float, picture: FloatArray, channels: int
) -> tuple[np.ndarray[Any, Any], ...]:
    """Return the arrays of `run_level` from ``rows`` to ``shares``, in its order."""
    stages = [each for each in taps.stages if each.level == level]
    before = sum(each.level < level for each in taps.stages)
    lines = [_line(each, mm_per_pixel * 2.0**level) for each in stages]
    reach = np.array([at.max() for at, _ in lines])
    many = np.array([len(at) for at, _ in lines])
    at = np.zeros((len(stages), many.max()), np.intp)
    weights = np.zeros((len(stages), many.max() + 1, channels), picture.dtype)
    for s, (own, each) in enumerate(lines):
        at[s, : len(own)] = own
        weights[s, : len(each)] = each
    shares = taps.blend[before : before + len(stages) + 1].copy()
    if level > 0:  # what it is halved from is part of the finer sum
        shares[0] = 0.0
    height, width = picture.shape[0], picture.shape[1] // channels
    rows = source_indices(height, 2 * int(reach.sum()) + 1, "mirror")
    columns = source_indices(width, int(reach.max()) + 1, "mirror")
    return rows, columns, reach, many, at, weights, shares.astype(picture.dtype)


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
