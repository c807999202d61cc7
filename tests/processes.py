"""Child processes of tests: interruptible whatever the parent ignores, and gone after the test."""

import signal
import subprocess
import time
from pathlib import Path

_started = []


def start(command, **options):
    """Start a child with pipes for text; `end_all` ends it, if the test does not.

    A shell starts background jobs with SIGINT ignored; Python and exec leave that as it is. A child
    of such a test run would not be interrupted by a SIGINT, so it is started with the default.
    """
    options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True} | options
    before = signal.getsignal(signal.SIGINT)
    # exec turns a handler into the default, and keeps only what is ignored.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        process = subprocess.Popen(command, **options)
    finally:
        signal.signal(signal.SIGINT, before)
    return ended_with_the_test(process)


def wait_until_at_work(process):
    """Wait until a child is past the step from its last word to what it then does.

    It sleeps by then, or has computed for 10 ms; where nothing tells, it is given time for that.
    """
    path, begun = Path(f"/proc/{process.pid}/stat"), None
    if not path.exists():
        return time.sleep(0.15)
    while True:
        state, *fields = path.read_text().rpartition(")")[2].split()
        ticks = int(fields[10]) + int(fields[11])
        begun = ticks if begun is None else begun
        if state == "S" or ticks >= begun + 2:
            return None
        time.sleep(0.005)


def ended_with_the_test(process):
    """Let `end_all` end a process, too."""
    _started.append(process)
    return process


def end_all():
    """Kill what still runs of the processes started, close their pipes and wait for their end."""
    while _started:
        process = _started.pop()
        process.kill()
        for stream in (process.stdin, process.stdout, process.stderr):
            if stream is not None:
                stream.close()
        process.wait()
