"""Fetches on a disk, as today's engines sample it: a golden-angle spiral, turned at each pixel.

The disk is cut into rings of equal energy of the widest channel, the one with the largest radius of
half its energy: F(r) of the profile decides, exactly. Each ring has one fetch, at the radius that
halves its energy, and every channel's weight is its own energy of the ring,

    r_k = F^-1((k + 1/2) / N),    w_k = F_c(F^-1((k + 1) / N)) - F_c(F^-1(k / N)),

so that a channel's weights add up to its energy. This is stratified importance sampling (Golubev
2018, "Efficient screen space subsurface scattering") with the weights integrated over their rings
and not taken at one radius. The rings are those of the widest channel: with rings of equal energy
of the channels' mean, skin1's pictures have 1.4 times the Delta E in one frame, and 2 times after
16. ``sssfit.render.disk`` has the angles.
"""

import time

import numpy as np

from sssfit.arrays import FloatArray, is_whole
from sssfit.errors import FitError
from sssfit.fit._result import TapsFit, provenance
from sssfit.fit._target import Pitch, make_target
from sssfit.kernel.structure import MOST_ON_DISK
from sssfit.kernel.taps import Stage, Taps
from sssfit.messages import counted, shown
from sssfit.profile import Profile

TAPS, FEWEST = 24, 4


def fit_disk(
    profile: Profile,
    *,
    taps: int = TAPS,
    mm_per_pixel: Pitch | None = None,
    support_mm: float | None = None,
) -> TapsFit:
    """Place fetches on a disk by the energy of a profile.

    Parameters
    ----------
    profile : Profile
        The profile to sample.
    taps : int
        Fetches a pixel, 4 to 256, by default 24.
    mm_per_pixel, support_mm : float, optional [mm]
        Pixel size, and radius of the disk; see ``sssfit.fit.make_target``. Light from beyond it is
        added to the rings in proportion.

    Returns
    -------
    TapsFit
        One stage of the kind "disk"; its spectral error is not known.

    Raises
    ------
    FitError, ProfileError
        The number, profile, pixel size or support is invalid.
    """
    begun = time.perf_counter()
    if not (is_whole(taps) and FEWEST <= taps <= MOST_ON_DISK):
        raise FitError(
            f"taps = {shown(taps)}; expected a whole number from {FEWEST} to {MOST_ON_DISK}."
        )
    target = make_target(profile, mm_per_pixel, support_mm)
    pixels = (2 * target.half_pixels + 1) ** 2
    if taps > pixels:
        raise FitError(
            f"taps = {taps}, but the support has {counted(pixels, 'pixel')}; use fewer taps or "
            "smaller pixels."
        )
    radius_mm = target.mm_per_pixel * (target.half_pixels + 0.5)
    radii_mm, weights = _rings(profile, taps, radius_mm)
    total = np.where(target.is_empty, 0.0, target.total)
    kernel = Taps(
        method="disk",
        mm_per_pixel=target.mm_per_pixel,
        channels=profile.channels,
        chained=False,
        stages=(Stage(0, "disk", radii_mm, np.concatenate((0.0 * weights[:1], weights))),),
        blend=np.stack((np.zeros_like(total), total)),
        errors={"spectral": np.full(total.size, np.nan), "energy": np.zeros(total.size)},
        meta=provenance(target, {"taps": taps}),
    )
    return TapsFit(kernel, 0, time.perf_counter() - begun)


def _rings(profile: Profile, count: int, radius_mm: float) -> tuple[FloatArray, FloatArray]:
    """Return the radii (N,) [mm] and the shares of each channel's energy (N, C) of N rings."""
    widest = int(np.nanargmax(profile.energy_radii_mm([0.5])[0]))
    within = profile.cumulative_at([radius_mm])[0, widest] / profile.total_on_grid[widest]
    half_rings = min(within, 1.0) * np.arange(1, 2 * count) / (2 * count)
    radii_mm = profile.energy_radii_mm(half_rings.tolist())[:, widest]
    edges_mm = np.concatenate(([0.0], radii_mm[1::2], [radius_mm]))
    energy = np.diff(profile.cumulative_at(edges_mm), axis=0)
    dark = energy.sum(axis=0) <= 0.0
    energy[:, dark] = energy[:, [widest]]  # any weights do: their blend is 0
    return radii_mm[::2], energy / energy.sum(axis=0)
