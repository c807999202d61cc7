"""The layered walk: Henyey-Greenstein, interfaces, stacks; against theory and the scalar MCML."""

import math
from pathlib import Path

import checks
import checks_layers
import numpy as np
import pytest
from checks_layers import STACKS, layer, stack
from hypothesis import given, settings
from hypothesis import strategies as st

from sssfit.errors import SssfitWarning
from sssfit.formats.mci import load_mci
from sssfit.grid import RadialGrid
from sssfit.simulate import shared_walks, simulate_montecarlo
from sssfit.simulate._run import run
from sssfit.simulate._walks import channels_with_equal_scattering
from sssfit.simulate.walk_layered import LayeredWalk

DATA = Path(__file__).parent / "data"
LIMIT = checks.LIMIT
ROUNDING = 1e-12  # what is booked for a photon adds up to 1 exactly; sums are double

sizes = pytest.mark.parametrize(
    "photons", [150_000, pytest.param(30_000_000, marks=pytest.mark.slow)], ids=["1.5e5", "3e7"]
)


def totals(profile):
    """Diffuse reflectance and transmittance of channel 0 with standard errors."""
    r, r_error = profile.diffuse_reflectance[0], profile.diffuse_reflectance_stderr[0]
    return r, r_error, profile.transmittance[0], profile.transmittance_stderr[0]


def walk_totals(task):
    """Mean and standard error of channel 0's reflected and transmitted weight."""
    sums = task.sums(run(task, 2), 0)
    through = sums.transmitted if sums.transmitted is not None else np.zeros((1, 1, 2))
    r = sums.reflected[:, 0].sum(axis=0)
    t = through[:, 0].sum(axis=0)
    return [
        (each[0] / sums.photons, float(checks.standard_error(each[0], each[1], sums.photons)))
        for each in (r, t)
    ]


def assert_within(figures):
    for figure in figures:
        assert abs(figure.sigmas) < LIMIT, figure


def assert_agree(a, b, a_error, b_error):
    assert abs(a - b) < LIMIT * math.hypot(a_error, b_error) + 1e-12


def assert_energy_conserved(profile):
    error = LIMIT * np.array(profile.meta["energy_balance_stderr"]) + ROUNDING
    assert np.all(np.abs(profile.energy_balance) <= error), profile.energy_balance


# Published and closed forms


def test_without_scattering_beer_and_lambert():
    slab = stack(layer(2.0, 0.0, 0.0, 1.0, 0.4))
    r, _, t, error = totals(simulate_montecarlo(slab, photons=200_000))
    assert r == 0.0
    assert_agree(t, math.exp(-0.8), error, 0.0)


def test_clear_layers_on_top_count_as_specular():
    glass = stack(layer(0.0, 0.0, 0.0, 1.5, 1.0), layer(0.1, 1.0, 0.0, 1.4))
    one, two = (0.5 / 2.5) ** 2, (0.1 / 2.9) ** 2
    expected = one + (1.0 - one) ** 2 * two / (1.0 - one * two)
    assert glass.specular_reflectance == pytest.approx(expected, rel=1e-12)
    profile = simulate_montecarlo(glass, photons=50_000)
    assert profile.absorbed[0, 0] == 0.0
    assert_energy_conserved(profile)


def test_a_slab_without_absorption_loses_nothing():
    profile = simulate_montecarlo(stack(layer(0.0, 10.0, 0.8, 1.4, 2.0)), photons=50_000)
    whole = profile.specular_reflectance + profile.diffuse_reflectance + profile.transmittance
    np.testing.assert_allclose(whole, 1.0, atol=ROUNDING)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["skin1", "chicken1", "ketchup"])
def test_a_half_space_by_the_original_mcml(name):
    assert_within(checks_layers.against_mcml(name, 10_000_000))


# Inputs of MCML that others run: g to 1, n below 1 (tests/data/README.md has the right values)


def walked_input(name, photons=None):
    """The profile of a .mci of tests/data on its own grid."""
    (asked,) = load_mci(DATA / name)
    return simulate_montecarlo(
        asked.material,
        photons=photons or asked.photons,
        dr_mm=asked.grid.dr_mm,
        radius_mm=asked.grid.radius_mm,
    )


def test_g_of_one_is_a_slab_that_only_absorbs():
    """Beams between two faces, each of reflectance R: T = (1-R)^2 a / (1 - R^2 a^2), a = e^-.1."""
    profile = walked_input("water-g1.mci")
    r, r_error, t, t_error = totals(profile)
    once, through = (0.33 / 2.33) ** 2, math.exp(-0.1)
    whole = (1.0 - once) ** 2 * through / (1.0 - (once * through) ** 2)
    assert (whole, whole * once * through) == pytest.approx((0.869187, 0.015776), abs=1e-6)
    assert_agree(t, whole, t_error, 0.0)
    assert_agree(r, whole * once * through, r_error, 0.0)
    assert profile.annulus_energy[1:].sum() + profile.beyond_grid[0] == 0.0  # straight back


