"""Progress bars: in a terminal, and gone from it when they are full; never in a log."""

import os
import subprocess
import sys

import fork_server
import pytest

from sssfit.cli import main

posix = pytest.mark.skipif(os.name != "posix", reason="Windows has no pseudo-terminals")
BAR = "\N{BOX DRAWINGS HEAVY HORIZONTAL}"
ERASED = "\x1b[2K"
WALK = ["simulate", "skin1", "--photons", "3e4", "-o", "a.npz"]
BUDGET = ["compare", "skin1", "--what", "budget", "--picture", "disk", "--size", "16x16"]
KERNELS = [
    *("compare", "skin1", "--what", "kernels", "--picture", "disk", "--size", "16x16"),
    *("--only", "preintegrated,svd"),
]
COMMANDS = [WALK, [*BUDGET, "--photons", "1e4"], [*KERNELS, "--mm-per-pixel", "4"]]


def command(arguments):
    return [sys.executable, "-m", "sssfit.cli", *arguments]


@pytest.mark.parametrize("arguments", COMMANDS, ids=["walk", "budget", "kernels"])
def test_a_log_has_no_line_of_progress(tmp_path, monkeypatch, capfd, arguments):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 0
    log = capfd.readouterr().err
    lines = [line for line in log.splitlines() if not line.startswith("Compiling")]
    assert [line for line in lines if "/s" in line or BAR in line or " % " in line] == []


@posix
@pytest.mark.parametrize("arguments", COMMANDS, ids=["walk", "budget", "kernels"])
def test_a_full_bar_is_taken_from_the_terminal(tmp_path, arguments):
    import pty

    ours, theirs = pty.openpty()
    try:
        ran = fork_server.start(
            command(arguments),
            cwd=tmp_path,
            stdout=subprocess.DEVNULL,
            stderr=theirs,
            env=os.environ | {"TERM": "xterm", "COLUMNS": "100"},
        )
        os.close(theirs)
        shown = b""
        while part := _read(ours):
            shown += part
        assert ran.wait(timeout=120) == 0
    finally:
        os.close(ours)
    text = shown.decode("utf-8")
    assert BAR in text
    assert ERASED in text[text.rindex(BAR) :], "the last thing that is done to the bar"


def _read(terminal):
    """What comes next; nothing once the other side is closed, which Linux calls an error."""
    try:
        return os.read(terminal, 65536)
    except OSError:
        return b""
