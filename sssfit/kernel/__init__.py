"""Kernels as renderers apply them, with their files: separable terms, and tables of taps."""

import io
from pathlib import Path
from typing import BinaryIO, TypeAlias

from sssfit.kernel.json_file import MOST_BYTES
from sssfit.kernel.record import FORMAT, SeparableKernel, is_kernel_file
from sssfit.kernel.taps import Stage, Taps, is_taps_file
from sssfit.kernel.taps_json import TAPS

__all__ = [
    "FORMAT",
    "Kernel",
    "SeparableKernel",
    "Stage",
    "Taps",
    "is_kernel_file",
    "is_taps_file",
    "read_kernel",
]

Kernel: TypeAlias = SeparableKernel | Taps


def read_kernel(source: str | Path | BinaryIO, origin: str | None = None) -> Kernel:
    """Read a kernel of either kind from a path or a binary stream.

    Raises
    ------
    KernelError
        As `SeparableKernel.read` and `Taps.read`.
    """
    if isinstance(source, str | Path):
        return (Taps if is_taps_file(Path(source)) else SeparableKernel).read(source, origin)
    content = source.read(MOST_BYTES + 1)
    kind = Taps if TAPS.mark in content[:200] else SeparableKernel
    return kind.read(io.BytesIO(content), origin)
