"""The profile models that mean something for a material: those of half spaces, or of layers.

Dipoles and normalised diffusion are of half spaces; with g they are given (1 - g) sigma_s, and say
so. A slab or a stack has the multipole, unless a layer is too thin or does not scatter.
"""

import inspect
from typing import Any

from sssfit.arrays import FloatArray
from sssfit.errors import SimulationError
from sssfit.material import Material
from sssfit.methods import OF_HALF_SPACES, OF_LAYERS, SIMULATIONS
from sssfit.profile import Profile
from sssfit.simulate import simulate

MODELS = (*OF_HALF_SPACES, *OF_LAYERS)


def models_of(material: Material) -> tuple[str, ...]:
    """Return the models that are of such a material."""
    return OF_HALF_SPACES if material.is_semi_infinite else OF_LAYERS


def model_profiles(
    material: Material, reflectance: FloatArray, **grid: Any
) -> tuple[dict[str, Profile], tuple[str, ...]]:
    """Return the profiles of a material's models, and lines about those that are left out.

    Parameters
    ----------
    material : Material
    reflectance : (C,)
        The exact total, which a model that takes one is told, as by an artist.
    **grid
        ``dr_mm`` and ``radius_mm``; see `sssfit.grid.make_grid`.
    """
    found: dict[str, Profile] = {}
    left: tuple[str, ...] = ()
    if not material.is_semi_infinite:
        left = (
            f"{material.name} is not one half space: {', '.join(OF_HALF_SPACES)}, which are of "
            "such, are left out.",
        )
    for name in models_of(material):
        known = inspect.signature(SIMULATIONS[name].load()).parameters
        own = {"reflectance": reflectance} if "reflectance" in known else {}
        try:
            found[name] = simulate(material, name, **grid, **own)
        except SimulationError as refusal:
            if name not in OF_LAYERS:
                raise
            left += (f"{name} is left out: {refusal}",)
    return found, left
