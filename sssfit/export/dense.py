"""A dense kernel as source of a language: constant arrays with a comment that explains them."""

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import KernelError
from sssfit.export.constants import Writer, check_prefix, in_half
from sssfit.export.dialects import Dialect, commented
from sssfit.export.document import description
from sssfit.export.remarks import remarked
from sssfit.kernel import SeparableKernel, Stage, Taps
from sssfit.kernel.structure import MOST_IN_PASS, MOST_STAGES

MOST_DENSE = 2 * MOST_IN_PASS + 1  # weights of a pass: the middle, and pairs of fetches


def dense(
    kernel: SeparableKernel, dialect: Dialect, prefix: str = "SSS", *, half: bool = False
) -> str:
    """Return constant arrays of the signs and weights of each term, one term after the other.

    One to four channels are one vector each; more channels follow one another.

    Raises
    ------
    KernelError
        The prefix is no identifier.
    """
    check_prefix(prefix)
    write = Writer(dialect, prefix, half=half)
    terms, pixels, channels = kernel.weights.shape
    lines = [
        dialect.mark,
        *(commented(line) for line in description(kernel)),
        write.scalar("uint", "TERMS", [terms]),
        write.scalar("uint", "PIXELS", [pixels]),
        write.scalar("float", "MM_PER_PIXEL", [kernel.mm_per_pixel]),
        write.vector("SCALE", kernel.scale.tolist()),
        *write.rows("SIGN", kernel.signs.tolist()),
        *write.rows("WEIGHT", kernel.weights.reshape(-1, channels).tolist()),
    ]
    return "\n".join([*remarked(lines, dialect), ""])


def taps_of_kernel(kernel: SeparableKernel, most: int | None) -> Taps:
    """Return a dense kernel as a table with a fetch for every pixel.

    Raises
    ------
    KernelError
        A pass has more weights than ``most``, or than a table of taps holds; or there are too many
        terms.
    """
    _check_size(kernel, most)
    # A pass has a pair of fetches at least; beside a single pixel they weigh nothing.
    beside = (0, 1 if kernel.pixels == 1 else 0)
    halves = np.pad(kernel.weights[:, kernel.half_pixels :], ((0, 0), beside, (0, 0)))
    offsets_mm: FloatArray = kernel.mm_per_pixel * np.arange(1.0, halves.shape[1])
    terms = [Stage.of_term(offsets_mm, each) for each in halves]
    sums = np.array([each for _, each in terms])  # (R, C)
    blend = np.concatenate((np.zeros((1, len(kernel.channels))), kernel.signs * sums**2))
    return Taps(
        method=kernel.method,
        mm_per_pixel=kernel.mm_per_pixel,
        channels=kernel.channels,
        chained=False,
        stages=tuple(stage for stage, _ in terms),
        blend=blend * kernel.scale,
        errors={"spectral": np.full(len(kernel.channels), np.nan), "energy": kernel.energy_error},
        meta=kernel.meta,
    )


def _check_size(kernel: SeparableKernel, most: int | None) -> None:
    """Refuse kernels of more weights a pass, or terms, than are written as passes."""
    limit = MOST_DENSE if most is None else most
    if kernel.pixels > limit:
        # Beyond what `dense` allows that option would be no remedy.
        unless = " unless `dense` is set" if kernel.pixels <= MOST_DENSE else ""
        raise KernelError(
            f"a pass of this kernel has {kernel.pixels} weights, and {limit} are the most that are "
            f"written as fetches{unless}; thin it to taps, or fit a cascade."
        )
    if kernel.rank > MOST_STAGES:
        raise KernelError(
            f"this kernel has {kernel.rank} terms, and {MOST_STAGES} are the most that are written "
            "as passes; fit one with fewer, or a cascade."
        )


def energy_in_half(kernel: SeparableKernel) -> FloatArray:
    """Return the energy (C,), with its scale, of a kernel's constants rounded to half floats."""
    sums = in_half(kernel.weights).sum(axis=1)
    energy: FloatArray = (kernel.signs * sums**2).sum(axis=0) * in_half(kernel.scale)
    return energy
