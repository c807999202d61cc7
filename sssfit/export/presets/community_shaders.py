"""Community Shaders for Skyrim: both of its methods, the separable one and Burley's.

``SSMode`` 0 is separable-sss with 21 taps: one unit of an offset moves by BlurRadius / 3 of what
spans half the picture, so that it is 2/3 of BlurRadius to the sides, in game units of 1.428 cm.
``SSMode`` 1 is normalised diffusion with the diffuse mean free path MeanFreePathBase.xyz; w is the
one that radii are sampled for. A radius of the shader covers 0.1428 game units of the surface,
2.04 mm, so that d = 2.04 xyz / (3.5 + 100 (A - 0.33)^4) in mm.
"""

from __future__ import annotations

import json

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.export.presets.burley import burley_profile, range_warnings
from sssfit.export.presets.fields import Field, Values
from sssfit.export.presets.record import Parameters, Preset
from sssfit.export.presets.separable import FALLOFF, STRENGTH, Words, unit_of, width_of
from sssfit.export.presets.separable_fit import fit_separable
from sssfit.export.presets.source import Source
from sssfit.kernel import Taps
from sssfit.profile import Profile
from sssfit.shapes import s_diffuse_mean_free_path

TAPS = 21
UNIT_MM = 14.28  # of a game unit
# uv = 0.1 (UNIT_MM / 10) radius 0.5 / (z tan(fov / 2)), and uv 1 spans 2 z tan(fov / 2) units.
DRAWN = 0.1 * (UNIT_MM / 10.0) * UNIT_MM
_BURLEY = 1
FIELDS = (
    Field("albedo", "1", "diffuse reflectance R_d, the texture's colour, linear", "colour",
          most=1.0),
    Field("SSMode", "", "0 for the separable kernel, 1 for normalised diffusion", "whole",
          among=(0, 1), default=0, is_chosen=True),
    Field("BlurRadius", "14.28 mm", "width of the kernel, in game units", is_above=True,
          default=1.0),
    Field("Strength", "1", "share of the light that is blurred", "colour", most=1.0,
          default=STRENGTH),
    Field("Falloff", "1", "relative width of each channel", "colour", most=1.0, default=FALLOFF),
    Field("MeanFreePath", "2.04 mm", "diffuse mean free path, xyz of MeanFreePathBase", "colour",
          is_above=True, default=(0.56, 0.56, 0.56)),
)  # fmt: skip


def unit_mm(parameters: Parameters) -> float:
    """Return the length of one unit of the offsets [mm], to the sides."""
    return unit_of(UNIT_MM * parameters.number("BlurRadius"))


WORDS = Words("albedo", "Strength", "Falloff", unit_mm, lambda _: TAPS)


def convert(source: Source, chosen: Values) -> Values:
    """Fit the kernel, or return the diffuse mean free paths of the shapes that fit best."""
    albedo = source.reflectance
    paths = s_diffuse_mean_free_path(albedo) / source.shapes_per_mm / DRAWN
    kernel: Values = {"BlurRadius": 1.0, "Strength": STRENGTH, "Falloff": FALLOFF}
    if chosen["SSMode"] != _BURLEY:
        found = fit_separable(source, TAPS)
        kernel = {
            **WORDS.values(found, albedo),
            "BlurRadius": width_of(found.unit_mm) / UNIT_MM,
        }
    return {
        **chosen,
        **kernel,
        "albedo": tuple(albedo.tolist()),
        "MeanFreePath": tuple(paths.tolist()),
    }


def distance_mm(parameters: Parameters) -> FloatArray:
    """Return d (3,) [mm] of ``SSMode`` 1, to the sides."""
    shapes = s_diffuse_mean_free_path(parameters.colour("albedo"))
    return np.asarray(DRAWN * np.array(parameters.colour("MeanFreePath")) / shapes)


def profile(parameters: Parameters) -> Profile:
    """Return normalised diffusion, or the kernel's radial profile."""
    if parameters["SSMode"] != _BURLEY:
        return WORDS.profile(parameters)
    albedo, name = parameters.colour("albedo"), parameters.preset.name
    return burley_profile(parameters.title, name, albedo, distance_mm(parameters))


def look(parameters: Parameters) -> Profile | Taps:
    """Return the profile of ``SSMode`` 1, or the table of taps."""
    is_burley = parameters["SSMode"] == _BURLEY
    return profile(parameters) if is_burley else WORDS.look(parameters)


def write(parameters: Parameters) -> str:
    """Return the feature's part of the settings file."""
    path = parameters.colour("MeanFreePath")
    profile_of = {
        "BlurRadius": parameters.number("BlurRadius"),
        "Thickness": 1.0,
        "Strength": list(parameters.colour("Strength")),
        "Falloff": list(parameters.colour("Falloff")),
    }
    settings = {
        "SSMode": int(parameters.number("SSMode")),
        "BaseProfile": profile_of,
        "MeanFreePathBase": [*path, max(path)],
    }
    return json.dumps({"Subsurface Scattering": settings}, indent=4) + "\n"


def doubts(parameters: Parameters) -> tuple[str, ...]:
    """Return a warning outside the model's range."""
    is_burley = parameters["SSMode"] == _BURLEY
    return range_warnings(parameters.colour("albedo")) if is_burley else ()


COMMUNITY_SHADERS = Preset(
    name="community-shaders",
    engine="Community Shaders for Skyrim, subsurface scattering",
    model="two passes of taps (Jimenez et al. 2012), or normalised diffusion",
    ending=".json",
    fields=FIELDS,
    convert=convert,
    write=write,
    look=look,
    profile=profile,
    lost="the round shape of the profile, and all but two numbers a channel, or one.",
    origin=(
        "github.com/community-shaders/skyrim-community-shaders: features/Subsurface Scattering/"
        "Shaders/SubsurfaceScattering/SeparableSSS.hlsli, SSSSBlurCS, and Burley.hlsli, "
        "BurleyNormalizedSS",
        "github.com/community-shaders/skyrim-community-shaders: src/Features/"
        "SubsurfaceScattering.h, DiffusionProfile",
    ),
    doubts=doubts,
)
