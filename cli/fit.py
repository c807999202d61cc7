"""``sssfit fit``: a profile to a separable kernel."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ._fit_options import fit_options
from ._fits import FITS, fit_lines, own_settings
from ._memory import check_memory
from ._options import Common, LengthOr, common_options
from ._outputs import KERNEL, held
from ._report import binary_stdin, binary_stdout, finish, newest, percent, table

if TYPE_CHECKING:
    from sssfit.fit import FitResult, Pitch
    from sssfit.profile import Profile


@click.command(epilog="\b\nMethods:\n" + fit_lines())
@click.argument("profile", required=False)
@click.option("--list", "listing", is_flag=True, help="Print the methods, a line each.")
@click.option("--method", type=click.Choice(list(FITS)), help="How; --list says what each does.")
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
    "--normalize", is_flag=True, help="Unit energy for every channel; its energy is kept apart."
)
@fit_options
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
        click.echo(fit_lines())
        return
    if method is None:
        raise click.UsageError("name a --method; `sssfit fit --list` has them.")
    settings = own_settings(context, method, given)
    name = profile or str(newest(common, "*.profile.npz", "sssfit simulate skin1"))
    source = _load(name)
    path = _target(name, source, method, settings, output)
    settings |= _judge(settings, common.threads) | {
        "mm_per_pixel": mm_per_pixel,
        "normalize": normalize,
    }
    from sssfit.kernel import is_kernel_file

    settings["support_mm"] = None if support == "auto" else support
    with held([path], is_kernel_file, inputs=[name], force=force, named=KERNEL):
        result = _fit_and_write(source, method, settings, path)
    figures = _figures(result, name, path)
    finish(common, figures, _text(result, figures), to_stderr=path is None)


def _judge(settings: dict[str, Any], threads: int | None) -> dict[str, Any]:
    """Return what judges pictures, if they are the target: the fits by themselves render none."""
    if settings.get("target") != "picture":
        return {}
    check_memory("picture fit", threads)
    from sssfit.compare.pictures import picture_error

    return {"target": picture_error}


def _load(name: str) -> Profile:
    from sssfit.profile import Profile

    return Profile.read(binary_stdin(), "stdin") if name == "-" else Profile.load(name)


def _fit_and_write(
    profile: Profile, method: str, settings: dict[str, Any], path: Path | None
) -> FitResult:
    """Fit and write; nothing is written where the fit fails."""
    from sssfit.fit import METHODS

    result = METHODS[method].fit(profile, **settings)
    if path is None:
        result.kernel.write(binary_stdout())
        binary_stdout().flush()
    else:
        result.kernel.save(path)
    return result


def _target(
    name: str, profile: Profile, method: str, settings: dict[str, Any], output: str | None
) -> Path | None:
    """Where the kernel goes; None is stdout."""
    if output is not None:
        return None if output == "-" else Path(output)
    stem = Path(name).name.removesuffix(".npz").removesuffix(".profile")
    if name == "-":
        stem = profile.material_name or "stdin"
    fit = FITS[method]
    count = settings.get(fit.counted, fit.count) if fit.counted else ""
    return Path(f"{stem}.{method}{count}.kernel.json")


def _figures(result: FitResult, name: str, path: Path | None) -> dict[str, Any]:
    """Everything that is printed, as ``--json`` has it."""
    kernel = result.kernel
    return {
        "command": "fit",
        "output": [str(path or "-")],
        "profile": name,
        "material": kernel.meta["material"],
        "channels": list(kernel.channels),
        "method": kernel.method,
        "rank": kernel.rank,
        "mm_per_pixel": kernel.mm_per_pixel,
        "support_mm": kernel.support_mm,
        "pixels": kernel.pixels,
        "taps": None,
        "relative_frobenius_error": result.relative_frobenius_error,
        "energy_error": result.energy_error,
        "energy": kernel.energy,
        "scale": kernel.scale,
        "evaluations": list(result.evaluations),
        "stop_reason": list(result.stop_reasons),
        "seconds": result.seconds,
        "parameters": dict(kernel.parameters),
    }


def _text(result: FitResult, figures: dict[str, Any]) -> str:
    """Write the figures for people."""
    kernel = result.kernel
    head = (
        f"{figures['material']}: {kernel.method}, {kernel.rank} "
        f"term{'s' if kernel.rank > 1 else ''}, {kernel.pixels} "
        f"pixel{'s' if kernel.pixels > 1 else ''} of {kernel.mm_per_pixel:.4g} mm, "
        f"{result.seconds:.1f} s"
    )
    rows = [
        [
            channel,
            percent(kernel.relative_frobenius_error[c], ".3g"),
            percent(kernel.energy_error[c], "+.2g"),
            f"{kernel.energy[c]:.6f}",
            result.stop_reasons[c],
        ]
        for c, channel in enumerate(kernel.channels)
    ]
    heads = ["channel", "Frobenius error", "energy error", "energy", "ended"]
    wrote = "the kernel to stdout" if figures["output"] == ["-"] else figures["output"][0]
    return "\n".join([head, table(heads, rows), f"Wrote {wrote}"])
