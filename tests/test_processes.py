"""Children of tests are interrupted by SIGINT, and do not outlive a test that fails."""

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import fork_server
import inner_pytest
import pytest
from processes import end_all, start

STARTS = (start, fork_server.start)
TESTS = Path(__file__).parent
WAITS = [sys.executable, "-c", "import time\nprint('ready', flush=True)\ntime.sleep(60)"]


@pytest.mark.skipif(os.name != "posix", reason="signals are POSIX")
@pytest.mark.parametrize("start", STARTS, ids=["started", "forked"])
def test_a_child_is_interrupted_where_the_parent_ignores_it(start):
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
    command = [*inner_pytest.COMMAND, "-q"]
    command += ["-k", "during_imports and 1-2", str(TESTS / "test_interrupts.py")]
    ended = subprocess.run(
        ["sh", "-c", 'trap "" INT; exec "$@"', "sh", *command],
        cwd=TESTS.parent,
        env=inner_pytest.ENVIRONMENT,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert ended.returncode == 0, ended.stdout
    assert "1 passed" in ended.stdout


@pytest.mark.parametrize("start", STARTS, ids=["started", "forked"])
def test_no_child_outlives_a_test_that_fails(start):
    process = start(WAITS)
    assert process.stdout.readline() == "ready\n"
    end_all()  # as the fixture of conftest.py does after every test
    assert process.returncode is not None
    assert process.stdout.closed
    ended = start([sys.executable, "-c", ""])
    ended.communicate(timeout=20)
    end_all()
    assert ended.returncode == 0


@pytest.mark.skipif(os.name != "posix", reason="forks are POSIX")
def test_a_forked_child_ends_as_one_that_was_started(tmp_path):
    for program in (
        "import sys; print(sys.argv, sys.stdin.read()); sys.exit(3)",
        "import os, sys; os.write(2, os.environ['MINE'].encode() + os.getcwd().encode())",
        "import sys; sys.exit('no')",
        "raise SystemExit",
        "import os, signal; os.kill(os.getpid(), signal.SIGTERM)",
        "import atexit; atexit.register(print, 'last'); print('first')",
        "import threading as t, time; t.Thread(target=lambda: time.sleep(.1) or print(1)).start()",
    ):
        options = {"cwd": tmp_path, "env": os.environ | {"MINE": "yes"}}
        command = [sys.executable, "-c", program, "a", "b"]
        ended = [begin(command, stdin=subprocess.DEVNULL, **options) for begin in STARTS]
        one, other = [(each.communicate(timeout=60), each.returncode) for each in ended]
        assert one == other
    ended = [begin([sys.executable, "-c", "1 / 0"]) for begin in STARTS]
    one, other = [each.communicate(timeout=60)[1].splitlines()[-1] for each in ended]
    assert one == other == "ZeroDivisionError: division by zero"
    assert [each.returncode for each in ended] == [1, 1]


def test_tests_start_processes_so_only():
    for path in TESTS.glob("test_*.py"):
        if path.name != Path(__file__).name:
            assert not re.search(r"subprocess\.Popen\(", path.read_text(encoding="utf-8")), path
