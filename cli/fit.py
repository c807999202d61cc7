"""``sssfit fit``: a profile to a separable kernel or a table of taps."""

from __future__ import annotations

from typing import Any

import click

from sssfit.methods import FITS, TAPS, imported, lines_of
from sssfit.process import check_memory

from ._input import load, profile_name
from ._options import Common, common_options, method_options, options, own_settings, refuse
from ._output import KERNEL, finish, held, stem_of, target, write
from ._verb_options import FIT_OUTPUT, FIT_PIXELS


@click.command(epilog="\b\nMethods:\n" + lines_of(FITS), short_help="Fit a kernel to a profile.")
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
      sssfit fit --fetches 14 --pitches .1,.2,.4,.8
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
    from sssfit.fit import fit_pitches
    from sssfit.kernel import is_kernel_file, is_taps_file
    from sssfit.profile import Profile
    from sssfit.stability.rules import warn_of_doubts

    method, pitches = given["method"], given["pitches"]
    settings = own_settings(context, FITS, method, given)
    is_taps = method in TAPS or "taps" in settings
    refuse(given, {"normalize": "separable kernels"} if is_taps else {})
    one = ("mm_per_pixel", "output") if pitches else ()
    refuse(given, dict.fromkeys(one, "one pixel size, without --pitches"))
    name = profile_name(profile)
    source = load(Profile.read, name)
    stem = f"{stem_of(name, source.material_name)}.{method}{FITS[method].count_of(settings)}"
    stems = [f"{stem}.{each:g}mm" for each in pitches] if pitches else [stem]
    ending = "taps.json" if is_taps else "kernel.json"
    paths = [target(given["output"], f"{each}.{ending}") for each in stems]
    settings |= FITS[method].shared(seed=common.seed, normalize=given["normalize"])
    if settings.get("target") == "picture":  # the fits by themselves render none
        check_memory("picture fit", common.threads)
        settings["target"] = imported("sssfit.compare.pictures:picture_error")
    settings["support_mm"] = None if given["support"] == "auto" else given["support"]
    settings |= {"smooth": True} if given["smooth"] else {}
    is_ours, inputs = is_taps_file if is_taps else is_kernel_file, [name, given["irradiance"]]
    kind, told = "fit-taps" if is_taps else "fit", dict[int, dict[str, Any]]()
    each_of = fit_pitches(source, method, pitches or [given["mm_per_pixel"]], **settings)
    with held(paths, is_ours, inputs=inputs, force=given["force"], named=KERNEL):
        for k, result in each_of:
            warn_of_doubts(result.kernel, source, strict=given["strict"])
            write(result.kernel.write, paths[k])
            told[k] = {"profile": name, **result.to_dict()}
    kernels = [told[k] for k in range(len(paths))]
    wrote = [f"Wrote {each or 'the kernel to stdout'}" for each in paths]
    text = [f"{page(kind, each)}\n{line}" for each, line in zip(kernels, wrote, strict=True)]
    figures = {"profile": name, "kernels": kernels} if pitches else kernels[0]
    finish(common, {"output": [str(each or "-") for each in paths], **figures}, "\n".join(text))
