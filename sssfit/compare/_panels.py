"""Pictures beside their differences, as contact sheets show them."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray
from sssfit.errors import RenderError
from sssfit.formats.colours import srgb_encode
from sssfit.measure.delta_e import shown
from sssfit.measure.score import ImageScore, measure

_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # Y of linear sRGB, IEC 61966-2-1
_COLOURS = (1, 3)
# CIE 1976: L = 116 Y^(1/3) - 16 above the joint, linear below.
_JOINT, _SLOPE = (6.0 / 29.0) ** 3, (29.0 / 3.0) ** 3


@dataclass(frozen=True, slots=True, eq=False)
class Panel:
    """A picture as a display shows it, and its distance from the true one.

    Parameters
    ----------
    codes : array (H, W, 3)
        sRGB codes, 0 to 1, at the truth's exposure.
    difference : array (H, W)
        CIE lightness L* shown less that of the truth, -100 to 100; 0 outside the scene's mask.
        Not luminance: light leaks into shadows, where eyes and Delta E tell small steps apart.
    score : ImageScore
        Of the picture against the truth, within the mask.
    """

    codes: FloatArray
    difference: FloatArray
    score: ImageScore

    def __post_init__(self) -> None:
        for array in (self.codes, self.difference):
            array.setflags(write=False)


def make_panel(
    picture: FloatArray,
    truth: FloatArray,
    *,
    exposure: float,
    mask: npt.NDArray[np.int32] | None = None,
    counts: npt.NDArray[np.int32] | None = None,
    shown_part: tuple[slice, slice] = (slice(None), slice(None)),
) -> Panel:
    """Compare a picture (H, W, C) with a truth; C is 1 (grey) or 3.

    ``mask`` (H, W) is the outline outside which no difference is drawn, ``counts`` the pixels that
    the score is of, the mask's by default. Only ``shown_part`` of rows and columns is drawn.

    Raises
    ------
    RenderError
        As `measure`.
    """
    score = measure(picture, truth, exposure=exposure, mask=mask if counts is None else counts)
    ours, true = (shown(each, exposure) for each in (picture, truth))
    difference = lightness(ours) - lightness(true)
    if mask is not None:
        difference = np.where(mask > 0, difference, 0.0)
    return Panel(srgb_encode(ours[shown_part]), difference[shown_part], score)


def lightness(linear: FloatArray) -> FloatArray:
    """Return CIE 1976 L*, 0 to 100, of linear sRGB (..., 3)."""
    y: FloatArray = linear @ _LUMINANCE
    above = 116.0 * np.cbrt(np.maximum(y, _JOINT)) - 16.0
    found: FloatArray = np.where(y > _JOINT, above, _SLOPE * y)
    return found


def check_colours(name: str, channels: int) -> None:
    """Refuse what a display cannot show."""
    if channels not in _COLOURS:
        raise RenderError(
            f"{name} has {channels} channels; expected 1 (grey) or 3 (red, green, blue) to look at."
        )
