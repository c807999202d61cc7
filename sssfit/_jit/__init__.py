"""The compiled layer: one jit policy for every function, and the cache of its machine code.

This module sets the flags once. ``nogil`` lets Python threads run batches in parallel;
``error_model="numpy"`` removes the zero-division branch that prevents LLVM from vectorising;
``fastmath`` stays off, so that the same seed gives the same bits on every machine.

numba's own cache does not notice an edit to a helper in *another* file and would run stale code.
The cache folder is therefore keyed by the version and by a hash of every source file of this
folder. Without a writable folder (read-only home, or none) functions are compiled in each process:
slower to start, otherwise the same.

Every file of the cache begins with a checksum of the rest. numba loads any bytes it finds: of 14
flipped bits in machine code 4 crashed every later run and one silently gave a different profile.
"""

import contextlib
import hashlib
import os
import pickle
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Literal, TypeVar

import numba
from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.core.registry import cpu_target
from numba.core.runtime.nrt import rtsys

from sssfit import __version__
from sssfit.process import user_cache_folder

Function = TypeVar("Function", bound=Callable[..., object])

_SUM_BYTES = 32  # of SHA-256


def source_key() -> str:
    """Return version and a hash of the compiled layer's sources, which key the cache."""
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.name.encode())
        digest.update(path.read_bytes())
    return f"{__version__}-{digest.hexdigest()[:16]}"


def _writable_cache_folder() -> str:
    """Return the keyed cache folder, or an empty string if it cannot be created and written."""
    try:
        folder = user_cache_folder() / source_key()
        folder.mkdir(parents=True, exist_ok=True)
        probe = folder / f".probe-{os.getpid()}"
        probe.touch()
        probe.unlink()
    except (OSError, RuntimeError):  # RuntimeError: no home folder can be determined
        return ""
    return str(folder)


_CACHE_FOLDER = _writable_cache_folder()


def compiled_before(file: str, function: str = "trace_batch") -> bool:
    """Return whether the cache has machine code for that file's function from these sources."""
    pattern = f"{file}.{function}-*.nbc"
    return bool(_CACHE_FOLDER) and any(Path(_CACHE_FOLDER).rglob(pattern))


def thread_pool(
    threads: int, name: str = "sssfit", first: Callable[[], object] | None = None
) -> ThreadPoolExecutor:
    """Return threads for compiled functions, after numba's lazy imports.

    Otherwise the first call would do 0.3 s of imports on several threads at once, where an
    interrupt or a MemoryError in one of them can leave the others waiting for its locks forever.
    A ``first`` call, of a function of `jit_entry` that is in the cache, does without them.
    """
    if first is not None:
        first()
        return ThreadPoolExecutor(threads, thread_name_prefix=name)
    from numba.core import boxing  # noqa: F401
    from numba.core.runtime import context as runtime  # noqa: F401

    for context in (cpu_target.typing_context, cpu_target.target_context):
        context.refresh()
    return ThreadPoolExecutor(threads, thread_name_prefix=name)


def jit(function: Function) -> Function:
    """Compile ``function`` on first call with the common policy; ``.py_func`` is its slow twin."""
    return _compile(function, inline="never")


def jit_entry(function: Function) -> Function:
    """Like ``jit``, for what a run calls from Python, if it compiles to arithmetic alone.

    The cache gives its machine code without numba's tables of all that it could compile, which take
    0.4 s of the processor (and import scipy), so it may need no symbols but those of numba's
    reference counts and of the mathematics library.
    """
    return _compile(function, inline="never", is_entry=True)


def jit_inline(function: Function) -> Function:
    """Like ``jit``, but inlined into compiled callers before array references are counted.

    A plain call counts references on every array it passes; for the handling of single photons this
    doubled the time of a walk (skin1: 527 ns per photon with calls, 264 ns inlined).
    """
    return _compile(function, inline="always")


