"""Where a verb's figure goes: checked and held before the drawing, written after it."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from ._report import binary_stdout


@contextlib.contextmanager
def chart_output(path: Path | None, *, force: bool) -> Iterator[Callable[[Any], None]]:
    """Hold an output and yield what writes a matplotlib Figure to it; None is PNG on stdout."""
    from sssfit._chart_files import is_chart_file
    from sssfit.files import check_output, locked

    def save(figure: Any) -> None:
        from sssfit.chart import save_figure

        if path is not None:
            save_figure(figure, path)
            return
        save_figure(figure, binary_stdout(), format="png")
        binary_stdout().flush()

    if path is None:
        binary_stdout()  # closed: said now and not after the drawing
        yield save
        return
    check_output(path, is_chart_file, force=force)
    with locked(path):
        yield save
