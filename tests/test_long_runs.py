"""Long runs: saved now and then, killed at any moment, resumed to the same bits."""

import contextlib
import dataclasses
import errno
import itertools
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
import warnings

import fork_server
import numpy as np
import processes
import pytest
from checks_layers import layer, stack

from sssfit import files
from sssfit.cli import main
from sssfit.errors import FileError, SimulationError, SssfitWarning
from sssfit.material import load_material
from sssfit.profile import Profile
from sssfit.simulate import (
    Checkpoint,
    is_complete,
    read_checkpoint,
    simulate_montecarlo,
    simulate_montecarlo_many,
)
from sssfit.simulate._walks import BATCH_PHOTONS

posix = pytest.mark.skipif(os.name != "posix", reason="signals are POSIX")
COMMAND = [sys.executable, "-m", "sssfit.cli", "simulate"]
PROFILE, CHECKPOINT = "skin1.profile.npz", "skin1.profile.npz.checkpoint"


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def skin1(**settings):
    return simulate_montecarlo(load_material("skin1"), **settings)


def same_bits(a, b):
    fields = ("r_edges_mm", "annulus_energy", "annulus_energy_stderr", "beyond_grid", "absorbed")
    return all(getattr(a, name).tobytes() == getattr(b, name).tobytes() for name in fields)


def stopping_after(batches):
    """A stop function that lets some batches pass, and no more."""
    asked = itertools.count()
    return lambda: next(asked) >= batches


def leave_checkpoint(path, batches=4, photons=10**9, **settings):
    """What a run killed or interrupted after a few batches leaves; its photons."""
    stopped = skin1(
        photons=photons,
        threads=1,
        stop=stopping_after(batches),
        checkpoint=Checkpoint(path, resume=False),
        **settings,
    )
    return stopped.photons


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


def full_disk(*_arguments, **_keywords):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


# Resuming, in one process


def test_a_resumed_run_ends_in_the_same_bits(tmp_path):
    path = tmp_path / "c"
    whole = skin1(photons=300_001)
    done = leave_checkpoint(path)
    first = leave_checkpoint(tmp_path / "d", batches=2)
    assert 0 < first < done < 300_001
    assert same_bits(skin1(photons=300_001, checkpoint=path), whole)
    again = Checkpoint(path)
    assert same_bits(skin1(photons=300_001, threads=2, checkpoint=again), whole)
    assert path.exists()  # until the caller has the profile safe
    again.remove()
    assert not path.exists()


def test_a_resumed_run_meets_its_target_where_it_would_have(tmp_path):
    whole = skin1(target_error=0.004)
    done = leave_checkpoint(tmp_path / "c", photons=None, target_error=0.004)
    assert done < whole.photons
    resumed = skin1(target_error=0.004, checkpoint=tmp_path / "c")
    assert resumed.photons == whole.photons
    assert same_bits(resumed, whole)


def test_a_run_may_be_resumed_with_other_ends(tmp_path):
    path = tmp_path / "c"
    done = leave_checkpoint(path, photons=10**6)
    assert same_bits(skin1(photons=200_000, checkpoint=path), skin1(photons=200_000))
    assert same_bits(skin1(photons=done, checkpoint=path), skin1(photons=done))
    assert same_bits(skin1(target_error=0.004, checkpoint=path), skin1(target_error=0.004))
    with pytest.raises(SimulationError, match=rf"more than the 20,000 asked .*`photons = {done}`"):
        skin1(photons=20_000, checkpoint=path)
    with pytest.raises(SimulationError, match="more than a target error of 2 % takes"):
        skin1(target_error=0.02, checkpoint=path)


def test_an_automatic_radius_is_resumed(tmp_path):
    done = leave_checkpoint(tmp_path / "c", batches=16, radius_mm="auto")
    assert done >= BATCH_PHOTONS
    resumed = skin1(photons=400_000, radius_mm="auto", checkpoint=tmp_path / "c")
    assert same_bits(resumed, skin1(photons=400_000, radius_mm="auto"))


def test_several_materials_are_resumed_together(tmp_path):
    materials = [load_material(each) for each in ("skin1", "ketchup")]
    checkpoint = Checkpoint(tmp_path / "c")
    settings = {"photons": 200_000, "checkpoint": checkpoint}
    simulate_montecarlo_many(materials, stop=stopping_after(2), threads=1, **settings)
    resumed = simulate_montecarlo_many(materials, **settings)
    for a, b in zip(resumed, simulate_montecarlo_many(materials, photons=200_000), strict=True):
        assert same_bits(a, b)
    with pytest.raises(SimulationError, match=r"material = skin1 .*ketchup .*\(now skin1 "):
        skin1(photons=200_000, checkpoint=checkpoint)


