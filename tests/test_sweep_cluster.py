"""A scheduler and two workers as processes of their own: the same bits, whatever is killed."""

import contextlib
import logging
import os
import signal
import socket
import sys
import time
from concurrent.futures import Future
from types import SimpleNamespace

import fork_server
import pytest
from processes import end_all
from test_sweep import WALK, content, plan_of

from sssfit.errors import ArgumentError, SweepError
from sssfit.material import load_material
from sssfit.simulate import simulate_to_files
from sssfit.sweep import cluster, sweep_to_store, tasks
from sssfit.sweep.cluster import Batches, local_count

pytestmark = pytest.mark.skipif(os.name != "posix", reason="kill -9")
# Long enough to be killed in its midst: 6 points of 20 batches.
LONG = WALK.replace("40_000", "320_000")


class Machines:
    """A scheduler and workers on this machine, which may be killed."""

    def __init__(self, folder, workers=2):
        self.folder = folder
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self.address = f"tcp://127.0.0.1:{self.port}"
        self.scheduler = self._begin("scheduler", "--host", "127.0.0.1", "--port", str(self.port))
        self.workers = [self.add_worker() for _ in range(workers)]

    def add_worker(self, *more):
        own = ("--nthreads", "1", "--no-nanny", "--no-dashboard", "--host", "127.0.0.1")
        own = (*own, "--local-directory", str(self.folder))
        return self._begin("worker", self.address, *own, *more)

    def _begin(self, what, *arguments):
        dashboard = ("--no-dashboard",) if what == "scheduler" else ()
        command = [sys.executable, "-m", "distributed.cli.dask_" + what, *arguments, *dashboard]
        return fork_server.start(command, stdout=-3, stderr=-3)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("cluster")


@pytest.fixture(scope="module")
def plan(folder):
    return plan_of(folder, LONG)


@pytest.fixture(scope="module")
def undisturbed(folder, plan):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tasks, "TASK_STEPS", 2e6)
        sweep_to_store(plan, folder / "local.zarr", threads=1)
    return content(folder / "local.zarr")


@pytest.fixture
def machines(tmp_path):
    yield Machines(tmp_path)
    end_all()


@pytest.fixture(autouse=True)
def small_tasks(monkeypatch):
    """Points of several parts."""
    monkeypatch.setattr(tasks, "TASK_STEPS", 2e6)


def killing(process, points=1):
    """A progress callback that kills a process once so many points are done."""

    def watch(done, of_all, at):
        if done == points and process.poll() is None:
            process.send_signal(signal.SIGKILL)

    return watch


CLIENT = """
import sys
from sssfit.sweep import load_plan, sweep_to_store, tasks
tasks.TASK_STEPS = 2e6
if __name__ == "__main__":
    plan, path, scheduler = sys.argv[1:]
    sweep_to_store(load_plan(plan), path, scheduler=scheduler, resume=True)
"""


def kill_a_client(machines, folder, path, seconds):
    """Begin the sweep in a process, and kill -9 it a time after its store is there."""
    (folder / "plan.toml").write_text(LONG)
    command = [sys.executable, "-c", CLIENT, folder / "plan.toml", path, machines.address]
    process = fork_server.start(command, stdout=-3, stderr=-3)
    end = time.monotonic() + 60.0
    while not path.exists() and process.poll() is None and time.monotonic() < end:
        time.sleep(0.01)
    time.sleep(seconds)
    process.kill()
    process.wait()


def test_what_is_killed_changes_no_bit(machines, plan, undisturbed, tmp_path, caplog, monkeypatch):
    """A client, then a worker, at last the scheduler; each time the sweep goes on to the end."""
    for name in ("distributed", "distributed.client", "distributed.gc"):
        monkeypatch.setattr(logging.getLogger(name), "handlers", [caplog.handler])
    path = tmp_path / "client.zarr"
    kill_a_client(machines, tmp_path, path, 0.3)
    found = sweep_to_store(plan, path, scheduler=machines.address, resume=True)
    assert found.before < plan.count
    assert content(path) == undisturbed

    path = tmp_path / "worker.zarr"
    watch = killing(machines.workers[0])
    assert sweep_to_store(plan, path, scheduler=machines.address, progress=watch).is_complete
    assert machines.workers[0].wait(5) == -signal.SIGKILL
    assert content(path) == undisturbed

    # Dask told of the result that it could not gather, in words that do not say what to do.
    assert not [each for each in caplog.records if each.name.startswith("distributed")]

    path = tmp_path / "scheduler.zarr"
    watch = killing(machines.scheduler)
    with pytest.raises(SweepError, match="`resume = True` computes the others") as caught:
        sweep_to_store(plan, path, scheduler=machines.address, progress=watch)
    assert "\n" not in str(caught.value)
    sweep_to_store(plan, path, threads=1, resume=True)
    assert content(path) == undisturbed


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20))
def test_twenty_kills_of_each(machines, plan, undisturbed, tmp_path, seed):
    points = 1 + seed % (plan.count - 1)
    path = tmp_path / "client.zarr"
    kill_a_client(machines, tmp_path, path, 0.1 * seed)
    sweep_to_store(plan, path, scheduler=machines.address, resume=True)
    assert content(path) == undisturbed
    path = tmp_path / "worker.zarr"
    watch = killing(machines.workers[seed % 2], points)
    sweep_to_store(plan, path, scheduler=machines.address, progress=watch)
    assert content(path) == undisturbed
    path = tmp_path / "scheduler.zarr"
    watch = killing(machines.scheduler, points)
    with pytest.raises(SweepError):
        sweep_to_store(plan, path, scheduler=machines.address, progress=watch)
    sweep_to_store(plan, path, threads=1, resume=True)
    assert content(path) == undisturbed


