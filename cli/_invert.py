"""``sssfit materials --from-reflectance``: an albedo inversion, written as a material."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sssfit.messages import table
from sssfit.process import check_memory

from ._options import Common
from ._output import binary_stdout, finish, held
from ._progress import say_if_compiling

if TYPE_CHECKING:
    from sssfit.material import Material
    from sssfit.simulate.exact import Light

# Heads the files we make: only a file that begins with it is replaced without --force.
_OURS = "# Made by `sssfit materials --from-reflectance`, which may replace this file;"
_DARK = 1e-9  # a reflectance that no relative error is given for: the fits were not made for it
_PUBLISHED = {"chiang2016": "Chiang et al. 2016", "van_de_hulst": "van de Hulst"}


@dataclass(frozen=True, slots=True)
class InversionRequest:
    """What the options ask for; None where they do not say."""

    from_reflectance: list[float] | str
    srgb: bool
    mean_free_path: list[float] | None
    eta: float
    light: Light | None
    name: str | None
    channels: str | None
    output: str | None
    force: bool


def write_material(request: InversionRequest, common: Common) -> None:
    """Invert, write the TOML, and print what was found beside the published approximations."""
    check_memory("inversion", common.threads)
    if request.mean_free_path is None:
        raise click.UsageError("--from-reflectance needs --mean-free-path.")
    asked_for = _asked(request)
    is_srgb = request.srgb or isinstance(asked_for, str)
    light = request.light or ("diffuse" if is_srgb else "normal")
    channels = _channels(request, 3 if isinstance(asked_for, str) else len(asked_for))
    name = request.name or _name_of(request.output)
    asked = f"{name}.toml" if request.output is None else request.output
    path = None if asked == "-" else Path(asked)

    with held([path], _is_ours, inputs=[], force=request.force, named=("a material", ".toml")):
        say_if_compiling(common, solver=True)
        material, figures = _inverted(
            asked_for, request.mean_free_path, request.eta, light, name, channels
        )
        _write(material, path)
    figures = {"command": "materials", "output": [str(path or "-")], **figures}
    text = f"{_text(figures)}\nWrote {path or 'the material to stdout'}"
    finish(common, figures, text, to_stderr=path is None)


def _inverted(
    asked_for: list[float] | str,
    paths_mm: list[float],
    eta: float,
    light: Light,
    name: str,
    channels: list[str],
) -> tuple[Material, dict[str, Any]]:
    """Return the material, and its figures beside those of the published approximations."""
    from sssfit.formats.colours import linear_from_hex
    from sssfit.simulate.inversion import (
        largest_reflectance,
        material_from_reflectance,
        published_inversions,
        reflectance_of,
    )

    material = material_from_reflectance(
        asked_for, paths_mm, eta, name=name, channels=channels, light=light
    )
    layer = material.layers[0]
    asked = linear_from_hex(asked_for).tolist() if isinstance(asked_for, str) else asked_for
    published = published_inversions(asked, eta, light=light)
    return material, {
        "name": material.name,
        "channels": material.channels,
        "light": light,
        "eta": eta,
        "mean_free_path_mm": layer.mean_free_path_mm,
        "reflectance_asked": asked,
        "reflectance": reflectance_of(layer.albedo, eta, light),
        "reflectance_normal": reflectance_of(layer.albedo, eta, "normal"),
        "largest_reflectance": largest_reflectance(eta, light),
        "albedo": layer.albedo,
        "sigma_a_per_mm": layer.sigma_a_per_mm,
        "sigma_s_per_mm": layer.sigma_s_per_mm,
        "approximations": {
            key: {"albedo": each.albedo, "reflectance": each.reflectance}
            for key, each in published.items()
        },
    }


def _asked(request: InversionRequest) -> list[float] | str:
    """Return linear reflectances, or the sRGB colour in hex, which the material's source names."""
    given = request.from_reflectance
    if isinstance(given, str) or not request.srgb:
        return given
    for each in given:
        if not (each.is_integer() and 0.0 <= each <= 255.0):
            raise click.UsageError(
                f"--srgb takes codes of 8 bits, whole numbers from 0 to 255, and not {each:g}."
            )
    if len(given) == 3:
        return "#" + "".join(f"{round(each):02x}" for each in given)
    from sssfit.formats.colours import srgb_decode

    return [float(srgb_decode(each / 255.0)) for each in given]


def _channels(request: InversionRequest, count: int) -> list[str]:
    """Names of the channels: R, G, B for three."""
    if request.channels is not None:
        names = [each.strip() for each in request.channels.split(",")]
        if len(names) != count:
            raise click.UsageError(f"--channels has {len(names)} names for {count} reflectances.")
        return names
    if count != 3:
        raise click.UsageError(
            f"--from-reflectance has {count} value{'s' * (count != 1)}; name "
            f"{'its channel' if count == 1 else 'their channels'} with --channels."
        )
    return ["R", "G", "B"]


def _name_of(output: str | None) -> str:
    """Name the material after its file."""
    return "from-reflectance" if output in (None, "", "-") else Path(str(output)).stem


def _write(material: Material, path: Path | None) -> None:
    """To the file, whole or not at all; to stdout where there is none."""
    from sssfit.files import write_atomically

    content = f"{_OURS} delete this line to keep it.\n{material.to_toml()}".encode()
    if path is None:
        binary_stdout().write(content)
        binary_stdout().flush()
    else:
        write_atomically(path, lambda stream: stream.write(content))


def _is_ours(path: Path) -> bool:
    """Whether a file begins with the line that says who made it."""
    from sssfit.files import has_mark

    return has_mark(path, {_OURS.encode(): b""})


def _text(figures: dict[str, Any]) -> str:
    """Say for people what was made, and what the approximations would have made."""
    is_diffuse = figures["light"] == "diffuse"
    heads = (
        ["channel", "base colour", "normal reflectance"]
        if is_diffuse
        else [
            "channel",
            "diffuse reflectance",
        ]
    )
    heads += ["albedo", "sigma_a, 1/mm", "sigma_s, 1/mm"]
    decimals = ("reflectance", *(("reflectance_normal",) if is_diffuse else ()), "albedo")
    rows = [
        [name, *(f"{figures[key][c]:.6f}" for key in decimals)]
        + [f"{figures[key][c]:.6g}" for key in ("sigma_a_per_mm", "sigma_s_per_mm")]
        for c, name in enumerate(figures["channels"])
    ]
    published = figures["approximations"]
    more_heads = ["channel", *(f"{head}, gives" for head in _PUBLISHED.values())]
    more_rows = [
        [name, *(_given(published[key], figures["reflectance_asked"], c) for key in _PUBLISHED)]
        for c, name in enumerate(figures["channels"])
    ]
    what = "base colour" if is_diffuse else "diffuse reflectance"
    return "\n".join(
        [
            f"{figures['name']}: eta {figures['eta']:g}, could reflect up to "
            f"{math.floor(1e6 * figures['largest_reflectance']) / 1e6:g} under {figures['light']} "
            "light",
            table(heads, rows),
            f"approximate albedos, the {what} they really have, and its error:",
            table(more_heads, more_rows),
        ]
    )


def _given(published: dict[str, Any], asked: list[float], channel: int) -> str:
    """Albedo, reflectance and its relative error."""
    gives = published["reflectance"][channel]
    is_dark = asked[channel] < _DARK
    error = "" if is_dark else f" ({100.0 * (gives / asked[channel] - 1.0):+#.3g} %)"
    return f"{published['albedo'][channel]:.6f}, {gives:.6f}{error}"
