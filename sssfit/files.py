"""Files on disk: atomic writes, no overwriting of foreign files, one run per output.

Writes go to a temporary file beside the target, are flushed to the disk and renamed over it, so a
reader sees the old file or the new one and never a part of either.
"""

import atexit
import contextlib
import errno
import glob
import io
import os
import shutil
import stat
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO

from sssfit.errors import ArgumentError, FileError, SssfitError
from sssfit.messages import shown
from sssfit.methods import EXPORTS

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl


# A plain ``open`` gives 0666 less this; mkstemp's 0600 would shut colleagues out. Read once, at
# import: it can only be read by changing it, and threads may be writing later.
_UMASK = os.umask(0)
os.umask(_UMASK)


_MARK_BYTES = 65_536  # as far as a mark may lie from either end of a file

_READ_BYTES = 1 << 20

# Temporary files and folders, and locks, of this process at this moment.
_unfinished: set[Path] = set()


def reason(error: OSError) -> str:
    """Say an operating-system error in lower case, without its number."""
    return (error.strerror or str(error)).lower()


def path_of(path: object, error: type[SssfitError] = FileError) -> Path:
    """Return the path that a caller gave, or raise an error for what cannot be one."""
    if not isinstance(path, str | Path):
        raise error(f"{shown(path)} is not a path; expected a text or a Path.")
    if "\0" in str(path):
        raise error(f"{shown(str(path))} holds a null character, which no file's name does.")
    try:
        os.fsencode(path)
    except UnicodeEncodeError:
        raise error(f"{shown(str(path))} holds half of a character; type it again.") from None
    return Path(path)


def source_of(
    source: str | Path | BinaryIO, error: type[SssfitError] = FileError
) -> Path | BinaryIO:
    """Return an input's path or binary stream, or raise an error for what is neither."""
    if isinstance(source, str | Path):
        return path_of(source, error)
    if not hasattr(source, "read") or isinstance(source, io.TextIOBase):
        raise error(f"{shown(source)} is not a path; expected one, or a binary stream.")
    return source


def check_target(target: object) -> None:
    """Raise an error for what is neither a path nor a binary stream that can be written to."""
    if isinstance(target, str | Path):
        path_of(target)
    elif not hasattr(target, "write") or isinstance(target, io.TextIOBase):
        raise FileError(f"{shown(target)} is not a path; expected one, or a binary stream.")


def has_mark(path: Path, marks: Mapping[bytes, bytes]) -> bool:
    """Return whether a file carries our mark.

    Parameters
    ----------
    path : Path
        A file of any kind; it need not exist.
    marks : mapping
        Maps the first bytes of a format's files to our mark near their beginning or end.
    """
    try:
        with path.open("rb") as stream:
            head = stream.read(_MARK_BYTES)
            if (size := path.stat().st_size) > _MARK_BYTES:
                stream.seek(max(_MARK_BYTES, size - _MARK_BYTES))
            tail = stream.read(_MARK_BYTES)
    except OSError:
        return False
    found = (mark for begin, mark in marks.items() if head.startswith(begin))
    return any(mark in head or mark in tail for mark in found)


def is_marked(stream: BinaryIO, marks: Sequence[bytes]) -> bool:
    """Whether a file that can seek holds one of some marks, anywhere in it."""
    stream.seek(0)
    kept = b""
    while block := stream.read(1 << 24):
        if any(mark in kept + block for mark in marks):
            return True
        kept = block[-100:]
    return False


def read_at_most(stream: BinaryIO, most: int) -> bytes:
    """Read a stream to its end, but at most this many bytes.

    ``stream.read(most)`` would first allocate all of them: 2 GB for a profile of 0.3 MB.
    """
    parts: list[bytes] = []
    while most > 0 and (part := stream.read(min(most, _READ_BYTES))):
        parts.append(part)
        most -= len(part)
    return b"".join(parts)


def check_output(
    path: Path,
    is_own: Callable[[Path], bool],
    *,
    force: bool = False,
    inputs: Iterable[str | Path] = (),
) -> None:
    """Raise an error for an output that could not be written, before hours of work.

    Parameters
    ----------
    path : Path
        Where the output is to go.
    is_own : callable
        Returns whether an existing file is one of ours, of the same kind as the output.
    force : bool
        Replace a foreign or write-protected file, or an input, as well.
    inputs : iterable of str or Path
        The inputs, ``-`` for stdin; names that are not files are ignored.

    Raises
    ------
    FileError
        The folder is missing or not writable, or the file is an input or not ours.
    """
    _check_target(path)
    path = followed(path)
    folder = path.parent
    if folder.exists() and not folder.is_dir():
        raise FileError(f"{path}: {folder} is a file; name a folder.")
    if not folder.is_dir():
        raise FileError(f"{path}: there is no folder {folder}; make it, or name another.")
    _check_ordinary(path)
    if path.exists():
        _check_replaceable(path, is_own, force, inputs)
    with _clear_errors(path):
        handle, probe = _temporary(path)
        os.close(handle)
        probe.unlink()


