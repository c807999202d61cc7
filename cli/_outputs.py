"""The files a verb writes: checked and held from other runs before the work begins."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path

import click

from ._report import binary_stdout

# What is written, and the ending of its name.
PROFILE, KERNEL = ("a profile", ".npz"), ("a kernel", ".json")


@contextlib.contextmanager
def held(
    paths: Sequence[Path | None],
    is_own: Callable[[Path], bool],
    *,
    inputs: Iterable[str | Path | None],
    force: bool,
    named: tuple[str, str] | None = None,
) -> Iterator[None]:
    """Refuse outputs that could not or should not be written, and lock the others; None is stdout.

    ``is_own`` tells an older output of the same kind, ``inputs`` are what the verb reads, ``named``
    is what is written and how its name ends: ("a profile", ".npz").
    """
    from sssfit.files import check_ending, check_output, locked

    if None in paths:
        binary_stdout()  # closed: said now and not after the work
    read = [each for each in inputs if each is not None]
    files = [path for path in paths if path is not None]
    check_distinct(files)
    with contextlib.ExitStack() as locks:
        for path in files:
            if named is not None:
                check_ending(path, *named)
            check_output(path, is_own, force=force, inputs=read)
            locks.enter_context(locked(path))
        yield


def check_distinct(paths: Iterable[Path]) -> None:
    """Refuse two outputs into one file."""
    from sssfit.files import is_same_file

    seen: list[Path] = []
    for path in paths:
        for other in seen:
            if is_same_file(path, other):
                raise click.UsageError(
                    f"two outputs name the same file, {path}; give each its own."
                )
        seen.append(path)
