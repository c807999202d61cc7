"""A dense kernel as source of a language: constant arrays with a comment that explains them."""

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import KernelError
from sssfit.export.constants import Writer, check_prefix
from sssfit.export.dialects import Dialect, commented, mark
from sssfit.export.document import description
from sssfit.export.remarks import remarked
from sssfit.kernel import SeparableKernel, Stage, Taps


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
        mark(dialect),
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
        A pass has more weights than ``most``.
    """
    if most is not None and kernel.pixels > most:
        raise KernelError(
            f"a pass of this kernel has {kernel.pixels} weights, and {most} are the most that are "
            "written as fetches unless `dense` is set; thin it to taps, or fit a cascade."
        )
    middle = kernel.pixels // 2
    offsets_mm: FloatArray = kernel.mm_per_pixel * np.arange(1.0, middle + 1.0)
    terms = [Stage.of_term(offsets_mm, each) for each in kernel.weights[:, middle:]]
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


def energy_in_half(kernel: SeparableKernel) -> FloatArray:
    """Return the energy (C,) of a kernel whose weights are rounded to half floats."""
    sums = kernel.weights.astype(np.float16).astype(float).sum(axis=1)
    energy: FloatArray = (kernel.signs * sums**2).sum(axis=0) * kernel.scale
    return energy
