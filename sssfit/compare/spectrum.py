"""How much of a profile's 2D kernel each separable term holds: its singular values.

The kernel on pixels is symmetric, so singular values are the absolute eigenvalues. Jimenez, Jarabo
and Gutierrez 2012, RR-02-12, figure 2, draw the "percentage of energy" of each and do not say of
what: both readings are here, shares of the sum of squares (what a Frobenius error is made of) and
of the sum of absolute values. ``sssfit.chart`` draws the record.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from sssfit.arrays import FloatArray, plain
from sssfit.fit import Pitch, make_target
from sssfit.fit.svd import all_eigenvalues
from sssfit.process import one_blas_thread
from sssfit.profile import Profile

_MOST = 12  # terms in figures; the chart shows as many


@dataclass(frozen=True, slots=True, eq=False)
class Spectrum:
    """The eigenvalues of a profile's kernel, for n = h + 1 terms and C channels.

    Parameters
    ----------
    profile : Profile
    mm_per_pixel : float [mm]
    values : (n, C) [1]
        Signed, falling in magnitude; 0 for a channel that returns nothing. Other singular values
        than these the kernel does not have, being even.
    """

    profile: Profile
    mm_per_pixel: float
    values: FloatArray

    @property
    def pixels(self) -> int:
        """Pixels along an edge of the kernel."""
        return 2 * len(self.values) - 1

    @property
    def squared_share(self) -> FloatArray:
        """Of the sum of squares, the squared Frobenius norm (n, C)."""
        return _share(self.values**2)

    @property
    def absolute_share(self) -> FloatArray:
        """Of the sum of singular values (n, C)."""
        return _share(np.abs(self.values))

    def rank_for(self, error: float, channel: int) -> int:
        """Return the fewest terms with which the relative Frobenius error is at most ``error``."""
        left = 1.0 - np.cumsum(self.squared_share[:, channel])
        return int(np.argmax(left <= error**2)) + 1

    def to_dict(self) -> dict[str, Any]:
        """Return the figures of ``sssfit chart --spectrum --json``: the first terms by channels."""
        return plain(
            {
                "channels": self.profile.channels,
                "mm_per_pixel": self.mm_per_pixel,
                "pixels": self.pixels,
                "eigenvalues": self.values[:_MOST],
                "squared_share": self.squared_share[:_MOST],
                "absolute_share": self.absolute_share[:_MOST],
                "rank_for_1_percent": [
                    self.rank_for(0.01, c) for c in range(self.profile.n_channels)
                ],
            }
        )


def compute_spectrum(
    profile: Profile, *, mm_per_pixel: Pitch | None = None, support_mm: float | None = None
) -> Spectrum:
    """Return the singular values of the kernel that fits aim at.

    Parameters
    ----------
    profile : Profile
    mm_per_pixel, support_mm : float, optional [mm]
        Pixels; see ``sssfit.fit.make_target``. Energy concentrates in the first term as pixels
        grow; the support hardly matters.

    Raises
    ------
    FitError, ProfileError
        Invalid profile, pitch or support.

    Examples
    --------
    >>> from sssfit.material import load_material
    >>> from sssfit.simulate import simulate_dipole
    >>> found = compute_spectrum(simulate_dipole(load_material("skin1")), mm_per_pixel=0.3)
    >>> found.squared_share[0].round(3).tolist()
    [0.988, 0.994, 0.996]
    """
    target = make_target(profile, mm_per_pixel, support_mm)
    values = np.zeros((target.half_pixels + 1, profile.n_channels))
    with one_blas_thread():  # as ``sssfit.fit`` does
        for c in np.flatnonzero(~target.is_empty):
            values[:, c] = all_eigenvalues(target.quadrant(int(c)))
    return Spectrum(profile, target.mm_per_pixel, values)


def _share(parts: FloatArray) -> FloatArray:
    """Parts over their sum by channel; 0 where it is 0."""
    whole = np.broadcast_to(parts.sum(axis=0), parts.shape)
    shares: FloatArray = np.divide(parts, whole, out=np.zeros_like(parts), where=whole > 0.0)
    return shares
