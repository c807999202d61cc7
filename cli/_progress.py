"""Progress on stderr: bars of a photon walk and of counted steps, a word before compiling."""

from __future__ import annotations

import contextlib
import math
import sys
from collections.abc import Callable, Iterator
from datetime import timedelta
from typing import TYPE_CHECKING

from ._options import Common
from ._output import say

if TYPE_CHECKING:
    from sssfit.material import Material
    from sssfit.simulate import Progress as WalkProgress


@contextlib.contextmanager
def walk_progress(label: str, *, quiet: bool) -> Iterator[Callable[[WalkProgress], None] | None]:
    """Yield a progress callback; None unless in a terminal, where the bar goes once it is full."""
    if not _is_shown(quiet):
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(bar_width=None),
        TextColumn("{task.percentage:3.0f} %"),
        TextColumn("{task.fields[rate]}"),
        TextColumn("error {task.fields[error]}"),
        TextColumn("{task.fields[left]}"),
        console=Console(stderr=True),
        transient=True,
    )
    task = bar.add_task(label, total=None, rate="", error="-", left="")
    first: list[WalkProgress] = []

    def report(now: WalkProgress) -> None:
        # The bar appears with the first figures: a refused setting should leave one line only.
        bar.start()
        first.append(now)
        del first[1:]
        error = now.relative_error
        bar.update(
            task,
            total=now.photons,
            completed=now.photons_done,
            rate=f"{now.photons_done / max(now.seconds, 1e-9):,.0f}/s",
            error=f"{100.0 * error:.2g} %" if math.isfinite(error) else "-",
            left=time_left(first[0], now),
        )

    try:
        yield report
    finally:
        if bar.live.is_started:
            bar.stop()


def _is_shown(quiet: bool) -> bool:
    """Tell whether somebody looks on: a bar that was redrawn is litter in a log."""
    return not quiet and sys.stderr is not None and sys.stderr.isatty()


@contextlib.contextmanager
def step_progress(label: str, *, quiet: bool) -> Iterator[Callable[[int, int, str], None] | None]:
    """Yield a callback for (done, of how many, the next one's name); None unless in a terminal."""
    if not _is_shown(quiet):
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.fields[step]}"),
        console=Console(stderr=True),
        transient=True,
    )
    task = bar.add_task(label, total=None, step="")
    with bar:
        yield lambda done, total, step: bar.update(
            task, completed=done, total=total, step=f"{done} of {total}, {step}"
        )


def time_left(first: WalkProgress, now: WalkProgress) -> str:
    """Say how long the rest takes at the rate since the first report, as h:mm:ss.

    That rate knows neither compilation nor earlier sittings. rich's own column loses its memory
    whenever the total changes, which under a target error is at every check.
    """
    done = now.photons_done - first.photons_done
    if now.photons == now.photons_done:
        return "0:00:00"
    if done <= 0:
        return "-:--:--"
    rest = (now.photons - now.photons_done) / done * (now.seconds - first.seconds)
    return str(timedelta(seconds=round(rest)))


def say_if_compiling(common: Common, *, walk: Material | None = None, solver: bool = False) -> None:
    """Say that the walk of a material, or the exact solver, is about to be compiled."""
    from sssfit.simulate import compiling_note

    wanted = [None] * solver + [walk] * (walk is not None)
    for note in filter(None, map(compiling_note, wanted)):
        say(common, note)
