"""Sweeps: the same bits on any number of workers, nothing lost or doubled, and one store of it."""

import json
import os
import shutil
import signal
import sys
import time
from concurrent.futures import Future
from dataclasses import replace
from pathlib import Path
from subprocess import DEVNULL

import numpy as np
import processes
import pytest
import xarray
import zarr

from sssfit._jit import half_space_walk
from sssfit.errors import FileError, SweepError
from sssfit.fit import fit_svd
from sssfit.kernel import read_kernel
from sssfit.simulate import simulate_exact, simulate_montecarlo
from sssfit.sweep import Plan, Store, load_plan, pools, sweep_to_store, tasks
from sssfit.sweep import runner as runner_module
from sssfit.sweep.chunks import Chunks
from sssfit.sweep.dry_run import estimate
from sssfit.sweep.layout import bytes_of, variables_of
from sssfit.sweep.runner import Run
from sssfit.sweep.variables import FINGERPRINT

GRID = "[grid]\ndr_mm = 0.25\nradius_mm = 5.0\n"
AXES = (
    '[[axes]]\nkey = "albedo"\nvalues = [0.5, 0.9, 0.99]\n[[axes]]\nkey = "eta"\n'
    "values = [1.3, 1.5]\n"
)
WALK = f'material = "skin1"\n[settings]\nphotons = 40_000\n{GRID}{AXES}'
EXACT = f'material = "skin1"\nmethod = "exact"\n[settings]\ntolerance = 1e-2\n{GRID}{AXES}'


def plan_of(folder, text):
    path = folder / "plan.toml"
    path.write_text(text)
    return load_plan(path)


def content(path):
    """Every file of a store, byte by byte."""
    return {
        each.relative_to(path).as_posix(): each.read_bytes()
        for each in sorted(path.rglob("*"))
        if each.is_file()
    }


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("sweep")


@pytest.fixture(scope="module")
def walked(folder):
    """A sweep that nothing disturbed."""
    plan = plan_of(folder, WALK)
    found = sweep_to_store(plan, folder / "walk.zarr", threads=1)
    assert (found.done, found.before, found.failures) == (6, 0, ())
    return plan, folder / "walk.zarr"


def test_xarray_opens_a_store_with_coordinates_and_units(walked):
    _, path = walked
    with xarray.open_zarr(path) as data:
        assert data.sizes == {
            "albedo": 3,
            "eta": 2,
            "r_mm": 20,
            "edge": 21,
            "channel": 3,
            "layer": 1,
        }
        assert {*data.coords} == {"albedo", "eta", "r_mm", "r_edges_mm", "channel"}
        assert data.albedo.values.tolist() == [0.5, 0.9, 0.99]
        assert data.channel.values.tolist() == ["R", "G", "B"]
        assert data.r_mm.attrs["units"] == "mm"
        assert all("long_name" in each.attrs for each in data.data_vars.values())
        assert data.annulus_energy.sel(albedo=0.9, eta=1.5).shape == (20, 3)
        assert not any(np.isnan(data[name]).any() for name in data.data_vars)


@pytest.mark.parametrize("index", [0, 5])
def test_a_point_of_one_part_is_the_profile_of_simulate(walked, index):
    plan, path = walked
    own = {"dr_mm": 0.25, "radius_mm": 5.0, "photons": 40_000, "seed": plan.point_seed(index)}
    profile = simulate_montecarlo(plan.material(index), threads=1, **own)
    with xarray.open_zarr(path) as data:
        a, e = plan.position(index)
        point = data.isel(albedo=a, eta=e)
        for name in ("annulus_energy", "annulus_energy_stderr", "beyond_grid", "absorbed"):
            assert np.array_equal(point[name], getattr(profile, name)), name
        assert int(point.seed) == profile.meta["seed"]


def test_noise_of_neighbours_is_independent(walked):
    """With one seed the differences of neighbours would have far less noise than this."""
    _, path = walked
    with xarray.open_zarr(path) as data:
        errors = data.annulus_energy_stderr.isel(albedo=1)
        step = data.annulus_energy.isel(albedo=1).diff("eta").values[0]
    # Physics changes with eta as well, smoothly: second differences along r leave noise alone.
    spread = np.diff(step[5:], n=2, axis=0)
    expected = np.sqrt(6.0 * (errors.values**2).sum(axis=0)[5:].mean(axis=0))
    assert (spread.std(axis=0) > 0.5 * expected).all()


