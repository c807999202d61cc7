"""Results to stdout, words to stderr: text for people, one JSON object for programs."""

import json
import math
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO

import click

from sssfit.messages import printable

from ._options import Common


def say(common: Common, line: str) -> None:
    """Put a word on stderr, unless -q."""
    if not common.quiet:
        click.echo(printable(line), err=True)


def finish(
    common: Common, figures: Mapping[str, Any], text: str, *, to_stderr: bool = False
) -> None:
    """End a verb: its JSON object with ``--json``, else its text unless ``-q``.

    ``to_stderr`` moves the text out of the way of data that went to stdout (``-o -``).
    """
    if common.json:
        click.echo(json.dumps(plain(figures), allow_nan=False), err=to_stderr)
    elif not common.quiet:
        click.echo(_legible(text, figures), err=to_stderr)


def _legible(text: str, figures: Mapping[str, Any]) -> str:
    """Escape what would move the cursor; a name that holds a newline stays on its line."""
    for name in (*figures.get("output", ()), *figures.values()):
        if isinstance(name, str) and "\n" in name:
            text = text.replace(name, printable(name))
    return "\n".join(printable(line) for line in text.split("\n"))


def newest(common: Common, pattern: str, made_by: str) -> Path:
    """Return the newest file of the current folder that matches, saying on stderr which."""
    from sssfit.errors import FileError

    found = [path for path in Path().glob(pattern) if path.is_file()]
    if not found:
        raise FileError(
            f"there is no {pattern} in this folder: name one, or make one with `{made_by}`."
        )
    path = max(found, key=lambda each: each.stat().st_mtime_ns)
    say(common, f"Using {path}, the newest {pattern} here.")
    return path


def binary_stdout() -> BinaryIO:
    """Return stdout for bytes, or say in one line that it is closed."""
    from sssfit.errors import FileError

    if sys.stdout is None:
        raise FileError("stdout is closed; name a file with -o, or pipe the output somewhere.")
    return sys.stdout.buffer


def binary_stdin() -> BinaryIO:
    """Return stdin for bytes, or say in one line that it is closed."""
    from sssfit.errors import FileError

    if sys.stdin is None:
        raise FileError("stdin is closed; name a file instead of -.")
    return sys.stdin.buffer


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Columns under their heads: the first flush left, the others flush right; no cut, no wrap."""
    widths = [max(len(row[k]) for row in [header, *rows]) for k in range(len(header))]
    lines = (
        "  ".join(
            cell.ljust(width) if k == 0 else cell.rjust(width)
            for k, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in [header, *rows]
    )
    return "\n".join(lines)


def percent(share: float, digits: str = "+.2g") -> str:
    """Write a share in percent; rounding of a sum of pixels is 0."""
    return "0 %" if abs(share) < 1e-9 else f"{100.0 * share:{digits}} %"


def plain(value: Any) -> Any:
    """Arrays to lists, paths to text, and what JSON cannot hold (NaN, inf) to null."""
    if isinstance(value, Mapping):
        return {str(key): plain(each) for key, each in value.items()}
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [plain(each) for each in value]
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
