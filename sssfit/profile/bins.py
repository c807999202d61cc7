"""Annuli of a profile, merged until each holds enough photons for a useful error.

A simulated profile has noise that grows outwards; charts and comparisons look at means over bins
with a known error. Without photons the annuli stay as they are.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import MaterialError
from sssfit.material import Material
from sssfit.profile import pixels as integrals

if TYPE_CHECKING:
    from sssfit.profile import Profile
import math
from dataclasses import dataclass

import numpy.typing as npt

from sssfit.profile import Profile

# F between 256 points of an annulus is straight to 2e-6 of the annulus' width.
_PARTS = 256


def energy_radii_mm(profile: "Profile", shares: Sequence[float]) -> FloatArray:
    """Return the radii within which ``shares`` of each channel's on-grid energy leave.

    F(r) is inverted inside the annulus that holds the share, by its smooth interpolation.

    Parameters
    ----------
    profile : Profile
    shares : sequence of float (k,) [1]
        Shares of `Profile.total_on_grid`, each in (0, 1].

    Returns
    -------
    array (k, C) [mm]
        NaN for a channel without energy on the grid.
    """
    cumulative = profile.cumulative
    total = cumulative[-1]
    radii_mm = np.full((len(shares), profile.n_channels), np.nan)
    for channel in np.flatnonzero(total > 0):
        for k, share in enumerate(shares):
            wanted = share * total[channel]
            annulus = int(np.argmax(cumulative[1:, channel] >= wanted))
            energy = profile.annulus_energy[:, channel]
            radii_mm[k, channel] = _radius_in(
                profile.r_edges_mm, energy, annulus, wanted - cumulative[annulus, channel]
            )
    return radii_mm


def _radius_in(r_edges_mm: FloatArray, energy: FloatArray, annulus: int, wanted: float) -> float:
    """Radius in an annulus where F has grown by ``wanted`` since its inner edge [mm]."""
    # The slopes at its edges depend on its neighbours; two on either side make them those of F.
    first, last = max(annulus - 2, 0), min(annulus + 3, len(energy))
    near = r_edges_mm[first : last + 1], energy[first:last, None]
    radii_mm = np.linspace(r_edges_mm[annulus], r_edges_mm[annulus + 1], _PARTS + 1)
    grown = integrals.cumulative_at(*near, radii_mm)[:, 0] - energy[first:annulus].sum()
    return float(np.interp(wanted, grown, radii_mm))


def mean_free_paths_mm(profile: "Profile") -> FloatArray | None:
    """Mean free path of each channel (C,) [mm] in the material's top layer; None if unknown."""
    material = material_of(profile)
    if material is None or material.n_channels != profile.n_channels:
        return None
    if len(material.layers) > 1:
        return None  # there is no one mean free path
    paths_mm = material.layers[0].mean_free_path_mm
    return paths_mm if np.isfinite(paths_mm).all() else None


def material_of(profile: "Profile") -> Material | None:
    """Return the material a profile says it was made from; None where it holds none."""
    record = profile.meta.get("material")
    if not isinstance(record, dict):
        return None
    try:
        return Material.from_dict(record)
    except MaterialError:
        return None


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
        return self._over(integrals.annulus_areas(self.edges_mm))

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
