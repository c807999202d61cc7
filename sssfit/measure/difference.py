"""Difference of a picture from the true one, in false colours safe for colour blindness.

The colours run from blue through white to red for signed differences (ColorBrewer's RdBu, Harrower
and Brewer 2003) and from dark violet through green to yellow for absolute ones (viridis, Smith and
van der Walt 2015). Both maps are readable with the common kinds of colour blindness.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray
from sssfit.errors import RenderError
from sssfit.formats.colours import linear_from_hex, srgb_decode, srgb_encode
from sssfit.messages import shown

MAPS = ("signed", "absolute")
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # luminance of linear R, G, B: ITU-R BT.709-6
# Anchors at even steps; between them sRGB codes are linear, as in the maps' own definition.
_RED_BLUE = (
    *("#053061", "#2166ac", "#4393c3", "#92c5de", "#d1e5f0", "#f7f7f7"),
    *("#fddbc7", "#f4a582", "#d6604d", "#b2182b", "#67001f"),
)
_VIRIDIS = (
    *("#440154", "#48186a", "#472d7b", "#424086", "#3b528b", "#33638d"),
    *("#2c728e", "#26828e", "#21918c", "#1fa088", "#28ae80", "#3fbc73"),
    *("#5ec962", "#84d44b", "#addc30", "#d8e219", "#fde725"),
)


@dataclass(frozen=True, slots=True, eq=False)
class DifferenceMap:
    """Differences of two pictures, magnified or in false colours.

    Parameters
    ----------
    pixels : array (H, W, 3), or (H, W, C) where magnified
        Linear R, G, B, for `save_image` at exposure 1; if magnified, in the pictures' unit.
    kind : str, optional
        "signed" or "absolute" false colours; None if magnified.
    what : str, optional
        Description of the number that a colour shows.
    end : float, optional
        The difference at the ends of the scale, in the pictures' unit: blue means -end or less in a
        signed map, red and yellow mean end or more.
    gain : float
        Factor of the difference; the scale of a map is divided by it.
    """

    pixels: FloatArray
    kind: str | None
    what: str | None
    end: float | None
    gain: float

    def figures(self) -> dict[str, Any]:
        """Return its figures of ``sssfit render --json``."""
        return {"gain": self.gain, "map": self.kind, "of": self.what, "end": self.end}


def magnified_difference(
    picture: npt.ArrayLike, truth: npt.ArrayLike, *, gain: float = 1.0
) -> FloatArray:
    """Return gain |picture - truth| (H, W, C); errors as `difference_map`."""
    lost: FloatArray = _gain(gain) * np.abs(_difference(picture, truth))
    return lost


def difference_map(
    picture: npt.ArrayLike, truth: npt.ArrayLike, *, kind: str | None = "signed", gain: float = 1.0
) -> DifferenceMap:
    """Draw picture - truth in false colours, or magnify it.

    Parameters
    ----------
    picture, truth : array (H, W, C)
        Linear light.
    kind : str, optional
        "signed" shows the luminance for three channels, else the mean of the channels; "absolute"
        shows the largest of the channels. None: `magnified_difference`.
    gain : float
        The scale ends at the largest difference over the gain, so at 1 no pixel is beyond it.

    Raises
    ------
    RenderError
        The pictures differ in shape, the kind is unknown, or the gain is not above 0.
    """
    if kind is None:
        magnified = magnified_difference(picture, truth, gain=gain)
        return DifferenceMap(magnified, None, None, None, gain)
    if kind not in MAPS:
        raise RenderError(f"kind = {shown(kind)}; expected {' or '.join(MAPS)}.")
    values, what = _values(_difference(picture, truth), kind)
    end = float(np.abs(values).max(initial=0.0)) / _gain(gain)
    at = values / end if end > 0.0 else values  # no difference: the colour of 0
    colours = _coloured(0.5 + 0.5 * at, _RED_BLUE) if kind == "signed" else _coloured(at, _VIRIDIS)
    return DifferenceMap(colours, kind, what, end, gain)


def _difference(picture: npt.ArrayLike, truth: npt.ArrayLike) -> FloatArray:
    """Return picture - truth (H, W, C)."""
    ours, true = (np.asarray(each, dtype=np.float64) for each in (picture, truth))
    if ours.shape != true.shape or ours.ndim != 3:
        raise RenderError(
            f"pictures of shape {ours.shape} and {true.shape}; expected the same rows, columns and "
            "channels."
        )
    return ours - true


def _gain(gain: float) -> float:
    if not (math.isfinite(gain) and gain > 0.0):
        raise RenderError(f"gain = {gain:g}; expected a factor above 0.")
    return float(gain)


def _values(difference: FloatArray, kind: str) -> tuple[FloatArray, str]:
    """Return one number per pixel (H, W), and its description."""
    channels = difference.shape[2]
    if kind == "absolute":
        largest: FloatArray = np.abs(difference).max(axis=2)
        return largest, "largest of the channels" if channels > 1 else "difference"
    if channels == 3:
        return difference @ _LUMINANCE, "luminance"
    mean: FloatArray = difference.mean(axis=2)
    return mean, "mean of the channels" if channels > 1 else "difference"


def _coloured(at: FloatArray, anchors: tuple[str, ...]) -> FloatArray:
    """Return linear colours (H, W, 3) for positions on the scale, clipped to 0 to 1."""
    codes = np.stack([srgb_encode(linear_from_hex(each)) for each in anchors])
    places = np.linspace(0.0, 1.0, len(anchors))
    return srgb_decode(np.stack([np.interp(at, places, code) for code in codes.T], axis=-1))
