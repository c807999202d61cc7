"""``sssfit choose``: the cheapest kernel whose error a scene does not show."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sssfit.messages import number
from sssfit.methods import DEON_SKIN

from ._choose_report import step_line, text_of
from ._input import load
from ._options import Common, Length, Number, NumberRange, common_options
from ._output import KERNEL, PROFILE, finish, held, say, stem_of, target, write
from ._progress import say_if_compiling
from ._scene import (
    EDGE_DEGREES,
    MADE,
    Picture,
    Size,
    check_file_options,
    file_options,
    made_options,
    made_scene,
    read_scene,
)

if TYPE_CHECKING:
    from sssfit.choose.choice import Choice, Step
    from sssfit.material import Material
    from sssfit.profile import Profile
    from sssfit.scene.record import Scene

_PROFILE_ENDING, _ENDING = ".npz", ".chosen.kernel.json"
_WORTH_A_NOTE = 1e-3  # of the light
_METRES = (0.1, 9.0)  # plain numbers that may have been meant in metres; 1cm is 10 mm and was not


@click.command()
@click.argument("material")
@click.option(
    "--distance",
    "distance_mm",
    type=Length(),
    default="0.6m",
    show_default=True,
    metavar="LENGTH",
    help="Camera distance.",
)
@click.option(
    "--fov",
    "fov_degrees",
    type=NumberRange(0.0, 180.0, min_open=True, max_open=True),
    default=30.0,
    show_default=True,
    metavar="DEGREES",
    help="Vertical field of view.",
)
@click.option(
    "--resolution",
    type=Size(),
    default="1920x1080",
    show_default=True,
    metavar="WxH",
    help="Columns and rows of the frame.",
)
@click.option(
    "--tolerance",
    type=Number(),
    default=1.0,
    show_default=True,
    metavar="DELTA-E",
    help="Largest CIE Delta E 2000 against the true 2D kernel.",
)
@click.option(
    "--tolerance-of",
    type=click.Choice(["p95", "p99", "mean"]),
    default="p95",
    show_default=True,
    help="The figure to compare with it: a percentile over the picture, or the mean, which hides "
    "the pixels that are far off.",
)
@click.option(
    "--irradiance",
    default="head",
    show_default=True,
    metavar="NAME|FILE",
    help=f"Picture to judge by: {', '.join(MADE)}, or your own EXR, HDR, TIFF, PNG, JPG or TGA "
    f"file. The edge is at {EDGE_DEGREES:g} degrees.",
)
@file_options
@click.option(
    "-o",
    "--output",
    metavar="FILE",
    help="Kernel file, - for stdout; the profile goes beside it.  "
    "[default: MATERIAL.chosen.kernel.json]",
)
@click.option(
    "--force", is_flag=True, help="Replace an input, or files that are not our kernel or profile."
)
@common_options
def choose(
    material: str,
    distance_mm: float,
    fov_degrees: float,
    resolution: tuple[int, int],
    tolerance: float,
    tolerance_of: str,
    irradiance: str,
    layer: str | None,
    mask: str | None,
    output: str | None,
    force: bool,
    common: Common,
) -> None:
    """Choose the cheapest kernel whose error the scene does not show, and save it.

    Tries every method and rank at seven supports, cheapest first, and stops at the first whose
    Delta E is within --tolerance. Cost is weights applied to a pixel. By default 95 % of the pixels
    have to be within a Delta E of 1, about what an eye can tell side by side.

    Distance, field of view and rows give the size of a pixel. The picture is the middle of the
    frame, 512 x 512 pixels at most. A close-up of the head, less than 88 mm across, has to hold on
    wider views as well.

    MATERIAL is a name (`sssfit materials` lists them), a path to your own TOML, or a .profile.npz
    file, - for one on stdin. The profile of a material is saved beside its kernel.

    \b
      sssfit choose skin1 --distance 0.6m --fov 30 --resolution 1920x1080
      sssfit choose marble --distance 2m --tolerance 0.5 --irradiance edge
      sssfit choose slab.profile.npz --tolerance-of mean --tolerance 0.3
      sssfit choose mine.toml --irradiance mine.exr -v
    """
    from sssfit.choose.choice import choose as choose_kernel
    from sssfit.choose.choice import mm_per_pixel_at
    from sssfit.kernel import is_kernel_file
    from sssfit.material import Material
    from sssfit.profile import is_profile_file

    _check_distance(distance_mm)
    picture = Picture(irradiance, None, None, made_options(irradiance), layer, mask)
    check_file_options(layer, mask, has_file=not picture.is_made)
    source = _source(material)
    pitch = mm_per_pixel_at(distance_mm, fov_degrees, resolution[0])
    name = source.name if isinstance(source, Material) else stem_of(material, source.material_name)
    path = target(output, f"{name}{_ENDING}")
    profile_path = _beside(path, material)
    read, beside = [material, irradiance], [] if profile_path is None else [profile_path]
    with (
        held([path], is_kernel_file, inputs=read, force=force, named=KERNEL),
        held(beside, is_profile_file, inputs=read, force=force, named=PROFILE),
    ):
        scene = None if irradiance == "head" else _scene(picture, pitch, resolution, common)
        _say_first(source, common)
        choice = choose_kernel(
            source,
            mm_per_pixel=pitch,
            scene=scene,
            distance_mm=distance_mm,
            frame=resolution,
            tolerance=tolerance,
            tolerance_of=tolerance_of,
            seed=common.seed,
            threads=common.threads,
            progress=lambda step: _say_step(step, common),
        )
        written = _write(choice, path, profile_path)
    view = {"distance_mm": distance_mm, "fov_degrees": fov_degrees, "resolution": resolution[::-1]}
    figures = {"command": "choose", "output": written, **view, **choice.to_dict()}
    finish(common, figures, text_of(choice, written, figures), to_stderr=written == ["-"])
    if not written and path is not None and path.exists():
        say(common, f"{path} is from an earlier run; this view needs no kernel.")


def _check_distance(distance_mm: float) -> None:
    """Refuse a camera nearer than the head can be seen from; the number may have meant metres."""
    from sssfit.scene.head import MIN_DISTANCE_MM

    if distance_mm < MIN_DISTANCE_MM:
        metres = f"a plain number is mm: did you mean {distance_mm:g}m?"
        raise click.UsageError(
            f"--distance: {distance_mm:g} mm is nearer than {MIN_DISTANCE_MM:g} mm; "
            f"{metres if _METRES[0] <= distance_mm <= _METRES[1] else 'move away.'}"
        )


def _source(name: str) -> Material | Profile:
    """Read a profile, or load a material."""
    from sssfit.material import load_material
    from sssfit.profile import Profile

    if name == DEON_SKIN:
        from sssfit.simulate import simulate_deon_skin

        return simulate_deon_skin()
    is_profile = name == "-" or name.endswith(_PROFILE_ENDING)
    return load(Profile, name) if is_profile else load_material(name)


def _beside(path: Path | None, name: str) -> Path | None:
    """Where the profile goes; None for stdout, and where it was read from a file.

    Not under the name that `sssfit simulate` gives: a longer walk may lie there.
    """
    if path is None or name == "-" or name.endswith(_PROFILE_ENDING):
        return None
    stem = path.name.removesuffix(".json").removesuffix(".kernel")
    return path.with_name(f"{stem}.profile.npz")


def _scene(picture: Picture, pitch: float, resolution: tuple[int, int], common: Common) -> Scene:
    """Make or read what the choice is judged on; a file that does not say has the pitch."""
    if not picture.is_made:
        return read_scene(picture, pitch, common)
    size = min(resolution[0], 512), min(resolution[1], 512)
    return made_scene(replace(picture, size=size), pitch, common)


def _say_first(source: Material | Profile, common: Common) -> None:
    """Say what takes longest, and what a profile cannot tell."""
    from sssfit.choose.choice import is_exact
    from sssfit.profile import Profile

    if isinstance(source, Profile):
        missing = source.beyond_grid.sum() / max(source.diffuse_reflectance.sum(), 1e-300)
        if missing > _WORTH_A_NOTE:
            say(
                common,
                f"{number(missing, '.2g%')} of the light lies beyond the profile's grid, where the "
                "true picture lacks it and a kernel does not: simulate with a larger radius.",
            )
        return
    if is_exact(source):
        say_if_compiling(common, solver=True)
        return
    say_if_compiling(common, walk=source)
    say(
        common,
        f"{source.name} has no exact solution: tracing 1e7 photons for its true profile.",
    )


def _say_step(step: Step, common: Common) -> None:
    if common.verbose:
        say(common, step_line(step))


def _write(choice: Choice, path: Path | None, profile_path: Path | None) -> list[str]:
    """Write the kernel, where one is needed, and the profile; return where they went."""
    if choice.fit is None:
        return []
    if profile_path is not None:
        write(choice.profile, profile_path)
    write(choice.fit.kernel, path)
    return [str(path or "-"), *([] if profile_path is None else [str(profile_path)])]
