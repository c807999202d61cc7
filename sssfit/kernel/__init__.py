"""Separable kernels: the record and its file."""

from sssfit.kernel.record import FORMAT, SeparableKernel, is_kernel_file

__all__ = ["FORMAT", "SeparableKernel", "is_kernel_file"]