@pytest.mark.parametrize("text", [WALK, EXACT])
def test_the_walk_is_compiled_before_workers_start(monkeypatch, tmp_path, text):
    """Each of them compiled it for itself: with an empty cache a small sweep took 24 s."""
    order = []
    monkeypatch.setattr(half_space_walk.ENTRY, "load", lambda: order.append("compiled"))
    monkeypatch.setattr(pools, "Processes", lambda *_: order.append("started"))
    pools.pool_for(plan_of(tmp_path, text), 2, None)
    assert order == (["compiled", "started"] if text == WALK else ["started"])


def test_two_processes_make_the_same_bytes(walked, tmp_path):
    plan, path = walked
    sweep_to_store(plan, tmp_path / "x.zarr", threads=2)
    assert content(tmp_path / "x.zarr") == content(path)


@pytest.fixture
def in_parts(monkeypatch):
    """Tasks of one batch each, so that a point has three parts."""
    monkeypatch.setattr(tasks, "TASK_STEPS", 1.0)


class Backwards:
    """A pool of many workers that finishes the last task first."""

    workers = 4

    def __init__(self, plan):
        self.plan, self.waiting = plan, []

    def submit(self, task):
        self.waiting.append((Future(), task))
        if len(self.waiting) == 3 * self.workers or task.profile is not None:
            self.check()
        return self.waiting[-1][0] if self.waiting else Future()

    def check(self):
        for future, task in reversed(self.waiting):
            if not future.done():
                future.set_result(tasks.perform(self.plan, task))


def test_parts_are_added_in_order_whatever_ends_first(walked, tmp_path, in_parts):
    plan, _ = walked
    assert len(tasks.parts_of(plan, 0, 1e6)) == 3
    sweep_to_store(plan, tmp_path / "a.zarr", threads=1)
    runner_module.make_store(tmp_path / "b.zarr", plan)
    store = Store(tmp_path / "b.zarr", plan)
    Run(plan, store, Backwards(plan), 0, lambda: False, None).all(range(6))
    assert content(tmp_path / "a.zarr") == content(tmp_path / "b.zarr")


def test_parts_do_not_depend_on_the_number_of_workers(walked):
    plan, _ = walked
    for workers in (1, 2, 20):
        parts = [part for each in tasks.tasks_of(plan, range(6), workers) for part in each.parts]
        assert sorted(parts, key=lambda each: each.index) == [
            tasks.Part(k, last=3) for k in range(6)
        ]


def test_no_task_is_longer_than_its_share(tmp_path):
    text = WALK.replace("40_000", "20_000_000").replace("0.99]", "0.9999]")
    plan = plan_of(tmp_path, text)
    every = list(tasks.tasks_of(plan, range(6), 2))
    batch = max(tasks.point_steps(plan, k) for k in range(6)) * 16_384 / 2e7
    assert max(each.steps for each in every) < 2.0 * tasks.TASK_STEPS + batch
    assert every[0].parts[0].index in (4, 5)  # the longest points come first


def test_resuming_computes_only_what_is_missing(walked, tmp_path):
    plan, path = walked
    shutil.copytree(path, tmp_path / "x.zarr")
    lose(tmp_path / "x.zarr", plan, [1, 4])
    found = sweep_to_store(plan, tmp_path / "x.zarr", threads=1, resume=True)
    assert (found.before, found.done) == (4, 2)
    assert content(tmp_path / "x.zarr") == content(path)


def lose(path, plan, indices):
    """Take the fingerprints of points, as a kill before they were written would."""
    marks = zarr.open_array(str(path / "fingerprint"), mode="r+", zarr_format=2)
    for index in indices:
        marks[plan.position(index)] = 0


