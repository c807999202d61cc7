"""Any record as figures and as a report, for ``sssfit show`` and ``sssfit materials``.

`figures_of` returns the figures of ``--json``, and `summary` makes the printed report from them.
"""

import json
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from sssfit.arrays import plain
from sssfit.errors import SimulationError
from sssfit.grid import RadialGrid, paper_grid
from sssfit.kernel import SeparableKernel, Taps
from sssfit.material import Material, load_material, material_names
from sssfit.messages import (
    SHARE,
    Columns,
    by_channel,
    columns,
    counted,
    filled,
    number,
    printable,
    report,
    table,
)
from sssfit.methods import DEON_SKIN
from sssfit.profile.checks import BALANCE_ROUNDING
from sssfit.shapes import SKIN_VARIANCES_MM2, SKIN_WEIGHTS

if TYPE_CHECKING:
    from sssfit.kinds import Loaded

Figures = Mapping[str, Any]


def figures_of(found: "Loaded") -> dict[str, Any]:
    """Return the figures of a record that `sssfit.load` reads; ``kind`` is the first."""
    if isinstance(found, Material):
        return {"kind": "material", **material_figures(found)}
    return found.figures() if isinstance(found, SeparableKernel | Taps) else found.to_dict()


def summary(figures: Figures) -> str:
    """Return the figures of any record as a report, with a table for values per channel."""
    return _PAGES[figures["kind"]](figures)


def material_row(material: Material) -> dict[str, Any]:
    """Return the figures of a row of materials; those of one layer are None for a stack."""
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


def material_figures(material: Material) -> dict[str, Any]:
    """Return all figures of a material: coefficients by layer and, for one layer, on their own."""
    layers = [
        layer.to_dict() | {"albedo": layer.albedo, "mean_free_path_mm": layer.mean_free_path_mm}
        for layer in material.layers
    ]
    keys = ("g", "sigma_a_per_mm", "sigma_s_per_mm", "thickness_mm")
    return plain(
        {
            **material_row(material),
            **{key: layers[0][key] if len(layers) == 1 else None for key in keys},
            "eta_above": material.eta_above,
            "eta_below": material.eta_below,
            "specular_reflectance": material.specular_reflectance,
            "layers": layers,
            "sha256": material.sha256,
        }
    )


def shipped_figures() -> dict[str, Any]:
    """Return a row for each material that ships with sssfit, half spaces apart from layers."""
    rows = [material_row(load_material(name)) for name in material_names()]
    layered = [_layered_row(load_material(name)) for name in material_names(layered=True)]
    return {"rows": rows, "layered": layered, "profiles": [DEON_SKIN]}


def _layered_row(material: Material) -> dict[str, Any]:
    """Return name and source, and index and thickness (None: without end) from the top down."""
    return {
        "name": material.name,
        "source": material.source,
        "channels": material.channels,
        "eta": [layer.eta for layer in material.layers],
        "thickness_mm": [layer.to_dict()["thickness_mm"] for layer in material.layers],
    }


def deon_skin_figures() -> dict[str, Any]:
    """Return the Gaussians of deon-skin, with the weights (6, 3) of the channels."""
    from sssfit.simulate import DEON_SKIN as SKIN  # it needs numba

    return {
        **SKIN.to_dict(),
        "channels": SKIN.channels,
        "variances_mm2": SKIN_VARIANCES_MM2,
        "weights": SKIN_WEIGHTS,
    }


def _grid(material: Material) -> RadialGrid | None:
    """Return the paper's grid, or None if it would have too many annuli."""
    try:
        return paper_grid(material)
    except SimulationError:
        return None


# Materials

_MATERIAL_HEAD = """\
name                  {name}
source                {source}
specular reflectance  {specular_reflectance:.5f}
paper's grid          {grid}
sha256                {sha256}"""
_GRID = "dr {dr_mm:.6g} mm, {annuli:#annulus}, radius {radius_mm:.6g} mm"
_NO_GRID = "none: too many annuli, give simulate a `dr_mm` or `radius_mm`"
_LAYER = (
    ("sigma_a, 1/mm", "sigma_a_per_mm", ".6g"),
    ("sigma_s, 1/mm", "sigma_s_per_mm", ".6g"),
    ("g", "g", ".6g"),
    ("single-scattering albedo", "albedo", ".6g"),
    ("transport mean free path, mm", "mean_free_path_mm", ".6g|inf"),
)


