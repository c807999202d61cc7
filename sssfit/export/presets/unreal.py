"""Unreal Engine 5: the subsurface profile, with both switches and the older separable triple.

The profile is normalised diffusion. With ``EnableMeanFreePath`` the engine takes the mean free path
l = 10 MeanFreePathColor MeanFreePathDistance [mm], without it the diffuse mean free path. Between
the two it uses dmfp = l s3(A) / (0.6 s1(A)), s1 the fit for perpendicular light and s3 that for
diffuse mean free paths of Christensen and Burley 2015, and draws d = dmfp / s3(A). So

    d = l / (0.6 s1(A))        with EnableMeanFreePath,
    d = dmfp / (0.3 s3(A))     without: an older asset is drawn 10/3 times as wide,

both times WorldUnitScale. The factor 0.6 is the engine's own: a true mean free path is drawn
1/0.6 times as wide as the memo has it. Where ``EnableBurley`` is off, the triple ScatterRadius,
SubsurfaceColor, FalloffColor drives the kernel of separable-sss, whose offsets to 3 reach over
ScatterRadius.
"""

from __future__ import annotations

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.export.presets.burley import burley_profile, range_warnings
from sssfit.export.presets.fields import Field, Values
from sssfit.export.presets.record import Parameters, Preset
from sssfit.export.presets.separable import FALLOFF, KERNEL_RANGE, STRENGTH, Words
from sssfit.export.presets.source import Source
from sssfit.export.presets.text import identifier, lines, number, numbers
from sssfit.kernel import Taps
from sssfit.profile import Profile
from sssfit.shapes import s_diffuse_mean_free_path, s_perpendicular

MEAN_FREE_PATH = 0.6  # of l for dmfp: what the engine multiplies by between its two switches
OLDER_SCALE = 0.3  # of assets with diffuse mean free paths: 3 of a kernel's units, in cm and mm
_LEAST_DISTANCE_CM = 0.1
_LEAST_COLOUR = 0.009  # smaller numbers are raised to it when the engine makes its texture
_CM = 10.0
_TAPS = 25  # thirteen of one side: the engine's largest table

FIELDS = (
    Field("SurfaceAlbedo", "1", "diffuse reflectance R_d, linear", "colour", most=1.0),
    Field(
        "MeanFreePathColor",
        "1",
        "share of MeanFreePathDistance of each channel",
        "colour",
        most=1.0,
        is_above=True,
        default=(1.0, 1.0, 1.0),
    ),
    Field(
        "MeanFreePathDistance",
        "cm",
        "mean free path, or diffuse mean free path, of the widest channel",
        least=0.0,
        most=50.0,
        is_above=True,
        default=1.2,
    ),
    Field(
        "WorldUnitScale",
        "1",
        "world units of 1 cm that one unit of the mesh has",
        least=0.0,
        most=50.0,
        is_above=True,
        default=1.0,
        is_chosen=True,
    ),
    Field("EnableBurley", "", "normalised diffusion, not the older kernel", "flag", default=True),
    Field(
        "EnableMeanFreePath",
        "",
        "the distance is a mean free path, not a diffuse one",
        "flag",
        default=True,
        is_chosen=True,
    ),
    Field("Tint", "1", "share of the light that is blurred", "colour", most=1.0,
          default=(1.0, 1.0, 1.0)),
    Field("ScatterRadius", "cm", "reach of the older kernel", is_above=True, most=50.0,
          default=1.2),
    Field("SubsurfaceColor", "1", "strength of the older kernel", "colour", most=1.0,
          default=STRENGTH),
    Field("FalloffColor", "1", "relative width of the older kernel", "colour", most=1.0,
          default=FALLOFF),
    Field(
        "match",
        "",
        "what is matched: the profile itself, or the material's mean free paths",
        "choice",
        among=("profile", "coefficients"),
        default="profile",
        is_chosen=True,
    ),
)  # fmt: skip


def distance_mm(parameters: Parameters) -> FloatArray:
    """Return d (3,) [mm] of a profile with ``EnableBurley``."""
    albedo = np.array(parameters.colour("SurfaceAlbedo"))
    path_mm = _CM * np.array(parameters.colour("MeanFreePathColor"))
    path_mm = path_mm * parameters.number("MeanFreePathDistance")
    path_mm = path_mm * parameters.number("WorldUnitScale")
    if parameters["EnableMeanFreePath"]:
        return np.asarray(path_mm / (MEAN_FREE_PATH * s_perpendicular(albedo)))
    return np.asarray(path_mm / (OLDER_SCALE * s_diffuse_mean_free_path(albedo)))