def test_a_damaged_chunk_is_noticed_and_computed_again(walked, tmp_path):
    plan, path = walked
    shutil.copytree(path, tmp_path / "x.zarr")
    chunk = tmp_path / "x.zarr" / "annulus_energy" / "1.0.0.0"
    chunk.write_bytes(chunk.read_bytes()[:-8] + b"\x00" * 8)
    (tmp_path / "x.zarr" / "annulus_energy_stderr" / "2.1.0.0").unlink()
    found = sweep_to_store(plan, tmp_path / "x.zarr", threads=1, resume=True)
    assert found.done == 2
    assert content(tmp_path / "x.zarr") == content(path)


@pytest.mark.parametrize("length", [0, 5])
def test_points_of_a_damaged_fingerprint_are_computed_again(walked, tmp_path, length):
    plan, path = walked
    shutil.copytree(path, tmp_path / "x.zarr")
    os.truncate(tmp_path / "x.zarr" / "fingerprint" / "1.0", length)
    found = sweep_to_store(plan, tmp_path / "x.zarr", threads=1, resume=True)
    assert found.done == 2
    assert content(tmp_path / "x.zarr") == content(path)


def test_damaged_heads_coordinates_and_seeds_are_written_again(walked, tmp_path, caplog):
    plan, path = walked
    shutil.copytree(path, tmp_path / "x.zarr")
    for name in ("fingerprint/.zarray", "eta/0", "seed/1.0"):
        (tmp_path / "x.zarr" / name).write_text("{")
    (tmp_path / "x.zarr" / "absorbed" / ".zarray").unlink()
    with caplog.at_level("INFO"):
        found = sweep_to_store(plan, tmp_path / "x.zarr", threads=1, resume=True)
    assert found.done == 0
    assert content(tmp_path / "x.zarr") == content(path)
    told = "absorbed/.zarray and 3 other files were damaged or missing; written again."
    assert told in caplog.text


def test_what_else_a_store_has_stays(walked, tmp_path, caplog):
    """Attributes and arrays of the user's own, and a head that is written otherwise."""
    plan, path = walked
    store = tmp_path / "x.zarr"
    shutil.copytree(path, store)
    group = zarr.open_group(store, zarr_format=2)
    group.attrs["author"] = "me"
    group.create_array("mine", data=np.arange(3.0))
    head = store / "eta" / ".zarray"
    head.write_text(json.dumps(json.loads(head.read_text()) | {"compressor": {"id": "zlib"}}))
    kept = head.read_bytes(), (store / "eta" / "0").read_bytes()
    (store / ".zmetadata").unlink()
    with caplog.at_level("INFO"):
        assert sweep_to_store(plan, store, threads=1, resume=True).done == 0
    assert ".zmetadata was damaged or missing; written again." in caplog.text
    assert (head.read_bytes(), (store / "eta" / "0").read_bytes()) == kept
    again = zarr.open_consolidated(store, zarr_format=2)
    assert again.attrs["author"] == "me"
    assert again["mine"][:].tolist() == [0.0, 1.0, 2.0]


