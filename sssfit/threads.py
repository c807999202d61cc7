"""Number of threads, limited by the machine."""

import operator
import os

from sssfit.errors import RenderError


def available_cores() -> int:
    """Cores this process may use (containers and ``taskset`` grant fewer than there are)."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def thread_count(threads: int | None) -> int:
    """Return the number of threads to use: all cores there are where none is named."""
    if threads is None:
        return available_cores()
    try:
        count = operator.index(threads)
    except TypeError:
        count = 0
    if count < 1:
        raise RenderError(f"threads = {threads!r}; expected a whole number from 1 up.")
    return count
