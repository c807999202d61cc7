"""From annuli to flat disks, lines and pixels: the integrals behind `sssfit.profile.Profile`.

A kernel is a function of the profile *and* the pixel size: near the beam, R_d ~ 1/r has no value to
sample and its square no integral. Every weight here is an integral over a pixel, in closed form, of
flat annuli (``sssfit._jit.pixels``), which the monotone interpolation of F first cuts into parts.
"""

import math
import operator
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray, number_array
from sssfit.errors import ProfileError
from sssfit.messages import shown

# If R_d ~ 1/r, the centre pixel at p = dr has 0.561 of F(dr), but only 1/pi of it from a flat
# annulus. Relative error with 1, 8, 16, 32, 64 parts: .44, .0036, .0011, .00049, .00031 at F = 1 -
# exp(-r/20dr), .00025 of it from the interpolation. 64 parts keep it below 1e-3 down to p = .37 dr;
# at p = .1 dr it is .008.
SUBDIVIDED_ANNULI = 10
PARTS_PER_ANNULUS = 64
# The steps between flat annuli are noise in pixels as wide as they are. R_d falls by 1/j over the
# jth of equal annuli, so parts in proportion to 1/j are all similar. skin1's kernel at p = dr is
# off by 1.2e-3 of its norm with steps from the eleventh annulus on and by 4e-5 with these parts;
# beyond the 320th, two parts reduce a pixel's error from 1 % or less to a quarter of it.
MIN_PARTS = 2

_LARGEST_KERNEL_BYTES = 2e9


def cumulative(annulus_energy: FloatArray) -> FloatArray:
    """Return F at the edges (n+1, C), 0 first."""
    return np.concatenate((np.zeros((1, annulus_energy.shape[1])), annulus_energy.cumsum(axis=0)))


def cumulative_at(
    r_edges_mm: FloatArray, annulus_energy: FloatArray, r_mm: FloatArray
) -> FloatArray:
    """Return F (..., C) at radii (...) from 0 up by smooth monotone interpolation."""
    at_edges = cumulative(annulus_energy)
    annulus = np.searchsorted(r_edges_mm[1:-1], r_mm, side="right")
    width, slopes = np.diff(r_edges_mm), _slopes(r_edges_mm, annulus_energy)
    local_width = width[annulus][..., None]
    t = (r_mm - r_edges_mm[annulus])[..., None] / local_width
    rise = local_width * slopes[annulus], local_width * slopes[annulus + 1]
    inside = at_edges[annulus] + _growth(t, annulus_energy[annulus], *rise)
    return np.where(t < 1.0, inside, at_edges[annulus + 1])