def material_page(figures: Figures) -> str:
    """Return a material's figures as a report."""
    source = printable(figures["source"]) or "not given"
    grid = filled(_GRID, figures) if figures["dr_mm"] else _NO_GRID
    lines = [filled(_MATERIAL_HEAD, {**figures, "source": source, "grid": grid})]
    if figures["eta_above"] != 1:
        lines += ["", filled("above: eta {eta_above:g}", figures)]
    layers = figures["layers"]
    for k, layer in enumerate(layers, 1):
        is_clear = not (any(layer["sigma_a_per_mm"]) or any(layer["sigma_s_per_mm"]))
        own = {**layer, "channels": figures["channels"], "clear": ", clear" if is_clear else ""}
        heading = f"layer {k}: " if len(layers) > 1 else ""
        heading += "semi-infinite" if layer["thickness_mm"] is None else "{thickness_mm:g} mm thick"
        parts = (heading + ", eta {eta:g}{clear}", Columns("channel", "channels", _LAYER))
        lines += ["", report(parts, own)]
    if any(any(layer["g"]) for layer in layers):
        lines.append("transport mean free path: 1 / (sigma_a + (1 - g) sigma_s)")
    if figures["eta_below"] != 1:
        lines += ["", filled("below: eta {eta_below:g}", figures)]
    return "\n".join(lines)


def shipped_page(figures: Figures) -> str:
    """Return the rows of the shipped materials as text."""
    rows = figures["rows"]

    def values(key: str, form: str = "") -> list[Any]:
        every = [row[key] for row in rows]
        return [" ".join(f"{each:{form}}" for each in of) for of in every] if form else every

    text = columns(
        "name",
        values("name"),
        ("eta", values("eta"), "g"),
        ("scattering albedo R G B", values("albedo", ".5f"), ""),
        ("transport MFP R G B, mm", values("mean_free_path_mm", ".4f"), ""),
        ("dr, mm", values("dr_mm"), ".5f"),
        ("annuli", values("annuli"), ""),
        ("radius, mm", values("radius_mm"), ".2f"),
    )
    return (
        f"{text}\n\n{_layered_table(figures['layered'])}\n\n"
        f"{DEON_SKIN}: a profile without coefficients, for simulate, compare, choose, motion and "
        "report"
    )


def _layered_table(rows: list[Figures]) -> str:
    """Return a line of text for each material of several layers, and for each slab."""
    lines = [
        [
            row["name"],
            " ".join(f"{eta:g}" for eta in row["eta"]),
            " ".join(number(each, "g|inf") for each in row["thickness_mm"]),
            row["source"],
        ]
        for row in rows
    ]
    return table(["layers", "eta", "thickness, mm", "source"], lines)


def deon_skin_page(figures: Figures) -> str:
    """Return a line of text for each Gaussian."""
    rows = [
        [f"{variance:g}", *(f"{weight:.3f}" for weight in weights)]
        for variance, weights in zip(figures["variances_mm2"], figures["weights"], strict=True)
    ]
    head = (
        "name      {name}\nsource    {source}\nsix Gaussians in place of coefficients: "
        '`simulate("deon-skin")` makes their profile\n\n'
    )
    return filled(head, figures) + table(["variance, mm^2", *figures["channels"]], rows)


# Profiles

_SHARES = (50, 90, 99)
_PROFILE_HEAD = """\
material  {name}{origin}
method    {method:|unknown}{settings}, {walks}, sssfit {version:|version unknown}
grid      {annuli:#annulus} of {width}, to {radius_mm:.4g} mm"""
_TOLD_ELSEWHERE = {"dr_mm", "radius", "photons", "angles", "numerical_aperture"}
_ENERGIES = Columns(
    "channel",
    "channels",
    (
        ("diffuse R", "diffuse_reflectance", SHARE),
        ("+- stderr", "diffuse_reflectance_stderr", ".1e"),
        ("beyond grid", "beyond_grid", ".2e"),
        ("of diffuse", "beyond_share", ""),
        ("absorbed", "absorbed", ".6f"),
        ("transmitted", "transmittance", SHARE),
        ("+- stderr", "transmittance_stderr", ".1e"),
        ("unfinished", "unfinished", ".1e"),
        ("sum - 1", "balance", ""),
    ),
)
_RADII = Columns(
    "channel",
    "channels",
    (
        *((f"{each} % within, mm", f"radius_of_{each}_percent_mm", ".4f") for each in _SHARES),
        ("empty", "empty_annuli", ""),
    ),
)
_COEFFICIENTS = (
    *("eta", "g", "sigma_a, 1/mm", "sigma_s, 1/mm", "single-scattering albedo"),
    *("transport MFP, mm", "thickness, mm"),
)
_EMPTY = (
    "empty: annuli in which nothing was seen; their standard error of 0 says that, and not that "
    "R_d is 0 there."
)


