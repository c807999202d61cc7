"""``sssfit export``: kernels and profiles as files for other programs."""

from __future__ import annotations

from functools import partial
from typing import Any

import click

from sssfit.methods import EXPORTS, lines_of

from ._input import kernel_name, load, profile_name
from ._options import Common, common_options, method_options, options, own_settings
from ._output import finish_one, held, stem_of, target, write
from ._verb_options import EXPORT, EXPORT_OUTPUT


@click.command(epilog="\b\nFormats:\n" + lines_of(EXPORTS))
@click.argument("files", nargs=-1)
@options(*EXPORT, method_options(EXPORTS), *EXPORT_OUTPUT)
@common_options
@click.pass_context
def export(context: click.Context, /, files: Any, form: str, common: Common, **given: Any) -> None:
    """Export FILES for other programs.

    A file is a .taps.json or .kernel.json file, for csv a .profile.npz file, or - for stdin; by
    default the newest in this folder. Source holds a table's constants and its passes, a function
    each, or the signs and weights of every separable term, and a comment that says how they are
    applied, with material, fit, cost, energy and errors. Several tables with the same stages share
    one source, and an index says which. The table of csv has the energy of each annulus and its
    standard error, against the annulus' outer edge r_mm (inf: beyond the grid), with every digit;
    `sssfit import` reads it back. It has no specular reflectance, absorption and transmittance.

    \b
      sssfit export --format hlsl
      sssfit export skin1.cascade24.taps.json wax.cascade24.taps.json --format glsl -o sss.glsl
      sssfit export skin1.profile.npz --format csv -o - | head
    """
    from sssfit.export import is_ours, kernel_text
    from sssfit.formats.csv import csv_text, is_profile_csv
    from sssfit.kernel import read_kernel
    from sssfit.profile import Profile

    settings = own_settings(context, EXPORTS, form, given, "--format")
    if len(files) > 1 and form in ("csv", "json"):
        raise click.UsageError(f"--format {form} takes one file, and {len(files)} are named.")
    if form == "csv":
        names = files or [profile_name(None)]
        text = csv_text(profile := load(Profile.read, names[0]))
        figures: dict[str, Any] = {"channels": profile.channels, "annuli": profile.n_annuli}
    else:
        names = files or [kernel_name(None)]
        text, figures = kernel_text([load(read_kernel, each) for each in names], form, **settings)
    what = "profile" if form == "csv" else "kernel"
    figures = ({what: names[0]} if len(names) == 1 else {"kernels": names}) | figures
    path = target(given["output"], f"{stem_of(names[0])}.{form}")
    ours = is_profile_csv if form == "csv" else partial(is_ours, form=form)
    kind = {"json": "a kernel", "csv": "a table"}.get(form, "source")
    with held([path], ours, inputs=names, force=given["force"], named=(kind, f".{form}")):
        write(text.encode(), path)
    finish_one(common, path, {"format": form, **figures}, "", kind.replace("a ", "the "))
