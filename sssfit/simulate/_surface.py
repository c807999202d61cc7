"""The surface seen from inside: the directions that leave, and the share of light that leaves.

Light at cosine mu to the normal leaves a medium of relative index eta if mu > mu_c = sqrt(1 -
1/eta^2); Fresnel's equations for unpolarised light give the share. Integrals over this cone take
mu = mu_c + (1 - mu_c) t^2, which removes the square root at the critical angle.
"""

import math
from dataclasses import dataclass

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.optics import fresnel_transmittance, gauss_legendre

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
