"""``sssfit simulate`` as a user meets it: files, figures, words, interruptions."""

import io
import json
import os
import signal
import sys
import time

import fork_server
import numpy as np
import processes
import pytest

from sssfit.cli import main
from sssfit.material import load_material
from sssfit.process import asked_to_stop, nothing_to_save
from sssfit.profile import Profile
from sssfit.simulate import run_figures, simulate_montecarlo
from sssfit.simulate._walks import BATCH_PHOTONS
from sssfit.simulate.summary import energy_lines
from sssfit.simulate.walk_half_space import SemiInfiniteWalk

posix = pytest.mark.skipif(os.name != "posix", reason="signals are POSIX")
COMMAND = [sys.executable, "-m", "sssfit.cli", "simulate"]


def names(folder):
    return sorted(path.name for path in folder.iterdir())


@pytest.fixture
def run(tmp_path, monkeypatch, capfd):
    """Run the command line here; give exit status, stdout and stderr."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments):
        with pytest.raises(SystemExit) as caught:
            main(["simulate", *arguments])
        out, err = capfd.readouterr()
        return caught.value.code, out, err

    return call


def start(folder, *arguments):
    return fork_server.start([*COMMAND, *arguments], cwd=folder)


def wait_for(condition, seconds=60.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "gave up waiting"
        time.sleep(0.02)


def test_writes_the_profile_and_says_so(run, tmp_path):
    status, out, err = run("skin1", "--photons", "2e4")
    assert status == 0
    profile = Profile.load(tmp_path / "skin1.profile.npz")
    assert profile.photons == 20_000
    assert "Wrote skin1.profile.npz" in out
    assert "specular + diffuse + absorbed = 1 within the run's own error" in out
    assert "20,000 photons" in out
    assert err.count("\n") <= 2  # piped, the bar leaves one line; one more where it compiled
    assert names(tmp_path) == ["skin1.profile.npz"]


def test_json_has_the_figures_and_nothing_else_on_stdout(run):
    status, out, err = run("skin1", "--photons", "2e4", "--json", "--seed", "3", "-q")
    assert (status, err) == (0, "")
    figures = json.loads(out)
    assert figures["command"] == "simulate"
    assert figures["output"] == ["skin1.profile.npz"]
    for key in (
        "material",
        "method",
        "channels",
        "diffuse_reflectance",
        "diffuse_reflectance_stderr",
        "specular_reflectance",
        "beyond_grid",
        "photons",
        "seed",
        "seconds",
        "photons_per_second",
    ):
        assert key in figures
    assert figures["photons"] == 20_000
    assert figures["seed"] == 3
    profile = simulate_montecarlo(load_material("skin1"), photons=20_000, seed=3)
    assert figures["diffuse_reflectance"] == profile.diffuse_reflectance.tolist()


def test_seconds_are_those_of_the_walk(run, monkeypatch):
    real = SemiInfiniteWalk.trace

    def trace(task, batch):
        time.sleep(0.25)
        return real(task, batch)

    asked = ("skin1", "--photons", str(3 * BATCH_PHOTONS), "--threads", "1", "--json", "-q")
    run(*asked)  # compiles and imports
    monkeypatch.setattr(SemiInfiniteWalk, "trace", trace)
    begun = time.perf_counter()
    figures = json.loads(run(*asked)[1])
    wall = time.perf_counter() - begun
    # three batches of a quarter second at least: a factor of two either way would show
    assert 0.75 <= figures["seconds"] <= wall
    rate = figures["photons_per_second"]
    assert rate * figures["seconds"] == pytest.approx(3 * BATCH_PHOTONS, rel=1e-12)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("sigmas", "said"), [(4.0, "= 1 within"), (10.0, "= 1 NOT WITHIN")])
def test_an_energy_balance_that_is_off_is_said(sigmas, said, sign):
    row, other = (
        run_figures(simulate_montecarlo(load_material(name), photons=20_000), 1.0)
        for name in ("skin1", "apple")
    )
    assert "= 1 within the run's own error" in energy_lines([row])[1]
    error = row["energy_balance_stderr"][0]
    assert error > 1e-9  # more than rounding
    row["energy_balance"] = np.array([sign * sigmas * error, 0.0, 0.0])
    other["energy_balance"] = np.zeros(3)
    alone, together = energy_lines([row])[1], energy_lines([other, row])[0]
    for line in (alone, together):
        assert f"{said} the run's own error: {sign * sigmas * error:+.1e}" in line
        assert "(worst channel, skin1 R)" in line


def test_rounding_is_not_the_worst_channel():
    """Of a channel without roulette the balance is rounding, and so is its standard error."""
    row = run_figures(simulate_montecarlo(load_material("skin1"), photons=20_000), 1.0)
    row["energy_balance"] = np.array([-4e-14, 3e-9, 0.0])
    row["energy_balance_stderr"] = np.array([2e-20, 1e-7, 0.0])
    assert "+3.0e-09, standard error 1e-07 (worst channel, skin1 G)" in energy_lines([row])[1]


def test_quiet_is_quiet(run):
    assert run("skin1", "--photons", "2000", "-q") == (0, "", "")


def test_file_has_the_same_bytes_on_one_and_two_threads(run, tmp_path):
    for threads in "12":
        run("skin1", "--photons", "5e4", "--threads", threads, "-o", f"{threads}.npz")
    assert (tmp_path / "1.npz").read_bytes() == (tmp_path / "2.npz").read_bytes()


def test_profile_to_stdout(tmp_path):
    command = [*COMMAND, "skin1", "--photons", "2000", "-o", "-"]
    ended = fork_server.run(command, cwd=tmp_path, text=False)
    assert ended.returncode == 0
    assert Profile.read(io.BytesIO(ended.stdout), "stdout").photons == 2000
    assert b"Wrote the profile to stdout" in ended.stderr
    assert names(tmp_path) == []


def test_material_from_stdin_and_from_a_path(run, tmp_path, monkeypatch):
    text = load_material("skin1").to_toml()
    (tmp_path / "mine.toml").write_text(text.replace('"skin1"', '"wax"'))
    assert run("mine.toml", "--photons", "2000")[0] == 0
    assert (tmp_path / "wax.profile.npz").exists()
    stdin = io.TextIOWrapper(io.BytesIO(text.encode()))
    monkeypatch.setattr(sys, "stdin", stdin)
    assert run("-", "--photons", "2000")[0] == 0
    assert (tmp_path / "skin1.profile.npz").exists()


def test_all_materials_into_a_folder(run, tmp_path):
    (tmp_path / "out").mkdir()
    status, out, _ = run("--paper", "--photons", "2000", "-o", "out", "--json")
    assert status == 0
    figures = json.loads(out)
    assert len(figures["rows"]) == len(figures["output"]) == 11
    materials = [row["material"] for row in figures["rows"]]
    assert materials == sorted(materials)
    assert len(names(tmp_path / "out")) == 11


def test_grid_options(run, tmp_path):
    run("skin1", "--photons", "2000", "--dr", "0.2", "--radius", "0.5cm")
    profile = Profile.load(tmp_path / "skin1.profile.npz")
    assert profile.n_annuli == 25
    assert profile.r_edges_mm[-1] == pytest.approx(5.0)
    run("skin1", "--photons", "2000", "--radius", "auto")
    profile = Profile.load(tmp_path / "skin1.profile.npz")
    assert np.all(profile.beyond_grid < 1e-3 * profile.diffuse_reflectance)


def test_loss_beyond_the_grid_is_pointed_out(run):
    assert "marble R" in run("marble", "--photons", "2e4")[1].split("beyond the grid, as")[1]


def test_unfinished_walks_are_pointed_out(run, tmp_path):
    text = 'eta = 1.3\ng = 0.0\nchannels = ["c"]\nsigma_a_per_mm = [0.0]\nsigma_s_per_mm = [1.0]\n'
    (tmp_path / "white.toml").write_text(text)
    status, out, err = run("white.toml", "--photons", "2e4")
    assert status == 0
    assert "Warning: white:" in err
    assert "still inside" in err
    assert "specular + diffuse + absorbed + unfinished = 1 within" in out


@pytest.mark.parametrize(
    ("arguments", "status", "fragment"),
    [
        ((), 2, "name one MATERIAL"),
        (("skin1", "--all"), 2, "name one MATERIAL"),
        (("--paper", "--all"), 2, "name one MATERIAL"),
        (("--all", "-o", "-"), 2, "folder"),
        (("skin1", "--photons", "many"), 2, "'many' is not a whole number"),
        (("skin1", "--photons", "1"), 2, "'1' is not a whole number from 2"),
        (("skin1", "--photons", "1e13"), 2, "1e13"),
        (("skin1", "--photons", "nan"), 2, "nan"),
        (("skin1", "--dr", "0"), 2, "'0' is not a length"),
        (("skin1", "--dr", "1 inch"), 2, "is not a length"),
        (("skin1", "--radius", "inf"), 2, "'inf' is not a length"),
        (("skin1", "--dr", "1e-6"), 1, "annuli"),
        (("skni1",), 1, "did you mean skin1"),
        (("skin1", "-o", "no/where.npz"), 1, "there is no folder"),
        (("skin1", "-o", "."), 1, "is a folder"),
        (("skin1", "--threads", "0"), 2, "--threads"),
    ],
)
def test_bad_input_is_one_clear_line(run, tmp_path, arguments, status, fragment):
    code, out, err = run(*arguments)
    assert code == status
    assert out == ""
    assert fragment in err.splitlines()[-1]
    assert "Traceback" not in err
    if status == 1:  # but for a first run's word that it compiles
        assert len([line for line in err.splitlines() if "Compiling" not in line]) == 1
    assert names(tmp_path) == []


def test_a_foreign_file_is_not_replaced_without_force(run, tmp_path):
    (tmp_path / "skin1.profile.npz").write_text("mine")
    status, _, err = run("skin1", "--photons", "2000")
    assert status == 1
    assert "--force" in err
    assert (tmp_path / "skin1.profile.npz").read_text() == "mine"
    assert run("skin1", "--photons", "2000", "--force")[0] == 0
    assert run("skin1", "--photons", "3000")[0] == 0  # our own format may be replaced
    assert Profile.load(tmp_path / "skin1.profile.npz").photons == 3000


@posix
@pytest.mark.parametrize("number", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_interrupted_runs_save_what_is_done(tmp_path, number):
    simulate_montecarlo(load_material("skin1"), photons=1000)  # compiled before, if not yet
    process = start(tmp_path, "skin1", "--photons", "1e11", "--json", "--checkpoint-every", "0")
    saved = tmp_path / "skin1.profile.npz.checkpoint"  # as soon as there is a batch
    wait_for(lambda: saved.exists() or process.poll() is not None)
    process.send_signal(getattr(signal, number))
    out, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Interrupted: the photons traced so far are saved" in err
    figures = json.loads(out)
    assert figures["interrupted"] is True
    profile = Profile.load(tmp_path / "skin1.profile.npz")
    assert profile.photons == figures["photons"]
    assert profile.photons % BATCH_PHOTONS == 0
    again = simulate_montecarlo(load_material("skin1"), photons=profile.photons)
    assert again.annulus_energy.tobytes() == profile.annulus_energy.tobytes()
    assert names(tmp_path) == ["skin1.profile.npz", "skin1.profile.npz.checkpoint"]


@posix
@pytest.mark.parametrize("first", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("second", [signal.SIGINT, signal.SIGTERM])
def test_a_second_signal_meets_the_former_handler(first, second):
    seen = []

    def former(number, _frame):
        seen.append(number)

    before = {number: signal.signal(number, former) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        with asked_to_stop() as stop:
            assert not stop()
            os.kill(os.getpid(), first)
            assert stop()
            assert seen == []
            os.kill(os.getpid(), second)
            assert seen == [second]
        with asked_to_stop() as stop:
            assert not stop()
        assert {signal.getsignal(number) for number in before} == {former}
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@posix
def test_a_signal_ends_at_once_what_leaves_nothing_behind():
    with asked_to_stop() as stop:
        with pytest.raises(KeyboardInterrupt), nothing_to_save():
            os.kill(os.getpid(), signal.SIGINT)
        assert stop()
        with pytest.raises(KeyboardInterrupt), nothing_to_save():
            pytest.fail("it had been asked to stop before")
    with asked_to_stop() as stop:
        with nothing_to_save():
            assert not stop()
        os.kill(os.getpid(), signal.SIGINT)  # after it only what comes next is told
        assert stop()


@posix
def test_ctrl_c_ends_the_compiling_of_a_walk(tmp_path):
    """It went on to the end of the compiling, ten seconds for layers."""
    cache = tmp_path / "cache"
    process = processes.start(
        [*COMMAND, "skin1", "--photons", "1e11"],
        cwd=tmp_path,
        env=os.environ | {"NUMBA_CACHE_DIR": str(cache)},
    )
    assert process.stderr.readline().startswith("Compiling the photon walk")
    time.sleep(0.5)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert (process.returncode, err.strip()) == (130, "Interrupted.")
    assert names(tmp_path) == ["cache"]
    assert not list(cache.rglob("*.o"))


@posix
def test_two_at_once_and_killed(tmp_path):
    first = start(tmp_path, "skin1", "--photons", "1e11")
    wait_for(lambda: (tmp_path / ".skin1.profile.npz.lock").exists())
    second = fork_server.run([*COMMAND, "skin1", "--photons", "1e4"], cwd=tmp_path)
    assert second.returncode == 1
    assert "being written by another run" in second.stderr
    first.kill()
    first.communicate()
    assert not (tmp_path / "skin1.profile.npz").exists()
    third = fork_server.run([*COMMAND, "skin1", "--photons", "1e4", "-q"], cwd=tmp_path)
    assert third.returncode == 0
    assert names(tmp_path) == ["skin1.profile.npz"]
