"""Runs that end at a target error: where they end, what that rests on, what is said of it."""

import json
import re

import checks
import numpy as np
import pytest

from sssfit.cli import main
from sssfit.cli._progress import walk_progress
from sssfit.errors import SimulationError, SssfitWarning
from sssfit.material import load_material
from sssfit.profile import Profile
from sssfit.simulate import Progress, simulate_montecarlo, simulate_montecarlo_many
from sssfit.simulate import _run as runs
from sssfit.simulate._walks import BATCH_PHOTONS


def skin1(**settings):
    return simulate_montecarlo(load_material("skin1"), **settings)


def same_bits(a, b):
    fields = ("r_edges_mm", "annulus_energy", "annulus_energy_stderr", "beyond_grid", "absorbed")
    return all(getattr(a, name).tobytes() == getattr(b, name).tobytes() for name in fields)


def error_of(profile):
    return float(np.max(profile.cumulative_stderr.max(axis=0) / profile.cumulative[-1]))


def check_before(photons):
    return next(n for n in range(photons - BATCH_PHOTONS, 0, -BATCH_PHOTONS) if runs.is_check(n))


@pytest.mark.parametrize("target", [0.01, 0.003])
def test_a_run_ends_at_the_first_check_under_its_target(target):
    profile = skin1(target_error=target)
    assert runs.is_check(profile.photons)
    assert error_of(profile) < target
    assert profile.meta["relative_error"] == pytest.approx(error_of(profile), rel=1e-9)
    before = skin1(photons=check_before(profile.photons))
    assert error_of(before) >= target
    assert same_bits(profile, skin1(photons=profile.photons))


def test_the_end_does_not_depend_on_threads():
    one, two, four = (skin1(target_error=0.005, threads=k) for k in (1, 2, 4))
    assert one.photons == two.photons == four.photons
    assert same_bits(one, two)
    assert same_bits(one, four)


def test_checks_are_fixed_and_grow_rarer():
    checks_at = [n for n in range(1, 20_000) if runs.is_check(n * BATCH_PHOTONS)]
    assert checks_at[:64] == list(range(1, 65))
    steps = np.diff(checks_at) / np.array(checks_at[1:])
    assert steps[64:].max() <= 1 / 32
    assert steps[64:].min() > 1 / 65
    assert not runs.is_check(BATCH_PHOTONS + 1)


def test_photons_may_come_first_and_that_is_said():
    with pytest.warns(
        SssfitWarning, match=r"50,000 photons were done before .* 0\.5 %.* 0\.8"
    ) as w:
        profile = skin1(photons=50_000, target_error=0.005)
    assert len(w) == 1
    assert profile.photons == 50_000
    assert same_bits(profile, skin1(photons=50_000))
    assert skin1(photons=10**9, target_error=0.02).photons < 10**6


def test_every_channel_counts_but_those_that_do_not_scatter():
    clear = checks.medium([1.0, 0.1], [0.0, 0.9], 1.3)
    profile = simulate_montecarlo(clear, target_error=0.01, dr_mm=0.1, radius_mm=20.0)
    assert profile.cumulative_stderr[:, 1].max() / profile.cumulative[-1, 1] < 0.01
    black = simulate_montecarlo(
        checks.medium([1.0], [0.0], 1.3), target_error=0.01, dr_mm=0.1, radius_mm=20.0
    )
    assert black.photons == BATCH_PHOTONS
    faint = checks.medium([0.1, 2.0], [0.9, 0.1], 1.3)
    both = simulate_montecarlo(faint, target_error=0.01)
    assert np.all(both.cumulative_stderr.max(axis=0) / both.cumulative[-1] < 0.01)


def test_many_materials_wait_for_the_worst():
    materials = [load_material(each) for each in ("skin1", "ketchup")]
    together = simulate_montecarlo_many(materials, target_error=0.01)
    assert {each.photons for each in together} == {together[0].photons}
    assert max(map(error_of, together)) < 0.01
    assert together[0].photons > skin1(target_error=0.01).photons  # ketchup's blue is dark


