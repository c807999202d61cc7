"""``sssfit chart``: files of ours, two views of a profile's kernel, a material by every method."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import click

from sssfit.messages import note
from sssfit.process import check_memory

from ._input import load, load_source, profile_name, profile_of_kernel
from ._options import Common, common_options, options, refuse
from ._output import finish_one, held, stem_of, target, write_chart
from ._progress import walk_progress
from ._verb_options import CHART, of_other_charts

if TYPE_CHECKING:
    from sssfit.profile import Profile

_VIEWS = ("models", "spectrum", "guide")
_COMPUTED = ("kernel", "taps", *_VIEWS)
_FILES = ("profile", "kernel", "taps", "material", "checkpoint")
_MEMORY = {"kernel": "kernel chart", "taps": "kernel chart", **dict.fromkeys(_VIEWS, "figures")}


@click.command()
@click.argument("file", required=False)
@options(*CHART)
@common_options
def chart(file: str | None, common: Common, **given: Any) -> None:
    """Draw FILE: a profile, a kernel, a table of taps, a material or the checkpoint of a walk.

    FILE is any of these, under any name, or - for stdin; by default the newest .profile.npz in this
    folder.

    A profile, and the profile so far of a checkpoint: 2 pi r R_d over r, linear and logarithmic;
    R_d over r in mean free paths; R_d(x, y) as an image; with error bands.

    A kernel: its passes, the 2D kernel beside the profile's, their difference, and slices along the
    axis and the diagonal. A table of taps: one point of light, stage by stage. A material:
    coefficients, mean free paths and albedos.

    With --spectrum: the share of each separable term in the 2D kernel, of the sum of squares and of
    the sum of absolute values, and the number of terms for an error of 1 %.

    With --guide, for each k, the guide function of the guided fit, the residual that the fit leaves
    of one channel, and its pass beside the pre-integrated one; and the same for the pre-integrated
    pass, under the guide function for which it is optimal.

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
    """
    from sssfit.chart.files import chart_format, is_chart_file
    from sssfit.export.reports import page
    from sssfit.profile import Profile

    if given["output"] not in (None, "-"):
        chart_format(given["output"])  # before anything is read or drawn
    view = _view(file, given)
    name = file if view == "models" and file else profile_name(file)
    found, kind, made_of = _found(name, view)
    refuse(given, of_other_charts({kind}))
    if kind == "models" and isinstance(found, Profile):
        refuse(given, {"photons": "a new walk, and FILE is already one"})
    check_memory(_MEMORY.get(kind, "chart"), common.threads)
    profile, source = None, name if kind in ("profile", "spectrum", "guide") else None
    if kind in ("kernel", "taps"):
        profile, source = profile_of_kernel(found, name, given["profile"])
    stem = made_of if kind == "models" else stem_of(name, made_of)
    path = target(given["output"], f"{stem}.{kind}.png")
    with held([path], is_chart_file, inputs=[name, source], force=given["force"]):
        record = _computed(found, kind, profile, given, common) if kind in _COMPUTED else found
        write_chart(record, path)
    figures: dict[str, Any] = {} if view else {"kind": kind, "file": name}
    figures |= {"profile": source} if kind != "models" else {}
    own = {"material": made_of, "channels": found.channels} if kind not in _COMPUTED else {}
    figures |= own or record.to_dict()
    text = page(kind, figures) if kind in _COMPUTED else ""
    finish_one(common, path, figures, text, "a PNG")


def _view(file: str | None, given: Mapping[str, Any]) -> str:
    """Return the chart that was asked for by its name; by default it is that of the file."""
    views = [f"--{name}" for name in _VIEWS if given[name]]
    if len(views) > 1:
        raise click.UsageError(f"{' and '.join(views[:2])} are two charts; ask for one at a time.")
    view = views[0].removeprefix("--") if views else ""
    refuse(given, of_other_charts({view} if view else set(_FILES)))
    if view == "models" and file is None:
        raise click.UsageError("--models needs a material, or a profile of a photon walk.")
    return view


def _found(name: str, view: str) -> tuple[Any, str, str | None]:
    """Read the file; return what is drawn of it, and the name of what it was made from."""
    from sssfit import kinds
    from sssfit.errors import ProfileError
    from sssfit.kernel import SeparableKernel, Taps
    from sssfit.material import Material
    from sssfit.material.checks import is_name
    from sssfit.profile import Profile

    found = load_source(name) if view == "models" else load(kinds.load, name)
    if view in ("spectrum", "guide") and not isinstance(found, Profile):
        raise ProfileError(f"{name} is not a profile; --{view} draws one, a .profile.npz file.")
    if isinstance(found, Material):
        return found, view or "material", found.name
    if isinstance(found, Profile):
        return found, view or "profile", found.material_name
    if isinstance(found, SeparableKernel | Taps):
        made_of, kind = found.meta.get("material"), "taps" if isinstance(found, Taps) else "kernel"
        return found, kind, f"{made_of}.{found.method}" if is_name(made_of) else None
    first, count = found.profiles[0], len(found.profiles)
    if count > 1:
        note(f"Drawing {first.label}, the first of the walk's {count} materials.")
    return first, "checkpoint", first.material_name


def _computed(
    found: Any, kind: str, profile: Profile | None, given: Mapping[str, Any], common: Common
) -> Any:
    """Compute the record that is drawn from that of the file."""
    from sssfit import compare
    from sssfit.profile import Profile

    asked = {key: given[key] for key in ("ks", "channel") if given[key] is not None}
    if kind == "kernel":
        return compare.view_kernel(found, profile, channels=[given["channel"]] if asked else None)
    if kind == "taps":
        return compare.view_taps(found, profile)
    if kind != "models":
        compute = compare.compute_guide if kind == "guide" else compare.compute_spectrum
        return compute(found, mm_per_pixel=given["mm_per_pixel"], **asked)
    walk = found if isinstance(found, Profile) else None
    material = compare.material_of_walk(walk) if walk else found
    settings = {"walk": walk, "photons": given["photons"], "seed": common.seed}
    with walk_progress(material.name) as show:
        return compare.compare_models(material, **settings, threads=common.threads, progress=show)
