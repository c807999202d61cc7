"""glTF: KHR_materials_volume_scatter with a volume, an index and diffuse transmission.

The extension reads sigma_t = -ln(attenuationColor) / attenuationDistance, in metres, and the
single-scattering albedo from multiscatterColor C by Kulla and Conty 2017:

    1 - s^2,    s = 4.09712 + 4.20863 C - sqrt(9.59217 + 41.6808 C + 17.7126 C^2).

The formula is that of a medium without an interface. `convert` inverts it, so that a renderer that
follows the text gets the right medium; C is then not the colour that is seen: behind an interface
part of the light is reflected back inside, and the medium looks darker and more saturated than C.
"""

from __future__ import annotations

import json

import numpy as np

from sssfit import __version__
from sssfit.arrays import FloatArray
from sssfit.errors import ArgumentError
from sssfit.export.presets import medium
from sssfit.export.presets.fields import Field, Values
from sssfit.export.presets.record import Parameters, Preset
from sssfit.export.presets.source import Source
from sssfit.material import Material
from sssfit.messages import by_channel, shown
from sssfit.simulate.inversion import van_de_hulst_albedo

_MM = 1000.0
FIELDS = (
    Field("multiscatterColor", "1", "what Kulla and Conty's formula turns into the albedo",
          "colour", most=1.0),
    Field("attenuationColor", "1", "transmittance over attenuationDistance", "colour", most=1.0,
          is_above=True),
    Field("attenuationDistance", "m", "distance of the attenuation colour", is_above=True),
    Field("scatterAnisotropy", "1", "mean cosine g of scattering", least=-0.99, most=0.99,
          default=0.0),
    Field("ior", "1", "refractive index", least=1.0, most=4.0, default=1.5),
    Field("thicknessFactor", "m", "thickness for renderers that do not trace the volume",
          is_above=True, default=0.01, is_chosen=True),
)  # fmt: skip


def multiscatter_colour(albedo: FloatArray) -> FloatArray:
    """Return C (3,) of an albedo (3,): the exact inverse of the extension's printed formula.

    With s = sqrt(1 - albedo) and u = 4.09712 - s the formula's square is a quadratic in C with a
    tiny leading number; its stable root is taken.
    """
    u = 4.09712 - np.sqrt(1.0 - albedo)
    a, b, c = 4.20863**2 - 17.7126, 2.0 * 4.20863 * u - 41.6808, u**2 - 9.59217
    root = -2.0 * c / (b - np.sqrt(b**2 - 4.0 * a * c))
    # Rounded coefficients: the formula gives 3e-6 and not 0 at C = 0.
    return np.asarray(np.clip(root, 0.0, 1.0))


def convert(source: Source, chosen: Values) -> Values:
    """Return the medium in the extension's terms."""
    path_mm, albedo, g, eta = medium.medium_of(source)
    longest = float(path_mm.max())
    return {
        **chosen,
        "multiscatterColor": tuple(multiscatter_colour(albedo).tolist()),
        "attenuationColor": tuple(np.exp(-longest / path_mm).tolist()),
        "attenuationDistance": longest / _MM,
        "scatterAnisotropy": g,
        "ior": eta,
    }


def material(parameters: Parameters) -> Material:
    """Return the medium that a renderer makes of the extension."""
    colour = np.array(parameters.colour("attenuationColor"))
    if (colour >= 1.0).any():
        raise ArgumentError(
            f"attenuationColor = {shown(parameters['attenuationColor'])}; expected three numbers "
            "above 0 and below 1: a medium that takes no light has no length."
        )
    path_mm = _MM * parameters.number("attenuationDistance") / -np.log(colour)
    return medium.half_space(
        parameters.title,
        parameters.preset.name,
        path_mm,
        van_de_hulst_albedo(np.array(parameters.colour("multiscatterColor"))),
        g=parameters.number("scatterAnisotropy"),
        eta=parameters.number("ior"),
    )


def write(parameters: Parameters) -> str:
    """Return a glTF document with one material."""
    extensions = {
        "KHR_materials_ior": {"ior": parameters.number("ior")},
        "KHR_materials_volume": {
            "thicknessFactor": parameters.number("thicknessFactor"),
            "attenuationDistance": parameters.number("attenuationDistance"),
            "attenuationColor": list(parameters.colour("attenuationColor")),
        },
        "KHR_materials_diffuse_transmission": {"diffuseTransmissionFactor": 1.0},
        "KHR_materials_volume_scatter": {
            "multiscatterColor": list(parameters.colour("multiscatterColor")),
            "scatterAnisotropy": parameters.number("scatterAnisotropy"),
        },
    }
    document = {
        "asset": {"version": "2.0", "generator": f"sssfit {__version__}"},
        "extensionsUsed": list(extensions),
        "materials": [
            {
                "name": parameters.title,
                "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.5},
                "extensions": extensions,
            }
        ],
    }
    return json.dumps(document, indent=2) + "\n"


def doubts(parameters: Parameters) -> tuple[str, ...]:
    """Return a warning where the colour that is seen parts from the multi-scatter colour."""
    written = np.array(parameters.colour("multiscatterColor"))
    g, eta = parameters.number("scatterAnisotropy"), parameters.number("ior")
    seen = medium.entering_colour(van_de_hulst_albedo(written), g, eta)
    if np.abs(seen - written).max() < _SAME_COLOUR:
        return ()
    said = by_channel(medium.CHANNELS, seen.tolist(), ".3g")
    return (
        f"Behind an interface of index {eta:g} this medium returns {said} of the light that "
        "enters, not its multiscatterColor.",
    )


_SAME_COLOUR = 0.02

GLTF = Preset(
    name="gltf",
    engine="glTF 2.0, KHR_materials_volume_scatter",
    model="a random walk in the medium itself",
    ending=".gltf",
    fields=FIELDS,
    convert=convert,
    write=write,
    look=medium.exact_look(material),
    profile=medium.exact_look(material),
    lost="nothing if all channels have one g; viewers draw it by their own approximations.",
    origin=(
        "github.com/KhronosGroup/glTF: extensions/2.0/Khronos/KHR_materials_volume_scatter/"
        "README.md, Multi-Scatter Albedo",
    ),
    material=material,
    losses=medium.losses,
    doubts=doubts,
)
