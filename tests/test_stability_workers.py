"""Workers: the same bits on any number of them, and none is left behind."""

import functools
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from multiprocessing.shared_memory import SharedMemory
from pathlib import Path

import numpy as np
import pytest
from processes import start
from test_profile import make_profile
from worker_calls import killed, refused, scaled

from sssfit.errors import FitError, SssfitError
from sssfit.report import make_report
from sssfit.shapes import gaussian_cdf
from sssfit.stability import imports, stability
from sssfit.stability.subject import Subject
from sssfit.stability.ways import Way
from sssfit.stability.workers import Workers
from sssfit.sweep import sweep_to_store


def is_alive(pid):
    """Return whether a process runs; one that has ended and is not waited for does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def waited_for(condition):
    end = time.monotonic() + 60.0
    while not condition() and time.monotonic() < end:
        time.sleep(0.05)
    return condition()


def test_results_come_in_order_from_processes_of_their_own_that_end():
    before = multiprocessing.active_children()
    with Workers(2, "shared") as workers:
        found = workers.each(functools.partial(scaled, 3), range(20))
        assert [each[:2] for each in found] == [("shared", 3 * k) for k in range(20)]
        assert os.getpid() not in {each[2] for each in found}
    assert multiprocessing.active_children() == before


def test_shared_memory_is_given_back(monkeypatch):
    """Also where no pool could be made, and after work that failed."""
    made = []

    def remembered(*given, **more):
        made.append(SharedMemory(*given, **more))
        return made[-1]

    monkeypatch.setattr("sssfit.stability.workers.SharedMemory", remembered)
    with Workers(1, bytes(100_000)):
        pass
    with pytest.raises(ValueError, match="max_workers"):
        Workers(0, bytes(100))
    with pytest.raises(FitError), Workers(1, None) as workers:
        workers.each(refused, [7])
    assert len(made) == 3
    for each in made:
        with pytest.raises(FileNotFoundError):
            SharedMemory(each.name)


def test_an_error_of_the_work_is_raised_here():
    with pytest.raises(FitError, match="7 is refused"), Workers(1, None) as workers:
        workers.each(refused, [7])


def test_a_killed_worker_gets_one_line():
    lost = pytest.raises(SssfitError, match="worker process ended before")
    with lost as caught, Workers(1, None) as workers:
        workers.each(killed, [0])
    assert "\n" not in str(caught.value)


def ended(thread):
    raise MemoryError


def stuck(thread):
    """Wait, as for the rest of a result, until nobody could write it any more."""
    os.read(thread.result_queue._reader.fileno(), 1)
    return None, True, None


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
@pytest.mark.parametrize("work", [ended, stuck])
def test_a_pool_that_cannot_tell_of_its_workers_gets_one_line(monkeypatch, work):
    """Python's thread for that has ended for lack of memory, or waits for half a result."""
    told = "concurrent.futures.process._ExecutorManagerThread.wait_result_broken_or_wakeup"
    monkeypatch.setattr(told, work)
    monkeypatch.setattr("sssfit.stability.workers._TOLD_SECONDS", 0.1)
    lost = pytest.raises(SssfitError, match="worker process ended before")
    with lost, Workers(1, None) as workers:
        workers.each(killed, [0])


_CALLER = """
import sys
from pathlib import Path
sys.path[:0] = {paths!r}
from sssfit.stability.ways import Way
from sssfit.stability.workers import Workers
from worker_calls import asleep

if __name__ == "__main__":
    with Workers(2, Path({folder!r})) as workers:
        workers.each(asleep, range(2))
"""


@pytest.mark.skipif(not Path("/proc/self").is_dir(), reason="looks for processes in /proc")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_no_worker_outlives_its_caller(tmp_path, number):
    """Ctrl-C or a killed caller ends workers in the midst of their work."""
    started = tmp_path / "started"
    started.mkdir()
    script = tmp_path / "caller.py"
    paths = [str(Path(__file__).parent)]
    script.write_text(_CALLER.format(paths=paths, folder=str(started)))
    caller = start([sys.executable, str(script)])
    assert waited_for(lambda: len(list(started.iterdir())) == 2)
    assert waited_for(lambda: all(each.read_text() for each in started.iterdir()))
    pids = [int(each.read_text()) for each in started.iterdir()]
    caller.send_signal(number)
    caller.wait(timeout=60.0)
    assert waited_for(lambda: not any(map(is_alive, pids)))


