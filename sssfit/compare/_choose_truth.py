"""The profile a choice is held against: exact, or a long walk where there is no exact method."""

import time

from sssfit.errors import RenderError
from sssfit.material import Material
from sssfit.profile import Profile
from sssfit.simulate import simulate_exact, simulate_montecarlo

WALK_PHOTONS = 10_000_000  # the papers' number


def truth_of(material: Material, *, seed: int, threads: int | None) -> tuple[Profile, float]:
    """Return a half space's exact profile, a slab's or a stack's by a walk; and the seconds."""
    begun = time.perf_counter()
    if material.is_semi_infinite:
        profile = simulate_exact(material, threads=threads)
    else:
        profile = simulate_montecarlo(material, photons=WALK_PHOTONS, seed=seed, threads=threads)
    return profile, time.perf_counter() - begun


def check_colours(material: Material) -> None:
    """Refuse channels that no display shows: Delta E needs grey or red, green and blue."""
    if material.n_channels not in (1, 3):
        raise RenderError(
            f"{material.name} has {material.n_channels} channels; Delta E needs 1 (grey) or 3 "
            "(red, green, blue)."
        )
