"""What a verb reads: files by name, the newest here, stdin."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, TypeVar

from ._options import Common
from ._output import say

if TYPE_CHECKING:
    from sssfit.kernel import SeparableKernel
    from sssfit.kinds import Loaded
    from sssfit.profile import Profile

_Record = TypeVar("_Record", "Profile", "SeparableKernel")


def newest(common: Common, pattern: str, made_by: str) -> str:
    """Return the newest file of the current folder that matches, saying on stderr which."""
    from sssfit.errors import FileError

    found = [path for path in Path().glob(pattern) if path.is_file()]
    if not found:
        raise FileError(
            f"there is no {pattern} in this folder: name one, or make one with `{made_by}`."
        )
    path = max(found, key=lambda each: each.stat().st_mtime_ns)
    say(common, f"Using {path}, the newest {pattern} here.")
    return str(path)


def profile_name(given: str | None, common: Common) -> str:
    """Return the profile that was named, by default the newest of this folder."""
    return given or newest(common, "*.profile.npz", "sssfit simulate skin1")


def kernel_name(given: str | None, common: Common) -> str:
    """Return the kernel that was named, by default the newest of this folder."""
    return given or newest(common, "*.kernel.json", "sssfit fit --method svd --rank 3")


def is_mci(name: str | None) -> bool:
    """Whether a name given for a material means an MCML input file."""
    return name is not None and name.lower().endswith(".mci")


def load(kind: type[_Record], name: str) -> _Record:
    """Read a profile or a kernel; ``-`` is stdin."""
    return kind.read(binary_stdin(), "stdin") if name == "-" else kind.load(name)


def load_any(name: str) -> Loaded:
    """Read a file of any kind, or a material that ships with sssfit; ``-`` is stdin."""
    from sssfit.kinds import load

    return load(binary_stdin(), "stdin") if name == "-" else load(name)


def binary_stdin() -> BinaryIO:
    """Return stdin for bytes, or say in one line that it is closed."""
    from sssfit.errors import FileError

    if sys.stdin is None:
        raise FileError("stdin is closed; name a file instead of -.")
    return sys.stdin.buffer
