"""The compiled layer: one jit policy for every function, and the cache of its machine code.

This module sets the flags once. ``nogil`` lets Python threads run batches in parallel;
``error_model="numpy"`` removes the zero-division branch that prevents LLVM from vectorising;
``fastmath`` stays off, so that the same seed gives the same bits on every machine.

numba's own cache does not notice an edit to a helper in *another* file and would run stale code.
The cache folder is therefore keyed by the version and by a hash of every source file of this
folder. Without a writable folder (read-only home, or none) functions are compiled in each process:
slower to start, otherwise the same.

numba itself, 0.2 to 0.35 s, is imported with the first compiled function (``compilation``): much
of what asks for a thread pool or for the cache's key runs none, and the photon walks, the matrices
of the exact solver and the integrals of kernels are loaded without it (``machine_code``).
"""

import functools
import hashlib
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, TypeVar

from sssfit import __version__
from sssfit.process import user_cache_folder

Function = TypeVar("Function", bound=Callable[..., object])
Address = Any  # in C's functions: of an array's first element


@functools.cache  # each walk records it: of 1000 photons, reading the sources took a third
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
# Settings of numba that leave the code as it is, or of which its key takes account: where code is
# kept, how it is run and for which processor it is. Any other may change the code itself.
_HARMLESS = {
    *("NUMBA_CACHE_DIR", "NUMBA_CPU_FEATURES", "NUMBA_CPU_NAME", "NUMBA_DISABLE_JIT"),
    *("NUMBA_NUM_THREADS", "NUMBA_THREADING_LAYER"),
}


def cache_folder() -> str:
    """Return the folder of machine code from these sources; "" where none can be written."""
    return _CACHE_FOLDER


def numbas_settings() -> list[str]:
    """Return the settings of numba by which code may come out different, as NAME=value."""
    given = {name: value for name, value in os.environ.items() if name.startswith("NUMBA_")}
    return sorted(f"{name}={value}" for name, value in given.items() if name not in _HARMLESS)


def thread_pool(
    threads: int, name: str = "sssfit", first: Callable[[], object] | None = None
) -> ThreadPoolExecutor:
    """Return threads for compiled functions, after numba's lazy imports.

    Otherwise the first call would do 0.3 s of imports on several threads at once, where an
    interrupt or a MemoryError in one of them can leave the others waiting for its locks forever.
    A ``first`` call, which loads machine code that needs no numba (``machine_code``), does without
    them. Two of the caller's threads take turns: numba's contexts are refreshed by generators, and
    a second caller in the midst of them left types unknown for the rest of the process.
    """
    if first is not None:
        first()
        return ThreadPoolExecutor(threads, thread_name_prefix=name)
    from numba.core import boxing  # noqa: F401
    from numba.core.compiler_lock import global_compiler_lock
    from numba.core.registry import cpu_target
    from numba.core.runtime import context as runtime  # noqa: F401

    with global_compiler_lock:
        for context in (cpu_target.typing_context, cpu_target.target_context):
            context.refresh()
    return ThreadPoolExecutor(threads, thread_name_prefix=name)


def jit(function: Function) -> Function:
    """Compile ``function`` on first call with the common policy; ``.py_func`` is its slow twin."""
    return _compile(function, inline="never")


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


def _compile(function: Function, **policy: Any) -> Function:
    """Compile by `compilation.compiled`, with machine code in our folder.

    With bounds checks, say, it has a folder of its own: numba would give code with checks to
    functions without.
    """
    from sssfit._jit.compilation import compiled

    folder, settings = _CACHE_FOLDER, numbas_settings()
    if folder and settings:
        folder += "-" + hashlib.sha256("\n".join(settings).encode()).hexdigest()[:8]
    return compiled(function, folder, **policy)
