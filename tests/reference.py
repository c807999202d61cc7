"""Slow, literal oracles, written apart from the library and sharing no code with it.

- ``scalar_walk``: one photon at a time, in double precision, every collision booked as it happens.
- ``chandrasekhar_total``, ``chandrasekhar_diffuse_total``: total reflectance of an index-matched
  half space from the H function, for normal and for diffuse light; ``diffuse_light_walk`` for the
  latter under a surface, ``duntley_specular`` for what that reflects itself.
- ``single_scattering_cumulative``: photons that leave after exactly one collision.
- ``xoshiro128pp``: the generator in Python integers.
"""

import itertools
import math

import numba
import numpy as np
from scipy.integrate import quad

MAX_COLLISIONS = 1_000_000


@numba.njit(error_model="numpy", cache=True)
def scalar_walk(seed, photons, albedo, mean_free_path, eta, dr, annuli):
    """Walk photons one by one; semi-infinite, g = 0, all channels carried as weights.

    Returns sums over photons: bins (annuli + 1, C) of energy and of squared weights, the last
    beyond the grid; hits per bin; energy of photons with exactly one collision per bin; absorbed,
    unfinished (C,); roulette's squared gains (C,). Photons enter with weight 1 - specular.
    """
    np.random.seed(seed)
    channels = albedo.size
    bins = np.zeros((annuli + 1, channels))
    squares = np.zeros((annuli + 1, channels))
    hits = np.zeros((annuli + 1, channels))
    once = np.zeros((annuli + 1, channels))
    once_squares = np.zeros((annuli + 1, channels))
    absorbed = np.zeros(channels)
    unfinished = np.zeros(channels)
    roulette = np.zeros(channels)
    weight = np.empty(channels)
    specular = ((eta - 1.0) / (eta + 1.0)) ** 2
    for _ in range(photons):
        weight[:] = 1.0 - specular
        x = y = z = 0.0
        ux = uy = 0.0
        uz = 1.0
        collisions = 0
        while True:
            step = -math.log(1.0 - np.random.random())
            # Fly; reflect at the surface as often as it is met (once: the way down is free).
            if uz < 0.0 and z + step * uz < 0.0:
                to_surface = -z / uz
                x += to_surface * ux
                y += to_surface * uy
                z = 0.0
                step -= to_surface
                cos_i = -uz
                sin_t = eta * math.sqrt(max(0.0, 1.0 - cos_i * cos_i))
                if sin_t >= 1.0:
                    reflectance = 1.0
                else:
                    cos_t = math.sqrt(1.0 - sin_t * sin_t)
                    r_s = (eta * cos_i - cos_t) / (eta * cos_i + cos_t)
                    r_p = (cos_i - eta * cos_t) / (cos_i + eta * cos_t)
                    reflectance = (r_s * r_s + r_p * r_p) / 2.0
                if np.random.random() >= reflectance:
                    rho = math.sqrt(x * x + y * y)
                    for c in range(channels):
                        k = min(int(rho * mean_free_path[c] / dr), annuli)
                        bins[k, c] += weight[c]
                        squares[k, c] += weight[c] ** 2
                        hits[k, c] += 1.0
                        if collisions == 1:
                            once[k, c] += weight[c]
                            once_squares[k, c] += weight[c] ** 2
                    break
                uz = -uz
            x += step * ux
            y += step * uy
            z += step * uz
            collisions += 1
            for c in range(channels):
                absorbed[c] += weight[c] * (1.0 - albedo[c])
                weight[c] *= albedo[c]
            if collisions >= MAX_COLLISIONS:
                unfinished += weight
                break
            if weight.max() < 1e-4 * (1.0 - specular):
                if np.random.random() < 0.1:
                    roulette += (9.0 * weight) ** 2
                    weight *= 10.0
                else:
                    roulette += weight**2
                    break
            uz = 2.0 * np.random.random() - 1.0
            phi = 2.0 * math.pi * np.random.random()
            sin_theta = math.sqrt(1.0 - uz * uz)
            ux = sin_theta * math.cos(phi)
            uy = sin_theta * math.sin(phi)
    return bins, squares, hits, once, once_squares, absorbed, unfinished, roulette


