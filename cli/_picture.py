"""What a kernel is applied to, for every verb: which options go together."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import click

from sssfit.scene.made import MADE

_COUNT = re.compile("0*[1-9][0-9]{0,8}")  # a picture of more columns than that has no memory


class Size(click.ParamType[tuple[int, int]]):
    """Columns and rows, as 1920x1080; gives (rows, columns)."""

    name = "size"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[int, int]:
        """Parse ``value``; a usage error (exit 2) names what was expected."""
        if isinstance(value, tuple):
            return value
        width, _, height = str(value).lower().partition("x")
        if not all(_COUNT.fullmatch(each) for each in (width, height)):
            self.fail(f"{value!r} is not a size in pixels, such as 1920x1080.", param, ctx)
        return int(height), int(width)


def check_pictures(
    names: Sequence[str], layer: str | None, mask: str | None, size: object = None
) -> None:
    """Refuse pictures that do not exist, and options that would do nothing to them."""
    for name in names:
        if not name or (name not in MADE and not Path(name).exists()):
            raise click.UsageError(
                f"there is no picture {name!r}; expected {', '.join(MADE)}, or your own file."
            )
    files = [name for name in names if name not in MADE]
    if size is not None and len(files) == len(names):
        raise click.UsageError("--size is for made pictures; leave it out.")
    for given, value in (("--layer", layer), ("--mask", mask)):
        if value is not None and not files:
            raise click.UsageError(f"{given} is for pictures from files; leave it out.")
