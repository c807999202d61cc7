"""``sssfit choose``: the cheapest kernel whose error a scene does not show."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sssfit.messages import note
from sssfit.scene.made import EDGE_DEGREES

from ._input import load_source
from ._options import Common, common_options, options
from ._output import KERNEL, PROFILE, finish, held, stem_of, target, write
from ._picture import check_pictures
from ._verb_options import CHOOSE

if TYPE_CHECKING:
    from sssfit.choose.choice import Choice
    from sssfit.scene.record import Scene

_METRES = (0.1, 9.0)  # plain numbers that may have been meant in metres; 1cm is 10 mm and was not
_MOST_PIXELS = 512  # of a made picture, along an edge


@click.command()
@click.argument("material")
@options(*CHOOSE)
@common_options
def choose(material: str, common: Common, **given: Any) -> None:
    """Choose the cheapest kernel whose error the scene does not show, and save it.

    Tries every method and rank at seven supports, cheapest first, and stops at the first whose
    Delta E is within --tolerance. Cost is weights applied to a pixel. By default 95 % of the pixels
    must be within a Delta E of 1, about the smallest difference seen side by side.

    Distance, field of view and rows give the size of a pixel. The picture is the middle of the
    frame, 512 x 512 pixels at most. For a close-up of the head, less than 88 mm across, the kernel
    must also hold on wider views.

    MATERIAL is a name (`sssfit materials` lists them), a path to your own TOML, or a .profile.npz
    file, - for one on stdin. The profile of a material is saved beside its kernel.

    \b
      sssfit choose skin1 --distance 0.6m --fov 30 --resolution 1920x1080
      sssfit choose marble --distance 2m --tolerance 0.5 --irradiance edge
      sssfit choose slab.profile.npz --tolerance-of mean --tolerance 0.3
      sssfit choose mine.toml --irradiance mine.exr -v
    """
    from sssfit.choose import choice as library
    from sssfit.choose.report import sentences, step_line
    from sssfit.export.reports import page
    from sssfit.kernel import is_kernel_file
    from sssfit.material import Material
    from sssfit.profile import is_profile_file

    _check_distance(given["distance_mm"])
    check_pictures([given["irradiance"]], given["layer"], given["mask"])
    source = load_source(material)
    view = {key: given[key] for key in ("distance_mm", "fov_degrees")}
    pitch = library.mm_per_pixel_at(**view, rows=given["resolution"][0])
    asked = {key: given[key] for key in ("distance_mm", "tolerance", "tolerance_of")}
    is_file = material == "-" or material.endswith(".npz")
    name = source.name if isinstance(source, Material) else stem_of(material, source.material_name)
    path = target(given["output"], f"{name}.chosen.kernel.json")
    profile_path = None
    if path is not None and not is_file:  # not simulate's name: a longer walk may lie there
        stem = path.name.removesuffix(".json").removesuffix(".kernel")
        profile_path = path.with_name(f"{stem}.profile.npz")
    hold = {"inputs": [material, given["irradiance"]], "force": given["force"]}
    with (
        held([path], is_kernel_file, named=KERNEL, **hold),
        held([profile_path] if profile_path else [], is_profile_file, named=PROFILE, **hold),
    ):
        scene = None if given["irradiance"] == "head" else _scene(pitch, given, common)
        choice = library.choose(
            source,
            mm_per_pixel=pitch,
            scene=scene,
            frame=given["resolution"],
            **asked,
            seed=common.seed,
            threads=common.threads,
            progress=(lambda step: note(step_line(step))) if common.verbose else None,
        )
        written = _write(choice, path, profile_path)
    view["resolution"] = given["resolution"][::-1]
    figures = {"output": written, **view, **choice.to_dict()}
    text = page("choose", {**figures, "sentences": "\n".join(sentences(choice))})
    finish(common, figures, text)
    if not written and path is not None and path.exists():
        note(f"{path} is from an earlier run; this view needs no kernel.")


def _check_distance(distance_mm: float) -> None:
    """Refuse a camera nearer than the head can be seen from; the number may have meant metres."""
    from sssfit.scene.head import MIN_DISTANCE_MM

    if distance_mm < MIN_DISTANCE_MM:
        metres = f"a plain number is mm: did you mean {distance_mm:g}m?"
        raise click.UsageError(
            f"--distance: {distance_mm:g} mm is nearer than {MIN_DISTANCE_MM:g} mm; "
            f"{metres if _METRES[0] <= distance_mm <= _METRES[1] else 'move away.'}"
        )


def _scene(pitch: float, given: dict[str, Any], common: Common) -> Scene:
    """Make or read what the choice is judged on; a file that does not say has the pitch."""
    from sssfit.scene.load import load_scene

    name, asked = given["irradiance"], {key: given[key] for key in ("layer", "mask")}
    asked |= {"angle_degrees": EDGE_DEGREES} if name == "edge" else {}
    rows, columns = (min(each, _MOST_PIXELS) for each in given["resolution"])
    return load_scene(name, otherwise=pitch, size=(rows, columns), seed=common.seed, **asked)


def _write(choice: Choice, path: Path | None, profile_path: Path | None) -> list[str]:
    """Write the kernel, where one is needed, and the profile; return where they went."""
    if choice.fit is None:
        return []
    if profile_path is not None:
        write(choice.profile.write, profile_path)
    write(choice.fit.kernel.write, path)
    return [str(path or "-"), *([] if profile_path is None else [str(profile_path)])]