def convert(source: Source, chosen: Values) -> Values:
    """Return albedo, mean free paths and switches."""
    albedo = source.reflectance
    if chosen["match"] == "coefficients":
        layer = source.layer("mean free paths are asked for")
        wide_mm = layer.mean_free_path_mm
        if not chosen["EnableMeanFreePath"]:
            wide_mm = 1.0 / np.sqrt(3.0 * layer.sigma_a_per_mm * layer.reduced_sigma_t_per_mm)
    elif chosen["EnableMeanFreePath"]:
        wide_mm = MEAN_FREE_PATH * s_perpendicular(albedo) / source.shapes_per_mm
    else:
        wide_mm = OLDER_SCALE * s_diffuse_mean_free_path(albedo) / source.shapes_per_mm
    wide_cm = wide_mm / _CM / float(chosen["WorldUnitScale"])  # type: ignore[arg-type]
    distance_cm = max(float(wide_cm.max()), _LEAST_DISTANCE_CM)
    return {
        **chosen,
        "SurfaceAlbedo": tuple(albedo.tolist()),
        "MeanFreePathColor": tuple((wide_cm / distance_cm).tolist()),
        "MeanFreePathDistance": distance_cm,
        **_kept(),
    }


def _kept() -> Values:
    """Return the values of fields that a conversion leaves at their defaults."""
    names = {"EnableBurley", "Tint", "ScatterRadius", "SubsurfaceColor", "FalloffColor"}
    return {each.name: each.read(each.default) for each in FIELDS if each.name in names}


def unit_mm(parameters: Parameters) -> float:
    """Return the length of one unit of the older kernel's offsets [mm]."""
    return _CM * parameters.number("ScatterRadius") / KERNEL_RANGE


WORDS = Words("SurfaceAlbedo", "SubsurfaceColor", "FalloffColor", unit_mm, lambda _: _TAPS)


def profile(parameters: Parameters) -> Profile:
    """Return normalised diffusion, or the radial profile of the older kernel."""
    if not parameters["EnableBurley"]:
        return WORDS.profile(parameters)
    albedo, name = parameters.colour("SurfaceAlbedo"), parameters.preset.name
    blurred = parameters.colour("Tint")
    return burley_profile(parameters.title, name, albedo, distance_mm(parameters), blurred)


def look(parameters: Parameters) -> Profile | Taps:
    """Return the profile, or the taps of the older kernel."""
    return profile(parameters) if parameters["EnableBurley"] else WORDS.look(parameters)


def doubts(parameters: Parameters) -> tuple[str, ...]:
    """Return warnings: the range of the model, and channels that the engine raises."""
    found = list(range_warnings(parameters.colour("SurfaceAlbedo")))
    if min(parameters.colour("MeanFreePathColor")) < _LEAST_COLOUR:
        found.append(
            f"The engine raises numbers of MeanFreePathColor below {_LEAST_COLOUR:g} to it, so the "
            "narrowest channel is drawn wider."
        )
    return tuple(found)


def write(parameters: Parameters) -> str:
    """Return a script for the editor's Python that makes the asset."""
    colours = ("SurfaceAlbedo", "MeanFreePathColor", "Tint")
    body = [
        "import unreal",
        "",
        "settings = unreal.SubsurfaceProfileStruct()",
        *(
            f'settings.set_editor_property("{_snake(each)}", '
            f"unreal.LinearColor({numbers(parameters.colour(each))}, 1.0))"
            for each in colours
        ),
        *(
            f'settings.set_editor_property("{_snake(each)}", {number(parameters.number(each))})'
            for each in ("MeanFreePathDistance", "WorldUnitScale")
        ),
        *(
            f'settings.set_editor_property("{_snake(each)}", {bool(parameters[each])})'
            for each in ("EnableBurley", "EnableMeanFreePath")
        ),
        "asset = unreal.AssetToolsHelpers.get_asset_tools().create_asset(",
        f'    "SP_{identifier(parameters.title)}", "/Game", unreal.SubsurfaceProfile, '
        "unreal.SubsurfaceProfileFactory()",
        ")",
        'asset.set_editor_property("settings", settings)',
    ]
    return lines(parameters, "#", body)


def _snake(name: str) -> str:
    """Return a property's name as the editor's Python spells it."""
    return "".join(f"_{c.lower()}" if c.isupper() else c for c in name).lstrip("_")


UNREAL = Preset(
    name="unreal",
    engine="Unreal Engine 5, subsurface profile",
    model="normalised diffusion (Christensen and Burley 2015)",
    ending=".py",
    fields=FIELDS,
    convert=convert,
    write=write,
    look=look,
    profile=profile,
    lost="the shape of the profile beyond one distance a channel, and the refractive index.",
    origin=(
        "P. H. Christensen, B. Burley 2015, technical memo 15-04, two of the three fits of s",
        "github.com/EpicGames/UnrealEngine: Engine/Shaders/Private/BurleyNormalizedSSSCommon.ush, "
        "the conversion of mean free paths (open to licensees)",
        "github.com/community-shaders/skyrim-community-shaders: features/Subsurface Scattering/"
        "Shaders/SubsurfaceScattering/Burley.hlsli, GetScalingFactor",
        "github.com/iryoku/separable-sss: Demo/Code/SeparableSSS.cpp, calculateKernel",
    ),
    doubts=doubts,
)
