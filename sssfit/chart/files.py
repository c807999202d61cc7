"""Chart files: their formats by ending, and whether an existing file is one."""

from pathlib import Path
from typing import BinaryIO

from sssfit.errors import FileError
from sssfit.files import check_target, has_mark

FORMATS = ("png", "svg", "pdf")
MAKER = "sssfit chart"
_MARKS = {
    b"\x89PNG\r\n\x1a\n": b"tEXtSoftware\0" + MAKER.encode(),
    b"<?xml": f"<dc:title>{MAKER}</dc:title>".encode(),
    b"%PDF-": f"/Creator ({MAKER})".encode(),
}


def chart_format(target: str | Path | BinaryIO) -> str:
    """Return the format of a path by its ending: "png", "svg" or "pdf".

    Raises
    ------
    FileError
        The path has another ending, or a stream has none.
    """
    check_target(target)
    if not isinstance(target, str | Path):
        raise FileError(f"a stream has no ending; name one of {', '.join(FORMATS)}.")
    return known_format(Path(target).suffix.removeprefix("."), str(target))


def known_format(name: str, origin: str) -> str:
    """Return the format in lower case, or raise an error that begins with ``origin``."""
    if (chosen := name.lower()) not in FORMATS:
        raise FileError(f"{origin}: charts are PNG, SVG or PDF; end it in .png, .svg or .pdf.")
    return chosen


def is_chart_file(path: Path) -> bool:
    """Return whether a file is a chart that we wrote, by the maker that it names."""
    return has_mark(path, _MARKS)
