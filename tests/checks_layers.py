"""Comparisons of the layered walk, at any size; see checks.py for the figures and limits."""

import math

import checks
import numpy as np
import reference
from checks import (
    Figure,
    chi_square_sigmas,
    effective_hits,
    groups_of_hits,
    merge,
    standard_error,
)

from sssfit.grid import RadialGrid, paper_grid
from sssfit.material import Layer, Material, load_material
from sssfit.simulate import simulate_montecarlo
from sssfit.simulate._finished import profile_of
from sssfit.simulate._run import EndCondition, run
from sssfit.simulate.walk_half_space import SemiInfiniteWalk
from sssfit.simulate.walk_layered import LayeredWalk


def layer(sigma_a, sigma_s, g=0.0, eta=1.0, thickness=math.inf):
    """A layer; numbers make one channel, lists several."""
    sigma_a, sigma_s = np.broadcast_arrays(np.atleast_1d(sigma_a), np.atleast_1d(sigma_s))
    g = np.broadcast_to(np.asarray(g, float), sigma_a.shape)
    return Layer(eta, g, sigma_a.astype(float), sigma_s.astype(float), thickness)


def stack(*layers, above=1.0, below=1.0):
    """Layers from the top down as a material."""
    channels = tuple(f"c{k}" for k in range(layers[0].sigma_a_per_mm.size))
    return Material("stack", channels, layers, eta_above=above, eta_below=below)


STACKS = {
    # MCML's own sample: 1/cm and cm there
    "MCML's sample": stack(
        layer(0.1, 10.0, 0.9, 1.37, 1.0),
        layer(0.1, 1.0, 0.0, 1.37, 1.0),
        layer(0.2, 1.0, 0.7, 1.37, 2.0),
    ),
    "three layers, g .8": stack(
        layer(0.1, 10.0, 0.8, 1.4, 0.1),
        layer(0.05, 20.0, 0.8, 1.35, 0.5),
        layer(0.2, 15.0, 0.8, 1.45),
    ),
    "glass, medium, glass": stack(
        layer(0.0, 0.0, 0.0, 1.5, 1.0),
        layer(0.1, 5.0, 0.8, 1.37, 1.0),
        layer(0.0, 0.0, 0.0, 1.5, 1.0),
        below=1.33,
    ),
    "clear gap inside, backward g": stack(
        layer(0.2, 3.0, -0.5, 1.3, 0.5),
        layer(0.0, 0.0, 0.0, 1.0, 0.3),
        layer(0.05, 2.0, 0.3, 1.6, 0.7),
        above=1.2,
    ),
    "into the thinner medium": stack(layer(0.1, 1.0, 0.5, 1.0), above=1.5),
}


def sums_of(task):
    """Walk a task on two threads; its sums."""
    return task.sums(run(task, 2), 0)


def compared(what, ours, photons, theirs, their_photons):
    """One figure for two profiles given as sums (n, 2) of w and w^2, by merged annuli."""
    groups = groups_of_hits(*(effective_hits(each[:, 0], each[:, 1]) for each in (ours, theirs)))
    a, a_squares = (merge(ours[:, k], groups) for k in (0, 1))
    b, b_squares = (merge(theirs[:, k], groups) for k in (0, 1))
    variance = (
        standard_error(a, a_squares, photons) ** 2
        + standard_error(b, b_squares, their_photons) ** 2
    )
    sigmas, chi2 = chi_square_sigmas(a / photons - b / their_photons, variance)
    return Figure(
        f"{what}, {len(groups)} annuli",
        f"{a.sum() / photons:.6f}, chi² {chi2:.0f}",
        f"{b.sum() / their_photons:.6f}",
        sigmas,
    )


def van_de_hulst(photons):
    """The slab of van de Hulst's tables, five published digits."""
    profile = simulate_montecarlo(stack(layer(1.0, 9.0, 0.75, 1.0, 0.2)), photons=photons)
    figures = []
    for what, value, error, published in (
        ("R_d", profile.diffuse_reflectance, profile.diffuse_reflectance_stderr, 0.09739),
        ("T", profile.transmittance, profile.transmittance_stderr, 0.66096),
    ):
        # half a unit of the last digit belongs to the table
        sigmas = (value[0] - published) / math.hypot(error[0], 5e-6 / math.sqrt(3.0))
        figures.append(
            Figure(
                f"slab of van de Hulst, {what}",
                f"{value[0]:.6f} ± {error[0]:.6f}",
                f"{published:.5f}",
                sigmas,
            )
        )
    return figures


