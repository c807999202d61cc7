"""Signals: the first ends in order, the second ends within a second, also in compiled code."""

import os
import random
import signal
import subprocess
import sys
import textwrap
import time

import fork_server
import numpy as np
import processes
import pytest
from reference_pixels import make_profile

from sssfit import files
from sssfit.cli import _main as cli_main
from sssfit.cli import main
from sssfit.fit import fit_svd

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals are POSIX")

TRIAL = """
import click
import sys
from pathlib import Path
from sssfit.cli import cli, main

@cli.command()
def trial():
{body}

# As the console script does: with arguments of its own `main` would give the signals back.
sys.argv = ["sssfit", "trial"]
main()
"""
COMPILED = """
import numba

@numba.njit(nogil={nogil})
def spin(n):
    total = 0.0
    for k in range(n):
        total += 1.0 / (1.0 + total * k)
    return total

spin(10)
click.echo("ready")
spin(10**15)
"""
BODIES = {
    "compiled, lock released": COMPILED.format(nogil=True),
    "compiled, lock kept": COMPILED.format(nogil=False),
    "one instruction of Python": "click.echo('ready')\nsum(range(10**15))",
    "an orderly end that takes long": """
import time
try:
    click.echo("ready")
    time.sleep(60)
finally:
    time.sleep(60)
""",
    "stopped in order": """
from sssfit.process import asked_to_stop
import time
with asked_to_stop() as stop:
    click.echo("ready")
    while True:
        time.sleep(60)
""",
}
KEEPS_LOCK = {"compiled, lock kept", "one instruction of Python"}


def start(program, folder, *arguments):
    """Start Python."""
    return processes.start([sys.executable, "-c", program, *arguments], cwd=folder)


def start_trial(body, folder):
    program = TRIAL.format(body=textwrap.indent(textwrap.dedent(body), "    "))
    process = fork_server.start([sys.executable, "-c", program], cwd=folder)
    assert process.stdout.readline() == "ready\n", process.stderr.read()
    processes.wait_until_at_work(process)
    return process


def end_of(process, *, within=60.0):
    """Exit status and stderr; a process that goes on for longer fails the test, killed."""
    try:
        _, err = process.communicate(timeout=within)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        raise
    return process.returncode, err


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("name", BODIES)
def test_the_second_signal_ends_it_within_a_second(tmp_path, name, number):
    process = start_trial(BODIES[name], tmp_path)
    process.send_signal(number)
    time.sleep(0.3)
    assert process.poll() is None
    process.send_signal(number)
    status, err = end_of(process, within=1.0)
    if name in KEEPS_LOCK:
        assert (status, err) == (-number, "")  # by the kernel; a shell says 130 and 143
    else:
        assert (status, err) == (130, "\nInterrupted twice: ended at once.\n")


def test_ctrl_c_and_then_sigterm_end_it_as_well(tmp_path):
    process = start_trial(BODIES["compiled, lock released"], tmp_path)
    process.send_signal(signal.SIGINT)
    time.sleep(0.1)
    process.send_signal(signal.SIGTERM)
    assert end_of(process, within=1.0)[0] == 130


def test_a_terminal_that_closes_ends_it_once(tmp_path):
    """Its shell sends SIGHUP, and the kernel again as the shell ends, while work is being saved."""
    body = """
        import time
        try:
            click.echo("ready")
            time.sleep(60)
        finally:
            time.sleep(0.5)
            Path("saved").touch()
    """
    process = start_trial(body, tmp_path)
    for _ in range(3):
        process.send_signal(signal.SIGHUP)
        time.sleep(0.1)
    assert end_of(process) == (130, "\nInterrupted.\n")
    assert (tmp_path / "saved").exists()


WRITING = """
import threading
from sssfit import files

def stuck(stream):
    stream.write(b"half")
    threading.Event().wait()

def write():
    with files.locked(Path("out")), files.temporary_folder() as folder:
        (folder / "picture").write_bytes(b"half")
        Path("told").write_text(str(folder))
        files.write_atomically(Path("out"), stuck)

thread = threading.Thread(target=write)
thread.start()
while not list(Path().glob(".out.*.tmp")):
    pass
click.echo("ready")
thread.join()
"""


