"""Blender: base colour, subsurface radius and scale of the Principled BSDF, by method.

With l = radius times scale in the scene's metres,

    burley           Cycles: d = l / (4 pi);
    eevee            the same node in EEVEE: d = l / (4 pi s2(A / max A)), the memo's s for diffuse
                     light, s2 = 1.9 - A + 3.5 (A - 0.8)^2;
    random_walk      mean free path l / (4 pi);
    random_walk_skin mean free path l sqrt(3 (1 - alpha')), alpha' that of the classical dipole
                     whose reflectance is the base colour, at the subsurface index.

The walk begins with a cosine below the surface and meets no interface on its way out. Cycles turns
the colour into its albedo by a fit to such walks (`cycles_albedo`). The look of both walks is the
exact profile of that medium without an interface, brought to the colour's energy; it is lit along
the normal.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq

from sssfit.arrays import FloatArray
from sssfit.export.presets import medium
from sssfit.export.presets.burley import burley_profile, range_warnings
from sssfit.export.presets.fields import Field, Values
from sssfit.export.presets.record import Parameters, Preset
from sssfit.export.presets.source import Source, source_of
from sssfit.export.presets.text import lines, number, numbers
from sssfit.optics import normal_transmittance
from sssfit.profile import Profile
from sssfit.shapes import s_diffuse
from sssfit.simulate import simulate_exact
from sssfit.simulate.dipole import mismatch_by_polynomial

METHODS = ("burley", "eevee", "random_walk", "random_walk_skin")
_ROUNDING = 1e-9  # of a share
_MM = 1000.0
_SPAN = 4.0 * math.pi
_LEAST_ALBEDO = 0.2  # Cycles raises smaller albedos of walks to it, and dims the light instead
FIELDS = (
    Field("base_color", "1", "R_d / (1 - R_sp), the share of the entering light, linear", "colour",
          most=1.0, is_above=True),
    Field("subsurface_radius", "1", "radius of each channel, as a share of the scale", "colour",
          is_above=True, default=(1.0, 0.2, 0.1)),
    Field("subsurface_scale", "m", "radius of the widest channel", is_above=True, default=0.05),
    Field("ior", "1", "refractive index; that of the subsurface for random_walk_skin", least=1.01,
          most=3.8, default=1.4),
    Field("method", "", "method of the node, and EEVEE", "choice", among=METHODS,
          default="random_walk", is_chosen=True),
    Field("meters_per_unit", "m", "length of the scene's unit", is_above=True, default=1.0,
          is_chosen=True),
)  # fmt: skip


def cycles_albedo(colour: npt.ArrayLike) -> FloatArray:
    """Return the single-scattering albedo that Cycles walks with for a colour, g = 0.

    (1 - b) 1.82605 atan(5.11247 C)^1.09686 + b 0.49631 atan(4.23501 C)^2.40603, b = C^(1/4), at
    most 0.999999 (``subsurface_random_walk_remap``).
    """
    c = np.asarray(colour, dtype=np.float64)
    blend = c**0.25
    low = 1.8260523782 * np.arctan((4.98511194385 + 0.127355959438) * c) ** 1.09686102424
    high = 0.496310210422 * np.arctan((4.23190299701 + 0.00310603949088) * c) ** 2.40602999408
    return np.asarray(np.clip((1.0 - blend) * low + blend * high, _LEAST_ALBEDO, 0.999999))


def dipole_albedo(reflectance: float, eta: float) -> float:
    """Return alpha' of the classical dipole with a reflectance, as of ``random_walk_skin``."""
    third = 4.0 / 3.0 * mismatch_by_polynomial(eta)

    def excess(alpha: float) -> float:
        s = math.sqrt(3.0 * (1.0 - alpha))
        return 0.5 * alpha * (1.0 + math.exp(-third * s)) * math.exp(-s) - reflectance

    if reflectance >= _BRIGHTEST:
        return 0.999999
    return float(brentq(excess, 0.0, 1.0, xtol=1e-15))


_BRIGHTEST = 0.995  # from here on Cycles takes the albedo .999999


def widths_mm(method: str, colour: FloatArray, eta: float) -> FloatArray:
    """Return what 1 mm of radius times scale is worth (3,) [mm]: d, or the mean free path."""
    if method == "random_walk_skin":
        alpha = np.array([dipole_albedo(each, eta) for each in colour.tolist()])
        return np.asarray(np.sqrt(3.0 * (1.0 - alpha)))
    own = s_diffuse(colour / colour.max()) if method == "eevee" else np.ones(3)
    return np.asarray(1.0 / (_SPAN * own))


def convert(source: Source, chosen: Values) -> Values:
    """Return colour and radii whose look has the profile's widths.

    A walk's own shape is first taken for equal paths, then corrected once with the look itself,
    whose channels share a grid: what it draws then gives the same radii to 1e-8.
    """
    method, eta = str(chosen["method"]), _index(source)
    colour = np.minimum(source.reflectance / normal_transmittance(eta), 1.0)
    shapes = source.shapes_per_mm
    width_mm = (_walk_shapes(colour) if "walk" in method else 1.0) / shapes
    if "walk" in method:
        drawn = _walk_look(source.title, colour, width_mm, colour * normal_transmittance(eta))
        width_mm = width_mm * source_of(drawn).shapes_per_mm / shapes
    radius_mm = width_mm / widths_mm(method, colour, eta)
    unit_mm = _MM * float(chosen["meters_per_unit"])  # type: ignore[arg-type]
    return {
        **chosen,
        "base_color": tuple(colour.tolist()),
        "subsurface_radius": tuple((radius_mm / radius_mm.max()).tolist()),
        "subsurface_scale": float(radius_mm.max()) / unit_mm,
        "ior": eta,
    }


