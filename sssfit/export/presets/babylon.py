"""Babylon.js: the colour of a diffusion profile, and the scene's metres per unit.

The engine keeps a colour (r, g, b) as (r, b, g), uses it as the *shape* s of normalised diffusion
(1/d, so that brighter channels blur less), and samples radii for the distance max(r, g, b). Both
agree only where max s = 1 / min s, and only equal channels survive the exchange. Since shapes are
per mm of a scene whose unit is metersPerUnit, the product can be brought there:

    k = sqrt(s_max s_min),  colour = (s_r, s_b, s_g) / k,  metersPerUnit = k (true metres a unit).
"""

from __future__ import annotations

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.export.presets.burley import burley_profile, range_warnings
from sssfit.export.presets.fields import Field, Values
from sssfit.export.presets.record import Parameters, Preset
from sssfit.export.presets.source import Source
from sssfit.export.presets.text import lines, number, numbers
from sssfit.profile import Profile
from sssfit.shapes import diffusion_cdf, diffusion_radius

SAMPLES = 40  # at most; the last lies at 39.5/40 of the energy of the sampled distance
_SEEN = 0.9  # share of the widest channel's light that samples should reach
FIELDS = (
    Field("albedo", "1", "diffuse reflectance R_d, the material's albedo, linear", "colour",
          most=1.0),
    Field("color", "1", "argument of addDiffusionProfile, in its own order and per scaled mm",
          "colour", is_above=True),
    Field("metersPerUnit", "m", "scene.subSurfaceConfiguration.metersPerUnit, for all profiles",
          is_above=True),
    Field("sceneMetersPerUnit", "m", "true length of the scene's unit", is_above=True, default=1.0,
          is_chosen=True),
    Field("equal", "", "one shape for all channels, which no later order or meaning can change",
          "flag", default=False, is_chosen=True),
)  # fmt: skip


def convert(source: Source, chosen: Values) -> Values:
    """Return the colour and the unit that give the shapes which fit best."""
    shapes = source.shapes_per_mm
    if chosen["equal"]:
        share = source.reflectance / source.reflectance.sum()
        shapes = np.full(3, 1.0 / float(share @ (1.0 / shapes)))
    scale = float(np.sqrt(shapes.max() * shapes.min()))
    unit_m = float(chosen["sceneMetersPerUnit"])  # type: ignore[arg-type]
    return {
        **chosen,
        "albedo": tuple(source.reflectance.tolist()),
        "color": tuple((shapes[[0, 2, 1]] / scale).tolist()),
        "metersPerUnit": scale * unit_m,
    }


def shapes_per_mm(parameters: Parameters) -> FloatArray:
    """Return the shapes (3,) [1/mm] of red, green and blue that the shader uses."""
    scale = parameters.number("metersPerUnit") / parameters.number("sceneMetersPerUnit")
    return np.asarray(np.array(parameters.colour("color"))[[0, 2, 1]] * scale)


def profile(parameters: Parameters) -> Profile:
    """Return normalised diffusion, as if the samples reached everywhere."""
    return burley_profile(
        parameters.title,
        parameters.preset.name,
        parameters.colour("albedo"),
        1.0 / shapes_per_mm(parameters),
    )


def write(parameters: Parameters) -> str:
    """Return JavaScript that adds the profile to a scene."""
    body = [
        "const subSurface = scene.enableSubSurfaceForPrePass();",
        f"subSurface.metersPerUnit = {number(parameters.number('metersPerUnit'))};",
        "material.subSurface.isScatteringEnabled = true;",
        "// This adds the profile; there is room for four of one's own.",
        "material.subSurface.scatteringDiffusionProfile = "
        f"new BABYLON.Color3({numbers(parameters.colour('color'))});",
        f"material.albedoColor = new BABYLON.Color3({numbers(parameters.colour('albedo'))});",
    ]
    return lines(parameters, "//", body)


def doubts(parameters: Parameters) -> tuple[str, ...]:
    """Return warnings: unequal channels, samples that do not reach, the model's range."""
    found = list(range_warnings(parameters.colour("albedo")))
    color = parameters.colour("color")
    if len(set(color)) > 1:
        found.append(
            "The channels differ, and Babylon.js keeps them as red, blue, green and uses the "
            "colour as the shape itself: this holds for its sources of 2026, and only equal "
            "channels are safe if that changes."
        )
    last = float(diffusion_radius(1.0 - 0.5 / SAMPLES, 1.0 / max(color)))
    seen = float(diffusion_cdf(last, min(color)))
    if seen < _SEEN:
        found.append(
            f"Samples reach over {100.0 * seen:.0f} % of the widest channel's light; the largest "
            "and the smallest number of the colour should have the product 1."
        )
    return tuple(found)


BABYLON = Preset(
    name="babylon",
    engine="Babylon.js, subsurface configuration of the prepass",
    model="normalised diffusion (Christensen and Burley 2015)",
    ending=".js",
    fields=FIELDS,
    convert=convert,
    write=write,
    look=profile,
    profile=profile,
    lost="the shape of the profile beyond one distance a channel; one unit serves all profiles.",
    origin=(
        "github.com/BabylonJS/Babylon.js: packages/dev/core/src/Rendering/"
        "subSurfaceConfiguration.ts, addDiffusionProfile",
        "github.com/BabylonJS/Babylon.js: packages/dev/core/src/Shaders/"
        "subSurfaceScattering.fragment.fx, EvalBurleyDiffusionProfile",
    ),
    doubts=doubts,
)
