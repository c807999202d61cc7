"""Threads: batches side by side, and compiled code that lets other Python threads run.

Told by what happens while something else is under way, never by how long it takes.
"""

import contextlib
import ctypes
import gc
import math
import sys
import threading
import time
from types import SimpleNamespace

import checks
import numpy as np
import pytest
from numba.core.registry import cpu_target

from sssfit import process
from sssfit._jit import thread_pool
from sssfit.grid import RadialGrid
from sssfit.material import Layer, Material
from sssfit.process import one_blas_thread
from sssfit.simulate import montecarlo, simulate_montecarlo
from sssfit.simulate._walks import BATCH_PHOTONS
from sssfit.simulate.walk_half_space import SemiInfiniteWalk
from sssfit.simulate.walk_layered import LayeredWalk

HALF_SPACE = checks.medium(0.1, 0.9, 1.3)
SLAB = Material("slab", ("c",), (Layer(1.3, [0.8], [0.01], [20.0], 5.0),))
WALKS = {"half space": (SemiInfiniteWalk, HALF_SPACE), "slab": (LayeredWalk, SLAB)}

walks = pytest.mark.parametrize(("kind", "material"), WALKS.values(), ids=WALKS)


def settings(photons, threads):
    return {"photons": photons, "threads": threads, "dr_mm": 0.1, "radius_mm": 5.0}


@walks
@pytest.mark.parametrize("threads", [2, None])
def test_two_batches_are_in_flight_at_once(monkeypatch, kind, material, threads):
    # either waits for the other before it begins: one thread alone would wait in vain
    real, meeting = kind.trace, threading.Barrier(2)

    def trace(task, batch):
        if task.photons:  # a walk of none only loads the code
            meeting.wait(timeout=30.0)
        return real(task, batch)

    monkeypatch.setattr(kind, "trace", trace)
    monkeypatch.setattr(montecarlo, "available_cores", lambda: 2)
    profile = simulate_montecarlo(material, **settings(4 * BATCH_PHOTONS, threads))
    assert profile.photons == 4 * BATCH_PHOTONS


def test_one_thread_walks_one_batch_at_a_time(monkeypatch):
    real, walking, most = SemiInfiniteWalk.trace, set(), []

    def trace(task, batch):
        if not task.photons:  # which only loads the code
            return real(task, batch)
        walking.add(batch)
        most.append(len(walking))
        tally = real(task, batch)
        walking.remove(batch)
        return tally

    monkeypatch.setattr(SemiInfiniteWalk, "trace", trace)
    simulate_montecarlo(HALF_SPACE, **settings(4 * BATCH_PHOTONS, 1))
    assert most == [1, 1, 1, 1]


@contextlib.contextmanager
def no_forced_switches():
    """Let a Python thread keep the interpreter until it gives it up."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1000.0)
    try:
        yield
    finally:
        sys.setswitchinterval(before)


def runs_beside(work):
    """Whether this thread got to run between the beginning and the end of ``work`` on another."""
    begun, ended = threading.Event(), threading.Event()

    def worker():
        begun.set()
        work()
        ended.set()

    with no_forced_switches():
        thread = threading.Thread(target=worker)
        thread.start()
        begun.wait()
        beside = not ended.is_set()
        thread.join()
    return beside


@walks
def test_a_compiled_batch_lets_other_threads_run(kind, material):
    task = kind((material,), (RadialGrid(0.1, 50),), 1, BATCH_PHOTONS)
    task.trace(0)  # compiles
    # Ten tries, since the machine may be busy elsewhere for as long as a batch takes; holding the
    # interpreter would keep this thread out every time.
    assert any(runs_beside(lambda: task.trace(0)) for _ in range(10))


def test_the_yardstick_notices_work_that_holds_the_interpreter():
    values = list(np.linspace(0.0, 1.0, 100_000))
    assert not any(runs_beside(lambda: math.fsum(values)) for _ in range(10))


def test_all_linear_algebra_is_held_to_one_thread():
    import scipy.linalg  # noqa: F401 (brings a BLAS of its own)
    from threadpoolctl import threadpool_info, threadpool_limits

    def threads():
        return [each["num_threads"] for each in threadpool_info() if each["user_api"] == "blas"]

    with threadpool_limits(limits=2, user_api="blas"):  # the tests themselves have one
        before = threads()
        assert set(before) == {2}
        with one_blas_thread():
            assert set(threads()) == {1}
        assert threads() == before
    assert len(before) >= 2


def test_the_host_gets_its_threads_back_when_the_last_of_several_has_ended():
    from threadpoolctl import threadpool_info, threadpool_limits

    def threads():
        return {each["num_threads"] for each in threadpool_info() if each["user_api"] == "blas"}

    def hold(inside, leave):
        with one_blas_thread():
            inside.set()
            leave.wait(60.0)

    with threadpool_limits(limits=2, user_api="blas"):
        events = [(threading.Event(), threading.Event()) for _ in range(2)]
        holding = [threading.Thread(target=hold, args=each) for each in events]
        for thread, (inside, _) in zip(holding, events, strict=True):
            thread.start()
            assert inside.wait(60.0)
        for thread, (_, leave) in zip(holding, events, strict=True):  # the first to come goes first
            assert threads() == {1}
            leave.set()
            thread.join()
        assert threads() == {2}


@pytest.mark.parametrize(("own", "calls"), [(None, 2), ("MALLOC_TRIM_THRESHOLD_", 0)])
def test_freed_memory_stays_unless_the_environment_says_otherwise(monkeypatch, own, calls):
    for each in process._MALLOC:
        monkeypatch.delenv(each, raising=False)
    if own:
        monkeypatch.setenv(own, "131072")
    asked = []
    library = SimpleNamespace(mallopt=lambda *given: asked.append(given))
    monkeypatch.setattr(ctypes, "CDLL", lambda _: library)
    monkeypatch.setattr(sys, "platform", "linux")
    process.keep_memory()
    assert len(asked) == calls


def test_garbage_is_looked_for_seldom():
    first, *_ = gc.get_threshold()
    gc.set_threshold(700)
    try:
        process.keep_memory()
        assert gc.get_threshold()[0] > 700
    finally:
        gc.set_threshold(first, 10, 10)


def test_another_c_library_is_left_alone(monkeypatch):
    for each in process._MALLOC:
        monkeypatch.delenv(each, raising=False)
    opened = []
    monkeypatch.setattr(ctypes, "CDLL", lambda _: opened.append(1) or SimpleNamespace())
    monkeypatch.setattr(sys, "platform", "linux")
    process.keep_memory()
    assert opened


def test_two_callers_take_turns_where_numba_does_not(monkeypatch):
    """Rendering from two threads left numba without types: refreshing goes through a generator."""
    inside, most = [], []

    def refresh(real):
        def refreshed():
            inside.append(threading.get_ident())
            most.append(len(set(inside)))
            time.sleep(0.02)  # lets the other thread run
            real()
            inside.pop()

        return refreshed

    for context in (cpu_target.typing_context, cpu_target.target_context):
        monkeypatch.setattr(context, "refresh", refresh(context.refresh))
    pools = []
    callers = [threading.Thread(target=lambda: pools.append(thread_pool(1))) for _ in range(3)]
    for each in callers:
        each.start()
    for each in callers:
        each.join()
    for each in pools:
        each.shutdown()
    assert len(pools) == 3
    assert set(most) == {1}
