"""Godot 4: the constants of its subsurface shader, and the scale of the project's settings.

The shader has the tables of separable-sss for 11, 17 and 25 taps: ``skin_kernel`` for the skin mode
with three weights a tap, and ``kernel`` with one. It moves by strength / 3 for each unit of an
offset, times depth_scale (`projection[0][0]` / depth) in texture coordinates: with the setting
scale 0 one unit is 2/3 of strength depth_scale to the sides, in the scene's metres, and less up and
down by the picture's width over its height.
"""

from __future__ import annotations

from sssfit.arrays import FloatArray
from sssfit.export.presets.fields import Field, Values
from sssfit.export.presets.record import Parameters, Preset
from sssfit.export.presets.separable import (
    COUNTS,
    LOST,
    MODEL,
    Separable,
    Words,
    kernel_rows,
    separable_of_taps,
    unit_of,
    width_of,
)
from sssfit.export.presets.separable_fit import fit_separable
from sssfit.export.presets.source import Source
from sssfit.export.presets.text import lines, number, numbers
from sssfit.kernel import Taps

_MM = 1000.0
FIELDS = (
    Field("albedo", "1", "diffuse reflectance R_d, the material's albedo, linear", "colour",
          most=1.0),
    Field("subsurface_scattering_depth_scale", "m", "setting rendering/environment/"
          "subsurface_scattering; its scale must be 0", is_above=True),
    Field("subsurf_scatter_strength", "1", "of the material, with its skin mode on", is_above=True,
          most=1.0, default=1.0),
    Field("strength", "1", "share of the light that is blurred", "colour", most=1.0),
    Field("falloff", "1", "relative width of each channel", "colour", most=1.0),
    Field("taps", "1", "taps of a pass: 11, 17 or 25 for low, medium and high quality", "whole",
          among=COUNTS, default=25, is_chosen=True),
)  # fmt: skip


def unit_mm(parameters: Parameters) -> float:
    """Return the length of one unit of the offsets [mm], to the sides."""
    reach_mm = _MM * parameters.number("subsurface_scattering_depth_scale")
    return unit_of(reach_mm * parameters.number("subsurf_scatter_strength"))


WORDS = Words("albedo", "strength", "falloff", unit_mm, lambda each: int(each.number("taps")))


def convert(source: Source, chosen: Values) -> Values:
    """Fit strength, falloff and width to the profile."""
    found = fit_separable(source, int(chosen["taps"]))  # type: ignore[arg-type]
    return {**chosen, **_values(found, source.reflectance)}


def of_taps(table: Taps, chosen: Values) -> Values:
    """Return the parameters of a table that has the layout."""
    found, taps = separable_of_taps(table)
    return {**chosen, **_values(found, table.energy), "taps": taps}


def _values(found: Separable, albedo: FloatArray) -> Values:
    return {
        **WORDS.values(found, albedo),
        "subsurface_scattering_depth_scale": width_of(found.unit_mm) / _MM,
        "subsurf_scatter_strength": 1.0,
    }


def write(parameters: Parameters) -> str:
    """Return the constants that replace those of subsurface_scattering.glsl."""
    taps = WORDS.taps(parameters)
    rows = kernel_rows(WORDS.read(parameters), taps)
    half = [rows[0], *rows[1 + taps // 2 :]]
    body = [
        f"// In project.godot: rendering/environment/subsurface_scattering/"
        f"subsurface_scattering_depth_scale="
        f"{number(parameters.number('subsurface_scattering_depth_scale'))}",
        "// and subsurface_scattering_scale=0.0; the material's subsurf_scatter_skin_mode is on.",
        "// The engine has to be built with these constants.",
        f"#ifdef USE_{taps}_SAMPLES",
        f"const int kernel_size = {len(half)};",
        "const vec2 kernel[kernel_size] = vec2[](",
        _rows("vec2", [(row[0], row[3]) for row in half]),
        "const vec4 skin_kernel[kernel_size] = vec4[](",
        _rows("vec4", half),
        "#endif",
    ]
    return lines(parameters, "//", body)


def _rows(kind: str, rows: list[tuple[float, ...]]) -> str:
    return ",\n".join(f"\t\t{kind}({numbers(row)})" for row in rows) + ");"


GODOT = Preset(
    name="godot",
    engine="Godot 4, subsurface scattering of the Forward+ renderer",
    model=MODEL,
    ending=".glsl",
    fields=FIELDS,
    convert=convert,
    write=write,
    look=WORDS.look,
    profile=WORDS.profile,
    lost=LOST,
    origin=(
        "github.com/godotengine/godot: servers/rendering/renderer_rd/shaders/effects/"
        "subsurface_scattering.glsl, main",
        "github.com/godotengine/godot: servers/rendering/renderer_rd/effects/ss_effects.cpp, "
        "sub_surface_scattering",
    ),
    of_taps=of_taps,
)
