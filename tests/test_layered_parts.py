"""The parts of the layered walk: samplers, deflections, interfaces, events; each against theory."""

import hashlib
import math
import os
import platform
import subprocess
import sys
from pathlib import Path

import checks
import numpy as np
import pytest
import reference
from checks_layers import STACKS, layer, stack
from scipy import stats
from scipy.integrate import quad

from sssfit._jit import (
    fused,
    layered,
    layered_end,
    layered_lanes,
    layered_slots,
    layered_tally,
    layered_walk,
)
from sssfit._jit.lanes import (
    FLOAT_ROWS,
    LANES,
    SLOT_ROWS,
    SLOT_WORD_ROWS,
    STRIDE,
    SUMS,
    WORD_ROWS,
)
from sssfit.grid import RadialGrid
from sssfit.simulate.walk_layered import LayeredWalk

LIMIT = checks.LIMIT
ALPHA = 2.0 * stats.norm.sf(LIMIT)
SWEEPS_BETWEEN = layered._SWEEPS_BETWEEN


def streams(rows, seed=1, stream=0):
    """A block of words of so many rows, its generators seeded."""
    words = np.zeros(rows * STRIDE, np.uint32)
    fused.seed_streams(words, np.uint64(seed), np.uint64(stream))
    return words


def row(block, first):
    """The lanes of a row."""
    return block[int(first) : int(first) + LANES]


def uniforms(count):
    words = streams(4)
    return np.array([fused.uniform(words, np.uint64(k % LANES)) for k in range(count)], float)


# Samplers


def test_a_fused_multiply_add_rounds_once():
    # (1 + 2^-12)^2 - (1 + 2^-11) = 2^-24, which a product rounded by itself would lose
    a = np.float32(1.0 + 2.0**-12)
    assert sum_of_product(a, a, np.float32(-1.0 - 2.0**-11)) == 2.0**-24


@fused.jit
def sum_of_product(a, b, c):
    return fused.fma(a, b, c)


def test_generator_is_xoshiro128_plus():
    words = streams(4, seed=5)
    state = [int(words[k * STRIDE + 7]) for k in range(4)]
    for _ in range(1000):
        expected = (state[0] + state[3]) % 2**32 >> 9
        assert fused.uniform(words, np.uint64(7)) == np.float32((expected + 0.5) * 2.0**-23)
        state = reference.xoshiro128_step(state)


def test_streams_follow_every_bit_of_the_seed_and_differ_between_lanes_and_batches():
    blocks = [streams(4, seed, 3) for seed in (0, *(2**k for k in range(64)), 1 + 2**32)]
    blocks += [streams(4, 1, stream) for stream in range(300) if stream != 3]
    states = np.concatenate([each.reshape(4, STRIDE)[:, :LANES].T for each in blocks])
    assert len(np.unique(states, axis=0)) == len(states)


def test_neighbouring_lanes_and_streams_are_uncorrelated():
    draws = []
    for stream in range(4):
        words = streams(4, 1, stream)
        draws.append(
            [[fused.uniform(words, np.uint64(k)) for _ in range(400)] for k in range(LANES)]
        )
    x = np.array(draws, float).reshape(4 * LANES, -1) - 0.5
    r = np.corrcoef(x)[np.triu_indices(len(x), 1)] * math.sqrt(x.shape[1])
    assert np.max(np.abs(r)) < stats.norm.isf(ALPHA / 2.0 / len(r))


def test_uniforms_are_inside_the_open_interval_and_uniform():
    u = uniforms(400_000)
    assert u.min() > 0.0
    assert u.max() < 1.0
    assert stats.chisquare(np.histogram(u, 256, (0.0, 1.0))[0]).pvalue > ALPHA


def test_free_paths_are_logarithms():
    u = (np.arange(2**23, dtype=np.float64)[:: 2**5] + 0.5) * 2.0**-23
    ours = np.array([fused.free_path(np.float32(each)) for each in u], float)
    np.testing.assert_allclose(ours, -np.log(u), rtol=2e-7, atol=1e-7)
    assert np.all(ours > 0.0)
    longest, shortest = (fused.free_path(np.float32(each)) for each in (2.0**-24, 1.0 - 2.0**-24))
    assert (longest, shortest) == pytest.approx((24.0 * math.log(2.0), 2.0**-24), abs=1e-7)
    assert shortest > 0.0  # 0 times the endless free path of a clear layer is no number


