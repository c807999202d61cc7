"""``sssfit render``: a kernel on a picture, and what it lost against the true 2D kernel."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ._input import kernel_name, load
from ._options import Common, NumberRange, common_options
from ._output import binary_stdout, finish, held, say, stem_of, target
from ._render_options import picture_options
from ._render_report import figures_of, text_of
from ._scene import Picture, make_or_read
from ._truth import true_profile

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from sssfit.compare.judge import Judgement
    from sssfit.kernel import SeparableKernel
    from sssfit.scene.record import Scene

    FloatArray = npt.NDArray[np.float64]


# Of the head's key light: behind both ears.
_BEHIND_DEGREES = 170.0


@click.command()
@click.argument("kernel", required=False)
@picture_options
@click.option(
    "--profile",
    metavar="FILE",
    help="What to measure against.  [default: the profile here that the kernel was fitted to]",
)
@click.option(
    "--exposure",
    type=NumberRange(min=0.0, min_open=True),
    metavar="FACTOR",
    help="Of Delta E and of PNG files.  [default: from the true picture]",
)
@click.option("--structure", is_flag=True, help='SSIM and FLIP too (needs "sssfit[metrics]").')
@click.option(
    "-o",
    "--output",
    metavar="FILE",
    help="Where the picture goes, .exr, .tif or .png (16 bits, sRGB); - for EXR on stdout."
    "  [default: KERNEL.PICTURE.exr]",
)
@click.option("--truth", metavar="FILE", help="Write the true picture as well.")
@click.option("--difference", metavar="FILE", help="Write the absolute difference as well.")
@click.option(
    "--gain",
    type=NumberRange(min=0.0, min_open=True),
    default=1.0,
    show_default=True,
    metavar="FACTOR",
    help="--difference: magnify it.",
)
@click.option(
    "--difference-map",
    type=click.Choice(["signed", "absolute"]),
    help="--difference: in false colours. signed: luminance, blue where the kernel is darker, red "
    "where it is brighter; absolute: the largest of the channels, violet to yellow. The scale is "
    "printed; it ends at the largest difference over --gain.",
)
@click.option("--force", is_flag=True, help="Replace an input, or a file that is not our picture.")
@common_options
def render(
    kernel: str | None,
    irradiance: str,
    size: tuple[int, int] | None,
    mm_per_pixel: float | None,
    layer: str | None,
    mask: str | None,
    border: str,
    transmit: bool,
    screen: bool,
    follow: str | None,
    profile: str | None,
    exposure: float | None,
    structure: bool,
    output: str | None,
    truth: str | None,
    difference: str | None,
    gain: float,
    difference_map: str | None,
    force: bool,
    common: Common,
    **own: Any,
) -> None:
    """Apply KERNEL to a picture of irradiance, and measure what it loses.

    KERNEL is a .kernel.json file, or - for stdin; by default the newest of this folder. The result
    is radiant exitance in linear light. Made pictures have the kernel's pixels; a file of your own
    (EXR, HDR, TIFF, PNG, JPG, TGA) has to have them too, except with --screen. The truth is the
    same picture convolved with the whole 2D kernel of the profile; Delta E 2000 is of both in sRGB
    at the exposure. The alpha of your file goes into the result and the truth as it is.

    \b
      sssfit render skin1.svd3.kernel.json --irradiance head -o out.exr
      sssfit render --irradiance edge --angle 45 --size 256x256
      sssfit render --irradiance mine.png --mm-per-pixel 0.3 -o mine.tif --difference lost.png
      sssfit render --screen --irradiance head
      sssfit render --irradiance head --transmit -o ears.png
    """
    from sssfit.formats.pictures import image_format, is_image_file
    from sssfit.kernel import SeparableKernel

    _check_options(screen, follow, profile or truth or difference or structure)
    if difference is None and (difference_map or gain != 1.0):
        raise click.UsageError("--gain and --difference-map are for --difference; name its file.")
    if transmit:
        own = _lit_from_behind(irradiance, own)
    picture = Picture(irradiance, size, mm_per_pixel, own, layer, mask)
    name = kernel_name(kernel, common)
    loaded = load(SeparableKernel, name)
    path = target(output, f"{stem_of(name)}.{picture.name}.exr")
    targets = {"picture": path} if path else {}
    targets |= {k: Path(v) for k, v in (("truth", truth), ("difference", difference)) if v}
    for each in targets.values():
        image_format(each)
    outputs = [*targets.values(), *([None] if path is None else [])]
    with held(outputs, is_image_file, inputs=[name, irradiance, profile], force=force):
        scene = make_or_read(*_on_pixels(picture, loaded, screen=screen), common)
        through = None
        if transmit:
            from sssfit.render.transmittance import transmitted, with_transmitted

            through = transmitted(scene, loaded)
            scene = scene if screen else with_transmitted(scene, loaded)
        source, source_name = (
            (None, None) if screen else true_profile(loaded, name, profile, common)
        )
        if source is None and (truth or difference):
            raise click.UsageError("--truth and --difference need the profile; name it.")
        settings: dict[str, Any] = {"border": border, "threads": common.threads}
        if screen:
            from sssfit.compare.judge import judge_in_screen_space

            result = judge_in_screen_space(scene, loaded, follow=follow or "gaussian", **settings)
        else:
            from sssfit.compare.judge import judge

            settings |= {"exposure": exposure, "structure": structure}
            result = judge(scene, loaded, source, **settings)
        lost = _lost(result, gain, difference_map) if difference else {}
        _write(result, lost, scene, loaded, targets, exposure, common)
    figures = {
        "command": "render",
        "output": [*(["-"] if path is None else []), *map(str, targets.values())],
        "kernel": name,
        "profile": source_name,
        "border": border,
        "follow": (follow or "gaussian") if screen else None,
        **figures_of(result, scene, loaded, through),
        **{f"difference_{key}": lost.get(key) for key in ("gain", "map", "of", "end")},
    }
    finish(common, figures, text_of(figures), to_stderr=path is None)


def _on_pixels(picture: Picture, kernel: SeparableKernel, *, screen: bool) -> tuple[Picture, float]:
    """Return what to make or read, and the size of a made picture's pixels [mm].

    Convolved as it is, a kernel has the picture's pixels; a screen's may have any.
    """
    if not (screen and picture.is_made):
        return picture, kernel.mm_per_pixel
    from sssfit.fit import MM_PER_PIXEL

    return dataclasses.replace(picture, mm_per_pixel=None), picture.mm_per_pixel or MM_PER_PIXEL


def _lit_from_behind(irradiance: str, own: dict[str, Any]) -> dict[str, Any]:
    """Return the head's options with light through it, its key light behind unless it is given."""
    if irradiance != "head":
        raise click.UsageError("--transmit is for the head; leave it out.")
    light = own["light_degrees"]
    return {**own, "transmit": True, "light_degrees": _BEHIND_DEGREES if light is None else light}


