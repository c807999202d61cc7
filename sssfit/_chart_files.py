"""The files charts go to: their formats by ending, and how to know one that is there."""

from pathlib import Path
from typing import BinaryIO

from sssfit.errors import FileError

FORMATS = ("png", "svg", "pdf")


def chart_format(target: str | Path | BinaryIO) -> str:
    """Return the format that the ending of a path asks for: "png", "svg" or "pdf".

    Raises
    ------
    FileError
        The ending is another, or a stream has none.
    """
    if not isinstance(target, str | Path):
        raise FileError(f"a stream has no ending; name one of {', '.join(FORMATS)}.")
    return known_format(Path(target).suffix.removeprefix("."), str(target))


def known_format(name: str, origin: str) -> str:
    """Return the format in lower case, or refuse it with a line that begins with ``origin``."""
    if (chosen := name.lower()) not in FORMATS:
        raise FileError(f"{origin}: charts are PNG, SVG or PDF; end it in .png, .svg or .pdf.")
    return chosen


def is_chart_file(path: Path) -> bool:
    """Tell whether a file begins as PNG, SVG or PDF files do."""
    try:
        with path.open("rb") as stream:
            head = stream.read(1024)
    except OSError:
        return False
    is_svg = head.lstrip().startswith((b"<?xml", b"<svg")) and b"svg" in head
    return is_svg or head.startswith((b"\x89PNG\r\n\x1a\n", b"%PDF-"))
