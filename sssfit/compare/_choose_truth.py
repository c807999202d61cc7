"""The profile a choice is held against: exact, or a long walk where there is no exact method."""

import math
import time
from collections.abc import Mapping

import numpy as np

from sssfit.compare._all_light import exact_with_all_light
from sssfit.errors import RenderError, SssfitError
from sssfit.grid import make_grid
from sssfit.material import Material
from sssfit.profile import Profile
from sssfit.simulate import simulate_montecarlo

WALK_PHOTONS = 10_000_000  # the papers' number
_TRANSPORT = ("exact", "montecarlo")


def truth_of(
    source: Material | Profile, *, seed: int, threads: int | None
) -> tuple[Profile, float]:
    """Return a half space's exact profile, that of others by a walk; and the seconds.

    A profile is its own truth.

    Others are slabs, stacks, and scattering with g other than 0, which the exact solver takes for
    isotropic: skin1's coefficients with g = 0.8 had a Delta E of 5.3 against the walk.
    The exact one has all of the light: marble's kernels, 2.2 % of whose red lies beyond the paper's
    grid, were .39 Delta E off on the head at best.
    """
    if isinstance(source, Profile):
        return source, 0.0
    begun = time.perf_counter()
    if is_exact(source):
        profile = exact_with_all_light(source, make_grid(source), math.inf, threads=threads)
    else:
        profile = simulate_montecarlo(source, photons=WALK_PHOTONS, seed=seed, threads=threads)
    return profile, time.perf_counter() - begun


def is_exact(material: Material) -> bool:
    """Whether the exact solver has the material's own profile: one half space with g = 0.

    Nor may it be thinner optically than what is above it, as vacuum under air is.
    """
    layer = material.layers[0]
    is_dense = layer.eta >= material.eta_above
    return material.is_semi_infinite and is_dense and not np.any(layer.g)


def material_of(source: Material | Profile) -> Material | None:
    """Return the material that walks can be held against the profile of.

    None for a profile without coefficients behind it, and for one that is not by transport: a
    model's error would be taken for noise.
    """
    if isinstance(source, Material):
        return source
    record = source.meta.get("material")
    if source.meta.get("method") not in _TRANSPORT or not isinstance(record, Mapping):
        return None
    try:
        return Material.from_dict(record)
    except SssfitError:  # a name alone, or a record that was edited
        return None


def name_of(source: Material | Profile) -> str:
    """Return what messages call it."""
    if isinstance(source, Material):
        return source.name
    return source.material_name or "the profile"


def check_colours(source: Material | Profile) -> None:
    """Refuse channels that no display shows: Delta E needs grey or red, green and blue."""
    if source.n_channels not in (1, 3):
        raise RenderError(
            f"{name_of(source)} has {source.n_channels} channels; Delta E needs 1 (grey) or 3 "
            "(red, green, blue)."
        )
