"""The picture a kernel is applied to: made by name, or the user's own file."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ._options import Common
from ._output import say

if TYPE_CHECKING:
    from sssfit.scene.record import Scene

MADE = ("head", "disk", "edge", "separable", "stripes", "points", "noise", "highlights")
# Of the edge that kernels are compared on: along an axis a pre-integrated one is exact.
EDGE_DEGREES = 30.0
_ROWS = 512
_MOST_ROWS = 1080  # of a head whose size is not given
_COUNT = re.compile("0*[1-9][0-9]{0,8}")  # a picture of more columns than that has no memory


FILE_OPTIONS = (
    click.option(
        "--layer",
        metavar="NAME",
        help="Your own EXR: the layer to read, such as ViewLayer.Combined.  [default: R, G, B "
        "without a layer, or the only layer with them]",
    ),
    click.option(
        "--mask",
        type=click.Choice(["alpha"]),
        help="Your own file: only what its alpha covers by half or more is the object, lit and "
        "judged.  [default: all of it]",
    ),
)


def file_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of pictures from files."""
    for option in reversed(FILE_OPTIONS):
        command = option(command)
    return command


class Size(click.ParamType[tuple[int, int]]):
    """Columns and rows, as 1920x1080; gives (rows, columns)."""

    name = "size"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[int, int]:
        """Parse ``value``; a usage error (exit 2) names what was expected."""
        if isinstance(value, tuple):
            return value
        width, _, height = str(value).lower().partition("x")
        if not all(_COUNT.fullmatch(each) for each in (width, height)):
            self.fail(f"{value!r} is not a size in pixels, such as 1920x1080.", param, ctx)
        return int(height), int(width)


@dataclass(frozen=True)
class Picture:
    """What was asked for; ``own`` has the options of single made pictures that were given.

    ``layer`` and ``mask`` are for files: which layer of an EXR, and what the mask is.
    """

    irradiance: str
    size: tuple[int, int] | None
    mm_per_pixel: float | None
    own: Mapping[str, Any]
    layer: str | None = None
    mask: str | None = None

    @property
    def is_made(self) -> bool:
        """Whether it is one of ours."""
        return self.irradiance in MADE

    @property
    def name(self) -> str:
        """For file names."""
        return self.irradiance if self.is_made else Path(self.irradiance).stem


def made_options(name: str) -> dict[str, Any]:
    """Options of the made pictures that kernels are compared on."""
    return {"angle_degrees": EDGE_DEGREES} if name == "edge" else {}


def make_or_read(picture: Picture, mm_per_pixel: float, common: Common) -> Scene:
    """Make the picture on a kernel's pixels, or read it from its file."""
    if picture.is_made:
        return made_scene(picture, mm_per_pixel, common)
    return read_scene(picture, None, common)


def made_scene(picture: Picture, mm_per_pixel: float, common: Common) -> Scene:
    """Make the picture on these pixels."""
    from sssfit.scene.made import make_scene, options_of

    if picture.mm_per_pixel is not None:
        raise click.UsageError(
            f"--mm-per-pixel is for pictures from files and for --screen; {picture.irradiance} is "
            "made on the kernel's pixels."
        )
    check_file_options(picture.layer, picture.mask, has_file=False)
    height, width = picture.size or _default_size(picture, mm_per_pixel, common)
    own, known = dict(picture.own), options_of(picture.irradiance)
    for key, value in own.items():
        if value is not None and key not in known:
            raise click.UsageError(
                f"--{key.split('_')[0]} is not for {picture.irradiance}; leave it out."
            )
    if "seed" in known:
        own["seed"] = common.seed
    return make_scene(
        picture.irradiance, height=height, width=width, mm_per_pixel=mm_per_pixel, **own
    )


def _default_size(picture: Picture, mm_per_pixel: float, common: Common) -> tuple[int, int]:
    """512 x 512; for a head as many rows as it takes, up to 1080."""
    if picture.irradiance != "head":
        return _ROWS, _ROWS
    from sssfit.scene.head import whole_face_mm_per_pixel

    # The face takes the more rows, the smaller a pixel.
    wanted = math.ceil(whole_face_mm_per_pixel(1, 1) / mm_per_pixel)
    if wanted > _MOST_ROWS:
        say(
            common,
            f"The whole face takes {wanted} rows of {mm_per_pixel:.4g} mm; {_MOST_ROWS} show its "
            f"middle. Give --size {wanted}x{wanted}, or fit the kernel to larger pixels.",
        )
    rows = min(wanted, _MOST_ROWS)
    return rows, rows


def read_scene(picture: Picture, otherwise: float | None, common: Common) -> Scene:
    """Read the picture; ``otherwise`` is the size of its pixels where nothing says it."""
    from sssfit.errors import RenderError
    from sssfit.formats.pictures import load_image
    from sssfit.scene.record import Scene

    if not Path(picture.irradiance).exists():
        raise click.UsageError(
            f"there is no picture {picture.irradiance!r}; expected {', '.join(MADE)}, or your own "
            "file."
        )
    asked = {**picture.own, "size": picture.size}
    given = [key for key, value in asked.items() if value is not None]
    if given:
        raise click.UsageError(
            f"--{given[0].split('_')[0]} is for made pictures ({', '.join(MADE)}); leave it out."
        )
    image = load_image(picture.irradiance, layer=picture.layer)
    pitch = picture.mm_per_pixel or image.mm_per_pixel or otherwise
    if pitch is None:
        raise RenderError(
            f"{picture.irradiance} does not say how large its pixels are; give --mm-per-pixel."
        )
    scene = Scene.from_image(image, pitch, alpha_is_mask=picture.mask == "alpha")
    for note in image.notes:
        say(common, f"{picture.irradiance}: {note}")
    return scene


def check_file_options(layer: str | None, mask: str | None, *, has_file: bool) -> None:
    """Refuse options of pictures from files where there are none."""
    for option, value in (("--layer", layer), ("--mask", mask)):
        if value is not None and not has_file:
            raise click.UsageError(f"{option} is for pictures from files; leave it out.")
