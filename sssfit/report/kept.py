"""Keeps finished pages in the user's cache folder: the same page again takes a second.

A page is kept under a hash of all that it depends on: the files of this package, the versions of
what it computes with, the material or profile, kernels, pictures and settings. A file begins with a
checksum of the rest, so that one that was damaged is made again.
"""

import contextlib
import hashlib
import json
import logging
import platform
import warnings
from collections.abc import Callable, Iterator, Mapping
from importlib.metadata import version
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

from sssfit.errors import FileError, SssfitWarning
from sssfit.files import write_atomically
from sssfit.messages import note
from sssfit.process import user_cache_folder

_PACKAGES = ("numpy", "scipy", "numba", "colour-science", "jinja2")
_MOST = 10  # pages of 5 MB
_SUM_BYTES = 32  # of SHA-256
_SOURCES = {".py", ".js", ".css", ".html"}
LOG = "sssfit"
_OF_ONE_RUN = "Compiling the "  # of `note_compiling`: a page says the same, compiled before or not


def page_key(given: Mapping[str, Any]) -> str:
    """Return the hash of what a page depends on; ``given`` has JSON values."""
    digest = hashlib.sha256(json.dumps(given, sort_keys=True).encode())
    known = [platform.python_version(), platform.node(), *map(version, _PACKAGES)]
    digest.update(json.dumps(known).encode())
    with as_file(files("sssfit")) as folder:
        for path in sorted(each for each in folder.rglob("*") if each.suffix in _SOURCES):
            digest.update(f"{path.relative_to(folder)}\0".encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()


def kept(key: str, make: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """Return what ``make`` returned before under this key, or make and keep it.

    What was noted or warned of while it was made is told again. While notes are turned off, nothing
    is kept, since they would be missing later.

    Parameters
    ----------
    key : str
        The page's key, from `page_key`.
    make : callable
        Returns JSON values.
    """
    path = _folder() / f"{key}.json"
    found = _read(path)
    if found is None:
        with heard() as told, warnings.catch_warnings(record=True) as warned:
            made = make()
        ours = [str(each.message) for each in warned if each.category is SssfitWarning]
        found = {"made": made, "notes": told.lines, "warnings": ours}
        if logging.getLogger(LOG).isEnabledFor(logging.INFO):
            _write(path, found)
    else:
        for line in found["notes"]:
            note(line)
    for line in found["warnings"]:
        warnings.warn(line, SssfitWarning, stacklevel=2)
    return dict(found["made"])


class Listener(logging.Handler):
    """Remembers what the library says; it says it all the same."""

    def __init__(self) -> None:
        super().__init__(logging.INFO)
        self.lines: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        """Remember a line, unless it holds for one run only."""
        if not (line := record.getMessage()).startswith(_OF_ONE_RUN):
            self.lines.append(line)


@contextlib.contextmanager
def heard() -> Iterator[Listener]:
    """Let a listener hear what is noted inside the block."""
    listener = Listener()
    logging.getLogger(LOG).addHandler(listener)
    try:
        yield listener
    finally:
        logging.getLogger(LOG).removeHandler(listener)


@contextlib.contextmanager
def told_once() -> Iterator[None]:
    """Let a line that is noted again inside the block pass only the first time."""
    told: set[str] = set()

    def is_new(record: logging.LogRecord) -> bool:
        seen = (line := record.getMessage()) in told
        told.add(line)
        return not seen

    logger = logging.getLogger(LOG)
    logger.addFilter(is_new)
    try:
        yield
    finally:
        logger.removeFilter(is_new)


def _folder() -> Path:
    return user_cache_folder() / "pages"


def _read(path: Path) -> dict[str, Any] | None:
    """Return what a file holds, if it is whole."""
    try:
        raw = path.read_bytes()
    except OSError:
        return None
    if hashlib.sha256(raw[_SUM_BYTES:]).digest() != raw[:_SUM_BYTES]:
        return None
    found: dict[str, Any] = json.loads(raw[_SUM_BYTES:])
    return found


def _write(path: Path, content: dict[str, Any]) -> None:
    """Keep a page and forget the oldest; a folder that cannot be written keeps none."""
    raw = json.dumps(content).encode()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, lambda out: out.write(hashlib.sha256(raw).digest() + raw))
        every = sorted(path.parent.glob("*.json"), key=lambda each: -each.stat().st_mtime)
        for old in every[_MOST:]:
            old.unlink(missing_ok=True)
    except (OSError, FileError) as error:
        logging.getLogger(LOG).debug("The page was not kept: %s", error)