@pytest.mark.parametrize("points", [2, 300])
def test_chunks_are_the_files_that_zarr_would_write(tmp_path, points):
    """Some points of rows of one chunk and of two; values, fill values and a row without any."""
    values = np.linspace(0.1, 0.9, points).tolist()
    axes = (
        f'[[axes]]\nkey = "albedo"\nvalues = [0.5, 0.9]\n[[axes]]\nkey = "g"\nvalues = {values}\n'
    )
    plan = plan_of(tmp_path, EXACT.replace(AXES, axes))
    random = np.random.default_rng(3)
    for name in ("ours", "zarrs"):
        runner_module.make_store(tmp_path / name, plan)
    for each in (*variables_of(plan), FINGERPRINT):
        chunks = Chunks(tmp_path / "ours", plan, each)
        array = zarr.open_array(str(tmp_path / "zarrs" / each.name), mode="r+", zarr_format=2)
        for some in ([0], [*range(1, points, 7)]):  # the second time into chunks that are there
            new = {k: random.random(array.shape[2:]) * 1e3 // 1 for k in some}
            new |= {0: np.full(array.shape[2:], np.nan)} if each is not FINGERPRINT else {}
            chunks.put((1,), new)
            for k, value in new.items():
                array[1, k] = value
        for k in (0, 1, points - 1):
            np.testing.assert_array_equal(chunks.get((1,), k), array[1, k])
    assert content(tmp_path / "ours") == content(tmp_path / "zarrs")


def test_a_sweep_that_is_stopped_keeps_its_points(walked, tmp_path):
    plan, path = walked
    seen = []
    stopped = sweep_to_store(
        plan,
        tmp_path / "x.zarr",
        threads=1,
        stop=lambda: len(seen) >= 2,
        progress=lambda *now: seen.append(now),
    )
    assert 2 <= stopped.done < 6
    assert not stopped.is_complete
    sweep_to_store(plan, tmp_path / "x.zarr", threads=1, resume=True)
    assert content(tmp_path / "x.zarr") == content(path)


def test_an_exact_sweep_has_the_profiles_of_simulate(tmp_path):
    plan = plan_of(tmp_path, EXACT.replace(", 0.99]", "]"))
    found = sweep_to_store(plan, tmp_path / "x.zarr", threads=1)
    assert found.is_complete
    own = {"dr_mm": 0.25, "radius_mm": 5.0, "tolerance": 1e-2, "threads": 1}
    profile = simulate_exact(plan.material(3), **own)
    with xarray.open_zarr(tmp_path / "x.zarr") as data:
        assert np.array_equal(data.annulus_energy[1, 1], profile.annulus_energy)
        assert "seed" not in data


def test_a_fit_stores_kernels(tmp_path, in_parts):
    fit = '[fit]\nmethod = "svd"\nrank = 2\nmm_per_pixel = 0.5\nsupport_mm = 3.0\n'
    plan = plan_of(tmp_path, WALK + fit)
    found = sweep_to_store(plan, tmp_path / "x.zarr", threads=1)
    assert found.is_complete
    settings = {"dr_mm": 0.25, "radius_mm": 5.0, "photons": 40_000}
    seed = plan.point_seed(2)
    profile = simulate_montecarlo(plan.material(2), threads=1, seed=seed, **settings)
    wanted = fit_svd(profile, rank=2, mm_per_pixel=0.5, support_mm=3.0).kernel
    with xarray.open_zarr(tmp_path / "x.zarr") as data:
        (tmp_path / "k.kernel.json").write_text(str(data.kernel.values[1, 0]))
    kernel = read_kernel(tmp_path / "k.kernel.json")
    np.testing.assert_allclose(kernel.weights, wanted.weights, atol=1e-12)


def test_a_slab_has_its_transmittance(tmp_path):
    axis = '[[axes]]\nkey = "thickness_mm"\nvalues = [0.5, 2.0, inf]\n'
    plan = plan_of(tmp_path, f'material = "skin1"\n[settings]\nphotons = 2000\n{GRID}{axis}')
    sweep_to_store(plan, tmp_path / "x.zarr", threads=1)
    with xarray.open_zarr(tmp_path / "x.zarr") as data:
        through = data.transmittance.values
        total = data.transmittance + data.diffuse_reflectance + data.absorbed.sum("layer")
        total = total + data.specular_reflectance + data.unfinished
    assert (through[0] > through[1]).all()
    assert np.isnan(through[2]).all()
    np.testing.assert_allclose(total[:2], 1.0, atol=1e-2)  # roulette's noise


def test_points_that_cannot_be_computed_do_not_keep_the_others_back(tmp_path, monkeypatch):
    dipole = EXACT.replace('"exact"', '"dipole"').replace("tolerance = 1e-2\n", "")
    plan = plan_of(tmp_path, dipole)

    def failing(plan, index, real=tasks._solved):
        if index == 2:
            raise SweepError("this point is too hard.")
        return real(plan, index)

    monkeypatch.setattr(tasks, "_solved", failing)
    found = sweep_to_store(plan, tmp_path / "x.zarr", threads=1)
    assert (found.done, len(found.failures)) == (5, 1)
    assert found.failure == (
        "1 point of 6 cannot be computed, the first at albedo = 0.9, eta = 1.3: this point is too "
        f"hard; the others are kept in {tmp_path / 'x.zarr'}."
    )


def test_the_store_of_another_plan_is_refused(walked, tmp_path):
    plan, path = walked
    other = replace(plan, settings={"photons": 50_000})
    with pytest.raises(SweepError, match=r'made with another plan: settings = \{"photons": 40000'):
        sweep_to_store(other, path, threads=1, resume=True)
    with pytest.raises(FileError, match="`resume = True` computes what it lacks"):
        sweep_to_store(plan, path, threads=1)
    begun = tmp_path / "begun.zarr"
    begun.mkdir()
    (begun / ".zattrs").write_text('{"format": "sssfit.sweep/1", "plan": 3}')
    with pytest.raises(SweepError, match=r"begun\.zarr: \.zattrs says plan = 3, and the plan was"):
        sweep_to_store(plan, begun, threads=1, resume=True)
    (tmp_path / "mine.zarr").mkdir()
    for force in (False, True):
        with pytest.raises(FileError, match="no store of a sweep"):
            sweep_to_store(plan, tmp_path / "mine.zarr", threads=1, force=force)
    with pytest.raises(FileError, match="- is stdout, and a store is a folder"):
        sweep_to_store(plan, "-", threads=1)
    with pytest.raises(FileError, match="there is no folder"):
        sweep_to_store(plan, tmp_path / "no" / "x.zarr", threads=1)


def test_another_version_is_refused(walked, monkeypatch):
    plan, path = walked
    task = next(tasks.tasks_of(plan, [0], 1))
    with pytest.raises(SweepError, match="install the same version on all machines"):
        tasks.perform(plan, replace(task, code="0.0.1-0123"))
    monkeypatch.setattr("sssfit.sweep.store.code_version", lambda: "0.0.1-0123")
    with pytest.raises(SweepError, match="would make other bits"):
        sweep_to_store(plan, path, threads=1, resume=True)


def test_a_disk_without_room_is_refused_before_anything_is_written(walked, tmp_path, monkeypatch):
    plan, _ = walked
    usage = shutil.disk_usage(tmp_path)._replace(free=bytes_of(plan))
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage)
    with pytest.raises(FileError, match="would take 10 MB, and the disk has 0 MB left"):
        sweep_to_store(plan, tmp_path / "x.zarr", threads=1)
    assert [*tmp_path.iterdir()] == []


