"""``sssfit materials``: those that ship with sssfit, one in full, or a new one by reflectance."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from sssfit.methods import DEON_SKIN

from ._options import BaseColour, Common, Lengths, Number, common_options, flag, option, options
from ._output import finish, finish_one, held, target, write

# Heads the files we make: only a file that begins with it is replaced without --force.
_OURS = "# Made by `sssfit materials --from-reflectance`, which may replace this file;"


# fmt: off
_OPTIONS = (
    flag("--toml as_toml", "Print MATERIAL as TOML, to start your own."),
    option("--from-reflectance", BaseColour(), "A,B,...|HEX", "Make a material with this total "
           "diffuse reflectance per channel, such as 0.44,0.23,0.13 or 44%, or with an sRGB base "
           "colour, such as '#c58c6b'."),
    flag("--srgb", "A,B,... are 8-bit sRGB codes, such as 197,140,107."),
    option("--mean-free-path", Lengths(), "MM,MM,...", "Its mean free paths, 1 / (sigma_a + "
           "sigma_s), such as 3.67,1.37,0.68 or 0.4cm; one applies to all channels."),
    option("--eta", Number(), "N", "Its refractive index; 1.4 is that of skin.", 1.4),
    option("--light", ["diffuse", "normal"], None, "Incident light of A,B,... normal: a beam "
           "along the normal, as in profiles; diffuse: equal radiance from all directions above, "
           "as for base colours, with A,B,... as shares of the light that enters.  [default: "
           "diffuse for sRGB colours, else normal]"),
    option("--name", None, "NAME", "Its name.  [default: that of FILE]"),
    option("--channels", None, "A,B,...", "Names of its channels.  [default: R,G,B for three]"),
    option("-o --output", None, "FILE", "Output file, - for stdout.  [default: NAME.toml]"),
    flag("--force", "Replace a file that --from-reflectance did not make."),
)
# fmt: on


@click.command(short_help="List, show or make materials.")
@click.argument("material", required=False)
@options(*_OPTIONS)
@common_options
@click.pass_context
def materials(
    context: click.Context, /, material: str | None, as_toml: bool, common: Common, **given: Any
) -> None:
    """List the materials that ship with sssfit, show one in full, or make one.

    MATERIAL is one of their names, the path of a TOML file, or - for standard input.
    --from-reflectance inverts the exact solver: it finds the albedos that give this total diffuse
    reflectance under isotropic scattering, and prints the results of renderers' approximate
    inversions for comparison. A base colour in sRGB is decoded to linear light and inverted for
    diffuse light; give --light diffuse with a linear base colour.

    \b
      sssfit materials skin1                        coefficients, mean free paths, grid
      sssfit materials skin1 --toml > mine.toml     a file to edit into your own
      sssfit materials mine.toml                    check it
      sssfit materials --from-reflectance 0.44,0.23,0.13 --mean-free-path 1.3,0.95,0.67 \\
        --eta 1.3 -o mine.toml                      make one
      sssfit materials --from-reflectance '#c58c6b' --mean-free-path 0.37,0.14,0.07cm
    """
    from_reflectance = given.pop("from_reflectance")
    if from_reflectance is not None:
        if material is not None or as_toml:
            raise click.UsageError("--from-reflectance makes a material; name none with it.")
        _make(from_reflectance, common, given)
        return
    for key in given:
        if context.get_parameter_source(key) is ParameterSource.COMMANDLINE:
            raise click.UsageError(
                f"--{key.replace('_', '-')} is for --from-reflectance; leave it out."
            )
    if as_toml and (common.json or material is None):
        raise click.UsageError("--toml needs a MATERIAL and does not go with --json.")
    if as_toml and material == DEON_SKIN:
        raise click.UsageError(
            f"{material} has no coefficients to write as TOML; begin with another, such as skin1."
        )
    from sssfit.export import summary
    from sssfit.material import load_material

    if as_toml:
        # TOML is UTF-8 on every terminal: bytes.
        click.echo(load_material(str(material)).to_toml().encode(), nl=False)
        return
    if material is None:
        figures, page = summary.shipped_figures(), summary.shipped_page
    elif material == DEON_SKIN:
        figures, page = summary.deon_skin_figures(), summary.deon_skin_page
    else:
        figures = summary.material_figures(load_material(material))
        page = summary.material_page
    finish(common, figures, page(figures))


def _make(reflectance: list[float] | str, common: Common, given: dict[str, Any]) -> None:
    """Invert, write the TOML, and print what was found beside the published approximations."""
    from sssfit.files import has_mark
    from sssfit.process import check_memory

    check_memory("inversion", common.threads)
    if (paths_mm := given["mean_free_path"]) is None:
        raise click.UsageError("--from-reflectance needs --mean-free-path.")
    from sssfit.simulate import inversion

    asked, light = inversion.asked_for(reflectance, srgb=given["srgb"], light=given["light"])
    names = inversion.channel_names(given["channels"], asked)
    output = given["output"]
    name = given["name"] or ("from-reflectance" if output in (None, "", "-") else Path(output).stem)
    path = target(output, f"{name}.toml")
    is_ours = functools.partial(has_mark, marks={_OURS.encode(): b""})
    with held([path], is_ours, inputs=[], force=given["force"], named=("a material", ".toml")):
        how: dict[str, Any] = {"name": name, "channels": names, "light": light}
        material = inversion.material_from_reflectance(asked, paths_mm, given["eta"], **how)
        figures = inversion.inversion_figures(material, asked, light)
        write(f"{_OURS} delete this line to keep it.\n{material.to_toml()}".encode(), path)
    finish_one(common, path, figures, inversion.summary(figures), "the material")
