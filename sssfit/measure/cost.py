"""Cost of a kernel: fetches, passes and bytes, which hold for any processor; measured seconds."""

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from sssfit.arrays import check_record
from sssfit.errors import RenderError
from sssfit.kernel import Kernel, SeparableKernel, Taps
from sssfit.kernel.taps import BYTES, textures_for
from sssfit.messages import counted

# Bytes of a weight in a shader, a float32.
FLOAT_BYTES = 4


@dataclass(frozen=True, slots=True)
class Cost:
    """The cost of a kernel per pixel.

    Parameters
    ----------
    fetches : float
        Texture fetches a pixel; one fetch counts for all channels together. A dense kernel has one
        for each weight of its passes that is not 0 in every channel; no shader does so many.
    passes : int
        Passes over the picture, two per term; of a cascade those of its stages.
    all_passes : int
        With those that change the picture's size.
    bytes_per_pixel : float
        Read and written a pixel, each picture once a pass, in textures of four half floats: three
        channels, used or not, and coverage.
    kernel_bytes : int
        Size of a float32 table of all terms, pixels and channels: T P C 4, with both halves of a
        pass. Of a table of taps, of offsets, weights and blend.
    seconds_per_megapixel : float, optional [s]
        Measured time of 1e6 pixels with all their channels; None if nothing was timed.
    """

    fetches: float
    passes: int
    all_passes: int
    bytes_per_pixel: float
    kernel_bytes: int
    seconds_per_megapixel: float | None = None


def cost_of(kernel: Kernel, seconds_per_megapixel: float | None = None) -> Cost:
    """Return the cost of a kernel; terms that are 0 in every channel cost nothing.

    Parameters
    ----------
    kernel : SeparableKernel or Taps
    seconds_per_megapixel : float, optional [s]
        Measured by the function of that name.

    Examples
    --------
    >>> from sssfit.fit import fit_svd
    >>> from sssfit.material import load_material
    >>> from sssfit.simulate import simulate_dipole
    >>> profile = simulate_dipole(load_material("skin1"))
    >>> cost_of(fit_svd(profile, rank=3, mm_per_pixel=0.5, support_mm=8).kernel)
    Cost(fetches=198.0, passes=6, all_passes=6, bytes_per_pixel=112.0, kernel_bytes=1188, \
seconds_per_megapixel=None)
    """
    check_record("kernel", kernel, Kernel, RenderError)
    if isinstance(kernel, Taps):
        numbers = sum(each.offsets_mm.size + each.weights.size for each in kernel.stages)
        return Cost(
            fetches=kernel.fetches,
            passes=kernel.passes,
            all_passes=kernel.cost.all_passes,
            bytes_per_pixel=kernel.bytes_per_pixel(),
            kernel_bytes=(numbers + kernel.blend.size) * FLOAT_BYTES,
            seconds_per_megapixel=seconds_per_megapixel,
        )
    return _dense_cost(kernel, seconds_per_megapixel)


def _dense_cost(kernel: SeparableKernel, seconds_per_megapixel: float | None) -> Cost:
    """Return the cost of a kernel with a weight for every pixel of its passes."""
    used = np.any(kernel.weights != 0.0, axis=2)  # (T, P)
    terms = int(np.count_nonzero(used.any(axis=1)))
    # A pass reads a picture and writes one; all but the first term are added to what is there.
    pictures = 4.0 * terms + max(terms - 1, 0)
    return Cost(
        fetches=2.0 * float(np.count_nonzero(used)),
        passes=2 * terms,
        all_passes=2 * terms,
        bytes_per_pixel=BYTES["half"] * pictures * textures_for(len(kernel.channels)),
        kernel_bytes=terms * kernel.pixels * len(kernel.channels) * FLOAT_BYTES,
        seconds_per_megapixel=seconds_per_megapixel,
    )


def seconds_per_megapixel(
    render: Callable[[], object],
    pixels: int,
    repeats: int = 5,
    clock: Callable[[], float] = perf_counter,
) -> float:
    """Return the least wall time of a call per 1e6 pixels [s].

    A first call is not counted: it compiles, plans and warms caches. The shortest of several is the
    one least disturbed by other programs.

    Parameters
    ----------
    render : callable
        Renders ``pixels`` pixels; its result is discarded.
    pixels : int
        Number of pixels H W of its picture.
    repeats : int
        Number of timed calls.
    clock : callable
        Returns the time in seconds.

    Raises
    ------
    RenderError
        Pixels or repeats are below 1.
    """
    if pixels < 1 or repeats < 1:
        raise RenderError(
            f"{counted(pixels, 'pixel')}, {counted(repeats, 'repeat')}; expected at least 1 of "
            "each."
        )
    render()
    times = []
    for _ in range(repeats):
        start = clock()
        render()
        times.append(clock() - start)
    return min(times) * 1e6 / pixels
