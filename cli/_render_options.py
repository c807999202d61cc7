"""The options of ``sssfit render`` that say what is lit, and how the kernel is applied."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

from ._options import Length, Number
from ._scene import FILE_OPTIONS, MADE, Size

_OPTIONS = (
    click.option(
        "--irradiance",
        default=MADE[0],
        show_default=True,
        metavar="NAME|FILE",
        help=f"What is lit: {', '.join(MADE)}, or your own EXR, HDR, TIFF, PNG, JPG or TGA file.",
    ),
    click.option(
        "--size",
        type=Size(),
        metavar="WxH",
        help="Made pictures: columns and rows.  [default: 512x512; head: the whole face, up to "
        "1080x1080]",
    ),
    click.option(
        "--mm-per-pixel",
        type=Length(),
        metavar="MM",
        help="Size of a pixel of your own file, unless its header says, and of the made head with "
        "--screen.  [default: 0.3 with --screen, else the kernel's]",
    ),
    *FILE_OPTIONS,
    click.option(
        "--angle",
        "angle_degrees",
        type=Number(),
        metavar="DEGREES",
        help="edge, stripes: the direction of their normal.  [default: 0]",
    ),
    click.option(
        "--radius",
        "radius_mm",
        type=Length(),
        metavar="MM",
        help="disk, highlights: of the disk, of a spot.",
    ),
    click.option(
        "--period",
        "period_mm",
        type=Length(),
        metavar="MM",
        help="stripes, separable: length of a period.",
    ),
    click.option(
        "--spacing",
        "spacing_mm",
        type=Length(),
        metavar="MM",
        help="points: from one to the next.",
    ),
    click.option(
        "--distance",
        "distance_mm",
        type=Length(),
        metavar="MM",
        help="head: from the eye to the face.  [default: 600]",
    ),
    click.option(
        "--light",
        "light_degrees",
        type=click.FLOAT,
        metavar="DEGREES",
        help="head: how far to the left of the view axis the key light is, behind the head beyond "
        "90.  [default: 45; with --transmit 170]",
    ),
    click.option(
        "--transmit",
        is_flag=True,
        help="head: add the key light that comes through ears and nose, as far as the kernel says.",
    ),
    click.option(
        "--border",
        type=click.Choice(["mirror", "clamp", "zero"]),
        default="mirror",
        show_default=True,
        help="What lies beyond the picture's rim.",
    ),
    click.option(
        "--screen",
        is_flag=True,
        help="As a shader does it: in perspective, by depth, within the mask; head only.",
    ),
    click.option(
        "--follow",
        type=click.Choice(["gaussian", "lerp", "none"]),
        help="With --screen: what steps in depth do to a sample.  [default: gaussian]",
    ),
)


def picture_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add them all, in this order."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command
