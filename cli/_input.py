"""What a verb reads: files by name, the newest here, stdin; any kind by what is in the file."""

from __future__ import annotations

import io
import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, TypeAlias, TypeVar

from sssfit.methods import SIMULATIONS

from ._options import Common
from ._output import say, say_notes

if TYPE_CHECKING:
    from sssfit.kernel import SeparableKernel
    from sssfit.material import Material
    from sssfit.profile import Profile
    from sssfit.simulate import SoFar

    Found: TypeAlias = Profile | SeparableKernel | Material | SoFar

DEON_SKIN = SIMULATIONS["gaussians"].makes
_KINDS = (
    "a profile (.profile.npz), a kernel (.kernel.json), a material (.toml) or a walk's checkpoint "
    "(.checkpoint)"
)
_MOST_BYTES = 500_000_000  # the most that a file of ours may have
# What every material has: a table of layers or a coefficient, if by a name that has to be mended.
_MATERIAL = re.compile(r"^\s*(\[\[layers\]\]|[\"']?(sigma|mu)_?[as])", re.MULTILINE | re.IGNORECASE)

_Record = TypeVar("_Record", "Profile", "SeparableKernel")


def newest(common: Common, pattern: str, made_by: str) -> Path:
    """Return the newest file of the current folder that matches, saying on stderr which."""
    from sssfit.errors import FileError

    found = [path for path in Path().glob(pattern) if path.is_file()]
    if not found:
        raise FileError(
            f"there is no {pattern} in this folder: name one, or make one with `{made_by}`."
        )
    path = max(found, key=lambda each: each.stat().st_mtime_ns)
    say(common, f"Using {path}, the newest {pattern} here.")
    return path


def profile_name(given: str | None, common: Common) -> str:
    """Return the profile that was named, by default the newest of this folder."""
    return given or str(newest(common, "*.profile.npz", "sssfit simulate skin1"))


def kernel_name(given: str | None, common: Common) -> str:
    """Return the kernel that was named, by default the newest of this folder."""
    return given or str(newest(common, "*.kernel.json", "sssfit fit --method svd --rank 3"))


def profile_of_kernel(
    kernel: SeparableKernel, name: str, given: str | None, common: Common
) -> tuple[Profile | None, str | None]:
    """Return a kernel's profile and its file: the one given, else the one it was fitted to.

    It is looked for beside the kernel and in the current folder.
    """
    from sssfit.kernel.origin import find_profile
    from sssfit.profile import Profile

    if given is None:
        folders = {Path(), Path() if name == "-" else Path(name).parent}
        profile, file, note = find_profile(kernel, name, folders)
        say_notes(common, [] if note is None else [note])
        return profile, file
    asked = Profile.load(given)
    if kernel.meta.get("profile_sha256") not in (None, asked.sha256):
        say(common, f"{given} is not the profile that {name} was fitted to.")
    return asked, given


def is_mci(name: str | None) -> bool:
    """Whether a name given for a material means an MCML input file."""
    return name is not None and name.lower().endswith(".mci")


def load(kind: type[_Record], name: str) -> _Record:
    """Read a profile or a kernel; ``-`` is stdin."""
    return kind.read(binary_stdin(), "stdin") if name == "-" else kind.load(name)


def load_source(name: str) -> Material | Profile:
    """Read a profile, ``-`` for stdin, or load a material."""
    from sssfit.material import load_material
    from sssfit.profile import Profile

    if name == DEON_SKIN:
        from sssfit.simulate import simulate_deon_skin

        return simulate_deon_skin()
    return load(Profile, name) if name == "-" or name.endswith(".npz") else load_material(name)


def binary_stdin() -> BinaryIO:
    """Return stdin for bytes, or say in one line that it is closed."""
    from sssfit.errors import FileError

    if sys.stdin is None:
        raise FileError("stdin is closed; name a file instead of -.")
    return sys.stdin.buffer


