"""Files: whole or not at all, never somebody else's, never two writers."""

import errno
import os
import sys

import pytest
from processes import start

from sssfit import files
from sssfit.errors import FileError


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def own(_path):
    return True


def foreign(_path):
    return False


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path):
    target = tmp_path / "a.npz"
    target.write_bytes(b"old")

    def fail(stream):
        stream.write(b"half")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with pytest.raises(FileError, match=r"a\.npz cannot be written: no space left on device"):
        files.write_atomically(target, fail)
    assert target.read_bytes() == b"old"
    assert names(tmp_path) == ["a.npz"]


def test_an_interrupted_write_leaves_nothing(tmp_path):
    def interrupted(stream):
        stream.write(b"half")
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        files.write_atomically(tmp_path / "a.npz", interrupted)
    assert names(tmp_path) == []


@pytest.mark.skipif(sys.platform == "win32", reason="an open file cannot be replaced there")
def test_a_reader_sees_the_old_file_or_the_new_one(tmp_path):
    target = tmp_path / "a.npz"
    target.write_bytes(b"old")

    def write(stream):
        stream.write(b"new,")
        stream.flush()
        assert target.read_bytes() == b"old"
        stream.write(b" longer")

    with target.open("rb") as reader:
        files.write_atomically(target, write)
        assert reader.read() == b"old"
    assert target.read_bytes() == b"new, longer"


def test_a_file_is_on_the_disk_whole_before_it_takes_the_name(tmp_path, monkeypatch):
    target, real, seen = tmp_path / "a.npz", os.fsync, []
    target.write_bytes(b"old")

    def note(handle):
        of = os.fstat(handle)
        seen.append((of.st_ino, of.st_size, target.read_bytes()))
        real(handle)

    monkeypatch.setattr(os, "fsync", note)
    files.write_atomically(target, lambda stream: stream.write(b"new, longer"))
    assert seen[0] == (target.stat().st_ino, len(b"new, longer"), b"old")
    if sys.platform != "win32":  # then the rename: a folder is flushed there too
        assert [(inode, content) for inode, _, content in seen[1:]] == [
            (tmp_path.stat().st_ino, b"new, longer")
        ]


def test_a_written_file_has_ordinary_permissions(tmp_path):
    files.write_atomically(tmp_path / "a", lambda stream: stream.write(b"x"))
    (tmp_path / "b").write_bytes(b"x")
    assert (tmp_path / "a").stat().st_mode == (tmp_path / "b").stat().st_mode


def test_outputs_are_checked_before_the_work(tmp_path, monkeypatch):
    (tmp_path / "theirs.npz").write_bytes(b"x")
    files.check_output(tmp_path / "new.npz", foreign)
    files.check_output(tmp_path / "theirs.npz", own)
    files.check_output(tmp_path / "theirs.npz", foreign, force=True)
    for path, fragment in (
        (tmp_path / "theirs.npz", "--force"),
        (tmp_path / "missing" / "a.npz", "there is no folder"),
        (tmp_path, "is a folder"),
    ):
        with pytest.raises(FileError, match=fragment):
            files.check_output(path, foreign)

    def read_only(**_):
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr(files.tempfile, "mkstemp", read_only)
    with pytest.raises(FileError, match="read-only file system"):
        files.check_output(tmp_path / "new.npz", own)


HOLD = """
import sys, time
from pathlib import Path
from sssfit.files import locked
with locked(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(60)
"""


@pytest.fixture
def holder(tmp_path):
    """A process that holds the lock of a.npz for a minute."""
    command = [sys.executable, "-c", HOLD, tmp_path / "a.npz"]
    process = start(command)
    assert process.stdout.readline() == "held\n"
    return process


def test_two_runs_on_one_output_are_kept_apart(tmp_path, holder):
    with (
        pytest.raises(FileError, match="being written by another run"),
        files.locked(tmp_path / "a.npz"),
    ):
        pass
    with files.locked(tmp_path / "b.npz"):
        assert holder.poll() is None


def test_a_killed_run_holds_nothing(tmp_path, holder):
    holder.kill()
    holder.wait()
    with files.locked(tmp_path / "a.npz"):
        assert (tmp_path / ".a.npz.lock").exists()
    assert names(tmp_path) == []


@pytest.mark.skipif(sys.platform == "win32", reason="an open file cannot be unlinked there")
def test_a_lock_file_unlinked_under_us_is_made_again(tmp_path, monkeypatch):
    # the run before us unlinks its lock file between our open and our lock
    real, calls = files._lock, []

    def unlink_first(handle):
        if not calls:
            (tmp_path / ".a.npz.lock").unlink()
        calls.append(handle)
        real(handle)

    monkeypatch.setattr(files, "_lock", unlink_first)
    with files.locked(tmp_path / "a.npz"):
        assert (tmp_path / ".a.npz.lock").exists()
    assert len(calls) == 2
