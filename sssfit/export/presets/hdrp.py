"""Unity's High Definition Render Pipeline: the diffusion profile.

Normalised diffusion with d = scatteringDistance [mm] by channel, a colour from 0 to 1 times a
multiplier; worldScale is the length of the scene's unit in metres. The filter reaches over 99.7 %
of the widest channel's light. The albedo is the material's base colour, which the profile does not
hold: it is applied after the blur ("post-scatter").
"""

from __future__ import annotations

import numpy as np

from sssfit.export.presets.burley import burley_profile, range_warnings, widest_and_shares
from sssfit.export.presets.fields import Field, Values
from sssfit.export.presets.record import Parameters, Preset
from sssfit.export.presets.source import Source
from sssfit.export.presets.text import lines, number, numbers
from sssfit.profile import Profile
from sssfit.shapes import diffusion_radius

SHARE = 0.997  # of the energy within the filter's radius
FIELDS = (
    Field("baseColor", "1", "diffuse reflectance R_d, the material's base colour, linear", "colour",
          most=1.0),
    Field("scatteringDistance", "1", "share of the multiplier of each channel", "colour", most=1.0,
          is_above=True),
    Field("scatteringDistanceMultiplier", "mm", "distance d of the widest channel", is_above=True,
          default=1.0),
    Field("worldScale", "m", "length of the scene's unit", least=0.001, default=1.0,
          is_chosen=True),
    Field("indexOfRefraction", "1", "refractive index, for reflections only", least=1.0, most=2.0,
          default=1.4),
)  # fmt: skip


def convert(source: Source, chosen: Values) -> Values:
    """Return the distances of the shapes that fit best."""
    widest, shares = widest_and_shares(source)
    return {
        **chosen,
        "baseColor": tuple(source.reflectance.tolist()),
        "scatteringDistance": shares,
        "scatteringDistanceMultiplier": widest,
        "indexOfRefraction": min(max(source.eta, 1.0), 2.0),
    }


def profile(parameters: Parameters) -> Profile:
    """Return normalised diffusion."""
    shares = np.array(parameters.colour("scatteringDistance"))
    distance_mm = parameters.number("scatteringDistanceMultiplier") * shares
    return burley_profile(
        parameters.title, parameters.preset.name, parameters.colour("baseColor"), distance_mm
    )


def filter_radius_mm(parameters: Parameters) -> float:
    """Return the radius of the engine's filter [mm], which its inspector shows."""
    shares = parameters.colour("scatteringDistance")
    widest = parameters.number("scatteringDistanceMultiplier") * max(shares)
    return float(diffusion_radius(SHARE, 1.0)) * widest


def write(parameters: Parameters) -> str:
    """Return C# for the editor that makes the asset."""
    scale = parameters.number("scatteringDistanceMultiplier")
    colour = numbers((scale * each for each in parameters.colour("scatteringDistance")), "f, ")
    body = [
        f"// baseColor (linear): {numbers(parameters.colour('baseColor'))}",
        f"// The inspector shows a maximum radius of {filter_radius_mm(parameters):.4g} mm.",
        "var profile = ScriptableObject.CreateInstance<"
        "UnityEngine.Rendering.HighDefinition.DiffusionProfileSettings>();",
        f"profile.scatteringDistance = new Color({colour}f);",
        f"profile.worldScale = {number(parameters.number('worldScale'))}f;",
        f"profile.indexOfRefraction = {number(parameters.number('indexOfRefraction'))}f;",
        f'UnityEditor.AssetDatabase.CreateAsset(profile, "Assets/{parameters.title}.asset");',
    ]
    return lines(parameters, "//", body)


def doubts(parameters: Parameters) -> tuple[str, ...]:
    """Return a warning outside the model's range."""
    return range_warnings(parameters.colour("baseColor"))


HDRP = Preset(
    name="hdrp",
    engine="Unity HDRP, diffusion profile",
    model="normalised diffusion (Christensen and Burley 2015)",
    ending=".cs",
    fields=FIELDS,
    convert=convert,
    write=write,
    look=profile,
    profile=profile,
    lost="the shape of the profile beyond one distance a channel, and the light outside 99.7 %.",
    origin=(
        "github.com/Unity-Technologies/Graphics: Packages/"
        "com.unity.render-pipelines.high-definition/Runtime/Material/DiffusionProfile/"
        "DiffusionProfileSettings.cs, UpdateKernel",
    ),
    doubts=doubts,
)