@pytest.mark.parametrize("apart_seconds", [0.0, 0.0005, 0.001, 0.002, 0.004, 0.3])
def test_what_is_under_way_is_removed_by_the_second_signal(tmp_path, apart_seconds):
    (tmp_path / "out").write_bytes(b"old")
    process = start_trial(WRITING, tmp_path)
    folder = (tmp_path / "told").read_text()
    assert os.path.isdir(folder)  # noqa: PTH112
    process.send_signal(signal.SIGTERM)
    time.sleep(apart_seconds)
    process.send_signal(signal.SIGINT)
    assert end_of(process, within=1.0)[0] in (130, -signal.SIGINT, -signal.SIGTERM)
    if process.returncode == 130:
        assert_nothing_is_left(tmp_path, folder)
    assert (tmp_path / "out").read_bytes() == b"old"


def test_a_folder_is_removed_though_its_files_are_taken_meanwhile(monkeypatch):
    """As by the first signal's cleaning, while the second one's goes on and ends the process."""
    real = os.unlink

    def taken(*given, **settings):
        real(*given, **settings)
        raise FileNotFoundError

    with files.temporary_folder() as folder:
        (folder / "picture").write_bytes(b"half")
        monkeypatch.setattr(os, "unlink", taken)
        files.remove_unfinished()
        monkeypatch.undo()
        assert not folder.exists()


def assert_nothing_is_left(tmp_path, folder):
    assert sorted(each.name for each in tmp_path.iterdir()) == ["out", "told"]
    assert not os.path.exists(folder)  # noqa: PTH110


def test_ignored_signals_stay_ignored(tmp_path):
    process = processes.start(
        [sys.executable, "-c", TRIAL.format(body="    click.echo('ready')\n    input()")],
        stdin=subprocess.PIPE,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_IGN),
    )
    assert process.stdout.readline() == "ready\n"
    for _ in range(3):
        process.send_signal(signal.SIGINT)
    process.communicate("\n", timeout=60)
    assert process.returncode == 0


# The child says that it goes as soon as the signals are its own and the imports begin.
IMPORTING = """
import sys

class Go:
    def find_spec(self, name, *_):
        if name == "sssfit.cli._main":
            print("go", flush=True)

sys.meta_path.insert(0, Go())
from sssfit.cli import main
main(sys.argv[1:])
"""
VERBS = (
    ("simulate", "skin1", "--photons", "1e9"),
    ("simulate", "skin1", "--method", "exact"),
    ("choose", "skin1"),
)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("times", [1, 2])
def test_a_signal_during_imports_leaves_no_traceback(tmp_path, number, times):
    chance = random.Random(times)
    for k in range(9):
        process = start(IMPORTING, tmp_path, *VERBS[k % len(VERBS)])
        assert process.stdout.readline() == "go\n"
        time.sleep(chance.choice([0.0, chance.uniform(0.0, 0.1), chance.uniform(0.0, 1.0)]))
        for _ in range(times):
            process.send_signal(number)
        status, err = end_of(process)
        assert status == 130 or (times == 2 and status == -number), err
        assert "Traceback" not in err
        assert "Exception" not in err
        assert not list(tmp_path.glob("*.tmp"))


@pytest.mark.parametrize("step", ["_keep_matplotlib_quiet", "_refuse"])
def test_a_signal_beside_what_the_verbs_catch_leaves_no_traceback(monkeypatch, capsys, step):
    """As in the instructions between the imports and the first verb, or while an error is told."""

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(cli_main, step, interrupted)
    with pytest.raises(SystemExit) as end:
        main(["show", "no-such-file"])
    assert end.value.code == 130
    assert capsys.readouterr().err == "Interrupted.\n"


# A look at what is imported where.
IMPORTED_IN_THREADS = """
import sys, threading
late = []

class Note:
    def find_spec(self, name, *_):
        if threading.current_thread() is not threading.main_thread():
            late.append(name)

sys.meta_path.insert(0, Note())
from sssfit.cli import main
try:
    main(sys.argv[1:])
except SystemExit as end:
    assert not end.code
print("imported in threads:", *late)
"""


@pytest.mark.parametrize(
    "arguments",
    [
        ("simulate", "skin1", "--photons", "2e4"),
        ("simulate", "skin1", "--method", "exact", "--tolerance", "10%"),
        ("render", "wax.kernel.json", "--size", "32x32"),
    ],
)
def test_nothing_is_imported_after_threads_have_started(tmp_path, arguments):
    profile = make_profile(np.arange(21) * 0.1, np.full((20, 3), 0.01))
    fit_svd(profile, rank=1, mm_per_pixel="profile").kernel.save(tmp_path / "wax.kernel.json")
    process = start(IMPORTED_IN_THREADS, tmp_path, *arguments, "-q")
    out, err = process.communicate(timeout=300)
    assert (process.returncode, err) == (0, "")
    assert out.splitlines()[-1] == "imported in threads:"
