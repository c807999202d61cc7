"""``sssfit materials``: those that ship with sssfit, one in full, or a new one by reflectance."""

from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from sssfit.messages import table

from ._deon_skin import DEON_SKIN, show_deon_skin
from ._invert import InversionRequest, write_material
from ._options import BaseColour, Common, Lengths, Number, common_options
from ._output import finish

if TYPE_CHECKING:
    from collections.abc import Iterable

    from sssfit.grid import RadialGrid
    from sssfit.material import Layer, Material


@click.command()
@click.argument("material", required=False)
@click.option("--toml", "as_toml", is_flag=True, help="Print MATERIAL as TOML, to start your own.")
@click.option(
    "--from-reflectance",
    type=BaseColour(),
    metavar="A,B,...|HEX",
    help="Make a material of this total diffuse reflectance, per channel, such as 0.44,0.23,0.13 "
    "or 44%, or of an sRGB base colour, such as '#c58c6b'.",
)
@click.option(
    "--srgb",
    is_flag=True,
    help="A,B,... are 8-bit sRGB codes, such as 197,140,107.",
)
@click.option(
    "--mean-free-path",
    type=Lengths(),
    metavar="MM,MM,...",
    help="Its mean free paths, 1 / (sigma_a + sigma_s), such as 3.67,1.37,0.68 or 0.4cm; one "
    "serves all channels.",
)
@click.option(
    "--eta",
    type=Number(),
    default=1.4,
    show_default=True,
    metavar="N",
    help="Its refractive index; 1.4 is that of skin.",
)
@click.option(
    "--light",
    type=click.Choice(["diffuse", "normal"]),
    help="The light that A,B,... are meant for. normal: a beam along the normal, as in profiles; "
    "diffuse: the same radiance from everywhere above, as base colours mean it, and shares of the "
    "light that enters.  [default: diffuse for sRGB colours, else normal]",
)
@click.option("--name", metavar="NAME", help="Its name.  [default: that of FILE]")
@click.option(
    "--channels", metavar="A,B,...", help="Names of its channels.  [default: R,G,B for three]"
)
@click.option(
    "-o", "--output", metavar="FILE", help="Where it goes, - for stdout.  [default: NAME.toml]"
)
@click.option("--force", is_flag=True, help="Replace a file that --from-reflectance did not make.")
@common_options
@click.pass_context
def materials(
    context: click.Context,
    /,
    material: str | None,
    as_toml: bool,
    from_reflectance: list[float] | str | None,
    common: Common,
    **request: Any,
) -> None:
    """List the materials that ship with sssfit, show one in full, or make one.

    MATERIAL is one of their names, the path of a TOML file, or - for standard input.
    --from-reflectance inverts the exact solver: it finds the albedos, for isotropic scattering,
    that have this total diffuse reflectance, and prints what the approximate inversions of
    renderers give. A base colour in sRGB is decoded to linear light and inverted for diffuse light;
    give --light diffuse with a linear base colour.

    \b
      sssfit materials skin1                        coefficients, mean free paths, grid
      sssfit materials skin1 --toml > mine.toml     a file to edit into your own
      sssfit materials mine.toml                    check it
      sssfit materials --from-reflectance 0.44,0.23,0.13 --mean-free-path 1.3,0.95,0.67 \\
        --eta 1.3 -o mine.toml                      make one
      sssfit materials --from-reflectance '#c58c6b' --mean-free-path 0.37,0.14,0.07cm
    """
    if from_reflectance is not None:
        if material is not None or as_toml:
            raise click.UsageError("--from-reflectance makes a material; name none with it.")
        write_material(InversionRequest(from_reflectance, **request), common)
        return
    for key in request:
        if context.get_parameter_source(key) is ParameterSource.COMMANDLINE:
            raise click.UsageError(
                f"--{key.replace('_', '-')} is for --from-reflectance; leave it out."
            )
    if as_toml and (common.json or material is None):
        raise click.UsageError("--toml needs a MATERIAL and does not go with --json.")
    if material is None:
        _list(common)
    elif material == DEON_SKIN:
        show_deon_skin(common, as_toml=as_toml)
    elif as_toml:
        from sssfit.material import load_material

        # TOML is UTF-8 on every terminal: bytes.
        click.echo(load_material(material).to_toml().encode(), nl=False)
    else:
        _show(common, material)


