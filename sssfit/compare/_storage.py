"""Kernels as they are kept for a shader: weights in fewer bits."""

import dataclasses

import numpy as np
import numpy.typing as npt

from sssfit.errors import KernelError
from sssfit.kernel import SeparableKernel

FloatArray = npt.NDArray[np.float64]

STORAGES = {"float64": "float64", "float32": "float32", "half": "half float", "8-bit": "8 bit"}


def stored(kernel: SeparableKernel, storage: str) -> SeparableKernel:
    """Return the kernel after its weights have been stored and read back.

    Parameters
    ----------
    kernel : SeparableKernel
    storage : str
        "float64" changes nothing; "float32"; "half", IEEE 754 binary16; "8-bit", whole numbers
        with one scale a channel, its largest weight: 0 to 255, or -127 to 127 where a weight of
        the channel is negative.

    Raises
    ------
    KernelError
        No such storage.
    """
    if storage not in STORAGES:
        raise KernelError(f"storage = {storage!r}; expected one of {', '.join(STORAGES)}.")
    if storage == "8-bit":
        weights = _eight_bit(kernel.weights)
    else:
        kinds = {"float64": np.float64, "float32": np.float32, "half": np.float16}
        weights = kernel.weights.astype(kinds[storage]).astype(np.float64)
    return dataclasses.replace(kernel, weights=weights)


def _eight_bit(weights: FloatArray) -> FloatArray:
    """Round weights (T, P, C) to steps of each channel's largest one."""
    largest = np.abs(weights).max(axis=(0, 1))
    steps = np.where((weights < 0.0).any(axis=(0, 1)), 127.0, 255.0)
    unit = np.where(largest > 0.0, largest, 1.0) / steps
    rounded: FloatArray = np.round(weights / unit) * unit
    return rounded
