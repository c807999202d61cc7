"""OpenPBR Surface: subsurface colour, radius and radius scale, as a MaterialX document.

The specification defines the radius times its scale as the mean free path 1 / sigma_t by channel,
in the scene's unit, and the colour C by

    E_multi-scatter = (1 - E_spec) C

for light along the normal on a half space of the medium below the dielectric interface, E_spec what
the interface reflects. So C = R_d / (1 - R_sp) with the R_d of this program, and the albedo for a
colour is its exact inversion. Renderers approximate this; most use Kulla and Conty's formula, which
leaves the interface out.
"""

from __future__ import annotations

import numpy as np

from sssfit.export.presets import medium
from sssfit.export.presets.fields import Field, Values
from sssfit.export.presets.materialx import document, value
from sssfit.export.presets.record import Parameters, Preset
from sssfit.export.presets.source import Source
from sssfit.material import Material

FIELDS = (
    Field("subsurface_color", "1", "R_d / (1 - R_sp) for light along the normal, linear", "colour",
          most=1.0),
    Field("subsurface_radius", "unit", "largest mean free path, in the scene's units",
          is_above=True),
    Field("subsurface_radius_scale", "1", "share of the radius of each channel", "colour", most=1.0,
          is_above=True, default=(1.0, 0.5, 0.25)),
    Field("subsurface_scatter_anisotropy", "1", "mean cosine g of scattering", least=-0.99,
          most=0.99, default=0.0),
    Field("specular_ior", "1", "refractive index", least=1.0, most=3.0, default=1.5),
    Field("mm_per_unit", "mm", "length of the scene's unit", is_above=True, default=10.0,
          is_chosen=True),
)  # fmt: skip


def convert(source: Source, chosen: Values) -> Values:
    """Return the medium in the specification's terms; exact."""
    path_mm, albedo, g, eta = medium.medium_of(source)
    unit_mm = float(chosen["mm_per_unit"])  # type: ignore[arg-type]
    return {
        **chosen,
        "subsurface_color": tuple(medium.entering_colour(albedo, g, eta).tolist()),
        "subsurface_radius": float(path_mm.max()) / unit_mm,
        "subsurface_radius_scale": tuple((path_mm / path_mm.max()).tolist()),
        "subsurface_scatter_anisotropy": g,
        "specular_ior": eta,
    }


def material(parameters: Parameters) -> Material:
    """Return the medium, its albedo by the exact inversion of the colour."""
    eta, g = parameters.number("specular_ior"), parameters.number("subsurface_scatter_anisotropy")
    path_mm = parameters.number("mm_per_unit") * parameters.number("subsurface_radius")
    scale = np.array(parameters.colour("subsurface_radius_scale"))
    return medium.half_space(
        parameters.title,
        parameters.preset.name,
        path_mm * scale,
        medium.albedo_of_colour(parameters.colour("subsurface_color"), g, eta),
        g=g,
        eta=eta,
    )


def write(parameters: Parameters) -> str:
    """Return a MaterialX document with one open_pbr_surface."""
    inputs = {
        "base_weight": ("float", value(1.0)),
        "specular_ior": ("float", value(parameters.number("specular_ior"))),
        "subsurface_weight": ("float", value(1.0)),
        "subsurface_color": ("color3", value(*parameters.colour("subsurface_color"))),
        "subsurface_radius": ("float", value(parameters.number("subsurface_radius"))),
        "subsurface_radius_scale": (
            "color3",
            value(*parameters.colour("subsurface_radius_scale")),
        ),
        "subsurface_scatter_anisotropy": (
            "float",
            value(parameters.number("subsurface_scatter_anisotropy")),
        ),
    }
    return document(parameters, "open_pbr_surface", inputs)


OPENPBR = Preset(
    name="openpbr",
    engine="OpenPBR Surface 1.1, as MaterialX",
    model="a random walk in a half space below a dielectric interface",
    ending=".mtlx",
    fields=FIELDS,
    convert=convert,
    write=write,
    look=medium.exact_look(material),
    profile=medium.exact_look(material),
    lost="nothing if all channels have one g; a renderer's own inversion of the colour may err.",
    origin=(
        "github.com/AcademySoftwareFoundation/OpenPBR: index.md.html, Subsurface, the definition "
        "of subsurface_color",
    ),
    material=material,
    losses=medium.losses,
)