def test_a_disk_that_fills_keeps_what_is_finished(walked, tmp_path, monkeypatch):
    plan, path = walked
    flush, calls = Store._flush, []

    def filling(store):
        calls.append(store)
        if len(calls) > 2:
            raise OSError(28, "No space left on device")
        flush(store)

    monkeypatch.setattr(Store, "_flush", filling)
    monkeypatch.setattr("sssfit.sweep.store._WAITS_POINTS", 1)
    with pytest.raises(FileError, match="no space left on device; the points that were finished"):
        sweep_to_store(plan, tmp_path / "x.zarr", threads=1)
    monkeypatch.undo()
    found = sweep_to_store(plan, tmp_path / "x.zarr", threads=1, resume=True)
    assert found.before == 2
    assert content(tmp_path / "x.zarr") == content(path)


def test_a_chunk_that_cannot_be_written_leaves_nothing_behind(walked, tmp_path, monkeypatch):
    plan, path = walked
    shutil.copytree(path, tmp_path / "x.zarr")

    def filling(path, content):
        with path.open("wb") as stream:
            stream.write(content[:8])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", filling)
    (first, *_) = variables_of(plan)
    with pytest.raises(OSError, match="No space"):
        Chunks(tmp_path / "x.zarr", plan, first).put((0,), {0: 1.0})
    monkeypatch.undo()
    assert content(tmp_path / "x.zarr") == content(path)