def _list(common: Common) -> None:
    """Print one row per shipped material."""
    from sssfit.material import load_material, material_names

    rows = [_figures(load_material(name)) for name in material_names()]
    head = (
        "name",
        "eta",
        "albedo R G B",
        "mean free path R G B, mm",
        "dr, mm",
        "annuli",
        "radius, mm",
    )
    cells = [
        (
            row["name"],
            f"{row['eta']:g}",
            " ".join(f"{each:.5f}" for each in row["albedo"]),
            " ".join(f"{each:.4f}" for each in row["mean_free_path_mm"]),
            f"{row['dr_mm']:.5f}",
            f"{row['annuli']}",
            f"{row['radius_mm']:.2f}",
        )
        for row in rows
    ]
    figures = {"command": "materials", "output": [], "rows": rows, "profiles": [DEON_SKIN]}
    uses = "a profile without coefficients, for simulate, compare and choose"
    text = f"{table(head, cells)}\n\n{DEON_SKIN}: {uses}"
    finish(common, figures, text)


def _show(common: Common, name_or_path: str) -> None:
    """Print one material in full."""
    from sssfit.material import load_material

    material = load_material(name_or_path)
    figures = {"command": "materials", "output": [], **material_figures(material)}
    finish(common, figures, material_text(material))


def material_figures(material: "Material") -> dict[str, Any]:
    """Everything that is printed of one material, as ``--json`` has it."""
    return {**_figures(material), **_content(material)}


def _figures(material: "Material") -> dict[str, Any]:
    """Return the figures of a row; those of one layer are null for a stack."""
    one = material.layers[0] if len(material.layers) == 1 else None
    grid = _grid(material)
    return {
        "name": material.name,
        "source": material.source,
        "channels": material.channels,
        "eta": one and one.eta,
        "albedo": one and one.albedo,
        "mean_free_path_mm": one and one.mean_free_path_mm,
        "dr_mm": grid and grid.dr_mm,
        "annuli": grid and grid.annuli,
        "radius_mm": grid and grid.radius_mm,
    }


def _content(material: "Material") -> dict[str, Any]:
    """Return what a row leaves out: coefficients, per layer and, for one layer, on their own."""
    layers = [
        layer.to_dict() | {"albedo": layer.albedo, "mean_free_path_mm": layer.mean_free_path_mm}
        for layer in material.layers
    ]
    keys = ("g", "sigma_a_per_mm", "sigma_s_per_mm", "thickness_mm")
    return {
        **{key: layers[0][key] if len(layers) == 1 else None for key in keys},
        "eta_above": material.eta_above,
        "eta_below": material.eta_below,
        "specular_reflectance": material.specular_reflectance,
        "layers": layers,
        "sha256": material.sha256,
    }


def _grid(material: "Material") -> "RadialGrid | None":
    """Return the paper's grid, or None where that would have too many annuli."""
    from sssfit.errors import SimulationError
    from sssfit.grid import paper_grid

    try:
        return paper_grid(material)
    except SimulationError:
        return None


def material_text(material: "Material") -> str:
    """Return the page a person reads."""
    from sssfit.messages import printable

    grid = _grid(material)
    lines = [
        f"name                  {material.name}",
        f"source                {printable(material.source) or 'not given'}",
        f"specular reflectance  {material.specular_reflectance:.5f}",
        "paper's grid          "
        + (
            f"dr {grid.dr_mm:.6g} mm, {grid.annuli} annuli, radius {grid.radius_mm:.6g} mm"
            if grid
            else "none: too many annuli, give simulate a --dr or --radius"
        ),
        f"sha256                {material.sha256}",
    ]
    several = len(material.layers) > 1
    if material.eta_above != 1:
        lines += ["", f"above: eta {material.eta_above:g}"]
    for number, layer in enumerate(material.layers, 1):
        lines += ["", _layer_heading(layer, number if several else None)]
        lines.append(_layer_table(layer, material.channels))
    if any(layer.g.any() for layer in material.layers):
        lines.append("mean free path: the reduced one, 1 / (sigma_a + (1 - g) sigma_s)")
    if material.eta_below != 1:
        lines += ["", f"below: eta {material.eta_below:g}"]
    return "\n".join(lines)


def _layer_heading(layer: "Layer", number: int | None) -> str:
    thickness = layer.to_dict()["thickness_mm"]
    return (
        (f"layer {number}: " if number else "")
        + ("semi-infinite" if thickness is None else f"{thickness:g} mm thick")
        + f", eta {layer.eta:g}"
        + (", clear" if layer.is_clear else "")
    )


def _layer_table(layer: "Layer", channels: "Iterable[str]") -> str:
    """Return the coefficients of a layer, a row a channel."""
    head = ("channel", "sigma_a, 1/mm", "sigma_s, 1/mm", "g", "albedo", "mean free path, mm")
    columns = (
        layer.sigma_a_per_mm,
        layer.sigma_s_per_mm,
        layer.g,
        layer.albedo,
        layer.mean_free_path_mm,
    )
    rows = [
        (channel, *(f"{value:.6g}" for value in values))
        for channel, *values in zip(channels, *columns, strict=True)
    ]
    return table(head, rows)
