"""What all flat renderers share: a table of source pixels past the border, a limit of memory."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit.errors import RenderError
from sssfit.messages import shown
from sssfit.scene.record import Scene

# mirror repeats the pixel at the rim and then its neighbours (numpy.pad's "symmetric"), so that no
# light is lost; clamp repeats only the pixel at the rim ("edge"); zero is black.
BORDERS = ("mirror", "clamp", "zero")

FloatArray = npt.NDArray[np.floating[Any]]


def source_indices(size: int, beyond: int, border: str) -> npt.NDArray[np.intp]:
    """Return the source pixel at each place of a line that continues past both its ends.

    Parameters
    ----------
    size : int
        Number of pixels of the line, n.
    beyond : int
        Places needed on either side; more than n are mirrored repeatedly.
    border : str
        One of `BORDERS`.

    Returns
    -------
    array (beyond + size + beyond,)
        0 to n - 1; n itself means outside, black.

    Raises
    ------
    RenderError
        The border is unknown.
    """
    if not isinstance(border, str):
        raise RenderError(f"border = {shown(border)}; expected {', '.join(BORDERS)}.")
    place = np.arange(-beyond, size + beyond)
    if border == "mirror":  # with the period 2 n
        place %= 2 * size
        return np.minimum(place, 2 * size - 1 - place)
    if border == "clamp":
        return np.clip(place, 0, size - 1)
    if border == "zero":
        return np.where((place >= 0) & (place < size), place, size)
    raise RenderError(f"border = {shown(border)}; expected {', '.join(BORDERS)}.")


# Limit of the work space: the reference of 4096 x 4096 RGB with a kernel of 8191 x 8191 pixels
# takes 4.6 GB, that of 20000 x 20000 with any kernel more than 9.
LARGEST_BYTES = 8e9


def check_channels(picture: int, kernel: int) -> None:
    """Raise an error if kernel and picture differ in channels; one channel fits any kernel."""
    if picture not in (1, kernel):
        expected = f"{kernel}, or 1 that serves all" if kernel > 1 else "1"
        raise RenderError(
            f"the picture has {picture} channels and the kernel {kernel}; expected {expected}."
        )


def scene_for(scene: Scene, channels: Sequence[str]) -> Scene:
    """Return the scene with its channels in a kernel's order; see `Scene.for_channels`.

    Raises
    ------
    RenderError
        It is no scene, or has other channels than one or as many.
    """
    if not isinstance(scene, Scene):
        raise RenderError(
            f"scene = {shown(scene)}; expected a Scene. sssfit.render takes arrays and files, too."
        )
    found = scene.for_channels(channels)
    check_channels(found.channels, len(channels))
    return found


def precision_for(dtype: npt.DTypeLike, scene: Scene) -> np.dtype[Any]:
    """Return the type that a scene is rendered in.

    Raises
    ------
    RenderError
        It is neither float32 nor float64, or the scene's light is above what float32 holds.
    """
    try:
        precision = np.dtype(dtype)
    except (TypeError, ValueError):
        raise RenderError(f"dtype = {shown(dtype)}; expected float32 or float64.") from None
    if precision not in (np.float32, np.float64):
        raise RenderError(f"dtype = {precision}; expected float32 or float64.")
    most, brightest = float(np.finfo(precision).max), float(scene.irradiance.max())
    if brightest > most:
        raise RenderError(
            f"{scene.name}: light of {brightest:.3g} is above {most:.3g}, the largest number of "
            f"{precision}; render it as float64."
        )
    return precision


def check_sums(picture: FloatArray, scene: Scene, gain: float) -> FloatArray:
    """Return a rendered picture, or raise RenderError if sums of its light were infinite.

    ``gain`` is the most by which sums of fetches exceed the light: twice where all weights are
    positive, because mirrored fetches are added first. Only light near the limit is looked at.
    """
    most, brightest = float(np.finfo(picture.dtype).max), float(scene.irradiance.max())
    if brightest * gain > most and not np.isfinite(picture).all():
        remedy = "render it as float64" if picture.dtype == np.float32 else "scale it down"
        raise RenderError(
            f"{scene.name}: sums of light of {brightest:.3g} are above {most:.3g}, the largest "
            f"number of {picture.dtype}; {remedy}."
        )
    return picture


def check_memory(needed_bytes: float, what: str, remedy: str) -> None:
    """Raise an error for work that would not fit in memory, before anything is allocated."""
    if needed_bytes > LARGEST_BYTES:
        raise RenderError(
            f"{what} would take {needed_bytes / 1e9:.3g} GB of memory, more than "
            f"{LARGEST_BYTES / 1e9:g} GB; {remedy}."
        )
