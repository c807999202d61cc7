"""What a chart draws of a profile: annuli merged until they mean something, and a 2D image.

Nothing here knows matplotlib; ``sssfit.chart`` draws.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sssfit import _disks
from sssfit._profile_radii import energy_radii_mm
from sssfit.errors import MaterialError
from sssfit.material import Material
from sssfit.profile import Profile

FloatArray = npt.NDArray[np.float64]

# 100 hits of equal weight have a standard error of 10 %: a tenth of the 2.3 that make a decade.
LEAST_HITS = 100
# No bin is narrower than 1/40 of its radius: over that R_d falls by under 10 % out to 4 decay
# lengths, and 1236 annuli become 163 steps without a visible change of the curve.
_RADII_PER_WIDTH = 40
_WIDENING = 1.25
# An exponential tail of equally full bins widens by under 1.7 a bin until it runs out of photons;
# what then reaches 100 hits spans decades. Up to 8 annuli the widths are luck, near the beam.
_MOST_WIDENING = 2
_WIDTH_OF_LUCK = 8

_IMAGE_SHARE_COLOUR, _IMAGE_SHARE_GREY = 0.75, 0.95
_IMAGE_ROWS, _IMAGE_COLUMNS = 201, 501  # wider than any panel, 130 an inch
_EXPOSED_AT = 0.35  # of the half height
_NOTHING = 1e-200  # 1/mm: stands for 0 under a logarithm


@dataclass(frozen=True, slots=True, eq=False)
class Bins:
    """One channel's annuli, neighbours merged: edges (m+1,) [mm], energies and errors (m,) [1].

    ``is_drawn`` (m,) is False for the last bins where they hold fewer than 100 effective hits, or
    are so much wider than the one before that a mean over them says little.
    """

    edges_mm: FloatArray
    energy: FloatArray
    stderr: FloatArray
    is_drawn: npt.NDArray[np.bool_]

    def per_mm(self) -> tuple[FloatArray, FloatArray]:
        """Mean of 2 pi r R_d over each bin and its standard error (m,) [1/mm]; NaN: not drawn."""
        return self._over(np.diff(self.edges_mm))

    def per_mm2(self) -> tuple[FloatArray, FloatArray]:
        """Mean of R_d over each bin and its standard error (m,) [1/mm^2]; NaN: not drawn."""
        return self._over(_disks.annulus_areas(self.edges_mm))

    def _over(self, measure: FloatArray) -> tuple[FloatArray, FloatArray]:
        mean = np.where(self.is_drawn, self.energy / measure, np.nan)
        return mean, self.stderr / measure


def merged(profile: Profile, channel: int) -> Bins:
    """Merge neighbouring annuli, ever more of them outwards, until each bin holds 100 hits.

    With N photons, e and s an annulus' energy and standard error, S2 = N ((N-1) s^2 + e^2) is its
    sum of squared weights, and (N e)^2 / S2 hits of equal weight would have the same relative
    error. S2 adds up where annuli merge, see `Profile.cumulative_stderr`. Without photons or
    errors the annuli stay as they are.
    """
    energy = profile.annulus_energy[:, channel]
    stderr = profile.annulus_energy_stderr[:, channel]
    photons = profile.photons
    if photons is None or photons < 2 or np.isnan(stderr).any():
        return Bins(profile.r_edges_mm, energy, stderr, np.ones(len(energy), dtype=np.bool_))
    mean_square = (photons - 1) * stderr**2 + energy**2
    cuts = _cuts(energy, mean_square, photons)
    summed = np.add.reduceat(energy, cuts[:-1])
    summed_square = np.add.reduceat(mean_square, cuts[:-1])
    variance = np.maximum(summed_square - summed**2, 0.0) / (photons - 1)
    is_full = effective_hits(summed, summed_square, photons) >= LEAST_HITS
    n_drawn = int(np.max(np.flatnonzero(is_full & _is_in_step(cuts)), initial=-1)) + 1
    is_drawn = np.arange(len(summed)) < n_drawn
    return Bins(profile.r_edges_mm[cuts], summed, np.sqrt(variance), is_drawn)


def effective_hits(energy: FloatArray, mean_square: FloatArray, photons: int) -> FloatArray:
    """Hits of equal weight with the same relative error, from e and S2 / N."""
    out = np.zeros_like(energy)
    return np.divide(photons * energy**2, mean_square, out=out, where=mean_square > 0)


def _cuts(energy: FloatArray, mean_square: FloatArray, photons: int) -> list[int]:
    """Choose the edges that stay; bins never get narrower outwards."""

    def is_full(first: int, last: int) -> bool:
        # Slices: differences of running sums lose the tails, S2 spans 20 decades in a profile.
        annuli = slice(first, last)
        total = energy[annuli].sum(keepdims=True), mean_square[annuli].sum(keepdims=True)
        return bool(effective_hits(*total, photons)[0] >= LEAST_HITS)

    cuts, width, end = [0], 1, len(energy)
    while (first := cuts[-1]) < end:
        width = max(width, math.ceil(first / _RADII_PER_WIDTH))
        while first + width < end and not is_full(first, first + width):
            width = math.ceil(_WIDENING * width)
        cuts.append(min(first + width, end))
    # What the end of the grid cut short joins its neighbour; a long empty tail must not.
    if len(cuts) > 2 and not is_full(cuts[-2], end) and end - cuts[-2] <= cuts[-2] - cuts[-3]:
        del cuts[-2]
    return cuts


def _is_in_step(cuts: list[int]) -> npt.NDArray[np.bool_]:
    """Whether each bin is not too wide after the one before it."""
    widths = np.diff(cuts)
    widest = np.maximum(_MOST_WIDENING * widths[:-1], _WIDTH_OF_LUCK)
    return np.concatenate(([True], widths[1:] <= widest))


def mean_free_paths_mm(profile: Profile) -> FloatArray | None:
    """Mean free path of each channel (C,) [mm] in the material's top layer; None if unknown."""
    material = material_of(profile)
    if material is None or material.n_channels != profile.n_channels:
        return None
    if len(material.layers) > 1:
        return None  # there is no one mean free path
    paths_mm = material.layers[0].mean_free_path_mm
    return paths_mm if np.isfinite(paths_mm).all() else None


