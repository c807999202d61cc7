"""``sssfit chart``: files of ours, two views of a profile's kernel, a material by every method."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import click

from sssfit.process import check_memory

from ._charts import (
    draw_guide,
    draw_kernel,
    draw_models,
    draw_spectrum,
    draw_whole,
    first_of,
    read_models,
)
from ._input import load_any, profile_name
from ._options import Common, Count, LengthOr, ListOf, Number, common_options
from ._output import finish_one, held_charts, stem_of, target, write_chart
from ._truth import true_profile

if TYPE_CHECKING:
    from sssfit.kernel import SeparableKernel
    from sssfit.kinds import Loaded

    from ._charts import Drawn


@click.command()
@click.argument("file", required=False)
@click.option(
    "--models", is_flag=True, help="Draw a material by every method, and the methods' errors."
)
@click.option("--spectrum", is_flag=True, help="Draw the energy of the kernel's singular values.")
@click.option(
    "--guide", is_flag=True, help="Draw the guide function beside the residual of the guided fit."
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
    help="Channel to draw, with --guide or of a kernel."
    "  [default: the first that returns light; of a kernel up to three]",
)
@click.option(
    "--profile",
    metavar="FILE",
    help="Profile that a kernel was fitted to.  [default: found beside it or here, by its hash]",
)
@click.option(
    "--photons",
    type=Count(2, 10**12),
    metavar="N",
    help="Photons of the walk, with --models.  [default: 1e7]",
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
def chart(file: str | None, output: str | None, force: bool, common: Common, **given: Any) -> None:
    """Draw FILE: a profile, a kernel, a material or the checkpoint of a walk.

    FILE is any of these, under any name, or - for stdin; by default the newest .profile.npz of
    this folder.

    A profile, and the profile so far of a checkpoint: 2 pi r R_d over r, linear and logarithmic;
    R_d over r in mean free paths; R_d(x, y) as an image; with error bands.

    A kernel: its passes, the 2D kernel beside the profile's, their difference, and slices along the
    axis and the diagonal. A material: coefficients, mean free paths and albedos.

    With --spectrum the share that each term of a separable kernel has in the 2D kernel, of its
    squares and of its absolute values; how many terms leave an error of 1 %.

    With --guide, for each k, the guide function of the guided fit, the residual that the fit leaves
    of one channel, and its pass beside the pre-integrated one; and the same for the pre-integrated
    pass, under the guide function for which it is optimal.

    With --models FILE is a material, or a profile of the photon walk, which is then not simulated
    again: the exact solution, the walk and the diffusion models in one figure, and how far
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
    asked = [f"--{name}" for name in ("models", "spectrum", "guide") if given[name]]
    _check_options(asked, given)
    if given["models"]:
        if file is None:
            raise click.UsageError("--models needs a material, or a profile of a photon walk.")
        check_memory("figures", common.threads)
        material, walk = read_models(file)
        if walk is not None and given["photons"] is not None:
            raise click.UsageError(
                "--photons is for a new walk, and FILE is already one; leave it out."
            )
        path = target(output, f"{material.name}.models.png")
        draw: Callable[[], Drawn] = partial(draw_models, material, walk, given["photons"], common)
        inputs = [file]
    else:
        name = profile_name(file, common)
        kind, stem, inputs, draw = _of_file(name, load_any(name), asked, given, common)
        path = target(output, f"{stem_of(name, stem)}.{kind}.png")
    with held_charts([path], inputs=inputs, force=force):
        figure, figures, text = draw()
        write_chart(figure, path)
    finish_one(common, "chart", path, figures, text, "a PNG")


def _of_file(
    name: str, found: Loaded, asked: list[str], given: dict[str, Any], common: Common
) -> tuple[str, str | None, list[Any], Callable[[], Drawn]]:
    """Return the kind of chart of a file, a name for it, what is read, and what draws it."""
    from sssfit.errors import ProfileError
    from sssfit.kernel import SeparableKernel
    from sssfit.material import Material
    from sssfit.profile import Profile

    if asked:
        if not isinstance(found, Profile):
            raise ProfileError(
                f"{name} is not a profile; {asked[0]} draws one, a .profile.npz file."
            )
        check_memory("figures", common.threads)
        if given["spectrum"]:
            draw = partial(draw_spectrum, name, found, given["mm_per_pixel"])
            return "spectrum", found.material_name, [name], draw
        settings = {key: given[key] for key in ("mm_per_pixel", "ks", "channel")}
        return "guide", found.material_name, [name], partial(draw_guide, name, found, settings)
    if isinstance(found, SeparableKernel):
        check_memory("kernel chart", common.threads)
        profile, source = true_profile(found, name, given["profile"], common)
        draw = partial(draw_kernel, name, found, profile, source, given["channel"])
        return "kernel", _name_of(found), [name, source], draw
    _refuse({"--channel": given["channel"], "--profile": given["profile"]})
    if isinstance(found, Material):
        return "material", found.name, [name], partial(draw_whole, name, "material", found)
    kind = "profile" if isinstance(found, Profile) else "checkpoint"
    shown = found if isinstance(found, Profile) else first_of(found, common)
    return kind, shown.material_name, [name], partial(draw_whole, name, kind, shown)


def _name_of(kernel: SeparableKernel) -> str | None:
    """Name a kernel that came without a name; None where its material could not be a file's."""
    from sssfit.material.checks import is_name

    material = kernel.meta.get("material")
    return f"{material}.{kernel.method}" if is_name(material) else None


_WHOSE = {  # options of single charts, and what of it they are for
    "photons": ("the walk of", ("--models",)),
    "mm_per_pixel": ("the kernel of", ("--spectrum", "--guide")),
    "ks": ("the fits of", ("--guide",)),
}


def _check_options(charts: list[str], given: dict[str, Any]) -> None:
    """Refuse two charts at once, and options of a chart that is not asked for.

    Whether a kernel's options have a kernel is known when the file has been read.
    """
    if len(charts) > 1:
        raise click.UsageError(f"{' and '.join(charts[:2])} are two charts; ask for one at a time.")
    for key, (what, owners) in _WHOSE.items():
        if given[key] is not None and not set(owners) & set(charts):
            option = "--k" if key == "ks" else f"--{key.replace('_', '-')}"
            raise click.UsageError(f"{option} is for {what} {' or '.join(owners)}; leave it out.")
    if charts:
        of_kernels = ("profile",) if charts == ["--guide"] else ("channel", "profile")
        _refuse({f"--{key}": given[key] for key in of_kernels})


_OF_KERNELS = {"--channel": "the fits of --guide, or for a kernel", "--profile": "a kernel"}


def _refuse(of_kernels: dict[str, str | None]) -> None:
    """Refuse the options of a kernel where there is none."""
    for option, value in of_kernels.items():
        if value is not None:
            raise click.UsageError(f"{option} is for {_OF_KERNELS[option]}; leave it out.")
