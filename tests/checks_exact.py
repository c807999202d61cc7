"""Comparisons of the exact solver with the photon walk and with itself, at any size.

Figures as in checks.py: tests run them small, docs/make_verification.py at full size.
"""

import functools

import numpy as np
from checks import (
    Figure,
    chi_square_sigmas,
    effective_hits,
    groups_of_hits,
    medium,
    merge,
    moments,
    standard_error,
)

from sssfit.material import load_material, material_names
from sssfit.simulate import shared_walks, simulate_montecarlo, simulate_montecarlo_many
from sssfit.simulate.exact import simulate_exact, simulate_exact_many

FINE = 2e-6  # tolerance of a much finer run: 20 s for the eleven materials


@functools.cache
def exact_profiles(names, tolerance):
    """Materials that ship, by the exact solver."""
    return simulate_exact_many([load_material(name) for name in names], tolerance=tolerance)


@functools.cache
def walk_profiles(names, photons):
    """Materials that ship, by one walk for each refractive index."""
    materials = [load_material(name) for name in names]
    profiles = [None] * len(names)
    for group in shared_walks(materials):
        walked = simulate_montecarlo_many([materials[k] for k in group], photons=photons)
        for k, profile in zip(group, walked, strict=True):
            profiles[k] = profile
    return profiles


def against_walk(photons, tolerance=1e-4, names=None):
    """Chi-square over merged annuli and the largest deviation of F, for every channel."""
    names = names or material_names(paper=True)
    pairs = zip(exact_profiles(names, tolerance), walk_profiles(names, photons), strict=True)
    figures = []
    for name, (exact, walk) in zip(names, pairs, strict=True):
        for c, channel in enumerate(walk.channels):
            figures.extend(_channel_against_walk(f"{name} {channel}", exact, walk, c))
    return figures


def _channel_against_walk(what, exact, walk, c):
    """Two figures of one channel."""
    photons = walk.photons
    sums, squares = (each[:, c] for each in moments(walk))
    solved = np.append(exact.annulus_energy[:, c], exact.beyond_grid[c])
    groups = groups_of_hits(effective_hits(sums, squares), photons * solved)
    error = standard_error(merge(sums, groups), merge(squares, groups), photons)
    ours, theirs = merge(solved, groups), merge(sums, groups) / photons
    sigmas, chi2 = chi_square_sigmas(ours - theirs, error**2)
    yield Figure(
        f"{what}: exact against the walk, {len(groups)} annuli",
        f"{ours.sum():.6f}, chi² {chi2:.0f}",
        f"{theirs.sum():.6f}",
        sigmas,
    )
    # F from the third edge on; edges before the hundredth hit have no standard error to speak of.
    edges = np.unique(groups[(groups >= 3) & (groups < len(solved))])
    apart = (exact.cumulative[edges, c] - walk.cumulative[edges, c]) / (
        walk.cumulative_stderr[edges, c]
    )
    worst = int(np.argmax(np.abs(apart)))
    yield Figure(
        f"{what}: F at {len(edges)} edges, worst at {exact.r_edges_mm[edges[worst]]:.3g} mm",
        f"{exact.cumulative[edges[worst], c]:.6f}",
        f"{walk.cumulative[edges[worst], c]:.6f}",
        float(apart[worst]),
    )


def shares_apart(names=None, tolerance=1e-4, fine=FINE):
    """|F - F_fine| / total at every edge from the third on, worst of each material's channels.

    Returns names, that error, and the error the coarser run claims.
    """
    names = names or material_names(paper=True)
    rows = []
    for name, ours, finer in zip(
        names, exact_profiles(names, tolerance), exact_profiles(names, fine), strict=True
    ):
        apart = np.abs(ours.cumulative - finer.cumulative)[3:] / finer.diffuse_reflectance
        rows.append((name, float(apart.max()), ours.meta["relative_error"]))
    return rows


def similarity_rows(photons):
    """Cost of the similarity relation: reduced isotropic scattering against the walk with g."""
    rows = []
    for g in (0.5, 0.8, 0.9):
        for albedo in (0.9, 0.99):
            scattering = albedo / (1.0 - g)
            material = medium(1.0 - albedo, scattering, 1.3, g=g, name="similar")
            exact = simulate_exact(material, similarity=True)
            walk = simulate_montecarlo(material, photons=photons)
            total = float(walk.diffuse_reflectance[0])
            near = int(np.searchsorted(exact.r_edges_mm, 1.0))  # one reduced mean free path
            rows.append(
                (
                    f"{g:g}",
                    f"{albedo:g}",
                    f"{total:.5f} ± {float(walk.diffuse_reflectance_stderr[0]):.5f}",
                    f"{100.0 * (float(exact.diffuse_reflectance[0]) / total - 1.0):+.1f} %",
                    f"{100.0 * _misplaced(exact, walk):.1f} %",
                    f"{100.0 * (exact.cumulative[near, 0] / walk.cumulative[near, 0] - 1):+.0f} %",
                )
            )
    return rows


def _misplaced(one, other):
    """Half the sum over annuli of the differences of their shares of the total."""
    shares = [
        np.append(each.annulus_energy[:, 0], each.beyond_grid[0]) / each.diffuse_reflectance[0]
        for each in (one, other)
    ]
    return 0.5 * float(np.sum(np.abs(shares[0] - shares[1])))