def giovanelli(photons):
    """Specular and diffuse reflectance at index 1.5, albedo 0.9, by the layered walk."""
    material = stack(layer(1.0, 9.0, 0.0, 1.5))
    sums = sums_of(LayeredWalk((material,), (paper_grid(material),), 1, photons))
    total, squares = sums.reflected[:, 0].sum(axis=0)
    r, error = total / photons, float(standard_error(total, squares, photons))
    specular = material.specular_reflectance
    found = specular + (1.0 - specular) * r
    return Figure(
        "specular + diffuse by the layered walk, eta 1.5, albedo 0.9, against Giovanelli 1955",
        f"{found:.6f} ± {error:.6f}",
        "0.2600",
        (found - 0.26) / math.hypot(error, 5e-5),
    )


def one_layer(name, photons):
    """A shipped material by the layered walk against the semi-infinite one, per channel."""
    material = load_material(name)
    grid = paper_grid(material)
    plain = sums_of(SemiInfiniteWalk((material,), (grid,), 1, photons)).reflected
    layered = sums_of(LayeredWalk((material,), (grid,), 2, photons)).reflected
    return [
        compared(
            f"{name} {channel}: layered walk against semi-infinite",
            layered[:, c],
            photons,
            plain[:, c],
            photons,
        )
        for c, channel in enumerate(material.channels)
    ]


def against_mcml(name, photons):
    """A shipped material by the layered walk against the original MCML program's profile."""
    material = load_material(name)
    task = LayeredWalk((material,), (paper_grid(material),), 1, photons)
    profile = profile_of(task, run(task, 2), 0, EndCondition(photons), 0.0, trim=False)
    return checks.against_mcml(name, photons, profile, "layered walk")


def scalar_sums(material, photons, grid):
    """The scalar MCML: reflected and transmitted (n, 2), absorbed (L,), weights begin at 1."""
    layers = material.layers
    reflected, transmitted, absorbed, _ = reference.scalar_layered_walk(
        7,
        photons,
        np.array([each.sigma_a_per_mm[0] for each in layers]),
        np.array([each.sigma_s_per_mm[0] for each in layers]),
        np.array([each.g[0] for each in layers]),
        np.array([material.eta_above, *(each.eta for each in layers), material.eta_below]),
        np.array([min(each.thickness_mm, 1e30) for each in layers]),
        0.0,
        material.first_scattering_layer,
        grid.dr_mm,
        grid.annuli,
    )
    return reflected[:, :2], transmitted[:, :2], absorbed


def against_scalar_mcml(name, photons):
    """A stack by the layered walk against the scalar MCML, on a fifth of the photons."""
    material, grid, loop_photons = STACKS[name], RadialGrid(0.02, 400), photons // 5
    sums = sums_of(LayeredWalk((material,), (grid,), 1, photons))
    reflected, transmitted, absorbed = scalar_sums(material, loop_photons, grid)
    figures = [compared(f"{name}: R_d", sums.reflected[:, 0], photons, reflected, loop_photons)]
    if sums.transmitted is not None:
        ours = sums.transmitted[:, 0]
        figures.append(compared(f"{name}: T", ours, photons, transmitted, loop_photons))
    for k, (a, b) in enumerate(zip(sums.absorbed[:, 0], absorbed, strict=True)):
        a, b = a / photons, b / loop_photons
        if a == b == 0.0:
            continue  # a clear layer
        # a photon leaves at most all it has in a layer: mean (1 - mean) bounds the variance
        error = math.sqrt(a * (1.0 - a) / photons + b * (1.0 - b) / loop_photons)
        figures.append(
            Figure(f"{name}: absorbed in layer {k + 1}", f"{a:.6f}", f"{b:.6f}", (a - b) / error)
        )
    return figures
