"""The progress bar of a photon walk, on stderr: rate, time left and the present error."""

import contextlib
import math
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sssfit.simulate import Progress as WalkProgress


@contextlib.contextmanager
def walk_progress(label: str, *, quiet: bool) -> Iterator[Callable[["WalkProgress"], None] | None]:
    """Yield a progress callback; None with ``quiet``. Piped, it leaves one line at the end."""
    if quiet:
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(bar_width=None),
        TextColumn("{task.percentage:3.0f} %"),
        TextColumn("{task.fields[rate]}"),
        TextColumn("error {task.fields[error]}"),
        TimeRemainingColumn(),
        console=Console(stderr=True),
    )
    task = bar.add_task(label, total=None, rate="", error="-")

    def report(now: "WalkProgress") -> None:
        # The bar appears with the first figures: a refused setting should leave one line only.
        bar.start()
        error = now.relative_error
        bar.update(
            task,
            total=now.photons,
            completed=now.photons_done,
            rate=f"{now.photons_done / max(now.seconds, 1e-9):,.0f}/s",
            error=f"{100.0 * error:.2g} %" if math.isfinite(error) else "-",
        )

    try:
        yield report
    finally:
        if bar.live.is_started:
            bar.stop()
