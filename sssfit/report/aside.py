"""Work beside the fits: a second process, since fits and compiling hold Python's global lock.

With everything yet to be compiled a page takes 90 s of one core: a second process does the half
that does not depend on the rest. What it notes or warns of is told when its result is asked for,
so that a page has the same lines in the same order with and without it.
"""

import logging
import warnings
from collections.abc import Callable
from functools import partial
from types import TracebackType
from typing import Any, TypeVar

from sssfit.errors import SssfitWarning
from sssfit.messages import note
from sssfit.process import thread_count
from sssfit.report.kept import LOG, heard
from sssfit.stability.workers import Workers

_Found = TypeVar("_Found")


class Aside:
    """A process that takes calls one after another; a context, at whose end it ends.

    Parameters
    ----------
    threads : int, optional
        With one there is no such process: a call is then made when its result is asked for.
    """

    def __init__(self, threads: int | None) -> None:
        self._workers = Workers(1, None) if thread_count(threads) > 1 else None
        self._begun: list[Callable[[], object]] = []
        if self._workers is not None:
            self._workers.begin(_ready, None)  # its imports take 2 s

    def __enter__(self) -> "Aside":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._workers is not None:
            self._workers.__exit__(kind, error, trace)

    def begin(self, work: Callable[[], _Found]) -> Callable[[], _Found]:
        """Begin a call, and return a function that returns what it returns.

        Parameters
        ----------
        work : callable
            A partial of a module's function: it is pickled.

        Raises
        ------
        SssfitError
            By the function that is returned: the process ended. What the work itself raises is
            raised there, too.
        """
        if self._workers is None:
            return work
        found = self._workers.begin(_told, work)
        self._begun.append(found)
        return partial(_taken, found)

    def wait(self) -> None:
        """Wait until all that was begun is done, so that nothing disturbs a timing."""
        for each in self._begun:
            try:
                each()
            except Exception:  # is raised where the result is asked for
                continue


def _ready(_shared: None, _given: None) -> None:
    """Do nothing: to be called, this module was imported with all that it imports."""


def _told(_shared: None, work: Callable[[], _Found]) -> tuple[_Found, list[str], list[str]]:
    """Return what work returns, with what it notes and what it warns of."""
    logging.getLogger(LOG).setLevel(logging.INFO)
    with heard() as told, warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        found = work()
    ours = [str(each.message) for each in warned if each.category is SssfitWarning]
    return found, told.lines, ours


def _taken(found: Callable[[], tuple[Any, list[str], list[str]]]) -> Any:
    """Wait for a result and tell what was told there."""
    made, notes, warned = found()
    for line in notes:
        note(line)
    for line in warned:
        warnings.warn(line, SssfitWarning, stacklevel=3)
    return made