@pytest.mark.parametrize(
    ("change", "fragment"),
    [
        ({"seed": 2}, r"settings: seed = 1 \(now 2\)\."),
        ({"radius_mm": 5.0}, r"annuli = 1236 \(now 149\)"),
        ({"seed": 2, "dr_mm": 0.1}, r"seed = 1 \(now 2\); dr_mm = 0\.03.* \(now 0\.1\); annuli"),
    ],
)
def test_other_settings_are_named(tmp_path, change, fragment):
    leave_checkpoint(tmp_path / "c")
    before = (tmp_path / "c").read_bytes()
    with pytest.raises(SimulationError, match=fragment) as caught:
        skin1(photons=10**6, checkpoint=tmp_path / "c", **change)
    assert "\n" not in str(caught.value)
    assert (tmp_path / "c").read_bytes() == before


def test_other_compiled_code_is_named(tmp_path, monkeypatch):
    leave_checkpoint(tmp_path / "c")
    monkeypatch.setattr("sssfit.simulate._checkpoint.source_key", lambda: "0.0-abc")
    with pytest.raises(SimulationError, match=r"version = .* \(now 0\.0-abc\)"):
        skin1(photons=10**6, checkpoint=tmp_path / "c")


def test_a_damaged_checkpoint_is_one_line(tmp_path):
    path = tmp_path / "c"
    leave_checkpoint(path)
    whole = path.read_bytes()
    undamaged = skin1(photons=200_000)
    lengths = {0, 1, 4, 100, len(whole) - 1, *range(0, len(whole), len(whole) // 40)}
    for length in lengths:
        path.write_bytes(whole[:length])
        # The first member, meta.npy, has the format in its text; before it ends nothing says so.
        is_marked = "sssfit.checkpoint/".encode("utf-32-le") in whole[:length]
        said = "is a damaged" if is_marked else "is not a"
        with pytest.raises(FileError, match=f"{said} checkpoint; delete it, or") as e:
            skin1(photons=200_000, checkpoint=path)
        assert "\n" not in str(e.value)
        assert path.read_bytes() == whole[:length]
    chance = random.Random(1)
    for _ in range(60):
        flipped = bytearray(whole)
        flipped[chance.randrange(len(whole))] ^= 1 << chance.randrange(8)
        path.write_bytes(flipped)
        # a bit that says nothing, such as a date, may flip; one that does must be noticed
        with contextlib.suppress(FileError, SimulationError):
            assert same_bits(skin1(photons=200_000, checkpoint=path), undamaged)


def test_foreign_files_are_one_line(tmp_path):
    path = tmp_path / "c"

    def savez(**arrays):
        with path.open("wb") as stream:
            np.savez(stream, **arrays)

    for write in (
        lambda: path.write_text("mine"),
        lambda: skin1(photons=2000).save(path),
        lambda: savez(meta=np.array('{"format": "sssfit.checkpoint/1"}')),
        lambda: savez(unrelated=np.zeros(3)),
    ):
        write()
        with pytest.raises(FileError, match=r"c (is (a damaged|not a) checkpoint|has format)"):
            skin1(photons=200_000, checkpoint=path)
    savez(meta=np.array('{"format": "sssfit.checkpoint/2"}'))
    with pytest.raises(FileError, match=r"has format 'sssfit\.checkpoint/2', not"):
        skin1(photons=200_000, checkpoint=path)
    path.unlink()
    path.mkdir()
    with pytest.raises(FileError, match="cannot be read: is a directory"):
        skin1(photons=200_000, checkpoint=path)


@pytest.fixture(scope="module")
def left(tmp_path_factory):
    """The bytes of a checkpoint of skin1."""
    path = tmp_path_factory.mktemp("left") / "c"
    leave_checkpoint(path)
    return path.read_bytes()


def edited(path, change):
    """A checkpoint rewritten by hand: ``change`` takes its meta and its arrays by name."""
    with np.load(path) as members:
        arrays = dict(members)
    meta = json.loads(str(arrays.pop("meta")))
    change(meta, arrays)
    with path.open("wb") as stream:
        np.savez(stream, meta=np.array(json.dumps(meta)), **arrays)


def put(name, value):
    """Replace a field of the meta, or one sum of a ledger."""

    def change(meta, arrays):
        if name in arrays:
            arrays[name].flat[1] = value
        else:
            meta[name] = value

    return change


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (put("settings", {"seed": "1\n2"}), r"seed = 1\n2 (now 1); material = None"),
        (put("settings", {"seed": 1}), "c is a damaged checkpoint; delete it"),
        (put("photons", -16384), "photons = -16384, expected whole batches of 16384"),
        (put("photons", 16384.0), "photons = 16384.0, expected whole batches"),
        (put("photons", True), "photons = True, expected whole batches"),
        (put("photons", "16384"), "photons = '16384', expected whole batches"),
        (put("photons", 16384 * 10**400), "photons = 1638400"),
        (put("flights", -1), "flights = -1, expected a whole number from 0 up"),
        (put("flights", None), "flights = None"),
        (put("least_error", "low"), "least_error = 'low'"),
        (put("least_error", float("nan")), "least_error = nan"),
        (put("least_error", -1.0), "least_error = -1.0"),
        (put("seconds", float("inf")), "seconds = inf"),
        (put("seconds", -5.0), "seconds = -5.0"),
        (put("ledger_bins", -1.0), r"ledger_bins holds -1.0 at [0, 1], expected 0 to "),
        (put("ledger_bins", 1e300), r"ledger_bins holds 1e+300 at [0, 1]"),
        (put("ledger_absorbed", np.inf), "ledger_absorbed holds inf at [1]"),
        (put("ledger_unfinished", np.nan), "ledger_unfinished holds nan"),
        (put("ledger_roulette", -1e300), "ledger_roulette holds -1e+300"),
        (lambda _, arrays: arrays.update(ledger_absorbed=np.zeros(2)), "absorbed has shape (2,)"),
        (
            lambda _, arrays: arrays.update(ledger_absorbed=np.zeros(3, int)),
            "c is a damaged checkpoint; delete it",
        ),
        (
            lambda _, arrays: arrays.update(ledger_absorbed=np.zeros(10**7)),
            "c is a damaged checkpoint; delete it",
        ),
        (lambda _, arrays: arrays.pop("ledger_bins"), "c is a damaged checkpoint; delete it"),
        (lambda _, arrays: arrays.update(more=np.zeros(2)), "c is a damaged checkpoint; delete it"),
    ],
)
def test_an_edited_checkpoint_is_one_line_that_names_the_fault(tmp_path, left, change, said):
    path = tmp_path / "c"
    path.write_bytes(left)
    edited(path, change)
    with pytest.raises((FileError, SimulationError)) as caught:
        skin1(photons=200_000, checkpoint=path)
    assert str(caught.value).startswith(f"{path} ")
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def without_the_label(meta, _):
    """A checkpoint of the time when it held no materials."""
    del meta["materials"]


