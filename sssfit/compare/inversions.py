"""From a colour to an albedo: the formula that renderers use, beside the exact solver.

Kulla and Conty 2017 inverted van de Hulst's reflectance of a half space without an interface; the
specifications of OpenPBR and of glTF's volume scattering print it. A medium behind an interface
reflects part of its own light back inside, and needs a higher albedo for the same colour: of the
formula's albedos it shows darker and more saturated ones. ``sssfit.chart.inversions`` draws the
record.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sssfit.arrays import FloatArray, plain
from sssfit.optics import normal_transmittance
from sssfit.simulate.half_space import Light, diffuse_reflectance, entering_light
from sssfit.simulate.inversion import invert_reflectance, van_de_hulst_albedo

ETAS = (1.0, 1.4, 1.5)
_COLOURS = 49
_LEAST, _MOST = 0.02, 0.98


@dataclass(frozen=True, slots=True, eq=False)
class InversionCurves:
    """Albedos of colours by the formula and exactly, for E refractive indices.

    Parameters
    ----------
    colour : (N,)
        Shares of the entering light that come back, R_d / (1 - R_sp).
    formula : (N,)
        Albedos by Kulla and Conty's formula, the same for all indices.
    etas : (E,)
    exact : (E, N)
        Albedos that have the colour.
    seen : (E, N)
        Colours that the formula's albedos have.
    light : "normal" or "diffuse"
        The light that the colours are for.
    """

    colour: FloatArray
    formula: FloatArray
    etas: tuple[float, ...]
    exact: FloatArray
    seen: FloatArray
    light: Light

    def to_dict(self) -> dict[str, Any]:
        """Return the curves as JSON values."""
        return plain({name: getattr(self, name) for name in self.__slots__})


def compute_inversions(
    colour: Sequence[float] | FloatArray | None = None,
    *,
    etas: Sequence[float] = ETAS,
    light: Light = "diffuse",
) -> InversionCurves:
    """Compute the curves.

    Parameters
    ----------
    colour : (N,), optional
        By default 49 from 0.02 to 0.98.
    etas : sequence of float
        Relative refractive indices, from 1.
    light : "normal" or "diffuse"
        The formula is for diffuse light; OpenPBR's colour is for light along the normal.

    Raises
    ------
    MaterialError, SimulationError
        A colour, an index or the light is out of range.
    """
    colours = np.linspace(_LEAST, _MOST, _COLOURS) if colour is None else np.array(colour, float)
    formula = van_de_hulst_albedo(colours)
    exact, seen = [], []
    for eta in etas:
        # An inversion under normal light takes shares of the incident light.
        scale = normal_transmittance(eta) if light == "normal" else 1.0
        exact.append(invert_reflectance(scale * colours, eta, light=light).albedo)
        entering = entering_light(eta, light)
        seen.append(diffuse_reflectance(formula, eta, light=light) / entering)
    return InversionCurves(colours, formula, tuple(etas), np.stack(exact), np.stack(seen), light)
