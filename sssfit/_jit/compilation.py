"""numba's compilation with the common policy, and its machine code kept in files that are checked.

Every file of the cache begins with a checksum of the rest. numba loads any bytes it finds: of 14
flipped bits in machine code 4 crashed every later run and one silently gave a different profile.
"""

import contextlib
import ctypes
import pickle
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Literal, TypeVar

import llvmlite.binding as llvm
import numba
from numba import types
from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.core.errors import NumbaWarning
from numba.core.registry import cpu_target

from sssfit._jit.machine_code import (
    SYMBOL,
    processor_features,
    sealed,
    target_machine,
    unsealed,
)

Function = TypeVar("Function", bound=Callable[..., object])

# numba reads it when it first compiles in a process, and is what makes vectors of loops.
if numba.config.CPU_FEATURES is None:  # type: ignore[attr-defined]
    numba.config.CPU_FEATURES = processor_features()  # type: ignore[attr-defined]

_NUMBERS = {
    ctypes.c_int64: types.int64,
    ctypes.c_uint64: types.uint64,
    ctypes.c_double: types.float64,
}


def compiled(
    function: Function,
    folder: str,
    *,
    inline: Literal["never", "always"],
    forceinline: bool = False,
) -> Function:
    """Decorate with the common policy, and with a cache in a folder; "" is without one.

    numba reads the folder from a global setting when a cache is created; it is set during the call
    and restored, so that the setting of a host program stays.
    """
    found: Function = numba.njit(
        function, nogil=True, error_model="numpy", inline=inline, forceinline=forceinline
    )
    if folder:
        before = numba.config.CACHE_DIR  # type: ignore[attr-defined]
        numba.config.CACHE_DIR = folder  # type: ignore[attr-defined]
        try:
            found._cache = _ForgivingCache(function)  # type: ignore[attr-defined]
        finally:
            numba.config.CACHE_DIR = before  # type: ignore[attr-defined]
    return found


def object_code(function: Callable[..., int], arguments: Sequence[Any]) -> tuple[bytes, str]:
    """Compile a function of numbers and addresses as C would call it.

    Returns its object code, and the features for which numba compiles in this process: other ones
    than ours if the host program used numba before.

    numba's C functions report exceptions through Python. Here every other function is made internal
    and the whole is optimised once more: LLVM then sees that nothing can fail, and what would ask
    for Python goes. Half spaces are then walked up to twice as fast as by numba's own call.

    Raises
    ------
    TypeError
        The function can fail, or allocates memory: its code would still need Python.
    """
    signature = types.int64(*(_NUMBERS.get(each, types.voidptr) for each in arguments))
    with warnings.catch_warnings():
        # With some settings numba does not keep what it compiles on the way, and says so of each.
        warnings.simplefilter("ignore", NumbaWarning)
        found = numba.cfunc(signature, error_model="numpy")(function)
    module = llvm.parse_assembly(found.inspect_llvm())
    for each in (*module.functions, *module.global_variables):
        if not each.is_declaration and each.name != found.native_name:
            each.linkage = "internal"
    features: str = cpu_target.target_context.codegen().magic_tuple()[2]
    machine = target_machine(features)
    builder = llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options(speed_level=3))
    builder.getModulePassManager().run(module, builder)
    needed = [each.name for each in module.functions if each.is_declaration]
    if pythons := [each for each in needed if each.startswith(("Py", "NRT_", "numba_"))]:
        raise TypeError(f"{function.__module__}: compiled code needs {', '.join(pythons)}.")
    module.get_function(found.native_name).name = SYMBOL
    return machine.emit_object(module), features


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
            file.write(sealed(data))


def _checked(content: bytes) -> bytes:
    """Return the content after the checksum, or raise if it has changed since it was written."""
    if (data := unsealed(content)) is None:
        raise _DamagedError
    return data


class _ForgivingCache(FunctionCache):
    """numba's cache on disk, in which every error counts as a miss.

    Otherwise a full disk or quota, or a truncated or damaged file, would stop every later run.
    """

    def __init__(self, function: object) -> None:
        super().__init__(function)  # type: ignore[no-untyped-call]
        self._cache_file = _CheckedFiles(  # type: ignore[no-untyped-call]
            cache_path=self._cache_path,
            filename_base=self._impl.filename_base,
            source_stamp=self._impl.locator.get_source_stamp(),
        )

    def load_overload(self, sig: object, target_context: object) -> object:
        try:
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