def with_another_grid(meta, _):
    meta["settings"]["annuli"] = "5000"


def with_another_albedo(meta, _):
    meta["materials"][0]["layers"][0]["sigma_s_per_mm"][0] = 0.75


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (without_the_label, "was saved by a version that did not keep the materials in it"),
        (put("materials", []), "is damaged or was edited: its materials and grids"),
        (put("materials", [{"name": "a\nb"}]), "is damaged or was edited: its materials"),
        (put("materials", 7), "is damaged or was edited: its materials"),
        (with_another_albedo, "is damaged or was edited: material = 'skin1 (sha256"),
        (with_another_grid, "ledger_bins has shape (3711, 2), expected (15003, 2)"),
        (lambda meta, _: meta["settings"].update(seed="-1"), "seed = -1, expected 0 to 2^64 - 1"),
        (put("photons", 5), "photons = 5, expected whole batches of 16384"),
        (put("format", "sssfit.checkpoint/2"), "has format 'sssfit.checkpoint/2'"),
    ],
)
def test_what_no_walk_left_makes_no_profile(tmp_path, left, change, said):
    path = tmp_path / "c"
    path.write_bytes(left)
    edited(path, change)
    with path.open("rb") as stream:
        for source, origin in ((path, str(path)), (stream, "stdin")):
            with pytest.raises(FileError) as caught:
                read_checkpoint(source, origin)
            assert str(caught.value).startswith(f"{origin} ")
            assert said in str(caught.value)
            assert "\n" not in str(caught.value)