def _check_options(screen: bool, follow: str | None, compared: object) -> None:
    """Refuse options that would do nothing."""
    if screen and compared:
        raise click.UsageError(
            "--screen has no true picture to measure against: leave out --profile, --truth, "
            "--difference and --structure."
        )
    if follow and not screen:
        raise click.UsageError("--follow is for --screen; leave it out.")


def _lost(result: Judgement, gain: float, kind: str | None) -> dict[str, Any]:
    """Return the difference as it is written, and what the report says of it."""
    from sssfit.measure.difference import difference_map, magnified_difference

    assert result.truth is not None  # without a profile the option was refused
    if kind is None:
        pixels = magnified_difference(result.picture, result.truth, gain=gain)
        return {"pixels": pixels, "gain": gain}
    drawn = difference_map(result.picture, result.truth, kind=kind, gain=gain)
    return {"pixels": drawn.pixels, "gain": gain, "map": kind, "of": drawn.what, "end": drawn.end}


def _write(
    result: Judgement,
    lost: dict[str, Any],
    scene: Scene,
    kernel: SeparableKernel,
    targets: dict[str, Path],
    exposure: float | None,
    common: Common,
) -> None:
    """Write the picture, and the truth and the difference where they are wanted."""
    from sssfit.formats.pictures import image_format, save_image
    from sssfit.measure.score import auto_exposure

    pictures: dict[str, Any] = {"picture": result.picture, "truth": result.truth}
    pictures["difference"] = lost.get("pixels")
    settings: dict[str, Any] = {
        "channels": kernel.channels,
        "mm_per_pixel": kernel.mm_per_pixel,
    }
    alpha = _alpha(scene, kernel, common)
    if "picture" not in targets:
        save_image(binary_stdout(), result.picture, format="exr", **settings, **alpha)
        binary_stdout().flush()
    shown = exposure or (result.score.exposure if result.score else auto_exposure(result.picture))
    for what, path in targets.items():
        own = settings | (alpha if what != "difference" else {})
        own["exposure"] = shown if image_format(path) == "png" else 1.0
        if what == "difference" and "map" in lost:  # its colours are no light
            own |= {"exposure": 1.0, "channels": ("R", "G", "B")}
        for note in save_image(path, pictures[what], **own):
            say(common, f"{path}: {note}")


def _alpha(scene: Scene, kernel: SeparableKernel, common: Common) -> dict[str, Any]:
    """Return what `save_image` takes of the picture's alpha, where a file can hold it."""
    if scene.alpha is None:
        return {}
    if len(kernel.channels) not in (1, 3) or "A" in kernel.channels:
        say(common, f"alpha left out beside the channels {', '.join(kernel.channels)}")
        return {}
    return {"alpha": scene.alpha, "alpha_is_multiplied": scene.alpha_is_multiplied}
