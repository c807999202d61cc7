"""A Dask cluster as the place where tasks are done: one that runs, or workers of this machine.

Tasks are the same as without a cluster, and results are added by this process in the same order.
Dask gives the task of a lost worker to another one; a lost scheduler ends the sweep in order.
"""

import contextlib
import logging
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from contextlib import ExitStack
from types import TracebackType
from typing import Any, Self, TypeVar

from sssfit import __version__
from sssfit.errors import ArgumentError, SweepError
from sssfit.messages import printable, shown
from sssfit.process import check_memory, check_open_files
from sssfit.simulate.batches import (
    BATCH_PHOTONS,
    Tally,
    Walk,
    code_version,
    steps_per_photon,
    trace_each,
)
from sssfit.sweep.local_workers import local_workers
from sssfit.sweep.needed import needed
from sssfit.sweep.plan import Plan
from sssfit.sweep.tasks import Done, Task, check_code, perform

_Found = TypeVar("_Found")

_CONNECT_SECONDS = 10.0
_WORKERS_SECONDS = 30.0
_MOST_LOCAL = 256
_FILES = 50
# Dask's loggers with a level of their own, which it sets as it is imported; and whose it uses.
_DASKS = ("distributed", "distributed.client", "distributed.gc")
_OTHERS = ("tornado", "tornado.application", "asyncio")
_AHEAD = 3  # ranges of a walk for each worker
_RANGE_STEPS, _MESSAGE_BYTES = 5e8, 8_000_000


class Connection:
    """The workers of a Dask scheduler, and a context at whose end those of local:N have ended.

    Parameters
    ----------
    scheduler : str
        Its address, tcp://HOST:PORT, or local:N, which starts a scheduler and N workers.

    Raises
    ------
    ArgumentError
        ``scheduler`` is neither.
    """

    def __init__(self, scheduler: str) -> None:
        self._address = scheduler
        self._count = local_count(scheduler)
        self._stack = ExitStack()
        self.workers = 1

    def __enter__(self) -> Self:
        check_memory("cluster", None)
        check_open_files(_FILES + 8 * self._count)
        distributed = needed("distributed", "cluster")
        with self._stack, _quiet(*_OTHERS):
            self._stack.enter_context(_quiet(*_DASKS))
            address: Any = self._address
            if self._count:
                address = self._stack.enter_context(local_workers(self._count))
            self._client = self._connected(distributed, address)
            self._stack.callback(self._close)
            self.workers = self._check_workers()
            self._stack = self._stack.pop_all()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        with _quiet(*_OTHERS):
            self._stack.close()

    def call(self, work: Callable[..., _Found], *given: Any) -> "Future[_Found]":
        """Send a call to the scheduler."""
        result: Future[_Found] = Future()
        asked = self._client.submit(work, *given, pure=False)
        asked.add_done_callback(lambda ended: _hand_over(ended, result))
        return result

    def check(self) -> None:
        """Raise SweepError if the connection to the scheduler is lost."""
        if self._client.status != "running":
            raise SweepError(f"the scheduler at {self._address} was lost.")

    def _connected(self, distributed: Any, address: Any) -> Any:
        try:
            return distributed.Client(
                address, timeout=_CONNECT_SECONDS, set_as_default=False, direct_to_workers=False
            )
        except (OSError, ValueError, TimeoutError) as error:
            raise SweepError(
                f"there is no Dask scheduler at {printable(self._address)} "
                f"({type(error).__name__}); start one with the command dask scheduler, or check "
                "the address."
            ) from None

    def _check_workers(self) -> int:
        """Return the number of threads of all workers, whose code has to be ours."""
        try:
            self._client.wait_for_workers(1, timeout=_WORKERS_SECONDS)
            found = self._client.run(code_version)
        except TimeoutError:
            raise SweepError(
                f"the scheduler at {self._address} has no workers; start some with "
                f"the command dask worker {self._address}."
            ) from None
        except Exception as error:  # another version raises anything when it is asked
            raise SweepError(
                f"a worker of {self._address} has no such sssfit ({type(error).__name__}); install "
                f"sssfit {__version__} there."
            ) from None
        for worker, code in found.items():
            if code != code_version():
                raise SweepError(
                    f"the worker {worker} has sssfit {shown(code)}, and this is "
                    f"{code_version()!r}; install the same version on all machines."
                )
        return sum(self._client.nthreads().values())

    def _close(self) -> None:
        with contextlib.suppress(Exception):
            self._client.close(timeout=2.0)


