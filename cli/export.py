"""``sssfit export``: kernels and profiles as files for other programs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from ._input import kernel_name, load, profile_name
from ._options import Common, common_options, options
from ._output import finish_one, held, stem_of, target, write
from ._verb_options import EXPORT


@click.command()
@click.argument("file", required=False)
@options(*EXPORT)
@common_options
def export(file: str | None, form: str, output: str | None, force: bool, common: Common) -> None:
    """Export FILE for other programs.

    FILE is a .kernel.json file, for csv a .profile.npz file, or - for stdin; by default the newest
    in this folder. Shader source holds the signs and weights of every separable term, and a comment
    with material, fit, pixels, energy and errors. The table has the energy of each annulus and its
    standard error, against the annulus' outer edge r_mm (inf: beyond the grid), with every digit;
    `sssfit import` reads it back. It does not include specular reflectance, absorption and
    transmittance.

    \b
      sssfit export --format hlsl
      sssfit export skin1.svd3.kernel.json --format json -o -
      sssfit export skin1.profile.npz --format csv -o - | head
    """
    from sssfit.export import hlsl, is_hlsl_file, json_document
    from sssfit.formats.csv import csv_text, is_profile_csv
    from sssfit.kernel import SeparableKernel, is_kernel_file
    from sssfit.profile import Profile

    figures: dict[str, Any]
    if form == "csv":
        name = profile_name(file)
        profile = load(Profile.read, name)
        text = csv_text(profile)
        figures = {"profile": name, "channels": profile.channels, "annuli": profile.n_annuli}
    else:
        name = kernel_name(file)
        kernel = load(SeparableKernel.read, name)
        text = (hlsl if form == "hlsl" else json_document)(kernel)
        keys = ("channels", "rank", "pixels", "mm_per_pixel")
        figures = {"kernel": name, **{key: getattr(kernel, key) for key in keys}}
    path = target(output, f"{stem_of(name)}.{form}")
    is_ours: dict[str, Callable[[Path], bool]] = {
        "hlsl": is_hlsl_file,
        "json": is_kernel_file,
        "csv": is_profile_csv,
    }
    named = ({"hlsl": "shader source", "json": "a kernel", "csv": "a table"}[form], f".{form}")
    with held([path], is_ours[form], inputs=[name], force=force, named=named):
        write(text.encode(), path)
    what = "the table" if form == "csv" else "the kernel"
    finish_one(common, path, {"format": form, **figures}, "", what)
