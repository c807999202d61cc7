"""Annuli of a profile, merged until each bin has enough photons for a useful error.

The noise of a simulated profile grows outwards, so charts and comparisons use means over bins with
a known error. Without photons the annuli are not merged.
"""

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray
from sssfit.profile import Profile
from sssfit.profile import pixels as integrals


def mean_free_paths_mm(profile: Profile) -> FloatArray | None:
    """Return the mean free path of each channel (C,) [mm] in the top layer, or None if unknown."""
    material = profile.material
    if material is None or material.n_channels != profile.n_channels:
        return None
    if len(material.layers) > 1:
        return None  # there is no single mean free path
    paths_mm = material.layers[0].mean_free_path_mm
    return paths_mm if np.isfinite(paths_mm).all() else None


Parts: TypeAlias = Callable[[FloatArray], FloatArray]  # values of annuli to sums of some of them
# 100 hits of equal weight have a standard error of 10 %: a tenth of the 2.3 that make a decade.
MIN_HITS = 100
# No bin is narrower than 1/40 of its radius. Over that width R_d falls by under 10 % out to 4 decay
# lengths, and 1236 annuli become 163 steps without a visible change of the curve.
_RADII_PER_WIDTH = 40
_WIDENING = 1.25
# In an exponential tail of equally full bins, widths grow by under 1.7 per bin until the photons
# run out; later bins with 100 hits span decades. Near the beam, up to 8 annuli, the widths are
# random.
_MAX_WIDENING = 2
_WIDTH_OF_LUCK = 8


@dataclass(frozen=True, slots=True, eq=False)
class Bins:
    """One channel's merged annuli: edges (m+1,) [mm], energies and errors (m,) [1].

    ``is_drawn`` (m,) is False for the last bins if they hold fewer than 100 effective hits, or are
    too wide, compared with the bin before, for a meaningful mean.
    """

    edges_mm: FloatArray
    energy: FloatArray
    stderr: FloatArray
    is_drawn: npt.NDArray[np.bool_]

    def per_mm(self) -> tuple[FloatArray, FloatArray]:
        """Mean of 2 pi r R_d over each bin and its standard error (m,) [1/mm]; NaN: not drawn."""
        return self._over(np.diff(self.edges_mm))

    def per_mm2(self) -> tuple[FloatArray, FloatArray]:
        """Return the mean of R_d over each bin and its standard error (m,) [1/mm^2], or NaN."""
        return self._over(integrals.annulus_areas(self.edges_mm))

    def _over(self, measure: FloatArray) -> tuple[FloatArray, FloatArray]:
        mean = np.where(self.is_drawn, self.energy / measure, np.nan)
        return mean, self.stderr / measure


def merged(profile: Profile, channel: int) -> Bins:
    """Merge neighbouring annuli, more of them outwards, until each bin holds 100 hits.

    With N photons, e and s an annulus' energy and standard error, S2 = N ((N-1) s^2 + e^2) is its
    sum of squared weights, and (N e)^2 / S2 hits of equal weight would have the same relative
    error. S2 of merged annuli is a sum, see `Profile.cumulative_stderr`. Under a beam annuli share
    photons; the error of a sum is then taken for the sum of their errors, the most that it can be.
    Without photons or errors the annuli are not merged.
    """
    energy = profile.annulus_energy[:, channel]
    stderr = profile.annulus_energy_stderr[:, channel]
    photons = profile.photons
    if photons is None or photons < 2 or np.isnan(stderr).any():
        return Bins(profile.r_edges_mm, energy, stderr, np.ones(len(energy), dtype=np.bool_))
    mean_square = (photons - 1) * stderr**2 + energy**2

    def hits(parts: Parts) -> FloatArray:
        if profile.shares_photons:
            return effective_hits(parts(energy), parts(stderr) ** 2, 1)
        return effective_hits(parts(energy), parts(mean_square), photons)

    cuts = _cuts(len(energy), hits)
    between = functools.partial(np.add.reduceat, indices=cuts[:-1])
    summed = between(energy)
    if profile.shares_photons:
        variance = between(stderr) ** 2
    else:
        variance = np.maximum(between(mean_square) - summed**2, 0.0) / (photons - 1)
    is_full = hits(between) >= MIN_HITS
    n_drawn = int(np.max(np.flatnonzero(is_full & _is_in_step(cuts)), initial=-1)) + 1
    is_drawn = np.arange(len(summed)) < n_drawn
    return Bins(profile.r_edges_mm[cuts], summed, np.sqrt(variance), is_drawn)


def effective_hits(energy: FloatArray, mean_square: FloatArray, photons: int) -> FloatArray:
    """Return the hits of equal weight with the same relative error, from e and S2 / N.

    One photon with e and s^2 gives those of an error s.
    """
    out = np.zeros_like(energy)
    return np.divide(photons * energy**2, mean_square, out=out, where=mean_square > 0)


def _cuts(end: int, hits: Callable[[Parts], FloatArray]) -> list[int]:
    """Choose the remaining edges; bins never get narrower outwards.

    ``hits`` takes the function that adds up values over the annuli of a bin.
    """

    def is_full(first: int, last: int) -> bool:
        # Sums of slices, because differences of running sums lose the tails: S2 spans 20 decades.
        return bool(hits(lambda each: each[first:last].sum(keepdims=True))[0] >= MIN_HITS)

    cuts, width = [0], 1
    while (first := cuts[-1]) < end:
        width = max(width, math.ceil(first / _RADII_PER_WIDTH))
        while first + width < end and not is_full(first, first + width):
            width = math.ceil(_WIDENING * width)
        cuts.append(min(first + width, end))
    # A bin cut short by the end of the grid joins its neighbour; a long empty tail must not.
    if len(cuts) > 2 and not is_full(cuts[-2], end) and end - cuts[-2] <= cuts[-2] - cuts[-3]:
        del cuts[-2]
    return cuts


def _is_in_step(cuts: list[int]) -> npt.NDArray[np.bool_]:
    """Return whether each bin is not too wide after the one before it."""
    widths = np.diff(cuts)
    widest = np.maximum(_MAX_WIDENING * widths[:-1], _WIDTH_OF_LUCK)
    return np.concatenate(([True], widths[1:] <= widest))
