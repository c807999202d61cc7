"""Mitsuba 3: a homogeneous medium inside a dielectric, as a scene's part in XML.

The medium has sigma_t times ``scale``, per unit of the scene, and an albedo. Its reader takes
colours from 0 to 1 only, so that sigma_t is a share of the strongest channel's extinction, the
scale.
"""

from __future__ import annotations

import numpy as np

from sssfit.export.presets import medium
from sssfit.export.presets.fields import Field, Values
from sssfit.export.presets.record import Parameters, Preset
from sssfit.export.presets.source import Source
from sssfit.export.presets.text import identifier, number, numbers, xml_comment
from sssfit.material import Material

FIELDS = (
    Field("sigma_t", "1", "share of the scale of each channel", "colour", most=1.0, is_above=True),
    Field("albedo", "1", "single-scattering albedo", "colour", most=1.0),
    Field("g", "1", "mean cosine of scattering, above 0 forward", least=-0.99, most=0.99,
          default=0.0),
    Field("int_ior", "1", "refractive index", least=1.0, most=4.0, default=1.5046),
    Field("scale", "1/unit", "extinction of the strongest channel, per unit of the scene",
          is_above=True, default=1.0),
    Field("mm_per_unit", "mm", "length of the scene's unit", is_above=True, default=1.0,
          is_chosen=True),
)  # fmt: skip


def convert(source: Source, chosen: Values) -> Values:
    """Return the coefficients; exact."""
    path_mm, albedo, g, eta = medium.medium_of(source)
    unit_mm = float(chosen["mm_per_unit"])  # type: ignore[arg-type]
    return {
        **chosen,
        "scale": unit_mm / float(path_mm.min()),
        "sigma_t": tuple((path_mm.min() / path_mm).tolist()),
        "albedo": tuple(albedo.tolist()),
        "g": g,
        "int_ior": eta,
    }


def material(parameters: Parameters) -> Material:
    """Return the medium."""
    strongest_per_mm = parameters.number("scale") / parameters.number("mm_per_unit")
    return medium.half_space(
        parameters.title,
        parameters.preset.name,
        1.0 / (strongest_per_mm * np.array(parameters.colour("sigma_t"))),
        parameters.colour("albedo"),
        g=parameters.number("g"),
        eta=parameters.number("int_ior"),
    )


def write(parameters: Parameters) -> str:
    """Return a scene of the medium and its interface, for an object to refer to."""
    title = identifier(parameters.title)
    return "\n".join(
        [
            '<scene version="3.0.0">',
            f"  <!--\n{xml_comment(parameters)}\n  -->",
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
    lost="nothing if all channels have one g.",
    origin=("github.com/mitsuba-renderer/mitsuba3: src/media/homogeneous.cpp",),
    material=material,
    losses=medium.losses,
)
