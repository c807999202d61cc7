"""Stride: scattering width, strength and falloff of the subsurface scattering feature.

25 taps of separable-sss, whose offsets the generator divides by 3; the blur multiplies them by the
width, by the projection of a unit and by 1 / depth, in texture coordinates, of which 1 spans 2 of
the projection's. One unit of an offset is therefore 2/3 of the width, in both directions.
"""

from __future__ import annotations

from sssfit.arrays import FloatArray
from sssfit.errors import KernelError
from sssfit.export.presets.fields import Field, Values
from sssfit.export.presets.record import Parameters, Preset
from sssfit.export.presets.separable import (
    LOST,
    MODEL,
    Separable,
    Words,
    separable_of_taps,
    unit_of,
    width_of,
)
from sssfit.export.presets.separable_fit import fit_separable
from sssfit.export.presets.source import Source
from sssfit.export.presets.text import lines, number, numbers
from sssfit.kernel import Taps

TAPS = 25
_MM = 1000.0
FIELDS = (
    Field("albedo", "1", "diffuse reflectance R_d, the diffuse map, linear", "colour", most=1.0),
    Field("ScatteringWidth", "m", "scattering width", is_above=True),
    Field("Strength", "1", "share of the light that is blurred", "colour", most=1.0),
    Field("Falloff", "1", "relative width of each channel", "colour", most=1.0),
    Field("Translucency", "1", "of light through thin parts; not fitted", most=1.0, default=0.83,
          is_chosen=True),
)  # fmt: skip


def unit_mm(parameters: Parameters) -> float:
    """Return the length of one unit of the offsets [mm]."""
    return unit_of(_MM * parameters.number("ScatteringWidth"))


WORDS = Words("albedo", "Strength", "Falloff", unit_mm, lambda _: TAPS)


def convert(source: Source, chosen: Values) -> Values:
    """Fit strength, falloff and width to the profile."""
    return {**chosen, **_values(fit_separable(source, TAPS), source.reflectance)}


def of_taps(table: Taps, chosen: Values) -> Values:
    """Return the parameters of a table that has the layout."""
    found, taps = separable_of_taps(table)
    if taps != TAPS:
        raise KernelError(f"the table has {taps} taps a pass; Stride's shader has {TAPS}.")
    return {**chosen, **_values(found, table.energy)}


def _values(found: Separable, albedo: FloatArray) -> Values:
    width = width_of(found.unit_mm) / _MM
    return {**WORDS.values(found, albedo), "ScatteringWidth": width}


def write(parameters: Parameters) -> str:
    """Return C# that makes the feature."""

    def colour(name: str) -> str:
        return f"new Color3({numbers(parameters.colour(name), 'f, ')}f)"

    body = [
        "var feature = new MaterialSubsurfaceScatteringFeature",
        "{",
        f"    ScatteringWidth = {number(parameters.number('ScatteringWidth'))}f,",
        f"    Translucency = {number(parameters.number('Translucency'))}f,",
        "    KernelFunction = new MaterialSubsurfaceScatteringScatteringKernelSkin",
        "    {",
        f"        Strength = {colour('Strength')},",
        f"        Falloff = {colour('Falloff')},",
        "    },",
        "};",
    ]
    return lines(parameters, "//", body)


STRIDE = Preset(
    name="stride",
    engine="Stride, subsurface scattering feature",
    model=MODEL,
    ending=".cs",
    fields=FIELDS,
    convert=convert,
    write=write,
    look=WORDS.look,
    profile=WORDS.profile,
    lost=LOST,
    origin=(
        "github.com/stride3d/stride: sources/engine/Stride.Rendering/Rendering/Images/"
        "SubsurfaceScattering/SubsurfaceScatteringBlurShader.sdsl, SSSSBlurPS",
        "github.com/stride3d/stride: sources/engine/Stride.Rendering/Rendering/Materials/"
        "SubsurfaceScattering/SubsurfaceScatteringKernelGenerator.cs, CalculateScatteringKernel",
    ),
    of_taps=of_taps,
)
