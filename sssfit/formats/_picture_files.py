"""Picture files and their formats, by ending and by first bytes."""

import contextlib
import math
import os
import struct
import sys
import threading
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from sssfit.errors import FileError, RenderError
from sssfit.files import has_mark, reason
from sssfit.messages import printable, shown

_LONGEST_HEADER = 1 << 20
_LARGEST = 1e30  # product of exposures; Radiance's own numbers span 1e-38 to 1e38
_PNG_SIGNATURE = 8  # bytes


@dataclass(frozen=True, slots=True)
class Header:
    """Encoding of a file's light: factors (3,), and the primaries of R, G, B.

    ``exposure`` and ``correction`` are 1 and ``primaries`` is None if the header has no entry.
    """

    exposure: float = 1.0
    correction: tuple[float, ...] = (1.0, 1.0, 1.0)
    primaries: tuple[float, ...] | None = None


def read_header(path: Path, format: str) -> Header:
    """Return the encoding from the header of a Radiance or PNG file; the default for others.

    Raises
    ------
    FileError
        The file is unreadable, or a line of its Radiance header is invalid.
    RenderError
        The file is a Radiance file of CIE XYZ.
    """
    try:
        if format == "hdr":
            return _radiance(path)
        if format == "png":
            return Header(primaries=_png_primaries(path))
    except OSError as error:
        raise FileError(f"{called(path)} cannot be read: {reason(error)}.") from error
    return Header()


def _radiance(path: Path) -> Header:
    """Read a Radiance header (Ward, Radiance file formats): all factors, the last primaries.

    A picture holds the light times all of these factors.
    """
    with path.open("rb") as stream:
        text = stream.read(_LONGEST_HEADER).replace(b"\r", b"").partition(b"\n\n")[0]
    exposure, primaries = 1.0, None
    correction: tuple[float, ...] = (1.0, 1.0, 1.0)
    for line in text.decode("latin-1").split("\n")[1:]:
        key, _, value = line.strip().partition("=")
        key = key.strip()
        if key == "FORMAT" and value.strip() == "32-bit_rle_xyze":
            raise RenderError(
                f"{called(path)} holds CIE XYZ (FORMAT={value.strip()}); expected R, G, B: convert "
                "it with Radiance's ra_xyze -r."
            )
        if key == "EXPOSURE":
            exposure *= _numbers(path, key, value, 1)[0]
        elif key == "COLORCORR":
            factors = _numbers(path, key, value, 3)
            correction = tuple(a * b for a, b in zip(correction, factors, strict=True))
        elif key == "PRIMARIES":
            primaries = _numbers(path, key, value, 8)
    if not all(1.0 / _LARGEST <= each <= _LARGEST for each in (exposure, *correction)):
        raise FileError(
            f"{called(path)} is damaged (the product of its EXPOSURE or COLORCORR lines is out of "
            "range)."
        )
    return Header(exposure, correction, primaries)


def _numbers(path: Path, key: str, value: str, count: int) -> tuple[float, ...]:
    """Return the numbers of a line, all above 0."""
    try:
        numbers = tuple(float(each) for each in value.split())
    except ValueError:
        numbers = ()
    if len(numbers) != count or not all(math.isfinite(each) and each > 0.0 for each in numbers):
        raise FileError(
            f"{called(path)} is damaged ({key}={printable(value.strip()[:60])} in its header; "
            f"expected {count} numbers above 0)."
        )
    return numbers


def _png_primaries(path: Path) -> tuple[float, ...] | None:
    """Return the numbers of the cHRM chunk, unless another chunk overrides it (PNG 3, 11.3.2.1)."""
    found = None
    with path.open("rb") as stream:
        stream.seek(_PNG_SIGNATURE)
        while len(head := stream.read(8)) == 8:
            length, name = struct.unpack(">I4s", head)
            if name in (b"sRGB", b"iCCP", b"cICP"):
                return None
            if name in (b"IDAT", b"IEND"):
                break
            if name == b"cHRM" and length == 32:
                white_first = struct.unpack(">8I", stream.read(32))
                found = tuple(each / 100_000.0 for each in (*white_first[2:], *white_first[:2]))
                length = 0
            stream.seek(length + 4, 1)
    return found