def profile_page(figures: Figures) -> str:
    """Return a profile's figures as a report."""
    material = figures["material"] or {"name": "unknown material", "source": "", "layers": []}
    source, layers = material["source"], material["layers"]
    names, diffuse = figures["channels"], figures["diffuse_reflectance"]
    shares = [
        b / d if d > 0 else None for b, d in zip(figures["beyond_grid"], diffuse, strict=True)
    ]
    told = {
        **figures,
        "name": material["name"],
        "origin": f" ({source})" if source else "",
        "settings": _settings(figures["settings"]),
        "walks": _walks(figures),
        "width": filled("{dr_mm:.4g} mm", figures) if figures["uniform"] else "varying width",
        "absorbed": figures["absorbed"] or [None] * len(names),
        "beyond_share": [None if each is None else f"{100.0 * each:.3f} %" for each in shares],
        "balance": [_balance(figures, c) for c in range(len(names))],
    }
    parts = [filled(_PROFILE_HEAD, told)]
    if layers:
        parts.append(f"\n{_coefficients(material)}")
    parts += ["\n" + report([_ENERGIES], told), f"\n{report([_RADII], told)}\n"]
    parts.append(
        filled("specular reflectance {specular_reflectance:.6f}, not part of diffuse R; ", figures)
        + "sum = specular + diffuse + absorbed + unfinished"
        + ("" if figures["transmittance"] is None else " + transmitted")
        + (" + outside the aperture" if "outside_aperture" in figures else "")
    )
    parts += [_directions(figures)] if {"exit_angles", "outside_aperture"} & figures.keys() else []
    parts += [_EMPTY] if any(figures["empty_annuli"] or ()) else []
    return "\n".join(parts)


def _directions(figures: Figures) -> str:
    """Return what is known of the directions of the light, as text."""
    if "exit_angles" in figures:
        bins = counted(len(figures["exit_angles"]), "bin")
        return f"exit angles: {bins} from 0 to 90 degrees"
    outside = by_channel(figures["channels"], figures["outside_aperture"], ".6f")
    return (
        filled("numerical aperture {numerical_aperture:g|unknown}; outside it ", figures) + outside
    )


def _settings(given: Figures) -> str:
    """Return the settings of a method as text: mapping diffuse, similarity."""
    told = {name: each for name, each in given.items() if name not in _TOLD_ELSEWHERE}
    words = [
        name.replace("_", " ") + ("" if each is True else f" {printable(str(each))}")
        for name, each in told.items()
        if each is True or (isinstance(each, str | int | float) and each is not False)
    ]
    return f" ({', '.join(words)})" if words else ""


def _walks(figures: Figures) -> str:
    """Return the number of photons, and the beam if it is not a pencil, as text."""
    beam = f", beam {figures['beam']} mm" if figures.get("beam") else ""
    if figures["photons"] is None:
        return f"no photons{beam}"
    return filled("{photons:,#photon}, seed {seed}", figures) + beam


def _coefficients(material: Figures) -> str:
    """Return one line per layer and channel."""
    layers = material["layers"]
    rows = [
        [
            f"{k + 1} {name}" if len(layers) > 1 else name,
            f"{layer['eta']:g}",
            f"{layer['g'][c]:g}",
            f"{layer['sigma_a_per_mm'][c]:.5g}",
            f"{layer['sigma_s_per_mm'][c]:.5g}",
            f"{material['albedo'][k][c]:.5f}",
            number(material["mean_free_path_mm"][k][c], ".4f"),
            number(layer["thickness_mm"], "g|infinite"),
        ]
        for k, layer in enumerate(layers)
        for c, name in enumerate(material["channels"])
    ]
    return table(["channel", *_COEFFICIENTS], rows)


def _balance(figures: Figures, channel: int) -> str:
    """Return the sum of all energies - 1, with its standard error if the run has one."""
    if figures["absorbed"] is None:
        return "-"
    balance = f"{figures['energy_balance'][channel]:+.0e}"
    stderr = figures["energy_balance_stderr"]
    return (
        balance if stderr is None else f"{balance} +- {max(stderr[channel], BALANCE_ROUNDING):.0e}"
    )


def checkpoint_page(figures: Figures) -> str:
    """Return a report on an unfinished walk, followed by that of each profile."""
    head = (
        "so far    {photons:,#photon}, {flights:,#flight}, {seconds:.1f} s; `resume = True` "
        "continues from there\nerror     {relative_error:.3g%} of F(r), in the worst channel"
    )
    pages = [f"\n{profile_page(each)}" for each in figures["profiles"]]
    return "\n".join([filled(head, figures), *pages])