def test_n_below_one():
    r, r_error, t, t_error = totals(walked_input("n098.mci", photons=200_000))
    assert_agree(r, 0.2500, r_error, 0.0006)
    assert_agree(t, 0.5859, t_error, 0.0006)


def test_only_ratios_of_indices_count():
    """Twice all indices, exact in binary, is the same walk."""
    one, two = (
        simulate_montecarlo(
            stack(layer(0.1, 10.0, 0.9, n, 1.0), above=n0, below=n0), photons=20_000
        )
        for n, n0 in ((0.75, 1.0), (1.5, 2.0))
    )
    assert one.annulus_energy.tobytes() == two.annulus_energy.tobytes()
    assert one.specular_reflectance == two.specular_reflectance


@pytest.mark.parametrize(
    "photons", [50_000, pytest.param(5_000_000, marks=pytest.mark.slow)], ids=["5e4", "5e6"]
)
def test_blood_scatters_forward(photons):
    """A photon at a time in double precision, cosines as published: .022613 +- .000054 (3e6)."""
    profile = walked_input("blood-g0.995.mci", photons=photons)
    r, error = profile.diffuse_reflectance[0], profile.diffuse_reflectance_stderr[0]
    assert_agree(r, 0.022613, error, 0.000054)
    assert_energy_conserved(profile)
    if photons <= 50_000:  # the published run's own error is about that of 1e5 photons
        assert_agree(r, 0.02290, error, 0.0003)


# Against the other walks


@sizes
@pytest.mark.parametrize("name", ["skin1", "ketchup", "marble"])
def test_one_layer_equals_the_semi_infinite_walk(name, photons):
    assert_within(checks_layers.one_layer(name, photons))


# With half of these photons a deflection 3 % off would pass in layers of g = .8.
@pytest.mark.parametrize(
    "photons", [300_000, pytest.param(30_000_000, marks=pytest.mark.slow)], ids=["3e5", "3e7"]
)
@pytest.mark.parametrize("name", list(STACKS))
def test_lanes_equal_the_scalar_mcml(name, photons):
    assert_within(checks_layers.against_scalar_mcml(name, photons))


@sizes
def test_a_split_slab_is_the_slab(photons):
    whole = stack(layer(0.2, 8.0, 0.7, 1.4, 0.8))
    split = stack(*[layer(0.2, 8.0, 0.7, 1.4, 0.2)] * 4)
    a = totals(simulate_montecarlo(whole, photons=photons, seed=1))
    b = totals(simulate_montecarlo(split, photons=photons, seed=2))
    assert_agree(a[0], b[0], a[1], b[1])
    assert_agree(a[2], b[2], a[3], b[3])


@sizes
def test_turned_over_a_stack_transmits_the_same_of_diffuse_light(photons):
    # Reciprocity holds for light from all sides and equal outer media; along the normal a stack
    # of an absorbing and a scattering layer transmits more with the absorbing one first.
    top, bottom = layer(0.5, 1.0, 0.3, 1.0, 0.6), layer(0.05, 6.0, 0.8, 1.0, 0.9)
    over, turned = stack(top, bottom), stack(bottom, top)
    grid = RadialGrid(0.05, 100)
    lit = [
        walk_totals(LayeredWalk((each,), (grid,), k, photons, diffuse=True))[1]
        for k, each in enumerate((over, turned))
    ]
    assert_agree(lit[0][0], lit[1][0], lit[0][1], lit[1][1])
    beams = [
        walk_totals(LayeredWalk((each,), (grid,), k, photons))[1]
        for k, each in enumerate((over, turned))
    ]
    assert beams[0][0] - beams[1][0] > LIMIT * math.hypot(beams[0][1], beams[1][1])


# Channels


def test_channels_that_differ_in_absorption_only_share_a_walk():
    material = stack(layer([0.1, 0.3, 0.2], [2.0, 2.0, 3.0], 0.5, 1.3, 1.0))
    assert [each.tolist() for each in channels_with_equal_scattering(material)] == [[0, 1], [2]]


@sizes
def test_shared_walks_agree_with_walks_of_their_own(photons):
    layers = (
        layer([0.02, 0.3, 1.0, 0.0], 5.0, 0.6, 1.4, 0.4),
        layer([0.5, 0.1, 0.3, 0.2], 3.0, 0.0, 1.3),
    )
    shared = simulate_montecarlo(stack(*layers), photons=photons, seed=1)
    assert_energy_conserved(shared)
    for c in range(4):
        single = stack(
            *(
                layer(
                    each.sigma_a_per_mm[c],
                    each.sigma_s_per_mm[c],
                    each.g[c],
                    each.eta,
                    each.thickness_mm,
                )
                for each in layers
            )
        )
        alone = simulate_montecarlo(single, photons=photons, seed=2 + c)
        assert_agree(
            shared.diffuse_reflectance[c],
            alone.diffuse_reflectance[0],
            shared.diffuse_reflectance_stderr[c],
            alone.diffuse_reflectance_stderr[0],
        )
        for k in range(2):
            a, b = shared.absorbed[k, c], alone.absorbed[k, 0]
            assert_agree(a, b, math.sqrt(a / photons), math.sqrt(b / photons))


