"""What holds for all tests: Ctrl-C arrives, no child process is left, and none runs for ever.

Half of the tests start from the exact profile of some material and a quarter from the lit head, so
each of these is computed once a run (``shared_work``), as are fits of the same profile.

Linear algebra has one thread in the tests' own process: a worker a core leaves no core for BLAS's
threads, and waiting for each other they took a tenth of the processor time. Children of the tests
have as many as a user's process.

Each worker has a core, and so have its children: where a worker and another's threads took turns
on a core, waiting for Python's lock cost a twentieth of the processor time.

Freed memory stays with the process and garbage is looked for seldom, as on the command line. What
collecting the tests made is not looked through again and again: that took a third of the
collection.

Files of the tests are not flushed to the disk: they need not survive a power failure, and waiting
for thousands of flushes took as long as a sixtieth of the tests.

Figures that are approved or documented are those of one kind of processor (``processor``).

Tests and the commands that they start keep their bytecode, whatever the caller's environment says:
to compile our sources again took a tenth of each command, and assertions half of the collection.
Each worker begins to collect at another file, so that the others find that bytecode: in step, all
compiled all of it.
"""

import atexit
import gc
import os
import signal
import sys

import processor  # isort: skip  # noqa: F401 (before numpy)
import fork_server
import pytest
import scipy.linalg  # noqa: F401 (its BLAS has to be there to be limited)
import shared_work
from processes import end_all
from threadpoolctl import threadpool_limits

import sssfit._jit.compilation  # noqa: F401 (before numba compiles what is the tests' own)
from sssfit.process import keep_memory

SLOW_SECONDS = 4 * 3600.0  # the longest, a walk of 1e8 photons through layers, takes under one

os.environ["PYTHONDONTWRITEBYTECODE"] = ""
sys.dont_write_bytecode = False

# A shell starts its background jobs with SIGINT ignored, and children inherit that: tests of Ctrl-C
# would wait for ever.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_sessionstart():
    """Share work between tests from here on, and leave each worker its core."""
    if _worker():
        atexit.register(os._exit, 0)  # what is registered from here on runs before it
    shared_work.begin()
    keep_to_a_core()
    threadpool_limits(limits=1, user_api="blas")
    keep_memory()
    os.fsync = _leave_to_the_system


def _leave_to_the_system(handle):
    """Flush nothing."""


def keep_to_a_core():
    """Leave this worker one of the cores, if there is one for each."""
    if not (worker := _worker()) or not hasattr(os, "sched_setaffinity"):
        return
    cores = sorted(os.sched_getaffinity(0))
    if worker[1] <= len(cores):
        os.sched_setaffinity(0, {cores[worker[0]]})


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item):
    """Share nothing in the tests of that work itself."""
    shared_work.allow(item.path.stem)


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector):
    """Begin a folder at the file that is this worker's; the tests are put in order below."""
    report = yield
    if isinstance(collector, pytest.Dir) and report.passed and (worker := _worker()):
        first = worker[0] * len(report.result) // worker[1]
        report.result = report.result[first:] + report.result[:first]
    return report


def _worker():
    """The number of this worker and how many there are, if xdist runs."""
    name = os.environ.get("PYTEST_XDIST_WORKER")
    return name and (int(name.removeprefix("gw")), int(os.environ["PYTEST_XDIST_WORKER_COUNT"]))


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Give slow tests a limit of their own; ``timeout`` in pyproject.toml holds for the rest."""
    if _worker():
        items.sort(key=lambda item: item.path.parts)  # stable: the workers have to agree
    for item in items:
        if item.get_closest_marker("slow") and not item.get_closest_marker("timeout"):
            item.add_marker(pytest.mark.timeout(SLOW_SECONDS))


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Look for garbage after the collection only, among what the tests make."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


def pytest_sessionfinish():
    """Let everything be collected at the end: OpenImageIO complains of what is left over.

    A worker looks once through what its tests made, where pytest does five times, and does not take
    down all that is loaded, which took the run another 5 s.
    """
    fork_server.close()
    if _worker():
        gc.collect()
        gc.freeze()
    else:
        gc.unfreeze()


@pytest.fixture(scope="session", autouse=True)
def _shared_between_workers(tmp_path_factory):
    """What one worker has solved, lit or fitted is read by the other; see ``shared_work``."""
    own = tmp_path_factory.getbasetemp()
    folder = (own.parent if "PYTEST_XDIST_WORKER" in os.environ else own) / "shared-work"
    folder.mkdir(exist_ok=True)
    shared_work.keep_in(folder)


@pytest.fixture(autouse=True)
def no_child_outlives_its_test():
    """End what the test started and, having failed perhaps, did not end."""
    yield
    end_all()
