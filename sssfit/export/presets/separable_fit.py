"""What the taps of separable-sss do to a picture, fitted to a profile: `fit_separable`."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy import special
from scipy.optimize import least_squares

from sssfit.arrays import FloatArray
from sssfit.export.presets.separable import LEAST_FALLOFF, PIXEL_MM, Separable
from sssfit.export.presets.source import Source
from sssfit.kernel.listing import listing
from sssfit.profile import Profile

# Along an axis: taps that reach over 13 mm oscillate between fewer (160 change the width by .04 %).
_FREQUENCIES, _GRADING = 100, 2.2
_RADIAL = 600  # frequencies of the profile's spectrum, between which it is interpolated
# Tried in every pair before the best are refined: taps at few offsets leave many shallow minima.
_STRENGTHS = (0.3, 0.5, 0.7, 0.9)
_UNITS = 0.5 * 2.0 ** np.arange(0.0, 5.0, 0.125)  # times the widest channel's distance d
_FALLOFFS = np.linspace(LEAST_FALLOFF, 1.0, 40)
_REFINED = 6
_Model = Callable[[FloatArray], FloatArray]


@functools.lru_cache(maxsize=8)  # three engines have the same 25 taps
def fit_separable(source: Source, taps: int) -> Separable:
    """Fit the kernel of so many taps to what a picture shows of a profile.

    Minimises sum S(w) (K(|w|) - a(w_x) a(w_y))^2 over frequencies up to those of 0.3 mm pixels,
    with K the profile's spectrum, a that of the taps, and S = 1 / |w|^2 the power of pictures of
    edges. The widest channel has the falloff 1 and gives the unit; the others follow in it.
    """
    spectra = _Spectra.of(source.profile)
    widest = int(np.argmin(source.shapes_per_mm))
    strength, falloff = np.zeros(3), np.ones(3)
    wide_mm = 1.0 / float(source.shapes_per_mm[widest])
    strength[widest], log_unit = spectra.fit(
        widest,
        lambda x: _spectrum(taps, x[0], 1.0, math.exp(x[1]), spectra),
        [(t, math.log(k * wide_mm)) for t in _STRENGTHS for k in _UNITS.tolist()],
        (-np.inf, np.inf),
    )
    unit_mm = math.exp(log_unit)
    for c in {0, 1, 2} - {widest}:
        strength[c], falloff[c] = spectra.fit(
            c,
            lambda x: _spectrum(taps, x[0], x[1], unit_mm, spectra),
            [(t, f) for t in _STRENGTHS for f in _FALLOFFS.tolist()],
            (LEAST_FALLOFF, 1.0),
        )
    return Separable(unit_mm, strength, falloff)


class _Spectra(NamedTuple):
    """Frequencies on a quadrant, and the profile's spectrum there by channel."""

    frequencies: FloatArray  # (n,) [1/mm]
    wanted: FloatArray  # (3, n, n), 1 at 0
    weight: FloatArray  # (n, n), the square root of S and the cell

    @classmethod
    def of(cls, profile: Profile) -> _Spectra:
        """Return those of a profile."""
        most = math.pi / PIXEL_MM
        edges = most * (np.arange(_FREQUENCIES + 1) / _FREQUENCIES) ** _GRADING
        middle, cell = 0.5 * (edges[1:] + edges[:-1]), np.diff(edges)
        radial = np.hypot(middle[:, None], middle)
        along = np.linspace(0.0, math.sqrt(2.0) * most, _RADIAL)
        wanted = [np.interp(radial, along, each) for each in _hankel(profile, along).T]
        return cls(middle, np.stack(wanted), np.sqrt(cell[:, None] * cell) / radial)

    def fit(
        self,
        channel: int,
        model: _Model,
        starts: Sequence[tuple[float, float]],
        bounds: tuple[float, float],
    ) -> tuple[float, float]:
        """Return the strength and the other parameter, within bounds, that fit a channel best."""

        def residual(x: FloatArray) -> FloatArray:
            a = model(x)
            return np.asarray((self.weight * (np.outer(a, a) - self.wanted[channel])).ravel())

        within = (0.0, bounds[0]), (1.0, bounds[1])
        near = sorted(starts, key=lambda x: float((residual(np.array(x)) ** 2).sum()))[:_REFINED]
        found = [least_squares(residual, x, bounds=within, xtol=1e-12, ftol=1e-12) for x in near]
        best = min(found, key=lambda each: float(each.cost))
        return float(best.x[0]), float(best.x[1])


def _hankel(profile: Profile, frequencies: FloatArray) -> FloatArray:
    """Return the spectrum (n, C) of a profile in the plane, 1 at 0: int J0(w r) dF / F."""
    middle_mm = 0.5 * (profile.r_edges_mm[1:] + profile.r_edges_mm[:-1])
    waves = special.j0(frequencies[:, None] * middle_mm)
    return np.asarray(waves @ profile.annulus_energy / profile.total_on_grid)


def _spectrum(taps: int, t: float, f: float, unit_mm: float, spectra: _Spectra) -> FloatArray:
    """Return the spectrum (n,) of the taps of one channel along a line."""
    offsets, weights = listing(taps, np.array([t]), np.array([f]))
    waves = 2.0 * np.cos(spectra.frequencies[:, None] * offsets * unit_mm)
    return np.asarray(weights[0, 0] + waves @ weights[1:, 0])