class Cluster(Connection):
    """A cluster as the pool of a sweep."""

    def __init__(self, plan: Plan, scheduler: str) -> None:
        super().__init__(scheduler)
        self._plan = plan

    def submit(self, task: Task) -> "Future[list[Done]]":
        """Send a task to the scheduler."""
        return self.call(perform, self._plan, task)


class Batches(Connection):
    """A cluster that traces the batches of one walk: ``elsewhere`` of `simulate_montecarlo_many`.

    The tallies of all batches come back one by one, since the walk without a cluster adds them so.
    """

    @property
    def ahead(self) -> int:
        """Number of ranges to ask for before the first is there."""
        return _AHEAD * self.workers

    def size(self, task: Walk) -> int:
        """Return the batches of a range: a second of work, or as many as a message may carry."""
        steps = BATCH_PHOTONS * sum(map(steps_per_photon, task.materials))
        held: int = sum(each.nbytes for each in task.empty_tally().ledger)
        return max(1, min(int(_RANGE_STEPS / steps), _MESSAGE_BYTES // held))

    def submit(self, task: Walk, first: int, last: int) -> "Future[Sequence[Tally]]":
        """Ask for the tallies of the batches from ``first`` to before ``last``."""
        return self.call(_traced, code_version(), task, first, last)


def _traced(code: str, walk: Walk, first: int, last: int) -> Sequence[Tally]:
    """Trace batches on a worker, whose code has to be that of who asks."""
    check_code(code)
    return trace_each(walk, first, last)


def local_count(scheduler: str) -> int:
    """Return N of local:N, and 0 for an address.

    Raises
    ------
    ArgumentError
        It is neither.
    """
    kind, _, rest = scheduler.partition(":")
    if kind == "local" and rest.isdecimal() and 1 <= int(rest[:9]) <= _MOST_LOCAL:
        return int(rest)
    if kind in ("tcp", "tls", "ucx", "ws", "wss") and rest.startswith("//") and len(rest) > 2:
        return 0
    raise ArgumentError(
        f"scheduler = {shown(scheduler)}; expected an address, tcp://HOST:PORT, or local:N for N "
        f"workers of this machine, at most {_MOST_LOCAL}."
    )


def _hand_over(ended: Any, result: "Future[Any]") -> None:
    """Give a result of Dask's to a future of Python's own; called in a thread of the client.

    A result is lost again if its worker is killed before it is fetched. Dask has it computed
    again, for which ``result`` waits.
    """
    if not result.set_running_or_notify_cancel():
        return
    if ended.status in ("finished", "lost", "pending"):
        try:
            result.set_result(ended.result())
        except Exception as error:
            result.set_exception(
                SweepError(f"a result, or the scheduler, was lost ({type(error).__name__})")
            )
    elif ended.status == "error":
        failed = ended.exception()
        is_ours = isinstance(failed, SweepError)
        text = printable(str(failed))
        result.set_exception(
            failed if is_ours else SweepError(f"a task failed ({type(failed).__name__}: {text})")
        )
    else:
        result.set_exception(SweepError("the scheduler gave up a task, or was lost"))


@contextlib.contextmanager
def _quiet(*names: str) -> Iterator[None]:
    """Keep what is logged of lost workers and connections out of stderr; what matters is raised."""
    before = {name: logging.getLogger(name).level for name in names}
    for name in names:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for name, level in before.items():
            logging.getLogger(name).setLevel(level)