def test_a_channel_that_returns_nothing_is_named(monkeypatch):
    monkeypatch.setattr(runs, "HOPELESS_PHOTONS", 10**5)
    with pytest.raises(SimulationError, match=r"nothing within the grid in skin1 R, skin1 G"):
        skin1(target_error=0.01, dr_mm=1e-9, radius_mm=1e-8)
    with pytest.warns(SssfitWarning, match="inf % was reached"):
        silent = skin1(photons=50_000, target_error=0.01, dr_mm=1e-9, radius_mm=1e-8)
    assert silent.meta["relative_error"] is None


@pytest.mark.parametrize("target", [0.0, -0.1, 1e-300, 1.0, float("nan")])
def test_a_target_out_of_range_is_one_line(target):
    with pytest.raises(SimulationError, match="give a share from 1e-07, which takes"):
        skin1(target_error=target)


def test_progress_estimates_the_photons_a_target_takes():
    seen = []
    profile = skin1(target_error=0.002, progress=seen.append)
    assert seen[-1].photons_done == seen[-1].photons == profile.photons
    for now in seen:
        assert now.photons_done <= now.photons
        if now.photons_done > 10 * BATCH_PHOTONS:
            assert 0.8 < now.photons / profile.photons < 1.25
    ending = runs.EndCondition(10**6, 0.01)
    assert ending.expected_photons(1000, 0.04) == 16_000
    assert ending.expected_photons(1000, 0.9) == 10**6
    assert ending.expected_photons(1000, float("inf")) == 10**6


def test_time_left_is_that_of_this_sitting():
    first = Progress(1000, 10_000, 100.0, 0.1)
    assert first.time_left(first) == "-:--:--"
    assert Progress(2000, 10_000, 110.0, 0.1).time_left(first) == "0:01:20"
    assert Progress(2000, 2000, 110.0, 0.1).time_left(first) == "0:00:00"


def test_the_bar_says_how_much_is_done_how_fast_and_how_well(capsys, monkeypatch):
    monkeypatch.setattr("sssfit.cli._progress._is_shown", lambda: True)
    monkeypatch.setenv("FORCE_COLOR", "1")  # rich then takes stderr for a terminal
    monkeypatch.setenv("COLUMNS", "100")
    now = Progress(2500, 10_000, 20.0, 0.0123)
    with walk_progress("wax") as show:
        show(Progress(1000, 10_000, 5.0, float("inf")))
        show(now)
    drawn = re.split(r"[\r\n]", re.sub(r"\x1b\[[\d;?]*[A-Za-z]", "", capsys.readouterr().err))
    words = [line for line in drawn if "/s" in line][-1]
    assert words.startswith("wax ")
    share = 100 * now.photons_done / now.photons
    rate = now.photons_done / now.seconds
    error = 100 * now.relative_error
    assert words.split()[-7:] == [
        *(f"{share:.0f}", "%", f"{rate:,.0f}/s", "error", f"{error:.2g}", "%", "0:01:15")
    ]


def test_target_error_on_the_command_line(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        with pytest.raises(SystemExit) as caught:
            main(["simulate", *arguments])
        return caught.value.code, *capfd.readouterr()

    status, out, _ = run("skin1", "--target-error", "1%")
    assert status == 0
    profile = Profile.load(tmp_path / "skin1.profile.npz")
    assert f"target error 1 % of F at the last edge: met with {profile.photons:,} photons" in out
    figures = json.loads(run("skin1", "--target-error", "0.01", "--json", "-q")[1])
    assert figures["target_error"] == 0.01
    assert figures["relative_error"] == profile.meta["relative_error"] < 0.01
    status, out, err = run("skin1", "--target-error", "1%", "--photons", "2e4")
    assert status == 0
    assert "NOT MET with 20,000 photons" in out
    assert "Warning: 20,000 photons were done before" in err
