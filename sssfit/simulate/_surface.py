"""The surface seen from inside: which directions leave, and how much of their light.

Light at cosine mu to the normal leaves a medium of relative index eta if mu > mu_c =
sqrt(1 - 1/eta^2); Fresnel's equations for unpolarised light give the share. Integrals over this
cone take mu = mu_c + (1 - mu_c) t^2, which tames the square root at the critical angle.
"""

import math
from dataclasses import dataclass

import numpy as np

from sssfit.arrays import FloatArray

MATCHED = 1e-9  # relative indices nearer to 1 reflect less than 1e-18: no surface at all
_DIRECTIONS = 96  # 1e-13 of Duntley's closed form for indices from 1.0001 to 4


def is_matched(eta: float) -> bool:
    """Whether a relative index is 1 for all purposes."""
    return abs(eta - 1.0) < MATCHED


def entering(eta: float) -> float:
    """Share 1 - R_sp of a normally incident beam that gets in."""
    return 1.0 - ((eta - 1.0) / (eta + 1.0)) ** 2


def entering_of_diffuse(eta: float) -> float:
    """Share 1 - R_sp that gets in of light of the same radiance from everywhere above.

    R_sp = 2 int_0^1 R_F(mu) mu dmu outside; by Snell's law mu dmu is eta^2 times that inside.
    """
    cone = Cone.of(eta, _DIRECTIONS)
    return 2.0 * eta**2 * float(cone.weight @ cone.cosine)


def transmitted(cosine: FloatArray, eta: float) -> FloatArray:
    """Return 1 - R_F for light from inside at that cosine: 0 beyond the critical angle (Fresnel).

    2 eta mu m [1/(eta mu + m)^2 + 1/(mu + eta m)^2] with m the cosine outside, the mean of both
    polarisations' transmittances: a difference 1 - R_F would lose grazing angles' digits.
    """
    outside = np.sqrt(np.maximum(1.0 - eta**2 * (1.0 - cosine**2), 0.0))
    if is_matched(eta):
        return np.ones_like(cosine)
    s_polarised = 1.0 / (eta * cosine + outside) ** 2
    p_polarised = 1.0 / (cosine + eta * outside) ** 2
    share: FloatArray = 2.0 * eta * cosine * outside * (s_polarised + p_polarised)
    return share


def gauss(count: int) -> tuple[FloatArray, FloatArray]:
    """Return nodes and weights of Gauss and Legendre on [0, 1]."""
    x, w = np.polynomial.legendre.leggauss(count)
    return 0.5 * (x + 1.0), 0.5 * w


@dataclass(frozen=True, slots=True, eq=False)
class Cone:
    """Quadrature over the cone of light that gets out, for a relative index above 1.

    ``cosine`` (M,), ``tangent`` (M,) of the directions; ``weight`` (M,) holds (1 - R_F) dmu.
    """

    cosine: FloatArray
    tangent: FloatArray
    weight: FloatArray

    @classmethod
    def of(cls, eta: float, count: int) -> "Cone":
        """Build the cone of a relative index with that many directions."""
        t, w = gauss(count)
        critical = math.sqrt(1.0 - 1.0 / eta**2)
        cosine = critical + (1.0 - critical) * t**2
        tangent = np.sqrt((1.0 - cosine) * (1.0 + cosine)) / cosine
        return cls(cosine, tangent, 2.0 * (1.0 - critical) * t * w * transmitted(cosine, eta))
