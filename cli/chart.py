"""``sssfit chart``: a profile as a picture."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from ._options import Common, common_options
from ._report import binary_stdin, binary_stdout, finish, newest

if TYPE_CHECKING:
    from sssfit.profile import Profile


@click.command()
@click.argument("profile", required=False)
@click.option(
    "-o",
    "--output",
    metavar="FILE",
    help="Where the chart goes, as PNG, SVG or PDF by its ending; - for PNG on stdout."
    "  [default: NAME.profile.png]",
)
@click.option("--force", is_flag=True, help="Replace a file that is not a chart.")
@common_options
def chart(profile: str | None, output: str | None, force: bool, common: Common) -> None:
    """Draw PROFILE: R_d(r) in four plots with error bands.

    2 pi r R_d over r, linear and logarithmic; R_d over r in mean free paths; R_d(x, y) as an image.
    PROFILE is a .profile.npz file, or - for stdin; by default the newest of this folder.

    \b
      sssfit chart skin1.profile.npz
      sssfit chart skin1.profile.npz -o skin1.pdf
      sssfit simulate skin1 -o - | sssfit chart - -o skin1.svg
    """
    from sssfit._chart_files import chart_format

    if output not in (None, "-"):
        chart_format(str(output))  # before anything is read or drawn
    name = profile or str(newest(common, "*.profile.npz", "sssfit simulate skin1"))
    loaded = _read(name)
    path = _target(name, loaded, output)
    _draw(loaded, path, force=force)
    figures = {
        "command": "chart",
        "output": ["-" if path is None else str(path)],
        "profile": name,
        "material": _material_name(loaded),
        "channels": loaded.channels,
    }
    finish(common, figures, f"Wrote {path or 'a PNG to stdout'}", to_stderr=path is None)


def _read(name: str) -> Profile:
    """From the file, or stdin for ``-``."""
    from sssfit.profile import Profile

    return Profile.read(binary_stdin(), "stdin") if name == "-" else Profile.load(name)


def _material_name(profile: Profile) -> str | None:
    from sssfit._chart_data import material_of

    material = material_of(profile)
    return material.name if material else None


def _target(name: str, profile: Profile, output: str | None) -> Path | None:
    """Where the chart goes; None is stdout. By default the current folder, under the same name."""
    if output is not None:
        return None if output == "-" else Path(output)
    if name == "-":
        return Path(f"{_material_name(profile) or 'stdin'}.profile.png")
    return Path(Path(name).name.removesuffix(".npz") + ".png")


def _draw(profile: Profile, path: Path | None, *, force: bool) -> None:
    """Draw and write; the output is checked and held before the second that takes."""
    from sssfit._chart_files import is_chart_file
    from sssfit.files import check_output, locked

    if path is None:
        from sssfit.chart import profile_figure, save_figure

        save_figure(profile_figure(profile), binary_stdout(), format="png")
        binary_stdout().flush()
        return
    check_output(path, is_chart_file, force=force)
    with locked(path):
        from sssfit.chart import profile_figure, save_figure

        save_figure(profile_figure(profile), path)
