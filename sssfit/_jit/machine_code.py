"""Compiled functions that are loaded from a file by LLVM alone and called through ctypes.

numba compiles such a function once, to a C function of numbers and addresses, whose object code is
kept beside numba's own cache and keyed like it. Later processes link it in 2 ms and never import
numba, which takes 0.2 to 0.35 s of the processor: more than the rest of a small run.

Without a writable folder each process compiles for itself. A damaged file is a miss: every file
begins with a checksum of the rest, which is verified before LLVM sees a byte of it.
"""

import contextlib
import ctypes
import functools
import hashlib
import os
import threading
from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from sssfit._jit import cache_folder
from sssfit.process import check_that_numba_compiles

_SUM_BYTES = 32  # of SHA-256
SYMBOL = "enter"


class Entry:
    """The function ``enter`` of a module of this folder; returns a whole number.

    ``arguments`` are the types that ctypes converts to: numbers of 64 bits, or arrays as
    `numpy.ctypeslib.ndpointer` describes and checks them.
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
        """Return whether the machine code is loaded or kept, and need not be compiled."""
        return self._function is not None or self._read() is not None

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
        code = object_code(function, self._arguments)
        if path := self.path():
            temporary = path.with_suffix(f".{os.getpid()}")
            with contextlib.suppress(OSError):
                try:
                    temporary.write_bytes(hashlib.sha256(code).digest() + code)
                    temporary.replace(path)
                finally:
                    temporary.unlink(missing_ok=True)
        return code

    def _read(self) -> bytes | None:
        """Return the kept object code; None if there is none, or if its file has changed."""
        if not (path := self.path()):
            return None
        try:
            content = path.read_bytes()
        except OSError:
            return None
        said, code = content[:_SUM_BYTES], content[_SUM_BYTES:]
        return code if hashlib.sha256(code).digest() == said else None

    def path(self) -> Path | None:
        """Return the file of the code for this processor, in the folder of these sources."""
        folder = cache_folder()
        return Path(folder) / f"{self._module}-{_machine_key()}.o" if folder else None


def _processor() -> tuple[str, str]:
    """Return the processor's name and features, or those for which numba is told to compile."""
    import llvmlite.binding as llvm

    return os.environ.get("NUMBA_CPU_NAME") or llvm.get_host_cpu_name(), processor_features()


def processor_features() -> str:
    """Return the features to compile for: numba's setting, or all that the processor has.

    LLVM makes vectors of 256 bits for Intel's processors with AVX-512, because the first ones ran
    slower with wider ones. On a Xeon of 2023 vectors of 512 bits walk through layers 1.1 to 1.35
    times as fast.
    """
    import llvmlite.binding as llvm

    if (chosen := os.environ.get("NUMBA_CPU_FEATURES")) is not None:
        return chosen
    try:
        found = llvm.get_host_cpu_features()
    except RuntimeError:  # not known for this kind of processor; numba does the same
        return ""
    if found.get("avx512f"):
        found["prefer-256-bit"] = False
    features: str = found.flatten()
    return features


@functools.cache
def _machine_key() -> str:
    """Return a hash of what object code depends on beside the sources."""
    import llvmlite
    import llvmlite.binding as llvm

    parts = (llvm.get_process_triple(), *_processor(), llvmlite.__version__)
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:16]


def target_machine() -> Any:
    """Return a new code generator for this processor, with numba's options; an engine owns its."""
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    name, features = _processor()
    return llvm.Target.from_triple(llvm.get_process_triple()).create_target_machine(
        cpu=name,
        features=features,
        opt=3,
        reloc="static" if llvm.Target.from_default_triple().name.startswith("x86") else "default",
        codemodel="jitdefault",
        jit=True,
    )
