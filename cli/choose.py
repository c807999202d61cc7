"""``sssfit choose``: the cheapest kernel that a scene can do with."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ._choose_report import figures_of, step_line, text_of
from ._compiling import say_if_compiling
from ._deon_skin import DEON_SKIN
from ._options import Common, Length, Number, NumberRange, common_options
from ._outputs import KERNEL, held
from ._report import binary_stdout, finish, say
from ._scene import (
    MADE,
    Picture,
    Size,
    check_file_options,
    file_options,
    made_scene,
    read_scene,
)

if TYPE_CHECKING:
    from sssfit.compare.choose import Choice, Step
    from sssfit.material import Material
    from sssfit.render.scene import Scene


@click.command()
@click.argument("material")
@click.option(
    "--distance",
    "distance_mm",
    type=Length(),
    default="0.6m",
    show_default=True,
    metavar="LENGTH",
    help="From the eye to the surface.",
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
    help="Largest mean CIE Delta E 2000 against the true 2D kernel.",
)
@click.option(
    "--irradiance",
    default="head",
    show_default=True,
    metavar="NAME|FILE",
    help=f"What it is judged on: {', '.join(MADE)}, or your own EXR, HDR, TIFF or PNG file.",
)
@file_options
@click.option(
    "-o",
    "--output",
    metavar="FILE",
    help="Where the kernel goes, - for stdout.  [default: MATERIAL.chosen.kernel.json]",
)
@click.option("--force", is_flag=True, help="Replace an input, or a file that is not our kernel.")
@common_options
def choose(
    material: str,
    distance_mm: float,
    fov_degrees: float,
    resolution: tuple[int, int],
    tolerance: float,
    irradiance: str,
    layer: str | None,
    mask: str | None,
    output: str | None,
    force: bool,
    common: Common,
) -> None:
    """Find the cheapest kernel for MATERIAL that the scene shows no difference to, and write it.

    Distance, field of view and rows give the size of a pixel on the surface. Every method and
    number of terms is tried on it, each at seven supports, from no blur at all upwards by the
    weights it applies to a pixel, until the mean Delta E of the picture is within --tolerance. The
    picture is the middle of
    the frame, 512 x 512 pixels at most; where it shows less than 88 mm of the head, the choice
    has to hold on wider views, up to 88 mm, as well.

    \b
      sssfit choose skin1 --distance 0.6m --fov 30 --resolution 1920x1080
      sssfit choose marble --distance 2m --tolerance 0.5 --irradiance edge
      sssfit choose mine.toml --irradiance mine.exr -v
    """
    from sssfit.compare.choose import choose as choose_kernel
    from sssfit.compare.choose import mm_per_pixel_at
    from sssfit.kernel import is_kernel_file
    from sssfit.material import load_material

    if material == DEON_SKIN:
        raise click.UsageError(
            f"{material} has no coefficients, and choose needs a material: `sssfit materials` "
            "lists them."
        )
    picture = Picture(irradiance, None, None, {}, layer, mask)
    check_file_options(layer, mask, has_file=not picture.is_made)
    loaded = load_material(material)
    pitch = mm_per_pixel_at(distance_mm, fov_degrees, resolution[0])
    path = None if output == "-" else Path(output or f"{loaded.name}.chosen.kernel.json")
    with held([path], is_kernel_file, inputs=[material, irradiance], force=force, named=KERNEL):
        scene = None if irradiance == "head" else _scene(picture, pitch, resolution, common)
        _say_first(loaded, common)
        choice = choose_kernel(
            loaded,
            mm_per_pixel=pitch,
            scene=scene,
            distance_mm=distance_mm,
            frame=resolution,
            tolerance=tolerance,
            seed=common.seed,
            threads=common.threads,
            progress=lambda step: _say_step(step, common),
        )
        written = _write(choice, path)
    view = {"distance_mm": distance_mm, "fov_degrees": fov_degrees, "resolution": resolution[::-1]}
    figures = {"command": "choose", "output": written, **view, **figures_of(choice)}
    finish(common, figures, text_of(choice, written, figures), to_stderr=written == ["-"])
    if not written and path is not None and path.exists():
        say(common, f"{path} is of an earlier run, and not needed here.")


def _scene(picture: Picture, pitch: float, resolution: tuple[int, int], common: Common) -> Scene:
    """Make or read what the choice is judged on; a file that does not say has the pitch."""
    if not picture.is_made:
        return read_scene(picture, pitch, common)
    size = min(resolution[0], 512), min(resolution[1], 512)
    return made_scene(replace(picture, size=size), pitch, common)


def _say_first(material: Material, common: Common) -> None:
    """Say what takes longest."""
    from sssfit.compare.choose import is_exact

    if is_exact(material):
        say_if_compiling(common, solver=True)
        return
    say_if_compiling(common, walk=material)
    say(
        common,
        f"{material.name} is no half space with g = 0: tracing 1e7 photons for its true profile.",
    )


def _say_step(step: Step, common: Common) -> None:
    if common.verbose:
        say(common, step_line(step))


def _write(choice: Choice, path: Path | None) -> list[str]:
    """Write the kernel, where one is needed; return where it went."""
    if choice.fit is None:
        return []
    if path is None:
        choice.fit.kernel.write(binary_stdout())
        binary_stdout().flush()
        return ["-"]
    choice.fit.kernel.save(path)
    return [str(path)]
