"""``sssfit fit``: a profile to a separable kernel or a table of taps."""

from __future__ import annotations

from typing import Any

import click

from sssfit.methods import FITS, TAPS, lines_of, settings_of
from sssfit.process import check_memory

from ._input import load, profile_name
from ._options import Common, common_options, method_options, options, own_settings, refuse
from ._output import KERNEL, finish_one, held, stem_of, target, write
from ._verb_options import FIT_OUTPUT, FIT_PIXELS


@click.command(epilog="\b\nMethods:\n" + lines_of(FITS))
@click.argument("profile", required=False)
@options(*FIT_PIXELS, method_options(FITS), *FIT_OUTPUT)
@common_options
@click.pass_context
def fit(context: click.Context, /, profile: str | None, common: Common, **given: Any) -> None:
    """Fit a kernel to PROFILE and write it: by default a cascade of 24 fetches a pixel.

    The kernels of other methods have a weight for every pixel unless --taps thins them.

    PROFILE is a .profile.npz file, or - for stdin; by default the newest in this folder. A kernel
    is made for one pixel size, because its weights are energies of pixels of --mm-per-pixel. The
    default is the pixel size of a head 0.6 m away on 1080 rows; `sssfit choose` computes it for
    another view.

    \b
      sssfit fit
      sssfit fit --fetches 14
      sssfit fit --method svd --rank 3
      sssfit fit --method preintegrated --taps 25
      sssfit fit skin1.exact.profile.npz --method gaussians --terms 6 --mm-per-pixel 0.1
      sssfit fit --method artist --target picture
      sssfit fit --method falloff --width .014 --strength .78,.70,.75 --falloff .57,.13,.08
    """
    if given["listing"]:
        click.echo(lines_of(FITS))
        return
    from sssfit.export.reports import page
    from sssfit.fit import fit_result
    from sssfit.kernel import is_kernel_file, is_taps_file
    from sssfit.profile import Profile

    method = given["method"]
    settings = own_settings(context, FITS, method, {key: given[key] for key in settings_of(FITS)})
    is_taps = method in TAPS or "taps" in settings
    if is_taps:
        refuse(given, {"normalize": "separable kernels"})
    name = profile_name(profile)
    source = load(Profile.read, name)
    stem = f"{stem_of(name, source.material_name)}.{method}{FITS[method].count_of(settings)}"
    path = target(given["output"], f"{stem}.{'taps' if is_taps else 'kernel'}.json")
    settings |= FITS[method].shared(seed=common.seed, normalize=given["normalize"])
    settings |= _picture_target(settings, common.threads)
    settings["mm_per_pixel"] = given["mm_per_pixel"]
    settings["support_mm"] = None if given["support"] == "auto" else given["support"]
    is_ours, inputs = is_taps_file if is_taps else is_kernel_file, [name, given["irradiance"]]
    with held([path], is_ours, inputs=inputs, force=given["force"], named=KERNEL):
        result = fit_result(source, method, **settings)
        write(result.kernel.write, path)
    figures = {"profile": name, **result.to_dict()}
    finish_one(common, path, figures, page("fit-taps" if is_taps else "fit", figures), "the kernel")


def _picture_target(settings: dict[str, Any], threads: int | None) -> dict[str, Any]:
    """Return what judges pictures, if they are the target: the fits by themselves render none."""
    if settings.get("target") != "picture":
        return {}
    check_memory("picture fit", threads)
    from sssfit.compare.pictures import picture_error

    return {"target": picture_error}
