"""What a verb puts out: files held and written, results on stdout, words on stderr."""

from __future__ import annotations

import contextlib
import functools
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
_ENDINGS = (".checkpoint", ".zarr", ".npz", ".json", ".toml", ".kernel", ".taps", ".profile")


def finish(common: Common, figures: Mapping[str, Any], text: str) -> None:
    """End a verb: its JSON object with ``--json``, else its text unless ``-q``.

    Either is on stderr where data went to stdout (``-o -``).
    """
    verb = click.get_current_context().command.name
    figures = {"command": verb, "output": [], **figures}
    to_stderr = "-" in figures["output"]
    if common.json:
        from sssfit.arrays import plain

        click.echo(json.dumps(plain(figures), allow_nan=False), err=to_stderr)
    elif not common.quiet:
        click.echo(_legible(in_options(text), figures), err=to_stderr)


def finish_one(
    common: Common, path: Path | None, figures: Mapping[str, Any], text: str, what: str
) -> None:
    """End a verb that wrote one file; None is ``what`` on stdout."""
    words = f"{text}\n" * bool(text) + f"Wrote {path or f'{what} to stdout'}"
    finish(common, {"output": [str(path or "-")], **figures}, words)


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

    if None in paths:
        binary_stdout()
    return files_held(paths, is_own, inputs=inputs, force=force, named=named)


def write(content: bytes | Callable[[BinaryIO], object], path: Path | None) -> None:
    """Write bytes, or what writes to a stream, to a file that is held; None is stdout."""
    from sssfit.files import write_atomically

    def write_to(stream: BinaryIO) -> None:
        stream.write(content) if isinstance(content, bytes) else content(stream)

    if path is not None:
        write_atomically(path, write_to)
    else:
        write_to(binary_stdout())
        binary_stdout().flush()


def write_chart(record: Any, path: Path | None, **options: Any) -> None:
    """Draw a record, and write its figure to a file that is held; None is PNG on stdout."""
    from sssfit.chart import figure_of
    from sssfit.chart.page import save_figure

    form = "png" if path is None else path.suffix.removeprefix(".")
    write(functools.partial(save_figure, figure_of(record, **options), format=form), path)