def test_turns_are_cosines_and_sines():
    u = np.linspace(1e-6, 1.0 - 1e-6, 100_001)
    ours = np.array([fused.turn(np.float32(each)) for each in u], float)
    angle = 2.0 * np.pi * np.float32(u).astype(float) - np.pi
    # single precision of the angle alone is 3e-7
    np.testing.assert_allclose(ours, np.stack([np.cos(angle), np.sin(angle)], 1), atol=1e-6)


def test_decay_is_the_exponential_and_never_above_one():
    x = np.concatenate([[0.0], np.logspace(-9.0, math.log10(86.5), 20_001)]).astype(np.float32)
    ours = np.array([fused.decay(each) for each in x], float)
    np.testing.assert_allclose(ours, np.exp(-x.astype(float)), rtol=2e-7)
    assert ours[0] == 1.0
    assert np.all(ours <= 1.0)
    assert 0.0 < fused.decay(np.float32(1e30)) < 2e-38


# Deflections and flights


@pytest.mark.parametrize("g", [-0.99, -0.9, -0.5, -0.01, 0.0, 0.3, 0.8, 0.9, 0.99, 0.9999])
def test_sampled_directions_follow_henyey_greenstein(g):
    back, uz = np.float32(1.0 - g), np.float32(0.3)
    drawn = uniforms(100_000)
    pairs = np.array([layered_lanes.deflection(back, np.float32(u), uz) for u in drawn], float)
    less = pairs[:, 0]  # 1 - cosine
    np.testing.assert_allclose(pairs[:, 1], 1.0 / 1.3, rtol=3e-7)
    # variance of the cosine: second moment (1 + 2 g^2)/3 less the mean's square
    sigma = math.sqrt((1.0 + 2.0 * g * g) / 3.0 - g * g)
    assert abs(less.mean() - (1.0 - g)) * math.sqrt(less.size) / sigma < LIMIT
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
    whole, _ = quad(lambda x: layered_lanes.hg_pdf(x, g), -1.0, 1.0, epsabs=1e-13, epsrel=1e-13)
    mean, _ = quad(lambda x: x * layered_lanes.hg_pdf(x, g), -1.0, 1.0, epsabs=1e-13, epsrel=1e-13)
    assert whole == pytest.approx(1.0, abs=1e-12)
    assert mean == pytest.approx(g, abs=1e-12)


def scattering_lanes(g, start):
    """Lanes of one direction in a medium of that g."""
    floats = np.zeros(FLOAT_ROWS * STRIDE, np.float32)
    row(floats, layered_lanes.BACK)[:] = 1.0 - g
    for k, each in enumerate(start):
        row(floats, k * STRIDE + int(layered_lanes.UX))[:] = each
    return floats


def directions(floats):
    """Directions of all lanes, (3, lanes)."""
    return np.array([row(floats, at) for at in UX_UY_UZ], float)


UX_UY_UZ = (layered_lanes.UX, layered_lanes.UY, layered_lanes.UZ)


def collide(floats, words, sweep):
    """One deflection of every lane, as in ``trace_batch``."""
    layered_lanes.draw(floats, words, LANES)
    layered_lanes.rotate(floats, LANES)
    if sweep % SWEEPS_BETWEEN == 0:
        layered_lanes.renormalise(floats, LANES)


def test_deflections_in_the_walk_have_mean_cosine_g_and_keep_directions_unit():
    floats, words = scattering_lanes(0.9, (0.0, 0.0, 1.0)), streams(6)
    cosines, azimuth, lengths = [], [], []
    for sweep in range(2000):
        before = directions(floats)
        collide(floats, words, sweep)
        after = directions(floats)
        cosines.append(np.sum(before * after, axis=0))
        azimuth.append(np.arctan2(after[1], after[0]))
        lengths.append(np.linalg.norm(after, axis=0))
    assert np.abs(np.array(lengths) - 1.0).max() < 2e-6
    cosines = np.concatenate(cosines)
    sigma = math.sqrt((1.0 + 2.0 * 0.81) / 3.0 - 0.81)
    assert abs(cosines.mean() - 0.9) * math.sqrt(cosines.size) / sigma < LIMIT
    # after 2000 deflections of mean cosine .9 the azimuth has forgotten where it began
    assert stats.chisquare(np.histogram(azimuth[-1], 8, (-np.pi, np.pi))[0]).pvalue > ALPHA


