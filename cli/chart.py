"""``sssfit chart``: files of ours, two views of a profile's kernel, a material by every method."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ._figure import chart_output
from ._guide import chart_guide
from ._kernel_chart import chart_kernel
from ._models import chart_models
from ._options import Common, Count, LengthOr, ListOf, Number, common_options
from ._report import finish, newest, say
from ._spectrum import chart_spectrum

if TYPE_CHECKING:
    from sssfit.fit import Pitch
    from sssfit.kernel import SeparableKernel
    from sssfit.material import Material
    from sssfit.profile import Profile
    from sssfit.simulate import SoFar

    from ._any_file import Found


@click.command()
@click.argument("file", required=False)
@click.option(
    "--models", is_flag=True, help="Draw a material by every method, and the methods' errors."
)
@click.option("--spectrum", is_flag=True, help="Draw the energy of the kernel's singular values.")
@click.option(
    "--guide", is_flag=True, help="Draw the guide function beside what the guided fit leaves."
)
@click.option(
    "--mm-per-pixel",
    type=LengthOr("profile"),
    metavar="MM|profile",
    help="Pixels of the kernel, with --spectrum or --guide; profile is the width of the profile's "
    "first annulus.  [default: 0.3]",
)
@click.option(
    "--k",
    "ks",
    type=ListOf(Number()),
    metavar="0..4,...",
    help="One to four values, with --guide.  [default: 0,1.55,4]",
)
@click.option(
    "--channel",
    metavar="NAME",
    help="Which one, with --guide or of a kernel."
    "  [default: the first that returns light; of a kernel up to three]",
)
@click.option(
    "--profile",
    metavar="FILE",
    help="What a kernel was fitted to.  [default: found beside it or here by its fingerprint]",
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
    "  [default: NAME.profile.png, NAME.kernel.png, NAME.material.png, NAME.checkpoint.png,"
    " NAME.spectrum.png, NAME.guide.png, MATERIAL.models.png]",
)
@click.option("--force", is_flag=True, help="Replace an input, or a file that is not our chart.")
@common_options
def chart(
    file: str | None,
    models: bool,
    spectrum: bool,
    guide: bool,
    mm_per_pixel: Pitch | None,
    ks: list[float] | None,
    channel: str | None,
    profile: str | None,
    photons: int | None,
    output: str | None,
    force: bool,
    common: Common,
) -> None:
    """Draw FILE: a profile, a kernel, a material or the checkpoint of a walk.

    FILE is any of these, whatever its name, or - for stdin; by default the newest .profile.npz of
    this folder.

    A profile, and the profile so far of a checkpoint: 2 pi r R_d over r, linear and logarithmic;
    R_d over r in mean free paths; R_d(x, y) as an image; with error bands.

    A kernel: its passes, the 2D kernel beside the profile's, their difference, and slices along the
    axis and the diagonal. A material: coefficients, mean free paths and albedos.

    With --spectrum the share that each term of a separable kernel has in the 2D kernel, of its
    squares and of its absolute values; how many terms leave an error of 1 %.

    With --guide, for each k, the guide function of the guided fit, the residual that the fit leaves
    of one channel, and its pass beside the pre-integrated one; and the same of that one, under a
    guide function that has it for the best.

    With --models FILE is a material, or a profile of the photon walk, which then need not be
    walked again: the exact solution, the walk and the diffusion models in one figure, and how far
    each is from the exact solution. Only for one half space.

    \b
      sssfit chart skin1.profile.npz
      sssfit chart skin1.profile.npz -o skin1.pdf
      sssfit chart skin1.svd3.kernel.json
      sssfit simulate skin1 -o - | sssfit chart - -o skin1.svg
      sssfit chart --spectrum skin1.profile.npz --mm-per-pixel 0.1
      sssfit chart --guide skin1.profile.npz --mm-per-pixel 0.1
      sssfit chart --models skin1
    """
    from sssfit.chart.files import chart_format

    if output not in (None, "-"):
        chart_format(str(output))  # before anything is read or drawn
    charts = {"--models": models, "--spectrum": spectrum, "--guide": guide}
    _check_options(
        [name for name, is_asked in charts.items() if is_asked],
        {"--photons": photons, "--mm-per-pixel": mm_per_pixel, "--k": ks},
        {"--channel": channel, "--profile": profile},
    )
    if models:
        if file is None:
            raise click.UsageError("--models needs a material, or a profile of a photon walk.")
        chart_models(file, output, photons, common, force=force)
        return
    from ._any_file import read_any

    name = file or str(newest(common, "*.profile.npz", "sssfit simulate skin1"))
    found = read_any(name)
    if spectrum or guide:
        loaded = _profile(found, name, "--spectrum" if spectrum else "--guide")
        path = _target(name, loaded.material_name, output, "spectrum" if spectrum else "guide")
        if spectrum:
            chart_spectrum(name, loaded, path, mm_per_pixel, common, force=force)
            return
        settings = {"mm_per_pixel": mm_per_pixel, "ks": ks, "channel": channel}
        chart_guide(name, loaded, path, settings, common, force=force)
        return
    from sssfit.kernel import SeparableKernel

    if isinstance(found, SeparableKernel):
        path = _target(name, _stem(found), output, "kernel")
        chart_kernel(name, found, path, profile, channel, common, force=force)
        return
    _refuse({"--channel": channel, "--profile": profile})
    _chart_whole(name, found, output, common, force=force)


def _chart_whole(
    name: str, found: Profile | Material | SoFar, output: str | None, common: Common, *, force: bool
) -> None:
    """Draw a profile, the first of a checkpoint, or a material."""
    from sssfit.material import Material
    from sssfit.profile import Profile
    from sssfit.simulate import SoFar

    shown = _first(found, common) if isinstance(found, SoFar) else found
    kinds = {Profile: "profile", Material: "material", SoFar: "checkpoint"}
    kind = kinds[type(found)]
    material = shown.name if isinstance(shown, Material) else shown.material_name
    path = _target(name, material, output, kind)
    with chart_output(path, inputs=[name], force=force) as save:
        from sssfit.chart.material import material_figure
        from sssfit.chart.profile import profile_figure

        save(material_figure(shown) if isinstance(shown, Material) else profile_figure(shown))
    figures = {
        "command": "chart",
        "output": ["-" if path is None else str(path)],
        "kind": kind,
        "file": name,
        "profile": name if kind == "profile" else None,
        "material": material,
        "channels": shown.channels,
    }
    finish(common, figures, f"Wrote {path or 'a PNG to stdout'}", to_stderr=path is None)


def _first(found: SoFar, common: Common) -> Profile:
    """Return the profile so far of a walk's first material, saying if there are more."""
    first, count = found.profiles[0], len(found.profiles)
    if count > 1:
        say(common, f"Drawing {first.material_name}, the first of the walk's {count} materials.")
    return first