def test_a_link_to_a_store_stays_one(walked, tmp_path, monkeypatch):
    plan, path = walked
    there, link = tmp_path / "disk" / "x.zarr", tmp_path / "link.zarr"
    there.parent.mkdir()
    shutil.copytree(path, there)
    link.symlink_to(there)
    looked, usage = [], shutil.disk_usage(tmp_path)
    monkeypatch.setattr(shutil, "disk_usage", lambda each: looked.append(each) or usage)
    found = sweep_to_store(plan, link, threads=1, force=True, stop=lambda: True)
    assert link.is_symlink()
    assert (found.done, looked) == (0, [there.parent])
    assert content(there) != content(path)
    (there / "eta" / "0").unlink()
    sweep_to_store(plan, link, threads=1, resume=True)
    assert content(there) == content(path)
    assert sorted(tmp_path.iterdir()) == [there.parent, link]


def test_the_estimate_of_bytes_is_what_a_store_takes(walked):
    plan, path = walked
    chunks = {name: len(each) for name, each in content(path).items() if ".z" not in name}
    known = ("albedo/", "eta/", "r_mm/", "r_edges_mm/", "channel/", "seed/")
    assert bytes_of(plan) == sum(n for name, n in chunks.items() if not name.startswith(known))


def test_a_dry_run_writes_nothing(walked, tmp_path, monkeypatch):
    plan, _ = walked
    monkeypatch.chdir(tmp_path)
    found = estimate(plan, threads=1)
    assert (found.to_dict()["photons"], found.workers) == (6 * 40_000, 1)
    assert 0.0 < found.work_seconds < found.seconds
    assert [*tmp_path.iterdir()] == []


RUN = """
import sys
from sssfit.sweep import load_plan, sweep_to_store
if __name__ == "__main__":
    sweep_to_store(load_plan(sys.argv[1]), sys.argv[2], threads=int(sys.argv[3]), resume=True)
"""


def killed_at(folder, seconds, threads=1):
    """Run the sweep of a folder, and kill -9 it after a time."""
    (folder / "run.py").write_text(RUN)
    command = [sys.executable, "run.py", "plan.toml", "x.zarr", str(threads)]
    process = processes.start(command, cwd=folder, stdout=DEVNULL, stderr=DEVNULL)
    end = time.monotonic() + 60.0
    while not (folder / "x.zarr").exists() and time.monotonic() < end:
        time.sleep(0.01)
    time.sleep(seconds)
    process.send_signal(signal.SIGKILL)
    process.wait()


@pytest.mark.skipif(os.name != "posix", reason="kill -9")
def test_a_sweep_killed_at_any_moment_resumes_to_the_same_bits(walked, tmp_path):
    plan, path = walked
    (tmp_path / "plan.toml").write_text(WALK)
    killed_at(tmp_path, 0.05)
    sweep_to_store(plan, tmp_path / "x.zarr", threads=1, resume=True)
    assert content(tmp_path / "x.zarr") == content(path)


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="kill -9")
def test_twenty_kills(walked, tmp_path):
    plan, path = walked
    for k in range(20):
        folder = tmp_path / str(k)
        folder.mkdir()
        (folder / "plan.toml").write_text(WALK)
        for _ in range(2):
            killed_at(folder, float(np.random.default_rng(k).random()), threads=1 + k % 2)
        sweep_to_store(plan, folder / "x.zarr", threads=1, resume=True)
        assert content(folder / "x.zarr") == content(path)


def test_without_the_extra_one_line_says_what_to_install(walked, tmp_path, monkeypatch):
    plan, _ = walked
    monkeypatch.setitem(sys.modules, "zarr", None)
    with pytest.raises(SweepError, match=r"zarr is not installed.*pip install 'sssfit\[sweep\]'"):
        sweep_to_store(plan, tmp_path / "x.zarr", threads=1)
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(SweepError, match=r"distributed is not.*pip install 'sssfit\[cluster\]'"):
        estimate(plan, scheduler="local:1")


def test_plans_can_be_made_in_python(tmp_path):
    from sssfit.material import load_material
    from sssfit.sweep import Axis

    axis = Axis("eta", (1.3, 1.5), key="eta")
    plan = Plan(load_material("skin1"), (axis,), "dipole", dr_mm=0.25, radius_mm=5.0)
    assert sweep_to_store(plan, Path(tmp_path, "x.zarr"), threads=1).is_complete