@pytest.mark.parametrize("g", [0.99, 0.995, 0.9999])
def test_directions_are_forgotten_as_g_to_the_number_of_collisions(g):
    """Mean cosine between the first direction and the n-th is g^n; here n = 1/(1 - g)."""
    n, start = round(1.0 / (1.0 - g)), np.array([0.48, 0.6, 0.64])
    cosines = []
    for stream in range(40):
        floats, words = scattering_lanes(g, start), streams(6, 1, stream)
        for sweep in range(n):
            collide(floats, words, sweep)
        cosines.append(start @ directions(floats))
    cosines = np.concatenate(cosines)
    assert abs(cosines.mean() - g**n) / (cosines.std() / math.sqrt(cosines.size)) < LIMIT


def test_flights_that_end_inside_are_flown_and_the_others_flagged():
    floats, rng = np.zeros(FLOAT_ROWS * STRIDE, np.float32), np.random.default_rng(1)
    for at in range(FLOAT_ROWS):
        row(floats, at * STRIDE)[:] = rng.uniform(0.0, 1.0, LANES)
    row(floats, layered_lanes.UZ)[:] = rng.uniform(-1.0, 1.0, LANES)
    row(floats, layered_lanes.FLIGHT)[:] = rng.exponential(0.5, LANES)
    row(floats, layered_lanes.THICKNESS)[:] = 1.0
    before, flags = floats.copy(), np.zeros(STRIDE, np.uint8)
    layered_lanes.fly(floats, flags, LANES)
    z, uz, flight = (
        row(before, at).astype(float)
        for at in (layered_lanes.Z, layered_lanes.UZ, layered_lanes.FLIGHT)
    )
    leaves = (z + flight * uz < 0.0) | (z + flight * uz > 1.0)
    assert 20 < leaves.sum() < 200
    np.testing.assert_array_equal(flags[:LANES], leaves)
    flown = np.where(leaves, 0.0, flight)
    for at, along in zip(
        (layered_lanes.X, layered_lanes.Y, layered_lanes.Z), UX_UY_UZ, strict=True
    ):
        expected = row(before, at) + flown * row(before, along)
        np.testing.assert_allclose(row(floats, at), expected, atol=2e-7)
    path = row(before, layered_lanes.PATH) + flown
    np.testing.assert_allclose(row(floats, layered_lanes.PATH), path, atol=3e-7)


@pytest.mark.parametrize("live", [1, 63, 64, 200, LANES])
def test_flagged_lanes_are_listed_in_order_and_those_beyond_the_live_ones_are_not(live):
    rng = np.random.default_rng(live)
    for share in (0.0, 0.01, 0.3, 1.0):
        flags = (rng.uniform(0.0, 1.0, STRIDE) < share).astype(np.uint8)
        expected = np.flatnonzero(flags[:live])
        lanes = np.zeros(STRIDE, np.uint64)
        count = layered_lanes.list_flagged(flags, flags.view(np.uint64), live, lanes)
        np.testing.assert_array_equal(lanes[:count], expected)


def test_the_last_lanes_move_into_the_gaps():
    floats = np.arange(3 * STRIDE, dtype=np.float32)
    words, shares = np.arange(2 * STRIDE, dtype=np.uint32), np.arange(STRIDE, dtype=np.float32)
    gone = np.zeros(STRIDE, np.uint8)
    gone[[0, 3, 8, 9]] = 1
    live = layered_lanes.remove_lanes(floats, words, shares, gone, 10)
    assert live == 6
    assert sorted(shares[:live]) == [1, 2, 4, 5, 6, 7]
    np.testing.assert_array_equal(floats.reshape(3, -1)[2, :live], shares[:live] + 2 * STRIDE)
    np.testing.assert_array_equal(words.reshape(2, -1)[1, :live], shares[:live] + STRIDE)
    assert not gone.any()


# Interfaces


def slots_at(uz, ratio, thickness=1.0):
    """Slots half way down a layer, headed for its interfaces; free paths of 0 beyond them."""
    e = np.zeros(SLOT_ROWS * STRIDE, np.float32)
    row(e, layered_lanes.UX)[:] = np.sqrt(1.0 - uz.astype(float) ** 2)
    row(e, layered_lanes.UZ)[:] = uz
    row(e, layered_lanes.Z)[:] = 0.5 * thickness
    row(e, layered_slots._OWN_THICKNESS)[:] = thickness
    row(e, layered_slots._NEXT_THICKNESS)[:] = 2.0
    row(e, layered_slots._RATIO)[:] = ratio
    return e


