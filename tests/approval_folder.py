"""A fresh copy of the folder of files for each invocation that is approved, and what is in it.

The copy consists of links, and one invocation's copy becomes the next one's: what it left is
removed, and what it removed or replaced is linked again. To make 200 links and remove them, and to
ask for the size of each, took a third of the time of all approvals. Each copy has a name of its
own, so that nothing is remembered of a path.
"""

import atexit
import contextlib
import functools
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

import approval_world as world


@contextlib.contextmanager
def copied_files() -> Iterator[Path]:
    """Be in a fresh folder of the files.

    What is written replaces a link and leaves the file behind it alone; that is checked.
    """
    folder = _renewed()
    with contextlib.chdir(folder):
        yield folder
    assert _signatures() == _first_signatures(), "a file was written in place"


@functools.cache
def _home() -> Path:
    home = Path(tempfile.mkdtemp(prefix="sssfit-copies-")).resolve()
    atexit.register(shutil.rmtree, home, ignore_errors=True)
    (home / "none").mkdir()
    return home


def _renewed() -> Path:
    """The last copy under a new name and as at the beginning."""
    _first_signatures()
    (before,) = _home().iterdir()
    folder = Path(tempfile.mkdtemp(dir=_home()))
    before.rename(folder)
    missing = {each.name: each for each in os.scandir(world.files())}
    for each in os.scandir(folder):
        if each.is_dir(follow_symlinks=False):
            shutil.rmtree(each.path)
        elif each.name in missing and missing[each.name].inode() == each.inode():
            del missing[each.name]
        else:
            Path(each.path).unlink()
    for name, each in missing.items():
        if each.is_dir():
            shutil.copytree(each.path, folder / name, copy_function=os.link)
        else:
            os.link(each.path, folder / name)
    return folder


def _signatures() -> dict[str, tuple[int, int]]:
    found = {each.path: each.stat() for each in os.scandir(world.files())}
    return {path: (each.st_size, each.st_mtime_ns) for path, each in found.items()}


@functools.cache
def _first_signatures() -> dict[str, tuple[int, int]]:
    return _signatures()


def contents(folder: Path) -> dict[str, bytes]:
    """Every file in a folder, by its path in it; those of the common folder are read once."""
    found = dict(_within(str(folder), ()))
    return {"/".join(parts): found[parts] for parts in sorted(found)}


def _within(folder: str, above: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], bytes]]:
    for each in os.scandir(folder):
        parts = *above, each.name
        if each.is_dir(follow_symlinks=False):
            yield from _within(each.path, parts)
        elif each.inode() in _common():
            yield parts, _common()[each.inode()]
        elif each.is_file():
            yield parts, Path(each.path).read_bytes()


@functools.cache
def _common() -> dict[int, bytes]:
    """The files that are linked, by inode, which nothing else can have as long as they exist."""
    files = [each for each in os.scandir(world.files()) if each.is_file()]
    return {each.inode(): Path(each.path).read_bytes() for each in files}
