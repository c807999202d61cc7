"""``sssfit render``: a kernel on a picture, and its error against the true 2D kernel."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sssfit.scene.made import MADE, check_pictures

from ._input import kernel_name, load, profile_of_kernel
from ._options import Common, common_options, method_options, options, own_settings
from ._output import binary_stdout, finish, held, stem_of, target
from ._verb_options import RENDER, RENDER_PICTURE

if TYPE_CHECKING:
    from sssfit.compare.evaluate import Evaluation
    from sssfit.kernel import Kernel

# Of the head's key light: behind both ears.
_BEHIND_DEGREES = 170.0


@click.command(short_help="Render a picture by a kernel, with its error.")
@click.argument("kernel", required=False)
@options(*RENDER_PICTURE, method_options(MADE), *RENDER)
@common_options
@click.pass_context
def render(context: click.Context, /, kernel: str | None, common: Common, **given: Any) -> None:
    """Apply KERNEL to a picture of irradiance, and measure its error.

    KERNEL is a .kernel.json or .taps.json file, or - for stdin; by default the newest of either
    kind in this folder. The result is radiant exitance in linear light. Made pictures use the
    kernel's pixel size; your own file (EXR, HDR, TIFF, PNG, JPG, TGA) must have it too, except with
    --screen and for a table of taps, which serves any size. The true picture is the same irradiance
    convolved with the whole 2D kernel of the profile; Delta E 2000 compares the two in sRGB at the
    exposure. The alpha channel of your file is copied, clipped to 0 to 1.

    \b
      sssfit render skin1.svd3.kernel.json --irradiance head -o out.exr
      sssfit render --irradiance edge --angle 45 --size 256x256
      sssfit render --irradiance mine.png --mm-per-pixel 0.3 -o mine.tif --difference lost.png
      sssfit render --screen --irradiance head
      sssfit render --irradiance head --transmit -o ears.png
    """
    from sssfit.export.reports import page
    from sssfit.formats.pictures import image_format, is_image_file
    from sssfit.kernel import read_kernel

    own = _check(context, given)
    name, irradiance = kernel_name(kernel), given["irradiance"]
    loaded = load(read_kernel, name)
    path = target(given["output"], f"{stem_of(name)}.{Path(irradiance).stem}.exr")
    asked = {"picture": path, "truth": given["truth"], "difference": given["difference"]}
    files = {key: Path(each) for key, each in asked.items() if each}
    for each in files.values():
        image_format(each)
    outputs = [*files.values(), *[None] * (path is None)]
    inputs = [name, irradiance, given["profile"]]
    with held(outputs, is_image_file, inputs=inputs, force=given["force"]):
        source, made = _rendered(loaded, name, given, own, common)
        targets: dict[str, Any] = files if path else {"picture": binary_stdout(), **files}
        made.save(targets, exposure=given["exposure"])
    figures = {
        "output": [*(["-"] if path is None else []), *map(str, files.values())],
        "kernel": name,
        "profile": source,
        **{key: given[key] for key in ("border", "intermediate")},
        "follow": (given["follow"] or "gaussian") if given["screen"] else None,
        **made.to_dict(),
    }
    finish(common, figures, page("render", figures))


def _check(context: click.Context, given: dict[str, Any]) -> dict[str, Any]:
    """Refuse options that do not go together; return the made picture's own."""
    name, is_made, screen = given["irradiance"], given["irradiance"] in MADE, given["screen"]
    if screen and any(given[key] for key in ("profile", "truth", "difference", "structure")):
        raise click.UsageError(
            "--screen has no true picture to measure against: leave out --profile, --truth, "
            "--difference and --structure."
        )
    if given["follow"] and not screen:
        raise click.UsageError("--follow is for --screen; leave it out.")
    if given["difference"] is None and (given["difference_map"] or given["gain"] != 1.0):
        raise click.UsageError("--gain and --difference-map are for --difference; name its file.")
    check_pictures([name], **{key: given[key] for key in ("layer", "mask", "size")})
    if is_made and not screen and given["mm_per_pixel"] is not None:
        raise click.UsageError(
            f"--mm-per-pixel is for pictures from files and for --screen; {name} is made on the "
            "kernel's pixels."
        )
    own = own_settings(context, MADE, name, given, "--irradiance")
    return ({"light_degrees": _BEHIND_DEGREES} | own) if given["transmit"] else own


def _rendered(
    kernel: Kernel, name: str, given: Mapping[str, Any], own: dict[str, Any], common: Common
) -> tuple[str | None, Evaluation]:
    """Light the picture and render it; return the file of its profile, too."""
    from sssfit.compare.evaluate import evaluate, evaluate_in_screen_space
    from sssfit.fit import MM_PER_PIXEL
    from sssfit.scene.load import load_scene

    screen, picture = given["screen"], given["irradiance"]
    made_mm = (given["mm_per_pixel"] or MM_PER_PIXEL) if screen else kernel.mm_per_pixel
    asked = {key: given[key] for key in ("size", "layer", "mask")} | own
    pitch = made_mm if picture in MADE else given["mm_per_pixel"]
    scene = load_scene(picture, pitch, seed=common.seed, **asked)
    how = {key: given[key] for key in ("transmit", "border", "intermediate")}
    how |= {"threads": common.threads}
    if screen:
        how["follow"] = given["follow"] or "gaussian"
        return None, evaluate_in_screen_space(scene, kernel, **how)
    profile, source = profile_of_kernel(kernel, name, given["profile"])
    if profile is None and (given["truth"] or given["difference"]):
        raise click.UsageError("--truth and --difference need the profile; name it.")
    how |= {key: given[key] for key in ("exposure", "structure")}
    made = evaluate(scene, kernel, profile, **how)
    if given["difference"]:
        made = made.with_difference(given["difference_map"], given["gain"])
    return source, made
