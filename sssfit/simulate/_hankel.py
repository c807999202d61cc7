"""From the plane's frequencies to the energy within r: F(r) = r int_0^inf Rhat(k) J1(k r) dk.

That is a Hankel transform of order 1, done on logarithmic grids as a convolution (FFTLog: Hamilton
2000, "Uncorrelated modes of the non-linear power spectrum", appendix B; scipy.fft.fht). For
transforms of the diffusion models, exponentials of sqrt(sigma_tr^2 + k^2) times lengths, F is good
to 2e-14 of the total at every radius, against the dipole's closed form.
"""

import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

# Step of ln k; 0.02 would do. The bias, a factor k^0.5, makes both ends of the range fade: without
# it the periodic transform wraps Rhat(0) around, an error of 1e-7 where there is 1e-14.
_STEP = 0.01
_BIAS = -0.5
# How far the range goes beyond the scales that matter, where 1e-3 and 1e3 leave 1e-10.
_BEYOND_LOW, _BEYOND_HIGH = 1e-13, 1e6

_POINTS = range(-3, 5)  # eight nodes around a point: their error is step^8


def cumulative_from_transform(
    transform: Callable[[FloatArray], FloatArray], r_mm: FloatArray, shortest_mm: float
) -> FloatArray:
    """Return F at radii.

    Parameters
    ----------
    transform : callable
        Takes wavenumbers (n, 1) [1/mm], gives Rhat (n, C): the integral of 2 pi r R_d(r) J0(k r).
    r_mm : (m,) [mm]
        Radii; the first is 0.
    shortest_mm : float [mm]
        The transform is an exponential exp(-k z) or smaller, z at least this, for large k.

    Returns
    -------
    (m, C)
    """
    from scipy.fft import fht, fhtoffset  # 0.2 s that the photon walk need not wait for

    low = _BEYOND_LOW / r_mm[-1]
    high = _BEYOND_HIGH / min(shortest_mm, float(r_mm[1]))
    n = math.ceil(math.log(high / low) / _STEP)
    steps = _STEP * (np.arange(n) - 0.5 * (n - 1))
    middle = math.sqrt(low * high)
    offset = float(fhtoffset(_STEP, 1, bias=_BIAS))
    values = transform((middle * np.exp(steps))[:, None])
    result = fht(values.T, _STEP, 1, offset=offset, bias=_BIAS)
    # fht gives int Rhat J1(k r) r dk at r = exp(offset + steps) / middle
    at = (np.log(r_mm[1:] * middle) - offset - steps[0]) / _STEP
    return np.vstack((np.zeros((1, len(result))), _interpolated(result, at).T))


def _interpolated(values: FloatArray, at: FloatArray) -> FloatArray:
    """Lagrange's interpolation (C, m) between values (C, n) that stand at 0, 1, 2, ..."""
    first = np.floor(at).astype(np.intp)
    fraction = at - first
    out = np.zeros((len(values), at.size))
    for own in _POINTS:
        weight = np.ones(at.size)
        for other in (each for each in _POINTS if each != own):
            weight *= (fraction - other) / (own - other)
        out += weight * values[:, first + own]
    return out
