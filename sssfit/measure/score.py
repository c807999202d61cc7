"""Errors of a rendered picture compared with the true one: energy, visible colour, structure.

RMSE, relative L2, maximum, PSNR and energy drift are computed from linear light. CIE Delta E 2000,
SSIM and FLIP are computed from the displayed picture, at a stated exposure. The last two are those
of ``sssfit.methods.MEASURES``, and need the extra ``metrics``; `asymmetry` and `cost` are measures
of a kernel alone.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray, ReadOnly, plain, true_or_false
from sssfit.errors import RenderError
from sssfit.measure.delta_e import (
    auto_exposure,
    check_exposure,
    check_pair,
    check_shows,
    delta_e_2000,
    exposure_of,
    selected_pixels,
    selection,
)
from sssfit.methods import MEASURES

__all__ = ["COLOUR_FIGURES", "ImageScore", "auto_exposure", "measure"]


JUST_NOTICEABLE = 1.0  # Delta E that an eye can see side by side
# Fields of an `ImageScore` that the rows of comparisons and choices also have.
COLOUR_FIGURES = ("delta_e_2000_mean", "delta_e_2000_p95", "delta_e_2000_p99", "share_above_1")
SCORE_FIGURES = (
    *("rmse", "relative_l2", "maximum", "psnr_db", "energy_drift"),
    *COLOUR_FIGURES,
    *("exposure", *MEASURES),
)


@dataclass(frozen=True, slots=True, eq=False)
class ImageScore(ReadOnly):
    """A picture compared with the true one, with C channels.

    Parameters
    ----------
    rmse : float [as the pictures]
        sqrt(mean((image - truth)^2)) over pixels and channels.
    relative_l2 : float [1]
        ||image - truth|| / ||truth||; 0 if both are black, inf if only the truth is black.
    maximum : float [as the pictures]
        The largest |image - truth|.
    psnr_db : float [dB]
        20 log10(peak / rmse), peak the largest value of the truth; inf for identical pictures.
    energy_drift : array (C,) [1]
        sum(image) / sum(truth) - 1; black channels as in ``relative_l2``.
    delta_e_2000_mean, delta_e_2000_p95, delta_e_2000_p99 : float [1]
        CIE Delta E 2000 at the exposure, for linear sRGB under D65: mean, 95th and 99th percentile.
        One channel counts as grey; NaN for 2 channels and for more than 3, which have no colour.
    share_above_1 : float [1]
        Share of the pixels with a Delta E above 1, about the smallest difference seen side by side;
        NaN without colour.
    exposure : float [1 / as the pictures]
        Factor applied to both pictures before they were clipped to [0, 1].
    structure : mapping of str to float [1]
        Those of ``sssfit.methods.MEASURES`` by their names; empty unless requested.
    """

    rmse: float
    relative_l2: float
    maximum: float
    psnr_db: float
    energy_drift: FloatArray
    delta_e_2000_mean: float
    delta_e_2000_p95: float
    delta_e_2000_p99: float
    share_above_1: float
    exposure: float
    structure: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        drift = np.array(self.energy_drift, dtype=np.float64)
        drift.setflags(write=False)
        object.__setattr__(self, "energy_drift", drift)
        object.__setattr__(self, "structure", MappingProxyType(dict(self.structure)))

    @property
    def ssim(self) -> float | None:
        """Structural similarity, `sssfit.measure.structure.ssim`; None unless requested."""
        return self.structure.get("ssim")

    @property
    def flip(self) -> float | None:
        """LDR-FLIP, `sssfit.measure.structure.flip`; None unless requested."""
        return self.structure.get("flip")

    def to_dict(self) -> dict[str, Any]:
        """Return all figures in the order and with the names of ``sssfit render --json``."""
        own = [key for key in SCORE_FIGURES if key not in MEASURES]
        measured = dict.fromkeys(MEASURES) | dict(self.structure)
        return plain({**{key: getattr(self, key) for key in own}, **measured})


def measure(
    image: npt.ArrayLike,
    truth: npt.ArrayLike,
    *,
    exposure: float | None = None,
    mask: npt.ArrayLike | None = None,
    structure: bool = False,
) -> ImageScore:
    """Return the errors of ``image`` compared with ``truth``.

    Parameters
    ----------
    image, truth : array (H, W, C)
        Linear light. Negative pixels count unchanged in linear light, and as black when displayed.
    exposure : float, optional
        Factor before display; `auto_exposure` of the truth unless given.
    mask : array (H, W), optional
        Restricts every figure to the pixels where it is above 0.
    structure : bool
        Also compute SSIM and FLIP, which need the extra ``metrics``. FLIP is NaN where Delta E is.

    Returns
    -------
    ImageScore
        Errors in linear light, and Delta E 2000 of the displayed pictures.

    Raises
    ------
    RenderError
        The pictures differ in shape or hold NaN, the mask does not fit or is empty, the exposure is
        not above 0 or shows both as nothing but white or black, or the truth is black and no
        exposure is given.

    Examples
    --------
    >>> score = measure([[[0.5], [0.25]]], [[[0.5], [0.5]]])
    >>> score.maximum, score.energy_drift.tolist(), round(score.psnr_db, 2)
    (0.25, [-0.25], 9.03)
    """
    structure = true_or_false("structure", structure, RenderError)
    pictures = check_pair(image, truth)
    selected = selection(mask, pictures[1])
    pixels, true = (selected_pixels(picture, selected) for picture in pictures)
    if exposure is None:
        exposure = exposure_of(true)
    else:
        exposure = check_exposure(exposure)
        check_shows(exposure, pixels, true)
    return ImageScore(
        **_differences(pixels, true),
        energy_drift=_ratio(pixels.sum(axis=0) - true.sum(axis=0), true.sum(axis=0)),
        **_colour_differences(pixels, true, exposure),
        exposure=exposure,
        structure=_structure(*pictures, exposure, mask) if structure else {},
    )


def _differences(pixels: FloatArray, true: FloatArray) -> dict[str, float]:
    """Return the figures of linear light for pixels (N, C)."""
    difference = pixels - true
    rmse = _root_mean_square(difference)
    peak = float(true.max())
    with np.errstate(divide="ignore"):  # identical: inf; a black truth: -inf
        psnr = np.inf if rmse == 0.0 else 20.0 * np.log10(max(peak, 0.0) / rmse)
    return {
        "rmse": rmse,
        "relative_l2": float(_ratio(rmse, _root_mean_square(true))),
        "maximum": float(max(difference.max(), -difference.min())),
        "psnr_db": float(psnr),
    }


def _root_mean_square(values: FloatArray) -> float:
    """Return sqrt(mean(values^2)) without a second array of squares.

    By einsum: a dot product waits for BLAS's threads, 3 ms beside another process in place of 0.1.
    """
    flat = values.reshape(-1)
    return float(np.sqrt(np.einsum("i,i->", flat, flat) / flat.size))


def _ratio(part: npt.ArrayLike, whole: npt.ArrayLike) -> FloatArray:
    """Divide; 0 / 0 is 0 (no error), x / 0 is inf with the sign of x."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.divide(part, whole)
    return np.where(np.equal(part, 0.0), 0.0, ratio)


def _colour_differences(pixels: FloatArray, true: FloatArray, exposure: float) -> dict[str, float]:
    """Return the figures of Delta E 2000 for pixels (N, C)."""
    if pixels.shape[1] not in (1, 3):
        return dict.fromkeys(COLOUR_FIGURES, np.nan)
    differences = delta_e_2000(pixels, true, exposure)
    p95, p99 = np.percentile(differences, [95.0, 99.0])
    above = np.count_nonzero(differences > JUST_NOTICEABLE) / differences.size
    figures = (differences.mean(), p95, p99, above)
    return {key: float(each) for key, each in zip(COLOUR_FIGURES, figures, strict=True)}


def _structure(
    image: FloatArray, truth: FloatArray, exposure: float, mask: npt.ArrayLike | None
) -> dict[str, float]:
    """Return the figures of ``MEASURES`` of whole pictures."""
    is_coloured = image.shape[2] in (1, 3)
    return {
        name: float(each.load()(image, truth, exposure, mask=mask))
        if is_coloured or not each.of_colours
        else np.nan
        for name, each in MEASURES.items()
    }
