"""``sssfit export``: kernels and profiles as files for other programs."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import click

from sssfit.methods import EXPORTS, PRESETS, lines_of

from ._input import kernel_name, load, profile_name
from ._options import Common, common_options, method_options, options, own_settings
from ._output import finish, finish_one, held, stem_of, target, write
from ._verb_options import EXPORT, EXPORT_OUTPUT


@click.command(
    epilog="\b\nFormats:\n" + lines_of(EXPORTS) + "\n\n\b\nPresets:\n" + lines_of(PRESETS),
    short_help="Write shader source, tables or an engine's parameters.",
)
@click.argument("files", nargs=-1)
@options(*EXPORT, method_options(EXPORTS), *EXPORT_OUTPUT)
@common_options
@click.pass_context
def export(
    context: click.Context, /, files: Any, form: str | None, common: Common, **given: Any
) -> None:
    """Export FILES for other programs, or the parameters that an engine asks for.

    A file is a .taps.json or .kernel.json file, for csv and lut a .profile.npz file too, or - for
    stdin; by default the newest in this folder. For a table of taps the source holds its constants
    and a function for each pass; for a separable kernel, the signs and weights of every term. A
    comment says how they are applied, and gives the material, fit, cost, energy and errors. Several
    tables with the same stages share one source, and an index says which. The csv of a profile has
    the energy of each annulus and its standard error, against the annulus' outer edge r_mm (inf:
    beyond the grid), with every digit; `sssfit import` reads it back. It has no specular
    reflectance, absorption and transmittance. lut writes linear floats; a PNG is scaled to its
    largest value. --preset takes a material, a profile or an engine's own taps, and NAME=VALUE
    options; see --list.

    \b
      sssfit export --format hlsl
      sssfit export skin1.cascade24.taps.json wax.cascade24.taps.json --format glsl -o sss.glsl
      sssfit export skin1.profile.npz --format lut --table line -o skin1.line.dds
      sssfit export skin1 --preset openpbr mm_per_unit=1000
    """
    from sssfit.export.presets import reports

    if given.pop("listing"):
        finish(common, {"presets": reports.presets_list()}, reports.list_text())
    elif (given["preset"] is None) == (form is None):
        raise click.UsageError("give --format or --preset, one of them; --list lists presets.")
    elif form is None:
        own_settings(context, EXPORTS, "--preset", given, "--format")
        _preset(files, given, common)
    else:
        _form(files, form, own_settings(context, EXPORTS, form, given, "--format"), given, common)


def _form(files: Any, form: str, settings: dict[str, Any], given: Any, common: Common) -> None:
    """Write kernels or a profile in a form."""
    from sssfit.export import exported, is_ours, read_exportable
    from sssfit.kernel import read_kernel
    from sssfit.stability.rules import warn_of_doubts

    read = read_exportable if EXPORTS[form].of_profiles else read_kernel
    names = files or (profile_name(None) if EXPORTS[form].of_profiles else kernel_name(None),)
    records = [load(read, each) for each in names]
    made = exported(records, form, ending=Path(given["output"] or "").suffix.lower(), **settings)
    files_of = {made.of: names[0]} if len(names) == 1 else {"kernels": list(names)}
    path = target(given["output"], stem_of(names[0]) + made.tag + made.ending)
    kind, ours = (made.what, made.ending), partial(is_ours, form=form)
    with held([path], ours, inputs=names, force=given["force"], named=kind):
        for each in records:
            warn_of_doubts(each, strict=given["strict"])
        write(made.content, path)
    finish_one(common, path, {"format": form} | files_of | made.figures, "", made.stdout)


def _preset(words: Any, given: Any, common: Common) -> None:
    """Write an engine's parameters."""
    from sssfit import kinds
    from sssfit.export.presets import preset_text, reports

    files, chosen = reports.words_of(words, most=1)
    loaded = load(kinds.load, files[0] if files else profile_name(None))
    found = reports.preset_of_any(given["preset"], loaded, chosen)
    path = target(given["output"], reports.text_name(found))
    with held([path], reports.is_preset_file, inputs=files, force=given["force"]):
        reports.warn_of(found, strict=given["strict"])
        write(preset_text(found).encode(), path)
    finish_one(common, path, found.to_dict(), reports.parameters_text(found), "the preset")
