"""Open 3D Engine: scatterColor and scatterDistance of the EnhancedPBR and Skin materials.

Normalised diffusion with d = scatterColor scatterDistance by channel, in mm. The pass multiplies
radii by `projectionMatrix[0][0]` / depth times the picture's width in pixels, where half the width
spans that: light moves twice as far as the radius says, so d on the surface is twice the number.
"""

from __future__ import annotations

import json

import numpy as np

from sssfit.export.presets.burley import burley_profile, range_warnings, widest_and_shares
from sssfit.export.presets.fields import Field, Values
from sssfit.export.presets.record import Parameters, Preset
from sssfit.export.presets.source import Source
from sssfit.profile import Profile

_DRAWN = 2.0  # radius on the surface per radius in the shader
FIELDS = (
    Field("baseColor", "1", "diffuse reflectance R_d, linear", "colour", most=1.0),
    Field("scatterColor", "1", "share of scatterDistance of each channel", "colour", most=1.0,
          is_above=True),
    Field("scatterDistance", "mm", "half the distance d of the widest channel", is_above=True),
    Field("quality", "1", "share of the 200 samples of a pixel", least=0.2, most=1.0, default=0.4,
          is_chosen=True),
)  # fmt: skip


def convert(source: Source, chosen: Values) -> Values:
    """Return the distances of the shapes that fit best."""
    widest, shares = widest_and_shares(source)
    return {
        **chosen,
        "baseColor": tuple(source.reflectance.tolist()),
        "scatterColor": shares,
        "scatterDistance": widest / _DRAWN,
    }


def profile(parameters: Parameters) -> Profile:
    """Return normalised diffusion."""
    distance_mm = parameters.number("scatterDistance") * np.array(parameters.colour("scatterColor"))
    return burley_profile(
        parameters.title,
        parameters.preset.name,
        parameters.colour("baseColor"),
        _DRAWN * distance_mm,
    )


def write(parameters: Parameters) -> str:
    """Return a .material document."""
    group = "subsurfaceScattering"
    values = {
        "baseColor.color": [*parameters.colour("baseColor"), 1.0],
        f"{group}.enableSubsurfaceScattering": True,
        f"{group}.subsurfaceScatterFactor": 1.0,
        f"{group}.scatterColor": [*parameters.colour("scatterColor"), 1.0],
        f"{group}.scatterDistance": parameters.number("scatterDistance"),
        f"{group}.quality": parameters.number("quality"),
    }
    document = {
        "description": f"{parameters.title}, {parameters.preset.model}, by sssfit",
        "materialType": "@gemroot:Atom_Feature_Common@/Assets/Materials/Types/"
        "EnhancedPBR.materialtype",
        "propertyValues": values,
    }
    return json.dumps(document, indent=4) + "\n"


def doubts(parameters: Parameters) -> tuple[str, ...]:
    """Return a warning outside the model's range."""
    return range_warnings(parameters.colour("baseColor"))


O3DE = Preset(
    name="o3de",
    engine="Open 3D Engine, EnhancedPBR material",
    model="normalised diffusion (Christensen and Burley 2015)",
    ending=".material",
    fields=FIELDS,
    convert=convert,
    write=write,
    look=profile,
    profile=profile,
    lost="the shape of the profile beyond one distance a channel.",
    origin=(
        "github.com/o3de/o3de: Gems/Atom/Feature/Common/Assets/Shaders/PostProcessing/"
        "ScreenSpaceSubsurfaceScatteringCS.azsl, MainCS",
        "github.com/o3de/o3de: Gems/Atom/Feature/Common/Code/Source/Material/"
        "SubsurfaceTransmissionParameterFunctor.cpp, Process",
    ),
    doubts=doubts,
)
