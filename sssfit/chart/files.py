"""Chart files: their formats by ending, and whether an existing file is one."""

from pathlib import Path
from typing import BinaryIO

from sssfit.errors import FileError
from sssfit.files import has_mark

FORMATS = ("png", "svg", "pdf")
MAKER = "sssfit chart"
_MARKS = {
    b"\x89PNG\r\n\x1a\n": b"tEXtSoftware\0" + MAKER.encode(),
    b"<?xml": f"<dc:title>{MAKER}</dc:title>".encode(),
    b"%PDF-": f"/Creator ({MAKER})".encode(),
}


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
    """Tell whether a file is a chart that we wrote, by what PNG, SVG and PDF say of their maker."""
    return has_mark(path, _MARKS)