@pytest.mark.parametrize("ratio", [1.5, 1.0, 1.5 / 1.4, 1.0 / 1.33])
def test_an_interface_lets_light_through_by_fresnels_formula(ratio):
    # 300 x 256 photons, decision by decision: a reflectance 1 % high would hold back some 18 more
    cosines = np.random.default_rng(1).uniform(-1.0, 1.0, (300, LANES)).astype(np.float32)
    for batch, uz in enumerate(cosines):
        e, words = slots_at(uz, ratio), streams(SLOT_WORD_ROWS, 1, batch)
        drawn = words.copy()
        layered_slots.meet(e, words, LANES)
        reflectance = [reference.fresnel(abs(float(each)), ratio) for each in uz]
        u = [float(fused.uniform(drawn, np.uint64(k))) for k in range(LANES)]
        crosses = row(words, layered_slots._CROSSES) == 1
        np.testing.assert_array_equal(crosses, np.array(u) >= np.array(reflectance))
        # Snell and the mirror
        sine = np.sqrt(1.0 - uz.astype(float) ** 2)
        ux, vz = (row(e, at).astype(float) for at in (layered_lanes.UX, layered_lanes.UZ))
        np.testing.assert_allclose(ux, np.where(crosses, ratio * sine, sine), atol=3e-7)
        np.testing.assert_array_equal(np.sign(vz), np.where(crosses, np.sign(uz), -np.sign(uz)))
        np.testing.assert_allclose(ux**2 + vz**2, 1.0, atol=2e-6)
        # half the layer, along the direction; then the top or bottom of a layer
        length = 0.5 / np.abs(uz.astype(float))
        np.testing.assert_allclose(row(e, layered_slots.LENGTH), length, rtol=3e-7)
        np.testing.assert_allclose(row(e, layered_lanes.X), length * sine, rtol=1e-6)
        floor = np.where(crosses, 2.0, 1.0)
        np.testing.assert_array_equal(row(e, layered_lanes.Z), np.where(vz > 0.0, 0.0, floor))


def test_beyond_the_critical_angle_everything_is_reflected():
    uz = np.linspace(1e-3, math.sqrt(1.0 - 1.0 / 1.5**2) - 1e-6, LANES).astype(np.float32)
    for stream in range(300):
        e, words = slots_at(uz, 1.5), streams(SLOT_WORD_ROWS, 1, stream)
        layered_slots.meet(e, words, LANES)
        assert not row(words, layered_slots._CROSSES).any()


def test_a_fresh_free_path_begins_at_the_interface():
    """Mean free path 2 along the normal into a layer of 2: exp(-1) of all meet its other side."""
    lengths, again = [], 0
    for stream in range(400):
        e = slots_at(np.ones(LANES, np.float32), 1.0)
        row(e, layered_slots._NEXT_FREE_PATH)[:] = 2.0
        words = streams(SLOT_WORD_ROWS, 1, stream)
        layered_slots.meet(e, words, LANES)
        meets = row(words, layered_slots._MEETS_AGAIN) == 1
        z = row(e, layered_lanes.Z).astype(float)
        assert not z[meets].any()
        np.testing.assert_array_equal(row(e, layered_slots._FRESH), z)
        lengths.append(z[~meets])
        again += int(meets.sum())
    n, share = 400 * LANES, math.exp(-1.0)
    assert abs(again / n - share) < LIMIT * math.sqrt(share * (1.0 - share) / n)
    edges = -2.0 * np.log1p(-np.linspace(0.0, 1.0 - share, 51))
    counts = np.histogram(np.concatenate(lengths), edges)[0]
    assert stats.chisquare(counts).pvalue > ALPHA


# Events


def lane_inside(task, collisions):
    """One lane of weight 10 after so many collisions; blocks, the lane, the sweep, the ledger."""
    _, bins = task.groups[0]
    lane, sweep = np.uint64(3), np.uint32(2_000_000)
    floats = np.zeros(FLOAT_ROWS * STRIDE, np.float32)
    words = streams(WORD_ROWS)
    row(floats, layered_lanes.WEIGHT)[:] = 1.0
    floats[layered_lanes.WEIGHT + lane] = floats[layered_lanes.BOOKED + lane] = 10.0
    floats[layered_lanes.PATH + lane] = 0.5
    row(words, layered_lanes.LAYER)[:] = 1
    row(words, layered_lanes.BORN)[:] = sweep
    words[layered_lanes.BORN + lane] = sweep - np.uint32(collisions)
    shares = np.ones(bins.channel.size * STRIDE, np.float32)
    return floats, words, shares, lane, sweep, task.empty_tally().ledger


