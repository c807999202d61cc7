"""``sssfit export``: kernels and profiles as files for other programs."""

from __future__ import annotations

from functools import partial
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

    FILE is a .taps.json or .kernel.json file, for csv a .profile.npz file, or - for stdin; by
    default the newest in this folder. Shader source holds the offsets, weights and blend of a table
    of taps, or the signs and weights of every separable term, and a comment that says how they are
    applied, with material, fit, cost, energy and errors. The table of csv has the energy of each
    annulus and its standard error, against the annulus' outer edge r_mm (inf: beyond the grid),
    with every digit; `sssfit import` reads it back. It does not include specular reflectance,
    absorption and transmittance.

    \b
      sssfit export --format hlsl
      sssfit export skin1.cascade24.taps.json --format hlsl -o -
      sssfit export skin1.svd3.kernel.json --format json -o -
      sssfit export skin1.profile.npz --format csv -o - | head
    """
    from sssfit.export import is_ours, kernel_text
    from sssfit.formats.csv import csv_text, is_profile_csv
    from sssfit.kernel import read_kernel
    from sssfit.profile import Profile

    figures: dict[str, Any]
    if form == "csv":
        name = profile_name(file)
        profile = load(Profile.read, name)
        text = csv_text(profile)
        figures = {"profile": name, "channels": profile.channels, "annuli": profile.n_annuli}
    else:
        name = kernel_name(file)
        text, figures = kernel_text(load(read_kernel, name), form)
        figures = {"kernel": name, **figures}
    path = target(output, f"{stem_of(name)}.{form}")
    ours = is_profile_csv if form == "csv" else partial(is_ours, form=form)
    named = ({"hlsl": "shader source", "json": "a kernel", "csv": "a table"}[form], f".{form}")
    with held([path], ours, inputs=[name], force=force, named=named):
        write(text.encode(), path)
    what = "the table" if form == "csv" else "the kernel"
    finish_one(common, path, {"format": form, **figures}, "", what)
