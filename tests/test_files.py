"""Files: whole or not at all, never somebody else's, never two writers."""

import errno
import os
import sys
from pathlib import Path

import pytest
from processes import start

from sssfit import files
from sssfit.cli import main
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
        (tmp_path / "theirs.npz", "`force = True`"),
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


@pytest.mark.parametrize("name", ["x.json", "x.TOML", "x.csv", "x.profile.png", "x.tiff", "x.mco"])
def test_an_ending_that_promises_another_format_is_refused(name):
    with pytest.raises(
        FileError, match=r"ends in \.\w+, and a profile is written; end its name in"
    ):
        files.check_ending(Path(name), "a profile", ".npz")


@pytest.mark.parametrize("name", ["x.npz", "x.NPZ", "x", "x.profile", "skin.2026-11-27", ".npz"])
def test_other_endings_promise_nothing(name):
    files.check_ending(Path(name), "a profile", ".npz")


ASKED = ("--from-reflectance", ".4,.3,.2", "--mean-free-path", "1", "--eta", "1.3")


@pytest.mark.parametrize(
    ("arguments", "ending"),
    [
        (("simulate", "skin1", "--photons", "2000", "-o", "x.json"), ".npz"),
        (("simulate", "skin1", "--method", "dipole", "-o", "x.csv"), ".npz"),
        (("simulate", "deon-skin", "-o", "x.toml"), ".npz"),
        (("import", "t.csv", "--quantity", "energy", "-o", "x.json"), ".npz"),
        (("materials", *ASKED, "-o", "x.json"), ".toml"),
        (("fit", "t.profile.npz", "--method", "preintegrated", "-o", "x.npz"), ".json"),
        (("choose", "skin1", "--distance", "1m", "-o", "x.c"), ".json"),
        (("export", "t.profile.npz", "--format", "csv", "-o", "x.json"), ".csv"),
        (("export", "t.kernel.json", "--format", "hlsl", "-o", "x.json"), ".hlsl"),
        (("export", "t.kernel.json", "--format", "json", "-o", "x.hlsl"), ".json"),
        (("chart", "t.profile.npz", "-o", "x.json"), ".png"),
        (("render", "t.kernel.json", "-o", "x.json"), ".exr"),
        (("compare", "skin1", "--what", "kernels", "--table", "x.npz"), ".md"),
        (("compare", "skin1", "--what", "kernels", "--chart", "x.csv"), ".png"),
    ],
)
def test_no_verb_writes_a_format_that_the_name_denies(
    tmp_path, monkeypatch, capfd, arguments, ending
):
    monkeypatch.chdir(tmp_path)
    Path("t.csv").write_text("r_mm,R,G,B\n0.5,.1,.1,.1\n1,.05,.04,.03\n1.5,.02,.01,.01\n")
    for first in (
        ("import", "t.csv", "--quantity", "energy", "-q"),
        ("fit", "t.profile.npz", "--method", "preintegrated", "-o", "t.kernel.json", "-q"),
    ):
        with pytest.raises(SystemExit) as end:
            main(first)
        assert not end.value.code
    before = names(tmp_path)
    capfd.readouterr()
    with pytest.raises(SystemExit) as end:
        main(arguments)
    out, err = capfd.readouterr()
    assert (end.value.code, out) == (1, ""), err
    assert err.count("\n") == 1, err
    assert ending in err
    assert names(tmp_path) == before


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


def test_the_temporary_folder_of_a_killed_write_is_removed(tmp_path):
    killed, other = tmp_path / ".a.npz.abcdefgh.tmp", tmp_path / ".b.npz.abcdefgh.tmp"
    for each in (killed, other):
        each.mkdir()
        (each / "part").write_bytes(b"half")
    with files.locked(tmp_path / "a.npz"), files.temporary_folder(tmp_path / "a.npz") as aside:
        assert aside.parent == tmp_path
        assert aside.match(".a.npz.????????.tmp")
        (aside / "part").write_bytes(b"half")
    assert names(tmp_path) == [other.name]


def test_a_temporary_folder_that_cannot_be_removed_yet_is_removed_at_the_end(tmp_path, monkeypatch):
    """As where no file more may be opened, which removing a folder has to."""
    with monkeypatch.context() as short:
        short.setattr(files.shutil, "rmtree", lambda *_, **__: None)
        with pytest.raises(OSError, match="too many"), files.temporary_folder(tmp_path / "a"):
            raise OSError("too many open files")
    assert names(tmp_path)
    files.remove_unfinished()
    assert names(tmp_path) == []


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no pipes with a name")
def test_a_pipe_is_not_replaced_by_a_file(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(FileError, match=r"pipe is not an ordinary file; name another\."):
        files.write_atomically(pipe, lambda stream: stream.write(b"new"))
    assert pipe.is_fifo()
    assert names(tmp_path) == ["pipe"]