def test_a_checkpoint_makes_the_profile_of_a_run_that_ended_there(tmp_path):
    path = tmp_path / "c"
    done = leave_checkpoint(path)
    ended = skin1(photons=done)
    found = read_checkpoint(path)
    (profile,) = found.profiles
    assert same_bits(profile, ended)
    assert profile.photons == done
    assert profile.meta["checkpoint"] == "sssfit.checkpoint/1"
    assert profile.meta["version"] == ended.meta["version"]
    assert found.relative_error == ended.meta["relative_error"]
    assert found.flights > done
    assert found.seconds > 0.0


def test_a_checkpoint_has_all_materials_of_its_walk(tmp_path):
    path = tmp_path / "c"
    materials = [load_material("skin1"), load_material("ketchup")]
    stopped = simulate_montecarlo_many(
        materials, photons=10**9, threads=1, stop=stopping_after(2), checkpoint=Checkpoint(path)
    )
    found = read_checkpoint(path).profiles
    assert [each.material_name for each in found] == ["skin1", "ketchup"]
    assert all(map(same_bits, found, stopped))


def test_a_checkpoint_of_another_version_says_so(tmp_path, monkeypatch):
    path = tmp_path / "c"
    monkeypatch.setattr("sssfit.simulate._checkpoint.source_key", lambda: "0.0-abc")
    leave_checkpoint(path)
    assert read_checkpoint(path).profiles[0].meta["version"] is None


def test_a_checkpoint_of_an_older_layered_walk_is_refused_by_name(tmp_path, monkeypatch):
    path, slab = tmp_path / "c", stack(layer(0.1, 5.0, 0.8, 1.4, 1.0))
    with monkeypatch.context() as older:
        older.setattr("sssfit.simulate._checkpoint.source_key", lambda: "0.1.0-the-old-walk")
        simulate_montecarlo(slab, photons=20_000, checkpoint=Checkpoint(path, 0.0))
    before = path.read_bytes()
    with pytest.raises(SimulationError, match=r"settings: version = 0\.1\.0-the-old-walk \(now"):
        simulate_montecarlo(slab, photons=40_000, checkpoint=Checkpoint(path))
    assert path.read_bytes() == before


def test_a_checkpoint_that_does_not_say_its_version_is_of_another(tmp_path, left):
    path = tmp_path / "c"
    path.write_bytes(left)
    edited(path, lambda meta, _: meta["settings"].pop("version"))
    assert read_checkpoint(path).profiles[0].meta["version"] is None


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04", b"\x89PNG\r\n", b"[1]"])
def test_foreign_files_are_not_checkpoints(tmp_path, content):
    path = tmp_path / "c"
    path.write_bytes(content)
    with pytest.raises(FileError, match="c is not a checkpoint"):
        read_checkpoint(path)


def test_a_full_disk_costs_the_checkpoint_and_not_the_run(tmp_path, monkeypatch):
    path = tmp_path / "c"
    leave_checkpoint(path)
    before = path.read_bytes()
    whole = skin1(photons=300_000)
    monkeypatch.setattr(files.os, "fsync", full_disk)
    with pytest.warns(SssfitWarning, match="no space left on device: the run goes on") as warned:
        profile = skin1(photons=300_000, checkpoint=Checkpoint(path, 0.0))
    assert len(warned) == 1
    assert same_bits(profile, whole)
    assert path.read_bytes() == before
    assert names(tmp_path) == ["c"]


def test_a_new_start_is_said_and_the_old_work_kept_until_there_is_new(tmp_path):
    path = tmp_path / "c"
    leave_checkpoint(path, batches=8)
    before = path.read_bytes()
    short, long = Checkpoint(path, resume=False), Checkpoint(path, 0.0, resume=False)
    with pytest.warns(
        SssfitWarning, match=r"starting a new run beside .*c, which an earlier run left"
    ):
        skin1(photons=50_000, checkpoint=short)
    assert not short.is_ours()
    short.remove()
    with pytest.warns(SssfitWarning, match="starting a new run"):
        skin1(photons=10**6, checkpoint=short, threads=1, stop=stopping_after(2))
    assert path.read_bytes() == before
    with pytest.warns(SssfitWarning, match="starting a new run"):
        skin1(photons=50_000, checkpoint=long)
    assert path.read_bytes() != before
    long.remove()
    assert not path.exists()


@pytest.mark.parametrize("seconds", [-1.0, float("inf"), float("nan")])
def test_times_between_checkpoints_out_of_range(tmp_path, seconds):
    with pytest.raises(SimulationError, match="give a time from 0 s up"):
        Checkpoint(tmp_path / "c", seconds)


