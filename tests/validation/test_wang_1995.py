"""MCML's own sample: three layers, walked from its input file."""

import functools
import math
from pathlib import Path

import checks
import checks_layers
import numpy as np
import pytest
from checks import Figure
from published import Published, check, what

from sssfit.formats.mci import load_mci
from sssfit.simulate import simulate_montecarlo

TITLE = "Wang, Jacques and Zheng 1995"
SOURCE = (
    'L. Wang, S. L. Jacques, L. Zheng, "MCML: Monte Carlo modeling of light transport in '
    'multi-layered tissues", *Computer Methods and Programs in Biomedicine* 47, 1995; sample.mci '
    "of its manual, run by MCML 1.2.2 with 1e6 photons"
)
PLACE = "sample.mco"
PHOTONS = 300_000
DATA = Path(__file__).parents[1] / "data"
PRINTED = {
    "diffuse reflectance": "0.237544",
    "transmittance": "0.0964896",
    "reflected beyond 4.9 mm": "0.009773",
    "absorbed": "0.641594",
    "absorbed in layer 1": "0.2612",
    "absorbed in layer 2": "0.1488",
    "absorbed in layer 3": "0.2316",
}


@functools.cache
def sample(photons):
    """Walk the sample; its material, grid and profile."""
    (asked,) = load_mci(DATA / "sample.mci")
    profile = simulate_montecarlo(
        asked.material, photons=photons, dr_mm=asked.grid.dr_mm, radius_mm=asked.grid.radius_mm
    )
    return asked.material, asked.grid, profile


def totals(profile):
    """Diffuse reflectance and transmittance of channel 0, each with its standard error."""
    return (
        (profile.diffuse_reflectance[0], profile.diffuse_reflectance_stderr[0]),
        (profile.transmittance[0], profile.transmittance_stderr[0]),
    )


def absorbed_error(absorbed, photons):
    """At least its standard error: a photon loses at most all it has in a layer."""
    return np.sqrt(absorbed * (1.0 - absorbed) / photons)


@functools.cache
def figures(photons):
    """Compare with MCML's 1e6 photons, which are as exact as ours per photon, by name."""
    profile = sample(photons)[2]
    (r, r_error), (t, t_error) = totals(profile)
    # MCML adds all light beyond 4.9 mm to its last annulus.
    rim = profile.annulus_energy[-1, 0] + profile.beyond_grid[0]
    rim_error = math.hypot(profile.annulus_energy_stderr[-1, 0], profile.beyond_grid_stderr[0])
    absorbed = profile.absorbed[:, 0]
    values = {
        "diffuse reflectance": (r, r_error),
        "transmittance": (t, t_error),
        "reflected beyond 4.9 mm": (rim, rim_error),
        "absorbed": (absorbed.sum(), math.hypot(r_error, t_error)),  # the rest of the energy
    }
    for k, each in enumerate(zip(absorbed, absorbed_error(absorbed, photons), strict=True), 1):
        values[f"absorbed in layer {k}"] = each
    return {name: compared(name, *values[name], photons) for name in PRINTED}


def compared(name, value, error, photons):
    """Compare one value by both standard errors and half a unit of the last printed digit."""
    printed = PRINTED[name]
    digit = 0.5 * 10.0 ** -len(printed.partition(".")[2])
    spread = math.hypot(error, error * math.sqrt(photons / 1e6), digit)
    return Figure(name, f"{value:.6f} ± {error:.6f}", printed, (value - float(printed)) / spread)


FIGURES = [
    Published(
        PLACE,
        "specular reflectance",
        "0.0243729",
        lambda: sample(PHOTONS)[2].specular_reflectance,
    ),
    *(
        Published(PLACE, f"{name}, 3e5 photons", printed, lambda k=name: figures(PHOTONS)[k])
        for name, printed in PRINTED.items()
    ),
]


@pytest.mark.parametrize("figure", FIGURES, ids=what)
def test_figure(figure):
    check(figure)


@pytest.mark.slow
def test_a_long_walk_agrees_too():
    for figure in figures(30_000_000).values():
        assert abs(figure.sigmas) < checks.LIMIT, figure


@pytest.mark.parametrize(
    "photons", [PHOTONS, pytest.param(30_000_000, marks=pytest.mark.slow)], ids=["3e5", "3e7"]
)
def test_the_literal_loop_agrees_as_well(photons):
    """The loop starts with weight 1 below the surface, and is walked for a fifth of the photons."""
    material, grid, profile = sample(photons)
    loop_photons, entering = photons // 5, 1.0 - material.specular_reflectance
    reflected, transmitted, lost = checks_layers.scalar_sums(material, loop_photons, grid)
    for (ours, error), theirs in zip(totals(profile), (reflected, transmitted), strict=True):
        total, squares = theirs.sum(axis=0)
        their_error = entering * checks.standard_error(total, squares, loop_photons)
        assert_agree(ours, entering * total / loop_photons, error, their_error)
    absorbed, lost = profile.absorbed[:, 0], entering * lost / loop_photons
    errors = absorbed_error(absorbed, photons), absorbed_error(lost, loop_photons)
    for each in zip(absorbed, lost, *errors, strict=True):
        assert_agree(*each)
    balance = checks.LIMIT * np.array(profile.meta["energy_balance_stderr"]) + 1e-9
    assert np.all(np.abs(profile.energy_balance) <= balance)


def assert_agree(a, b, a_error, b_error):
    assert abs(a - b) < checks.LIMIT * math.hypot(a_error, b_error) + 1e-12