_CLOSED = """
import os, signal, sys
from functools import partial
from multiprocessing.resource_tracker import _resource_tracker as tracker
sys.path[:0] = {paths!r}
from sssfit.stability.workers import Workers
from worker_calls import scaled

if __name__ == "__main__":
    with Workers(1, None) as workers:
        pid = workers.each(partial(scaled, 1), [1])[0][2]
        for each in (pid, tracker._pid):
            os.kill(each, signal.SIGHUP)
        assert workers.each(partial(scaled, 1), [1])[0][2] == pid
        assert tracker._check_alive()
"""


@pytest.mark.skipif(os.name != "posix", reason="SIGHUP")
def test_a_terminal_that_closes_leaves_workers_to_their_caller(tmp_path):
    """It sends SIGHUP to all of them, and to Python's tracker, which printed a traceback."""
    script = tmp_path / "closed.py"
    script.write_text(_CLOSED.format(paths=[str(Path(__file__).parent)]))
    _, errors = (caller := start([sys.executable, str(script)])).communicate(timeout=60.0)
    assert (caller.returncode, errors) == (0, "")


_FAILING = """
import sys
sys.path[:0] = {paths!r}
from sssfit.stability.workers import Workers
from worker_calls import large

if __name__ == "__main__":
    with Workers(2, None) as workers:
        results = [workers.submit(large, 20_000_000) for _ in range(50)]
        results[0].result()
        raise OSError("the disk is full")
"""


def test_an_error_ends_workers_in_the_midst_of_a_result(tmp_path):
    """Their results take longer to come than to make, so one is always under way."""
    script = tmp_path / "failing.py"
    script.write_text(_FAILING.format(paths=[str(Path(__file__).parent)]))
    caller = start([sys.executable, str(script)])
    _, errors = caller.communicate(timeout=60.0)
    assert errors.strip().splitlines()[-1] == "OSError: the disk is full"


@pytest.mark.parametrize("size", [1, 1_000_000], ids=["little", "more than a pipe holds"])
def test_a_script_without_its_guard_gets_one_line(tmp_path, size):
    script = tmp_path / "unguarded.py"
    script.write_text(
        "from sssfit.stability.workers import Workers\n"
        f"with Workers(1, bytes({size})) as workers:\n"
        "    workers.each(print, [0])\n"
    )
    run = subprocess.run(
        [sys.executable, str(script)], capture_output=True, text=True, timeout=120.0, check=False
    )
    assert run.returncode == 1
    last = run.stderr.strip().splitlines()[-1]
    assert "the script lacks the main guard" in last


@pytest.mark.parametrize("call", [stability, sweep_to_store, make_report])
def test_what_starts_workers_says_that_a_script_needs_its_guard(call):
    assert 'if __name__ == "__main__":' in call.__doc__


@pytest.fixture(scope="module")
def profile():
    edges_mm = np.linspace(0.0, 8.0, 401)
    energy = np.diff(0.5 * gaussian_cdf(edges_mm[:, None], np.array([1.0])), axis=0)
    return make_profile(edges_mm, energy)


def test_a_stress_gives_the_same_bits_with_workers(profile):
    subject = Subject("gaussian", profile, 0.25)
    ways = [Way("pre", "preintegrated", {}), Way("svd 2", "svd", {"rank": 2})]
    profiles = [imports._saturated(subject, each) for each in (0.01, 0.1)]
    alone = subject.changes(ways, [profiles], np.inf)[0]
    with Workers(2, Subject("gaussian", profile, 0.25)) as workers:
        shared = Subject("gaussian", profile, 0.25, workers=workers).changes(
            ways, [profiles], np.inf
        )[0]
    np.testing.assert_array_equal(alone, shared)
    assert (np.diff(np.array(alone), axis=1) > 0.0).all()
