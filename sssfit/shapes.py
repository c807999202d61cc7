"""Model shapes of profiles: Gaussians, normalised diffusion, the six-Gaussian skin.

Pure formulas of unit energy: no materials, no profiles, no units beyond "the same length
everywhere". A density in the plane is ``*_density``, its energy within a disk ``*_cdf``, its
integral along a line ``*_marginal``. Fits and simulations share them.
"""

import math

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray

# Six Gaussians for the skin of a face, d'Eon, Luebke, Enderton 2007, "Efficient rendering of human
# skin": variances per axis [mm^2], and weights of R, G, B (6, 3) that add up to 1 in each.
SKIN_VARIANCES_MM2 = (0.0064, 0.0484, 0.187, 0.567, 1.99, 7.41)
SKIN_WEIGHTS = (
    (0.233, 0.455, 0.649),
    (0.100, 0.336, 0.344),
    (0.118, 0.198, 0.0),
    (0.113, 0.007, 0.007),
    (0.358, 0.004, 0.0),
    (0.078, 0.0, 0.0),
)

# The integral of K0 from t on: beyond 1 by the trapezoidal rule, whose error is exp(-2 pi / step).
_STEP = 0.17
_NODES = _STEP * np.arange(1, 38)  # exp(-w^2) is under 1e-17 at the last
_SMALL_SHARE = 1e-2  # below, the closed form of the inverse loses the digits of its share


def gaussian_density(r: npt.ArrayLike, variance: npt.ArrayLike) -> FloatArray:
    """Gaussian in the plane, G(r; v) = exp(-r^2 / 2v) / (2 pi v), v the variance per axis."""
    v = np.asarray(variance, dtype=np.float64)
    return np.exp(-np.square(r) / (2.0 * v)) / (2.0 * math.pi * v)


def gaussian_cdf(r: npt.ArrayLike, variance: npt.ArrayLike) -> FloatArray:
    """Energy of `gaussian_density` within r: 1 - exp(-r^2 / 2v)."""
    exponent = np.square(r) / (2.0 * np.asarray(variance, dtype=np.float64))
    return np.asarray(-np.expm1(-exponent), dtype=np.float64)


def gaussian_between(
    inner: npt.ArrayLike, outer: npt.ArrayLike, variance: npt.ArrayLike
) -> FloatArray:
    """Energy of `gaussian_density` between two radii, with all digits even if it is small.

    exp(-a^2 / 2v) (1 - exp(-(b^2 - a^2) / 2v)); a difference of two CDFs has no more digits than 1.
    """
    v = np.asarray(variance, dtype=np.float64)
    grown = np.square(outer) - np.square(inner)
    return np.asarray(-np.expm1(-grown / (2.0 * v)) * gaussian_beyond(inner, v), dtype=np.float64)


def gaussian_beyond(r: npt.ArrayLike, variance: npt.ArrayLike) -> FloatArray:
    """Energy of `gaussian_density` beyond r: exp(-r^2 / 2v)."""
    return np.asarray(np.exp(-np.square(r) / (2.0 * np.asarray(variance))), dtype=np.float64)


def gaussian_marginal(x: npt.ArrayLike, variance: npt.ArrayLike) -> FloatArray:
    """`gaussian_density` integrated along a line: exp(-x^2 / 2v) / sqrt(2 pi v)."""
    v = np.asarray(variance, dtype=np.float64)
    return np.exp(-np.square(x) / (2.0 * v)) / np.sqrt(2.0 * math.pi * v)


def gaussian_line_integral(
    left: npt.ArrayLike, right: npt.ArrayLike, variance: npt.ArrayLike
) -> FloatArray:
    """Integral of `gaussian_marginal` from ``left`` to ``right``: energy of a pixel's column.

    A difference of two tails, on the side of 0 where these are small and keep their digits.
    """
    from scipy.special import ndtr  # 0.2 s that the photon walk does not need

    sigma = np.sqrt(np.asarray(variance, dtype=np.float64))
    a, b = np.asarray(left) / sigma, np.asarray(right) / sigma
    near, far = np.where(a + b < 0.0, -b, a), np.where(a + b < 0.0, -a, b)
    return np.asarray(ndtr(-near) - ndtr(-far), dtype=np.float64)


def diffusion_density(r: npt.ArrayLike, s: npt.ArrayLike) -> FloatArray:
    """Normalised diffusion, s (exp(-s r) + exp(-s r / 3)) / (8 pi r): infinite at r = 0.

    Christensen and Burley 2015, "Approximate reflectance profiles for efficient subsurface
    scattering"; s is an inverse length. With ``s = s_perpendicular(A) / mean_free_path`` and
    times A it is their R(r).
    """
    r, s = np.asarray(r, dtype=np.float64), np.asarray(s, dtype=np.float64)
    with np.errstate(divide="ignore"):
        return np.asarray(s * (np.exp(-s * r) + np.exp(-s * r / 3.0)) / (8.0 * math.pi * r))


def diffusion_beyond(r: npt.ArrayLike, s: npt.ArrayLike) -> FloatArray:
    """Energy of `diffusion_density` beyond r: exp(-s r) / 4 + 3 exp(-s r / 3) / 4."""
    t = np.multiply(r, s, dtype=np.float64)
    return np.asarray(0.25 * np.exp(-t) + 0.75 * np.exp(-t / 3.0), dtype=np.float64)


def diffusion_cdf(r: npt.ArrayLike, s: npt.ArrayLike) -> FloatArray:
    """Energy of `diffusion_density` within r: 1 - `diffusion_beyond`, to rounding near 0 too."""
    t = np.multiply(r, s, dtype=np.float64)
    return np.asarray(-0.25 * np.expm1(-t) - 0.75 * np.expm1(-t / 3.0), dtype=np.float64)