def material_of(profile: Profile) -> Material | None:
    """Return the material a profile says it was made from; None where it holds none."""
    record = profile.meta.get("material")
    if not isinstance(record, dict):
        return None
    try:
        return Material.from_dict(record)
    except MaterialError:
        return None


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """R_d(x, y) around the beam: (rows, columns, C) [1/mm^2], and how far it reaches [mm]."""

    per_mm2: FloatArray
    half_width_mm: float
    half_height_mm: float

    @property
    def exposure_per_mm2(self) -> float:
        """R_d that is shown half bright: the brightest channel's, a third of the way up."""
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
    """Return the centre of the 2D profile: of three channels, else of the first alone."""
    is_colour = len(bins) == 3
    shown = range(3) if is_colour else range(1)
    half_mm = drawn_radius_mm(
        profile, _IMAGE_SHARE_COLOUR if is_colour else _IMAGE_SHARE_GREY, shown
    )
    pitch_mm = 2.0 * half_mm / _IMAGE_ROWS
    images = [_image_per_mm2(bins[channel], pitch_mm) for channel in shown]
    return Picture(np.stack(images, axis=2), 0.5 * pitch_mm * _IMAGE_COLUMNS, half_mm)


def drawn_radius_mm(profile: Profile, share: float, channels: Sequence[int]) -> float:
    """Radius that holds this share of the energy of every one of the channels that has any [mm]."""
    radii_mm = energy_radii_mm(profile, [share])[0, list(channels)]
    known_mm = radii_mm[np.isfinite(radii_mm)]
    return float(known_mm.max(initial=0.0)) or float(profile.r_edges_mm[-1])


def _image_per_mm2(bins: Bins, pitch_mm: float) -> FloatArray:
    """R_d at the centres of pixels around the beam (rows, columns) [1/mm^2].

    log(2 pi r R_d) is interpolated between the middles of the bins: steps, or the kinks of an
    interpolated F, would draw rings. The centre pixel takes the mean over a disk of its area.
    """
    y = pitch_mm * (np.arange(_IMAGE_ROWS) - _IMAGE_ROWS // 2)
    x = pitch_mm * (np.arange(_IMAGE_COLUMNS) - _IMAGE_COLUMNS // 2)
    r = np.hypot(y[:, None], x)
    r[_IMAGE_ROWS // 2, _IMAGE_COLUMNS // 2] = 0.5 * pitch_mm / math.sqrt(math.pi)
    per_mm = np.exp(np.interp(r, *_nodes(bins)))
    is_lit = (r < bins.edges_mm[-1]) & (per_mm > _NOTHING)
    return np.where(is_lit, per_mm / (2.0 * math.pi * r), 0.0)


def _nodes(bins: Bins) -> tuple[FloatArray, FloatArray]:
    """Radii (k,) [mm] and log(2 pi r R_d) (k,) there: the middles of the bins.

    Past the last bin that is drawn, an exponential takes over that holds what energy is left: a
    mean over the empty rest of the grid would put a glow far from the beam.
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
