"""What a verb reads: files by name, the newest here, stdin."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, TypeVar

from sssfit.messages import note
from sssfit.methods import DEON_SKIN

if TYPE_CHECKING:
    from sssfit.kernel import Kernel
    from sssfit.material import Material
    from sssfit.profile import Profile


_Record = TypeVar("_Record")


def newest(made_by: str, *patterns: str) -> str:
    """Return the newest file of the current folder that matches, saying on stderr which."""
    from sssfit.errors import FileError

    found = [path for each in patterns for path in Path().glob(each) if path.is_file()]
    what = " or ".join(patterns)
    if not found:
        raise FileError(
            f"there is no {what} in this folder: name one, or make one with `{made_by}`."
        )
    path = max(found, key=lambda each: each.stat().st_mtime_ns)
    note(f"Using {path}, the newest {what} here.")
    return str(path)


def profile_name(given: str | None) -> str:
    """Return the profile that was named, by default the newest in this folder."""
    return newest("sssfit simulate skin1", "*.profile.npz") if given is None else given


def kernel_name(given: str | None) -> str:
    """Return the kernel that was named, by default the newest in this folder."""
    return newest("sssfit fit", "*.taps.json", "*.kernel.json") if given is None else given


def profile_of_kernel(
    kernel: Kernel, name: str, given: str | None
) -> tuple[Profile | None, str | None]:
    """Return a kernel's profile and its file: the one given, else the one it was fitted to.

    It is looked for beside the kernel and in the current folder.
    """
    from sssfit.kernel.origin import find_profile
    from sssfit.profile import Profile

    if given is None:
        folders = {Path(), Path() if name == "-" else Path(name).parent}
        return find_profile(kernel, name, folders)
    asked = Profile.load(given)
    if kernel.meta.get("profile_sha256") not in (None, asked.sha256):
        note(f"{given} is not the profile that {name} was fitted to.")
    return asked, given


def load(read: Callable[..., _Record], name: str) -> _Record:
    """Read a record from a file; ``-`` is stdin."""
    return read(binary_stdin(), "stdin") if name == "-" else read(name)


def load_source(name: str) -> Material | Profile:
    """Read a profile, ``-`` for stdin, or load a material."""
    from sssfit.material import load_material
    from sssfit.profile import Profile

    if name == DEON_SKIN:
        from sssfit.simulate import simulate_deon_skin

        return simulate_deon_skin()
    return load(Profile.read, name) if name == "-" or name.endswith(".npz") else load_material(name)


def binary_stdin() -> BinaryIO:
    """Return stdin for bytes, or say in one line that it is closed."""
    from sssfit.errors import FileError

    if sys.stdin is None:
        raise FileError("stdin is closed; name a file instead of -.")
    return sys.stdin.buffer
