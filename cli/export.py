"""``sssfit export``: kernels and profiles as files for other programs."""

from __future__ import annotations

from functools import partial
from pathlib import Path
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

    A file is a .taps.json or .kernel.json file, for csv and lut a .profile.npz file too, or - for
    stdin; by default the newest in this folder. Source holds a table's constants and its passes, a
    function each, or the signs and weights of every separable term, and a comment that says how
    they are applied, with material, fit, cost, energy and errors. Several tables with the same
    stages share one source, and an index says which. The csv of a profile has the energy of each
    annulus and its standard error, against the annulus' outer edge r_mm (inf: beyond the grid),
    with every digit; `sssfit import` reads it back. It has no specular reflectance, absorption and
    transmittance. Textures of lut are linear floats; a PNG shows them over their largest value.

    \b
      sssfit export --format hlsl
      sssfit export skin1.cascade24.taps.json wax.cascade24.taps.json --format glsl -o sss.glsl
      sssfit export skin1.profile.npz --format csv -o - | head
      sssfit export skin1.profile.npz --format lut --table line -o skin1.line.dds
    """
    from sssfit.export import exported, is_ours, read_exportable
    from sssfit.kernel import read_kernel
    from sssfit.stability.rules import warn_of_doubts

    settings = own_settings(context, EXPORTS, form, given, "--format")
    read = read_exportable if EXPORTS[form].of_profiles else read_kernel
    names = files or [profile_name(None) if EXPORTS[form].of_profiles else kernel_name(None)]
    records = [load(read, each) for each in names]
    made = exported(records, form, ending=Path(given["output"] or "").suffix.lower(), **settings)
    files_of = {made.of: names[0]} if len(names) == 1 else {"kernels": names}
    path = target(given["output"], stem_of(names[0]) + made.tag + made.ending)
    kind, ours = (made.what, made.ending), partial(is_ours, form=form)
    with held([path], ours, inputs=names, force=given["force"], named=kind):
        for each in records:
            warn_of_doubts(each, strict=given["strict"])
        write(made.content, path)
    finish_one(common, path, {"format": form} | files_of | made.figures, "", made.stdout)
