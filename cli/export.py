"""``sssfit export``: what sssfit made, in a form for other programs."""

from __future__ import annotations

from pathlib import Path

import click

from ._options import Common, common_options
from ._report import binary_stdin, binary_stdout, finish, newest


@click.command()
@click.argument("file", required=False)
@click.option(
    "--format",
    "form",
    type=click.Choice(["csv"]),
    required=True,
    help="What to write. csv: a profile as a table.",
)
@click.option(
    "-o",
    "--output",
    metavar="FILE",
    help="Where it goes, - for stdout.  [default: NAME.csv]",
)
@click.option("--force", is_flag=True, help="Replace a file that sssfit did not write.")
@common_options
def export(file: str | None, form: str, output: str | None, force: bool, common: Common) -> None:
    """Write FILE in a form for other programs.

    FILE is a .profile.npz file, or - for stdin; by default the newest of this folder. The table
    has the energy of each annulus and its standard error, against the annulus' outer edge r_mm
    (inf: beyond the grid), with every digit; `sssfit import` reads it back. Specular reflectance,
    absorption and transmittance have no place in it.

    \b
      sssfit export skin1.profile.npz --format csv
      sssfit export skin1.profile.npz --format csv -o - | head
    """
    from sssfit.profile import Profile
    from sssfit.profile_csv import csv_text

    name = file or str(newest(common, "*.profile.npz", "sssfit simulate skin1"))
    profile = Profile.read(binary_stdin(), "stdin") if name == "-" else Profile.load(name)
    path = _target(name, form, output)
    _write(csv_text(profile).encode(), path, force=force)
    figures = {
        "command": "export",
        "output": [str(path or "-")],
        "format": form,
        "profile": name,
        "channels": profile.channels,
        "annuli": profile.n_annuli,
    }
    finish(common, figures, f"Wrote {path or 'the table to stdout'}", to_stderr=path is None)


def _target(name: str, form: str, output: str | None) -> Path | None:
    """Where it goes; None is stdout. By default the current folder, under the same name."""
    if output is not None:
        return None if output == "-" else Path(output)
    stem = "stdin" if name == "-" else Path(name).name.removesuffix(".npz").removesuffix(".profile")
    return Path(f"{stem}.{form}")


def _write(content: bytes, path: Path | None, *, force: bool) -> None:
    """To the file, whole or not at all; to stdout where there is none."""
    from sssfit.files import check_output, locked, write_atomically
    from sssfit.profile_csv import is_profile_csv

    if path is None:
        binary_stdout().write(content)
        binary_stdout().flush()
        return
    check_output(path, is_profile_csv, force=force)
    with locked(path):
        write_atomically(path, lambda stream: stream.write(content))