def test_one_large_walk_is_the_same_bits_on_a_cluster(machines, tmp_path, monkeypatch):
    """A worker is killed in the midst of one; the scheduler of another one, which is resumed."""
    # So many ranges that most are not asked for yet when either is killed: in ranges of a second,
    # all of the walk was sometimes done before the loss was noticed.
    monkeypatch.setattr(cluster, "_RANGE_STEPS", 2e6)
    material, settings = load_material("skin1"), {"photons": 3_000_000, "threads": 2}
    how = {"checkpoint_every": 0.0}
    walk = [[material], [tmp_path / "local.npz"], "montecarlo", settings]
    simulate_to_files(*walk)
    local = (tmp_path / "local.npz").read_bytes()

    seen = []

    def killing(process):
        @contextlib.contextmanager
        def watch(label):
            def report(now):
                seen.append(now.photons_done)
                if now.photons_done > 300_000 and process.poll() is None:
                    process.kill()

            yield report

        return watch

    walk[1] = [tmp_path / "far.npz"]
    with Batches(machines.address) as elsewhere:
        walk[3] = settings | {"elsewhere": elsewhere}
        simulate_to_files(*walk, watch=killing(machines.workers[0]), **how)
    assert (tmp_path / "far.npz").read_bytes() == local
    assert len({*seen}) > 3  # progress is live

    walk[1] = [tmp_path / "lost.npz"]
    with Batches(machines.address) as elsewhere:
        walk[3] = settings | {"elsewhere": elsewhere}
        with pytest.raises(
            SweepError, match=r"lost.*; .*checkpoint keeps [\d,]+ photons, and `resume"
        ):
            simulate_to_files(*walk, watch=killing(machines.scheduler), **how)
    assert (tmp_path / "lost.npz.checkpoint").exists()
    walk[3] = settings
    simulate_to_files(*walk, resume=True)
    assert (tmp_path / "lost.npz").read_bytes() == local


@pytest.mark.parametrize("status", ["finished", "lost", "pending"])
def test_a_result_that_died_with_its_worker_is_waited_for(status):
    """Killed after the result was announced and before it was fetched: seen once in 40 kills."""
    result = Future()
    cluster._hand_over(SimpleNamespace(status=status, result=lambda: 3), result)
    assert result.result(0) == 3


OTHER = "import sssfit.simulate.batches as b\nb.source_key = lambda: '0.0.1-0123'\n"


def test_another_version_on_the_workers_is_refused(plan, tmp_path):
    machines = Machines(tmp_path, workers=0)
    (tmp_path / "other.py").write_text(OTHER)
    machines.add_worker("--preload", str(tmp_path / "other.py"))
    wanted = r"has sssfit '0.0.1-0123', and this is .*; install the same version on all machines"
    with pytest.raises(SweepError, match=wanted):
        sweep_to_store(plan, tmp_path / "x.zarr", scheduler=machines.address)
    assert not (tmp_path / "x.zarr").exists()
    end_all()


def test_a_scheduler_that_is_not_there_is_one_line(plan, tmp_path, monkeypatch):
    monkeypatch.setattr(cluster, "_CONNECT_SECONDS", 0.5)
    with pytest.raises(SweepError, match=r"no Dask scheduler at tcp://127\.0\.0\.1:9 "):
        sweep_to_store(plan, tmp_path / "x.zarr", scheduler="tcp://127.0.0.1:9")
    assert not (tmp_path / "x.zarr").exists()


@pytest.mark.parametrize(("text", "count"), [("local:2", 2), ("tcp://10.0.0.5:8786", 0)])
def test_schedulers_that_are_understood(text, count):
    assert local_count(text) == count


@pytest.mark.parametrize("text", ["local:0", "local:x", "local:1000", "10.0.0.5", "http://x", ""])
def test_others_are_refused(text):
    with pytest.raises(ArgumentError, match="expected an address, tcp://HOST:PORT, or local:N"):
        local_count(text)
