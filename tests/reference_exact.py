"""The terms of the transport equation by brute force, as physics writes them: slow, literal.

Double scattering needs no solver: sources on the axis, one flight (straight, or by way of the
surface, where it is reflected specularly), and the way out, each a quadrature over its definition.
"""

import functools
import itertools
import math
import warnings

import numpy as np
import reference
from scipy import integrate, interpolate, special


def direct_kernel(distance, k):
    """K_d = 1/2 int_kappa^inf exp(-tau d) / sqrt(tau^2 - k^2) dtau, by adaptive quadrature."""
    kappa = math.sqrt(1.0 + k * k)
    value, _ = integrate.quad(
        # tau = kappa + t^2 / (1 - t)^2
        lambda t: (
            math.exp(-distance * (t / (1 - t)) ** 2)
            / math.sqrt((kappa + (t / (1 - t)) ** 2) ** 2 - k * k)
            * 2.0
            * t
            / (1 - t) ** 3
        ),
        0.0,
        1.0,
        epsabs=1e-12,
        epsrel=1e-11,
        limit=400,
    )
    return 0.5 * math.exp(-kappa * distance) * value


def _over_directions(function, eta):
    """Integrate over the cosine, split at the critical angle."""
    critical = np.sqrt(1.0 - 1.0 / eta**2)
    ends = [0.0, critical, 1.0] if critical > 0.0 else [0.0, 1.0]
    with warnings.catch_warnings():
        # J0 near grazing angles oscillates without end under exp(-s/mu): quad doubts its 1e-10
        warnings.simplefilter("ignore", integrate.IntegrationWarning)
        parts = [
            integrate.quad(function, a, b, epsabs=1e-11, epsrel=1e-10, limit=600)[0]
            for a, b in itertools.pairwise(ends)
        ]
    return sum(parts)


def mirror_kernel(distance, k, eta):
    """K_r = 1/2 int_0^1 R_F exp(-s/mu) J0(k s tan theta) dmu/mu."""

    def integrand(mu):
        if mu <= 0.0:
            return 0.0
        tangent = math.sqrt(1.0 - mu * mu) / mu
        path = math.exp(-distance / mu) * special.j0(k * distance * tangent)
        return reference.fresnel(mu, eta) * path / mu

    return 0.5 * _over_directions(integrand, eta)


def escape(depth, k, eta):
    """E = 1/2 int_0^1 (1 - R_F) exp(-z/mu) J0(k z tan theta) dmu."""

    def integrand(mu):
        if mu <= 0.0:
            return 0.0
        tangent = math.sqrt(1.0 - mu * mu) / mu
        path = math.exp(-depth / mu) * special.j0(k * depth * tangent)
        return (1.0 - reference.fresnel(mu, eta)) * path

    return 0.5 * _over_directions(integrand, eta)


def single_scattering_of_diffuse(eta):
    """Once scattered, of diffuse light of 1, for albedo 1: 4 eta^2 int E^2 dz, E by its definition.

    Radiance 1/pi outside is eta^2 (1 - R_F)/pi inside (Snell); 2 pi of it over dmu are collisions.
    """
    value, _ = integrate.quad(
        lambda z: 4.0 * eta**2 * escape(z, 0.0, eta) ** 2, 0.0, 40.0, epsabs=1e-10, limit=200
    )
    return value


def double_scattering(k, eta, nodes=14):
    """Rhat of light scattered twice, for albedo 1: int int C0(z') [K_d + K_r] E(z) dz' dz.

    Depths by Gauss nodes on panels that double from 0.03 on, the logarithm of K_d at z = z' by
    x^4 on either side of it: good to 1e-7 (8 and 14 nodes differ by less; 6 and 8 by 3e-8).
    """
    mirrored_at = functools.cache(lambda s: mirror_kernel(s, k, eta))  # z + z' is z' + z
    edges = np.concatenate(([0.0], 0.03 * 2.0 ** np.arange(11)))
    x, w = np.polynomial.legendre.leggauss(nodes)
    x, w = 0.5 * (x + 1.0), 0.5 * w
    width = np.diff(edges)
    depths = (edges[:-1, None] + width[:, None] * x).ravel()
    weights = (width[:, None] * w).ravel()
    # K_d at many distances: exact values on a fine grid in log(distance), splined.
    log_d = np.linspace(np.log(1e-10), np.log(70.0), 700)
    spline = interpolate.CubicSpline(log_d, [direct_kernel(np.exp(each), k) for each in log_d])
    total = 0.0
    for z, weight in zip(depths, weights, strict=True):
        collisions = 0.0
        for sign, reach in ((1.0, 40.0), (-1.0, z)):
            for a, b in _stretches(reach):
                d = a + (b - a) * x**4 if a == 0.0 else a + (b - a) * x
                slope = 4.0 * x**3 if a == 0.0 else 1.0
                source = np.exp(-(z + sign * d))
                collisions += np.sum(w * (b - a) * slope * source * spline(np.log(d)))
        if eta > 1.0:
            mirrored = [mirrored_at(z + each) for each in depths]
            collisions += np.sum(weights * np.exp(-depths) * mirrored)
        total += weight * collisions * escape(z, k, eta)
    return (1.0 - ((eta - 1.0) / (eta + 1.0)) ** 2) * total


def _stretches(reach):
    """Intervals from 0 to ``reach`` that double from a hundredth on."""
    edges = [0.0]
    while edges[-1] < reach:
        edges.append(min(reach, max(0.01, 2.0 * edges[-1])))
    return list(itertools.pairwise(edges))
