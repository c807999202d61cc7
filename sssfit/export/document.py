"""Kernels and tables of taps as JSON documents: their files with a comment in words."""

import json
from pathlib import Path

from sssfit.export.certificate import certificate, errors_text, how_to_run, values_text
from sssfit.kernel import SeparableKernel, Taps, is_kernel_file, is_taps_file
from sssfit.kernel.taps_json import pack
from sssfit.messages import counted, printable


def description(kernel: SeparableKernel) -> list[str]:
    """Return the lines of the comment, which do not depend on the clock or the machine.

    Text is kept on one line, because a newline would end a shader's comment.
    """
    meta = kernel.meta
    photons = (
        f", {counted(meta['photons'], 'photon', ',')}" if meta.get("photons") is not None else ""
    )
    photons += f", seed {meta['seed']}" if meta.get("seed") is not None else ""
    settings = ", ".join(f"{key} {value}" for key, value in meta.get("settings", {}).items())
    sha = f", sha256 {meta['material_sha256'][:16]}" if meta.get("material_sha256") else ""
    terms = counted(kernel.rank, "separable term")
    fit = f"{kernel.method}, {terms}{f' ({settings})' if settings else ''}"
    lines = [
        f"Subsurface scattering kernel: {meta.get('material') or 'unknown material'}{sha}.",
        f"Profile: {meta.get('profile_method') or 'unknown'}{photons}. Fit: {fit}. "
        f"sssfit {meta.get('version') or '(unknown)'}.",
        f"{counted(kernel.pixels, 'pixel')} of {kernel.mm_per_pixel:.9g} mm, the middle one on "
        "the axis; "
        f"channels {', '.join(kernel.channels)}.",
        "K[i][j] = sum over terms of sign * weight[i] * weight[j]: a horizontal pass and the same "
        "pass vertically,",
        "then the sum over terms. Weights are energies of pixels (dimensionless), linear light.",
        f"Energy of the 2D kernel: {values_text(kernel.energy.tolist())}.",
        f"Multiply by: {values_text(kernel.scale.tolist())}.",
        f"Relative Frobenius error: {errors_text(kernel.relative_frobenius_error.tolist())}; "
        f"energy error: {errors_text(kernel.energy_error.tolist())}.",
    ]
    return [printable(line) for line in lines]


def json_document(kernel: SeparableKernel) -> str:
    """Return the kernel as indented JSON, with a ``comment`` (list of lines) first."""
    whole = {"comment": description(kernel), **kernel.to_dict()}
    terms = whole.pop("terms")
    head = json.dumps(whole, indent=1, allow_nan=False, ensure_ascii=False)
    lines = ",\n  ".join(json.dumps(each, allow_nan=False) for each in terms)
    return head.removesuffix("\n}") + f',\n "terms": [\n  {lines}\n ]\n}}\n'


def taps_document(taps: Taps) -> str:
    """Return a table's own JSON with a ``comment`` (list of lines) after its format."""
    first, *rest = pack(taps).decode().split("\n")
    words = [printable(each) for each in (*certificate(taps), *how_to_run(taps))]
    lines = json.dumps(words, ensure_ascii=False)
    return "\n".join([first, rest[0], f' "comment": {lines},', *rest[1:]])


def is_our_document(path: Path) -> bool:
    """Return whether a file is a kernel's document or a table's, with or without a comment."""
    return is_kernel_file(path) or is_taps_file(path)