def _chandrasekhar_h(albedo, nodes):
    """H on Gauss nodes (Chandrasekhar 1960, Radiative Transfer, chapter V): mu, weights, H.

    1/H(mu) = sqrt(1-a) + a/2 int_0^1 mu' H(mu') / (mu + mu') dmu', iterated.
    """
    x, w = np.polynomial.legendre.leggauss(nodes)
    mu, weights = (x + 1.0) / 2.0, w / 2.0
    root = math.sqrt(1.0 - albedo)
    h = np.ones(nodes)
    kernel = albedo / 2.0 * weights * mu / (mu[:, None] + mu[None, :])
    for _ in range(5_000):
        new = 1.0 / (root + kernel @ h)
        if np.max(np.abs(new - h)) < 1e-14:
            break
        h = (h + new) / 2.0
    return mu, weights, h


def chandrasekhar_total(albedo, nodes=200):
    """1 - H(1) sqrt(1 - albedo): normal incidence, index-matched, isotropic scattering."""
    mu, weights, h = _chandrasekhar_h(albedo, nodes)
    root = math.sqrt(1.0 - albedo)
    h_one = 1.0 / (root + albedo / 2.0 * np.sum(weights * mu * h / (1.0 + mu)))
    return 1.0 - h_one * root


def chandrasekhar_by_angle(albedo, edges_rad, nodes=200):
    """Shares of normal light that leave between exit angles: the law of diffuse reflection.

    I(mu) = a/4 F mu0 / (mu + mu0) H(mu) H(mu0) for a flux pi F mu0 (Chandrasekhar 1960, section
    33); over 2 pi mu dmu, by the trapezoidal rule with 100 steps a bin.
    """
    mu, weights, h = _chandrasekhar_h(albedo, nodes)

    def at(x):
        kernel = albedo / 2.0 * weights * mu / (x[:, None] + mu)
        return 1.0 / (math.sqrt(1.0 - albedo) + kernel @ h)

    shares = []
    for low, high in itertools.pairwise(edges_rad):
        x = np.linspace(math.cos(high), math.cos(low), 101)
        y = albedo / 2.0 * x / (1.0 + x) * at(x) * at(np.ones(1))
        shares.append(np.trapezoid(y, x))
    return np.array(shares)


def chandrasekhar_diffuse_total(albedo, nodes=200):
    """1 - 2 sqrt(1 - albedo) int_0^1 H(mu) mu dmu: the same under diffuse light from above."""
    mu, weights, h = _chandrasekhar_h(albedo, nodes)
    return 1.0 - 2.0 * math.sqrt(1.0 - albedo) * np.sum(weights * mu * h)


def duntley_specular(eta):
    """Fresnel's reflectance of diffuse light from outside (Duntley 1942, J. Opt. Soc. Am. 32)."""
    n, squared = eta, eta * eta
    return (
        0.5
        + (n - 1.0) * (3.0 * n + 1.0) / (6.0 * (n + 1.0) ** 2)
        + squared * (squared - 1.0) ** 2 / (squared + 1.0) ** 3 * math.log((n - 1.0) / (n + 1.0))
        - 2.0 * n**3 * (squared + 2.0 * n - 1.0) / ((squared + 1.0) * (n**4 - 1.0))
        + 8.0 * n**4 * (n**4 + 1.0) / ((squared + 1.0) * (n**4 - 1.0) ** 2) * math.log(n)
    )


@numba.njit(error_model="numpy", cache=True)
def diffuse_light_walk(seed, photons, albedo, eta):
    """Photons of diffuse light, one by one, all weights 1 or 0: what becomes of each.

    The directions outside are those of uniform radiance, cosine sqrt(u); surface, flights and
    absorption are drawn. Returns the numbers of photons reflected at the surface, and of those
    that entered and left again.
    """
    np.random.seed(seed)
    specular = left = 0
    for _ in range(photons):
        cos_out = math.sqrt(1.0 - np.random.random())
        cos_in = math.sqrt(1.0 - (1.0 - cos_out * cos_out) / (eta * eta))
        r_s = (cos_out - eta * cos_in) / (cos_out + eta * cos_in)
        r_p = (eta * cos_out - cos_in) / (eta * cos_out + cos_in)
        if np.random.random() < (r_s * r_s + r_p * r_p) / 2.0:
            specular += 1
            continue
        z, uz = 0.0, cos_in
        while True:
            z -= uz * math.log(1.0 - np.random.random())
            if z < 0.0:
                sin_t = eta * math.sqrt(max(0.0, 1.0 - uz * uz))
                reflectance = 1.0
                if sin_t < 1.0:
                    cos_t = math.sqrt(1.0 - sin_t * sin_t)
                    r_s = (eta * -uz - cos_t) / (eta * -uz + cos_t)
                    r_p = (-uz - eta * cos_t) / (-uz + eta * cos_t)
                    reflectance = (r_s * r_s + r_p * r_p) / 2.0
                if np.random.random() >= reflectance:
                    left += 1
                    break
                z = -z  # a mirror: what is left of the flight goes down as far
            if np.random.random() >= albedo:
                break
            uz = 2.0 * np.random.random() - 1.0
    return specular, left