def test_what_a_killed_write_left_is_cleared_away(tmp_path):
    for name in (".c.abcd_123.tmp", ".c.d.abcd_123.tmp", ".c.abc.tmp"):
        (tmp_path / name).touch()
    skin1(photons=20_000, checkpoint=tmp_path / "c")
    with files.locked(tmp_path / "c.d"):
        pass
    assert names(tmp_path) == [".c.abc.tmp"]


# Resuming, on the command line


def test_without_a_checkpoint_resume_starts(run, tmp_path):
    status, out, err = run("skin1", "--photons", "2e4", "--resume")
    assert status == 0
    assert err.startswith(f"No {CHECKPOINT} to continue from: starting a new run.\n")
    assert "Wrote skin1.profile.npz" in out
    assert names(tmp_path) == [PROFILE]


def test_a_finished_run_is_left_alone(run, tmp_path):
    run("skin1", "--photons", "2e4")
    before = (tmp_path / PROFILE).stat()
    status, out, err = run("skin1", "--photons", "2e4", "--resume")
    assert (status, err) == (0, "")
    assert "Finished before, nothing to do: skin1.profile.npz" in out
    figures = json.loads(run("skin1", "--photons", "2e4", "--resume", "--json")[1])
    assert figures["finished_before"] is True
    assert figures["photons"] == 20_000
    assert figures["seconds"] is None
    assert run("skin1", "--photons", "2e4", "--resume", "-q") == (0, "", "")
    assert (tmp_path / PROFILE).stat().st_mtime_ns == before.st_mtime_ns
    assert names(tmp_path) == [PROFILE]


@pytest.mark.parametrize(
    "change",
    [
        ("--photons", "3e4"),
        ("--photons", "2e4", "--seed", "2"),
        ("--photons", "2e4", "--dr", "0.05"),
        ("--photons", "2e4", "--radius", "5"),
        ("--photons", "2e4", "--radius", "auto"),
        ("--photons", "2e4", "--target-error", "5%"),
    ],
)
def test_a_profile_of_other_settings_is_not_finished(run, tmp_path, change):
    run("skin1", "--photons", "2e4")
    status, _, err = run("skin1", *change, "--resume")
    assert status == 0
    assert "to continue from" in err
    assert run("skin1", *change, "--resume")[2] == ""  # now it is


def test_a_damaged_or_edited_profile_is_not_finished(run, tmp_path):
    run("skin1", "--photons", "2e4")
    whole = (tmp_path / PROFILE).read_bytes()
    (tmp_path / PROFILE).write_bytes(whole.replace(b'"seed": 1', b'"seed": x'))
    assert run("skin1", "--photons", "2e4", "--resume", "--force")[0] == 0
    assert (tmp_path / PROFILE).read_bytes() == whole


@pytest.mark.parametrize("name", ["relative_error", "energy_balance_stderr", "material"])
def test_a_profile_without_a_figure_of_its_walk_is_not_finished(run, tmp_path, name):
    run("skin1", "--photons", "2e3")
    profile = Profile.load(PROFILE)
    meta = {key: value for key, value in profile.meta.items() if key != name}
    dataclasses.replace(profile, meta=meta).save(PROFILE)
    status, _, err = run("skin1", "--photons", "2e3", "--resume")
    assert status == 0
    assert "to continue from" in err
    assert dict(Profile.load(PROFILE).meta) == dict(profile.meta)


def test_a_checkpoint_is_gone_on_from_and_removed(run, tmp_path):
    run("skin1", "--photons", "3e5")
    whole = (tmp_path / PROFILE).read_bytes()
    (tmp_path / PROFILE).unlink()
    done = leave_checkpoint(tmp_path / CHECKPOINT)
    status, out, err = run("skin1", "--photons", "3e5", "--resume", "--json")
    assert status == 0
    assert err.startswith(f"Continuing from {CHECKPOINT}: {done:,} photons done.\n")
    assert json.loads(out)["photons"] == 300_000
    assert (tmp_path / PROFILE).read_bytes() == whole
    assert names(tmp_path) == [PROFILE]


