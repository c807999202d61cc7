"""Batches that are traced by other processes or machines, and come back in order."""

from collections import deque
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Future
from typing import Protocol

from sssfit.simulate._walks import BATCH_PHOTONS, Tally, Walk

_LOOKS_SECONDS = 0.5  # between two looks at whether the other machines are still there


class Elsewhere(Protocol):
    """Interface of what traces batches in other processes or on other machines."""

    @property
    def ahead(self) -> int:
        """Number of ranges that are to be asked for before the first is there."""

    def submit(self, task: Walk, first: int, last: int) -> "Future[Sequence[Tally]]":
        """Ask for the tallies of the batches from ``first`` to before ``last``, one by one."""

    def size(self, task: Walk) -> int:
        """Return the number of batches to ask for at a time."""

    def check(self) -> None:
        """Raise an error if no more tallies will come."""


def from_elsewhere(
    task: Walk, elsewhere: Elsewhere, stop: Callable[[], bool] | None, photons_done: int
) -> Generator[Tally]:
    """Yield the tallies of the remaining batches in order, while ranges of them are computed."""
    size, end = elsewhere.size(task), -(-task.photons // BATCH_PHOTONS)
    firsts = iter(range(photons_done // BATCH_PHOTONS, end, size))
    pending: deque[Future[Sequence[Tally]]] = deque()
    stopped = False
    try:
        while True:
            stopped = stopped or (stop is not None and stop())
            while not stopped and len(pending) < elsewhere.ahead:
                first = next(firsts, None)
                if first is None:
                    break
                pending.append(elsewhere.submit(task, first, min(first + size, end)))
            if not pending:
                return
            try:
                tallies = pending[0].result(timeout=_LOOKS_SECONDS)
            except TimeoutError:
                elsewhere.check()
                continue
            pending.popleft()
            yield from tallies
    finally:
        for each in pending:
            each.cancel()
