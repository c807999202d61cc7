"""Light scattered once in a half space, in closed form but for one integral over direction.

Collisions of a pencil beam lie on the axis; from depth z light at angle theta to the normal leaves
at r = z tan(theta). Integrated over depth, what leaves beyond r is

    a/2 (1 - R_sp) int_{mu_c}^1 (1 - R_F) exp(-r (mu/sqrt(1-mu^2)) (1 + 1/mu)) / (1 + 1/mu) dmu

with a the albedo and r in mean free paths. The exponent is 1/tan(theta) near the axis, so the
integral is taken by the double-exponential rule (Takahasi and Mori 1974) in theta, which no
behaviour at an end of the range troubles.
"""

import math

import numpy as np

from sssfit.simulate._surface import Cone, FloatArray, entering, transmitted

_REACH = 3.2  # the rule's last nodes lie 1e-16 of the range from its ends
_DIRECTIONS = 96
_RADII_AT_ONCE = 8192  # 8 MB of exponents at a time for 128 directions


def single_scattering_beyond(radii_mfp: FloatArray, eta: float, step: float) -> FloatArray:
    """Return the energy once scattered, for albedo 1, that leaves beyond each radius.

    Parameters
    ----------
    radii_mfp : (n,) [MFP]
        From 0 up.
    eta : float
        Relative refractive index, 1 or above.
    step : float
        Of the double-exponential rule; 0.1 gives 1e-7, 0.05 gives 1e-12.

    Returns
    -------
    (n,) array
        Multiply by the albedo. The first value for radius 0 is the total.
    """
    half_angle, weight = _angles(eta, step)
    angle = 2.0 * half_angle
    cosine = np.cos(angle)
    # (1 + 1/mu) mu / sqrt(1 - mu^2) = (1 + mu) / sin(theta) = 1 / tan(theta/2)
    rate = 1.0 / np.tan(half_angle)
    share = transmitted(cosine, eta) * np.sin(angle) * cosine / (1.0 + cosine)
    factor = 0.5 * entering(eta) * weight * share
    parts = [
        np.exp(-np.outer(radii_mfp[first : first + _RADII_AT_ONCE], rate)) @ factor
        for first in range(0, len(radii_mfp), _RADII_AT_ONCE)
    ]
    return np.concatenate(parts)


def single_scattering_of_diffuse_light(eta: float) -> float:
    """Return what leaves, once scattered, of light of the same radiance from everywhere above.

    eta^2 int int (1 - R_F(mu)) (1 - R_F(mu')) mu mu' / (mu + mu') dmu dmu' over the cone, for
    albedo 1 and incident light of 1. Without a surface that is 2/3 (1 - ln 2).
    """
    cone = Cone.of(eta, _DIRECTIONS)
    part = cone.weight * cone.cosine
    return eta**2 * float(part @ (1.0 / np.add.outer(cone.cosine, cone.cosine)) @ part)


def _angles(eta: float, step: float) -> tuple[FloatArray, FloatArray]:
    """Return half of each angle up to the critical one, and the weights of the angles."""
    largest = math.asin(1.0 / eta)
    t = np.arange(-_REACH, _REACH + 0.5 * step, step)
    stretched = 0.5 * math.pi * np.sinh(t)
    place = 1.0 / (1.0 + np.exp(-2.0 * stretched))
    weight = 0.25 * math.pi * np.cosh(t) / np.cosh(stretched) ** 2 * step
    return 0.5 * largest * place, largest * weight
