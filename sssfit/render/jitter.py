"""Jitter: some taps of a pass, moved by each pixel for itself, so that bands become noise.

Few taps show copies of an edge at their offsets, the same for all pixels. Where the outer third of
them (Jimenez et al. 2015 jitter 33 %) lies elsewhere for each pixel, neighbours disagree, and what
is a band without jitter is noise that a filter over time or an eye far away averages. A pixel's two
random numbers are hashes of its place and the frame (`sssfit.render.disk.turns`), so that a still
picture shimmers only as the frame's number says.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit.arrays import is_number
from sssfit.errors import RenderError
from sssfit.kernel.taps import Stage
from sssfit.messages import shown
from sssfit.render.disk import gathered, turns

FloatArray = npt.NDArray[np.floating[Any]]

_ROWS, _COLUMNS = 977, 613  # how far away the pixels lie whose hashes are the second numbers


@dataclass(frozen=True, slots=True)
class Jitter:
    """How far jittered taps move.

    Parameters
    ----------
    share : float
        Share of the mirrored pairs of a pass, the outermost ones, rounded up: 0 to 1.
    scale : float
        Most by which a pixel lengthens or shortens their offsets, as a share, below 1.
    degrees : float
        Most by which it turns them either way, up to 90.
    """

    share: float = 1.0 / 3.0
    scale: float = 0.25
    degrees: float = 30.0

    def __post_init__(self) -> None:
        for name, most in (("share", 1.0), ("scale", 1.0), ("degrees", 90.0)):
            value = getattr(self, name)
            if not is_number(value):
                raise RenderError(f"{name} = {shown(value)} of a jitter; expected 0 to {most:g}.")
            if not 0.0 <= value <= most or (name == "scale" and value == most):
                raise RenderError(f"{name} = {value:g} of a jitter; expected 0 to {most:g}.")

    def still(self, pairs: int) -> int:
        """Return how many of a pass's mirrored pairs, the inner ones, do not move."""
        return pairs - math.ceil(self.share * pairs - 1e-9)


def apply_jittered(
    pixels: FloatArray,
    stage: Stage,
    direction: tuple[float, float],
    mm_per_texel: float,
    jitter: Jitter,
    *,
    frame: int,
    border: str,
    threads: int | None,
) -> FloatArray:
    """Return a pass of a pair or a line along a direction (down, right) with jittered taps.

    Parameters
    ----------
    pixels : array (H, W, 1) or (H, W, C)
    stage : Stage
    direction : tuple of float
    mm_per_texel : float [mm]
    jitter : Jitter
    frame : int
    border : str
    threads : int, optional
    """
    pairs = len(stage.offsets_mm)
    still = jitter.still(pairs)
    places = np.outer(stage.offsets_mm / mm_per_texel, direction)
    weights = stage.weights.astype(pixels.dtype)
    height, width = pixels.shape[:2]
    unturned = np.stack((np.ones((height, width)), np.zeros((height, width))))
    both = turns(height, width, frame), turns(_ROWS + height, _COLUMNS + width, frame)
    first, second = both[0] / math.pi - 1.0, both[1][_ROWS:, _COLUMNS:] / math.pi - 1.0
    angle, moved = math.radians(jitter.degrees) * first, 1.0 + jitter.scale * second
    turned = moved * np.stack((np.cos(angle), np.sin(angle)))
    found: FloatArray = weights[0] * pixels
    for own, turn in ((slice(0, still), unturned), (slice(still, pairs), turned)):
        at, share = places[own], weights[1:][own]
        if len(at):
            sides, shares = np.concatenate((at, -at)), np.concatenate((share, share))
            found = found + gathered(pixels, sides, shares, turn, border=border, threads=threads)
    return found
