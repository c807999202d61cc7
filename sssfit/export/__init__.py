"""Kernels as text for other programs: shader source and documents, dense or as taps."""

from pathlib import Path
from typing import Any

from sssfit.export.document import json_document
from sssfit.export.dense import hlsl, is_hlsl_file
from sssfit.export.taps import taps_document, taps_hlsl
from sssfit.kernel import Kernel, Taps, is_kernel_file, is_taps_file

__all__ = ["hlsl", "is_hlsl_file", "json_document", "kernel_text", "taps_document", "taps_hlsl"]

_DENSE, _TAPS = {"hlsl": hlsl, "json": json_document}, {"hlsl": taps_hlsl, "json": taps_document}
_FIGURES = ("channels", "rank", "pixels", "mm_per_pixel")
_TAPS_FIGURES = ("channels", "structure", "fetches", "passes", "mm_per_pixel")


def kernel_text(kernel: Kernel, form: str) -> tuple[str, dict[str, Any]]:
    """Return a kernel as text, and the figures of ``sssfit export --json``.

    Parameters
    ----------
    kernel : SeparableKernel or Taps
    form : {"hlsl", "json"}
    """
    if isinstance(kernel, Taps):
        return _TAPS[form](kernel), {key: getattr(kernel, key) for key in _TAPS_FIGURES}
    return _DENSE[form](kernel), {key: getattr(kernel, key) for key in _FIGURES}


def is_ours(path: Path, form: str) -> bool:
    """Return whether a file is one that `kernel_text` wrote in this form."""
    return is_hlsl_file(path) if form == "hlsl" else is_kernel_file(path) or is_taps_file(path)
