"""``sssfit chart``: a profile, two views of its kernel, or a material by every method."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ._figure import chart_output
from ._guide import chart_guide
from ._models import chart_models
from ._options import Common, Count, Length, ListOf, common_options
from ._report import binary_stdin, finish, newest
from ._spectrum import chart_spectrum

if TYPE_CHECKING:
    from sssfit.profile import Profile


@click.command()
@click.argument("profile", required=False)
@click.option(
    "--models", is_flag=True, help="Draw a material by every method, and the methods' errors."
)
@click.option("--spectrum", is_flag=True, help="Draw the energy of the kernel's singular values.")
@click.option(
    "--guide", is_flag=True, help="Draw the guide function beside what the guided fit leaves."
)
@click.option(
    "--mm-per-pixel",
    type=Length(),
    metavar="MM",
    help="Pixels of the kernel, with --spectrum or --guide."
    "  [default: the profile's first annulus]",
)
@click.option(
    "--k",
    "ks",
    type=ListOf(click.FLOAT),
    metavar="0..4,...",
    help="One to four values, with --guide.  [default: 0,1.55,4]",
)
@click.option(
    "--channel",
    metavar="NAME",
    help="Which one, with --guide.  [default: the first that returns light]",
)
@click.option(
    "--photons",
    type=Count(2, 10**12),
    metavar="N",
    help="Of the photon walk, with --models.  [default: 1e7]",
)
@click.option(
    "-o",
    "--output",
    metavar="FILE",
    help="Where the chart goes, as PNG, SVG or PDF by its ending; - for PNG on stdout."
    "  [default: NAME.profile.png, NAME.spectrum.png, NAME.guide.png,"
    " MATERIAL.models.png]",
)
@click.option("--force", is_flag=True, help="Replace an input, or a file that is not our chart.")
@common_options
def chart(
    profile: str | None,
    models: bool,
    spectrum: bool,
    guide: bool,
    mm_per_pixel: float | None,
    ks: list[float] | None,
    channel: str | None,
    photons: int | None,
    output: str | None,
    force: bool,
    common: Common,
) -> None:
    """Draw PROFILE: R_d(r) in four plots with error bands, or its kernel in other views.

    2 pi r R_d over r, linear and logarithmic; R_d over r in mean free paths; R_d(x, y) as an image.
    PROFILE is a .profile.npz file, or - for stdin; by default the newest of this folder.

    With --spectrum the share that each term of a separable kernel has in the 2D kernel, of its
    squares and of its absolute values; how many terms leave an error of 1 %.

    With --guide, for each k, the guide function of the guided fit, the residual that the fit leaves
    of one channel, and its pass beside the pre-integrated one; and the same of that one, under a
    guide function that has it for the best.

    With --models PROFILE is a material, or a profile of the photon walk, which then need not be
    walked again: the exact solution, the walk and the diffusion models in one figure, and how far
    each is from the exact solution. Only for one half space.

    \b
      sssfit chart skin1.profile.npz
      sssfit chart skin1.profile.npz -o skin1.pdf
      sssfit simulate skin1 -o - | sssfit chart - -o skin1.svg
      sssfit chart --spectrum skin1.profile.npz --mm-per-pixel 0.1
      sssfit chart --guide skin1.profile.npz --mm-per-pixel 0.1
      sssfit chart --models skin1
    """
    from sssfit._chart_files import chart_format

    if output not in (None, "-"):
        chart_format(str(output))  # before anything is read or drawn
    charts = {"--models": models, "--spectrum": spectrum, "--guide": guide}
    _check_options(
        [name for name, is_asked in charts.items() if is_asked],
        {"--photons": photons, "--mm-per-pixel": mm_per_pixel, "--k": ks, "--channel": channel},
    )
    if models:
        if profile is None:
            raise click.UsageError("--models needs a material, or a profile of a photon walk.")
        chart_models(profile, output, photons, common, force=force)
        return
    name = profile or str(newest(common, "*.profile.npz", "sssfit simulate skin1"))
    loaded = _read(name)
    kind = "spectrum" if spectrum else "guide" if guide else "profile"
    path = _target(name, loaded, output, kind)
    if spectrum:
        chart_spectrum(name, loaded, path, mm_per_pixel, common, force=force)
        return
    if guide:
        settings = {"mm_per_pixel": mm_per_pixel, "ks": ks, "channel": channel}
        chart_guide(name, loaded, path, settings, common, force=force)
        return
    with chart_output(path, inputs=[name], force=force) as save:
        from sssfit.chart import profile_figure

        save(profile_figure(loaded))
    figures = {
        "command": "chart",
        "output": ["-" if path is None else str(path)],
        "profile": name,
        "material": loaded.material_name,
        "channels": loaded.channels,
    }
    finish(common, figures, f"Wrote {path or 'a PNG to stdout'}", to_stderr=path is None)


_WHOSE = {  # options of single charts, and what of it they are for
    "--photons": ("the walk of", ("--models",)),
    "--mm-per-pixel": ("the kernel of", ("--spectrum", "--guide")),
    "--k": ("the fits of", ("--guide",)),
    "--channel": ("the fits of", ("--guide",)),
}


def _check_options(charts: list[str], given: dict[str, Any]) -> None:
    """Refuse two charts at once, and options of a chart that is not asked for."""
    if len(charts) > 1:
        raise click.UsageError(f"{' and '.join(charts[:2])} are two charts; ask for one at a time.")
    for option, value in given.items():
        what, owners = _WHOSE[option]
        if value is not None and not set(owners) & set(charts):
            raise click.UsageError(f"{option} is for {what} {' or '.join(owners)}; leave it out.")


def _read(name: str) -> Profile:
    """From the file, or stdin for ``-``."""
    from sssfit.profile import Profile

    return Profile.read(binary_stdin(), "stdin") if name == "-" else Profile.load(name)


def _target(name: str, profile: Profile, output: str | None, kind: str) -> Path | None:
    """Where the chart goes; None is stdout. By default the current folder, under the same name."""
    if output is not None:
        return None if output == "-" else Path(output)
    if name == "-":
        return Path(f"{profile.material_name or 'stdin'}.{kind}.png")
    stem = Path(name).name.removesuffix(".npz")
    if kind != "profile":
        stem = f"{stem.removesuffix('.profile')}.{kind}"
    return Path(f"{stem}.png")