def fresnel(cos_inside, eta):
    """Unpolarised reflectance from inside."""
    sin_t = eta * math.sqrt(1.0 - cos_inside**2)
    if sin_t >= 1.0:
        return 1.0
    cos_t = math.sqrt(1.0 - sin_t**2)
    r_s = (eta * cos_inside - cos_t) / (eta * cos_inside + cos_t)
    r_p = (cos_inside - eta * cos_t) / (cos_inside + eta * cos_t)
    return (r_s**2 + r_p**2) / 2.0


def single_scattering_cumulative(r, albedo, eta):
    """F1(r), r in mean free paths: energy of photons that leave within r after one collision.

    a/2 (1-R_sp) int_{mu_c}^1 (1-R_F(mu)) [1 - exp(-r mu/sqrt(1-mu^2) (1+1/mu))] / (1+1/mu) dmu
    """
    specular = ((eta - 1.0) / (eta + 1.0)) ** 2
    critical = math.sqrt(1.0 - 1.0 / eta**2)

    def integrand(t):
        # mu = mu_c + (1 - mu_c) t^2 takes the square root out of the critical angle
        mu = critical + (1.0 - critical) * t * t
        if mu <= 0.0 or mu >= 1.0:
            reach = 0.0 if mu <= 0.0 else 1.0
        else:
            reach = -math.expm1(-r * mu / math.sqrt(1.0 - mu * mu) * (1.0 + 1.0 / mu))
        slope = 2.0 * (1.0 - critical) * t
        return (1.0 - fresnel(mu, eta)) * reach * mu / (1.0 + mu) * slope

    integral, _ = quad(integrand, 0.0, 1.0, epsabs=1e-12, epsrel=1e-10, limit=500)
    return albedo / 2.0 * (1.0 - specular) * integral


def rotated_left(word, bits):
    """Rotate 32 bits, in Python integers."""
    return ((word << bits) | (word >> (32 - bits))) & 0xFFFFFFFF


def xoshiro128_step(state):
    """Next state of xoshiro128 (Blackman and Vigna 2021) in Python integers."""
    s = list(state)
    t = (s[1] << 9) & 0xFFFFFFFF
    s[2] ^= s[0]
    s[3] ^= s[1]
    s[1] ^= s[2]
    s[0] ^= s[3]
    s[2] ^= t
    s[3] = rotated_left(s[3], 11)
    return s


def xoshiro128pp(state, count):
    """First ``count`` outputs of xoshiro128++ in Python integers."""
    mask, outputs = 0xFFFFFFFF, []
    for _ in range(count):
        outputs.append((rotated_left((state[0] + state[3]) & mask, 7) + state[0]) & mask)
        state = xoshiro128_step(state)
    return outputs


def splitmix64(start, count):
    """First ``count`` outputs of splitmix64 in Python integers."""
    mask = 0xFFFFFFFFFFFFFFFF
    outputs, state = [], start
    for _ in range(count):
        state = (state + 0x9E3779B97F4A7C15) & mask
        z = state
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & mask
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & mask
        outputs.append(z ^ (z >> 31))
    return outputs