def _index(source: Source) -> float:
    """Return the refractive index within the limits of the node."""
    return min(max(source.eta, 1.01), 3.8)


def losses(source: Source) -> tuple[str, ...]:
    """Return a warning where more light returns than from white below the interface."""
    eta = _index(source)
    most, wanted = normal_transmittance(eta), float(source.reflectance.max())
    if wanted <= most * (1.0 + _ROUNDING):
        return ()
    return (
        f"Below the interface of index {eta:g} a white base colour returns {most:.4g} of the "
        f"light, and {source.title} returns {wanted:.4g}: it is drawn darker.",
    )


def _walk_shapes(colour: FloatArray) -> FloatArray:
    """Return the shape (3,) of Cycles' walk for a colour, for a mean free path of 1."""
    walk = medium.half_space("walk", "blender", np.ones(3), cycles_albedo(colour), eta=1.0)
    return source_of(simulate_exact(walk)).shapes_per_mm


def profile(parameters: Parameters) -> Profile:
    """Return the profile of the method, with the colour's energy below the interface."""
    method, eta = str(parameters["method"]), parameters.number("ior")
    colour = np.array(parameters.colour("base_color"))
    scale_mm = _MM * parameters.number("subsurface_scale") * parameters.number("meters_per_unit")
    radius_mm = scale_mm * np.array(parameters.colour("subsurface_radius"))
    width_mm = radius_mm * widths_mm(method, colour, eta)
    total = colour * normal_transmittance(eta)
    if "walk" not in method:
        return burley_profile(parameters.title, parameters.preset.name, total, width_mm)
    return _walk_look(parameters.title, colour, width_mm, total)


def _walk_look(title: str, colour: FloatArray, path_mm: FloatArray, total: FloatArray) -> Profile:
    """Return the exact profile of Cycles' medium, brought to the totals (3,), by title."""
    walk = medium.half_space("walk", "blender", path_mm, cycles_albedo(colour), eta=1.0)
    found = simulate_exact(walk)
    share = total / found.diffuse_reflectance
    named = {"name": title, "source": "preset blender"}
    return dataclasses.replace(
        found,
        annulus_energy=found.annulus_energy * share,
        annulus_energy_stderr=found.annulus_energy_stderr * share,
        beyond_grid=found.beyond_grid * share,
        beyond_grid_stderr=found.beyond_grid_stderr * share,
        absorbed=np.zeros((0, 3)),
        meta={**found.meta, "method": "blender", "material_sha256": None, "material": named},
    )


def write(parameters: Parameters) -> str:
    """Return Python for Blender that makes the material."""
    method = {"eevee": "BURLEY"}.get(str(parameters["method"]), str(parameters["method"]).upper())
    rows = {
        "Base Color": f"({numbers(parameters.colour('base_color'))}, 1.0)",
        "Subsurface Weight": "1.0",
        "Subsurface Radius": f"({numbers(parameters.colour('subsurface_radius'))})",
        "Subsurface Scale": number(parameters.number("subsurface_scale")),
        "IOR": number(parameters.number("ior")),
    }
    if method == "RANDOM_WALK_SKIN":
        rows["Subsurface IOR"] = number(parameters.number("ior"))
    body = [
        "import bpy",
        "",
        f"material = bpy.data.materials.new({parameters.title!r})",
        "material.use_nodes = True",
        'node = material.node_tree.nodes["Principled BSDF"]',
        f'node.subsurface_method = "{method}"',
        *(f'node.inputs["{key}"].default_value = {value}' for key, value in rows.items()),
    ]
    return lines(parameters, "#", body)


def doubts(parameters: Parameters) -> tuple[str, ...]:
    """Return warnings: the range of Burley's methods, and albedos that Cycles raises."""
    colour = np.array(parameters.colour("base_color"))
    if "walk" not in str(parameters["method"]):
        return range_warnings(colour)
    if float(cycles_albedo(colour).min()) > _LEAST_ALBEDO:
        return ()
    return (
        f"Cycles walks dark channels with an albedo of {_LEAST_ALBEDO:g} and dims the light, so "
        "their profile is not that of their colour.",
    )


BLENDER = Preset(
    name="blender",
    engine="Blender, Principled BSDF in Cycles and EEVEE",
    model="a random walk without an interface, or normalised diffusion",
    ending=".py",
    fields=FIELDS,
    convert=convert,
    write=write,
    look=profile,
    profile=profile,
    lost="the interface on the way out; by Burley's methods all but one distance a channel.",
    origin=(
        "github.com/blender/blender: intern/cycles/kernel/closure/bssrdf.h, bssrdf_setup_radius",
        "github.com/blender/blender: intern/cycles/kernel/integrator/subsurface_random_walk.h, "
        "subsurface_random_walk_remap",
        "github.com/blender/blender: source/blender/draw/engines/eevee_next/shaders/"
        "eevee_subsurface_convolve_comp.glsl, burley_setup",
    ),
    doubts=doubts,
    losses=losses,
)
