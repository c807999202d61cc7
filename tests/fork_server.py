"""A process that forks itself for each command line: imports are paid for once, crashes alone.

Run as a program it reads requests from stdin, a line of JSON each, and answers each with a line on
stdout. It must not have used what a fork cannot take along, such as OpenImageIO's threads, and so
is a process of its own beside the tests.
"""

import contextlib
import importlib
import json
import os
import signal
import subprocess
import sys
import time
import warnings
from pathlib import Path

# What verbs import when they are run.
_LOADED = (
    *(
        "sssfit.chart.profile",
        "sssfit.compare",
        "sssfit.export",
        "sssfit.fit",
        "sssfit.motion.runner",
    ),
    *(
        "sssfit.formats.mci",
        "sssfit.formats.mco",
        "sssfit.formats.csv",
        "sssfit.render.screen",
        "sssfit.simulate",
        "sssfit.cli",
    ),
    *("colour", "matplotlib.pyplot", "scipy.sparse.linalg", "OpenImageIO"),
)


class Forks:
    """The client: `run` gives a command line's exit status, what it printed, and if it was cut."""

    def __init__(self):
        self._server = subprocess.Popen(
            [sys.executable, __file__], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def run(self, folder, arguments, stdin, *, cut, most):
        """After ``cut`` seconds it is interrupted, after ``most`` killed (status -9)."""
        names = {name: str(folder.parent / name) for name in ("stdin", "stdout", "stderr")}
        Path(names["stdin"]).write_bytes(stdin)
        request = {"folder": str(folder), "arguments": arguments, "cut": cut, "most": most} | names
        self._server.stdin.write(json.dumps(request) + "\n")
        self._server.stdin.flush()
        answer = json.loads(self._server.stdout.readline())
        printed = [Path(names[name]).read_bytes().decode() for name in ("stdout", "stderr")]
        return answer["status"], *printed, answer["is_cut"]

    def close(self):
        """End the server."""
        self._server.stdin.close()
        self._server.stdout.close()
        self._server.wait()


def _serve():
    for name in _LOADED:
        importlib.import_module(name)
    warnings.simplefilter("error")
    for line in sys.stdin:
        request = json.loads(line)
        child = os.fork()
        if child == 0:
            _run(request)
        status, is_cut = _waited_for(child, request["cut"], request["most"])
        print(json.dumps({"status": status, "is_cut": is_cut}), flush=True)


def _run(request):
    """Be the command line, with files for stdin, stdout and stderr; does not return."""
    status = 99
    try:
        os.chdir(request["folder"])
        for number, name in enumerate(("stdin", "stdout", "stderr")):
            flags = os.O_RDONLY if number == 0 else os.O_WRONLY | os.O_CREAT | os.O_TRUNC
            os.dup2(os.open(request[name], flags), number)
        sys.stdin, sys.stdout, sys.stderr = (
            open(number, mode, closefd=False)  # noqa: SIM115 (as a new process has them)
            for number, mode in enumerate("rww")
        )
        from sssfit.cli import main

        main(request["arguments"])
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else 0
    finally:
        with contextlib.suppress(OSError, ValueError):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(status)


def _waited_for(child, cut, most):
    """Exit status, and whether it had to be interrupted."""
    begun, is_cut = time.perf_counter(), False
    while (seconds := time.perf_counter() - begun) < most:
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            return os.waitstatus_to_exitcode(status), is_cut
        if seconds > cut and not is_cut:
            is_cut = True
            os.kill(child, signal.SIGINT)
        time.sleep(0.005)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return -signal.SIGKILL, is_cut


if __name__ == "__main__":
    _serve()