def read_any(name: str) -> Found:
    """Read a file, ``-`` for stdin, or a material that ships with sssfit.

    Raises
    ------
    SssfitError
        One line: not a file of ours, or one of ours that is damaged.
    """
    from sssfit.material import load_material, material_names

    if name == "-":
        return _read(_stdin(), "stdin")
    path = Path(name)
    if name in material_names() and not path.exists():
        return load_material(name)
    _check_regular_file(name, path)
    return _read(path, name)


def _read(source: Path | io.BytesIO, origin: str) -> Found:
    """Read what the content says it is."""
    from sssfit.kernel import SeparableKernel
    from sssfit.profile import Profile
    from sssfit.simulate import read_checkpoint

    kind = _kind(source, origin)
    if kind == "profile":
        return Profile.read(source, origin)
    if kind == "kernel":
        return SeparableKernel.read(source, origin)
    if kind == "checkpoint":
        return read_checkpoint(source, origin)
    return _material(source, origin)


def _material(source: Path | io.BytesIO, origin: str) -> Material:
    from sssfit.errors import MaterialError
    from sssfit.material import load_material, parse_material
    from sssfit.material.toml import decode

    if isinstance(source, Path):
        return load_material(source)
    with decode(source.getvalue()).hinting(MaterialError) as content:
        return parse_material(content, origin)


def _stdin() -> io.BytesIO:
    """Take all of stdin, which cannot seek, up to the most that a file of ours may have."""
    from sssfit.errors import FileError
    from sssfit.files import read_at_most

    content = read_at_most(binary_stdin(), _MOST_BYTES + 1)
    if len(content) > _MOST_BYTES:
        raise FileError(f"stdin has over {_MOST_BYTES:,} bytes; expected {_KINDS}.")
    return io.BytesIO(content)


def _check_regular_file(name: str, path: Path) -> None:
    """Refuse what is not there, folders, devices and pipes."""
    from sssfit.errors import FileError
    from sssfit.files import reason
    from sssfit.material import material_names
    from sssfit.material.toml import did_you_mean

    try:
        path.stat()
    except (OSError, ValueError) as error:  # ValueError: a null character
        why = reason(error) if isinstance(error, OSError) else str(error)
        near = did_you_mean(name, material_names()).strip()
        raise FileError(f"{name} cannot be read: {why}.{f' {near}' if near else ''}") from None
    if path.is_dir():
        raise FileError(f"{name} is a folder; name a file in it.")
    if not path.is_file():
        raise FileError(f"{name} is not an ordinary file; use - to read a pipe.")


def _kind(source: Path | io.BytesIO, origin: str) -> str:
    """Tell a file's kind by the marks in it."""
    from sssfit.errors import FileError
    from sssfit.files import reason

    if not isinstance(source, Path):
        kind = _kind_of_stream(source)
        source.seek(0)
    else:
        try:
            with source.open("rb") as stream:
                kind = _kind_of_stream(stream)
        except OSError as error:
            raise FileError(f"{origin} cannot be read: {reason(error)}.") from error
    if kind is None:
        raise FileError(f"{origin} is not a sssfit file; expected {_KINDS}.")
    return kind


def _kind_of_stream(stream: BinaryIO) -> str | None:
    """Return a kind, or None for what is foreign."""
    from sssfit.kernel import json as kernel_json
    from sssfit.material.toml import MOST_BYTES
    from sssfit.profile import npz
    from sssfit.simulate import CHECKPOINT_MARKS
    from sssfit.text import decode

    marks = {
        "kernel": (kernel_json.MARK,),
        "profile": npz.MARKS,
        "checkpoint": CHECKPOINT_MARKS,
    }
    for kind, each in marks.items():
        if npz.is_marked(stream, each):
            return kind
    stream.seek(0)
    text = decode(stream.read(MOST_BYTES))
    return "material" if text is not None and _MATERIAL.search(text.content) else None
