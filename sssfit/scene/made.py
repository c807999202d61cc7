"""Made pictures for judging kernels, with light given by formulas.

All are grey and linear. Except for the head's silhouette they are averaged over each pixel's area
in closed form, so edges have no staircase. The head is lit in perspective and comes with depth and
mask. A picture's function is imported when it is made, so that help answers at once.
"""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sssfit.errors import ArgumentError
from sssfit.messages import shown
from sssfit.methods import Method, Setting

if TYPE_CHECKING:
    from sssfit.scene.record import Scene

_ANGLE = Setting(
    "angle", "number", "direction of the normal.", "DEGREES", words="0", keyword="angle_degrees"
)
_RADIUS = Setting("radius", "length", "radius of the disk or of a spot.", "MM", keyword="radius_mm")
_PERIOD = Setting("period", "length", "length of a period.", "MM", keyword="period_mm")

MADE: Mapping[str, Method] = {
    "head": Method(
        "sssfit.scene.head:head_scene",
        "a lit head in perspective",
        (
            Setting(
                *("distance", "length", "camera distance.", "MM"),
                words="600",
                keyword="distance_mm",
            ),
            Setting(
                "light",
                "number",
                "angle of the key light to the left of the view axis; beyond 90 it is behind the "
                "head.",
                "DEGREES",
                words="45; for transmit 170",
                keyword="light_degrees",
            ),
            Setting(
                "transmit",
                "flag",
                "add the key light that the kernel lets through ears and nose.",
            ),
        ),
    ),
    "disk": Method("sssfit.scene.patterns:disk", "a lit disk", (_RADIUS,)),
    "edge": Method("sssfit.scene.patterns:edge", "light beside shadow", (_ANGLE,)),
    "separable": Method("sssfit.scene.patterns:separable", "a product of two waves", (_PERIOD,)),
    "stripes": Method("sssfit.scene.patterns:stripes", "a wave", (_ANGLE, _PERIOD)),
    "points": Method(
        "sssfit.scene.patterns:points",
        "a lattice of single pixels",
        (
            Setting(
                *("spacing", "length", "distance between neighbours.", "MM"), keyword="spacing_mm"
            ),
        ),
    ),
    "noise": Method("sssfit.scene.patterns:noise", "1/f noise"),
    "highlights": Method("sssfit.scene.patterns:highlights", "spots", (_RADIUS,)),
}
# Those that kernels are compared on. The edge is oblique: along an axis a pre-integrated kernel is
# exact.
COMPARED = ("disk", "edge", "points", "head")
EDGE_DEGREES = 30.0
_COMMON = {"height", "width", "mm_per_pixel"}


def options_of(name: str) -> tuple[str, ...]:
    """Return the options of a made picture, apart from its size."""
    parameters = inspect.signature(MADE[name].load()).parameters
    return tuple(key for key in parameters if key not in _COMMON)


def make_scene(name: str, *, height: int, width: int, mm_per_pixel: float, **options: Any) -> Scene:
    """Make a picture by its name.

    Parameters
    ----------
    name : str
        One of ``MADE``.
    height, width : int
        Pixels.
    mm_per_pixel : float [mm]
        Size of a pixel on the surface.
    **options
        Options of the picture's function; a value of None means its default.

    Returns
    -------
    Scene
        A scene of one channel, for kernels with any number of channels.

    Raises
    ------
    RenderError
        The picture or option is unknown, or a value is invalid.
    """
    from sssfit.errors import RenderError

    if not isinstance(name, str) or name not in MADE:
        raise RenderError(f"no made picture {shown(name)}; expected one of {', '.join(MADE)}.")
    known = options_of(name)
    given = {key: value for key, value in options.items() if value is not None}
    for key in given:
        if key not in known:
            raise RenderError(
                f"{name}: no option {shown(key)}; expected one of {', '.join(known)}."
            )
    scene: Scene = MADE[name].load()(height=height, width=width, mm_per_pixel=mm_per_pixel, **given)
    return scene


def check_pictures(
    names: Sequence[str],
    *,
    layer: str | None = None,
    mask: str | None = None,
    size: tuple[int, int] | None = None,
) -> None:
    """Refuse pictures that do not exist, and settings that would do nothing to them.

    Raises
    ------
    ArgumentError
    """
    for name in names:
        if not name or (name not in MADE and not Path(name).exists()):
            raise ArgumentError(
                f"there is no picture {shown(name)}; expected {', '.join(MADE)}, or your own file."
            )
    files = [name for name in names if name not in MADE]
    if size is not None and len(files) == len(names):
        raise ArgumentError("`size` is for made pictures; leave it out.")
    if layer is not None and not files:
        raise ArgumentError("`layer` is for pictures from files; leave it out.")
    if mask is not None and not files:
        raise ArgumentError("`mask` is for pictures from files; leave it out.")