# Formats that are written, by ending.
_ENDINGS = {".exr": "exr", ".tif": "tiff", ".tiff": "tiff", ".png": "png"}
FORMATS = ("exr", "tiff", "png")
_PNG = b"\x89PNG\r\n\x1a\n"
# Formats that are read, by first bytes, so a wrong ending does no harm. TIFF has two byte orders,
# and a variant for more than 4 GB.
_MAGIC = {
    "exr": (b"\x76\x2f\x31\x01",),
    "hdr": (b"#?RADIANCE", b"#?RGBE"),
    "tiff": (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"),
    "png": (_PNG,),
    "jpeg": (b"\xff\xd8\xff",),
}
READ = "EXR, HDR, TIFF, PNG, JPG or TGA"
# A TGA file begins with no mark: the new form ends with one, the old needs its file ending.
_TGA_END = b"TRUEVISION-XFILE.\0"
_TGA_ENDINGS = (".tga", ".targa")
# Types with palettes, colours and greys, plain and run-length encoded.
_TGA_TYPES = (1, 2, 3, 9, 10, 11)
_TGA_DEPTHS = (8, 15, 16, 24, 32)  # bits a pixel
_STDERR = threading.Lock()  # two at once would restore the wrong stderr
_LONGEST_CALLED = 400  # characters of a path in messages
# How pictures that we write name their maker; PNG has it in its Exif, which uses TIFF's tags.
MAKER = "sssfit picture"
_MARKS = {
    begin: b"Software\0string\0\x0e\0\0\0" + MAKER.encode()
    if name == "exr"
    else MAKER.encode() + b"\0"
    for name, begins in _MAGIC.items()
    for begin in begins
}
_CRC_BLOCK = 1 << 20  # bytes in memory while the checksum of a chunk is computed


def image_format(target: str | Path | BinaryIO) -> str:
    """Return the format of a path by its ending: "exr", "tiff" or "png".

    Raises
    ------
    FileError
        The path has another ending, or a stream has none.
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
    """Return the path of a picture; raises an error if it cannot be one."""
    if not isinstance(path, str | os.PathLike) or isinstance(os.fspath(path), bytes):
        raise FileError(f"{shown(path)} is not a path; name an {READ} file.")
    if "\0" in (text := os.fspath(path)):
        raise FileError(f"{shown(text)} holds a null character, which no file's name does.")
    return Path(text)


def is_image_file(path: str | Path) -> bool:
    """Return whether a file is a picture that we wrote, by the maker it names."""
    try:
        return has_mark(as_path(path), _MARKS)
    except FileError:
        return False


def found_format(path: Path) -> str:
    """Return the format of a file by its content: a key of ``_MAGIC``, or "tga".

    Raises
    ------
    FileError
        The file is missing, unreadable, a folder or device, empty, or of another format.
    """
    name = called(path)
    try:
        if path.exists() and not path.is_file():
            raise FileError(f"{name} is a folder or a device; name an {READ} file.")
        found = _format_of(path)
        is_empty = path.stat().st_size == 0
    except OSError as error:
        raise FileError(f"{name} cannot be read: {reason(error)}.") from error
    if found is None:
        what = "is empty" if is_empty else f"is not an {READ} file"
        raise FileError(f"{name} {what}; name a picture in one of these formats.")
    return found


def called(path: Path) -> str:
    """Return a path for messages: on one line, and shortened in the middle if it is long."""
    text = printable(str(path))
    half = _LONGEST_CALLED // 2
    return text if len(text) <= _LONGEST_CALLED else f"{text[:half]}...{text[-half:]}"


@contextlib.contextmanager
def without_lines_of_libpng() -> Iterator[None]:
    """Capture stderr, because libpng writes its errors there and also returns them."""
    with _STDERR:
        with contextlib.suppress(OSError, ValueError, AttributeError):
            sys.stderr.flush()
        try:
            kept = os.dup(2)
        except OSError:  # closed: no need to capture it
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
    """Check the checksums of a PNG's chunks, which libpng does for some of them only.

    Raises
    ------
    FileError
        The file is truncated or damaged.
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
    """Return whether every chunk up to IEND is present with the right checksum."""
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
        head = stream.read(18)
        if found := next(
            (name for name, begins in _MAGIC.items() if head.startswith(begins)), None
        ):
            return found
        is_old = path.suffix.lower() in _TGA_ENDINGS
        return "tga" if _begins_a_tga(head) and (is_old or _ends_a_tga(stream)) else None


def _begins_a_tga(head: bytes) -> bool:
    """Return whether 18 bytes can be a TGA header (Truevision, TGA file format, version 2.0)."""
    if len(head) < 18:
        return False
    has_palette, kind = head[1], head[2]
    width, height = struct.unpack("<HH", head[12:16])
    is_known = has_palette in (0, 1) and kind in _TGA_TYPES and head[16] in _TGA_DEPTHS
    return is_known and width > 0 and height > 0


def _ends_a_tga(stream: BinaryIO) -> bool:
    size = stream.seek(0, os.SEEK_END)
    stream.seek(max(size - len(_TGA_END), 0))
    return stream.read() == _TGA_END