@numba.njit(error_model="numpy", cache=True)
def scalar_layered_walk(
    seed,
    photons,
    sigma_a,
    sigma_s,
    g,
    eta,
    thickness,
    specular,
    first,
    dr,
    annuli,
    max_mm=1e30,
    angles=1,
):
    """MCML photon by photon, one channel: hop, drop, spin, roulette, as in the 1995 paper.

    sigma_a, sigma_s, g, thickness (L,); eta (L + 2,) from above to below; ``first`` is the first
    layer that is not clear. Returns sums over photons: reflected and transmitted ((annuli + 1)
    angles, 3) of weight, squared weight and hits; absorbed (L,); roulette's squared gains. The bins
    of the exit angle are those of MCML, acos(uz) / da.
    """
    np.random.seed(seed)
    layers = sigma_a.size
    top = np.zeros(layers + 1)
    for k in range(layers):
        top[k + 1] = top[k] + thickness[k]
    reflected = np.zeros(((annuli + 1) * angles, 3))
    transmitted = np.zeros(((annuli + 1) * angles, 3))
    absorbed = np.zeros(layers)
    roulette = 0.0
    for _ in range(photons):
        w = 1.0 - specular
        x = y = 0.0
        z = top[first]
        ux = uy = 0.0
        uz = 1.0
        layer = first
        left = 0.0
        alive = True
        while alive:
            st = sigma_a[layer] + sigma_s[layer]
            if st > 0.0 and left == 0.0:
                left = -math.log(1.0 - np.random.random())
            if uz > 0.0:
                to_boundary = (top[layer + 1] - z) / uz
            elif uz < 0.0:
                to_boundary = (top[layer] - z) / uz
            else:
                to_boundary = max_mm
            hits = st == 0.0 or to_boundary * st <= left
            step = to_boundary if hits else left / st
            x += step * ux
            y += step * uy
            z += step * uz
            if hits:
                left = max(left - step * st, 0.0)
                n1 = eta[layer + 1]
                n2 = eta[layer + 2] if uz > 0.0 else eta[layer]
                z = top[layer + 1] if uz > 0.0 else top[layer]
                cos_i = abs(uz)
                sin_t = n1 / n2 * math.sqrt(max(0.0, 1.0 - cos_i * cos_i))
                if n1 == n2:
                    reflectance, cos_t = 0.0, cos_i
                elif sin_t >= 1.0:
                    reflectance, cos_t = 1.0, 0.0
                else:
                    cos_t = math.sqrt(1.0 - sin_t * sin_t)
                    r_s = (n1 * cos_i - n2 * cos_t) / (n1 * cos_i + n2 * cos_t)
                    r_p = (n1 * cos_t - n2 * cos_i) / (n1 * cos_t + n2 * cos_i)
                    reflectance = (r_s * r_s + r_p * r_p) / 2.0
                if np.random.random() < reflectance:
                    uz = -uz
                elif (uz > 0.0 and layer == layers - 1) or (uz < 0.0 and layer == 0):
                    k = min(int(math.sqrt(x * x + y * y) / dr), annuli)
                    exit_angle = math.acos(min(cos_t, 1.0))
                    k = k * angles + min(int(exit_angle / (0.5 * math.pi) * angles), angles - 1)
                    out = transmitted if uz > 0.0 else reflected
                    out[k, 0] += w
                    out[k, 1] += w * w
                    out[k, 2] += 1.0
                    alive = False
                else:
                    ux *= n1 / n2
                    uy *= n1 / n2
                    if uz > 0.0:
                        uz = cos_t
                        layer += 1
                    else:
                        uz = -cos_t
                        layer -= 1
                continue
            left = 0.0
            lost = w * sigma_a[layer] / st
            absorbed[layer] += lost
            w -= lost
            if w < 1e-4:
                if np.random.random() < 0.1:
                    roulette += (9.0 * w) ** 2
                    w *= 10.0
                else:
                    roulette += w * w
                    alive = False
                    continue
            gl = g[layer]
            u = np.random.random()
            if gl == 0.0:
                cos_theta = 2.0 * u - 1.0
            else:
                t = (1.0 - gl * gl) / (1.0 - gl + 2.0 * gl * u)
                cos_theta = (1.0 + gl * gl - t * t) / (2.0 * gl)
            sin_theta = math.sqrt(max(0.0, 1.0 - cos_theta * cos_theta))
            phi = 2.0 * math.pi * np.random.random()
            c, s = math.cos(phi), math.sin(phi)
            if abs(uz) > 1.0 - 1e-12:
                ux, uy, uz = sin_theta * c, sin_theta * s, cos_theta * (1.0 if uz > 0 else -1.0)
            else:
                root = math.sqrt(1.0 - uz * uz)
                vx = sin_theta * (ux * uz * c - uy * s) / root + ux * cos_theta
                vy = sin_theta * (uy * uz * c + ux * s) / root + uy * cos_theta
                uz = -sin_theta * c * root + uz * cos_theta
                ux, uy = vx, vy
    return reflected, transmitted, absorbed, roulette
