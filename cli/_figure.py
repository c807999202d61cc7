"""Where a verb's figure goes: checked and held before the drawing, written after it."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from ._outputs import held
from ._report import binary_stdout


@contextlib.contextmanager
def chart_output(
    path: Path | None, *, inputs: Iterable[str | Path | None], force: bool
) -> Iterator[Callable[[Any], None]]:
    """Hold an output and yield what writes a matplotlib Figure to it; None is PNG on stdout."""
    with held_charts([path], inputs=inputs, force=force):
        yield lambda figure: write_chart(figure, path)


def held_charts(
    paths: Sequence[Path | None], *, inputs: Iterable[str | Path | None], force: bool
) -> contextlib.AbstractContextManager[None]:
    """Hold the outputs of charts; formats are known by their endings."""
    from sssfit.chart.files import chart_format, is_chart_file

    for path in paths:
        if path is not None:
            chart_format(path)
    return held(paths, is_chart_file, inputs=inputs, force=force)


def write_chart(figure: Any, path: Path | None) -> None:
    """Write a figure to a file that is held; None is PNG on stdout."""
    from sssfit.chart.page import save_figure

    if path is not None:
        save_figure(figure, path)
        return
    save_figure(figure, binary_stdout(), format="png")
    binary_stdout().flush()


def chart_path(name: str) -> Path | None:
    """``-`` is stdout."""
    return None if name == "-" else Path(name)
