"""The process: its cores and threads, the memory it may use, its caches, its signals.

Memory: under a limit (``ulimit -v``, a batch system's) compiled libraries do not raise MemoryError.
At 400 MB scipy's BLAS tried forever to get its buffers, at 520 MB the process ended in a
segmentation fault. So the limit is compared with the measured needs of libraries and threads.

Signals: the first requests an orderly end, the second ends the program at once. The first raises
KeyboardInterrupt in the main thread, or is recorded if the work so far can be saved
(`asked_to_stop`). A terminal that closes sends SIGHUP more than once, by its shell and again as the
shell ends: the later ones count for nothing, or they would end what saves the work. Python code
receives a signal only between two of its instructions, and the main thread may be inside compiled
code for minutes. So a thread that waits at the pipe of Python's C handler handles the second
signal; it removes temporary files and locks and ends the process with
130. If even that thread cannot run, because compiled code holds Python's global lock, the kernel
ends the process: with glibc a signal's handler works for one signal until the thread renews it
(System V semantics).

Nothing heavy is imported here, because a program installs its signal handlers first.
"""

import contextlib
import errno
import functools
import gc
import operator
import os
import select
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from types import FrameType, TracebackType
from typing import Any, NoReturn

from sssfit.errors import RenderError, SssfitError
from sssfit.messages import shown

if sys.platform != "win32":
    import resource


# Threads