def _profile(found: Found, name: str, option: str) -> Profile:
    """Return what is a profile, or refuse to draw a profile's kernel of anything else."""
    from sssfit.errors import ProfileError
    from sssfit.profile import Profile

    if not isinstance(found, Profile):
        raise ProfileError(f"{name} is not a profile; {option} draws one, a .profile.npz file.")
    return found


def _stem(kernel: SeparableKernel) -> str | None:
    """Name a kernel that came without a name; None where its material could not be a file's."""
    from sssfit.material.checks import is_name

    material = kernel.meta.get("material")
    return f"{material}.{kernel.method}" if is_name(material) else None


_WHOSE = {  # options of single charts, and what of it they are for
    "--photons": ("the walk of", ("--models",)),
    "--mm-per-pixel": ("the kernel of", ("--spectrum", "--guide")),
    "--k": ("the fits of", ("--guide",)),
}


def _check_options(
    charts: list[str], given: dict[str, Any], of_kernels: dict[str, str | None]
) -> None:
    """Refuse two charts at once, and options of a chart that is not asked for.

    Whether a kernel's options have a kernel is known when the file has been read.
    """
    if len(charts) > 1:
        raise click.UsageError(f"{' and '.join(charts[:2])} are two charts; ask for one at a time.")
    for option, value in given.items():
        what, owners = _WHOSE[option]
        if value is not None and not set(owners) & set(charts):
            raise click.UsageError(f"{option} is for {what} {' or '.join(owners)}; leave it out.")
    if charts == ["--guide"]:
        of_kernels = {"--profile": of_kernels["--profile"]}
    if charts:
        _refuse(of_kernels)


_OF_KERNELS = {"--channel": "the fits of --guide, or for a kernel", "--profile": "a kernel"}


def _refuse(of_kernels: dict[str, str | None]) -> None:
    """Refuse the options of a kernel where there is none."""
    for option, value in of_kernels.items():
        if value is not None:
            raise click.UsageError(f"{option} is for {_OF_KERNELS[option]}; leave it out.")


_ENDINGS = (".checkpoint", ".npz", ".json", ".toml", ".kernel", ".profile")


def _target(name: str, stem: str | None, output: str | None, kind: str) -> Path | None:
    """Where the chart goes; None is stdout. By default the current folder, under the same name.

    ``stem`` is the name of what came from stdin.
    """
    if output is not None:
        return None if output == "-" else Path(output)
    own = stem or "stdin"
    if name != "-":
        own = Path(name).name
        for ending in _ENDINGS:
            own = own.removesuffix(ending)
    return Path(f"{own}.{kind}.png")
