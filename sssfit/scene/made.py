"""Made pictures for judging kernels, with light given by formulas.

All are grey and linear. Except for the head's silhouette they are averaged over each pixel's area
in closed form, so edges have no staircase. `head` is lit in perspective and comes with depth and
mask.
"""

import inspect
from collections.abc import Callable
from typing import Any

from sssfit.errors import RenderError
from sssfit.scene.head import head_scene
from sssfit.scene.patterns import disk, edge, highlights, noise, points, separable, stripes
from sssfit.scene.record import Scene

MADE: dict[str, Callable[..., Scene]] = {
    "disk": disk,
    "edge": edge,
    "separable": separable,
    "stripes": stripes,
    "points": points,
    "noise": noise,
    "highlights": highlights,
    "head": head_scene,
}
_COMMON = {"height", "width", "mm_per_pixel"}


def options_of(name: str) -> tuple[str, ...]:
    """Return the options of a made picture, apart from its size."""
    return tuple(key for key in inspect.signature(MADE[name]).parameters if key not in _COMMON)


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
    if name not in MADE:
        raise RenderError(f"no made picture {name!r}; expected one of {', '.join(MADE)}.")
    known = options_of(name)
    given = {key: value for key, value in options.items() if value is not None}
    for key in given:
        if key not in known:
            raise RenderError(f"{name}: no option {key!r}; expected one of {', '.join(known)}.")
    return MADE[name](height=height, width=width, mm_per_pixel=mm_per_pixel, **given)
