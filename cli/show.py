"""``sssfit show``: what a file of ours holds, in figures; a profile's are here."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from sssfit.messages import columns, table

from ._input import load_any, profile_name
from ._options import Common, common_options
from ._output import finish

if TYPE_CHECKING:
    from sssfit.kinds import Loaded

_SHARES = (0.5, 0.9, 0.99)


@click.command()
@click.argument("file", required=False)
@common_options
def show(file: str | None, common: Common) -> None:
    """Print what FILE holds: a profile, a kernel, a material or the checkpoint of a walk.

    FILE is any of these, under any name, or - for stdin; by default the newest .profile.npz of
    this folder.

    \b
      sssfit show skin1.profile.npz              provenance, grid, energies, standard errors
      sssfit show skin1.svd3.kernel.json         pixels, energies, errors, terms
      sssfit show mine.toml                      coefficients, mean free paths
      sssfit show skin1.profile.npz.checkpoint   the profile so far
      sssfit simulate skin1 -o - | sssfit show - --json
    """
    name = profile_name(file, common)
    figures, text = _shown(load_any(name), name)
    finish(common, {"command": "show", "output": [], "file": name, **figures}, text)


def _shown(found: Loaded, name: str) -> tuple[dict[str, Any], str]:
    """Return the figures of what was found, and the page for people."""
    from sssfit.kernel import SeparableKernel
    from sssfit.material import Material
    from sssfit.profile import Profile

    if isinstance(found, Profile):
        figures = found.to_dict()
        return figures, f"{name}: diffuse reflectance profile ({figures['format']})\n" + _text(
            figures
        )
    if isinstance(found, SeparableKernel):
        from ._show_kernel import kernel_text

        figures = found.figures()
        return figures, f"{name}: separable kernel ({figures['format']})\n" + kernel_text(figures)
    if isinstance(found, Material):
        from .materials import material_figures, material_text

        return {"kind": "material", **material_figures(found)}, material_text(found)
    figures = found.to_dict()
    return figures, f"{name}: checkpoint of a photon walk\n" + _checkpoint_text(figures)


def _checkpoint_text(figures: dict[str, Any]) -> str:
    """Write the same for people: the walk, then the page of each profile."""
    return "\n".join(
        [
            f"so far    {figures['photons']:,} photons, {figures['flights']:,} flights, "
            f"{figures['seconds']:.1f} s; --resume continues from there",
            f"error     {100.0 * figures['relative_error']:.3g} % of F(r), in the worst channel",
            *(f"\n{_text(each)}" for each in figures["profiles"]),
        ]
    )


def _text(figures: dict[str, Any]) -> str:
    """All of it for people."""
    parts = [_head(figures), _coefficients(figures), _energies(figures), _radii(figures)]
    parts.append(
        f"specular reflectance {figures['specular_reflectance']:.6f}, not part of diffuse R; "
        "sum = specular + diffuse + absorbed + unfinished"
        + ("" if figures["transmitted"] is None else " + transmitted")
    )
    if figures["empty_annuli"] is not None and any(figures["empty_annuli"]):
        parts.append(
            "empty: annuli in which nothing was seen; their standard error of 0 says that, and not "
            "that R_d is 0 there."
        )
    return "\n".join(filter(None, parts))


def _head(figures: dict[str, Any]) -> str:
    """Provenance and grid."""
    material, photons = figures["material"], figures["photons"]
    name = material["name"] if material else "unknown material"
    source = f" ({material['source']})" if material and material["source"] else ""
    walks = "no photons" if photons is None else f"{photons:,} photons, seed {figures['seed']}"
    width = f"{figures['dr_mm']:.4g} mm" if figures["uniform"] else "varying width"
    return (
        f"material  {name}{source}\n"
        f"method    {figures['method'] or 'unknown'}, {walks}, "
        f"sssfit {figures['version'] or 'version unknown'}\n"
        f"grid      {figures['annuli']} annuli of {width}, to {figures['radius_mm']:.4g} mm"
    )


def _coefficients(figures: dict[str, Any]) -> str:
    """One line a layer and channel; nothing where the material is unknown."""
    material = figures["material"]
    if material is None or not material["layers"]:
        return ""
    rows = [
        (
            f"{k + 1} {name}" if len(material["layers"]) > 1 else name,
            f"{layer['eta']:g}",
            f"{layer['g'][c]:g}",
            f"{layer['sigma_a_per_mm'][c]:.5g}",
            f"{layer['sigma_s_per_mm'][c]:.5g}",
            f"{material['albedo'][k][c]:.5f}",
            f"{material['mean_free_path_mm'][k][c]:.4f}",
            "infinite" if layer["thickness_mm"] is None else f"{layer['thickness_mm']:g}",
        )
        for k, layer in enumerate(material["layers"])
        for c, name in enumerate(material["channels"])
    ]
    head = ("channel", "eta", "g", "sigma_a, 1/mm", "sigma_s, 1/mm", "albedo", "MFP, mm")
    return "\n" + table((*head, "thickness, mm"), rows)


def _energies(figures: dict[str, Any]) -> str:
    """Where each channel's light went."""
    diffuse, beyond = figures["diffuse_reflectance"], figures["beyond_grid"]
    shares = [b / d if d > 0 else None for b, d in zip(beyond, diffuse, strict=True)]
    names = figures["channels"]
    return "\n" + columns(
        "channel",
        names,
        ("diffuse R", diffuse, ".6f"),
        ("+- stderr", figures["diffuse_reflectance_stderr"], ".1e"),
        ("beyond grid", beyond, ".2e"),
        ("of diffuse", [None if each is None else f"{100.0 * each:.3f} %" for each in shares], ""),
        ("absorbed", figures["absorbed"] or [None] * len(names), ".6f"),
        ("transmitted", figures["transmitted"], ".6f"),
        ("unfinished", figures["unfinished"], ".1e"),
        ("sum - 1", [_balance(figures, c) for c in range(len(names))], ""),
    )


def _balance(figures: dict[str, Any], channel: int) -> str:
    """Sum of all energies - 1, with the standard error where the run gave one."""
    if figures["absorbed"] is None:
        return "-"
    balance = f"{figures['energy_balance'][channel]:+.0e}"
    stderr = figures["energy_balance_stderr"]
    return balance if stderr is None else f"{balance} +- {stderr[channel]:.0e}"


def _radii(figures: dict[str, Any]) -> str:
    """How far the light on the grid spreads."""
    within = [(100 * share, figures[f"radius_of_{100 * share:g}_percent_mm"]) for share in _SHARES]
    shown = [(f"{percent:g} % within, mm", radii, ".4f") for percent, radii in within]
    empty = ("empty", figures["empty_annuli"], "")
    return f"\n{columns('channel', figures['channels'], *shown, empty)}\n"
