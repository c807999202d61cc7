"""The files pictures come from and go to: formats by ending, and by what the file begins with."""

import contextlib
import os
import struct
import sys
import threading
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from sssfit._material_checks import printable, shown
from sssfit.errors import FileError
from sssfit.files import has_mark, reason

# What is written, by ending.
_ENDINGS = {".exr": "exr", ".tif": "tiff", ".tiff": "tiff", ".png": "png"}
FORMATS = ("exr", "tiff", "png")
_PNG = b"\x89PNG\r\n\x1a\n"
# What is read, by its first bytes: a wrong ending does no harm. Both byte orders of TIFF, and its
# variant for more than 4 GB.
_MAGIC = {
    "exr": (b"\x76\x2f\x31\x01",),
    "hdr": (b"#?RADIANCE", b"#?RGBE"),
    "tiff": (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"),
    "png": (_PNG,),
}
_STDERR = threading.Lock()  # two at once would put the wrong stderr back
_LONGEST_CALLED = 400  # characters of a path in messages
# How pictures that we write name their maker; PNG has it in its Exif, which is TIFF's.
MAKER = "sssfit picture"
_MARKS = {
    begin: b"Software\0string\0\x0e\0\0\0" + MAKER.encode()
    if name == "exr"
    else MAKER.encode() + b"\0"
    for name, begins in _MAGIC.items()
    for begin in begins
}
_CRC_BLOCK = 1 << 20  # bytes held at a time while a chunk is summed


def image_format(target: str | Path | BinaryIO) -> str:
    """Return the format that the ending of a path asks for: "exr", "tiff" or "png".

    Raises
    ------
    FileError
        The ending is another, or a stream has none.
    """
    if not isinstance(target, str | Path):
        raise FileError(f"a stream has no ending; name a format: {', '.join(FORMATS)}.")
    if (chosen := _ENDINGS.get(Path(target).suffix.lower())) is None:
        raise FileError(
            f"{called(Path(target))}: pictures are written as EXR, TIFF or 16-bit PNG; end it in "
            ".exr, .tif or .png."
        )
    return chosen


def as_path(path: object) -> Path:
    """Return the path of a picture; refuse what cannot be one."""
    if not isinstance(path, str | os.PathLike) or isinstance(os.fspath(path), bytes):
        raise FileError(f"{shown(path)} is no path; name an EXR, HDR, TIFF or PNG file.")
    if "\0" in (text := os.fspath(path)):
        raise FileError(f"{shown(text)} holds a null character, which no file's name does.")
    return Path(text)


def is_image_file(path: str | Path) -> bool:
    """Tell whether a file is a picture that we wrote, by what it says of its maker."""
    try:
        return has_mark(as_path(path), _MARKS)
    except FileError:
        return False


def found_format(path: Path) -> str:
    """Return the format a file has by its content: "exr", "hdr", "tiff" or "png".

    Raises
    ------
    FileError
        Missing, unreadable, a folder or device, empty, or of another format.
    """
    name = called(path)
    try:
        if path.exists() and not path.is_file():
            raise FileError(f"{name} is a folder or a device; name an EXR, HDR, TIFF or PNG file.")
        found = _format_of(path)
        is_empty = path.stat().st_size == 0
    except OSError as error:
        raise FileError(f"{name} cannot be read: {reason(error)}.") from error
    if found is None:
        what = "is empty" if is_empty else "is not an EXR, HDR, TIFF or PNG file"
        raise FileError(f"{name} {what}; name a picture in one of these formats.")
    return found


def called(path: Path) -> str:
    """Return a path as it stands in messages: on one line, its middle left out where it is long."""
    text = printable(str(path))
    half = _LONGEST_CALLED // 2
    return text if len(text) <= _LONGEST_CALLED else f"{text[:half]}...{text[-half:]}"


@contextlib.contextmanager
def without_lines_of_libpng() -> Iterator[None]:
    """Keep stderr to ourselves: libpng writes its errors there, and then hands them on as well."""
    with _STDERR:
        with contextlib.suppress(OSError, ValueError, AttributeError):
            sys.stderr.flush()
        try:
            kept = os.dup(2)
        except OSError:  # closed: there is nothing to keep clean
            yield
            return
        try:
            with Path(os.devnull).open("wb") as nowhere:
                os.dup2(nowhere.fileno(), 2)
            yield
        finally:
            os.dup2(kept, 2)
            os.close(kept)


def check_png(path: Path) -> None:
    """Check a PNG's chunks against their own sums, which libpng does for some of them only.

    Raises
    ------
    FileError
        Cut short or damaged.
    """
    try:
        with path.open("rb") as stream:
            stream.seek(len(_PNG))
            is_whole = _chunks_are_whole(stream)
    except OSError as error:
        raise FileError(f"{called(path)} cannot be read: {reason(error)}.") from error
    if not is_whole:
        raise FileError(f"{called(path)} is damaged or cut short; write or copy it again.")


def _chunks_are_whole(stream: BinaryIO) -> bool:
    """Tell whether every chunk up to IEND is there and has the sum it says."""
    while len(head := stream.read(8)) == 8:
        length, name = struct.unpack(">I4s", head)
        total = zlib.crc32(name)
        while length:
            if not (block := stream.read(min(length, _CRC_BLOCK))):
                return False
            total = zlib.crc32(block, total)
            length -= len(block)
        if stream.read(4) != struct.pack(">I", total):
            return False
        if name == b"IEND":
            return True
    return False


def _format_of(path: Path) -> str | None:
    with path.open("rb") as stream:
        head = stream.read(16)
    return next((name for name, begins in _MAGIC.items() if head.startswith(begins)), None)
