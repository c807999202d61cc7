"""separable-sss, the shader of Jimenez and Gutierrez: a table of taps, and its width.

The shader moves by sssWidth / 3 for each unit of an offset, in texture coordinates of a picture
whose height is 2 tan(fov / 2) at distance 1, while it divides by tan(fov / 2): one unit is 2/3 of
sssWidth up and down, and times the picture's width over its height to the sides.
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
    Field("albedo", "1", "diffuse reflectance R_d, the colour of the surface, linear", "colour",
          most=1.0),
    Field("sssWidth", "m", "width in the scene's units; the shader's sssWidth", is_above=True),
    Field("strength", "1", "share of the light that is blurred", "colour", most=1.0),
    Field("falloff", "1", "relative width of each channel", "colour", most=1.0),
    Field("SSSS_N_SAMPLES", "1", "taps of a pass", "whole", among=COUNTS, default=25,
          is_chosen=True),
    Field("meters_per_unit", "m", "length of the scene's unit", is_above=True, default=1.0,
          is_chosen=True),
)  # fmt: skip


def unit_mm(parameters: Parameters) -> float:
    """Return the length of one unit of the offsets [mm], up and down."""
    width_mm = _MM * parameters.number("sssWidth") * parameters.number("meters_per_unit")
    return unit_of(width_mm)


WORDS = Words(
    "albedo", "strength", "falloff", unit_mm, lambda each: int(each.number("SSSS_N_SAMPLES"))
)


def convert(source: Source, chosen: Values) -> Values:
    """Fit strength, falloff and width to the profile."""
    found = fit_separable(source, int(chosen["SSSS_N_SAMPLES"]))  # type: ignore[arg-type]
    return {**chosen, **_values(found, source.reflectance, chosen)}


def of_taps(table: Taps, chosen: Values) -> Values:
    """Return the parameters of a table that has the layout."""
    found, taps = separable_of_taps(table)
    return {**chosen, **_values(found, table.energy, chosen), "SSSS_N_SAMPLES": taps}


def _values(found: Separable, albedo: FloatArray, chosen: Values) -> Values:
    unit_m = float(chosen["meters_per_unit"])  # type: ignore[arg-type]
    width = width_of(found.unit_mm) / _MM / unit_m
    return {**WORDS.values(found, albedo), "sssWidth": width}


def write(parameters: Parameters) -> str:
    """Return the table as HLSL, in the layout of SeparableSSS.h."""
    taps = WORDS.taps(parameters)
    rows = kernel_rows(WORDS.read(parameters), taps)
    body = [
        f"#define SSSS_N_SAMPLES {taps}",
        f"static const float sssWidth = {number(parameters.number('sssWidth'))};",
        "float4 kernel[] = {",
        *(f"    float4({numbers(row)})," for row in rows),
        "};",
    ]
    return lines(parameters, "//", body)


IRYOKU = Preset(
    name="iryoku",
    engine="separable-sss (iryoku)",
    model=MODEL,
    ending=".hlsl",
    fields=FIELDS,
    convert=convert,
    write=write,
    look=WORDS.look,
    profile=WORDS.profile,
    lost=LOST,
    origin=(
        "github.com/iryoku/separable-sss: Demo/Code/SeparableSSS.cpp, calculateKernel; "
        "SeparableSSS.h, SSSSBlurPS",
    ),
    of_taps=of_taps,
)