def flat_annuli(
    r_edges_mm: FloatArray, annulus_energy: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return edges (m+1,) and densities (m, C) [1/mm^2] of the annuli, each cut into flat parts."""
    parts = _parts(len(annulus_energy))
    annulus = np.repeat(np.arange(parts.size), parts)
    last = np.cumsum(parts) - 1
    t = (np.arange(annulus.size) - (last - parts)[annulus]) / parts[annulus]
    width, slopes = np.diff(r_edges_mm), _slopes(r_edges_mm, annulus_energy)
    local_width = width[annulus][:, None]
    rise = local_width * slopes[annulus], local_width * slopes[annulus + 1]
    grown = _growth(t[:, None], annulus_energy[annulus], *rise)
    grown[last] = annulus_energy
    energy = np.diff(grown, axis=0, prepend=0.0)
    energy[last[:-1] + 1] = grown[last[:-1] + 1]  # the first part of each starts at 0
    edges = np.concatenate(([0.0], r_edges_mm[annulus] + width[annulus] * t))
    edges[last + 1] = r_edges_mm[1:]
    return edges, energy / annulus_areas(edges)[:, None]


def _parts(annuli: int) -> npt.NDArray[np.intp]:
    """Return the number of parts of each annulus (n,): 64 for the first ten, then fewer."""
    share = SUBDIVIDED_ANNULI / np.arange(1, annuli + 1)
    parts = np.ceil(PARTS_PER_ANNULUS * np.minimum(share, 1.0)).astype(np.intp)
    at_least: npt.NDArray[np.intp] = np.maximum(parts, min(MIN_PARTS, PARTS_PER_ANNULUS))
    return at_least


def _growth(t: FloatArray, energy: FloatArray, rise0: FloatArray, rise1: FloatArray) -> FloatArray:
    """Return the cubic Hermite polynomial from 0 to ``energy`` with slopes ``rise0``, ``rise1``.

    Without F at the inner edge, rounding is relative to the annulus and not to F, so no part of an
    annulus of positive energy becomes negative, even if the annulus holds very little.
    """
    square = 3.0 * energy - 2.0 * rise0 - rise1
    cubic = rise0 + rise1 - 2.0 * energy
    return ((cubic * t + square) * t + rise0) * t


def _slopes(r_edges_mm: FloatArray, annulus_energy: FloatArray) -> FloatArray:
    """Return dF/dr at the edges (n+1, C): parabolas, limited so that F is monotone.

    The parabolas go through three edges. The limit is three times the smaller neighbouring chord
    (Fritsch and Carlson 1980, "Monotone piecewise cubic interpolation"). Harmonic means of the
    chords, the usual choice, are exact for F ~ r but 25 % low at the first edge for F ~ r^2 (any
    profile finite at 0: dipoles, Gaussians); parabolas are exact for both.
    """
    width = np.diff(r_edges_mm)[:, None]
    chord = annulus_energy / width
    left, right = chord[:-1], chord[1:]
    inner = (width[1:] * left + width[:-1] * right) / (width[1:] + width[:-1])
    # At the ends the slope of the parabola is 2 chord - its slope one edge farther in.
    first = 2.0 * chord[:1] - inner[:1] if len(inner) else chord
    last = 2.0 * chord[-1:] - inner[-1:] if len(inner) else chord
    smaller = np.where(left * right > 0, np.sign(left) * np.minimum(abs(left), abs(right)), 0.0)
    limit = 3.0 * np.concatenate((chord[:1], smaller, chord[-1:]))
    slopes = np.concatenate((first, inner, last))
    return np.clip(slopes, np.minimum(limit, 0.0), np.maximum(limit, 0.0))


def annulus_areas(r_edges_mm: FloatArray) -> FloatArray:
    """Return areas [mm^2], factored, since r1^2 - r0^2 loses four digits at the rim of a grid."""
    inner, outer = r_edges_mm[:-1], r_edges_mm[1:]
    return np.pi * (outer - inner) * (outer + inner)


def line_kernel(
    r_edges_mm: FloatArray,
    annulus_energy: FloatArray,
    mm_per_pixel: float,
    half_pixels: int | None,
) -> FloatArray:
    """Return the energy in strips one pixel wide: (2h+1, C)."""
    from sssfit._jit.pixel_energy import line_energy  # 7 ms that reading a profile does not need

    pitch_mm, half = checked_support(r_edges_mm[-1], mm_per_pixel, half_pixels, dimensions=1)
    edges, densities = flat_annuli(r_edges_mm, annulus_energy)
    half_line = line_energy(edges[1:], densities, pitch_mm, half)
    return np.concatenate((half_line[:0:-1], half_line))


def quadrant_kernel(
    r_edges_mm: FloatArray,
    annulus_energy: FloatArray,
    mm_per_pixel: float,
    half_pixels: int | None,
) -> FloatArray:
    """Return the energy in the pixels of a quadrant with its axes: (h+1, h+1, C)."""
    from sssfit._jit.pixel_energy import quadrant_energy

    pitch_mm, half = checked_support(r_edges_mm[-1], mm_per_pixel, half_pixels, dimensions=2)
    edges, densities = flat_annuli(r_edges_mm, annulus_energy)
    return quadrant_energy(edges[1:], densities, pitch_mm, half)


def full_kernel(quadrant: FloatArray) -> FloatArray:
    """Unfold a quadrant kernel (h+1, h+1, ...) into the whole one (2h+1, 2h+1, ...)."""
    half = np.concatenate((quadrant[:0:-1], quadrant))
    return np.concatenate((half[:, :0:-1], half), axis=1)


def checked_support(
    r_last_mm: float, mm_per_pixel: float, half_pixels: int | None, *, dimensions: int
) -> tuple[float, int]:
    """Return pixel size and half width in pixels, if a kernel of that size fits in memory.

    Raises
    ------
    ProfileError
        The pixel size is not a positive number, the half width is not a whole number from 0, or the
        kernel would take more than 2 GB per channel.
    """
    try:
        pitch_mm = float(mm_per_pixel)
        half = None if half_pixels is None else operator.index(half_pixels)
    except (TypeError, ValueError, OverflowError):
        raise ProfileError(
            f"mm_per_pixel = {shown(mm_per_pixel)}, half_pixels = {shown(half_pixels)}; "
            "expected a number and a whole number."
        ) from None
    if not (math.isfinite(pitch_mm) and pitch_mm > 0):
        raise ProfileError(f"mm_per_pixel = {pitch_mm}; expected a positive, finite number.")
    if half is not None and half < 0:
        raise ProfileError(f"half_pixels = {half}; expected 0 or more.")
    # Limited to avoid overflow: a size of 1e301 bytes says enough.
    across = min(r_last_mm / pitch_mm if half is None else half, 1e150)
    size = 8.0 * (across + 1.0) ** 2 if dimensions == 2 else 8.0 * (2.0 * across + 1.0)
    if size > _LARGEST_KERNEL_BYTES:
        raise ProfileError(
            f"a kernel of {across:.6g} pixels each way would take {size:.3g} bytes a "
            f"channel, more than {_LARGEST_KERNEL_BYTES:.3g}; use a larger `mm_per_pixel` or a "
            "smaller half_pixels."
        )
    return pitch_mm, _covering_half(r_last_mm, pitch_mm) if half is None else half


def _covering_half(r_last_mm: float, pitch_mm: float) -> int:
    """Return the smallest h with (h + 1/2) p >= r_last; the division may round either way."""
    half = max(math.ceil(r_last_mm / pitch_mm - 0.5) - 1, 0)
    while (half + 0.5) * pitch_mm < r_last_mm:
        half += 1
    return half


# F between 256 points of an annulus is linear to 2e-6 of the annulus' width.
_PARTS = 256


def energy_radii_mm(
    r_edges_mm: FloatArray, annulus_energy: FloatArray, shares: Sequence[float]
) -> FloatArray:
    """Return the radii (k, C) [mm] that contain k shares of each channel's energy.

    ``r_edges_mm`` (n+1,) and ``annulus_energy`` (n, C) are a profile's. Raises ProfileError for a
    share that is not above 0 and at most 1.
    """
    wanted = number_array("shares", shares, ProfileError)
    if wanted.ndim != 1:
        raise ProfileError(f"shares has shape {wanted.shape}; expected a list of shares.")
    for share in wanted.tolist():
        if not 0.0 < share <= 1.0:
            raise ProfileError(f"share = {share}; expected a share above 0 and at most 1.")
    within = cumulative(annulus_energy)
    total = within[-1]
    radii_mm = np.full((len(shares), total.size), np.nan)
    for channel in np.flatnonzero(total > 0):
        for k, share in enumerate(shares):
            wanted = share * total[channel]
            annulus = int(np.argmax(within[1:, channel] >= wanted))
            energy = annulus_energy[:, channel]
            radii_mm[k, channel] = _radius_in(
                r_edges_mm, energy, annulus, wanted - within[annulus, channel]
            )
    return radii_mm


def _radius_in(r_edges_mm: FloatArray, energy: FloatArray, annulus: int, wanted: float) -> float:
    """Return the radius in an annulus where F has grown by ``wanted`` from its inner edge [mm]."""
    # The slopes at its edges depend on its neighbours; two on either side are enough.
    first, last = max(annulus - 2, 0), min(annulus + 3, len(energy))
    near = r_edges_mm[first : last + 1], energy[first:last, None]
    radii_mm = np.linspace(r_edges_mm[annulus], r_edges_mm[annulus + 1], _PARTS + 1)
    grown = cumulative_at(*near, radii_mm)[:, 0] - energy[first:annulus].sum()
    return float(np.interp(wanted, grown, radii_mm))
