"""pbrt-v4: a homogeneous medium behind a dielectric interface, as a part of a scene.

sigma_a and sigma_s are given per mm and multiplied by ``scale``, which brings them to the scene's
unit. The renderer makes spectra of the three numbers; a spectral render differs from ours by that.
"""

from __future__ import annotations

import numpy as np

from sssfit.export.presets import medium
from sssfit.export.presets.fields import Field, Values
from sssfit.export.presets.record import Parameters, Preset
from sssfit.export.presets.source import Source
from sssfit.export.presets.text import lines, number, numbers
from sssfit.material import Layer, Material

FIELDS = (
    Field("sigma_a", "1/mm", "absorption coefficient", "colour"),
    Field("sigma_s", "1/mm", "scattering coefficient", "colour", is_above=True),
    Field("g", "1", "mean cosine of scattering, above 0 forward", least=-0.99, most=0.99,
          default=0.0),
    Field("eta", "1", "refractive index", least=1.0, most=4.0, default=1.5),
    Field("scale", "1", "mm in the scene's unit: 1000 for metres", is_above=True, default=1.0,
          is_chosen=True),
)  # fmt: skip


def convert(source: Source, chosen: Values) -> Values:
    """Return the coefficients; exact."""
    path_mm, albedo, g, eta = medium.medium_of(source)
    return {
        **chosen,
        "sigma_a": tuple(((1.0 - albedo) / path_mm).tolist()),
        "sigma_s": tuple((albedo / path_mm).tolist()),
        "g": g,
        "eta": eta,
    }


def material(parameters: Parameters) -> Material:
    """Return the medium."""
    sigma_a, sigma_s = (np.array(parameters.colour(each)) for each in ("sigma_a", "sigma_s"))
    layer = Layer(parameters.number("eta"), np.full(3, parameters.number("g")), sigma_a, sigma_s)
    return Material(parameters.title, medium.CHANNELS, (layer,), source="preset pbrt")


def write(parameters: Parameters) -> str:
    """Return directives that make the medium and enter it through a dielectric."""
    name = parameters.title
    body = [
        f'MakeNamedMedium "{name}"',
        '    "string type" [ "homogeneous" ]',
        *(
            f'    "rgb {each}" [ {numbers(parameters.colour(each), " ")} ]'
            for each in ("sigma_a", "sigma_s")
        ),
        f'    "float scale" [ {number(parameters.number("scale"))} ]',
        f'    "float g" [ {number(parameters.number("g"))} ]',
        "",
        "AttributeBegin",
        f'    MediumInterface "{name}" ""',
        f'    Material "dielectric" "float eta" [ {number(parameters.number("eta"))} ]',
        "    # The object's shape, closed and with its normals outwards, goes here.",
        "AttributeEnd",
    ]
    return lines(parameters, "#", body)


PBRT = Preset(
    name="pbrt",
    engine="pbrt-v4, homogeneous medium",
    model="a random walk in the medium itself",
    ending=".pbrt",
    fields=FIELDS,
    convert=convert,
    write=write,
    look=medium.exact_look(material),
    profile=medium.exact_look(material),
    lost="nothing if all channels have one g, but the renderer makes spectra of three numbers.",
    origin=(
        "github.com/mmp/pbrt-v4: src/pbrt/media.cpp, HomogeneousMedium::Create",
        "pbrt.org/fileformat-v4: Participating Media",
    ),
    material=material,
    losses=medium.losses,
)