def jit_merged(function: Function) -> Function:
    """Like ``jit``, but LLVM inlines it into its callers, loops and all, as they are optimised.

    For loops over a few elements, where the call itself would take as long as the loop.
    """
    return _compile(function, inline="never", forceinline=True)


class _DamagedError(Exception):
    """A file of the cache has changed since it was written."""


class _CheckedFiles(IndexDataCacheFile):
    """numba's index and data files, each preceded by the SHA-256 of its content.

    The checksum is verified before anything is unpickled; the 290 kB of a walk take 0.2 ms.
    """

    def _load_index(self) -> dict[object, str]:
        try:
            stamp, overloads = pickle.loads(_checked(Path(self._index_path).read_bytes()))
        except FileNotFoundError:
            return {}
        return dict(overloads) if stamp == self._stamp() else {}

    def _save_index(self, overloads: dict[object, str]) -> None:
        self._write(self._index_path, (self._stamp(), overloads))

    def _load_data(self, name: str) -> object:
        content = Path(self._data_path(name)).read_bytes()  # type: ignore[no-untyped-call]
        return pickle.loads(_checked(content))

    def _save_data(self, name: str, data: object) -> None:
        self._write(self._data_path(name), data)  # type: ignore[no-untyped-call]

    def _stamp(self) -> tuple[str, object]:
        return self._version, self._source_stamp

    def _write(self, path: str, content: object) -> None:
        data = self._dump(content)  # type: ignore[no-untyped-call]
        with self._open_for_write(path) as file:
            file.write(hashlib.sha256(data).digest() + data)


def _checked(content: bytes) -> bytes:
    """Return the content after the checksum, or raise if it has changed since it was written."""
    said, data = content[:_SUM_BYTES], content[_SUM_BYTES:]
    if hashlib.sha256(data).digest() != said:
        raise _DamagedError
    return data


class _ForgivingCache(FunctionCache):
    """numba's cache on disk, in which every error counts as a miss.

    Otherwise a full disk or quota, or a truncated or damaged file, would stop every later run.
    """

    def __init__(self, function: object, *, is_entry: bool) -> None:
        self.is_entry = is_entry
        super().__init__(function)  # type: ignore[no-untyped-call]
        self._cache_file = _CheckedFiles(  # type: ignore[no-untyped-call]
            cache_path=self._cache_path,
            filename_base=self._impl.filename_base,
            source_stamp=self._impl.locator.get_source_stamp(),
        )

    def load_overload(self, sig: object, target_context: object) -> object:
        try:
            if self.is_entry:
                rtsys.initialize(target_context)
                return self._load_overload(sig, target_context)  # type: ignore[no-untyped-call]
            return super().load_overload(sig, target_context)  # type: ignore[no-untyped-call]
        except Exception:  # _DamagedError, OSError, or the errors of other versions of numba
            self._forget()
            return None

    def save_overload(self, sig: object, data: object) -> None:
        try:
            super().save_overload(sig, data)  # type: ignore[no-untyped-call]
        except Exception:
            self._forget()

    def _forget(self) -> None:
        with contextlib.suppress(Exception):
            self.flush()  # type: ignore[no-untyped-call]


def _compile(
    function: Function,
    *,
    inline: Literal["never", "always"],
    forceinline: bool = False,
    is_entry: bool = False,
) -> Function:
    """Decorate with a cache in our keyed folder.

    numba reads the folder from a global setting when a cache is created; it is set during the call
    and restored, so that the setting of a host program stays.
    """
    compiled: Function = numba.njit(
        function, nogil=True, error_model="numpy", inline=inline, forceinline=forceinline
    )
    if _CACHE_FOLDER:
        before = numba.config.CACHE_DIR  # type: ignore[attr-defined]
        numba.config.CACHE_DIR = _CACHE_FOLDER  # type: ignore[attr-defined]
        try:
            compiled._cache = _ForgivingCache(function, is_entry=is_entry)  # type: ignore[attr-defined]
        finally:
            numba.config.CACHE_DIR = before  # type: ignore[attr-defined]
    return compiled
