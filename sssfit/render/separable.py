"""A fitted kernel on a flat picture: two one-dimensional passes for every term.

The sum over terms t of s_t w_t[i] w_t[j] is applied as a pass along x and the same pass along y;
``sssfit._jit.passes`` does the work, with rows distributed over threads. The second pass applies
signs and the kernel's scale.
"""

import itertools
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit.arrays import check_record, read_only
from sssfit.errors import RenderError
from sssfit.kernel import SeparableKernel
from sssfit.process import thread_count
from sssfit.render.borders import check_memory, check_sums, precision_for, scene_for, source_indices
from sssfit.scene.record import Scene

FloatArray = npt.NDArray[np.floating[Any]]

# Rows per block of a thread: 64 rows of 2048 RGB pixels take 2 ms, a thousand times a start.
_ROWS = 64
_PAIRS = 4  # weights that the compiled passes take at a time


def render_separable(
    scene: Scene,
    kernel: SeparableKernel,
    *,
    border: str = "mirror",
    threads: int | None = None,
    dtype: npt.DTypeLike = np.float64,
) -> FloatArray:
    """Convolve irradiance with a separable kernel.

    Parameters
    ----------
    scene : Scene
        A flat picture: only its irradiance and pixel size are used.
    kernel : SeparableKernel
        A kernel for the scene's pixel size; its ``scale`` is applied.
    border : str
        One of ``sssfit.render.borders.BORDERS``.
    threads : int, optional
        Threads to use, by default all cores; the result does not depend on them.
    dtype : float64 or float32
        Precision of the sums and of the result.

    Returns
    -------
    array (H, W, C)
        Radiant exitance, in the irradiance's unit.

    Raises
    ------
    RenderError
        Kernel and scene differ in pixel size or channels, or a setting is invalid.
    """
    check_record("kernel", kernel, SeparableKernel, RenderError)
    scene = scene_for(scene, kernel.channels)
    check_pitch(scene, kernel)
    precision = precision_for(dtype, scene)
    # Two passes, the result and, in float32, a copy of the picture.
    samples = scene.height * scene.width * len(kernel.channels)
    check_memory(
        3.0 * samples * precision.itemsize,
        f"{scene.name}: {scene.height} x {scene.width} pixels",
        "render a part of the picture",
    )
    pixels = scene.irradiance.astype(precision, copy=False)
    signs = kernel.signs * kernel.scale
    picture = apply_passes(pixels, kernel.weights, signs, border=border, threads=threads)
    return check_sums(picture, scene, _gain(kernel))


def _gain(kernel: SeparableKernel) -> float:
    """Return how many times the light the sums of a picture's passes can be."""
    sums = np.maximum(np.abs(kernel.weights).sum(axis=1), 1.0)
    return 2.0 * float((kernel.scale * sums**2).sum(axis=0).max(initial=1.0))


def check_pitch(scene: Scene, kernel: SeparableKernel) -> None:
    """Raise an error for a kernel that was made for another pixel size."""
    if abs(kernel.mm_per_pixel - scene.mm_per_pixel) > 1e-6 * scene.mm_per_pixel:
        raise RenderError(
            f"the kernel has {kernel.mm_per_pixel:.7g} mm per pixel and {scene.name} "
            f"{scene.mm_per_pixel:.7g}; fit the kernel at "
            f"`mm_per_pixel = {scene.mm_per_pixel:.7g}`."
        )


def apply_passes(
    pixels: FloatArray,
    weights: FloatArray,
    signs: FloatArray,
    *,
    border: str = "mirror",
    threads: int | None = None,
) -> FloatArray:
    """Return the sum over terms t of signs_t times the passes weights_t along x and y.

    Parameters
    ----------
    pixels : array (H, W, 1) or (H, W, C)
        float32 or float64, the precision of all sums.
    weights : array (T, P, C)
        Symmetric about the middle; zeros at the ends cost nothing.
    signs : array (T, C)
        Factors of the terms, of any size.
    border, threads
        As `render_separable`.

    Returns
    -------
    array (H, W, C)
        The blurred picture, in the pixels' precision.
    """
    from sssfit._jit import thread_pool
    from sssfit._jit.passes import pass_across, pass_down  # numba: 0.4 s

    height, width = pixels.shape[:2]
    halves, reach = _halves(weights)
    down = (halves * signs[:, :, None]).astype(pixels.dtype)
    across = halves.astype(pixels.dtype)
    beyond = halves.shape[2] - 1
    columns = source_indices(width, beyond, border)
    rows = source_indices(height, beyond, border)
    channels = weights.shape[2]
    planes = np.empty((channels, height + 1, width), pixels.dtype)
    planes[:, height] = 0.0  # pixels outside a black border
    out = np.zeros((height, width, channels), pixels.dtype)
    read = read_only(pixels)
    with thread_pool(thread_count(threads), "sssfit-passes") as pool:
        for t in range(len(weights)):
            _run_blocks(pool, height, pass_across, read, columns, across[t], reach[t], planes)
            _run_blocks(pool, height, pass_down, planes, rows, down[t], reach[t], out)
    return out


def _run_blocks(
    pool: ThreadPoolExecutor, rows: int, work: Callable[..., None], *given: object
) -> None:
    """Run ``work(*given, first, last)`` on blocks of rows and wait for all of them."""
    edges = [*range(0, rows, _ROWS), rows]
    for done in [pool.submit(work, *given, *block) for block in itertools.pairwise(edges)]:
        done.result()


def _halves(weights: FloatArray) -> tuple[FloatArray, npt.NDArray[np.intp]]:
    """Return passes from the middle outwards (T, C, 1 + 4 n), and their reaches (T, C).

    Zeros at the ends are removed, and others added to fill whole groups of pairs.
    """
    middle = weights.shape[1] // 2
    half = weights[:, middle:].transpose(0, 2, 1)
    last = np.max(np.where(half != 0.0, np.arange(middle + 1), 0), axis=2)
    reach = -(-last // _PAIRS) * _PAIRS
    kept = min(int(reach.max()), middle) + 1
    halves = np.zeros((*last.shape, int(reach.max()) + 1))
    halves[:, :, :kept] = half[:, :, :kept]
    return halves, reach