def event_of(task, collisions):
    """Whether that lane is flagged, whether it ends, and what is booked."""
    floats, words, shares, lane, sweep, ledger = lane_inside(task, collisions)
    stack_, bins = task.groups[0]
    flags, exits = np.zeros(STRIDE, np.uint8), np.zeros(STRIDE, np.uint64)
    layered_end.flag_weak(floats, words, flags, LANES, sweep)
    layers = stack_.layers.size // 4
    absorbed = np.zeros(bins.channel.size * SUMS * layers)
    ended = layered_end.end_or_boost(
        floats,
        words,
        shares,
        np.array([lane]),
        1,
        sweep,
        stack_.excess_per_mm,
        absorbed,
        bins,
        ledger,
        exits,
    )
    layered_tally.add_absorbed(absorbed, bins, ledger)
    return np.flatnonzero(flags).tolist(), ended, ledger


def test_a_layered_walk_ends_unfinished_at_a_million_collisions_and_not_before():
    material = stack(layer([0.0, 0.2], 1.0, 0.5, 1.3))
    task = LayeredWalk((material,), (RadialGrid(1.0, 5),), 1, 1000)
    flagged, _, ledger = event_of(task, 999_999)
    assert flagged == []
    assert not ledger.unfinished.any()
    assert ledger.roulette.any()

    flagged, ended, ledger = event_of(task, 1_000_000)
    assert (flagged, ended) == ([3], 1)
    assert not ledger.roulette.any()
    # ten: what roulette gave the photon is part of it; .2 per mm over half a mm
    left = 10.0 * np.exp([0.0, -0.1])
    np.testing.assert_allclose(ledger.unfinished, np.stack([left, left**2], 1), rtol=4e-7)
    np.testing.assert_allclose(ledger.absorbed[0], 10.0 - left, rtol=4e-6, atol=0.0)
    balance = ledger.absorbed[0] + ledger.unfinished[:, 0]
    np.testing.assert_array_equal(balance, 10.0)


def blocks_of(stack_, *, channels, layers):
    """The memory of a walk, as `layered.enter` lays it over the addresses that it gets."""
    made = layered_walk.blocks(layers, channels)
    floats, words, shares, flags, gone, slots, slot_words, *rest = made
    return layered_walk.Blocks(
        *(floats, floats.view(np.uint32), words, shares, flags, flags.view(np.uint64), gone),
        *(slots, slots.view(np.uint32), slot_words, *rest),
        *(stack_.layers.view(np.uint32), stack_.crossings.view(np.uint32)),
    )


def test_photons_that_meet_interfaces_without_end_are_kept_apart_as_unfinished(monkeypatch):
    """Given up after two rounds instead of 100 000; the rest of the walk is that of the library."""
    monkeypatch.setattr(layered, "_MOST_ROUNDS", 1)
    material = stack(
        layer([0.1, 0.3], 5.0, 0.5, 1.5, 0.02), layer([0.0, 0.0], 0.0, 0.0, 1.0, 1.0), below=1.5
    )
    task = LayeredWalk((material,), (RadialGrid(1.0, 5),), 1, 300)
    (stack_, bins), ledger = task.groups[0], task.empty_tally().ledger
    blocks = blocks_of(stack_, channels=bins.channel.size, layers=len(material.layers))
    given = np.uint64(1), np.int64(0), 300, 0, False
    layered.trace_batch.py_func(*given, stack_, bins, ledger, blocks)
    out = (ledger.reflected + ledger.transmitted)[..., 0].sum(axis=0)
    inside = ledger.absorbed.sum(axis=0) + ledger.unfinished[:, 0]
    assert np.all(ledger.unfinished > 0.0)
    np.testing.assert_allclose(out + inside - ledger.roulette[:, 0], 300.0, atol=1e-9)


# The same bits on every processor