def _check_ordinary(path: Path) -> None:
    if path.is_dir():
        raise FileError(f"{path} is a folder; name a file in it.")
    if path.exists() and not path.is_file():
        raise FileError(f"{path} is not an ordinary file; name another.")


def is_same_file(one: Path, other: Path) -> bool:
    """Return whether two names lead to the same file, which need not exist yet."""
    with contextlib.suppress(OSError):
        return one.samefile(other)
    return os.path.normcase(os.path.realpath(one)) == os.path.normcase(os.path.realpath(other))


def _check_target(path: Path) -> None:
    """Raise an error for a circular symbolic link."""
    try:
        path.stat()
    except OSError as error:
        if error.errno == errno.ELOOP:
            raise FileError(f"{path} is a link that leads back to itself; name a file.") from None


def _check_replaceable(
    path: Path, is_own: Callable[[Path], bool], force: bool, inputs: Iterable[str | Path]
) -> None:
    """Raise an error instead of replacing files that the user may want to keep."""
    remedy = "choose another name, or replace it with `force = True`."
    if not force:
        if _is_among(path, inputs):
            raise FileError(f"{path} is read as an input as well; {remedy}")
        if not is_own(path):
            raise FileError(f"{path} exists and was not written by sssfit as such a file; {remedy}")
        if not os.access(path, os.W_OK):
            raise FileError(f"{path} is write-protected; {remedy}")
    folder = path.parent.stat()
    if sys.platform == "win32" or not folder.st_mode & stat.S_ISVTX:
        return
    if os.geteuid() not in (0, folder.st_uid, path.stat().st_uid):
        raise FileError(
            f"{path} belongs to somebody else, and only the owner may replace a file in "
            f"{path.parent}; choose another name."
        )


def _is_among(path: Path, inputs: Iterable[str | Path]) -> bool:
    """Return whether a file is one of these, by any name, link or stream."""
    here = path.stat()
    for each in inputs:
        with contextlib.suppress(OSError, ValueError):  # the name of a material, a closed stdin
            there = os.fstat(0) if str(each) == "-" else Path(each).stat()
            if os.path.samestat(here, there):
                return True
    return False


# Endings that promise a format; a name without one of them promises nothing.
_DATA = (".csv", ".json", ".mci", ".mco", ".md", ".npz", ".toml")
_PICTURES = (".exr", ".hdr", ".jpeg", ".jpg", ".pdf", ".png", ".svg", ".tif", ".tiff")
_OF_KERNELS = tuple(f".{name}" for name, each in EXPORTS.items() if not each.of_profiles)


def check_ending(path: Path, what: str, own: str) -> None:
    """Raise an error for an output whose name promises another format.

    Parameters
    ----------
    path : Path
        Where the output is to go.
    what : str
        Its kind, with the article: "a profile".
    own : str
        The ending of its format: ".npz".

    Raises
    ------
    FileError
        The name has the ending of another format.
    """
    ending = path.suffix.lower()
    if ending != own and ending in (*_DATA, *_PICTURES, *_OF_KERNELS):
        raise FileError(f"{path} ends in {ending}, and {what} is written; end its name in {own}.")


def write_atomically(path: str | Path, write: Callable[[BinaryIO], object]) -> None:
    """Write a complete file or nothing: temporary file in the same folder, fsync, rename.

    Raises
    ------
    FileError
        The disk is full, the folder read-only, or another failure; an older file at ``path`` stays
        unchanged. Or it is a device or a pipe, which the new file would replace, or no path.
    """
    path = followed(path_of(path))
    with _clear_errors(path):
        _check_ordinary(path)
        handle, temporary = _temporary(path)
        _unfinished.add(temporary)
        try:
            with os.fdopen(handle, "wb") as stream:
                write(stream)
                stream.flush()
                os.fsync(stream.fileno())
            temporary.chmod(path.stat().st_mode if path.exists() else 0o666 & ~_UMASK)
            temporary.replace(path)
            _flush_folder(path.parent)
        except BaseException:
            temporary.unlink(missing_ok=True)
            raise
        finally:
            _unfinished.discard(temporary)


@contextlib.contextmanager
def temporary_folder(beside: Path | None = None) -> Iterator[Path]:
    """Make a folder that is removed again, also where the process ends at once.

    It lies outside the user's own, or on the disk of an output and beside it.
    """
    where: dict[str, Any] = {}
    if beside is not None:
        where = {"dir": beside.parent, "prefix": f".{beside.name}.", "suffix": ".tmp"}
    folder = Path(tempfile.mkdtemp(**where))
    _unfinished.add(folder)
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        if not folder.exists():  # else at the end, when there may be memory and files again
            _unfinished.discard(folder)


