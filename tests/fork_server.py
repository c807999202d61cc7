"""Children that are forked from a process with everything loaded: start-up is paid for once.

`start` and `run` stand for `processes.start` and `subprocess.run`, for ``python -m sssfit.cli ...``
and ``python -c ...``: a command that walks photons takes .2 s of processor time in place of 2. The
child is a process like any other, with signals, streams, variables, crash and end of its own. What
it does not show is how imports go, how machine code is loaded, and what a limit does to either.

Run as a program this is the server, which reads requests from a socket. It must not have used what
a fork cannot take along, such as OpenImageIO's threads.
"""

import atexit
import contextlib
import gc
import importlib
import inspect
import json
import os
import runpy
import select
import signal
import socket
import struct
import subprocess
import sys
import threading
import traceback
from pathlib import Path

import processes

# What verbs import when they are run.
_LOADED = (
    *("sssfit.chart", "sssfit.chart.profile", "sssfit.choose", "sssfit.cli._main"),
    *("sssfit.compare", "sssfit.export", "sssfit.fit", "sssfit.fit.cascade", "sssfit.formats.csv"),
    *("sssfit.formats.mci", "sssfit.formats.mco", "sssfit.motion.runner", "sssfit.render.screen"),
    "sssfit.simulate",
    *("colour", "distributed", "matplotlib.pyplot"),
    *("scipy.optimize", "scipy.sparse.linalg", "scipy.special"),
)
_NUMBER = struct.Struct("=q")  # a length, a process, or the status that it ended with
_STREAMS = 3


def start(command, **options):
    """Start a child with pipes for text; ``processes.end_all`` ends it, if the test does not."""
    if os.name != "posix":
        return processes.start(command, **options)
    options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True} | options
    return processes.ended_with_the_test(_Forked(command, **options))


def run(command, *, timeout=None, **options):
    """Run a child to its end; return what `subprocess.run` does where it captures text."""
    process = start(command, **options)
    out, err = process.communicate(timeout=timeout)
    return subprocess.CompletedProcess(command, process.returncode, out, err)


class _Forked(subprocess.Popen):
    """A child of the server, which tells its number and, when it has ended, its status."""

    def _execute_child(self, *given, **named):
        asked = inspect.signature(subprocess.Popen._execute_child).bind(self, *given, **named)
        value = asked.arguments
        assert value["preexec_fn"] is None
        variables = os.environ if value["env"] is None else value["env"]
        request = json.dumps(
            {
                "command": [str(each) for each in self.args[1:]],
                "folder": str(value["cwd"] or Path.cwd()),
                "variables": dict(variables),
            }
        ).encode()
        streams = value["p2cread"], value["c2pwrite"], value["errwrite"]
        fds = [number if fd == -1 else fd for number, fd in enumerate(streams)]
        self._told, told = os.pipe()
        socket.send_fds(_server(), [_NUMBER.pack(len(request))], [*fds, told])
        _server().sendall(request)
        os.close(told)
        pipes = ("p2cread", "p2cwrite", "c2pread", "c2pwrite", "errread", "errwrite")
        self._close_pipe_fds(*(value[each] for each in pipes))
        self.pid, self._child_created = self._number(), True

    def _number(self):
        (number,) = _NUMBER.unpack(os.read(self._told, _NUMBER.size))
        return number

    def _try_wait(self, flags):
        seconds = 0.0 if flags == os.WNOHANG else None
        if not select.select([self._told], [], [], seconds)[0]:
            return 0, 0
        status = self._number()
        os.close(self._told)
        return self.pid, status

    def _internal_poll(self, *_given, **_named):
        if self.returncode is None:
            pid, status = self._try_wait(os.WNOHANG)
            if pid:
                self._handle_exitstatus(status)
        return self.returncode


_kept = []  # the server, and the socket to it


def _server():
    """The socket of this process's server, which is started when it is first asked for."""
    if not _kept:
        _walk()  # compiled now, if it was not: the server only loads it
        ours, theirs = socket.socketpair()
        with theirs:
            command = [sys.executable, __file__, str(theirs.fileno())]
            _kept.extend((subprocess.Popen(command, pass_fds=[theirs.fileno()]), ours))
    return _kept[1]


