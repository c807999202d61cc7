"""What a verb puts out: files held and written, results on stdout, words on stderr."""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO

import click

from sssfit.messages import printable

from ._options import Common, in_options

# What is written, and the ending of its name.
PROFILE, KERNEL = ("a profile", ".npz"), ("a kernel", ".json")
_ENDINGS = (".checkpoint", ".npz", ".json", ".toml", ".kernel", ".taps", ".profile")


def say(common: Common, line: str) -> None:
    """Put a word on stderr, unless -q."""
    if not common.quiet:
        click.echo(printable(in_options(line)), err=True)


def say_notes(common: Common, notes: Iterable[str]) -> None:
    """Put the library's notes on stderr, unless -q."""
    for note in notes:
        say(common, note)


def finish(
    common: Common, figures: Mapping[str, Any], text: str, *, to_stderr: bool = False
) -> None:
    """End a verb: its JSON object with ``--json``, else its text unless ``-q``.

    ``to_stderr`` moves the text out of the way of data that went to stdout (``-o -``).
    """
    if common.json:
        from sssfit.arrays import plain

        click.echo(json.dumps(plain(figures), allow_nan=False), err=to_stderr)
    elif not common.quiet:
        click.echo(_legible(in_options(text), figures), err=to_stderr)


def finish_one(
    common: Common, verb: str, path: Path | None, figures: Mapping[str, Any], text: str, what: str
) -> None:
    """End a verb that wrote one file; None is ``what`` on stdout."""
    whole = {"command": verb, "output": [str(path or "-")], **figures}
    words = f"{text}\n" * bool(text) + f"Wrote {path or f'{what} to stdout'}"
    finish(common, whole, words, to_stderr=path is None)


def _legible(text: str, figures: Mapping[str, Any]) -> str:
    """Escape what would move the cursor; a name that holds a newline stays on its line."""
    for name in (*figures.get("output", ()), *figures.values()):
        if isinstance(name, str) and "\n" in name:
            text = text.replace(name, printable(name))
    return "\n".join(printable(line) for line in text.split("\n"))


def binary_stdout() -> BinaryIO:
    """Return stdout for bytes, or say in one line that it is closed."""
    from sssfit.errors import FileError

    if sys.stdout is None:
        raise FileError("stdout is closed; name a file with -o, or pipe the output somewhere.")
    return sys.stdout.buffer


def target(output: str | None, default: str = "-") -> Path | None:
    """Return where an output goes: where it was asked for or by default; None is stdout (-)."""
    name = default if output is None else output
    return None if name == "-" else Path(name)


def stem_of(name: str, of_stdin: str | None = None) -> str:
    """Name a file without the endings of ours; ``of_stdin`` is the name of what came from there."""
    if name == "-":
        return of_stdin or "stdin"
    stem = Path(name).name
    for ending in _ENDINGS:
        stem = stem.removesuffix(ending)
    return stem


def held(
    paths: Sequence[Path | None],
    is_own: Callable[[Path], bool],
    *,
    inputs: Iterable[str | Path | None],
    force: bool,
    named: tuple[str, str] | None = None,
) -> contextlib.AbstractContextManager[None]:
    """Refuse outputs that could not or should not be written, and lock the others; None is stdout.

    See `sssfit.files.held`.
    """
    from sssfit.files import held as files_held

    check_outputs(paths)
    return files_held(paths, is_own, inputs=inputs, force=force, named=named)


def held_charts(
    paths: Sequence[Path | None], *, inputs: Iterable[str | Path | None], force: bool
) -> contextlib.AbstractContextManager[None]:
    """Hold the outputs of charts; formats are known by their endings."""
    from sssfit.chart.files import chart_format, is_chart_file

    for path in paths:
        if path is not None:
            chart_format(path)
    return held(paths, is_chart_file, inputs=inputs, force=force)


def check_outputs(paths: Sequence[Path | None]) -> None:
    """Refuse a closed stdout, which is None, and two outputs into one file, before the work."""
    from sssfit.files import check_distinct

    if None in paths:
        binary_stdout()
    check_distinct(path for path in paths if path is not None)


def write(content: Any, path: Path | None) -> None:
    """Write bytes, or what writes itself to a stream, to a file that is held; None is stdout."""
    from sssfit.files import write_atomically

    def write_to(stream: BinaryIO) -> None:
        stream.write(content) if isinstance(content, bytes) else content.write(stream)

    if path is not None:
        write_atomically(path, write_to)
    else:
        write_to(binary_stdout())
        binary_stdout().flush()


def write_chart(figure: Any, path: Path | None) -> None:
    """Write a figure to a file that is held; None is PNG on stdout."""
    from sssfit.chart.page import save_figure

    if path is not None:
        save_figure(figure, path)
    else:
        save_figure(figure, binary_stdout(), format="png")
        binary_stdout().flush()
