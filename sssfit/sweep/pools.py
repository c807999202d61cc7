"""Where tasks are done: in this process, or by worker processes of this machine.

A pool hands out `concurrent.futures.Future` objects, as the one of a Dask cluster does
(``cluster``), so that `sssfit.sweep.runner` knows no difference.
"""

from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager
from types import TracebackType
from typing import Protocol, Self

from sssfit.errors import SweepError
from sssfit.process import check_open_files, thread_count
from sssfit.stability.workers import Workers
from sssfit.sweep.plan import Plan
from sssfit.sweep.tasks import Done, Task, perform, prepare

_FILES = 20  # Zarr's loop and a chunk, and what is imported meanwhile
LOST = (
    "a worker process ended before its work was done: it was killed, memory ran out, or the script "
    "lacks the main guard that multiprocessing needs"
)


class Pool(AbstractContextManager["Pool"], Protocol):
    """Interface of a pool, a context at whose end its own processes have ended."""

    workers: int

    def submit(self, task: Task) -> "Future[list[Done]]":
        """Begin a task, or keep it until a worker is free."""

    def check(self) -> None:
        """Raise SweepError if the workers are lost and no result will come."""


class ThisProcess:
    """A pool of one worker, which is this process."""

    workers = 1

    def __init__(self, plan: Plan) -> None:
        self._plan = plan

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def submit(self, task: Task) -> "Future[list[Done]]":
        """Do a task at once."""
        done: Future[list[Done]] = Future()
        try:
            done.set_result(perform(self._plan, task))
        except Exception as error:
            done.set_exception(error)
        return done

    def check(self) -> None:
        """Do nothing: nothing can be lost."""


class Processes:
    """Worker processes of this machine, each on one thread."""

    def __init__(self, plan: Plan, workers: int) -> None:
        self._pool = Workers(workers, plan)
        self.workers = workers

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._pool.__exit__(kind, error, trace)

    def submit(self, task: Task) -> "Future[list[Done]]":
        """Send a task to the next free process."""
        try:
            return self._pool.submit(perform, task)
        except BrokenProcessPool:
            raise SweepError(f"{LOST}.") from None

    def check(self) -> None:
        """Raise SweepError where processes, or what tells of their end, ended without a word."""
        try:
            self._pool.check()
        except BrokenProcessPool:
            raise SweepError(f"{LOST}.") from None


def pool_for(plan: Plan, threads: int | None, scheduler: str | None) -> Pool:
    """Return the pool that is asked for: a Dask cluster, this process or some of this machine."""
    if scheduler is not None:
        from sssfit.sweep.cluster import Cluster  # which needs the extra of that name

        return Cluster(plan, scheduler)
    workers = min(thread_count(threads), plan.count if plan.photons is None else 1024)
    if workers == 1:
        check_open_files(_FILES)
        return ThisProcess(plan)
    prepare(plan)
    return Processes(plan, workers)