def diffusion_radius(share: npt.ArrayLike, s: npt.ArrayLike) -> FloatArray:
    """Radius that contains a share (0 to 1) of the energy: the inverse of `diffusion_cdf`.

    With y = exp(-s r / 3) the CDF reads y^3 + 3 y = 4 (1 - share), and y = 2 sinh t makes the left
    side 2 sinh 3t. Small shares, which 1 - share would round, start from the series s r = 2 u + 4
    u^2 / 3 and take two Newton steps. NaN for a share outside 0 to 1.
    """
    u = np.asarray(share, dtype=np.float64)
    u = np.where((u >= 0.0) & (u <= 1.0), u, np.nan)
    with np.errstate(divide="ignore"):
        far = -3.0 * np.log(2.0 * np.sinh(np.arcsinh(2.0 * (1.0 - u)) / 3.0))
    near = 2.0 * u + 4.0 * u**2 / 3.0
    for _ in range(2):
        slope = 0.25 * (np.exp(-near) + np.exp(-near / 3.0))
        near = near - (diffusion_cdf(near, 1.0) - u) / slope
    return np.asarray(np.where(u < _SMALL_SHARE, near, far) / s, dtype=np.float64)


def diffusion_marginal(x: npt.ArrayLike, s: npt.ArrayLike) -> FloatArray:
    """`diffusion_density` integrated along a line, s (K0(s|x|) + K0(s|x|/3)) / (4 pi).

    Infinite at x = 0: pixels take `diffusion_line_integral`. Its second moment is 7 / s^2.
    """
    from scipy.special import k0  # 0.2 s that the photon walk does not need

    s = np.asarray(s, dtype=np.float64)
    t = s * np.abs(x)
    return np.asarray(s * (k0(t) + k0(t / 3.0)) / (4.0 * math.pi), dtype=np.float64)


def diffusion_line_integral(
    left: npt.ArrayLike, right: npt.ArrayLike, s: npt.ArrayLike
) -> FloatArray:
    """Integral of `diffusion_marginal` from ``left`` to ``right``: the energy of a pixel's column.

    Differences are taken on the side of 0 that keeps digits: of the energy beyond, where both ends
    lie on one side.
    """
    a = np.multiply(left, s, dtype=np.float64)
    b = np.multiply(right, s, dtype=np.float64)
    across = 0.5 * (np.sign(b) - np.sign(a))  # 1 where the interval holds 0
    tails = np.sign(a) * _beyond_line(np.abs(a)) - np.sign(b) * _beyond_line(np.abs(b))
    return np.asarray(across + tails, dtype=np.float64)


def _beyond_line(t: FloatArray) -> FloatArray:
    """Integral of the marginal at s = 1 from t >= 0 to infinity; 1/2 at 0."""
    return np.asarray((_k0_beyond(t) + 3.0 * _k0_beyond(t / 3.0)) / (4.0 * math.pi))


def _k0_beyond(t: FloatArray) -> FloatArray:
    """Integral of K0 from t >= 0 to infinity, pi/2 at 0; relative error 1e-14.

    pi/2 less the integral from 0 on loses its digits beyond 1. There, with w^2 = t (cosh u - 1),
    K0's own integral over u becomes sqrt(2/t) exp(-t) int_0^inf exp(-w^2) / ((1 + w^2/t)
    sqrt(1 + w^2/2t)) dw.
    """
    from scipy.special import iti0k0  # 0.2 s, as above

    near = 0.5 * math.pi - iti0k0(np.minimum(t, 1.0))[1]
    far = np.maximum(t, 1.0)
    ratio = _NODES**2 / far[..., None]
    values = np.exp(-(_NODES**2)) / ((1.0 + ratio) * np.sqrt(1.0 + 0.5 * ratio))
    integral = _STEP * (0.5 + values.sum(axis=-1))
    return np.asarray(np.where(t < 1.0, near, np.sqrt(2.0 / far) * np.exp(-far) * integral))


def s_perpendicular(reflectance: npt.ArrayLike) -> FloatArray:
    """Shape s times the mean free path for light along the normal: 1.85 - A + 7 |A - 0.8|^3.

    A is the diffuse reflectance, not the single-scattering albedo; the mean free path is 1/sigma_t
    (with g other than 0 the reduced one, 1/sigma_t'). Christensen and Burley 2015, as below.
    """
    a = np.asarray(reflectance, dtype=np.float64)
    return np.asarray(1.85 - a + 7.0 * np.abs(a - 0.8) ** 3, dtype=np.float64)


def s_diffuse(reflectance: npt.ArrayLike) -> FloatArray:
    """Shape s times the mean free path for diffuse light: 1.9 - A + 3.5 (A - 0.8)^2.

    A and the mean free path as in `s_perpendicular`.
    """
    a = np.asarray(reflectance, dtype=np.float64)
    return np.asarray(1.9 - a + 3.5 * (a - 0.8) ** 2, dtype=np.float64)


def s_diffuse_mean_free_path(reflectance: npt.ArrayLike) -> FloatArray:
    """Shape s times the diffuse mean free path: 3.5 + 100 (A - 0.33)^4.

    The diffuse mean free path is 1 / sigma_tr with sigma_tr = sqrt(3 sigma_a sigma_t'), which gives
    the 3.67, 1.37, 0.68 mm that the literature calls skin1's; A as in `s_perpendicular`.
    """
    a = np.asarray(reflectance, dtype=np.float64)
    return np.asarray(3.5 + 100.0 * (a - 0.33) ** 4, dtype=np.float64)
