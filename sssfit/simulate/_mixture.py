"""From wavenumbers back to radii: the profile as a mixture of Bessel functions K0.

The transform Rhat(k) of multiple scattering is, to the solver's precision, a Stieltjes function of
k^2: a sum of w q^2 / (k^2 + q^2), w >= 0, q >= lambda. Each term is the transform of w q^2 K0(q
r) / (2 pi), of which w q r K1(q r) leaves beyond r. So the inversion

    F(r) = r int_0^inf Rhat(k) J1(k r) dk

becomes a non-negative least squares problem of about 40 wavenumbers and 200 rates q (Lawson and
Hanson 1974), followed by a closed form. By construction F rises and R_d falls everywhere, at any
distance, and the tail beyond the last wavenumber is extrapolated. Interpolating Rhat and
integrating against J1 left a noise of 1e-6 of the total. The misfit of the mixture at the
wavenumbers is returned as part of the solver's error.
"""

import math
from dataclasses import dataclass

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import SimulationError
from sssfit.optics import Cone, fresnel_transmittance, normal_transmittance

_REACH = 3.2  # the last nodes of the rule lie 1e-16 of the range from its ends
_DIRECTIONS = 96
_RADII_AT_ONCE = 8192  # 8 MB of exponents at a time for 128 directions


def single_scattering_beyond(radii_mfp: FloatArray, eta: float, step: float) -> FloatArray:
    """Return the singly scattered energy, for albedo 1, that leaves beyond each radius.

    Parameters
    ----------
    radii_mfp : (n,) [MFP]
        Radii, at least 0.
    eta : float
        Relative refractive index, at least 1.
    step : float
        Step of the double-exponential rule; 0.1 gives 1e-7, 0.05 gives 1e-12.

    Returns
    -------
    (n,) array
        To be multiplied by the albedo. The value at radius 0 is the total.
    """
    half_angle, weight = _angles(eta, step)
    angle = 2.0 * half_angle
    cosine = np.cos(angle)
    # (1 + 1/mu) mu / sqrt(1 - mu^2) = (1 + mu) / sin(theta) = 1 / tan(theta/2)
    rate = 1.0 / np.tan(half_angle)
    share = fresnel_transmittance(cosine, eta) * np.sin(angle) * cosine / (1.0 + cosine)
    factor = 0.5 * normal_transmittance(eta) * weight * share
    parts = [
        np.exp(-np.outer(radii_mfp[first : first + _RADII_AT_ONCE], rate)) @ factor
        for first in range(0, len(radii_mfp), _RADII_AT_ONCE)
    ]
    return np.concatenate(parts)


def single_scattering_of_diffuse_light(eta: float) -> float:
    """Return the singly scattered share under light of equal radiance from all directions.

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


_PER_E_FOLD = 13  # rates per decade; 9 leave 1e-5, 13 leave 1e-7
_STEEPER = 30.0  # the largest rate relative to the largest wavenumber
_RIDGE = 1e-8


@dataclass(frozen=True, slots=True, eq=False)
class Mixture:
    """Rates q (N,) [1/MFP] with weights w (N,); ``misfit`` is the largest residual in Rhat."""

    rates: FloatArray
    weights: FloatArray
    misfit: float

    def beyond(self, radii_mfp: FloatArray) -> FloatArray:
        """Return the energy that leaves beyond each radius: sum of w q r K1(q r), (n,)."""
        parts = [
            _q_r_k1(np.outer(radii_mfp[first : first + _RADII_AT_ONCE], self.rates)) @ self.weights
            for first in range(0, len(radii_mfp), _RADII_AT_ONCE)
        ]
        return np.concatenate(parts)


def mixture_of(wavenumbers: FloatArray, transform: FloatArray, slowest: float) -> Mixture:
    """Fit Rhat at the wavenumbers (m,) [1/MFP] with rates from ``slowest`` up.

    Residuals are weighted by 1 + k: Rhat falls like 1/k^2, and the first annuli depend on large k.
    """
    steepest = _STEEPER * float(wavenumbers[-1])
    from scipy import optimize  # 0.2 s that the photon walk does not need

    # One rate at the end of the spectrum, the others from 1 % beyond it.
    count = math.ceil(_PER_E_FOLD * math.log(100.0 * steepest / slowest))
    rates = slowest + np.concatenate(([0.0], np.geomspace(0.01 * slowest, steepest, count)))
    terms = rates**2 / (wavenumbers[:, None] ** 2 + rates**2)
    scale = 1.0 + wavenumbers
    # Neighbouring rates are almost equal: without the ridge the active set can cycle forever (seen
    # where the solver's own error is 1e-13). It adds 1e-11 to the misfit.
    ridge = _RIDGE * np.eye(rates.size)
    rows = np.concatenate((terms * scale[:, None], ridge))
    wanted = np.append(transform * scale, np.zeros(rates.size))
    try:
        weights, _ = optimize.nnls(rows, wanted, maxiter=60 * rates.size)
    except RuntimeError as error:
        raise SimulationError(
            f"the way back from {wavenumbers.size} wavenumbers to radii did not converge "
            f"({error.args[0].rstrip('.')}): give a larger tolerance."
        ) from None
    used = weights > 0.0
    misfit = float(np.max(np.abs(terms @ weights - transform)))
    return Mixture(rates[used], weights[used], misfit)


def _q_r_k1(x: FloatArray) -> FloatArray:
    """Return x K1(x), 1 at 0."""
    from scipy import special  # 0.2 s, as above

    product: FloatArray = np.where(x > 0.0, x * special.k1(np.maximum(x, 1e-300)), 1.0)
    return product
