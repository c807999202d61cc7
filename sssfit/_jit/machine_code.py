"""Compiled functions that are loaded from a file by LLVM alone and called through ctypes.

numba compiles such a function once, to a C function of numbers and addresses, whose object code is
kept beside numba's own cache and keyed like it. Later processes link it in 2 ms and never import
numba, which takes 0.2 to 0.35 s of the processor: more than the rest of a small run.

Without a writable folder each process compiles for itself. A damaged file is a miss: every file
begins with a checksum of the rest, which is verified before LLVM sees a byte of it.
"""

import contextlib
import ctypes
import hashlib
import os
import threading
from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit._jit import cache_folder, numbas_settings
from sssfit.process import check_that_numba_compiles, nothing_to_save, unfit_settings

_SUM_BYTES = 32  # of SHA-256
SYMBOL = "enter"


class Array:
    """The type, for ctypes, of a contiguous array of a kind of number and a rank.

    It checks as `numpy.ctypeslib.ndpointer` does in a quarter of the time, .5 us for 2 us: with 22
    arrays a batch, short walks through layers took up to a sixth longer with numpy's.
    """

    def __init__(self, kind: npt.DTypeLike, rank: int = 1) -> None:
        self._kind, self._rank = np.dtype(kind), rank

    def from_param(self, array: npt.NDArray[Any]) -> Any:
        """Return the address that ctypes passes; TypeError if it is another kind of array."""
        if array.dtype != self._kind or array.ndim != self._rank:
            raise TypeError(f"expected an array of {self._kind} and rank {self._rank}.")
        try:
            return ctypes.byref(ctypes.c_char.from_buffer(array))  # type: ignore[arg-type]
        except (TypeError, ValueError):  # read-only or empty, or not contiguous
            if not array.flags.c_contiguous:
                raise
            return array.ctypes


class Entry:
    """The function ``enter`` of a module of this folder; returns a whole number.

    ``arguments`` are the types that ctypes converts to: numbers of 64 bits, or an `Array` each.
    """

    def __init__(self, module: str, arguments: Sequence[Any]) -> None:
        self._module, self._arguments = module, tuple(arguments)
        self._lock = threading.Lock()
        self._function: Callable[..., int] | None = None
        self._engine: Any = None  # owns the code

    def __call__(self, *arguments: Any) -> int:
        """Call the function without Python's global lock."""
        function = self._function or self.load()
        return function(*arguments)

    def is_ready(self) -> bool:
        """Return whether the machine code is loaded or kept, and need not be compiled.

        Raises
        ------
        SssfitError
            It would have to be compiled, and numba is told not to.
        """
        if self._function is not None or self._read() is not None:
            return True
        check_that_numba_compiles()
        return False

    def load(self) -> Callable[..., int]:
        """Link the kept machine code, or else compile and keep it; once in a process."""
        with self._lock:
            if self._function is None:
                address = self._link(self._read() or self._compile())
                self._function = ctypes.CFUNCTYPE(ctypes.c_int64, *self._arguments)(address)
        return self._function

    def _link(self, code: bytes) -> int:
        """Return the address of the function."""
        import llvmlite.binding as llvm

        self._engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), target_machine())
        self._engine.add_object_file(llvm.ObjectFileRef.from_data(code))
        self._engine.finalize_object()
        address: int = self._engine.get_function_address(SYMBOL)
        return address

    def _compile(self) -> bytes:
        """Return the object code, compiled by numba, and keep it where that is possible."""
        check_that_numba_compiles()
        from sssfit._jit.compilation import object_code

        function = import_module(f"sssfit._jit.{self._module}").enter
        try:
            with nothing_to_save():
                code, features = object_code(function, self._arguments)
        except TypeError as error:
            if not (settings := numbas_settings()):
                raise
            raise unfit_settings(settings) from error
        path = None if numbas_settings() else self.path(features)
        if path is not None:
            temporary = path.with_suffix(f".{os.getpid()}")
            with contextlib.suppress(OSError):
                try:
                    temporary.write_bytes(sealed(code))
                    temporary.replace(path)
                finally:
                    temporary.unlink(missing_ok=True)
        return code

    def _read(self) -> bytes | None:
        """Return the kept object code; None if there is none, or if its file has changed.

        Code with the widest vectors is preferred to that of a host program's numba.
        """
        for features in (processor_features(), own_features()):
            path = self.path(features)
            with contextlib.suppress(OSError):
                if path and (code := unsealed(path.read_bytes())) is not None:
                    return code
        return None

    def path(self, features: str | None = None) -> Path | None:
        """Return the file of the code for a processor, by default all of this one's features."""
        folder, has = cache_folder(), processor_features() if features is None else features
        return Path(folder) / f"{self._module}-{_machine_key(has)}.o" if folder else None


def sealed(content: bytes) -> bytes:
    """Return bytes with their SHA-256 before them."""
    return hashlib.sha256(content).digest() + content


def unsealed(content: bytes) -> bytes | None:
    """Return the bytes after their checksum; None if they have changed since it was written."""
    said, data = content[:_SUM_BYTES], content[_SUM_BYTES:]
    return data if hashlib.sha256(data).digest() == said else None


def _processor_name() -> str:
    """Return the processor's name, or that for which numba is told to compile."""
    import llvmlite.binding as llvm

    return os.environ.get("NUMBA_CPU_NAME") or str(llvm.get_host_cpu_name())


def processor_features() -> str:
    """Return the features to compile for: numba's setting, or all that the processor has.

    LLVM makes vectors of 256 bits for Intel's processors with AVX-512, because the first ones ran
    slower with wider ones. On a Xeon of 2023 vectors of 512 bits make long walks through layers
    1.4 times as fast, and short ones up to a tenth slower.
    """
    found = _host_features()
    if found.get("avx512f"):
        found["prefer-256-bit"] = False
    chosen = _chosen_features()
    return str(found.flatten()) if chosen is None else chosen


def own_features() -> str:
    """Return the features for which numba compiles by itself: its setting, or the processor's."""
    chosen = _chosen_features()
    return str(_host_features().flatten()) if chosen is None else chosen


def _chosen_features() -> str | None:
    """Return numba's setting; an empty one is the baseline of the processor's family."""
    return os.environ.get("NUMBA_CPU_FEATURES")


def _host_features() -> Any:
    """Return the processor's features, none where LLVM does not know them, as numba does."""
    import llvmlite.binding as llvm
    from llvmlite.binding.targets import FeatureMap

    try:
        return llvm.get_host_cpu_features()
    except RuntimeError:
        return FeatureMap()


def _machine_key(features: str) -> str:
    """Return a hash of what object code depends on beside the sources."""
    import llvmlite
    import llvmlite.binding as llvm

    parts = (llvm.get_process_triple(), _processor_name(), features, llvmlite.__version__)
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:16]


def target_machine(features: str | None = None) -> Any:
    """Return a new code generator for this processor, with numba's options; an engine owns its."""
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    return llvm.Target.from_triple(llvm.get_process_triple()).create_target_machine(
        cpu=_processor_name(),
        features=processor_features() if features is None else features,
        opt=3,
        reloc="static" if llvm.Target.from_default_triple().name.startswith("x86") else "default",
        codemodel="jitdefault",
        jit=True,
    )