def available_cores() -> int:
    """Return the cores this process may use, which containers and ``taskset`` may limit."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def thread_count(threads: int | None) -> int:
    """Return the number of threads to use: by default all cores."""
    if threads is None:
        return available_cores()
    try:
        count = operator.index(threads)
    except TypeError:
        count = 0
    if count < 1:
        raise RenderError(f"threads = {shown(threads)}; expected a whole number from 1 up.")
    return count


def one_blas_thread() -> contextlib.AbstractContextManager[Any]:
    """Return a context in which numpy's and scipy's linear algebra use one thread.

    BLAS waits for its threads: up to ten times longer if another process holds a core. The number
    is one of the whole process: the first of several contexts, also of several threads, sets it,
    and the last to end puts back what was there.
    """
    return _one_blas_thread


class _OneBlasThread:
    """A context that may be entered again before its end, by any thread."""

    def __init__(self) -> None:
        self._lock, self._inside = threading.Lock(), 0
        self._before: dict[str, tuple[Any, int]] = {}

    def __enter__(self) -> None:
        with self._lock:
            for each in _blas("scipy.linalg._fblas" in sys.modules):
                # Of what was loaded since the first came in, this is the first that is seen.
                self._before.setdefault(each.filepath, (each, each.get_num_threads()))
                _set_threads(each, 1)
            self._inside += 1

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._inside -= 1
            if self._inside == 0:
                for library, count in self._before.values():
                    _set_threads(library, count)
                self._before.clear()


def _set_threads(library: Any, count: int) -> None:
    """Set the threads of a BLAS library, whichever thread asks.

    From 3.8 on threadpoolctl ignores all threads but the one that set the number first.
    """
    getattr(library, "_real_set_num_threads", library.set_num_threads)(count)


_one_blas_thread = _OneBlasThread()


@functools.cache
def _blas(_scipys: bool) -> Any:
    """Return the loaded BLAS libraries; scipy has its own. Looking for them takes 3 ms."""
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController().select(user_api="blas").lib_controllers


# Memory

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
    "figures": 680,  # of models, spectra and guide functions
    "inversion": 700,
    "sweep": 880,
    "cluster": 1300,  # the client, its threads, and the scheduler of workers of this machine
}
_OTHER_MB = 280
# Of a thread: its stack, and what the C library sets aside for it. Without threads of our own a
# core has BLAS's buffers.
_THREAD_MB, _CORE_MB = 75, 6
_THREADED = {"simulate", "picture fit", "render", "compare", "choose", "figures"}

_NO_MORE = ("allocate memory", "can't start new thread", "failed to map segment")
_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD = -1, -3  # of GNU's malloc.h
_MALLOC = ("GLIBC_TUNABLES", "MALLOC_MMAP_THRESHOLD_", "MALLOC_TRIM_THRESHOLD_")
_KEPT_BYTES, _MAPPED_BYTES = 1 << 27, 1 << 25  # the second is the most that glibc allows
_NEW_OBJECTS = 50_000


def keep_memory() -> None:
    """Let freed memory stay with the process for its next arrays, where the C library is GNU's.

    By itself it soon gives memory back, and the system clears the pages when they are wanted again:
    a sixth of the time of a cascade's fit. What the environment says of it stays.

    Garbage is looked for after 50 000 new objects, not 700 as Python does by itself: a twentieth of
    the time of a comparison and of compiling, for no more memory.
    """
    gc.set_threshold(_NEW_OBJECTS, 10, 10)
    if sys.platform != "linux" or any(name in os.environ for name in _MALLOC):
        return
    import ctypes

    if mallopt := getattr(ctypes.CDLL(None), "mallopt", None):
        mallopt(_M_TRIM_THRESHOLD, _KEPT_BYTES)
        mallopt(_M_MMAP_THRESHOLD, _MAPPED_BYTES)


def check_memory(what: str, threads: int | None) -> None:
    """Raise an error for work that needs more memory than allowed; ``what`` is a key of the table.

    Raises
    ------
    SssfitError
        The limit is too low.
    """
    if sys.platform == "win32":
        return
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit == resource.RLIM_INFINITY:
        return
    cores = available_cores()
    needed = _NEEDED_MB.get(what, _OTHER_MB) + _CORE_MB * cores
    hint = ""
    if what in _THREADED:
        needed += _THREAD_MB * (threads or cores)
        hint = ", or give fewer `threads`" if (threads or cores) > 1 else ""
    if limit < needed * 10**6:
        raise SssfitError(
            f"this process may use {limit / 1e6:.0f} MB of memory (ulimit -v), and this takes "
            f"about {needed} MB; raise the limit{hint}."
        )


def check_open_files(count: int) -> None:
    """Raise an error where this process may not open so many files more.

    Short of them, libraries leave half of their own behind, or wait for workers that cannot start.

    Raises
    ------
    SssfitError
        The limit is too low.
    """
    if sys.platform == "win32":
        return
    opened: list[int] = []
    try:
        for _ in range(count):
            opened += [os.open(os.devnull, os.O_RDONLY)]
    except OSError:
        limit, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
        raise SssfitError(
            f"this process may have {limit} files open (ulimit -n), and this takes {count} besides "
            "those that are; raise the limit."
        ) from None
    finally:
        for each in opened:
            os.close(each)


def check_threads_of_numba() -> None:
    """Raise an error for a number of threads with which numba cannot be imported.

    Raises
    ------
    SssfitError
        NUMBA_NUM_THREADS is not a whole number above 0.
    """
    given = os.environ.get("NUMBA_NUM_THREADS")
    if given is not None and not (given.strip().isdecimal() and int(given)):
        raise SssfitError(
            f"NUMBA_NUM_THREADS = {shown(given)}; set it to a whole number from 1 up, or unset it."
        )


def check_that_numba_compiles() -> None:
    """Raise an error if numba is told to leave Python functions as they are.

    Raises
    ------
    SssfitError
        NUMBA_DISABLE_JIT is set.
    """
    if os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"):
        raise SssfitError(
            "NUMBA_DISABLE_JIT is set, and only machine code computes walks and kernels; unset it."
        )


def unfit_settings(settings: Sequence[str]) -> SssfitError:
    """Return the error for settings of numba with which walks and kernels cannot be compiled."""
    return SssfitError(
        f"with {' '.join(settings)} the code of walks and kernels would need Python as it runs; "
        f"unset {'it' if len(settings) == 1 else 'them'} once, and the code is kept for later runs."
    )


def is_out_of_memory(error: BaseException | None) -> bool:
    """Return whether an error means a lack of memory, under any library's name for it."""
    while error is not None:
        if isinstance(error, MemoryError) or getattr(error, "errno", None) == errno.ENOMEM:
            return True
        if any(words in str(error).lower() for words in _NO_MORE):
            return True
        error = error.__cause__ or error.__context__
    return False


