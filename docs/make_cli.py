"""Write docs/cli.md from the verbs' own ``--help``: ``python docs/make_cli.py``.

``tests/test_docs.py`` compares the file with ``page()``, so it cannot fall behind the program.
"""

import os
import subprocess
import sys
from pathlib import Path

from sssfit.cli import cli

_HEAD = """\
# Verbs and options

<!-- Made by `python docs/make_cli.py` from the program's own help; edit that, not this. -->
"""


def help_text(*verb: str) -> str:
    """Return what ``sssfit VERB --help`` prints in a terminal of 80 columns.

    From a process of its own: click's test runner wraps its lines at another width.
    """
    return subprocess.run(
        [sys.executable, "-m", "sssfit.cli", *verb, "--help"],
        env=os.environ | {"COLUMNS": "80", "PYTHONUTF8": "1"},
        stdout=subprocess.PIPE,
        encoding="utf-8",
        check=True,
    ).stdout


def page() -> str:
    """Return the whole of docs/cli.md."""
    sections = [_HEAD]
    for verb in [(), *((name,) for name in cli.commands)]:
        title = " ".join(("sssfit", *verb))
        sections.append(f"## {title}\n\n```\n{help_text(*verb).rstrip()}\n```\n")
    return "\n".join(sections)


if __name__ == "__main__":
    Path(__file__).with_name("cli.md").write_text(page(), encoding="utf-8", newline="\n")
