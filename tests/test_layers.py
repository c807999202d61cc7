"""The layered walk: Henyey-Greenstein, interfaces, stacks; against theory and the scalar MCML."""

import math

import checks
import numpy as np
import pytest
import reference
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
from scipy.integrate import quad

from sssfit._jit import layered, sampling
from sssfit.errors import SssfitWarning
from sssfit.grid import RadialGrid, paper_grid
from sssfit.material import Layer, Material, load_material
from sssfit.simulate import simulate_montecarlo
from sssfit.simulate._layered import LayeredWalk, alike_channels
from sssfit.simulate._run import run
from sssfit.simulate._semi_infinite import SemiInfiniteWalk

LIMIT = checks.LIMIT
ALPHA = 2.0 * stats.norm.sf(LIMIT)
ROUNDING = 1e-9  # weights are single precision; sums of them telescope to about 1e-11

sizes = pytest.mark.parametrize(
    "photons", [300_000, pytest.param(30_000_000, marks=pytest.mark.slow)], ids=["3e5", "3e7"]
)


def layer(sigma_a, sigma_s, g=0.0, eta=1.0, thickness=math.inf):
    """A layer; numbers make one channel, lists several."""
    sigma_a, sigma_s = np.broadcast_arrays(np.atleast_1d(sigma_a), np.atleast_1d(sigma_s))
    g = np.broadcast_to(np.asarray(g, float), sigma_a.shape)
    return Layer(eta, g, sigma_a.astype(float), sigma_s.astype(float), thickness)


def stack(*layers, above=1.0, below=1.0):
    channels = tuple(f"c{k}" for k in range(layers[0].sigma_a_per_mm.size))
    return Material("stack", channels, layers, eta_above=above, eta_below=below)


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


def assert_agree(a, b, a_error, b_error):
    assert abs(a - b) < LIMIT * math.hypot(a_error, b_error) + 1e-12


def assert_energy_conserved(profile):
    error = LIMIT * np.array(profile.meta["energy_balance_stderr"]) + ROUNDING
    assert np.all(np.abs(profile.energy_balance) <= error), profile.energy_balance


# Henyey-Greenstein


@pytest.mark.parametrize("g", [-0.99, -0.9, -0.5, -0.01, 0.0, 0.3, 0.8, 0.9, 0.99])
def test_sampled_directions_follow_henyey_greenstein(g):
    words = np.zeros(8 * sampling.LANES, np.uint32)
    sampling.seed_lanes(words, np.uint64(1), np.int64(0))
    n = 400_000
    cosines = np.array(
        [
            layered.sample_hg(np.float32(g), sampling.next_unit(words, k % sampling.LANES))
            for k in range(n)
        ],
        float,
    )
    # variance of the cosine: second moment (1 + 2 g^2)/3 less the mean's square
    sigma = math.sqrt((1.0 + 2.0 * g * g) / 3.0 - g * g)
    assert abs(cosines.mean() - g) * math.sqrt(n) / sigma < LIMIT
    # equal shares of probability, by the inverse of the cumulative density
    u = np.linspace(0.0, 1.0, 101)
    edges = 2.0 * u - 1.0
    if g != 0.0:
        edges = (1.0 + g * g - ((1.0 - g * g) / (1.0 - g + 2.0 * g * u)) ** 2) / (2.0 * g)
    edges[0], edges[-1] = -1.0, 1.0
    assert stats.chisquare(np.histogram(cosines, edges)[0]).pvalue > ALPHA


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
    row = {name: getattr(layered, name) // lanes for name in ("_UX", "_UY", "_UZ", "_G")}
    view[row["_UZ"]] = 1.0
    view[row["_G"]] = 0.9
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


# Published and closed forms


@sizes
def test_van_de_hulst_slab(photons):
    slab = stack(layer(1.0, 9.0, 0.75, 1.0, 0.2))
    r, r_error, t, t_error = totals(simulate_montecarlo(slab, photons=photons))
    assert_agree(r, 0.09739, r_error, 5e-6)
    assert_agree(t, 0.66096, t_error, 5e-6)


@sizes
def test_giovanelli_by_the_layered_walk(photons):
    material = stack(layer(1.0, 9.0, 0.0, 1.5), above=1.0)
    task = LayeredWalk((material,), (paper_grid(material),), 1, photons)
    (r, error), _ = walk_totals(task)
    specular = material.specular_reflectance
    assert_agree(specular + (1.0 - specular) * r, 0.2600, error, 5e-5)


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


# Against the other walks


@sizes
@pytest.mark.parametrize("name", ["skin1", "ketchup", "marble"])
def test_one_layer_equals_the_semi_infinite_walk(name, photons):
    material = load_material(name)
    grid = paper_grid(material)
    one = SemiInfiniteWalk((material,), (grid,), 1, photons)
    other = LayeredWalk((material,), (grid,), 2, photons)
    a, b = (each.sums(run(each, 2), 0).reflected for each in (one, other))
    for c in range(3):
        hits = [checks.effective_hits(each[:, c, 0], each[:, c, 1]) for each in (a, b)]
        groups = checks.groups_of_hits(*hits)
        merged = [[checks.merge(each[:, c, k], groups) for k in (0, 1)] for each in (a, b)]
        variance = sum(checks.standard_error(*each, photons) ** 2 for each in merged)
        difference = (merged[0][0] - merged[1][0]) / photons
        sigmas, _ = checks.chi_square_sigmas(difference, variance)
        assert abs(sigmas) < LIMIT


STACKS = {
    # MCML's own sample: 1/cm and cm there
    "mcml sample": stack(
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


@sizes
@pytest.mark.parametrize("name", list(STACKS))
def test_lanes_equal_the_scalar_mcml(name, photons):
    material = STACKS[name]
    loop_photons = photons // 5  # the loop is the slow side
    grid = RadialGrid(0.02, 400)
    task = LayeredWalk((material,), (grid,), 1, photons)
    sums = task.sums(run(task, 2), 0)
    layers = material.layers
    reflected, transmitted, absorbed, _ = reference.scalar_layered_walk(
        7,
        loop_photons,
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
    pairs = [(sums.reflected, reflected)]
    if sums.transmitted is not None:
        pairs.append((sums.transmitted, transmitted))
    for ours, theirs in pairs:
        own = checks.effective_hits(ours[:, 0, 0], ours[:, 0, 1])
        groups = checks.groups_of_hits(own, checks.effective_hits(theirs[:, 0], theirs[:, 1]))
        a, a_squares = (checks.merge(ours[:, 0, k], groups) for k in (0, 1))
        b, b_squares = (checks.merge(theirs[:, k], groups) for k in (0, 1))
        variance = (
            checks.standard_error(a, a_squares, photons) ** 2
            + checks.standard_error(b, b_squares, loop_photons) ** 2
        )
        sigmas, _ = checks.chi_square_sigmas(a / photons - b / loop_photons, variance)
        assert abs(sigmas) < LIMIT
    # a photon loses at most all it has in a layer: mean (1 - mean) bounds the variance
    for a, b in zip(sums.absorbed[:, 0] / photons, absorbed / loop_photons, strict=True):
        assert_agree(a, b, math.sqrt(a * (1 - a) / photons), math.sqrt(b * (1 - b) / loop_photons))


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
    assert [each.tolist() for each in alike_channels(material)] == [[0, 1], [2]]


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
    a, b = (simulate_montecarlo(STACKS["mcml sample"], photons=60_000, threads=k) for k in (1, 2))
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