# Signals

_SIGNALS = (signal.SIGINT, signal.SIGTERM)
_FIRST = (*_SIGNALS, *([] if sys.platform == "win32" else [signal.SIGHUP]))
_STATUS = 130
_STDERR = 2
_SHOW_CURSOR = b"\x1b[?25h"  # a progress bar hides it

# Whether the first signal has arrived; from then on the listening thread alone acts.
_heard = threading.Event()
_listening = threading.Event()
# Whether the main thread does what need not be finished, such as compiling, and whether a signal
# has been noted by `asked_to_stop`.
_nothing_to_save, _noted = threading.Event(), threading.Event()


class Interrupts:
    """The program's handling of signals, from `take` to `give_back`; one at a time."""

    def __init__(self) -> None:
        self._before: dict[signal.Signals, Any] = {}
        self._hooks = sys.excepthook, sys.unraisablehook
        self._thread_hook = threading.excepthook

    def take(self) -> None:
        """Handle these signals from here on, unless they are ignored (``nohup``, ``&``)."""
        _heard.clear()
        reader, self._writer = os.pipe()
        if sys.platform != "win32":
            os.set_blocking(self._writer, False)
        self._wakeup = signal.set_wakeup_fd(self._writer, warn_on_full_buffer=False)
        for number in _FIRST:
            if signal.getsignal(number) is not signal.SIG_IGN:
                self._before[number] = signal.signal(number, _raise)
        sys.excepthook, sys.unraisablehook = self._uncaught, self._unraisable
        threading.excepthook = self._in_thread
        threading.Thread(target=_listen, args=(reader,), daemon=True).start()
        _listening.set()
        _reset_on_delivery()

    def give_back(self) -> None:
        """Put the former handlers back: the caller goes on."""
        for number, handler in self._before.items():
            signal.signal(number, handler)
        sys.excepthook, sys.unraisablehook = self._hooks
        threading.excepthook = self._thread_hook
        signal.set_wakeup_fd(self._wakeup)
        _listening.clear()
        os.close(self._writer)  # which ends the thread

    def _uncaught(
        self, kind: type[BaseException], error: BaseException, traceback: TracebackType | None
    ) -> None:
        """End without a traceback if nothing catches an interruption."""
        if issubclass(kind, KeyboardInterrupt):
            _end(b"\nInterrupted.\n")
        self._hooks[0](kind, error, traceback)

    def _in_thread(self, failed: threading.ExceptHookArgs) -> None:
        """Leave it to the main thread, which notices and says it in one line, to speak of it."""
        if os.environ.get("SSSFIT_TRACEBACK"):
            self._thread_hook(failed)

    def _unraisable(self, ignored: "sys.UnraisableHookArgs") -> None:
        """End where Python would print an interruption and ignore it, in its own clean-up."""
        if issubclass(ignored.exc_type, KeyboardInterrupt):
            _end(b"\nInterrupted.\n")
        self._hooks[1](ignored)


@contextlib.contextmanager
def asked_to_stop() -> Iterator[Callable[[], bool]]:
    """Yield a function that tells whether SIGINT, SIGTERM or SIGHUP has arrived since.

    After the first signal the former handlers stand again. Under `nothing_to_save` it raises
    KeyboardInterrupt.
    """
    asked = False
    before: dict[signal.Signals, Any] = {}

    def restore() -> None:
        for number, handler in before.items():
            signal.signal(number, handler)

    def note(_signal: int, frame: FrameType | None) -> None:
        nonlocal asked
        asked = True
        _heard.set()
        _noted.set()
        restore()
        if _nothing_to_save.is_set():
            _interrupt(frame)

    for number in _FIRST:
        if signal.getsignal(number) is not signal.SIG_IGN:
            before[number] = signal.signal(number, note)
    if _listening.is_set():
        _reset_on_delivery()
    try:
        yield lambda: asked
    finally:
        _noted.clear()
        restore()


