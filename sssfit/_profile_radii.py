"""Radii that hold a given share of a profile's energy: what charts and summaries are scaled by."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from sssfit.profile import Profile

# Bisection of one annulus: 2^-40 of its width is under 1e-12 of any radius worth printing.
_HALVINGS = 40


def energy_radii_mm(profile: "Profile", shares: Sequence[float]) -> npt.NDArray[np.float64]:
    """Return the radii within which ``shares`` of each channel's on-grid energy leave.

    F(r) is inverted by bisection of its smooth interpolation inside the annulus that holds the
    share.

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
    cumulative, total = profile.cumulative, profile.total_on_grid
    radii_mm = np.full((len(shares), profile.n_channels), np.nan)
    for channel in np.flatnonzero(total > 0):
        wanted = np.asarray(shares) * total[channel]
        upper = np.searchsorted(cumulative[1:, channel], wanted).clip(max=profile.n_annuli - 1) + 1
        low, high = profile.r_edges_mm[upper - 1], profile.r_edges_mm[upper]
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            is_below = profile.cumulative_at(middle)[:, channel] < wanted
            low, high = np.where(is_below, middle, low), np.where(is_below, high, middle)
        radii_mm[:, channel] = high
    return radii_mm
