"""``sssfit export``: what sssfit made, in a form for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ._options import Common, common_options
from ._outputs import held
from ._report import binary_stdin, binary_stdout, finish, newest

_ENDINGS = (".npz", ".json", ".profile", ".kernel")


@click.command()
@click.argument("file", required=False)
@click.option(
    "--format",
    "form",
    type=click.Choice(["hlsl", "json", "csv"]),
    required=True,
    help="What to write. hlsl: a kernel as shader source; json: a kernel as a document; csv: a "
    "profile as a table.",
)
@click.option(
    "-o",
    "--output",
    metavar="FILE",
    help="Where it goes, - for stdout.  [default: NAME.FORMAT]",
)
@click.option(
    "--force", is_flag=True, help="Replace an input, or a file that sssfit did not write."
)
@common_options
def export(file: str | None, form: str, output: str | None, force: bool, common: Common) -> None:
    """Write FILE in a form for other programs.

    FILE is a .kernel.json file, for csv a .profile.npz file, or - for stdin; by default the newest
    of this folder. Shader source holds the signs and weights of every separable term, and a comment
    with material, fit, pixels, energy and errors. The table has the energy of each annulus and its
    standard error, against the annulus' outer edge r_mm (inf: beyond the grid), with every digit;
    `sssfit import` reads it back. Specular reflectance, absorption and transmittance have no place
    in it.

    \b
      sssfit export --format hlsl
      sssfit export skin1.svd3.kernel.json --format json -o -
      sssfit export skin1.profile.npz --format csv -o - | head
    """
    name, text, figures = (_table if form == "csv" else _kernel)(file, form, common)
    path = _target(name, form, output)
    _write(text.encode(), path, form, name, force=force)
    figures = {"command": "export", "output": [str(path or "-")], "format": form, **figures}
    what = "table" if form == "csv" else "kernel"
    finish(common, figures, f"Wrote {path or f'the {what} to stdout'}", to_stderr=path is None)


def _table(file: str | None, _form: str, common: Common) -> tuple[str, str, dict[str, Any]]:
    """Return the profile's name, its table and its figures."""
    from sssfit.formats.csv import csv_text
    from sssfit.profile import Profile

    name = file or str(newest(common, "*.profile.npz", "sssfit simulate skin1"))
    profile = Profile.read(binary_stdin(), "stdin") if name == "-" else Profile.load(name)
    figures = {"profile": name, "channels": profile.channels, "annuli": profile.n_annuli}
    return name, csv_text(profile), figures


def _kernel(file: str | None, form: str, common: Common) -> tuple[str, str, dict[str, Any]]:
    """Return the kernel's name, its text in that form and its figures."""
    from sssfit.export import hlsl, json_document
    from sssfit.kernel import SeparableKernel

    name = file or str(newest(common, "*.kernel.json", "sssfit fit --method svd --rank 3"))
    is_stdin = name == "-"
    kernel = (
        SeparableKernel.read(binary_stdin(), "stdin") if is_stdin else SeparableKernel.load(name)
    )
    figures = {
        "kernel": name,
        "channels": kernel.channels,
        "rank": kernel.rank,
        "pixels": kernel.pixels,
        "mm_per_pixel": kernel.mm_per_pixel,
    }
    return name, (hlsl if form == "hlsl" else json_document)(kernel), figures


def _target(name: str, form: str, output: str | None) -> Path | None:
    """Where it goes; None is stdout. By default the current folder, under the same name."""
    if output is not None:
        return None if output == "-" else Path(output)
    stem = "stdin" if name == "-" else Path(name).name
    for ending in _ENDINGS:
        stem = stem.removesuffix(ending)
    return Path(f"{stem}.{form}")


def _write(content: bytes, path: Path | None, form: str, name: str, *, force: bool) -> None:
    """To the file, whole or not at all; to stdout where there is none."""
    from sssfit.export import is_hlsl_file
    from sssfit.files import write_atomically
    from sssfit.formats.csv import is_profile_csv
    from sssfit.kernel import is_kernel_file

    own = {"hlsl": is_hlsl_file, "json": is_kernel_file, "csv": is_profile_csv}
    with held(
        [path], own[form], inputs=[name], force=force, named=(f"--format {form}", f".{form}")
    ):
        if path is not None:
            write_atomically(path, lambda stream: stream.write(content))
            return
        binary_stdout().write(content)
        binary_stdout().flush()