@pytest.mark.parametrize(
    ("arguments", "status", "fragment"),
    [
        (("--seed", "2"), 1, "was made with other settings: seed = 1 (now 2)."),
        (("--photons", "2e4"), 1, "more than the 20,000 asked for"),
        (("-o", "-"), 2, "--resume needs a file"),
        (("--checkpoint-every", "-1"), 2, "--checkpoint-every"),
        (("--checkpoint-every", "nan"), 2, "'nan' is not a finite number."),
        (("--target-error", "0"), 2, "'0' is not a share between 0 and 100 %"),
        (("--target-error", "100%"), 2, "'100%' is not a share"),
        (("--target-error", "few"), 2, "'few' is not a share"),
    ],
)
def test_what_cannot_be_resumed_is_one_line(run, tmp_path, arguments, status, fragment):
    leave_checkpoint(tmp_path / CHECKPOINT)
    before = (tmp_path / CHECKPOINT).read_bytes()
    code, out, err = run("skin1", "--resume", *arguments)
    assert (code, out) == (status, "")
    assert fragment in err.splitlines()[-1]
    assert status == 2 or err.count("\n") == 1
    assert (tmp_path / CHECKPOINT).read_bytes() == before


def test_a_checkpoint_cut_in_half_is_one_line(run, tmp_path):
    leave_checkpoint(tmp_path / CHECKPOINT)
    whole = (tmp_path / CHECKPOINT).read_bytes()
    (tmp_path / CHECKPOINT).write_bytes(whole[: len(whole) // 2])
    status, out, err = run("skin1", "--resume")
    assert (status, out) == (1, "")
    assert err == (
        f"Error: {CHECKPOINT} is a damaged checkpoint; delete it, or start a new run without "
        "--resume.\n"
    )


def test_a_short_run_does_not_touch_the_checkpoint_of_a_long_one(run, tmp_path):
    leave_checkpoint(tmp_path / CHECKPOINT)
    before = (tmp_path / CHECKPOINT).read_bytes()
    status, _, err = run("skin1", "--photons", "2e4")
    assert status == 0
    assert err.count(f"Warning: starting a new run beside {CHECKPOINT}") == 1
    assert (tmp_path / CHECKPOINT).read_bytes() == before
    assert run("skin1", "--photons", "2e4", "-o", "-")[0] == 0


def test_a_full_disk_at_the_end_is_one_line_and_resumed(run, tmp_path, monkeypatch):
    run("skin1", "--photons", "3e5")
    whole = (tmp_path / PROFILE).read_bytes()
    (tmp_path / PROFILE).unlink()
    leave_checkpoint(tmp_path / CHECKPOINT)
    with monkeypatch.context() as patch:
        patch.setattr(files.os, "fsync", full_disk)
        status, out, err = run("skin1", "--photons", "3e5", "--resume", "-q")
    assert (status, out) == (1, "")
    assert err == (
        f"Error: {PROFILE} cannot be written: no space left on device; "
        f"{CHECKPOINT} is kept: --resume continues from it.\n"
    )
    assert names(tmp_path) == [CHECKPOINT]
    assert run("skin1", "--photons", "3e5", "--resume", "-q") == (0, "", "")
    assert (tmp_path / PROFILE).read_bytes() == whole


# Other processes


def start(folder, *arguments, **environment):
    begin = processes.start if environment else fork_server.start  # a cache of its own: compiling
    return begin([*COMMAND, *arguments], cwd=folder, env=os.environ | environment)


def wait_for(condition, seconds=60.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "gave up waiting"
        time.sleep(0.005)


@posix
def test_interrupted_and_resumed(tmp_path):
    long = ("skin1", "--target-error", "0.1%", "--checkpoint-every", "0.05")
    process = start(tmp_path, *long)
    wait_for((tmp_path / CHECKPOINT).exists)
    process.send_signal(signal.SIGTERM)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "with their true count; --resume continues from there." in err
    assert names(tmp_path) == [PROFILE, CHECKPOINT]
    stopped = Profile.load(tmp_path / PROFILE)
    assert not is_complete(stopped)
    assert same_bits(stopped, skin1(photons=stopped.photons))
    process = start(tmp_path, *long, "--resume")
    _, err = process.communicate(timeout=120)
    assert process.returncode == 0
    assert f"Continuing from {CHECKPOINT}: {stopped.photons:,} photons done." in err
    resumed = Profile.load(tmp_path / PROFILE)
    assert same_bits(resumed, skin1(target_error=0.001))
    assert names(tmp_path) == [PROFILE]


@posix
def test_the_lock_covers_the_checkpoint(tmp_path):
    first = start(tmp_path, "skin1", "--photons", "1e11", "--checkpoint-every", "0.05")
    try:
        wait_for((tmp_path / CHECKPOINT).exists)
        for arguments in (("--resume",), ("--photons", "1e4")):
            process = start(tmp_path, "skin1", *arguments)
            _, err = process.communicate(timeout=60)
            assert process.returncode == 1
            assert err.count("\n") == 1
            assert "being written by another run" in err
        assert first.poll() is None
    finally:
        first.kill()
        first.communicate()
    assert (tmp_path / CHECKPOINT).exists()


class Killer:
    """Runs that are killed, each once, at a random moment of its life, until one ends."""

    def __init__(self, arguments, seconds, chance, cache=None):
        self.arguments, self.seconds, self.chance, self.cache = arguments, seconds, chance, cache
        self.hits = dict.fromkeys(("by the clock", "in a checkpoint", "in a profile"), 0)
        self.half_written = 0

    def start(self, folder):
        environment = {"NUMBA_CACHE_DIR": str(self.cache)} if self.cache else {}
        return start(folder, *self.arguments, "--resume", **environment)

    def kill_one(self, folder, moment):
        """Kill a run at such a moment; False where it ended before."""
        process = self.start(folder)
        if moment == "by the clock":
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(self.chance.uniform(0.0, self.seconds))
        else:
            start_of_name = ".skin1.profile.npz." + "checkpoint." * (moment == "in a checkpoint")
            self.wait_for_write(folder, start_of_name, process)
        process.kill()
        _, err = process.communicate(timeout=60)
        assert process.returncode in (0, -signal.SIGKILL), err
        assert "Error" not in err
        killed = process.returncode != 0
        self.hits[moment] += killed
        self.half_written += any(each.endswith(".tmp") for each in names(folder))
        return killed

    def wait_for_write(self, folder, start_of_name, process):
        """Look for the temporary file of a write without pause: it lives for a millisecond."""
        length = len(start_of_name) + len("abcdefgh.tmp")
        passes = self.chance.randrange(4)
        while process.poll() is None:
            found = [
                each
                for each in os.listdir(folder)  # noqa: PTH208 (the quicker one)
                if each.startswith(start_of_name) and len(each) == length and each[-4:] == ".tmp"
            ]
            if found and passes <= 0:
                return
            passes -= bool(found)

    def finish(self, folder):
        process = self.start(folder)
        _, err = process.communicate(timeout=300)
        assert process.returncode == 0, err


KILLED = ("skin1", "--photons", "4e6", "--checkpoint-every", "0.05", "-q")
BRIEF = ("skin1", "--photons", "1e6", "--checkpoint-every", "0.02", "-q")
LONGER = ("skin1", "--photons", "2e6", "--checkpoint-every", "0.02")  # than a disk takes to fill


def run_alone(folder, arguments):
    """The profile's bytes of a run left alone, and how long it took."""
    begun = time.monotonic()
    process = start(folder, *arguments)
    assert process.communicate(timeout=300)[1] == ""
    return (folder / PROFILE).read_bytes(), time.monotonic() - begun


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    return run_alone(tmp_path_factory.mktemp("undisturbed"), KILLED)


def kill_and_resume(folder, killer, moments, whole):
    """Kill a run at each of the moments; wherever one ends by itself its bytes must be right."""
    for moment in moments:
        if not killer.kill_one(folder, moment):
            assert (folder / PROFILE).read_bytes() == whole
            shutil.rmtree(folder)
            folder.mkdir()
    killer.finish(folder)
    assert (folder / PROFILE).read_bytes() == whole
    assert names(folder) == [PROFILE]


@posix
def test_killed_three_times_and_resumed(tmp_path):
    folders = [tmp_path / each for each in ("alone", "killed")]
    for folder in folders:
        folder.mkdir()
    whole, seconds = run_alone(folders[0], BRIEF)
    killer = Killer(BRIEF, seconds, random.Random(1))
    kill_and_resume(folders[1], killer, list(killer.hits), whole)


@posix
@pytest.mark.slow
def test_killed_a_hundred_times_and_resumed(tmp_path, undisturbed):
    whole, seconds = undisturbed
    chance = random.Random(2)
    killer = Killer(KILLED, seconds, chance)
    while sum(killer.hits.values()) < 90:
        moments = chance.choices(list(killer.hits), k=chance.randrange(1, 6))
        folder = tmp_path / f"{sum(killer.hits.values())}"
        folder.mkdir(exist_ok=True)
        kill_and_resume(folder, killer, moments, whole)
    # ten more over a life that begins with compiling
    for k in range(10):
        folder = tmp_path / f"cold-{k}"
        folder.mkdir()
        cold = Killer(KILLED, 10.0, chance, tmp_path / f"cache-{k}")
        while not cold.kill_one(folder, "by the clock"):
            (folder / PROFILE).unlink()
            shutil.rmtree(cold.cache)
        cold.finish(folder)
        assert (folder / PROFILE).read_bytes() == whole
    assert killer.half_written > 5  # else no kill fell into a write
    print(killer.hits, killer.half_written, "half-written files")


@posix
def test_all_materials_killed_and_resumed(tmp_path):
    arguments = ("--paper", "--photons", "2e4", "--checkpoint-every", "0", "-q")
    folders = [tmp_path / each for each in ("whole", "killed")]
    for folder in folders:
        folder.mkdir()
    fork_server.run([*COMMAND, *arguments], cwd=folders[0]).check_returncode()
    killer = Killer(arguments, 3.0, random.Random(3))
    for _ in range(2):
        killer.kill_one(folders[1], "by the clock")
    killer.finish(folders[1])
    killer.finish(folders[1])
    assert len(names(folders[0])) == 11
    assert names(folders[0]) == names(folders[1])
    for name in names(folders[0]):
        assert (folders[0] / name).read_bytes() == (folders[1] / name).read_bytes()


def test_a_walk_done_before_is_not_walked_again(run, tmp_path, monkeypatch):
    # as after a kill between the two walks of --paper: marble, of another index, is missing
    run("--paper", "--photons", "2000", "-q")
    whole = (tmp_path / "marble.profile.npz").read_bytes()
    (tmp_path / "marble.profile.npz").unlink()
    status, out, err = run("--paper", "--photons", "2000", "--resume")
    assert status == 0
    assert "Wrote marble.profile.npz\nFinished before, nothing to do: apple" in out
    assert "No marble.profile.npz.checkpoint to continue from: starting a new run." in err
    assert (tmp_path / "marble.profile.npz").read_bytes() == whole


# A disk of our own


@pytest.fixture
def small_disk(tmp_path):
    """A file system of 256 kB, where this process may mount one."""
    folder = tmp_path / "disk"
    folder.mkdir()
    if shutil.which("mount") is None:
        pytest.skip("there is no mount command")
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=256k", "tmpfs", folder], capture_output=True, text=True
    )
    if mounted.returncode != 0:
        pytest.skip(f"mounting is not permitted here: {mounted.stderr.strip()}")
    yield folder
    subprocess.run(["umount", folder], check=True)


def fill(folder, seconds=0.3):
    """Take all room, also what a checkpoint replaced in the meantime gives back."""
    end = time.monotonic() + seconds
    with (folder / "filler").open("ab", buffering=0) as stream:
        while time.monotonic() < end:
            with contextlib.suppress(OSError):
                stream.write(bytes(1024))


@posix
def test_a_disk_that_fills_up_during_a_run(small_disk, tmp_path):
    whole, _ = run_alone(tmp_path, [*LONGER, "-q"])
    process = start(small_disk, *LONGER)
    wait_for((small_disk / CHECKPOINT).exists)
    fill(small_disk)
    _, err = process.communicate(timeout=120)
    assert process.returncode == 1
    assert err.count("Warning:") == err.count("no space left on device: the run goes on") == 1
    assert err.splitlines()[-1] == (
        f"Error: {PROFILE} cannot be written: no space left on device; "
        f"{CHECKPOINT} is kept: --resume continues from it."
    )
    assert names(small_disk) == ["filler", CHECKPOINT]
    (small_disk / "filler").unlink()
    process = start(small_disk, *LONGER, "-q", "--resume")
    assert process.communicate(timeout=120)[1] == ""
    assert (small_disk / PROFILE).read_bytes() == whole
    assert names(small_disk) == [PROFILE]


@posix
def test_a_read_only_folder_is_one_line(small_disk):
    leave_checkpoint(small_disk / CHECKPOINT)
    before = (small_disk / CHECKPOINT).read_bytes()
    subprocess.run(["mount", "-o", "remount,ro", small_disk], check=True)
    process = start(small_disk, "skin1", "--resume")
    _, err = process.communicate(timeout=60)
    assert process.returncode == 1
    assert err == f"Error: {PROFILE} cannot be written: read-only file system.\n"
    assert (small_disk / CHECKPOINT).read_bytes() == before


def test_a_folder_that_turns_read_only_costs_the_checkpoint_only(tmp_path, monkeypatch):
    def read_only(*_arguments, **_keywords):
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr(files.tempfile, "mkstemp", read_only)
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        skin1(photons=100_000, checkpoint=Checkpoint(tmp_path / "c", 0.0))
    assert [str(each.message).partition(": ")[2] for each in warned] == [
        "read-only file system: the run goes on, and the last good checkpoint, if there is one, "
        "is kept."
    ]
