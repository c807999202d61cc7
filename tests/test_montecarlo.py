"""The photon walk as a whole: truth, energy, errors, reproducibility, limits.

Statistical limits are 4.5 of the run's own standard errors with fixed seeds (checks.LIMIT);
full sizes carry the marker ``slow``.
"""

import itertools
import math
import subprocess
import sys
import warnings
from unittest import mock

import checks
import numpy as np
import pytest
import reference

from sssfit.errors import SimulationError, SssfitWarning
from sssfit.material import load_material, material_names
from sssfit.simulate import montecarlo, simulate_montecarlo, simulate_montecarlo_many
from sssfit.simulate._finished import AUTO_BEYOND
from sssfit.simulate._run import run
from sssfit.simulate._walks import BATCH_PHOTONS
from sssfit.simulate.walk_half_space import SemiInfiniteWalk, roulette_schedule

LIMIT = checks.LIMIT
# What double precision leaves of sums over a few thousand bins and a million collisions.
ROUNDING = 1e-11
ENTERING = 1.0 - (0.3 / 2.3) ** 2

sizes = pytest.mark.parametrize(
    "photons", [1_000_000, pytest.param(100_000_000, marks=pytest.mark.slow)], ids=["1e6", "1e8"]
)


def assert_within(figures):
    for figure in figures:
        assert abs(figure.sigmas) < LIMIT, figure


def assert_energy_conserved(profile):
    error = LIMIT * np.array(profile.meta["energy_balance_stderr"]) + ROUNDING
    assert np.all(np.abs(profile.energy_balance) <= error), profile.energy_balance
    for array in (profile.annulus_energy, profile.absorbed, profile.beyond_grid):
        assert np.all(np.isfinite(array))
        assert np.all(array >= 0.0)


def same_bits(a, b):
    fields = ("r_edges_mm", "annulus_energy", "annulus_energy_stderr", "beyond_grid", "absorbed")
    return all(getattr(a, name).tobytes() == getattr(b, name).tobytes() for name in fields)


# Truth


@sizes
@pytest.mark.parametrize("eta", [1.0, 1.3, 1.5, 2.0])
def test_single_scattering_against_its_closed_form(eta, photons):
    assert_within([checks.single_scattering(photons, eta)])


@pytest.mark.parametrize(
    "photons", [100_000, pytest.param(20_000_000, marks=pytest.mark.slow)], ids=["1e5", "2e7"]
)
@pytest.mark.parametrize("name", ["skin1", "ketchup"])
def test_lanes_equal_the_scalar_loop(name, photons):
    # the scalar loop is the slow side: 36 s of skin1 at full size
    assert_within(checks.against_scalar_loop(name, photons))


@sizes
@pytest.mark.parametrize("name", ["skin1", "chicken1", "ketchup"])
def test_lanes_agree_with_the_original_mcml(name, photons):
    assert_within(checks.against_mcml(name, photons))


def test_scalar_loop_books_single_scattering_like_theory():
    # keeps the two oracles honest about each other
    photons, dr, annuli, eta = 150_000, 0.05, 100, 1.3
    albedo, mfp = np.array([0.8]), np.array([1.0])
    _, _, _, once, squares, *_ = reference.scalar_walk(3, photons, albedo, mfp, eta, dr, annuli)
    r = dr * np.arange(annuli + 1)
    theory = [reference.single_scattering_cumulative(each, 0.8, eta) for each in r]
    theory.append(reference.single_scattering_cumulative(1e9, 0.8, eta))
    groups = checks.groups_of_hits(checks.effective_hits(once[:, 0], squares[:, 0]))
    ours = checks.merge(once[:, 0], groups)
    error = checks.standard_error(ours, checks.merge(squares[:, 0], groups), photons)
    sigmas, _ = checks.chi_square_sigmas(
        ours / photons - checks.merge(np.diff(theory), groups), error**2
    )
    assert abs(sigmas) < LIMIT


# Energy


@pytest.mark.parametrize(
    ("albedo", "eta"),
    list(itertools.product([0.01, 0.3, 0.9, 0.999, 0.99999], [1.0, 1.1, 1.5, 2.0])),
)
def test_energy_is_conserved_over_albedo_and_index(albedo, eta):
    profile = simulate_montecarlo(checks.medium(1.0 - albedo, albedo, eta), photons=5_000)
    assert_energy_conserved(profile)


def test_energy_error_is_honest():
    # 200 runs: the balance scatters by what each run says of itself
    material = checks.medium(0.05, 0.95, 1.3)
    runs = [simulate_montecarlo(material, photons=20_000, seed=k) for k in range(200)]
    z = [each.energy_balance[0] / each.meta["energy_balance_stderr"][0] for each in runs]
    # roulette gains are rare and skewed: the spread of z is within a fifth of 1 at this size
    assert abs(np.mean(z)) * math.sqrt(len(z)) < LIMIT
    assert 0.8 < np.std(z) < 1.2


