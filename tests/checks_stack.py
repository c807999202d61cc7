"""Random layered materials, and the solver for layers against the walk, at any size."""

import re

import numpy as np
from checks import (
    Figure,
    chi_square_sigmas,
    effective_hits,
    groups_of_hits,
    merge,
    moments,
    standard_error,
)
from checks_layers import layer, stack

from sssfit.errors import SimulationError
from sssfit.grid import make_grid
from sssfit.simulate import simulate_exact, simulate_montecarlo

TOLERANCE = 2e-4


def random_stack(seed):
    """1 to 4 layers, g 0 to .85 (to .9 where light does not come through), indices 1 to 1.6."""
    rng = np.random.default_rng([22, seed])
    count = int(rng.integers(1, 5))
    has_bottom = bool(rng.random() < 0.5)
    layers = []
    for j in range(count):
        g = float(rng.choice([0.0, rng.uniform(0.0, 0.85 if has_bottom else 0.9)]))
        scattering = 10.0 ** rng.uniform(0.0, 1.0) / (1.0 - g)
        absorption = 10.0 ** rng.uniform(-2.0, 0.0)
        is_last = j == count - 1
        thickness = np.inf if is_last and not has_bottom else 10.0 ** rng.uniform(-1.0, 0.3)
        layers.append(layer(absorption, scattering, g, rng.uniform(1.0, 1.6), thickness))
    above, below = rng.uniform(1.0, 1.3), rng.uniform(1.0, 1.6) if has_bottom else 1.0
    return stack(*layers, above=above, below=below)


def solved_and_walked(material, photons, tolerance=TOLERANCE):
    """Both profiles on one grid of 200 annuli, the exact one with a tolerance that can be met."""
    radius_mm = float(make_grid(material).radius_mm) / 4.0
    grid = {"dr_mm": radius_mm / 200.0, "radius_mm": radius_mm}
    try:
        exact = simulate_exact(material, tolerance=tolerance, **grid)
    except SimulationError as refusal:
        (named,) = re.findall(r"give .tolerance = ([\d.e-]+). or more", str(refusal))
        exact = simulate_exact(material, tolerance=float(named), **grid)
    return exact, simulate_montecarlo(material, photons=photons, **grid)


def against_walk(what, exact, walk):
    """Chi-square over merged annuli above and below, and the largest deviation of F above."""
    sums, squares = (each[:, 0] for each in moments(walk))
    solved = np.append(exact.annulus_energy[:, 0], exact.beyond_grid[0])
    estimate = np.append(exact.annulus_energy_stderr[:, 0], exact.beyond_grid_stderr[0])
    photons = walk.photons
    groups = groups_of_hits(effective_hits(sums, squares), photons * solved)
    error = standard_error(merge(sums, groups), merge(squares, groups), photons)
    ours, theirs = merge(solved, groups), merge(sums, groups) / photons
    known = np.sqrt(merge(estimate**2, groups))
    sigmas, chi2 = chi_square_sigmas(ours - theirs, error**2 + known**2)
    yield Figure(f"{what}: {len(groups)} annuli", f"{ours.sum():.6f}", f"chi² {chi2:.0f}", sigmas)
    for name, unit in (("diffuse_reflectance", "R"), ("transmittance", "T")):
        a, b = getattr(exact, name), getattr(walk, name)
        if a is None:
            continue
        deviation = np.hypot(
            getattr(exact, f"{name}_stderr")[0], getattr(walk, f"{name}_stderr")[0]
        )
        yield Figure(f"{what}: {unit}", f"{a[0]:.6f}", f"{b[0]:.6f}", (a[0] - b[0]) / deviation)
    for j, (a, b) in enumerate(zip(exact.absorbed[:, 0], walk.absorbed[:, 0], strict=True)):
        # A photon leaves a share of 0 to 1 of itself in a layer: the error is at most this.
        deviation = np.sqrt(max(b * (1.0 - b), 1e-12) / photons) + 0.5 * TOLERANCE * b
        yield Figure(f"{what}: absorbed by layer {j}", f"{a:.6f}", f"{b:.6f}", (a - b) / deviation)
