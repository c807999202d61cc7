"""``sssfit import``: a profile from another program's file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sssfit.messages import columns

from ._input import binary_stdin, is_mci
from ._options import Common, common_options
from ._output import PROFILE, finish_one, held, target, write

if TYPE_CHECKING:
    from sssfit.profile import Profile
    from sssfit.text import Text

_DEFAULT_CHANNELS = {1: "mono", 3: "R,G,B"}
_UNITS = ("um", "mm", "cm", "m")
_FIGURES = (
    *("method", "channels", "annuli", "radius_mm", "diffuse_reflectance"),
    *("diffuse_reflectance_stderr", "specular_reflectance", "beyond_grid", "transmittance"),
    *("energy_balance", "photons"),
)
_OF_TABLES = {"quantity": "--quantity", "unit": "--unit", "density_unit": "--density-unit"}


@click.command("import")
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
@click.option(
    "--quantity",
    type=click.Choice(["density", "energy"]),
    help="What the numbers of a CSV are.  [default: what its own comment says]",
)
@click.option(
    "--unit",
    type=click.Choice(_UNITS),
    help="Unit of a CSV's column r; r_um, r_mm, r_cm and r_m say theirs.",
)
@click.option(
    "--density-unit",
    type=click.Choice(_UNITS),
    help="A CSV's densities are per square of this unit.  [default: the unit of its radii]",
)
@click.option(
    "--channels",
    metavar="A,B,...",
    help="Names for several .mco, in their order.  [default: R,G,B for three]",
)
@click.option(
    "-o",
    "--output",
    metavar="FILE",
    help="Where the profile goes, - for stdout.  [default: NAME.profile.npz]",
)
@click.option("--force", is_flag=True, help="Replace an input, or a file that is not our profile.")
@common_options
def import_(
    files: tuple[str, ...],
    channels: str | None,
    output: str | None,
    force: bool,
    common: Common,
    **of_table: str | None,
) -> None:
    """Make a profile of FILE: a table (CSV), or what MCML wrote (.mco, ASCII); - for stdin.

    A CSV has a header with r_mm (radii in mm, of any spacing) and one column a channel; r_um, r_cm
    and r_m are read as well and converted. X_stderr holds standard errors of X, and lines that
    begin with # are comments.

    \b
      density: R_d per square of the radius' unit (1/mm^2 beside r_mm, 1/cm^2 beside
               r_cm) at that radius; annuli meet half-way between radii
      energy:  share of the light that leaves in the annulus whose OUTER edge is the
               radius; a last line with radius inf is what leaves beyond

    An .mco is one channel, in cm, without standard errors, as MCML 1 and its ports to GPUs write
    it; several of one grid become the channels of one profile. Their last bin, where MCML counts
    all beyond, becomes the energy beyond the grid.

    \b
      sssfit import profile.csv --quantity density
      sssfit import measured.csv --quantity density --unit mm --density-unit cm
      sssfit import skin.mco -o skin.profile.npz
      sssfit import r.mco g.mco b.mco --channels R,G,B -o skin.profile.npz
    """
    from sssfit.profile import is_profile_file

    if len(files) > 1 and output is None:
        raise click.UsageError("name the profile of several files with -o.")
    profile = _read(files, of_table, channels)
    stem = "stdin" if files[0] == "-" else Path(files[0]).stem
    path = target(output, f"{stem}.profile.npz")
    with held([path], is_profile_file, inputs=files, force=force, named=PROFILE):
        write(profile, path)
    figures = _figures(profile)
    finish_one(common, "import", path, figures, _text(figures), "the profile")


def _read(files: tuple[str, ...], of_table: dict[str, str | None], channels: str | None) -> Profile:
    """Tell the formats apart by what the files hold, and read them."""
    from sssfit.errors import ProfileError
    from sssfit.formats.csv import parse_csv
    from sssfit.formats.mco import is_mco, join_channels, parse_mco

    origins = ["stdin" if name == "-" else name for name in files]
    texts = [_text_of(name, origin) for name, origin in zip(files, origins, strict=True)]
    tables = [each for each, text in zip(origins, texts, strict=True) if not is_mco(text.content)]
    if not tables:
        if given := [option for key, option in _OF_TABLES.items() if of_table[key] is not None]:
            raise click.UsageError(f"{given[0]} is for a CSV; an .mco says itself what it holds.")
        profiles = []
        for text, origin in zip(texts, origins, strict=True):
            with text.hinting(ProfileError) as content:
                profiles.append(parse_mco(content, origin))
        return join_channels(profiles, _names(len(files), channels))
    if len(files) > 1:
        raise ProfileError(f"{tables[0]} is no .mco; a CSV is imported alone, with all channels.")
    if channels is not None:
        raise click.UsageError("--channels is for .mco files; a CSV has names in its header.")
    with texts[0].hinting(ProfileError) as content:
        return parse_csv(content, origins[0], **of_table)


def _text_of(name: str, origin: str) -> Text:
    """Read a file that may be a table or MCML's output."""
    from sssfit.errors import ProfileError
    from sssfit.text import read_text

    if is_mci(name):
        raise ProfileError(
            f"{name} is an MCML input file; `sssfit simulate` walks what it describes."
        )
    source = binary_stdin() if name == "-" else name
    expected = "a CSV or MCML's output in ASCII"
    return read_text(source, origin, expected=expected, error=ProfileError)


def _names(count: int, channels: str | None) -> list[str]:
    """Names of the channels of so many .mco files."""
    given = _DEFAULT_CHANNELS.get(count) if channels is None else channels
    if given is None:
        raise click.UsageError(f"give --channels with {count} names, one for each .mco.")
    return [name.strip() for name in given.split(",")]


def _figures(profile: Profile) -> dict[str, Any]:
    """Figures of the profile, as ``--json`` prints them; null where the files do not say."""
    figures, material = profile.to_dict(), profile.meta["material"]
    return {
        "source": profile.meta["source"],
        "material": material and material["name"],
        **{key: figures[{"transmittance": "transmitted"}.get(key, key)] for key in _FIGURES},
    }


def _text(figures: dict[str, Any]) -> str:
    """Write the same for people: one line a channel."""
    return (
        f"{figures['source']}: {figures['annuli']} annuli, to {figures['radius_mm']:.4g} mm\n"
    ) + columns(
        "channel",
        figures["channels"],
        ("diffuse reflectance", figures["diffuse_reflectance"], ".6f"),
        ("std. error", figures["diffuse_reflectance_stderr"], ".6f"),
        ("beyond grid", figures["beyond_grid"], ".6f"),
        ("transmittance", figures["transmittance"], ".6f"),
    )