def test_no_absorption_returns_everything_but_what_is_unfinished():
    with pytest.warns(SssfitWarning, match="still inside after a million collisions"):
        profile = simulate_montecarlo(checks.medium(0.0, 1.0, 1.3), photons=30_000)
    whole = profile.specular_reflectance + profile.diffuse_reflectance + profile.unfinished
    np.testing.assert_allclose(whole, 1.0, atol=ROUNDING)
    # surviving n collisions has probability about 2.6 / sqrt(n) at eta 1.3 (two digits)
    survivors = profile.unfinished[0] / ENTERING
    stderr = math.sqrt(survivors / 30_000)
    assert abs(survivors - 2.6 / math.sqrt(1e6)) < LIMIT * stderr + 0.05e-3


def test_no_scattering_returns_nothing():
    profile = simulate_montecarlo(checks.medium(1.0, 0.0, 1.3), photons=10_000)
    assert profile.diffuse_reflectance[0] == 0.0
    assert profile.absorbed[0, 0] == pytest.approx(ENTERING, abs=ROUNDING)
    assert_energy_conserved(profile)


def test_channels_without_scattering_stand_beside_others():
    material = checks.medium([1.0, 0.1, 0.001], [0.0, 0.9, 0.999], 1.0)
    profile = simulate_montecarlo(material, photons=2_000, dr_mm=0.1, radius_mm=5.0)
    assert profile.diffuse_reflectance[0] == 0.0
    assert_energy_conserved(profile)


def test_beyond_grid_is_apart_and_nothing_is_folded_into_the_last_annulus():
    material = load_material("skin1")
    small = simulate_montecarlo(material, photons=200_000, radius_mm=2.0)
    large = simulate_montecarlo(material, photons=200_000)
    shared = small.n_annuli
    np.testing.assert_array_equal(small.annulus_energy, large.annulus_energy[:shared])
    np.testing.assert_allclose(small.diffuse_reflectance, large.diffuse_reflectance, rtol=1e-12)
    assert small.beyond_grid[0] > 0.05


# Errors


@pytest.mark.parametrize(
    ("photons", "seeds"),
    [(1000, 400), pytest.param(20_000, 400, marks=pytest.mark.slow)],
)
def test_standard_errors_are_honest(photons, seeds):
    # spread over the seeds against the mean of the variances the runs claim, F at several radii
    runs = [
        simulate_montecarlo(load_material("skin1"), photons=photons, seed=k, threads=1)
        for k in range(seeds)
    ]
    at = [3, 30, 100, 300, -1]
    f = np.array([each.cumulative[at] for each in runs])
    claimed = np.mean([each.cumulative_stderr[at] ** 2 for each in runs], axis=0)
    ratio = np.var(f, axis=0, ddof=1) / claimed
    # the variance of n normal draws has a relative standard error of sqrt(2/(n - 1)); at three
    # annuli a thousand photons leave 15 hits, whose kurtosis adds 1/(15 * 400)
    assert np.all(np.abs(ratio - 1.0) < LIMIT * math.sqrt(2.0 / (seeds - 1) + 0.001)), ratio


def test_errors_of_single_annuli_are_honest():
    runs = [
        simulate_montecarlo(load_material("skin1"), photons=1000, seed=k, dr_mm=0.5, threads=1)
        for k in range(400)
    ]
    energy = np.array([each.annulus_energy[:4] for each in runs])
    claimed = np.mean([each.annulus_energy_stderr[:4] ** 2 for each in runs], axis=0)
    ratio = np.var(energy, axis=0, ddof=1) / claimed
    assert np.all(np.abs(ratio - 1.0) < LIMIT * math.sqrt(2.0 / 399.0 + 0.001)), ratio


def test_few_photons_are_warned_about():
    with pytest.warns(SssfitWarning, match="999 photons are too few"):
        simulate_montecarlo(load_material("skin1"), photons=999)


# Reproducibility


def test_same_bits_on_one_and_two_threads():
    one, two, four = (
        simulate_montecarlo(load_material("skin1"), photons=100_003, threads=k) for k in (1, 2, 4)
    )
    assert same_bits(one, two)
    assert same_bits(one, four)


def test_batches_may_be_walked_in_any_order():
    material = load_material("skin1")
    from sssfit.grid import paper_grid

    task = SemiInfiniteWalk((material,), (paper_grid(material),), 1, 5 * BATCH_PHOTONS)
    forwards = [task.trace(k).ledger.bins for k in range(5)]
    backwards = [task.trace(k).ledger.bins for k in reversed(range(5))][::-1]
    for a, b in zip(forwards, backwards, strict=True):
        assert a.tobytes() == b.tobytes()
    assert run(task, 1).ledger.bins.tobytes() == sum(forwards[1:], forwards[0]).tobytes()


