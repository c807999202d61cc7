"""``sssfit fit``: a profile to a separable kernel."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from sssfit.messages import columns
from sssfit.methods import FITS, lines_of, settings_of
from sssfit.process import check_memory

from ._input import load, profile_name
from ._methods import method_options, own_settings
from ._options import Common, LengthOr, common_options
from ._output import KERNEL, finish_one, held, stem_of, target, write

if TYPE_CHECKING:
    from sssfit.fit import Pitch


@click.command(epilog="\b\nMethods:\n" + lines_of(FITS))
@click.argument("profile", required=False)
@click.option("--list", "listing", is_flag=True, help="List the methods.")
@click.option("--method", type=click.Choice(list(FITS)), help="Fit method; --list describes each.")
@click.option(
    "--mm-per-pixel",
    type=LengthOr("profile"),
    metavar="MM|profile",
    help="Size of a pixel of the kernel; profile is the width of the profile's first annulus."
    "  [default: 0.3]",
)
@click.option(
    "--support",
    type=LengthOr("auto"),
    default="auto",
    show_default=True,
    metavar="MM|auto",
    help="Half width of the kernel; auto is the smallest that keeps 99.9 % of every channel.",
)
@click.option(
    "--normalize",
    is_flag=True,
    help="Scale every channel to unit energy, and store its energy as a factor.",
)
@method_options(FITS)
@click.option(
    "-o",
    "--output",
    metavar="FILE",
    help="Where the kernel goes, - for stdout.  [default: PROFILE.METHOD.kernel.json]",
)
@click.option("--force", is_flag=True, help="Replace an input, or a file that is not our kernel.")
@common_options
@click.pass_context
def fit(
    context: click.Context,
    /,
    profile: str | None,
    listing: bool,
    method: str | None,
    mm_per_pixel: Pitch | None,
    support: float | str,
    normalize: bool,
    output: str | None,
    force: bool,
    common: Common,
    **given: Any,
) -> None:
    """Fit a separable kernel to PROFILE and write it.

    PROFILE is a .profile.npz file, or - for stdin; by default the newest of this folder. A kernel
    belongs to its pixels: weights are energies of pixels of --mm-per-pixel. The default is that of
    a head 0.6 m away on 1080 rows; `sssfit choose` works it out for another view.

    \b
      sssfit fit --method svd --rank 3
      sssfit fit skin1.exact.profile.npz --method gaussians --terms 6 --mm-per-pixel 0.1
      sssfit fit --method artist --target picture
      sssfit fit --method falloff --width .014 --strength .78,.70,.75 --falloff .57,.13,.08
    """
    if listing:
        click.echo(lines_of(FITS))
        return
    if method is None:
        raise click.UsageError("name a --method; `sssfit fit --list` has them.")
    from sssfit.fit import METHODS
    from sssfit.kernel import is_kernel_file
    from sssfit.profile import Profile

    settings = own_settings(context, FITS, method, given)
    name = profile_name(profile, common)
    source = load(Profile, name)
    counted, stem = FITS[method].counted, stem_of(name, source.material_name)
    count = settings.get(counted, settings_of(FITS)[counted][0].words) if counted else ""
    path = target(output, f"{stem}.{method}{count}.kernel.json")
    settings |= _judge(settings, common.threads) | {
        "mm_per_pixel": mm_per_pixel,
        "normalize": normalize,
        "support_mm": None if support == "auto" else support,
    }
    with held([path], is_kernel_file, inputs=[name], force=force, named=KERNEL):
        result = METHODS[method].fit(source, **settings)
        write(result.kernel, path)
    figures = {"profile": name, **result.to_dict()}
    finish_one(common, "fit", path, figures, _text(figures), "the kernel")


def _judge(settings: dict[str, Any], threads: int | None) -> dict[str, Any]:
    """Return what judges pictures, if they are the target: the fits by themselves render none."""
    if settings.get("target") != "picture":
        return {}
    check_memory("picture fit", threads)
    from sssfit.compare.pictures import picture_error

    return {"target": picture_error}


def _text(figures: dict[str, Any]) -> str:
    """Write the figures for people."""
    rank, pixels = figures["rank"], figures["pixels"]
    head = (
        f"{figures['material']}: {figures['method']}, {rank} term{'s' * (rank > 1)}, {pixels} "
        f"pixel{'s' * (pixels > 1)} of {figures['mm_per_pixel']:.4g} mm, "
        f"{figures['seconds']:.1f} s\n"
    )
    return head + columns(
        "channel",
        figures["channels"],
        ("Frobenius error", figures["relative_frobenius_error"], ".3g%"),
        ("energy error", figures["energy_error"], "+.2g%"),
        ("energy", figures["energy"], ".6f"),
        ("ended", figures["stop_reason"], ""),
    )
