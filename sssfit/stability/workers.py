"""Worker processes: fits are Python code for most of their time, so threads gain 5 % on two cores.

Processes are spawned: forked ones would take along locks that numba's and BLAS's threads may hold
at that moment. A worker ends as soon as the caller's end of a pipe is closed, by the caller or by
its death, so none is left behind; Ctrl-C reaches the caller alone, also while a worker imports.
"""

import contextlib
import multiprocessing
import os
import pickle
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures import wait as wait_for
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.connection import Connection, wait
from multiprocessing.resource_tracker import ensure_running
from multiprocessing.shared_memory import SharedMemory
from types import TracebackType
from typing import Any, TypeVar, cast

from sssfit.errors import SssfitError
from sssfit.process import check_open_files, one_blas_thread

_Given = TypeVar("_Given")
_Found = TypeVar("_Found")

_MOST = 16  # workers; each takes 0.3 GB
_FILES = 30  # open at a time, of the pool, of what is read, written or imported meanwhile
_LOST = (
    "a worker process ended before its work was done: it was killed, memory ran out, or the "
    "script lacks the main guard that multiprocessing needs; `threads = 1` takes no worker."
)

_LOOKS_SECONDS = 0.2
_TOLD_SECONDS = 5.0  # after a worker's end the pool's thread tells of it at once, if at all

_shared: Any = None


class Workers:
    """Processes that share an object and take calls on it; a context, at whose end they end.

    Parameters
    ----------
    count : int
        Number of processes, which start at the first call.
    shared : object
        The first argument of every call. Each process has a copy, so what is cached on it stays.
    """

    def __init__(self, count: int, shared: object) -> None:
        check_open_files(_FILES + 2 * min(count, _MOST))
        context = multiprocessing.get_context("spawn")
        _start_tracker()
        self._theirs, self._ours = context.Pipe(duplex=False)
        # In shared memory, not among the arguments: a pipe holds 64 kB, and to write more waits for
        # a reader, forever if the process dies while it starts, as without a main guard.
        data = pickle.dumps(shared)
        self._kept = SharedMemory(create=True, size=len(data))
        cast(memoryview, self._kept.buf)[: len(data)] = data  # None only after it is closed
        given = self._theirs, self._kept.name
        self._ended_at: float | None = None
        try:
            self._pool = ProcessPoolExecutor(min(count, _MOST), context, _begin, given)
        except BaseException:
            self._close()
            raise

    def __enter__(self) -> "Workers":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if error is not None:
            self._ours.close()  # which ends them in the midst of their work
            self._end_queues()
        try:
            self._pool.shutdown(cancel_futures=True)
        finally:
            self._close()

    def _end_queues(self) -> None:
        """Close this process's own end of what results come through, and leave calls unsent.

        A worker may end in the midst of a result. The pool's thread waits for the rest of it, and
        `shutdown` for that thread: for ever, as long as anybody could still write. Python at its
        end waits for a call that no worker takes. It has no public way to say that nobody will.
        """
        writer = getattr(getattr(self._pool, "_result_queue", None), "_writer", None)
        if writer is not None:
            writer.close()
        calls = getattr(self._pool, "_call_queue", None)
        if calls is not None:
            calls.cancel_join_thread()

    def _close(self) -> None:
        """Close the pipe, and give the shared memory back."""
        self._ours.close()
        self._theirs.close()
        self._kept.close()
        self._kept.unlink()

    def submit(self, work: Callable[[Any, _Given], _Found], given: _Given) -> "Future[_Found]":
        """Return the future of work(shared, given); its exception is BrokenProcessPool if lost."""
        with _deaf():
            return self._pool.submit(_call, (work, given))

    def each(self, work: Callable[[Any, _Given], _Found], given: Iterable[_Given]) -> list[_Found]:
        """Return work(shared, each) for all that is given, in its order.

        Parameters
        ----------
        work : callable
            A function of a module, or a partial of one: it is pickled.
        given : iterable

        Raises
        ------
        SssfitError
            A process ended. What the work itself raises is raised here.
        """
        begun: list[Future[_Found]] = []
        try:
            begun.extend(self.submit(work, each) for each in given)
            return [self.result(each) for each in begun]
        except BrokenProcessPool:
            raise SssfitError(_LOST) from None
        finally:
            for future in begun:
                future.cancel()

    def begin(self, work: Callable[[Any, _Given], _Found], given: _Given) -> Callable[[], _Found]:
        """Begin work(shared, given); return a function that waits for what it returns.

        Raises
        ------
        SssfitError
            By the function that is returned, as `each`.
        """
        future = self.submit(work, given)

        def result() -> Any:
            try:
                return self.result(future)
            except BrokenProcessPool:
                raise SssfitError(_LOST) from None

        return result

    def result(self, future: "Future[_Found]") -> _Found:
        """Wait for what `submit` began; raise BrokenProcessPool if no result will come."""
        while not wait_for([future], _LOOKS_SECONDS).done:
            self.check()
        return future.result()

    def check(self) -> None:
        """Raise BrokenProcessPool if workers or the pool's thread have ended without a word.

        Python tells of a worker that ended in that thread. It ends itself where memory is short,
        and waits for ever for the rest of a result whose worker was killed as it wrote it.
        """
        thread = getattr(self._pool, "_executor_manager_thread", None)
        if thread is not None and not thread.is_alive():
            raise BrokenProcessPool
        processes = getattr(self._pool, "_processes", None) or {}
        if not wait([each.sentinel for each in [*processes.values()]], 0.0):
            self._ended_at = None
        elif self._ended_at is None:
            self._ended_at = time.monotonic()
        elif time.monotonic() - self._ended_at > _TOLD_SECONDS:
            raise BrokenProcessPool


def _start_tracker() -> None:
    """Start Python's process that removes what others leave, without a word about it.

    A caller that is killed, or that ends at once while it imports, leaves semaphores.
    """
    if sys.platform != "win32":
        sys.warnoptions.append("ignore:resource_tracker:UserWarning")
        try:
            with _deaf():
                ensure_running()
        finally:
            sys.warnoptions.pop()


@contextlib.contextmanager
def _deaf() -> Iterator[None]:
    """Start processes that hear neither Ctrl-C nor a terminal that closes.

    Those go to all processes of the terminal, and the caller ends the others in order.
    """
    if sys.platform == "win32":
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGHUP})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin(theirs: Connection, name: str) -> None:
    """Make this process a worker; what all share is in the memory of this name."""
    global _shared  # the pool hands nothing else from the initializer to the calls
    kept = SharedMemory(name)
    _shared = pickle.loads(cast(memoryview, kept.buf))
    kept.close()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if sys.platform != "win32":
        signal.signal(signal.SIGHUP, signal.SIG_IGN)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT, signal.SIGHUP})
    threading.Thread(target=_end_with_caller, args=(theirs,), daemon=True).start()
    warnings.simplefilter("ignore")  # as in the caller: what fits warn of is what a stress finds
    one_blas_thread().__enter__()


def _end_with_caller(theirs: Connection) -> None:
    """Wait until the other end of the pipe is closed; nothing is ever sent."""
    try:
        theirs.poll(None)
    finally:
        os._exit(1)


def _call(given: tuple[Callable[[Any, _Given], _Found], _Given]) -> _Found:
    work, each = given
    return work(_shared, each)
