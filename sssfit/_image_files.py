"""The files pictures come from and go to: formats by ending, and by what the file begins with."""

import struct
import zlib
from pathlib import Path
from typing import BinaryIO

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
            f"{target}: pictures are written as EXR, TIFF or 16-bit PNG; end it in .exr, .tif or "
            ".png."
        )
    return chosen


def is_image_file(path: Path) -> bool:
    """Tell whether a file is a picture that we wrote, by what it says of its maker."""
    return has_mark(path, _MARKS)


def found_format(path: Path) -> str:
    """Return the format a file has by its content: "exr", "hdr", "tiff" or "png".

    Raises
    ------
    FileError
        Missing, unreadable, a folder or device, empty, or of another format.
    """
    if path.exists() and not path.is_file():
        raise FileError(f"{path} is a folder or a device; name an EXR, HDR, TIFF or PNG file.")
    try:
        found = _format_of(path)
        is_empty = path.stat().st_size == 0
    except OSError as error:
        raise FileError(f"{path} cannot be read: {reason(error)}.") from error
    if found is None:
        what = "is empty" if is_empty else "is not an EXR, HDR, TIFF or PNG file"
        raise FileError(f"{path} {what}; name a picture in one of these formats.")
    return found


def check_png(path: Path) -> None:
    """Check a PNG's chunks against their own sums.

    libpng does so too, but writes lines of its own to stderr about what it finds.

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
        raise FileError(f"{path} cannot be read: {reason(error)}.") from error
    if not is_whole:
        raise FileError(f"{path} is damaged or cut short; write or copy it again.")


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
