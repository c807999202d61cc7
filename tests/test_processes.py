"""Children of tests are interrupted by SIGINT, and do not outlive a test that fails."""

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from processes import end_all, start

TESTS = Path(__file__).parent
WAITS = [sys.executable, "-c", "import time\nprint('ready', flush=True)\ntime.sleep(60)"]


@pytest.mark.skipif(os.name != "posix", reason="signals are POSIX")
def test_a_child_is_interrupted_where_the_parent_ignores_it():
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        process = start(WAITS)
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
        assert process.stdout.readline() == "ready\n"
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=20)
    finally:
        signal.signal(signal.SIGINT, before)
    assert process.returncode == -signal.SIGINT
    assert err.endswith("KeyboardInterrupt\n")


@pytest.mark.skipif(os.name != "posix", reason="signals are POSIX")
def test_tests_of_interrupts_pass_where_the_parent_ignores_it():
    # What a background job of a shell is: sh -c 'pytest ... &'.
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider"]
    command += ["-k", "interrupted_fit and 2", str(TESTS / "test_cli_fit_unlucky.py")]
    ended = subprocess.run(
        ["sh", "-c", 'trap "" INT; exec "$@"', "sh", *command],
        cwd=TESTS.parent,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert ended.returncode == 0, ended.stdout
    assert "2 passed" in ended.stdout


def test_no_child_outlives_a_test_that_fails():
    process = start(WAITS)
    assert process.stdout.readline() == "ready\n"
    end_all()  # as the fixture of conftest.py does after every test
    assert process.returncode is not None
    assert process.stdout.closed
    ended = start([sys.executable, "-c", ""])
    ended.communicate(timeout=20)
    end_all()
    assert ended.returncode == 0


def test_tests_start_processes_so_only():
    for path in TESTS.glob("test_*.py"):
        if path.name != Path(__file__).name:
            assert not re.search(r"subprocess\.Popen\(", path.read_text(encoding="utf-8")), path
