"""``sssfit choose``: the table of taps for a scene, by its error or by a budget of fetches."""

from __future__ import annotations

from typing import Any

import click

from sssfit.messages import note
from sssfit.scene.made import check_pictures

from ._input import load_source
from ._options import Common, common_options, options
from ._output import KERNEL, PROFILE, finish, held, stem_of, target, write
from ._verb_options import CHOOSE


@click.command(short_help="Find the cheapest table of taps for a view.")
@click.argument("material")
@options(*CHOOSE)
@common_options
def choose(material: str, common: Common, **given: Any) -> None:
    """Choose the cheapest table of taps whose error is invisible in the scene.

    Cost is texture fetches a pixel. By default 95 % of the pixels must be within a Delta E of 1,
    about the smallest difference seen side by side. With --fetches alone it is the table with the
    least error within that budget; with --tolerance as well, the cheapest one that meets both.

    Distance, field of view and rows give the size of a pixel. The picture is the middle of the
    frame, 512 x 512 pixels at most. For a close-up of the head, less than 88 mm across, the kernel
    must also hold on wider views.

    MATERIAL is a name (`sssfit materials` lists them), a path to your own TOML, or a .profile.npz
    file, - for one on stdin. The profile of a material is saved beside its kernel.

    \b
      sssfit choose skin1 --distance 0.6m --fov 30 --resolution 1920x1080
      sssfit choose skin1 --fetches 14 --passes 8
      sssfit choose marble --distance 2m --tolerance 0.5 --irradiance edge
      sssfit choose slab.profile.npz --tolerance-of mean --tolerance 0.3
      sssfit choose mine.toml --irradiance mine.exr -v
    """
    from sssfit.choose import choice as library
    from sssfit.choose import views
    from sssfit.choose.report import sentences, step_line
    from sssfit.export.reports import page
    from sssfit.kernel import is_taps_file
    from sssfit.material import Material
    from sssfit.profile import is_profile_file
    from sssfit.stability.rules import warn_of_doubts

    views.check_distance(given["distance_mm"])
    on = {key: given[key] for key in ("layer", "mask")}
    check_pictures([given["irradiance"]], **on)
    source = load_source(material)
    frame, view = given["resolution"], {k: given[k] for k in ("distance_mm", "fov_degrees")}
    pitch = library.mm_per_pixel_at(**view, rows=frame[0])
    asked = {k: given[k] for k in ("distance_mm", "tolerance", "tolerance_of", "fetches", "passes")}
    is_file = material == "-" or material.endswith(".npz")
    name = source.name if isinstance(source, Material) else stem_of(material, source.material_name)
    path = target(given["output"], f"{name}.chosen.taps.json")
    profile_path = None
    if path is not None and not is_file:  # not simulate's name: a longer walk may lie there
        profile_path = path.with_name(f"{stem_of(path.name)}.profile.npz")
    hold = {"inputs": [material, given["irradiance"]], "force": given["force"]}
    with (
        held([path], is_taps_file, named=KERNEL, **hold),
        held([profile_path] if profile_path else [], is_profile_file, named=PROFILE, **hold),
    ):
        choice = library.choose(
            source,
            mm_per_pixel=pitch,
            scene=views.scene_for(given["irradiance"], pitch, frame, seed=common.seed, **on),
            frame=frame,
            **asked,
            seed=common.seed,
            threads=common.threads,
            progress=(lambda step: note(step_line(step))) if common.verbose else None,
        )
        written: list[str] = []
        if choice.fit is not None:
            warn_of_doubts(choice.fit.kernel, choice.profile, strict=given["strict"])
            if profile_path is not None:
                write(choice.profile.write, profile_path)
            write(choice.fit.kernel.write, path)
            written = [str(path or "-"), *([] if profile_path is None else [str(profile_path)])]
    view["resolution"] = frame[::-1]
    figures = {"output": written, **view, **choice.to_dict()}
    text = page("choose", {**figures, "sentences": "\n".join(sentences(choice))})
    finish(common, figures, text)
    if not written and path is not None and path.exists():
        note(f"{path} is from an earlier run; this view needs no kernel.")
