"""The angle phi between a direction's part along the surface and the wavenumber's.

Radiance has the symmetry L(pi - phi) = conj L(phi), so nodes in (0, pi/2) are enough: orders
cos(m phi) with even m make the real part, those with odd m the imaginary part.
"""

import math
from dataclasses import dataclass

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.optics import gauss_legendre

_SMOOTH = 1.2  # wavenumber in attenuation lengths from which light near phi = pi/2 lasts longest
# Directions a quarter for wavenumbers, in attenuation lengths, below each limit, where the most
# are FEWEST; more are added at all wavenumbers alike.
_COUNTS = ((0.08, 2), (0.25, 3), (0.6, 4), (math.inf, 5))
FEWEST = 5


@dataclass(frozen=True, slots=True, eq=False)
class Azimuth:
    """A rule in phi: ``weight``, ``cosine`` (J,), and cos phi in the discrete orders (2 J, 2 J).

    With k = 0 there is one order, which does not stream along the surface.
    """

    weight: FloatArray
    cosine: FloatArray
    streaming: FloatArray

    @property
    def orders(self) -> int:
        """Number of azimuthal orders."""
        return len(self.streaming)


def azimuth_of(k: float, sigma_t: float, most: int = FEWEST) -> Azimuth:
    """Return the rule for a wavenumber and the least extinction of the layers that scatter.

    ``most`` is the number of directions a quarter that large wavenumbers get.
    """
    if k == 0.0:
        return Azimuth(np.ones(1), np.zeros(1), np.zeros((1, 1)))
    x = k / sigma_t
    count = next(few for limit, few in _COUNTS if x < limit) + most - FEWEST
    if x < _SMOOTH:
        angle = (np.arange(count) + 0.5) * 0.5 * math.pi / count
        weight = np.full(count, 1.0 / count)
    else:
        last = math.asinh(0.5 * math.pi * x)
        eta, weight = gauss_legendre(count, 0.0, last)
        angle = np.sinh(eta) / x
        weight = weight * np.cosh(eta) / x / (0.5 * math.pi)
    cosine = np.sin(angle)  # the angle is pi/2 - phi
    return Azimuth(weight, cosine, _streaming(angle, weight, cosine))


def _streaming(angle: FloatArray, weight: FloatArray, cosine: FloatArray) -> FloatArray:
    """Return cos phi between orders made orthonormal on the nodes; the factor i makes it skew."""
    phi, count = 0.5 * math.pi - angle, angle.size
    root = np.sqrt(weight)[:, None]
    even = np.linalg.qr(root * np.cos(phi[:, None] * np.arange(0, 2 * count, 2)))[0]
    odd = np.linalg.qr(root * np.cos(phi[:, None] * np.arange(1, 2 * count, 2)))[0]
    even[:, 0] *= np.sign(np.sum(even[:, 0]))  # light that does not depend on phi is positive
    between = even.T @ (cosine[:, None] * odd)
    found = np.zeros((2 * count, 2 * count))
    found[0::2, 1::2], found[1::2, 0::2] = -between, between.T
    return found
