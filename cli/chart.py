"""``sssfit chart``: files of ours, views of a profile's kernel, a material by every method."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from sssfit.methods import VIEWS, imported
from sssfit.process import check_memory

from ._input import load, load_source, profile_name, profile_of_kernel
from ._options import Common, common_options, flag, options, output, refuse
from ._output import finish_one, held, stem_of, target, write_chart
from ._progress import walk_progress
from ._verb_options import CHART

_FLAGS = {name: each.flag for name, each in VIEWS.items() if each.flag}
_OUTPUT = output(
    ", ".join(f"NAME.{name}.png" for name in VIEWS if name != "models") + ", MATERIAL.models.png",
    "is not our chart",
    "Output file, PNG, SVG or PDF by its ending; - for PNG on stdout",
)
_OF_CHARTS = {  # what options of single charts are for; {} are the flags of the views
    "photons": "the walk of {}",
    "mm_per_pixel": "the kernel of {}",
    "ks": "the fits of {}",
    "channel": "the fits of {}, or for a separable kernel",
    "profile": "a kernel",
}


@click.command(short_help="Draw a profile, kernel, table of taps, material or sweep.")
@click.argument("file", required=False)
@options(*(flag(f"--{name}", text) for name, text in _FLAGS.items()), *CHART, *_OUTPUT)
@common_options
def chart(file: str | None, common: Common, **given: Any) -> None:
    """Draw FILE: a profile, a kernel, a table of taps, a material or the checkpoint of a walk.

    FILE is any of these, under any name, or - for stdin; by default the newest .profile.npz in this
    folder.

    A profile, and the profile so far of a checkpoint: 2 pi r R_d over r, linear and logarithmic;
    R_d over r in mean free paths; R_d(x, y) as an image; with error bands.

    A kernel: its passes, the 2D kernel beside the profile's, their difference, and slices along the
    axis and the diagonal. A table of taps: one point of light, stage by stage. A material:
    coefficients, mean free paths and albedos. A sweep over wavelengths, a Zarr folder: the colour
    of its diffuse reflectance in daylight, a swatch for each combination of the other axes.

    With --spectrum: the share of each separable term in the 2D kernel, of the sum of squares and of
    the sum of absolute values, and the number of terms for an error of 1 %.

    With --guide, for each k, the guide function of the guided fit, the residual that the fit leaves
    of one channel, and its pass beside the pre-integrated one; and the same for the pre-integrated
    pass, under the guide function for which it is optimal.

    With --frequency: R(k), what returns of light that varies as cos(k x), with error bands; its
    table is `sssfit export --format frequency`. With --angles: R_d by exit angle, of a profile made
    with `sssfit simulate --angles N`, beside cos times Fresnel's transmittance.

    With --models, FILE is a material, or a profile of the photon walk, which is then not simulated
    again. The figure shows the exact solution, the walk and the diffusion models, with the error of
    each compared with the exact solution. Half spaces only.

    \b
      sssfit chart skin1.profile.npz
      sssfit chart skin1.profile.npz -o skin1.pdf
      sssfit chart skin1.svd3.kernel.json
      sssfit simulate skin1 -o - | sssfit chart - -o skin1.svg
      sssfit chart --spectrum skin1.profile.npz --mm-per-pixel 0.1
      sssfit chart --guide skin1.profile.npz --mm-per-pixel 0.1
      sssfit chart --models skin1
      sssfit chart skin-spectral.zarr
    """
    from sssfit import kinds
    from sssfit.chart.files import chart_format, is_chart_file
    from sssfit.compare.drawing import computed, drawn_of
    from sssfit.profile import Profile

    if given["output"] not in (None, "-"):
        chart_format(given["output"])  # before anything is read or drawn
    view = _view(file, given)
    name = file if view == "models" and file else profile_name(file)
    read = imported("sssfit.sweep.swatches:read_swatches") if Path(name).is_dir() else kinds.load
    loaded = load_source(name) if view == "models" else load(read, name)
    found, kind, made_of = drawn_of(loaded, view, name)
    refuse(given, _of_others({kind}))
    if kind == "models" and isinstance(found, Profile):
        refuse(given, {"photons": "a new walk, and FILE is already one"})
    drawn = VIEWS[kind]
    check_memory(drawn.memory, common.threads)
    profile, source = None, name if drawn.of == ("Profile",) else None
    if "profile" in drawn.takes:
        profile, source = profile_of_kernel(found, name, given["profile"])
    stem = made_of if kind == "models" else stem_of(name, made_of)
    path = target(given["output"], f"{stem}.{kind}.png")
    with held([path], is_chart_file, inputs=[name, source], force=given["force"]):
        known = {**given, "profile": profile, "seed": common.seed, "threads": common.threads}
        known["walk"] = walk_progress
        record = computed(found, kind, **{key: known[key] for key in drawn.takes})
        figures: dict[str, Any] = {} if view else {"kind": kind, "file": name}
        figures |= {"profile": source} if kind != "models" else {}
        figures |= record.to_dict() if drawn.page else {}
        figures |= {} if drawn.page else {"material": made_of, "channels": found.channels}
        text = imported(drawn.page)(figures) if drawn.page else ""
        write_chart(record, path)
    finish_one(common, path, figures, text, "a PNG")


def _view(file: str | None, given: Mapping[str, Any]) -> str:
    """Return the chart that was asked for by its name; by default it is that of the file."""
    views = [f"--{name}" for name in _FLAGS if given[name]]
    if len(views) > 1:
        raise click.UsageError(f"{' and '.join(views[:2])} are two charts; ask for one at a time.")
    view = views[0].removeprefix("--") if views else ""
    refuse(given, _of_others({view} if view else VIEWS.keys() - _FLAGS.keys()))
    if view == "models" and file is None:
        raise click.UsageError("--models needs a material, or a profile of a photon walk.")
    return view


def _of_others(charts: set[str]) -> dict[str, str]:
    """Return the options that are for other charts than these, with what they are for."""
    found = {}
    for key, what in _OF_CHARTS.items():
        owners = [name for name, each in VIEWS.items() if key in each.takes]
        if charts.isdisjoint(owners):
            flags = (f"--{name}" for name in owners if name in _FLAGS)
            found[key] = what.format(" or ".join(flags))
    return found
