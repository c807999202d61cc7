"""The outputs of ``sssfit simulate``: where they go, held from other runs, written whole."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ._report import binary_stdout

if TYPE_CHECKING:
    from sssfit.material import Material
    from sssfit.profile import Profile
    from sssfit.simulate import ProfileSource


def profile_paths(
    materials: Sequence[Material | ProfileSource], method: str, output: str | None, *, several: bool
) -> list[Path | None]:
    """Where each profile goes; None is stdout. Methods but the first put their name into it."""
    if output == "-":
        if several:
            raise click.UsageError("there are several profiles; -o names a folder for them.")
        return [None]
    if several or output is None:
        folder, kind = Path(output or "."), "" if method == "montecarlo" else f".{method}"
        return [folder / f"{each.name}{kind}.profile.npz" for each in materials]
    return [Path(output)]


def write_profile(profile: Profile, path: Path | None) -> None:
    """To the file, whole or not at all; to stdout where there is none."""
    if path is None:
        stream = binary_stdout()
        profile.write(stream)
        stream.flush()
    else:
        profile.save(path)
