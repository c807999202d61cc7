"""The diffusion models against the photon walk, at any size: totals, and the profile by radius.

A walk has standard errors, a model has none: what is compared is a relative difference, and how
much of it the walk's own noise could be. The tests run these small; docs/make_verification.py can
run them full. ``DIFFUSE`` are the cases that are to agree within ``WITHIN``; ``BEYOND`` are cases
where diffusion itself fails, kept to be reported.
"""

from dataclasses import dataclass

import numpy as np
from checks import effective_hits, groups_of_hits, merge, standard_error
from checks_layers import layer, stack

from sssfit.grid import RadialGrid
from sssfit.profile import Profile
from sssfit.simulate import simulate_montecarlo, simulate_multipole

WITHIN = 0.05  # of the total, reflected and transmitted

# Albedo .99, index 1.4; the two stacks have unlike layers, the first also g, the second a step of
# the index inside.
DIFFUSE = {
    "slab, 5 mean free paths": stack(layer(0.01, 0.99, 0.0, 1.4, 5.0)),
    "slab, 20 mean free paths": stack(layer(0.01, 0.99, 0.0, 1.4, 20.0)),
    "two layers, g .8": stack(layer(0.1, 20.0, 0.8, 1.4, 0.5), layer(0.02, 10.0, 0.8, 1.4, 4.0)),
    "two layers, eta 1.5 on 1.3": stack(
        layer(0.01, 0.99, 0.0, 1.5, 5.0), layer(0.01, 1.98, 0.0, 1.3, 5.0)
    ),
}
BEYOND = {
    "slab, 2 mean free paths": stack(layer(0.01, 0.99, 0.0, 1.4, 2.0)),
    "slab of 5, albedo .9": stack(layer(0.1, 0.9, 0.0, 1.4, 5.0)),
    "layer of albedo .7 below": stack(
        layer(0.01, 0.99, 0.0, 1.4, 5.0), layer(0.3, 0.7, 0.0, 1.4, 5.0)
    ),
    "one slab of 12, cut in three": stack(*[layer(0.01, 0.99, 0.0, 1.4, 4.0)] * 3),
}


@dataclass(frozen=True)
class Difference:
    """A model's profile of one channel against a walk's, by annuli merged to 100 hits.

    Energies are shares of the incident light; the last of the m bins ends beyond the grid.
    """

    what: str
    total: float
    walk_total: float
    walk_total_stderr: float
    r_mm: np.ndarray  # (m,) inner edges of the bins
    energy: np.ndarray  # (m,)
    walk_energy: np.ndarray  # (m,)
    walk_stderr: np.ndarray  # (m,)

    @property
    def relative(self) -> float:
        """Model's total over the walk's, less 1."""
        return self.total / self.walk_total - 1.0

    @property
    def noise(self) -> float:
        """One standard error of `relative`."""
        return self.walk_total_stderr / self.walk_total

    @property
    def relative_by_radius(self) -> np.ndarray:
        """Model's energy over the walk's in each bin, less 1 (m,)."""
        return self.energy / self.walk_energy - 1.0

    @property
    def misplaced(self) -> float:
        """Share of the walk's total that the model has at other radii: half the sum of |d|."""
        parts = self.energy / self.total - self.walk_energy / self.walk_total
        return float(0.5 * np.abs(parts).sum())


def differences(what, model: Profile, walk: Profile, channel=0):
    """Reflected, and for slabs transmitted, of two profiles on one grid."""
    assert np.array_equal(model.r_edges_mm, walk.r_edges_mm)
    pairs = [("R_d", "annulus_energy", "beyond_grid")]
    if model.annulus_transmittance is not None:
        pairs.append(("T", "annulus_transmittance", "beyond_grid_transmittance"))
    photons = walk.photons
    found = []
    for name, on_grid, beyond in pairs:

        def of(profile, suffix="", on_grid=on_grid, beyond=beyond):
            inside = getattr(profile, on_grid + suffix)
            return np.vstack([inside, getattr(profile, beyond + suffix)])[:, channel]

        energy, walked, stderr = of(model), of(walk), of(walk, "_stderr")
        sums = photons * walked
        squares = photons * ((photons - 1) * stderr**2 + walked**2)
        groups = groups_of_hits(effective_hits(sums, squares))
        merged, merged_squares = merge(sums, groups), merge(squares, groups)
        found.append(
            Difference(
                what=f"{what}: {name}",
                total=float(energy.sum()),
                walk_total=float(walked.sum()),
                walk_total_stderr=float(standard_error(sums.sum(), squares.sum(), photons)),
                r_mm=walk.r_edges_mm[groups],
                energy=merge(energy, groups),
                walk_energy=merged / photons,
                walk_stderr=standard_error(merged, merged_squares, photons),
            )
        )
    return found


def multipole_against_walk(material, what, photons):
    """One stack by both: reflected and transmitted."""
    grid = RadialGrid(0.25, 160)
    size = {"dr_mm": grid.dr_mm, "radius_mm": grid.radius_mm}
    walk = simulate_montecarlo(material, photons=photons, **size)
    return differences(what, simulate_multipole(material, **size), walk)