@contextlib.contextmanager
def nothing_to_save() -> Iterator[None]:
    """Let a signal end what takes seconds and leaves nothing behind: ten of compiling a walk."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    _nothing_to_save.set()
    try:
        if _noted.is_set():  # just before
            raise KeyboardInterrupt
        yield
    finally:
        _nothing_to_save.clear()


def _raise(_signal: int, frame: FrameType | None) -> None:
    """Interrupt the main thread; at the second signal the listening thread ends the process."""
    if _heard.is_set():
        return
    _heard.set()
    _interrupt(frame)


def _interrupt(frame: FrameType | None) -> NoReturn:
    """Raise KeyboardInterrupt; end a program of ours where that would not get through.

    In the midst of compiling it leaves half-made objects of LLVM, which complain as they are freed.
    """
    if _listening.is_set() and (_nothing_to_save.is_set() or _is_importing(frame)):
        _end(b"\nInterrupted.\n")
    raise KeyboardInterrupt


def _is_importing(frame: FrameType | None) -> bool:
    """Return whether a module is being imported: compiled ones print or swallow exceptions."""
    while frame is not None:
        if frame.f_code.co_filename.startswith("<frozen importlib"):
            return True
        frame = frame.f_back
    return False


def _listen(reader: int) -> None:
    """Count the signals that arrive; end the process at the second, end at a closed pipe."""
    count = 0
    while arrived := os.read(reader, 64):
        count += sum(number in _SIGNALS for number in arrived)
        if count >= 2:
            _end(b"\nInterrupted twice: ended at once.\n")
        _reset_on_delivery()
    os.close(reader)


def _end(line: bytes) -> NoReturn:
    """End this process at once, without temporary files, locks or a hidden cursor."""
    files = sys.modules.get("sssfit.files")
    if remove := getattr(files, "remove_unfinished", None):
        remove()
    with contextlib.suppress(OSError, ValueError):  # stderr is closed
        # A full pipe that nobody reads is not worth waiting for.
        if sys.platform == "win32" or select.select([], [_STDERR], [], 0.0)[1]:
            os.write(_STDERR, (_SHOW_CURSOR if os.isatty(_STDERR) else b"") + line)
    os._exit(_STATUS)


def _reset_on_delivery() -> None:
    """Let the kernel end the process at the signal after the next, until this is called again."""
    if (found := _system_v()) is None:
        return
    install, handler = found
    for number in _SIGNALS:
        if callable(signal.getsignal(number)):
            install(number, handler)


@functools.cache
def _system_v() -> tuple[Callable[[int, int], int], int] | None:
    """Return glibc's ``sysv_signal`` and Python's own C handler; None with other libraries."""
    if not sys.platform.startswith("linux"):
        return None
    import ctypes

    install = getattr(ctypes.CDLL(None), "sysv_signal", None)
    if install is None:
        return None
    install.argtypes, install.restype = (ctypes.c_int, ctypes.c_void_p), ctypes.c_void_p
    handler = install(signal.SIGTERM, signal.SIG_IGN)  # the same for all signals
    install(signal.SIGTERM, handler)
    return install, handler


def user_cache_folder() -> Path:
    """Return the cache folder: NUMBA_CACHE_DIR if set, else the platform's user cache folder."""
    if chosen := os.environ.get("NUMBA_CACHE_DIR"):
        return Path(chosen)
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA")
        return (Path(base) if base else Path.home() / "AppData" / "Local") / "sssfit" / "cache"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "sssfit"
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "sssfit"
