"""The published table of taps of separable-sss, by number of taps, strength and falloff."""

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import FitError
from sssfit.messages import shown

# The red channel of d'Eon's skin without its narrowest Gaussian, for which the strength stands:
# weights and variances [mm^2].
LISTED = ((0.1, 0.0484), (0.118, 0.187), (0.113, 0.567), (0.358, 1.99), (0.078, 7.41))


def listing(taps: int, strength: FloatArray, falloff: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the kernel of Jimenez' listing: offsets (n,) and weights (n+1, C), middle first.

    ``calculateKernel`` of separable-sss: offsets grow as the square up to 3, or 2 with 20 taps or
    fewer; weights are the profile at a point, by radius, times half the distance between the
    neighbours, and the strength (C,) is the share that is scattered. ``falloff`` (C,) scales the
    profile. Raises FitError for an even number of taps, or one below 3.
    """
    if taps < 3 or taps % 2 == 0:
        raise FitError(f"taps = {shown(taps)}; expected an odd number from 3.")
    half = taps // 2
    reach = 3.0 if taps > 20 else 2.0
    offsets = reach * (np.arange(half + 1) / half) ** 2
    after = np.append(offsets[1:], offsets[-1])
    before = np.append(-offsets[1], offsets[:-1])
    r = offsets[:, None] / (0.001 + np.asarray(falloff))
    profile = sum(w * np.exp(-(r**2) / (2.0 * v)) / (2.0 * 3.14 * v) for w, v in LISTED)
    weights = 0.5 * (after - before)[:, None] * profile
    weights = strength * weights / (weights[0] + 2.0 * weights[1:].sum(axis=0))
    weights[0] += 1.0 - strength
    return offsets[1:], weights