def test_plain_half_spaces_of_one_relative_index_share_a_walk_and_layers_walk_alone():
    plain = layer(0.1, 1.0, 0.0, 2.0)
    materials = {
        "index 2 under air": stack(plain),
        "layered": stack(layer(0.1, 1.0, 0.0, 2.0, 1.0), plain),
        "index 2 under water": stack(plain, above=1.5),
        "index 3 under water": stack(layer(0.3, 1.0, 0.0, 3.0), above=1.5),
        "g not 0": stack(layer(0.1, 1.0, 0.5, 2.0)),
        "slab": stack(layer(0.1, 1.0, 0.0, 2.0, 1.0)),
        "layered again": stack(layer(0.1, 1.0, 0.0, 2.0, 1.0), plain),
        "into the thinner medium": stack(layer(0.1, 1.0, 0.0, 1.0), above=2.0),
        "and again": stack(layer(0.1, 1.0, 0.0, 1.0), above=2.0),
        "index 2 under air again": stack(layer(1.0, 9.0, 0.0, 2.0)),
    }
    names = list(materials)
    shared = shared_walks(list(materials.values()))
    assert [[names[k] for k in group] for group in shared] == [
        ["index 2 under air", "index 3 under water", "index 2 under air again"],
        *([name] for name in names[1:3]),
        *([name] for name in names[4:9]),
    ]


# Energy and reproducibility


@st.composite
def stacks(draw):
    """One to five layers of any kind, at least one of them matter, finite or not."""
    count = draw(st.integers(1, 5))
    etas = st.sampled_from([1.0, 1.33, 1.4, 1.5, 2.0])
    layers = []
    for k in range(count):
        clear = k > 0 and draw(st.booleans())
        sigma_a = 0.0 if clear else draw(st.floats(0.001, 5.0))
        sigma_s = 0.0 if clear else draw(st.floats(0.0, 20.0))
        endless = k == count - 1 and not clear and draw(st.booleans())
        thickness = math.inf if endless else draw(st.floats(0.01, 3.0))
        layers.append(layer(sigma_a, sigma_s, draw(st.floats(-0.99, 0.99)), draw(etas), thickness))
    below = draw(etas) if math.isfinite(layers[-1].thickness_mm) else 1.0
    return stack(*layers, above=draw(etas), below=below)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(stacks())
def test_energy_is_conserved_over_random_stacks(material):
    profile = simulate_montecarlo(material, photons=1000, dr_mm=0.1, radius_mm=3.0)
    assert_energy_conserved(profile)
    for array in (profile.annulus_energy, profile.absorbed):
        assert np.all(np.isfinite(array))
        assert np.all(array >= -ROUNDING)


def test_same_bits_on_one_and_two_threads():
    a, b = (simulate_montecarlo(STACKS["MCML's sample"], photons=60_000, threads=k) for k in (1, 2))
    assert a.annulus_energy.tobytes() == b.annulus_energy.tobytes()
    assert a.annulus_transmittance.tobytes() == b.annulus_transmittance.tobytes()
    assert a.absorbed.tobytes() == b.absorbed.tobytes()


def test_unfinished_walks_are_kept_apart_in_layers_too():
    material = stack(layer(0.0, 1.0, 0.5, 1.4))
    with pytest.warns(SssfitWarning, match="still inside after a million collisions"):
        profile = simulate_montecarlo(material, photons=10_000, dr_mm=0.1, radius_mm=10.0)
    assert profile.unfinished[0] > 0.0
    assert_energy_conserved(profile)


def test_transmittance_has_an_honest_error():
    slab = stack(layer(0.2, 3.0, 0.5, 1.4, 1.0))
    runs = [
        simulate_montecarlo(slab, photons=1000, seed=k, dr_mm=0.5, radius_mm=2.0, threads=1)
        for k in range(300)
    ]
    spread = np.std([each.transmittance[0] for each in runs], ddof=1)
    claimed = math.sqrt(np.mean([each.transmittance_stderr[0] ** 2 for each in runs]))
    # a standard deviation from 300 normal draws has a relative standard error of sqrt(1/598)
    assert abs(spread / claimed - 1.0) < LIMIT * math.sqrt(1.0 / 598.0)


def test_auto_radius_counts_what_a_slab_transmits():
    slab = stack(layer(0.01, 5.0, 0.5, 1.3, 3.0))
    profile = simulate_montecarlo(slab, photons=50_000, radius_mm="auto")
    lost = profile.beyond_grid + profile.beyond_grid_transmittance
    assert np.all(lost < 1e-3 * (profile.diffuse_reflectance + profile.transmittance))
