"""Kernels as renderers apply them, with their files: separable terms, and tables of taps."""

import io
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO, TypeAlias

from sssfit.kernel.between import taps_between
from sssfit.kernel.json import KERNEL
from sssfit.kernel.json_file import read_bytes, read_json
from sssfit.kernel.record import FORMAT, SeparableKernel, is_kernel_file
from sssfit.kernel.taps import Stage, Taps, is_taps_file
from sssfit.kernel.taps_json import TAPS
from sssfit.messages import printable

__all__ = [
    "FORMAT",
    "Kernel",
    "SeparableKernel",
    "Stage",
    "Taps",
    "is_kernel_file",
    "is_taps_file",
    "read_kernel",
    "taps_between",
]

Kernel: TypeAlias = SeparableKernel | Taps
_EITHER = replace(KERNEL, ending=".kernel.json or .taps")  # of messages


def read_kernel(source: str | Path | BinaryIO, origin: str | None = None) -> Kernel:
    """Read a kernel of either kind from a path or a binary stream.

    Raises
    ------
    KernelError
        As `SeparableKernel.read` and `Taps.read`.
    """
    if origin is None:
        origin = str(source) if isinstance(source, str | Path) else "the kernel"
    content = read_bytes(source, printable(origin), KERNEL)
    if not (KERNEL.mark in content or TAPS.mark in content):
        read_json(io.BytesIO(content), printable(origin), _EITHER)  # says what it is instead
    kind = Taps if TAPS.mark in content else SeparableKernel
    return kind.read(io.BytesIO(content), origin)
