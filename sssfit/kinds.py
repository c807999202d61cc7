"""The kinds of file that sssfit writes, recognised by content; `load` reads any of them.

A new kind is one entry here. Nothing of a room is imported before one of its files is read.
"""

import io
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, TypeAlias

from sssfit.errors import FileError
from sssfit.files import is_marked, read_at_most, reason, source_of
from sssfit.messages import did_you_mean, printable
from sssfit.methods import DEON_SKIN, imported
from sssfit.text import decode

if TYPE_CHECKING:
    from sssfit.kernel import SeparableKernel, Taps
    from sssfit.material import Material
    from sssfit.profile import Profile
    from sssfit.simulate import SoFar

    Loaded: TypeAlias = Profile | SeparableKernel | Taps | Material | SoFar

MOST_BYTES = 500_000_000  # the most that a file of ours may have
_MOST_TOML_BYTES = 1_000_001
# What every material has: a table of layers or a coefficient, even with a misspelt name.
_MATERIAL = re.compile(r"^\s*(\[\[layers\]\]|[\"']?(sigma|mu)_?[as])", re.MULTILINE | re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Kind:
    """One kind of file.

    Parameters
    ----------
    words : str
        Its name in messages.
    reader : str
        "module:function", which takes a path or binary stream and its name in messages.
    marks : tuple of bytes
        Any of them identifies a file of this kind, even a damaged one. A material, which is text,
        has none.
    """

    words: str
    reader: str
    marks: tuple[bytes, ...] = ()


def _in_json(family: str) -> tuple[bytes, ...]:
    """Return the marks of a format in JSON, also as older shells of Windows pass on text."""
    return tuple(f'"{family}/'.encode(each) for each in ("utf-8", "utf-16-le", "utf-16-be"))


# The marks of archives are their first member's name, or the format in their JSON, which numpy
# writes with four bytes a letter. Both stand uncompressed.
KINDS: Mapping[str, Kind] = {
    "profile": Kind(
        "a profile (.profile.npz)",
        "sssfit.profile:Profile.read",
        (b"r_edges_mm.npy", "sssfit.profile/".encode("utf-32-le")),
    ),
    "kernel": Kind(
        "a kernel (.kernel.json)",
        "sssfit.kernel:SeparableKernel.read",
        _in_json("sssfit.kernel"),
    ),
    "taps": Kind(
        "a table of taps (.taps.json)", "sssfit.kernel:Taps.read", _in_json("sssfit.taps")
    ),
    "material": Kind("a material (.toml)", "sssfit.material:read_material"),
    "checkpoint": Kind(
        "a walk's checkpoint (.checkpoint)",
        "sssfit.simulate:read_checkpoint",
        (b"ledger_absorbed.npy", "sssfit.checkpoint/".encode("utf-32-le")),
    ),
}


def load(source: "str | Path | BinaryIO", origin: str | None = None) -> "Loaded":
    """Read a profile, kernel, table of taps, material or walk's checkpoint, told by its content.

    Parameters
    ----------
    source : str, Path or binary stream
        A file, the name of a material that ships with sssfit, or a stream (which need not seek).
    origin : str, optional
        Its name in messages, by default the path, or "the stream".

    Returns
    -------
    Profile, SeparableKernel, Taps, Material or SoFar

    Raises
    ------
    SssfitError
        The file is not one of ours, or it is damaged; the message is one line.

    Examples
    --------
    >>> load("skin1").name
    'skin1'
    """
    path = source_of(source)
    if not isinstance(path, Path):
        origin = printable(str(origin) if origin is not None else "the stream")
        source = _whole(path, origin)
        kind = _kind(source)
        source.seek(0)
    else:
        origin = printable(str(source if origin is None else origin))
        names = imported("sssfit.material:shipped_names")()
        if not str(source):
            raise FileError(f"the name '' is empty; name {_expected()}.")
        if source in names and not path.exists():
            return imported("sssfit.material:load_material")(source)  # type: ignore[no-any-return]
        _check_regular_file(path, origin, names)
        source = path
        try:
            with path.open("rb") as stream:
                kind = _kind(stream)
        except OSError as error:
            raise FileError(f"{origin} cannot be read: {reason(error)}.") from error
    if kind is None:
        raise FileError(f"{origin} is not a sssfit file; expected {_expected()}.")
    found: Loaded = imported(kind.reader)(source, origin)
    return found


def _whole(stream: BinaryIO, origin: str) -> io.BytesIO:
    """Read a stream that may not seek, up to the largest size of our files."""
    content = read_at_most(stream, MOST_BYTES + 1)
    if len(content) > MOST_BYTES:
        raise FileError(f"{origin} has over {MOST_BYTES:,} bytes; expected {_expected()}.")
    return io.BytesIO(content)


def _check_regular_file(path: Path, origin: str, names: Any) -> None:
    """Raise an error for missing files, folders, devices and pipes."""
    try:
        path.stat()
    except OSError as error:
        if origin == DEON_SKIN:
            raise FileError(
                f"{origin} has no coefficients and no file; simulate it, and name its profile."
            ) from None
        near = did_you_mean(origin, names).strip()
        raise FileError(
            f"{origin} cannot be read: {reason(error)}.{f' {near}' if near else ''}"
        ) from None
    if path.is_dir():
        raise FileError(f"{origin} is a folder; name a file in it.")
    if not path.is_file():
        raise FileError(f"{origin} is not an ordinary file; use - to read a pipe.")


def _kind(stream: BinaryIO) -> Kind | None:
    """Return the kind by the marks in a file; None for foreign files."""
    for kind in KINDS.values():
        if is_marked(stream, kind.marks):
            return kind
    stream.seek(0)
    text = decode(stream.read(_MOST_TOML_BYTES))
    is_material = text is not None and _MATERIAL.search(text.content)
    return KINDS["material"] if is_material else None


def _expected() -> str:
    """Return the names of the kinds as text."""
    *others, last = (kind.words for kind in KINDS.values())
    return f"{', '.join(others)} or {last}"