def test_seeds_differ_and_repeat():
    a, b, c = (simulate_montecarlo(load_material("skin1"), photons=5000, seed=k) for k in (1, 2, 1))
    assert same_bits(a, c)
    assert not same_bits(a, b)


def test_a_stopped_run_equals_a_shorter_one():
    asked = itertools.count()
    stopped = simulate_montecarlo(
        load_material("skin1"), photons=10**9, threads=2, stop=lambda: next(asked) >= 3
    )
    done = stopped.photons
    assert 0 < done < 10**9
    assert done % BATCH_PHOTONS == 0
    assert same_bits(stopped, simulate_montecarlo(load_material("skin1"), photons=done))


def test_stopped_before_any_photon_is_an_error():
    with pytest.raises(SimulationError, match="stopped before"):
        simulate_montecarlo(load_material("skin1"), stop=lambda: True)


def test_progress_is_reported_to_the_end():
    seen = []
    simulate_montecarlo(load_material("skin1"), photons=300_000, progress=seen.append)
    assert seen[-1].photons_done == seen[-1].photons == 300_000
    profile = simulate_montecarlo(load_material("skin1"), photons=300_000)
    relative = profile.cumulative_stderr.max(axis=0) / profile.cumulative[-1]
    assert seen[-1].relative_error == pytest.approx(relative.max(), rel=1e-9)


# Several materials, grids


def test_one_walk_for_many_materials_agrees_with_single_runs():
    materials = [load_material(each) for each in ("skin1", "ketchup", "apple")]
    together = simulate_montecarlo_many(materials, photons=100_000, seed=5)
    for material, ours in zip(materials, together, strict=True):
        alone = simulate_montecarlo(material, photons=100_000, seed=6)
        error = np.hypot(ours.diffuse_reflectance_stderr, alone.diffuse_reflectance_stderr)
        z = (ours.diffuse_reflectance - alone.diffuse_reflectance) / error
        assert np.all(np.abs(z) < LIMIT)
        assert ours.r_edges_mm.tobytes() == alone.r_edges_mm.tobytes()
        assert_energy_conserved(ours)


def test_sixty_four_channels():
    albedo = np.linspace(0.01, 0.995, 64)
    profile = simulate_montecarlo(checks.medium(1.0 - albedo, albedo, 1.4), photons=20_000)
    assert profile.n_channels == 64
    assert np.all(np.diff(profile.diffuse_reflectance) > 0.0)
    assert_energy_conserved(profile)


def test_materials_of_different_index_are_refused():
    with pytest.raises(SimulationError, match="one refractive index"):
        simulate_montecarlo_many([load_material("skin1"), load_material("marble")])


def test_paper_grid_is_the_default_and_can_be_overridden():
    material = load_material("skin1")
    assert simulate_montecarlo(material, photons=2000).n_annuli == 1236
    profile = simulate_montecarlo(material, photons=2000, dr_mm=0.1, radius_mm=3.0)
    assert profile.n_annuli == 30
    assert profile.r_edges_mm[-1] == pytest.approx(3.0)


@pytest.mark.parametrize("name", ["skin1", "cream"])
def test_auto_radius_is_the_smallest_that_keeps_the_share(name, monkeypatch):
    monkeypatch.setattr(montecarlo, "PILOT_PHOTONS", 20_000)  # those of the run itself
    profile = simulate_montecarlo(load_material(name), photons=20_000, radius_mm="auto")
    total = profile.diffuse_reflectance
    assert np.all(profile.beyond_grid < AUTO_BEYOND * total)
    one_less = profile.beyond_grid + profile.annulus_energy[-1]
    assert np.any(one_less >= AUTO_BEYOND * total)
    assert_energy_conserved(profile)


def test_one_pilot_for_several_doublings_finds_the_grids_of_one_for_each(monkeypatch):
    materials = [load_material(name) for name in ("cream", "wholemilk", "skin1")]
    monkeypatch.setattr(montecarlo, "PILOT_PHOTONS", 5000)
    walked = mock.Mock(side_effect=run)
    monkeypatch.setattr(montecarlo, "run", walked)
    found, walks = [], []
    for doublings in (3, 0):
        monkeypatch.setattr(montecarlo, "PILOT_DOUBLINGS", doublings)
        found.append(montecarlo._auto_grids(materials, None, 1, 1, None))
        walks.append(walked.call_count)
    assert found[0] == found[1]
    assert 2 * walks[0] < walks[1]


