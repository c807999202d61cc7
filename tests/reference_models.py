"""Slow, literal oracles for the diffusion models; they share no code with the library.

Media are given as sigma_a, the reduced sigma_s', A at the surfaces and a thickness; energies are
shares of the light that entered (no factor 1 - R_sp).

- ``dipole_density``, ``slab_density``: R_d(r) and T(r), image by image.
- ``disk_energy``: a density's integral over a disk by quadrature.
- ``two_layers_by_convolution``: layers added in the plane, pixel by pixel, not in its frequencies.
- ``fresnel_moment``: moments of Fresnel's reflectance by adaptive quadrature.
"""

import math

import numpy as np
from reference import fresnel
from scipy.fft import irfft2, next_fast_len, rfft2
from scipy.integrate import quad


def polynomial_mismatch(eta):
    """A of Jensen et al. 2001."""
    reflected = -1.440 / eta**2 + 0.710 / eta + 0.668 + 0.0636 * eta
    return (1 + reflected) / (1 - reflected)


def fresnel_moment(eta, power):
    """int_0^1 R_F(mu) mu^power dmu."""
    critical = math.sqrt(max(0.0, 1 - 1 / eta**2))
    total = critical ** (power + 1) / (power + 1)

    def slope(t):  # mu = mu_c + (1 - mu_c) t^2
        mu = critical + (1 - critical) * t * t
        return fresnel(mu, eta) * mu**power * 2 * (1 - critical) * t

    return total + quad(slope, 0, 1, epsabs=1e-13, epsrel=1e-12, limit=500)[0]


def source(z, r, sigma_tr):
    """Flux through the plane at distance z from a source, times 4 pi."""
    d = np.hypot(r, z)
    return z * (1 + sigma_tr * d) * np.exp(-sigma_tr * d) / d**3


def dipole_density(r, sigma_a, sigma_s, a, d_mm=None):
    """R_d(r): the source at z_r and its negative at z_v above the surface."""
    sigma_t = sigma_a + sigma_s
    d_mm = 1 / (3 * sigma_t) if d_mm is None else d_mm
    sigma_tr = math.sqrt(sigma_a / d_mm)
    z_r = 1 / sigma_t
    z_v = z_r + 4 * a * d_mm
    sources = source(z_r, r, sigma_tr) + source(z_v, r, sigma_tr)
    return sigma_s / sigma_t / (4 * math.pi) * sources


def slab_density(r, sigma_a, sigma_s, a_0, a_d, thickness, images):
    """R(r) and T(r) of Donner and Jensen 2005, eq. 8 to 11, images from -n to n."""
    sigma_t = sigma_a + sigma_s
    d_mm, length = 1 / (3 * sigma_t), 1 / sigma_t
    sigma_tr = math.sqrt(sigma_a / d_mm)
    z_0, z_d = 2 * a_0 * d_mm, 2 * a_d * d_mm
    reflected = transmitted = 0.0
    for i in range(-images, images + 1):
        z_r = 2 * i * (thickness + z_0 + z_d) + length
        z_v = 2 * i * (thickness + z_0 + z_d) - length - 2 * z_0
        reflected = reflected + source(z_r, r, sigma_tr) - source(z_v, r, sigma_tr)
        transmitted = transmitted + source(thickness - z_r, r, sigma_tr)
        transmitted = transmitted - source(thickness - z_v, r, sigma_tr)
    scale = sigma_s / sigma_t / (4 * math.pi)
    return scale * reflected, scale * transmitted


def disk_energy(density, r, scale=1.0):
    """Energy of a density within r, by quadrature, cut where the length ``scale`` tells."""
    cuts = [0.0, *(scale * each for each in (0.3, 1, 3, 10, 30) if scale * each < r), r]
    return sum(
        quad(lambda t: 2 * math.pi * t * density(t), a, b, epsabs=1e-14, epsrel=1e-12)[0]
        for a, b in zip(cuts, cuts[1:])  # noqa: B905, RUF007 (one shorter on purpose)
    )


def two_layers_by_convolution(top, bottom, pitch, half):
    """R and T in the plane (2 half + 1 square) [1/mm^2] of two slabs without a step between.

    R1 + T1 * R2 * T1' + T1 * R2 * R1' * R2 * T1' + ..., * a convolution; T likewise. A layer is
    (sigma_a, sigma_s', A outside, thickness), and A = 1 where the two meet.
    """
    x = pitch * np.arange(half + 1)
    r = np.hypot(x[:, None], x)
    size = (next_fast_len(4 * half + 1, real=True),) * 2

    def density(*layer):
        """Of a quarter of the plane, and its mirror images."""
        quarters = slab_density(r, *layer, 10)  # exp(-50) of the light comes from the next
        return [np.pad(each, ((half, 0), (half, 0)), mode="reflect") for each in quarters]

    r_1, t_1 = density(top[0], top[1], top[2], 1.0, top[3])
    r_1_up, t_1_up = density(top[0], top[1], 1.0, top[2], top[3])
    r_2, t_2 = density(bottom[0], bottom[1], 1.0, bottom[2], bottom[3])

    def after(one, other):
        """A convolution, of the second by its transform."""
        both = irfft2(rfft2(one, size) * other, size)
        return pitch**2 * both[half : 3 * half + 1, half : 3 * half + 1]

    by_t_1_up, by_r_1_up, by_r_2, by_t_2 = (
        rfft2(each, size) for each in (t_1_up, r_1_up, r_2, t_2)
    )
    down = t_1
    reflected, transmitted = r_1, 0.0
    for _ in range(15):  # each time less than a third is left
        transmitted = transmitted + after(down, by_t_2)
        up = after(down, by_r_2)
        reflected = reflected + after(up, by_t_1_up)
        down = after(up, by_r_1_up)
    return reflected, transmitted
