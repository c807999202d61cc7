"""What headers say of light that OpenImageIO keeps to itself: Radiance's lines, PNG's primaries."""

import math
import struct
from dataclasses import dataclass
from pathlib import Path

from sssfit._image_files import called
from sssfit._material_checks import printable
from sssfit.errors import FileError, RenderError
from sssfit.files import reason

_LONGEST_HEADER = 1 << 20
_LARGEST = 1e30  # product of exposures; Radiance's own numbers span 1e-38 to 1e38
_PNG_SIGNATURE = 8  # bytes


@dataclass(frozen=True, slots=True)
class Header:
    """What was done to a file's light: the factors in it (3,), and the primaries of R, G, B.

    ``exposure`` and ``correction`` are 1 where the header does not say, ``primaries`` None.
    """

    exposure: float = 1.0
    correction: tuple[float, ...] = (1.0, 1.0, 1.0)
    primaries: tuple[float, ...] | None = None


def read_header(path: Path, format: str) -> Header:
    """Return what the header of a Radiance or PNG file says; nothing for other formats.

    Raises
    ------
    FileError
        Unreadable, or a line of a Radiance header is not what it should be.
    RenderError
        A Radiance file of CIE XYZ.
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
    """Multiply up the EXPOSURE and COLORCORR lines (Ward, Radiance file formats); the last rules.

    A picture holds the light times all of them.
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
    """Return the cHRM chunk's numbers, unless another chunk overrules it (PNG 3, 11.3.2.1)."""
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
