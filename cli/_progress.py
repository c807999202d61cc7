"""Progress on stderr: bars of a photon walk and of counted steps, a word before compiling."""

from __future__ import annotations

import contextlib
import logging
import math
import sys
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sssfit.simulate import Progress as WalkProgress


@contextlib.contextmanager
def walk_progress(label: str) -> Iterator[Callable[[WalkProgress], None] | None]:
    """Yield a progress callback; None unless in a terminal, where the bar goes once it is full."""
    if not _is_shown():
        yield None
        return
    from rich.progress import TextColumn

    texts = ("{task.percentage:3.0f} %", "{task.fields[rate]}", "error {task.fields[error]}")
    # rich's own column of the time left loses its memory whenever the total changes, which under a
    # target error is at every check.
    columns = [TextColumn(each) for each in (*texts, "{task.fields[left]}")]
    bar, task = _bar(label, None, columns, rate="", error="-", left="")
    first: list[WalkProgress] = []

    def report(now: WalkProgress) -> None:
        # The bar appears with the first figures: a refused setting should leave one line only.
        bar.start()
        first.append(now)
        error = now.relative_error
        bar.update(
            task,
            total=now.photons,
            completed=now.photons_done,
            rate=f"{now.photons_done / max(now.seconds, 1e-9):,.0f}/s",
            error=f"{100.0 * error:.2g} %" if math.isfinite(error) else "-",
            left=now.time_left(first[0]),
        )
        del first[1:]

    try:
        yield report
    finally:
        if bar.live.is_started:
            bar.stop()


@contextlib.contextmanager
def step_progress(label: str) -> Iterator[Callable[[int, int, str], None] | None]:
    """Yield a callback for (done, of how many, the next one's name); None unless in a terminal."""
    if not _is_shown():
        yield None
        return
    from rich.progress import TextColumn, TimeElapsedColumn

    columns = [TimeElapsedColumn(), TextColumn("{task.fields[step]}")]
    bar, task = _bar(label, 40, columns, step="")
    with bar:
        yield lambda done, total, step: bar.update(
            task, completed=done, total=total, step=f"{done} of {total}, {step}"
        )


def _bar(label: str, width: int | None, columns: list[Any], **fields: Any) -> tuple[Any, Any]:
    """Return a bar on stderr that goes once it is full, and its task; None is as wide as can be."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    heads = TextColumn("{task.description}"), BarColumn(width)
    bar = Progress(*heads, *columns, console=Console(stderr=True), transient=True)
    return bar, bar.add_task(label, total=None, **fields)


def _is_shown() -> bool:
    """Tell whether somebody looks on: a bar that was redrawn is litter in a log."""
    shown = logging.getLogger("sssfit").isEnabledFor(logging.INFO)  # not under -q
    return shown and sys.stderr is not None and sys.stderr.isatty()
