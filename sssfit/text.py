"""Text files of other programs, decoded, their numbers parsed strictly; values as people type them.

``sssfit.formats`` and ``sssfit.material`` read their files by it. UTF-8 is what is meant; UTF-16
and the Western code page of Windows are what editors there also write, and are read: names and
comments may hold any letter, numbers are ASCII.
"""

import codecs
import contextlib
import io
import math
import re
from collections.abc import Collection, Iterator
from decimal import Decimal
from pathlib import Path
from typing import BinaryIO, NamedTuple

from sssfit.errors import ArgumentError, SssfitError
from sssfit.files import read_at_most, reason, source_of
from sssfit.messages import printable

# A million absorption boxes of an MCML run are 13 MB of text.
MOST_BYTES = 500_000_000

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_HINT = "The file is not UTF-8 text: if a letter is the trouble, save it as UTF-8."
_LOOKED_AT = 4096  # bytes among which those of pictures and archives have a null


class Text(NamedTuple):
    """A decoded file: lines end in newline characters; whether its bytes were UTF-8 or UTF-16."""

    content: str
    is_unicode: bool

    @contextlib.contextmanager
    def hinting(self, error: type[SssfitError]) -> Iterator[str]:
        """Lend the content; an ``error`` raised meanwhile also says how to save the file."""
        try:
            yield self.content
        except error as failure:
            if self.is_unicode:
                raise
            raise error(f"{failure} {_HINT}") from None


def read_text(
    source: str | Path | BinaryIO, origin: str, *, expected: str, error: type[SssfitError]
) -> Text:
    """Read a text of another program.

    Parameters
    ----------
    source : str, Path or binary stream
        A path is opened; a stream is read to its end.
    origin : str
        What messages call it.
    expected : str
        What the file should have been, with its article: "an MCML input file".
    error : type
        The error to raise.

    Raises
    ------
    SssfitError
        Of the type ``error``: missing, unreadable, a folder, no text, or larger than 500 MB.
    """
    if isinstance(source, str | Path) and not origin:
        raise error(f"the name '' is empty; name {expected}.")
    source = source_of(source, error)
    try:
        content = _bytes(source)
    except OSError as failure:
        raise error(f"{printable(origin)} cannot be read: {reason(failure)}.") from None
    if len(content) > MOST_BYTES:
        raise error(
            f"{printable(origin)} is larger than {MOST_BYTES / 1e6:.0f} MB, not {expected}."
        )
    text = decode(content)
    if text is None:
        raise error(f"{printable(origin)} is not text; expected {expected}.")
    # NEL ends lines on mainframes; in the Windows code page its byte is an ellipsis.
    return text._replace(content=text.content.replace("\x85", "\n"))


def decode(content: bytes) -> Text | None:
    """Decode UTF-8, UTF-16 or the Western code page of Windows; None if it is not text.

    Byte order marks are dropped, line ends become newline characters.
    """
    text, is_unicode = _decoded(content)
    if "\0" in text[:_LOOKED_AT]:
        return None
    text = text.rstrip("\x1a")  # DOS's mark of the end
    return Text(io.StringIO(text, newline=None).getvalue(), is_unicode)


def _decoded(content: bytes) -> tuple[str, bool]:
    """Return the text, and whether it was Unicode."""
    encoding = _utf16(content[:_LOOKED_AT])
    if encoding is not None:
        return content.decode(encoding, errors="replace"), True
    try:
        return content.decode("utf-8-sig"), True
    except UnicodeDecodeError:
        pass
    # Five bytes stand for nothing in the code page; a name or comment that has one is not lost.
    return content.decode("cp1252", errors="replace"), False


def _utf16(head: bytes) -> str | None:
    """Tell UTF-16 by its mark, or by a null in every other byte of what begins in ASCII."""
    if head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    first = head[:8]
    if len(first) >= 4 and not any(first[1::2]) and all(first[::2]):
        return "utf-16-le"
    if len(first) >= 4 and not any(first[::2]) and all(first[1::2]):
        return "utf-16-be"
    return None


def _bytes(source: Path | BinaryIO) -> bytes:
    """All of it, or one byte more than is allowed."""
    if isinstance(source, Path):
        with source.open("rb") as stream:
            return read_at_most(stream, MOST_BYTES + 1)
    return read_at_most(source, MOST_BYTES + 1)


def finite_number(word: str) -> float | None:
    """Return the number that a whole word writes in decimal; None if it is none, or too large."""
    value = float(word) if _NUMBER.fullmatch(word) else math.inf
    return value if math.isfinite(value) else None


def decimal_shifted(word: str, power: int) -> float:
    """Return a word that `finite_number` reads, times 10 to a power.

    The shift is decimal: 7.4 per cm gives the same bits as 0.74 per mm.
    """
    # Not for 0, which may be written 0e999999999999999999999, beyond what Decimal knows.
    return float(Decimal(word).scaleb(power)) if finite_number(word) else 0.0


# Values as people type them: each function raises ArgumentError for what it cannot read.

