"""Record what the invocations of ``approval_commands`` do now: ``python tests/approve.py [VERB]``.

Read the difference (``git diff tests/approved``) before you commit it: a fault that is approved is
worse than no test.
"""

import sys
import time
import warnings
from pathlib import Path

from approval_commands import COMMANDS
from approval_files import lines_of
from approval_run import Command, run

FOLDER = Path(__file__).parent / "approved"
_MARK = "$ "  # no line of an output begins with it: those have a bar before them


def recorded(command: Command) -> list[str]:
    """What an invocation does now."""
    return lines_of(command, run(command))


def approved(group: str) -> dict[str, list[str]]:
    """What the invocations of a group are to do, by their titles."""
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
    for command in COMMANDS[group]:
        begun = time.process_time()
        parts.append("\n".join([f"{_MARK}{command.title}", *recorded(command)]))
        if (seconds := time.process_time() - begun) > 0.5:
            print(f"{seconds:5.1f} s  {command.title}")
    FOLDER.mkdir(exist_ok=True)
    text = "\n\n".join(parts) + "\n"
    (FOLDER / f"{group}.txt").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    warnings.simplefilter("error")
    for name in sys.argv[1:] or COMMANDS:
        begun = time.process_time()
        approve(name)
        print(f"{name}: {time.process_time() - begun:.1f} s of processor time")
