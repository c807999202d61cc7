"""``sssfit show``: what a file of ours holds, in figures; a profile's are here."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from ._options import Common, common_options
from ._report import finish, newest, table

if TYPE_CHECKING:
    from sssfit.material import Material
    from sssfit.profile import Profile
    from sssfit.simulate import SoFar

    from ._any_file import Found

_SHARES = (0.5, 0.9, 0.99)


@click.command()
@click.argument("file", required=False)
@common_options
def show(file: str | None, common: Common) -> None:
    """Print what FILE holds: a profile, a kernel, a material or the checkpoint of a walk.

    FILE is any of these, whatever its name, or - for stdin; by default the newest .profile.npz of
    this folder.

    \b
      sssfit show skin1.profile.npz              provenance, grid, energies, standard errors
      sssfit show skin1.svd3.kernel.json         pixels, energies, errors, terms
      sssfit show mine.toml                      coefficients, mean free paths
      sssfit show skin1.profile.npz.checkpoint   the profile so far
      sssfit simulate skin1 -o - | sssfit show - --json
    """
    from ._any_file import read_any

    name = file or str(newest(common, "*.profile.npz", "sssfit simulate skin1"))
    figures, text = _shown(read_any(name), name)
    finish(common, {"command": "show", "output": [], "file": name, **figures}, text)


def _shown(found: Found, name: str) -> tuple[dict[str, Any], str]:
    """Return the figures of what was found, and the page for people."""
    from sssfit.kernel import SeparableKernel
    from sssfit.material import Material
    from sssfit.profile import Profile

    if isinstance(found, Profile):
        figures = _figures(found)
        return figures, f"{name}: diffuse reflectance profile ({figures['format']})\n" + _text(
            figures
        )
    if isinstance(found, SeparableKernel):
        from ._show_kernel import kernel_figures, kernel_text

        figures = kernel_figures(found)
        return figures, f"{name}: separable kernel ({figures['format']})\n" + kernel_text(figures)
    if isinstance(found, Material):
        from .materials import material_figures, material_text

        return {"kind": "material", **material_figures(found)}, material_text(found)
    figures = _checkpoint_figures(found)
    return figures, f"{name}: checkpoint of a photon walk\n" + _checkpoint_text(figures)


def _checkpoint_figures(found: SoFar) -> dict[str, Any]:
    """Where the walk stands, and the figures of its profiles so far."""
    profiles = [_figures(each) for each in found.profiles]
    return {
        "kind": "checkpoint",
        "photons": found.profiles[0].photons,
        "flights": found.flights,
        "seconds": found.seconds,
        "relative_error": found.relative_error,
        "profiles": profiles,
    }


def _checkpoint_text(figures: dict[str, Any]) -> str:
    """Write the same for people: the walk, then the page of each profile."""
    return "\n".join(
        [
            f"so far    {figures['photons']:,} photons, {figures['flights']:,} flights, "
            f"{figures['seconds']:.1f} s; --resume goes on from there",
            f"error     {100.0 * figures['relative_error']:.3g} % of F(r), in the worst channel",
            *(f"\n{_text(each)}" for each in figures["profiles"]),
        ]
    )


def _figures(profile: Profile) -> dict[str, Any]:
    """Everything that is printed, as ``--json`` has it; null where a profile does not say."""
    from sssfit.profile.bins import energy_radii_mm

    meta = profile.meta
    radii_mm = energy_radii_mm(profile, _SHARES)
    return {
        "kind": "profile",
        "format": meta["format"],
        "material": _material_figures(profile),
        "method": meta.get("method"),
        "channels": list(profile.channels),
        "photons": profile.photons,
        "seed": meta.get("seed"),
        "version": meta.get("version"),
        "annuli": profile.n_annuli,
        "dr_mm": float(profile.r_edges_mm[1]),
        "uniform": _is_uniform(profile),
        "radius_mm": float(profile.r_edges_mm[-1]),
        "diffuse_reflectance": profile.diffuse_reflectance,
        "diffuse_reflectance_stderr": profile.diffuse_reflectance_stderr,
        "specular_reflectance": profile.specular_reflectance,
        "beyond_grid": profile.beyond_grid,
        "absorbed": profile.absorbed.sum(axis=0) if len(profile.absorbed) else None,
        "transmitted": profile.transmittance,
        "unfinished": profile.unfinished,
        "energy_balance": profile.energy_balance,
        "energy_balance_stderr": meta.get("energy_balance_stderr"),
        "radius_of_50_percent_mm": radii_mm[0],
        "radius_of_90_percent_mm": radii_mm[1],
        "radius_of_99_percent_mm": radii_mm[2],
        "empty_annuli": _empty(profile),
    }


def _material_figures(profile: Profile) -> dict[str, Any] | None:
    """Name and layers, from the top down, of the material the profile was made from.

    No layers where only a name is known; null where there is not even that.
    """
    from sssfit.messages import printable
    from sssfit.profile.bins import material_of

    material = material_of(profile)
    if material is not None:
        return {**material.to_dict(), **_scales(material)}
    if profile.material_name is None:
        return None
    source = printable(str(profile.meta["material"].get("source") or ""))
    return {"name": profile.material_name, "source": source, "layers": []}


def _scales(material: Material) -> dict[str, Any]:
    """Albedo and mean free path per layer and channel."""
    return {
        "albedo": [layer.albedo for layer in material.layers],
        "mean_free_path_mm": [layer.mean_free_path_mm for layer in material.layers],
    }


def _is_uniform(profile: Profile) -> bool:
    import numpy as np

    width_mm = np.diff(profile.r_edges_mm)
    return bool(np.allclose(width_mm, width_mm[0]))


def _empty(profile: Profile) -> Any:
    """Annuli per channel in which no photon left any energy; null where none were traced."""
    if profile.photons is None:
        return None
    return ((profile.annulus_energy == 0) & (profile.annulus_energy_stderr == 0)).sum(axis=0)


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
    head = ["channel", "diffuse R", "+- stderr", "beyond grid", "of diffuse", "absorbed"]
    columns = ["unfinished", "sum - 1"]
    transmitted = figures["transmitted"]
    if transmitted is not None:
        columns.insert(0, "transmitted")
    rows = []
    for c, name in enumerate(figures["channels"]):
        diffuse, beyond = figures["diffuse_reflectance"][c], figures["beyond_grid"][c]
        row = [
            name,
            f"{diffuse:.6f}",
            _error(figures["diffuse_reflectance_stderr"][c]),
            f"{beyond:.2e}",
            f"{100.0 * beyond / diffuse:.3f} %" if diffuse > 0 else "-",
            "-" if figures["absorbed"] is None else f"{figures['absorbed'][c]:.6f}",
        ]
        row += [] if transmitted is None else [f"{transmitted[c]:.6f}"]
        row += [f"{figures['unfinished'][c]:.1e}", _balance(figures, c)]
        rows.append(row)
    return "\n" + table([*head, *columns], rows)


def _error(stderr: float) -> str:
    return "-" if stderr != stderr else f"{stderr:.1e}"  # NaN: none


def _balance(figures: dict[str, Any], channel: int) -> str:
    """Sum of all energies - 1, with the standard error where the run gave one."""
    if figures["absorbed"] is None:
        return "-"
    balance = f"{figures['energy_balance'][channel]:+.0e}"
    stderr = figures["energy_balance_stderr"]
    return balance if stderr is None else f"{balance} +- {stderr[channel]:.0e}"


def _radii(figures: dict[str, Any]) -> str:
    """How far the light on the grid spreads."""
    empty = figures["empty_annuli"]
    head = ["channel", *(f"{100 * share:g} % within, mm" for share in _SHARES)]
    rows = [
        [name, *(f"{figures[f'radius_of_{100 * share:g}_percent_mm'][c]:.4f}" for share in _SHARES)]
        + ([] if empty is None else [str(empty[c])])
        for c, name in enumerate(figures["channels"])
    ]
    return "\n" + table(head + ([] if empty is None else ["empty"]), rows) + "\n"
