"""``sssfit import``: a profile from another program's file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from sssfit.methods import PRESETS

from ._input import binary_stdin
from ._options import Common, common_options, option, options, output, refuse
from ._output import PROFILE, finish_one, held, target, write

_UNITS = ("um", "mm", "cm", "m")

# fmt: off
_OPTIONS = (
    option("--quantity", ["density", "energy"], None, "Meaning of the numbers of a CSV.  [default: "
           "from its own comment]"),
    option("--unit", _UNITS, None, "Unit of a CSV's column r; r_um, r_mm, r_cm and r_m include "
           "it."),
    option("--density-unit", _UNITS, None, "A CSV's densities are per square of this unit.  "
           "[default: the unit of its radii]"),
    option("--channels", None, "A,B,...", "Names for several .mco, in their order.  [default: "
           "R,G,B for three]"),
    option("--preset", list(PRESETS), None, "FILE... are an engine's own parameters, NAME=VALUE."),
    *output("NAME.profile.npz; of some presets .toml or .taps.json", "is not our profile"),
)
# fmt: on


@click.command("import", short_help="Convert a table or MCML output to a profile.")
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
@options(*_OPTIONS)
@common_options
def import_(files: tuple[str, ...], common: Common, **given: Any) -> None:
    """Convert FILE to a profile: a table (CSV) or MCML output (.mco, ASCII); - for stdin.

    A CSV has a header with r_mm (radii in mm, of any spacing) and one column per channel; r_um,
    r_cm and r_m are converted. X_stderr holds standard errors of X, and lines that begin with # are
    comments.

    \b
      density: R_d per square of the radius' unit (1/mm^2 beside r_mm, 1/cm^2 beside
               r_cm) at that radius; annuli meet half-way between radii
      energy:  share of the light that leaves in the annulus whose OUTER edge is the
               radius; a last line with radius inf holds the energy beyond

    An .mco file of MCML 1 or one of its GPU ports has one channel, in cm, without standard errors;
    several on the same grid become the channels of one profile. Their last bin, to which MCML adds
    all light beyond, becomes the energy beyond the grid.

    \b
      sssfit import profile.csv --quantity density
      sssfit import measured.csv --quantity density --unit mm --density-unit cm
      sssfit import r.mco g.mco b.mco --channels R,G,B -o skin.profile.npz
      sssfit import --preset hdrp scatteringDistance=0.35,0.2,0.1 baseColor=0.8,0.5,0.4
    """
    output, force = given.pop("output"), given.pop("force")
    if preset := given.pop("preset"):
        refuse(given, dict.fromkeys(given, "files, and a preset has none"))
        _preset(preset, files, output, force, common)
        return
    from sssfit.formats.profiles import import_profile, imported_figures, imported_page
    from sssfit.profile import is_profile_file

    if len(files) > 1 and output is None:
        raise click.UsageError("name the profile of several files with -o.")
    sources: list[Any] = [binary_stdin() if name == "-" else name for name in files]
    names = given["channels"] and [name.strip() for name in given["channels"].split(",")]
    profile = import_profile(sources, **given | {"channels": names})
    stem = "stdin" if files[0] == "-" else Path(files[0]).stem
    path = target(output, f"{stem}.profile.npz")
    with held([path], is_profile_file, inputs=files, force=force, named=PROFILE):
        write(profile.write, path)
    figures = imported_figures(profile)
    finish_one(common, path, figures, imported_page(figures), "the profile")


def _preset(name: str, words: Any, output: str | None, force: bool, common: Common) -> None:
    """Write the material or the profile that an engine's parameters describe."""
    from sssfit.export.presets import reports
    from sssfit.export.summary import figures_of, summary

    title = name if output in (None, "-") else Path(output or "").name.split(".")[0]
    record = reports.imported_as(name, reports.words_of(words, most=0)[1], title, output or "")
    ending, ours = reports.kind_of(record)
    path = target(output, f"{title}{ending}")
    with held([path], ours, inputs=[], force=force):
        write(reports.stored(record), path)
    finish_one(common, path, figures_of(record), summary(figures_of(record)), "what was imported")