def remove_unfinished() -> None:
    """Delete temporary files and locks of this process, which is about to end.

    Other threads may still be writing: files not yet renamed are deleted, the others stay.
    """
    for path in tuple(_unfinished):
        with contextlib.suppress(OSError):
            if path.is_dir():
                # Two signals may remove it twice at a time: what the other took is no reason to
                # stop before the folder itself, after which this one ends the process.
                shutil.rmtree(path, ignore_errors=True)
            else:
                path.unlink()


# Python 3.11 does not wait at its end for a thread whose `join` a signal interrupted (bpo-46726).
atexit.register(remove_unfinished)


def remove_leftovers(path: Path) -> None:
    """Delete the temporary files and folders of killed writes of ``path``.

    Call it while holding the output's lock, so that no other process is writing.
    """
    pattern = f".{glob.escape(path.name)}.{8 * '?'}.tmp"  # mkstemp puts eight letters in
    with contextlib.suppress(OSError):
        for leftover in path.parent.glob(pattern):
            shutil.rmtree(leftover) if leftover.is_dir() else leftover.unlink(missing_ok=True)


@contextlib.contextmanager
def locked(path: Path) -> Iterator[None]:
    """Hold the output ``path`` for this process by an operating-system lock.

    The lock is on ``.NAME.lock`` beside the output and ends with the process, even by kill -9; the
    lock file of a killed run locks nothing.

    Raises
    ------
    FileError
        Another run holds it.
    """
    path = followed(path)
    lock_path = path.with_name(f".{path.name}.lock")
    with _clear_errors(path):
        handle = _open_locked(lock_path, path)
    _unfinished.add(lock_path)
    try:
        remove_leftovers(path)
        yield
    finally:
        # Unlink before the lock is released, so that a waiting process notices that its file is
        # gone.
        with contextlib.suppress(OSError):
            lock_path.unlink()
        _unfinished.discard(lock_path)
        os.close(handle)


def check_distinct(paths: Iterable[Path]) -> None:
    """Refuse two outputs into one file."""
    seen: list[Path] = []
    for path in paths:
        if any(is_same_file(path, other) for other in seen):
            raise ArgumentError(f"two outputs name the same file, {path}; give each its own.")
        seen.append(path)


@contextlib.contextmanager
def held(
    paths: Iterable[Path | None],
    is_own: Callable[[Path], bool],
    *,
    inputs: Iterable[str | Path | None] = (),
    force: bool = False,
    named: tuple[str, str] | None = None,
) -> Iterator[None]:
    """Refuse outputs that could not or should not be written, and lock the others.

    Parameters
    ----------
    paths : iterable of Path or None
        Where outputs are to go; None is passed over.
    is_own, inputs, force
        As in `check_output`; None among the inputs is passed over.
    named : (str, str), optional
        What is written and how its name ends: ("a profile", ".npz").

    Raises
    ------
    ArgumentError
        Two outputs into one file.
    FileError
        As `check_ending`, `check_output` and `locked`.
    """
    files = [path for path in paths if path is not None]
    read = [each for each in inputs if each is not None]
    check_distinct(files)
    with contextlib.ExitStack() as locks:
        for path in files:
            if named is not None:
                check_ending(path, *named)
            check_output(path, is_own, force=force, inputs=read)
            locks.enter_context(locked(path))
        yield


def _open_locked(lock_path: Path, path: Path) -> int:
    """Open and lock; repeat if the run that ended unlinked the file in between."""
    while True:
        handle = os.open(lock_path, os.O_RDWR | os.O_CREAT, 0o644)
        try:
            _lock(handle)
        except OSError:
            os.close(handle)
            raise FileError(
                f"{path} is being written by another run; wait for it, or choose another name."
            ) from None
        with contextlib.suppress(FileNotFoundError):
            if os.path.samestat(lock_path.stat(), os.fstat(handle)):
                return handle
        os.close(handle)


def _flush_folder(folder: Path) -> None:
    """Flush a rename to the disk, so that later deletions do not become durable before it."""
    if sys.platform == "win32":
        return  # a folder cannot be opened there
    # Not supported by every file system; the file itself is safe.
    with contextlib.suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def _lock(handle: int) -> None:
    """Take an exclusive lock at once or raise OSError."""
    if sys.platform == "win32":
        msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
    else:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _temporary(path: Path) -> tuple[int, Path]:
    """Make the file that will be renamed to ``path``; `remove_leftovers` recognises its name."""
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.", suffix=".tmp")
    return handle, Path(name)


def followed(path: Path) -> Path:
    """Return the target of a symbolic link, so that a rename replaces the file and not the link."""
    return path.resolve() if path.is_symlink() else path


@contextlib.contextmanager
def _clear_errors(path: Path) -> Iterator[None]:
    """Turn operating-system errors into one line that names the file."""
    try:
        yield
    except OSError as error:
        raise FileError(f"{path} cannot be written: {reason(error)}.") from error
