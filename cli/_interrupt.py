"""Ctrl-C and SIGTERM as a request to end well: the first one is noted, the second one ends."""

import contextlib
import signal
from collections.abc import Callable, Iterator
from types import FrameType


@contextlib.contextmanager
def asked_to_stop() -> Iterator[Callable[[], bool]]:
    """Yield a function that tells whether SIGINT or SIGTERM has arrived since.

    After the first signal the former handlers stand again, so an impatient second Ctrl-C ends the
    process at once; files are renamed into place whole, so even that leaves no half-written one.
    """
    asked = False
    before: dict[signal.Signals, signal._HANDLER] = {}

    def restore() -> None:
        for number, handler in before.items():
            signal.signal(number, handler)

    def note(_signal: int, _frame: FrameType | None) -> None:
        nonlocal asked
        asked = True
        restore()

    for number in (signal.SIGINT, signal.SIGTERM):
        before[number] = signal.signal(number, note)
    try:
        yield lambda: asked
    finally:
        restore()
