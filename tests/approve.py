"""Record what the lines of ``approval_commands`` and ``approval_calls`` do now.

``python tests/approve.py`` records all, ``python tests/approve.py fit python-compare`` two groups.

Read the difference (``git diff tests/approved``) before you commit it: a fault that is approved is
worse than no test.
"""

import functools
import sys
import time
import warnings
from pathlib import Path

import processor  # isort: skip  # noqa: F401 (before numpy)
import approval_calls as calls
from approval_calls import CALLS, Call
from approval_commands import COMMANDS
from approval_files import lines_of
from approval_run import Command, run
from threadpoolctl import threadpool_limits

FOLDER = Path(__file__).parent / "approved"
_MARK = "$ "  # no line of an output begins with it: those have a bar before them


EVERY: dict[str, list[Command] | list[Call]] = COMMANDS | CALLS


def recorded(each: Command | Call) -> list[str]:
    """What an invocation or a call does now."""
    return calls.lines_of(each) if isinstance(each, Call) else lines_of(each, run(each))


@functools.cache
def approved(group: str) -> dict[str, list[str]]:
    """What the invocations or calls of a group are to do, by their titles."""
    path = FOLDER / f"{group}.txt"
    found: dict[str, list[str]] = {}
    for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else []:
        if line.startswith(_MARK):
            lines = found.setdefault(line.removeprefix(_MARK), [])
        elif line:
            lines.append(line)
    return found


def approve(group: str) -> None:
    parts = []
    for command in EVERY[group]:
        begun = time.process_time()
        parts.append("\n".join([f"{_MARK}{command.title}", *recorded(command)]))
        if (seconds := time.process_time() - begun) > 0.5:
            print(f"{seconds:5.1f} s  {command.title}")
    FOLDER.mkdir(exist_ok=True)
    text = "\n\n".join(parts) + "\n"
    (FOLDER / f"{group}.txt").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    warnings.simplefilter("error")
    # As in conftest.py: products of several threads have other last digits.
    threadpool_limits(limits=1, user_api="blas")
    for name in sys.argv[1:] or EVERY:
        begun = time.process_time()
        approve(name)
        print(f"{name}: {time.process_time() - begun:.1f} s of processor time")