# Kernels

_KERNEL_HEAD = """\
material  {material}
profile   {origin}, {walks}{sha}
fit       {method}, {rank:#term}{pairs}, sssfit {version}
pixels    {pixels} x {pixels} of {mm_per_pixel:.6g} mm, the outermost \
{support_mm:.6g} mm from the axis
"""
_CHANNELS = Columns(
    "channel",
    "channels",
    (
        ("energy", "energy", ".6f"),
        ("scale", "scale", ".6g"),
        ("Frobenius error", "relative_frobenius_error", ".3g%|unknown"),
        ("energy error", "energy_error", "+.2g%|unknown"),
    ),
)


def _made_of(figures: Figures) -> dict[str, Any]:
    """Return figures with the words of their provenance."""
    sha = figures["profile_sha256"]
    return {
        **figures,
        "material": _name(figures["material"], "unknown material"),
        "origin": _name(figures["profile_method"], "unknown"),
        "walks": _walks(figures),
        "sha": f", sha256 {sha[:16]}" if sha else "",
        "method": _name(figures["method"]),
        "version": _name(figures["version"], "version unknown"),
    }


def kernel_page(figures: Figures) -> str:
    """Return a kernel's figures as a report."""
    told = {
        **_made_of(figures),
        "pairs": _pairs(figures["settings"], ", "),
    }
    terms = [
        [
            f"{name} {t + 1}",
            "+" if figures["sign"][t][c] > 0 else "-",
            f"{figures['term_energy'][t][c]:.6f}",
            f"{figures['middle_weight'][t][c]:.6f}",
        ]
        for c, name in enumerate(figures["channels"])
        for t in range(figures["rank"])
    ]
    found = [
        f"{_name(name)}:{_pairs(each, '  ') if isinstance(each, Mapping) else f' {each}'}"
        for name, each in figures["parameters"].items()
    ]
    heads = ["channel, term", "sign", "energy", "middle pixel of the pass"]
    parts = [report([_KERNEL_HEAD, _CHANNELS], told), table(heads, terms)]
    return "\n\n".join([*parts, *(["\n".join(["the fit found", *found])] if found else [])])


_TAPS_HEAD = """\
material  {material}
profile   {origin}, {walks}{sha}
fit       {method}{pairs}, sssfit {version}
stages    {structure}, {reads}
cost      {fetches:.4g#fetch} a pixel, {passes:#pass} ({all_passes} with the changes of size), \
{bytes_per_pixel:.4g} bytes a pixel in half precision
made for  pixels of {mm_per_pixel:.6g} mm
"""
_TAPS_CHANNELS = Columns(
    "channel",
    "channels",
    (
        ("energy", "energy", ".6f"),
        ("spectral error", "spectral_error", ".3g%|unknown"),
        ("energy error", "energy_error", "+.2g%|unknown"),
    ),
)


def taps_page(figures: Figures) -> str:
    """Return the figures of a table of taps as a report."""
    settings = figures["settings"]
    told = {
        **_made_of(figures),
        "pairs": _pairs({key: each for key, each in settings.items() if each is not None}, ", "),
        "reads": "each reads the one before" if figures["chained"] else "all read the irradiance",
    }
    names = ["irradiance", *(f"stage {k + 1}" for k in range(len(figures["reach_mm"])))]
    reach = ["0", *(f"{each:.4g}" for each in figures["reach_mm"])]
    rows = [
        [name, far, *(f"{each:.6f}" for each in row)]
        for name, far, row in zip(names, reach, figures["blend"], strict=True)
    ]
    heads = ["blend", "farthest tap, mm", *figures["channels"]]
    return "\n\n".join([report([_TAPS_HEAD, _TAPS_CHANNELS], told), table(heads, rows)])


def _pairs(values: Figures, separator: str) -> str:
    """Return names and values as text, each after the separator."""
    return "".join(f"{separator}{_name(key)} {_value(each)}" for key, each in values.items())


def _value(value: Any) -> str:
    """Return numbers with six digits, lists of them in brackets, and other values as JSON."""
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(_value(each) for each in value)}]"
    return _name(value) if isinstance(value, str) else json.dumps(value)


def _name(value: object, unknown: str = "") -> str:
    return unknown if value is None else printable(str(value))


_PAGES: Mapping[str, Callable[[Figures], str]] = {
    "profile": profile_page,
    "kernel": kernel_page,
    "taps": taps_page,
    "material": material_page,
    "checkpoint": checkpoint_page,
}