_MM_PER_UNIT = {"": 1.0, "um": 1e-3, "mm": 1.0, "cm": 10.0, "m": 1000.0}
_LENGTH = re.compile(r"\s*([-+.\deE]+?)\s*(um|mm|cm|m|)\s*")
_PIXELS = re.compile("0*[1-9][0-9]{0,8}")  # a picture of more columns than that has no memory
_WHOLE = re.compile("[+-]?[0-9]{1,9}", re.ASCII)
_HEX = re.compile("#(?:[0-9a-fA-F]{3}|[0-9a-fA-F]{6})")


def number(text: str) -> float:
    """Read a finite number."""
    if (found := _number(text)) is None:
        raise ArgumentError(f"{text!r} is not a valid number.")
    if not math.isfinite(found):
        raise ArgumentError(f"{text!r} is not a finite number.")
    return found


def numbers(text: str) -> list[float]:
    """Read finite numbers with commas between them."""
    return [number(each) for each in text.split(",")]


def length_mm(text: str, word: str | None = None) -> float | str:
    """Read a length: a plain number is mm; 250um, 3cm and 0.6m are understood.

    ``word`` is one that comes through as it is.
    """
    if text == word:
        return text
    found = _LENGTH.fullmatch(text)
    number = (_number(found[1]) or 0.0) * _MM_PER_UNIT[found[2]] if found else 0.0
    if not 0.0 < number < math.inf:
        other = f", or {word}" if word else ""
        raise ArgumentError(f"{text!r} is not a length above 0, such as 0.05, 3cm or 0.6m{other}.")
    return number


def lengths_mm(text: str) -> list[float | str]:
    """Read lengths with commas between them; the unit of the last serves those that have none."""
    parts = [each.strip() for each in text.split(",")]
    units = [re.sub(r"[-+.\deE\s]", "", each) for each in parts]
    if units[-1] and not any(units[:-1]):
        parts[:-1] = [f"{each}{units[-1]}" for each in parts[:-1]]
    elif not all(units) and any(units):
        raise ArgumentError(f"{text!r} has a unit for some lengths only; give it to all.")
    return [length_mm(each) for each in parts]


def names(text: str, among: Collection[str]) -> list[str]:
    """Read names from a list of words with commas; ArgumentError for another word."""
    words = [word.strip() for word in text.split(",")]
    for word in words:
        if word not in among:
            raise ArgumentError(f"{printable(word)!r} is not among {', '.join(among)}.")
    return words


def whole_number(text: str, least: int, most: int) -> int:
    """Read a whole number that may be written 1e7."""
    number = _number(text.replace("_", ""))
    if number is None or not (number.is_integer() and least <= number <= most):
        raise ArgumentError(
            f"{text!r} is not a whole number from {least} to {most:.0e} "
            "(10000000 and 1e7 are both understood)."
        )
    return int(number)


def size(text: str) -> tuple[int, int]:
    """Read columns and rows, as 1920x1080; return (rows, columns)."""
    width, _, height = text.lower().partition("x")
    if not all(_PIXELS.fullmatch(each) for each in (width, height)):
        raise ArgumentError(f"{text!r} is not a size in pixels, such as 1920x1080.")
    return int(height), int(width)


def shift(text: str) -> tuple[int, int]:
    """Read whole pixels to the right and down, as 2,-1; return (down, right)."""
    parts = [each.strip() for each in text.split(",")]
    if len(parts) != 2 or not all(_WHOLE.fullmatch(each) for each in parts):
        raise ArgumentError(f"{text!r} is not a shift of whole pixels X,Y, such as 2,-1.")
    return int(parts[1]), int(parts[0])


def share(text: str) -> float:
    """Read a share between 0 and 1, which may be written in per cent: 0.5% or 0.005."""
    number = _number_or_percent(text)
    if number is None or not 0.0 < number < 1.0:
        raise ArgumentError(f"{text!r} is not a share between 0 and 100 %, such as 0.5% or 0.005.")
    return number


def part(text: str) -> float:
    """Read a share from 0 to 1, both included, which may be written in per cent: 20% or 0.2."""
    number = _number_or_percent(text)
    if number is None or not 0.0 <= number <= 1.0:
        raise ArgumentError(f"{text!r} is not a share from 0 to 100 %, such as 20% or 0.2.")
    return number


def parts(text: str) -> list[float]:
    """Read shares from 0 to 1 with commas between them, as `part`."""
    return [part(each) for each in text.split(",")]


def base_colour(text: str) -> list[float] | str:
    """Read reflectances, 0.44 or 44%, with commas between them; an sRGB colour in hex stays."""
    text = text.strip()
    if text.startswith("#"):
        if not _HEX.fullmatch(text):
            raise ArgumentError(f"{text!r} is not an sRGB colour in hex, such as '#c58c6b'.")
        return text
    found = []
    for each in text.split(","):
        if (number := _number_or_percent(each)) is None:
            raise ArgumentError(f"{each!r} is not a reflectance, such as 0.44 or 44%.")
        found.append(number)
    return found


def _number_or_percent(text: str) -> float | None:
    """Read 0.44 or 44%; None for what is no number."""
    text = text.strip()
    number = _number(text.removesuffix("%"))
    return number / 100.0 if number is not None and text.endswith("%") else number


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None
