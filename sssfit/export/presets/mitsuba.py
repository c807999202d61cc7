"""Mitsuba 3: a homogeneous medium inside a dielectric, as a scene's part in XML.

The medium has sigma_t and an albedo, which ``scale`` brings to the scene's unit: sigma_t is given
per mm.
"""

from __future__ import annotations

import numpy as np

from sssfit.export.presets import medium
from sssfit.export.presets.fields import Field, Values
from sssfit.export.presets.record import Parameters, Preset
from sssfit.export.presets.source import Source
from sssfit.export.presets.text import head, number, numbers
from sssfit.material import Material

FIELDS = (
    Field("sigma_t", "1/mm", "extinction coefficient", "colour", is_above=True),
    Field("albedo", "1", "single-scattering albedo", "colour", most=1.0),
    Field("g", "1", "mean cosine of scattering, above 0 forward", least=-0.99, most=0.99,
          default=0.0),
    Field("int_ior", "1", "refractive index", least=1.0, most=4.0, default=1.5046),
    Field("scale", "1", "mm in the scene's unit: 1000 for metres", is_above=True, default=1.0,
          is_chosen=True),
)  # fmt: skip


def convert(source: Source, chosen: Values) -> Values:
    """Return the coefficients; exact."""
    path_mm, albedo, g, eta = medium.medium_of(source)
    return {
        **chosen,
        "sigma_t": tuple((1.0 / path_mm).tolist()),
        "albedo": tuple(albedo.tolist()),
        "g": g,
        "int_ior": eta,
    }


def material(parameters: Parameters) -> Material:
    """Return the medium."""
    return medium.half_space(
        parameters.title,
        parameters.preset.name,
        1.0 / np.array(parameters.colour("sigma_t")),
        parameters.colour("albedo"),
        g=parameters.number("g"),
        eta=parameters.number("int_ior"),
    )


def write(parameters: Parameters) -> str:
    """Return a scene of the medium and its interface, for an object to refer to."""
    title = "".join(c if c.isalnum() else "_" for c in parameters.title)
    comment = "\n".join(f"  {line.strip()}" for line in head(parameters, "")).replace("--", "- -")
    return "\n".join(
        [
            '<scene version="3.0.0">',
            f"  <!--\n{comment}\n  -->",
            f'  <medium type="homogeneous" id="medium_{title}">',
            f'    <rgb name="albedo" value="{numbers(parameters.colour("albedo"))}" />',
            f'    <rgb name="sigma_t" value="{numbers(parameters.colour("sigma_t"))}" />',
            f'    <float name="scale" value="{number(parameters.number("scale"))}" />',
            '    <phase type="hg">',
            f'      <float name="g" value="{number(parameters.number("g"))}" />',
            "    </phase>",
            "  </medium>",
            f'  <bsdf type="dielectric" id="interface_{title}">',
            f'    <float name="int_ior" value="{number(parameters.number("int_ior"))}" />',
            '    <float name="ext_ior" value="1.0" />',
            "  </bsdf>",
            f'  <!-- In a closed shape: <ref id="interface_{title}" /> and',
            f'       <ref name="interior" id="medium_{title}" />. -->',
            "</scene>",
            "",
        ]
    )


MITSUBA = Preset(
    name="mitsuba",
    engine="Mitsuba 3, homogeneous medium",
    model="a random walk in the medium itself",
    ending=".xml",
    fields=FIELDS,
    convert=convert,
    write=write,
    look=medium.exact_look(material),
    profile=medium.exact_look(material),
    lost="nothing of a medium of one g.",
    origin=("github.com/mitsuba-renderer/mitsuba3: src/media/homogeneous.cpp",),
    material=material,
)
