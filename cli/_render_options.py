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
        help="edge, stripes: direction of the normal.  [default: 0]",
    ),
    click.option(
        "--radius",
        "radius_mm",
        type=Length(),
        metavar="MM",
        help="disk, highlights: radius of the disk or of a spot.",
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
        help="points: distance between neighbours.",
    ),
    click.option(
        "--distance",
        "distance_mm",
        type=Length(),
        metavar="MM",
        help="head: camera distance.  [default: 600]",
    ),
    click.option(
        "--light",
        "light_degrees",
        type=click.FLOAT,
        metavar="DEGREES",
        help="head: angle of the key light to the left of the view axis; beyond 90 it is behind "
        "the head.  [default: 45; with --transmit 170]",
    ),
    click.option(
        "--transmit",
        is_flag=True,
        help="head: add the key light that the kernel lets through ears and nose.",
    ),
    click.option(
        "--border",
        type=click.Choice(["mirror", "clamp", "zero"]),
        default="mirror",
        show_default=True,
        help="Continuation of the picture beyond its border.",
    ),
    click.option(
        "--screen",
        is_flag=True,
        help="Render like a shader: in perspective, by depth, within the mask; head only.",
    ),
    click.option(
        "--follow",
        type=click.Choice(["gaussian", "lerp", "none"]),
        help="With --screen: how a depth difference weights a sample.  [default: gaussian]",
    ),
)


def picture_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add them all, in this order."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command