def walks():
    """Digest of walks through layers."""
    top = layer([0.02, 0.3, 1.0], 5.0, 0.6, 1.4, 0.4)
    channels = stack(top, layer([0.5, 0.1, 0.3], 3.0, 0.0, 1.3))
    digest = hashlib.sha256()
    for material in (*STACKS.values(), channels, stack(layer(0.1, 5.0, 0.9999, 1.3, 1.0))):
        task = LayeredWalk((material,), (RadialGrid(0.02, 200),), 1, 1000)
        for each in task.trace(0).ledger:
            digest.update(each.tobytes())
    return digest.hexdigest()


def loops():
    """Digest of loops over lanes, which are what becomes vectors: a walk takes 20 s to compile."""
    digest = hashlib.sha256()
    for g in (0.0, 0.6, 0.9999):
        floats, words = scattering_lanes(g, (0.48, 0.6, 0.64)), streams(6)
        row(floats, layered_lanes.THICKNESS)[:] = 1.0
        flags = np.zeros(floats.size // FLOAT_ROWS, np.uint8)
        for sweep in range(60):
            collide(floats, words, sweep)
            layered_lanes.fly(floats, flags, LANES)
            digest.update(floats.tobytes() + words.tobytes() + flags.tobytes())
    uz = np.random.default_rng(1).uniform(-1.0, 1.0, LANES).astype(np.float32)
    for ratio in (1.5, 1.0, 1.0 / 1.33):
        slots, words = slots_at(uz, ratio), streams(SLOT_WORD_ROWS)
        layered_slots.meet(slots, words, LANES)
        digest.update(slots.tobytes() + words.tobytes())
    return digest.hexdigest()


def elsewhere(digest, **environment):
    """A digest from a process whose compiler knows these instructions only."""
    program = "import sys; sys.path.insert(0, sys.argv[1]); import test_layered_parts as parts; "
    ended = subprocess.run(
        [sys.executable, "-c", f"{program}print(parts.{digest.__name__}())", Path(__file__).parent],
        env=os.environ | environment,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert ended.returncode == 0, ended.stderr
    return ended.stdout.strip()


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="names of x86-64")
@pytest.mark.parametrize(
    "digest", [loops, pytest.param(walks, marks=pytest.mark.slow)], ids=["loops", "walks"]
)
@pytest.mark.parametrize(
    ("name", "features"),
    [
        ("x86-64", ""),  # SSE2: no fused multiply-add, vectors of four
        pytest.param("haswell", "+avx2,-fma", marks=pytest.mark.slow),
        pytest.param("haswell", "+avx2,+fma", marks=pytest.mark.slow),
    ],
    ids=["SSE2", "AVX2 without FMA", "AVX2"],
)
def test_the_same_bits_come_from_any_vectors(name, features, digest):
    assert elsewhere(digest, NUMBA_CPU_NAME=name, NUMBA_CPU_FEATURES=features) == digest()


def test_the_same_bits_come_from_any_number_of_channels_beside_the_least_absorbing_one():
    """The walk's own channel does not depend on the others that share it."""
    top, below = (0.1, 5.0, 0.6, 1.4, 0.4), (0.2, 3.0, 0.0, 1.3)
    alone = stack(layer(*top), layer(*below))
    shared = stack(
        layer([0.1, 0.3], *top[1:]),
        layer([0.2, 0.9], *below[1:]),
    )
    ledgers = [
        LayeredWalk((each,), (RadialGrid(0.02, 200),), 1, 2000).trace(0).ledger
        for each in (alone, shared)
    ]
    np.testing.assert_array_equal(ledgers[0].reflected[:, 0], ledgers[1].reflected[:, 0])
    np.testing.assert_allclose(ledgers[0].absorbed[:, 0], ledgers[1].absorbed[:, 0], rtol=1e-12)


@pytest.mark.parametrize("name", list(STACKS))
def test_what_is_booked_adds_up_to_one(name):
    task = LayeredWalk((STACKS[name],), (RadialGrid(0.02, 100),), 1, 16_384)
    ledger = task.trace(0).ledger
    out = ledger.reflected[..., 0].sum(axis=0) + ledger.transmitted[..., 0].sum(axis=0)
    inside = ledger.absorbed.sum(axis=0) + ledger.unfinished[:, 0]
    balance = (out + inside - ledger.roulette[:, 0]) / 16_384
    np.testing.assert_allclose(balance, 1.0, rtol=0.0, atol=1e-12)
