"""MaterialX: the subsurface part of its standard surface, as a document.

standard_surface takes the radius times the scale as mean free paths by channel, in the scene's
unit, and a colour. The colour is taken for R_d / (1 - R_sp), as OpenPBR, its successor, defines it;
its own text says "the color of the subsurface scattering effect" and no more.
"""

from __future__ import annotations

from collections.abc import Mapping
from xml.sax.saxutils import quoteattr

import numpy as np

from sssfit.export.presets import medium
from sssfit.export.presets.fields import Field, Values
from sssfit.export.presets.record import Parameters, Preset
from sssfit.export.presets.source import Source
from sssfit.export.presets.text import identifier, xml_comment
from sssfit.material import Material

VERSION = "1.39"
FIELDS = (
    Field("subsurface_color", "1", "R_d / (1 - R_sp) for light along the normal, linear", "colour",
          most=1.0),
    Field("subsurface_radius", "1", "mean free path of each channel, as a share of the scale",
          "colour", is_above=True, default=(1.0, 1.0, 1.0)),
    Field("subsurface_scale", "unit", "length that the radius is a share of, in the scene's units",
          is_above=True, default=1.0),
    Field("subsurface_anisotropy", "1", "mean cosine g of scattering", least=-0.99, most=0.99,
          default=0.0),
    Field("specular_IOR", "1", "refractive index", least=1.0, most=3.0, default=1.5),
    Field("mm_per_unit", "mm", "length of the scene's unit", is_above=True, default=10.0,
          is_chosen=True),
)  # fmt: skip


def convert(source: Source, chosen: Values) -> Values:
    """Return the medium in the surface's terms."""
    path_mm, albedo, g, eta = medium.medium_of(source)
    unit_mm = float(chosen["mm_per_unit"])  # type: ignore[arg-type]
    return {
        **chosen,
        "subsurface_color": tuple(medium.entering_colour(albedo, g, eta).tolist()),
        "subsurface_radius": tuple((path_mm / path_mm.max()).tolist()),
        "subsurface_scale": float(path_mm.max()) / unit_mm,
        "subsurface_anisotropy": g,
        "specular_IOR": eta,
    }


def material(parameters: Parameters) -> Material:
    """Return the medium, its albedo by the exact inversion of the colour."""
    eta, g = parameters.number("specular_IOR"), parameters.number("subsurface_anisotropy")
    path_mm = parameters.number("mm_per_unit") * parameters.number("subsurface_scale")
    return medium.half_space(
        parameters.title,
        parameters.preset.name,
        path_mm * np.array(parameters.colour("subsurface_radius")),
        medium.albedo_of_colour(parameters.colour("subsurface_color"), g, eta),
        g=g,
        eta=eta,
    )


def value(*numbers: float) -> str:
    """Return numbers as a MaterialX value."""
    return ", ".join(f"{each:.9g}" for each in numbers)


def document(parameters: Parameters, category: str, inputs: Mapping[str, tuple[str, str]]) -> str:
    """Return a MaterialX document: a shader of a category with inputs, and its material.

    ``inputs`` are types and values by name.
    """
    name = identifier(parameters.title)
    name = name if name[0].isalpha() else f"m_{name}"
    rows = [
        f"    <input name={quoteattr(key)} type={quoteattr(kind)} value={quoteattr(text)} />"
        for key, (kind, text) in inputs.items()
    ]
    return "\n".join(
        [
            '<?xml version="1.0"?>',
            f'<materialx version="{VERSION}" colorspace="lin_rec709">',
            f"  <!--\n{xml_comment(parameters)}\n  -->",
            f'  <{category} name="SR_{name}" type="surfaceshader">',
            *rows,
            f"  </{category}>",
            f'  <surfacematerial name="M_{name}" type="material">',
            f'    <input name="surfaceshader" type="surfaceshader" nodename="SR_{name}" />',
            "  </surfacematerial>",
            "</materialx>",
            "",
        ]
    )


def write(parameters: Parameters) -> str:
    """Return a MaterialX document with one standard_surface."""
    inputs = {
        "specular_IOR": ("float", value(parameters.number("specular_IOR"))),
        "subsurface": ("float", value(1.0)),
        "subsurface_color": ("color3", value(*parameters.colour("subsurface_color"))),
        "subsurface_radius": ("color3", value(*parameters.colour("subsurface_radius"))),
        "subsurface_scale": ("float", value(parameters.number("subsurface_scale"))),
        "subsurface_anisotropy": ("float", value(parameters.number("subsurface_anisotropy"))),
    }
    return document(parameters, "standard_surface", inputs)


MATERIALX = Preset(
    name="materialx",
    engine="MaterialX 1.39, standard_surface",
    model="a random walk in a half space below a dielectric interface",
    ending=".mtlx",
    fields=FIELDS,
    convert=convert,
    write=write,
    look=medium.exact_look(material),
    profile=medium.exact_look(material),
    lost="nothing if all channels have one g; a renderer's own inversion of the colour may err.",
    origin=(
        "github.com/AcademySoftwareFoundation/MaterialX: libraries/bxdf/standard_surface.mtlx",
        "github.com/Autodesk/standard-surface: reference/standard_surface.mtlx",
    ),
    material=material,
    losses=medium.losses,
)
