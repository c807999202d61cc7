"""Text files of other programs: read whole, known to be text, their numbers taken strictly.

The three formats that come in this way are MCML's input (``sssfit.mci``) and output
(``sssfit.mco``) and tables of a profile (``sssfit.profile_csv``).
"""

import io
import math
import re
from pathlib import Path
from typing import BinaryIO

from sssfit._material_checks import printable
from sssfit.errors import SssfitError
from sssfit.files import read_at_most, reason

# A million absorption boxes of an MCML run are 13 MB of text.
MOST_BYTES = 500_000_000

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


def read_text(
    source: str | Path | BinaryIO, origin: str, *, expected: str, error: type[SssfitError]
) -> str:
    """Read a text of another program; every line in it ends with a single newline character.

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
        Of the type ``error``: missing, unreadable, a folder, not UTF-8, or larger than 500 MB.
    """
    try:
        content = _bytes(source)
    except OSError as failure:
        raise error(f"{printable(origin)} cannot be read: {reason(failure)}.") from None
    except ValueError as failure:  # a null character in the path
        raise error(f"{printable(origin)} cannot be read: {failure}.") from None
    if len(content) > MOST_BYTES:
        raise error(
            f"{printable(origin)} is larger than {MOST_BYTES / 1e6:.0f} MB, not {expected}."
        )
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as failure:
        line = content[: failure.start].count(b"\n") + 1
        raise error(
            f"{printable(origin)}: line {line} holds the byte {content[failure.start]:#04x}, which "
            f"is no UTF-8 text; expected {expected}."
        ) from None
    return io.StringIO(text, newline=None).getvalue()


def _bytes(source: str | Path | BinaryIO) -> bytes:
    """All of it, or one byte more than is allowed."""
    if isinstance(source, str | Path):
        with Path(source).open("rb") as stream:
            return read_at_most(stream, MOST_BYTES + 1)
    return read_at_most(source, MOST_BYTES + 1)


def finite_number(word: str) -> float | None:
    """Return the number that a whole word writes in decimal; None if it is none, or too large."""
    value = float(word) if _NUMBER.fullmatch(word) else math.inf
    return value if math.isfinite(value) else None
