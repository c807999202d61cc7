"""The steps from a material's numbers to each engine's parameters, in words with units.

``make_engines.py`` writes them into docs/engines.md. A step function takes the source and the
parameters of a preset; what a step says is computed from the source where it can be.
"""

import math

import numpy as np

from sssfit.export.presets.blender import cycles_albedo
from sssfit.shapes import s_perpendicular


def text(values, form=".4g"):
    """Return one number, or those of the channels."""
    if isinstance(values, str | bool):
        return str(values).lower() if isinstance(values, bool) else values
    return ", ".join(f"{each:{form}}" for each in np.atleast_1d(values))


def begin(source):
    """Return what all walks start from."""
    layer = source.material.layers[0]
    d = 1.0 / source.shapes_per_mm
    return [
        f"sigma_a = {text(layer.sigma_a_per_mm)} per mm, sigma_s = {text(layer.sigma_s_per_mm)} "
        f"per mm, g = 0, eta = {source.eta:g}",
        f"mean free path l = 1 / (sigma_a + sigma_s) = {text(layer.mean_free_path_mm)} mm",
        f"diffuse reflectance by the exact solver, of the incident light: R_d = "
        f"{text(source.reflectance)}",
        f"of the light that enters, R_d / (1 - R_sp) with R_sp = "
        f"{text(source.profile.specular_reflectance)}: {text(source.entering_colour)}",
        f"normalised diffusion that fits the profile best: s = {text(source.shapes_per_mm)} "
        f"per mm, d = 1 / s = {text(d)} mm",
    ]


def of_unreal(source, found):
    """Return steps to Unreal's parameters."""
    scaling = s_perpendicular(source.reflectance)
    path_mm = 0.6 * scaling / source.shapes_per_mm
    return [
        f"s1(A) = 1.85 - A + 7 |A - 0.8|^3 with A = R_d: {text(scaling)}",
        f"mean free path that draws d: 0.6 s1 d = {text(path_mm)} mm = {text(path_mm / 10)} cm",
        f"MeanFreePathDistance = the largest, {text(found['MeanFreePathDistance'])} cm; "
        f"MeanFreePathColor = shares of it, {text(found['MeanFreePathColor'])}",
    ]


def of_distances(scale, unit, share):
    """Return steps of engines that take d as a length and shares of it."""

    def steps(source, found):
        d = 1.0 / source.shapes_per_mm
        half = " / 2, since the pass moves twice as far" if share == "scatterColor" else ""
        return [
            f"{scale} = the largest d{half}: {text(d.max())} mm gives {text(found[scale])} {unit}",
            f"{share} = shares of it: {text(d / d.max())}",
        ]

    return steps


def of_blender(_, found):
    """Return steps to Blender's random walk."""
    colour = np.array(found["base_color"])
    radius_mm = 1000.0 * found["subsurface_scale"] * np.array(found["subsurface_radius"])
    return [
        f"base colour = R_d / (1 - R_sp): {text(colour)}",
        f"Cycles walks with the albedo {text(cycles_albedo(colour))}, without an interface",
        f"mean free path whose walk is as wide as the profile: {text(radius_mm / (4 * math.pi))} "
        "mm",
        f"radius = 4 pi of these: {text(radius_mm)} mm; subsurface_scale = the largest, "
        f"{text(found['subsurface_scale'])} m; subsurface_radius = shares, "
        f"{text(found['subsurface_radius'])}",
    ]


def of_separable(width, strength, falloff, unit, mm):
    """Return steps of engines that run the taps of separable-sss."""

    def steps(_, found):
        wide_mm = found[width] * mm
        return [
            f"taps fitted to the picture: one unit of an offset is {text(2.0 * wide_mm / 3.0)} mm, "
            f"strength {text(found[strength])}, falloff {text(found[falloff])}",
            f"{width} = 3/2 of a unit: {text(wide_mm)} mm = {text(found[width])} {unit}",
        ]

    return steps


def of_babylon(source, found):
    """Return steps to Babylon's colour."""
    shapes = source.shapes_per_mm
    return [
        f"k = sqrt(s_max s_min) = {text(math.sqrt(shapes.max() * shapes.min()))} per mm",
        f"s / k = {text(shapes / math.sqrt(shapes.max() * shapes.min()))}; colour, in the order "
        f"red, blue, green: {text(found['color'])}",
        f"metersPerUnit = k times 1 m a unit: {text(found['metersPerUnit'])} m",
    ]


def of_colour(radius, unit_mm, scale):
    """Return steps to a colour and a mean free path in the scene's units."""

    def steps(source, found):
        path_mm = source.material.layers[0].mean_free_path_mm
        return [
            f"subsurface_color = R_d / (1 - R_sp): {text(found['subsurface_color'])}",
            f"{radius} = the longest l: {text(path_mm.max())} mm = "
            f"{text(path_mm.max() / unit_mm)} units of {unit_mm:g} mm",
            f"{scale} = shares of it: {text(path_mm / path_mm.max())}",
        ]

    return steps


def of_pbrt(_, found):
    """Return steps to pbrt's coefficients."""
    return [
        f"sigma_a = {text(found['sigma_a'])} per mm, sigma_s = {text(found['sigma_s'])} per mm",
        f"scale = {text(found['scale'])} mm in the scene's unit",
    ]


def of_mitsuba(source, found):
    """Return steps to Mitsuba's coefficients."""
    sigma_t = source.material.layers[0].sigma_t_per_mm
    return [
        f"sigma_t = {text(sigma_t)} per mm; scale = the largest, {text(found['scale'])} per unit "
        f"of 1 mm; sigma_t as shares, {text(found['sigma_t'])}",
        f"albedo = sigma_s / sigma_t = {text(found['albedo'])}",
    ]


def of_gltf(source, found):
    """Return steps to glTF's extensions."""
    layer = source.material.layers[0]
    s = np.sqrt(1.0 - layer.albedo)
    return [
        f"attenuationDistance = the longest l: {text(layer.mean_free_path_mm.max())} mm = "
        f"{text(found['attenuationDistance'])} m",
        f"attenuationColor = exp(-sigma_t distance) = {text(found['attenuationColor'])}",
        f"s = sqrt(1 - albedo) = {text(s)}; the C whose formula gives it: "
        f"{text(found['multiscatterColor'])}",
    ]


STEPS = {
    "iryoku": of_separable("sssWidth", "strength", "falloff", "m", 1000.0),
    "unreal": of_unreal,
    "hdrp": of_distances("scatteringDistanceMultiplier", "mm", "scatteringDistance"),
    "blender": of_blender,
    "godot": of_separable("subsurface_scattering_depth_scale", "strength", "falloff", "m", 1000.0),
    "babylon": of_babylon,
    "openpbr": of_colour("subsurface_radius", 10.0, "subsurface_radius_scale"),
    "materialx": of_colour("subsurface_scale", 10.0, "subsurface_radius"),
    "pbrt": of_pbrt,
    "mitsuba": of_mitsuba,
    "gltf": of_gltf,
    "stride": of_separable("ScatteringWidth", "Strength", "Falloff", "m", 1000.0),
    "o3de": of_distances("scatterDistance", "mm", "scatterColor"),
    "community-shaders": of_separable(
        "BlurRadius", "Strength", "Falloff", "game units of 14.28 mm", 14.28
    ),
}