def close():
    """End the server, if there is one."""
    while _kept:
        process, ours = _kept
        ours.close()
        process.wait()
        _kept.clear()


def _walk():
    from sssfit.material import load_material
    from sssfit.simulate import simulate_montecarlo

    simulate_montecarlo(load_material("skin1"), photons=1000, threads=1)


def _serve(requests):
    """Fork a child for each request, in which it is returned; None when there are no more."""
    for name in _LOADED:
        importlib.import_module(name)
    _walk()
    gc.freeze()  # children that look for garbage then copy no page of it
    signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored in a shell's background job
    woken, waker = socket.socketpair()
    waker.setblocking(False)
    signal.set_wakeup_fd(waker.fileno())
    signal.signal(signal.SIGCHLD, lambda *_: None)
    told = {}
    while True:
        ready = select.select([requests, woken], [], [])[0]
        if woken in ready:
            woken.recv(4096)
            _tell_ends(told)
        if requests not in ready:
            continue
        head, fds, _, _ = socket.recv_fds(requests, _NUMBER.size, _STREAMS + 1)
        if not head:
            return None
        request = json.loads(requests.recv(*_NUMBER.unpack(head), socket.MSG_WAITALL))
        child = os.fork()
        if child == 0:
            signal.set_wakeup_fd(-1)
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            for each in (requests, woken, waker):
                each.close()
            for fd in (*told.values(), fds.pop()):
                os.close(fd)
            return request | {"streams": fds}
        told[child] = fds.pop()
        os.write(told[child], _NUMBER.pack(child))
        for fd in fds:
            os.close(fd)


def _tell_ends(told):
    """Tell the status of every child that has ended."""
    while told:
        child, status = os.waitpid(-1, os.WNOHANG)
        if not child:
            return
        with contextlib.suppress(BrokenPipeError):  # nobody asks any more
            os.write(told[child], _NUMBER.pack(status))
        os.close(told.pop(child))


def _become(request):
    """Be the command that was asked for, in its folder, with its streams and variables."""
    os.chdir(request["folder"])
    os.environ.clear()
    os.environ.update(request["variables"])
    for number, fd in enumerate(request["streams"]):
        os.dup2(fd, number)
        os.close(fd)
    sys.stdin = sys.__stdin__ = open(0, closefd=False)  # noqa: SIM115 (as a new process has them)
    sys.stdout = sys.__stdout__ = open(1, "w", closefd=False)  # noqa: SIM115
    sys.stderr = sys.__stderr__ = open(2, "w", 1, errors="backslashreplace", closefd=False)  # noqa: SIM115
    option, program, *arguments = request["command"]
    sys.argv = [option, *arguments]
    if option == "-m":
        runpy.run_module(program, run_name="__main__", alter_sys=True)
    else:
        exec(compile(program, "<string>", "exec"), {"__name__": "__main__"})


def _ended(request):
    """The exit status of a command that came to its end, said as Python says it."""
    status = 0
    try:
        _become(request)
    except SystemExit as end:
        status = end.code
        if not isinstance(status, int | None):
            print(status, file=sys.stderr)
            status = 1
    except KeyboardInterrupt:
        traceback.print_exc()
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        os.kill(os.getpid(), signal.SIGINT)
    except BaseException:
        traceback.print_exc()
        status = 1
    threading._shutdown()  # waits for threads
    atexit._run_exitfuncs()
    try:
        sys.stdout.flush()
    except OSError as error:
        print(f"Exception ignored: {error!r}", file=sys.stderr)
        status = 120
    return status or 0


if __name__ == "__main__":
    with socket.socket(fileno=int(sys.argv[1])) as asked:
        wanted = _serve(asked)
    # To take everything down that is loaded costs 1.2 s, and nobody looks; OpenImageIO complains.
    os._exit(0 if wanted is None else _ended(wanted))
