"""``sssfit show``: what a file of ours holds, in figures."""

from __future__ import annotations

import click

from ._input import load, profile_name
from ._options import Common, common_options
from ._output import finish

_TITLES = {
    "profile": "{name}: diffuse reflectance profile ({format})\n",
    "kernel": "{name}: separable kernel ({format})\n",
    "taps": "{name}: table of taps ({format})\n",
    "material": "",
    "checkpoint": "{name}: checkpoint of a photon walk\n",
}


@click.command(short_help="Print what a file holds.")
@click.argument("file", required=False)
@common_options
def show(file: str | None, common: Common) -> None:
    """Print what FILE holds: a profile, kernel, table of taps, material or checkpoint of a walk.

    FILE is any of these, under any name, or - for stdin; by default the newest .profile.npz in this
    folder.

    \b
      sssfit show skin1.profile.npz              provenance, grid, energies, standard errors
      sssfit show skin1.svd3.kernel.json         pixels, energies, errors, terms
      sssfit show mine.toml                      coefficients, mean free paths
      sssfit show skin1.profile.npz.checkpoint   the profile so far
      sssfit simulate skin1 -o - | sssfit show - --json
    """
    name = profile_name(file)
    from sssfit import kinds
    from sssfit.export.summary import figures_of, summary

    figures = figures_of(load(kinds.load, name))
    title = _TITLES[figures["kind"]].format_map({"name": name, "format": figures.get("format")})
    finish(common, {"file": name, **figures}, title + summary(figures))
