"""Kernels as text for other programs: source of shaders and of C, and documents."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sssfit.errors import KernelError
from sssfit.export.dense import dense
from sssfit.export.dialects import DIALECTS, mark
from sssfit.export.document import json_document, taps_document
from sssfit.export.shader import Style, source
from sssfit.files import has_mark
from sssfit.kernel import Kernel, SeparableKernel, Taps, is_kernel_file, is_taps_file

__all__ = ["DIALECTS", "Style", "dense", "json_document", "kernel_text", "source", "taps_document"]

_FIGURES = ("channels", "rank", "pixels", "mm_per_pixel")
_TAPS_FIGURES = ("channels", "structure", "fetches", "passes", "mm_per_pixel")


def kernel_text(
    kernels: Kernel | Sequence[Kernel], form: str, style: Style | None = None
) -> tuple[str, dict[str, Any]]:
    """Return a kernel as text, and the figures of ``sssfit export --json``.

    Parameters
    ----------
    kernels : SeparableKernel or Taps, or a sequence of them
        Several tables with the same stages become one source, indexed by profile.
    form : str
        A name of ``DIALECTS``, or "json".
    style : Style, optional
        Of source.

    Raises
    ------
    KernelError
        The form is unknown, several kernels cannot be one, or the style is not for them.
    """
    every = [kernels] if isinstance(kernels, SeparableKernel | Taps) else list(kernels)
    first, chosen = every[0], style or Style()
    if form != "json" and form not in DIALECTS:
        raise KernelError(f"no format {form!r}; expected json, {', '.join(DIALECTS)}.")
    tables = [each for each in every if isinstance(each, Taps)]
    if len(every) > 1 and (form == "json" or len(tables) < len(every)):
        raise KernelError("only tables of taps share one source; write other kernels one by one.")
    keys = _TAPS_FIGURES if tables else _FIGURES
    figures = {key: getattr(first, key) for key in keys}
    if isinstance(first, Taps):
        text = taps_document(first) if form == "json" else source(tables, DIALECTS[form], chosen)
        return text, figures
    if form == "json":
        return json_document(first), figures
    return dense(first, DIALECTS[form], chosen.prefix), figures


def is_ours(path: Path, form: str) -> bool:
    """Return whether a file is one that `kernel_text` wrote in this form."""
    if form == "json":
        return is_kernel_file(path) or is_taps_file(path)
    return has_mark(path, {mark(DIALECTS[form]).encode(): b""})
