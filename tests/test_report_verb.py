"""``sssfit report`` as a command: interrupted, killed, twice at once, and where nothing can be
written."""

import errno
import os
import signal
import sys
import time
from pathlib import Path

import fork_server
import pytest

from sssfit import files
from sssfit.cli import main
from sssfit.report.html import MARK

posix = pytest.mark.skipif(os.name != "posix", reason="signals and groups are POSIX")
PAGE = f'<!doctype html><meta name="generator" content="{MARK}"><p>é'

# The verb at work in both of its processes.
WORKING = """
import functools, os, sys, time
import sssfit.report
from sssfit.report.aside import Aside

def finished_page(*_, **__):
    with Aside(2) as aside:
        if {is_ready}:
            aside.begin(functools.partial(str, 1))()
        begun = aside.begin(functools.partial(time.sleep, 60))
        print("working", flush=True)
        begun()

os.setsid()
sssfit.report.finished_page = finished_page
from sssfit.cli import main
sys.argv[1:] = ["report", "skin1", "-q", "-o", "a.html"]
main()
"""


@pytest.fixture
def run(tmp_path, monkeypatch, capfd):
    """Run the verb on pages that take no time; its status, and what it writes as bytes."""
    monkeypatch.chdir(tmp_path)
    made = {"page": PAGE, "words": "1 kernel", "figures": {"name": "skin1"}}
    monkeypatch.setattr("sssfit.report.finished_page", lambda *_, **__: made)

    def called(*arguments):
        with pytest.raises(SystemExit) as ended:
            main(["report", "skin1", *arguments])
        return ended.value.code, *capfd.readouterr()

    return called


def working(folder, when):
    """The verb in a process group of its own, with its second process starting or ready."""
    command = [sys.executable, "-c", WORKING.format(is_ready=when == "ready")]
    process = fork_server.start(command, cwd=folder)
    assert process.stdout.readline() == "working\n"
    return process


def is_left(group):
    """Whether a process of a group runs."""
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, own = path.read_text().rpartition(")")[2].split()[:3]
        except OSError:
            continue
        if int(own) == group and state != "Z":
            return True
    return False


def ended(process):
    """Its status and stderr, once nothing of its group is left."""
    _, err = process.communicate(timeout=60)
    end = time.monotonic() + 20
    while is_left(process.pid) and time.monotonic() < end:
        time.sleep(0.02)
    assert not is_left(process.pid)
    return process.returncode, err


@posix
@pytest.mark.parametrize("when", ["starting", "ready"])
def test_ctrl_c_ends_both_processes_in_one_line_and_leaves_nothing(tmp_path, when):
    process = working(tmp_path, when)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does, to the second process, too
    status, err = ended(process)
    assert (status, err) == (130, "\nInterrupted.\n")
    assert list(tmp_path.iterdir()) == []


@posix
def test_a_killed_report_leaves_no_process_and_no_lock_that_holds(tmp_path, run):
    process = working(tmp_path, "ready")
    process.kill()
    assert ended(process) == (-signal.SIGKILL, "")
    assert [each.name for each in tmp_path.iterdir()] == [".a.html.lock"]
    assert run("-o", "a.html")[0] == 0
    assert [each.name for each in tmp_path.iterdir()] == ["a.html"]


def test_two_at_once_onto_one_file_are_kept_apart(run):
    with files.locked(Path("a.html")):
        status, _, err = run("-o", "a.html")
    assert (status, err.count("\n")) == (1, 1)
    assert "a.html is being written by another run" in err
    assert not Path("a.html").exists()


def test_a_folder_that_is_a_file_is_refused_before_the_work(run, monkeypatch):
    monkeypatch.setattr("sssfit.report.finished_page", None)
    Path("folder").write_text("")
    status, _, err = run("-o", "folder/a.html")
    assert (status, err.count("\n")) == (1, 1)
    assert "folder/a.html: folder is a file; name a folder." in err


@posix
def test_a_full_disk_keeps_the_page_of_before(run, monkeypatch):
    Path("a.html").write_text(PAGE.replace("é", "before"), encoding="utf-8")

    def full(_handle):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("os.fsync", full)
    status, _, err = run("-o", "a.html")
    assert (status, err.count("\n")) == (1, 1)
    assert "a.html cannot be written: no space left on device" in err
    assert "before" in Path("a.html").read_text(encoding="utf-8")
    assert [each.name for each in Path().iterdir()] == ["a.html"]


def test_a_piped_page_is_the_page_alone(run):
    status, out, err = run("-o", "-")
    assert (status, out) == (0, PAGE)
    assert err == "1 kernel\nWrote the page to stdout\n"
    assert list(Path().iterdir()) == []


@pytest.mark.parametrize("columns", ["30", "0"])
def test_a_narrow_terminal_has_all_words(run, monkeypatch, columns):
    monkeypatch.setenv("COLUMNS", columns)
    status, out, _ = run("--help")
    assert status == 0
    assert "Show this message" in " ".join(out.split())
    assert run("-o", "a.html") == (0, "1 kernel\nWrote a.html\n", "")
