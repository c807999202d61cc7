"""The command line: ``main`` takes the signals in hand, then imports the verbs and runs one.

Importing click and the verbs takes 60 ms, in which Ctrl-C should already end the program in order:
so nothing but the handling of signals is imported here.
"""

from __future__ import annotations

import sys

try:
    from typing import TYPE_CHECKING, Any

    from sssfit.process import Interrupts
except KeyboardInterrupt:  # in the few milliseconds before the signals are ours
    raise SystemExit(130) from None

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import NoReturn

    from ._main import cli

__all__ = ["cli", "main"]


def main(args: Sequence[str] | None = None) -> NoReturn:
    """Run the command line and exit; the console script's entry point.

    With ``args`` the caller may go on afterwards, and gets its signal handlers back.
    """
    interrupts = Interrupts()
    interrupts.take()
    try:
        from ._main import run

        run(args)
    except KeyboardInterrupt:  # between the imports and what `run` catches, or after that
        sys.stderr.write("Interrupted.\n")
        raise SystemExit(130) from None
    finally:
        if args is not None:
            interrupts.give_back()


def __getattr__(name: str) -> Any:
    """Import the group of verbs when somebody asks for it."""
    if name == "cli":
        from ._main import cli

        return cli
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
