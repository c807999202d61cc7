"""Data of a profile's chart besides its bins: range, unit, and a 2D image.

Without matplotlib; the other files of ``sssfit.chart`` draw.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.profile import Profile
from sssfit.profile.bins import Bins

_IMAGE_SHARE_COLOUR, _IMAGE_SHARE_GREY = 0.75, 0.95
_IMAGE_ROWS, _IMAGE_COLUMNS = 201, 501  # wider than any panel, 130 per inch
_EXPOSED_AT = 0.35  # of the half height
_NOTHING = 1e-200  # 1/mm: stands for 0 under a logarithm


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """Return R_d(x, y) around the beam (rows, columns, C) [1/mm^2], and its half width [mm]."""

    per_mm2: FloatArray
    half_width_mm: float
    half_height_mm: float

    @property
    def exposure_per_mm2(self) -> float:
        """Return the R_d that is shown at half brightness, from the brightest channel."""
        along = self.per_mm2[_IMAGE_ROWS // 2 + round(_EXPOSED_AT * _IMAGE_ROWS / 2)]
        return float(along[_IMAGE_COLUMNS // 2].max()) or 1.0

    def screen_colours(self) -> FloatArray:
        """Encode as sRGB (rows, columns, 3) by x / (1 + x), which clips nothing, x in exposures."""
        relative = self.per_mm2 / self.exposure_per_mm2
        linear = relative / (1.0 + relative)
        return np.where(  # IEC 61966-2-1
            linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055
        )


def picture(profile: Profile, bins: Sequence[Bins]) -> Picture:
    """Return the centre of the 2D profile: of three channels, else of the first only."""
    is_colour = len(bins) == 3
    shown = range(3) if is_colour else range(1)
    half_mm = drawn_radius_mm(
        profile, _IMAGE_SHARE_COLOUR if is_colour else _IMAGE_SHARE_GREY, shown
    )
    pitch_mm = 2.0 * half_mm / _IMAGE_ROWS
    images = [_image_per_mm2(bins[channel], pitch_mm) for channel in shown]
    return Picture(np.stack(images, axis=2), 0.5 * pitch_mm * _IMAGE_COLUMNS, half_mm)


def drawn_radius_mm(profile: Profile, share: float, channels: Sequence[int]) -> float:
    """Return the radius that contains this share of the energy of every lit channel [mm]."""
    radii_mm = profile.energy_radii_mm([share])[0, list(channels)]
    known_mm = radii_mm[np.isfinite(radii_mm)]
    return float(known_mm.max(initial=0.0)) or float(profile.r_edges_mm[-1])


def _image_per_mm2(bins: Bins, pitch_mm: float) -> FloatArray:
    """Return R_d at the centres of pixels around the beam (rows, columns) [1/mm^2].

    log(2 pi r R_d) is interpolated between the middles of the bins, because steps, or the kinks of
    an interpolated F, would show as rings. The centre pixel is the mean over a disk of its area.
    """
    y = pitch_mm * (np.arange(_IMAGE_ROWS) - _IMAGE_ROWS // 2)
    x = pitch_mm * (np.arange(_IMAGE_COLUMNS) - _IMAGE_COLUMNS // 2)
    r = np.hypot(y[:, None], x)
    r[_IMAGE_ROWS // 2, _IMAGE_COLUMNS // 2] = 0.5 * pitch_mm / math.sqrt(math.pi)
    per_mm = np.exp(np.interp(r, *_nodes(bins)))
    is_lit = (r < bins.edges_mm[-1]) & (per_mm > _NOTHING)
    return np.where(is_lit, per_mm / (2.0 * math.pi * r), 0.0)


def _nodes(bins: Bins) -> tuple[FloatArray, FloatArray]:
    """Return the middles of the bins (k,) [mm], and log(2 pi r R_d) (k,) there.

    Beyond the last drawn bin, an exponential with the remaining energy continues it: a mean over
    the empty rest of the grid would draw a glow far from the beam.
    """
    middles_mm = 0.5 * (bins.edges_mm[1:] + bins.edges_mm[:-1])
    logarithms = np.log(np.maximum(bins.energy / np.diff(bins.edges_mm), 0.5 * _NOTHING))
    if bins.is_drawn[-1] or not bins.is_drawn.any():
        return middles_mm, logarithms
    last = int(np.flatnonzero(bins.is_drawn)[-1])
    left = 0.5 * bins.energy[last] + bins.energy[last + 1 :].sum()
    decay_mm = left / math.exp(logarithms[last])
    nowhere = 40.0  # decay lengths: e^-40 is 1e-17
    return (
        np.append(middles_mm[: last + 1], middles_mm[last] + nowhere * decay_mm),
        np.append(logarithms[: last + 1], logarithms[last] - nowhere),
    )
