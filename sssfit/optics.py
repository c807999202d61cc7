"""Light at a smooth surface, the quadrature for integrals over directions, and interpolation.

This is the only place of Fresnel's equations outside the compiled layer, which may not import this
module and has its own (`sssfit._jit.sampling.fresnel_reflectance`). ``eta`` is the refractive index
inside divided by that outside; cosines are those to the normal, inside.

Light at cosine mu to the normal leaves a medium if mu > mu_c = sqrt(1 - 1/eta^2). Integrals over
this cone take mu = mu_c + (1 - mu_c) t^2, which removes the square root at the critical angle.
"""

import functools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray

_LEAST = 1e-150  # denominator: 0 / 0 at a cosine of 0 becomes 0
MATCHED = 1e-9  # relative indices nearer to 1 reflect less than 1e-18, like no surface


def is_matched(eta: float) -> bool:
    """Return whether a relative index counts as 1."""
    return abs(eta - 1.0) < MATCHED


def normal_reflectance(eta: float, eta_outside: float = 1.0) -> float:
    """Return the specular reflectance R_sp = ((n1 - n0) / (n1 + n0))^2 at normal incidence."""
    return ((eta - eta_outside) / (eta + eta_outside)) ** 2


def normal_transmittance(eta: float) -> float:
    """Return the share 1 - R_sp of a normally incident beam that enters."""
    return 1.0 - normal_reflectance(eta)


def fresnel_transmittance(cosine: npt.ArrayLike, eta: float) -> FloatArray:
    """Return the share 1 - R_F of unpolarised light that escapes; 0 beyond the critical angle.

    2 eta mu m [1/(eta mu + m)^2 + 1/(mu + eta m)^2] with m the cosine outside, the mean of both
    polarisations' transmittances (Born and Wolf, "Principles of Optics", section 1.5.3): a
    difference 1 - R_F would lose digits at grazing angles.
    """
    cosine = np.asarray(cosine, dtype=np.float64)
    outside = np.sqrt(np.maximum(1.0 - eta**2 * (1.0 - cosine**2), 0.0))
    if is_matched(eta):
        return np.ones_like(cosine)
    s_polarised = 1.0 / np.maximum(eta * cosine + outside, _LEAST) ** 2
    p_polarised = 1.0 / np.maximum(cosine + eta * outside, _LEAST) ** 2
    share: FloatArray = 2.0 * eta * cosine * outside * (s_polarised + p_polarised)
    return share


def fresnel_reflectance(cosine: npt.ArrayLike, eta: float) -> FloatArray:
    """Return R_F of unpolarised light from inside, to 1e-15; 1 beyond the critical angle."""
    reflected: FloatArray = 1.0 - fresnel_transmittance(cosine, eta)
    return reflected


@functools.cache
def _legendre(count: int) -> tuple[FloatArray, FloatArray]:
    """Return the rule on [-1, 1]; 96 nodes take 2 ms."""
    x, w = np.polynomial.legendre.leggauss(count)
    return x, w


def gauss_legendre(
    count: int, start: float = 0.0, end: float = 1.0
) -> tuple[FloatArray, FloatArray]:
    """Return nodes and weights (count,) of Gaussian quadrature over [start, end]."""
    x, w = _legendre(count)
    middle, half = 0.5 * (start + end), 0.5 * (end - start)
    return middle + half * x, half * w


def lagrange_shares(places: npt.NDArray[np.number[Any]], t: FloatArray) -> FloatArray:
    """Return the weights (K, n) of the values at ``places`` (K,) in their polynomial at t (n,).

    Lagrange's formula: the product over all other places q of (t - q) / (place - q).
    """
    shares = np.ones((places.size, t.size))
    for place, share in zip(places, shares, strict=True):
        for other in places[places != place]:
            share *= (t - other) / (place - other)
    return shares


_DIRECTIONS = 96  # 1e-13 of Duntley's closed form for indices from 1.0001 to 4


def entering_of_diffuse(eta: float) -> float:
    """Return the share 1 - R_sp that enters, of light of equal radiance from all directions above.

    R_sp = 2 int_0^1 R_F(mu) mu dmu outside; by Snell's law mu dmu is eta^2 times that inside.
    """
    cone = Cone.of(eta, _DIRECTIONS)
    return 2.0 * eta**2 * float(cone.weight @ cone.cosine)


@dataclass(frozen=True, slots=True, eq=False)
class Cone:
    """Quadrature over the escape cone, for a relative index above 1.

    ``cosine`` (M,), ``tangent`` (M,) of the directions; ``weight`` (M,) holds (1 - R_F) dmu.
    """

    cosine: FloatArray
    tangent: FloatArray
    weight: FloatArray

    @classmethod
    def of(cls, eta: float, count: int) -> "Cone":
        """Build the cone for a relative index with this many directions."""
        t, w = gauss_legendre(count)
        critical = math.sqrt(1.0 - 1.0 / eta**2)
        cosine = critical + (1.0 - critical) * t**2
        tangent = np.sqrt((1.0 - cosine) * (1.0 + cosine)) / cosine
        return cls(
            cosine, tangent, 2.0 * (1.0 - critical) * t * w * fresnel_transmittance(cosine, eta)
        )
