"""The layered walk: Henyey-Greenstein, interfaces, stacks; against theory and the scalar MCML."""

import math
from pathlib import Path

import checks
import checks_layers
import numpy as np
import pytest
import reference
from checks_layers import STACKS, layer, stack
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
from scipy.integrate import quad

from sssfit._jit import layered, sampling
from sssfit.errors import SssfitWarning
from sssfit.formats.mci import load_mci
from sssfit.grid import RadialGrid
from sssfit.simulate import shared_walks, simulate_montecarlo
from sssfit.simulate._run import run
from sssfit.simulate._walks import LayeredWalk, channels_with_equal_scattering

DATA = Path(__file__).parent / "data"
LIMIT = checks.LIMIT
ALPHA = 2.0 * stats.norm.sf(LIMIT)
ROUNDING = 1e-9  # weights are single precision; sums of them telescope to about 1e-11

sizes = pytest.mark.parametrize(
    "photons", [300_000, pytest.param(30_000_000, marks=pytest.mark.slow)], ids=["3e5", "3e7"]
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


# Henyey-Greenstein


@pytest.mark.parametrize("g", [-0.99, -0.9, -0.5, -0.01, 0.0, 0.3, 0.8, 0.9, 0.99, 0.9999])
def test_sampled_directions_follow_henyey_greenstein(g):
    words = np.zeros(8 * sampling.LANES, np.uint32)
    sampling.seed_lanes(words, np.uint64(1), np.int64(0))
    n = 400_000
    back = np.float32(1.0 - g)
    draws = [
        layered.sample_hg(back, sampling.next_unit(words, k % sampling.LANES)) for k in range(n)
    ]
    less = np.array(draws, float)  # 1 - cosine
    # variance of the cosine: second moment (1 + 2 g^2)/3 less the mean's square
    sigma = math.sqrt((1.0 + 2.0 * g * g) / 3.0 - g * g)
    assert abs(less.mean() - (1.0 - g)) * math.sqrt(n) / sigma < LIMIT
    # equal shares of probability, by the inverse of the cumulative density
    u = np.linspace(0.0, 1.0, 101)
    edges = 2.0 - 2.0 * u
    if g != 0.0:
        s = (1.0 - g * g) / (1.0 - g + 2.0 * g * u)
        edges = (s * s - (1.0 - g) ** 2) / (2.0 * g)
    edges[0], edges[-1] = 2.0, 0.0
    assert stats.chisquare(np.histogram(less, edges[::-1])[0]).pvalue > ALPHA


@pytest.mark.parametrize("g", [-0.7, 0.0, 0.9])
def test_phase_function_is_normalised_and_has_mean_cosine_g(g):
    whole, _ = quad(lambda x: layered.hg_pdf(x, g), -1.0, 1.0, epsabs=1e-13, epsrel=1e-13)
    mean, _ = quad(lambda x: x * layered.hg_pdf(x, g), -1.0, 1.0, epsabs=1e-13, epsrel=1e-13)
    assert whole == pytest.approx(1.0, abs=1e-12)
    assert mean == pytest.approx(g, abs=1e-12)


def test_deflections_in_the_walk_have_mean_cosine_g_and_keep_directions_unit():
    rows, lanes = layered._FLOAT_ROWS, sampling.LANES
    floats = np.zeros(rows * lanes, np.float32)
    words = np.zeros(layered._WORD_ROWS * lanes, np.uint32)
    sampling.seed_lanes(words, np.uint64(1), np.int64(0))
    view = floats.reshape(rows, lanes)
    row = {name: getattr(layered, name) // lanes for name in ("_UX", "_UY", "_UZ", "_BACK")}
    view[row["_UZ"]] = 1.0
    view[row["_BACK"]] = 0.1
    view[layered._SIGMA_T // lanes] = 1.0
    view[layered._BOTTOM // lanes], view[layered._TOP // lanes] = np.inf, -np.inf
    cosines, azimuth = [], []
    for _ in range(2000):
        before = view[[row["_UX"], row["_UY"], row["_UZ"]]].astype(float)
        layered.advance(floats, words, lanes)
        after = view[[row["_UX"], row["_UY"], row["_UZ"]]].astype(float)
        cosines.append(np.sum(before * after, axis=0))
        azimuth.append(np.arctan2(after[1], after[0]))
    assert np.abs(np.linalg.norm(after, axis=0) - 1.0).max() < 1e-6
    cosines = np.concatenate(cosines)
    sigma = math.sqrt((1.0 + 2.0 * 0.81) / 3.0 - 0.81)
    assert abs(cosines.mean() - 0.9) * math.sqrt(cosines.size) / sigma < LIMIT
    # after 2000 deflections of mean cosine .9 the azimuth has forgotten where it began
    assert stats.chisquare(np.histogram(azimuth[-1], 8, (-np.pi, np.pi))[0]).pvalue > ALPHA


@pytest.mark.parametrize("g", [0.99, 0.995, 0.9999])
def test_directions_are_forgotten_as_g_to_the_number_of_collisions(g):
    """Mean cosine between the first direction and the n-th is g^n; here n = 1/(1 - g)."""
    rows, lanes, n = layered._FLOAT_ROWS, sampling.LANES, round(1.0 / (1.0 - g))
    floats = np.zeros(rows * lanes, np.float32)
    words = np.zeros(layered._WORD_ROWS * lanes, np.uint32)
    view = floats.reshape(rows, lanes)
    view[layered._BACK // lanes] = 1.0 - g
    view[layered._SIGMA_T // lanes] = 1.0
    view[layered._BOTTOM // lanes], view[layered._TOP // lanes] = np.inf, -np.inf
    start = np.array([0.48, 0.6, 0.64])
    cosines = []
    for batch in range(40):
        sampling.seed_lanes(words, np.uint64(1), np.int64(batch))
        view[: layered._UZ // lanes + 1] = 0.0
        for row, component in zip((layered._UX, layered._UY, layered._UZ), start, strict=True):
            view[row // lanes] = component
        for _ in range(n):
            layered.advance(floats, words, lanes)
        after = view[[layered._UX // lanes, layered._UY // lanes, layered._UZ // lanes]]
        cosines.append(start @ after.astype(float))
    cosines = np.concatenate(cosines)
    assert abs(cosines.mean() - g**n) / (cosines.std() / math.sqrt(cosines.size)) < LIMIT


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


@sizes
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


# Events


@pytest.mark.parametrize("below", [1.0, 1.4])
def test_an_interface_lets_light_through_by_fresnels_formula(below):
    # 300 x 256 photons out of index 1.5, up into 1 or down into what is below, decision by
    # decision: a reflectance 1 % high would hold back some 18 more
    material = stack(layer(0.1, 1.0, 0.5, 1.5, 1.0), below=below)
    task = LayeredWalk((material,), (RadialGrid(1.0, 5),), 1, 1000)
    (stack_, bins), lanes = task.groups[0], sampling.LANES
    cosines = np.random.default_rng(1).uniform(-1.0, 1.0, (300, lanes)).astype(np.float32)
    for batch, uz in enumerate(cosines):
        floats, words, booked, *_, ledger = lane_at_an_event(task, 1)
        sampling.seed_lanes(words, np.uint64(1), np.int64(batch))
        drawn = words.copy()
        floats[layered._UX : layered._UX + lanes] = np.sqrt(1.0 - uz.astype(float) ** 2)
        floats[layered._UZ : layered._UZ + lanes] = uz
        words[layered._AT_INTERFACE : layered._AT_INTERFACE + lanes] = 1
        stays = [
            layered.handle_event(floats, words, booked, lane, stack_, bins, ledger)
            for lane in range(lanes)
        ]
        expected = [
            float(sampling.next_unit(drawn, lane))
            < reference.fresnel(abs(float(uz[lane])), 1.5 / (below if uz[lane] > 0.0 else 1.0))
            for lane in range(lanes)
        ]
        assert stays == expected


def lane_at_an_event(task, collisions):
    """One lane inside, of weight ten, after so many collisions; the arguments of its event."""
    (stack_, bins), lane = task.groups[0], 3
    floats = np.zeros(layered._FLOAT_ROWS * sampling.LANES, np.float32)
    words = np.zeros(layered._WORD_ROWS * sampling.LANES, np.uint32)
    booked = np.ones((sampling.LANES, bins.channel.size, 2))
    sampling.seed_lanes(words, np.uint64(1), np.int64(0))
    floats[layered._WEIGHT : layered._WEIGHT + sampling.LANES] = 1.0
    floats[layered._WEIGHT + lane] = 10.0
    floats[layered._PATH + lane] = 0.5
    words[layered._COLLISIONS + lane] = collisions
    booked[lane, :, 1] = 10.0
    return floats, words, booked, lane, stack_, bins, task.empty_tally().ledger


def test_a_layered_walk_ends_unfinished_at_a_million_collisions_and_not_before():
    material = stack(layer([0.0, 0.2], 1.0, 0.5, 1.3))
    task = LayeredWalk((material,), (RadialGrid(1.0, 5),), 1, 1000)
    events = np.zeros(sampling.LANES, np.int64)

    before = lane_at_an_event(task, 999_999)
    assert layered.find_events(*before[:2], sampling.LANES, events) == 0
    layered.handle_event(*before)
    assert not before[-1].unfinished.any()
    assert before[-1].roulette.any()

    at = lane_at_an_event(task, 1_000_000)
    assert layered.find_events(*at[:2], sampling.LANES, events) == 1
    assert events[0] == at[3]
    assert not layered.handle_event(*at)
    assert not at[-1].roulette.any()
    # ten: what roulette gave the photon is part of it; .2 per mm over half a mm
    left = 10.0 * np.exp([0.0, -0.1])
    np.testing.assert_allclose(at[-1].unfinished, np.stack([left, left**2], 1), rtol=1e-12)
    np.testing.assert_allclose(at[-1].absorbed[0], 10.0 - left, rtol=1e-12, atol=1e-12)


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
