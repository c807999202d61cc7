"""What a process is given: too little memory, or nonsense, is said before anything is loaded.

Under such a limit (``ulimit -v``, a batch system's) compiled libraries do not raise MemoryError: at
400 MB scipy's BLAS tried for ever to get its buffers, at 520 MB the process ended in a segmentation
fault. So the limit is compared with what a verb's libraries and threads take, as measured.
"""

from __future__ import annotations

import errno
import os
import sys

import click

if sys.platform != "win32":
    import resource

# Address space [MB] of a small run with one thread, some 10 % more than was seen.
_NEEDED_MB = {
    "simulate": 620,
    "fit": 650,
    "picture fit": 980,
    "render": 800,
    "compare": 1080,
    "choose": 880,
    "chart": 570,
    "kernel chart": 710,
    "show": 460,
    "figures": 680,  # of chart --models, --spectrum and --guide
    "inversion": 700,
}
_OTHER_MB = 280
# Of a thread: its stack, and what the C library sets aside for it. Without threads of our own a
# core has BLAS's buffers.
_THREAD_MB, _CORE_MB = 75, 6
_THREADED = {"simulate", "picture fit", "render", "compare", "choose", "figures"}

_NO_MORE = ("allocate memory", "can't start new thread", "failed to map segment")


def check_memory(what: str, threads: int | None) -> None:
    """Refuse, in one line, a verb that needs more memory than the process may use.

    Raises
    ------
    click.ClickException
        The limit is too low; exit status 1.
    """
    if sys.platform == "win32":
        return
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit == resource.RLIM_INFINITY:
        return
    from sssfit.threads import available_cores

    cores = available_cores()
    needed = _NEEDED_MB.get(what, _OTHER_MB) + _CORE_MB * cores
    hint = ""
    if what in _THREADED:
        needed += _THREAD_MB * (threads or cores)
        hint = ", or give fewer --threads" if (threads or cores) > 1 else ""
    if limit < needed * 10**6:
        raise click.ClickException(
            f"this process may use {limit / 1e6:.0f} MB of memory (ulimit -v), and this takes "
            f"about {needed} MB; raise the limit{hint}."
        )


def check_threads_of_numba() -> None:
    """Refuse, in one line, a number of threads that numba would not be imported with.

    Raises
    ------
    click.ClickException
        NUMBA_NUM_THREADS is no whole number above 0.
    """
    given = os.environ.get("NUMBA_NUM_THREADS")
    if given is not None and not (given.strip().isdecimal() and int(given)):
        raise click.ClickException(
            f"NUMBA_NUM_THREADS = {given!r}; set it to a whole number from 1 up, or unset it."
        )


def is_out_of_memory(error: BaseException | None) -> bool:
    """Tell whether an error comes from a lack of memory, under any library's name for it."""
    while error is not None:
        if isinstance(error, MemoryError) or getattr(error, "errno", None) == errno.ENOMEM:
            return True
        if any(words in str(error).lower() for words in _NO_MORE):
            return True
        error = error.__cause__ or error.__context__
    return False