def test_auto_radius_does_not_change_the_energies():
    auto = simulate_montecarlo(load_material("skin1"), photons=50_000, radius_mm="auto")
    paper = simulate_montecarlo(load_material("skin1"), photons=50_000)
    n = min(auto.n_annuli, paper.n_annuli)
    np.testing.assert_array_equal(auto.annulus_energy[:n], paper.annulus_energy[:n])
    np.testing.assert_allclose(
        auto.diffuse_reflectance_stderr, paper.diffuse_reflectance_stderr, rtol=1e-9
    )


def test_auto_radius_beyond_the_largest_grid_is_one_line(monkeypatch):
    monkeypatch.setattr(montecarlo, "PILOT_PHOTONS", 5000)
    with pytest.raises(SimulationError, match="annuli"):
        simulate_montecarlo(load_material("cream"), photons=2000, dr_mm=0.0005, radius_mm="auto")


def test_roulette_schedule_follows_the_weight():
    schedule = roulette_schedule(0.9)
    for level, n in enumerate(schedule[:10]):
        assert 0.9 ** int(n) * 10.0**level < 1e-4 <= 0.9 ** (int(n) - 1) * 10.0**level
    assert np.all(roulette_schedule(1.0) == 1_000_000)
    assert roulette_schedule(0.0)[:3].tolist() == [2, 3, 4]


# What is refused


@pytest.mark.parametrize(
    ("settings", "fragment"),
    [
        ({"photons": 1}, "photons = 1"),
        ({"photons": 10**13}, "photons = 10000000000000"),
        ({"seed": -1}, "seed = -1"),
        ({"threads": 0}, "threads = 0"),
        ({"radius_mm": "large"}, "radius_mm = 'large'"),
        ({"dr_mm": 0.0}, "dr"),
        ({"dr_mm": math.nan}, "dr"),
        ({"radius_mm": -1.0}, "radius"),
        ({"dr_mm": 1e-5}, "100 000|100000|100,000"),
    ],
)
def test_settings_out_of_range_are_one_line(settings, fragment):
    with pytest.raises(SimulationError, match=fragment) as caught:
        simulate_montecarlo(load_material("skin1"), **settings)
    assert "\n" not in str(caught.value)


def test_a_g_too_steep_for_single_precision_is_refused():
    with pytest.raises(SimulationError, match=r"g = 0\.99995; the photon walk"):
        simulate_montecarlo(checks.medium(0.1, 1.0, 1.3, g=0.99995))
    with pytest.raises(SimulationError, match=r"g = -0\.995; the photon walk covers -0\.99 to"):
        simulate_montecarlo(checks.medium(0.1, 1.0, 1.3, g=-0.995))


def test_a_layered_material_walks_by_itself():
    with pytest.raises(SimulationError, match="cannot share a walk"):
        simulate_montecarlo_many([load_material("skin1"), checks.medium(0.1, 1.0, 1.3, g=0.5)])


# Memory


# VmHWM, not ru_maxrss: that one counts what the forking parent held.
MEASURE = """
import sys
from sssfit.material import load_material
from sssfit.simulate import simulate_montecarlo
simulate_montecarlo(load_material("ketchup"), photons=int(sys.argv[1]), threads=2)
status = open("/proc/self/status").read()
print(int(status.split("VmHWM:")[1].split()[0]) / 1024)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="peak memory is read from /proc")
def test_memory_is_small_and_does_not_grow_with_the_photons():
    def peak_mib(photons):
        command = [sys.executable, "-c", MEASURE, str(photons)]
        return float(subprocess.run(command, capture_output=True, text=True, check=True).stdout)

    simulate_montecarlo(load_material("ketchup"), photons=1000)  # compiles what is not cached yet
    few, many = peak_mib(50_000), peak_mib(4_000_000)
    assert many < 400.0
    assert many < few + 40.0


def test_shipped_materials_all_walk():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for name in material_names(paper=True):
            assert_energy_conserved(simulate_montecarlo(load_material(name), photons=1000))


def test_centre_pixel_of_skin1():
    # flat annuli give .0062 of red's energy to the centre pixel at the paper's pitch, truth .0112
    profile = checks.lane_profile("skin1", 1_000_000)
    dr = float(profile.r_edges_mm[1])
    centre = profile.quadrant_kernel(dr, 0, channel=0)[0, 0] / profile.total_on_grid[0]
    # a bit over half of the first annulus' energy lies in it, and its error with it
    error = profile.annulus_energy_stderr[0, 0] / profile.total_on_grid[0]
    assert abs(centre - 0.0112) < LIMIT * 0.56 * error + 0.00005


def test_skin1_is_what_was_published():
    # exact solution of skin1's green channel: .2096 without specular
    profile = checks.lane_profile("skin1", 1_000_000)
    error = profile.diffuse_reflectance_stderr[1]
    assert abs(profile.diffuse_reflectance[1] - 0.2096) < LIMIT * error + 0.00005
