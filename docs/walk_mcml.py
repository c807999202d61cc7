"""The walk of MCML 1.2.2, photon by photon, with its generator or another one.

Its generator is Knuth's subtractive one with lags 55 and 24, `ran3` of Press et al. 1992,
"Numerical Recipes in C": each number is the difference of two earlier ones, in single precision.

The scalar walk of tests/reference.py draws in another order, which such a generator's numbers feel.
"""

import math

import numba
import numpy as np

LARGEST, SEED = 1_000_000_000, 161_803_398
FIRST, SECOND = 55, 56  # places of the two indices, after the 55 numbers


@numba.njit
def subtractive(seed):
    """Return ran3's state for a seed below 32 768."""
    state = np.zeros(57, np.int64)
    last = (SEED - seed) % LARGEST
    state[54], other = last, 1
    for i in range(1, 55):
        at = (21 * i) % 55
        state[at - 1] = other
        other = (last - other) % LARGEST
        last = state[at - 1]
    for _ in range(4):
        for i in range(55):
            state[i] = (state[i] - state[(i + 31) % 55]) % LARGEST
    state[FIRST], state[SECOND] = 54, 30  # one before the first two
    return state


@numba.njit
def twister(seed):
    """Seed numpy's Mersenne twister, whose state here is empty."""
    np.random.seed(seed)  # noqa: NPY002 - what numba has
    return np.zeros(0, np.int64)


@numba.njit
def drawn(state):
    """Return ran3's next number, or the twister's."""
    if state.size == 0:
        return np.random.random()  # noqa: NPY002
    for place in (FIRST, SECOND):
        state[place] = (state[place] + 1) % 55
    first, second = state[FIRST], state[SECOND]
    state[first] = (state[first] - state[second]) % LARGEST
    return float(np.float32(state[first] * 1e-9))


@numba.njit
def walk(state, photons, sigma_a, sigma_s, g, eta, thickness):
    """Return diffuse reflectance and its standard error, the specular part taken off.

    sigma_a, sigma_s, g, thickness (L,) of layers that scatter; eta (L + 2,) from above to below.
    Numbers are drawn in MCML's order: step, side at a boundary, two for a new direction, roulette.
    """
    top = np.append(0.0, np.cumsum(thickness))
    weight = 1.0 - ((eta[0] - eta[1]) / (eta[0] + eta[1])) ** 2
    total = squares = 0.0
    for _ in range(photons):
        out = _photon(state, weight, sigma_a, sigma_s, g, eta, top)
        total += out
        squares += out * out
    mean = total / photons
    return mean, math.sqrt((squares / photons - mean * mean) / photons)


@numba.njit
def _photon(state, w, sigma_a, sigma_s, g, eta, top):
    """Return the weight that one photon takes out at the top."""
    layer, z, left = 0, 0.0, 0.0
    u = np.array([0.0, 0.0, 1.0])
    while True:
        st = sigma_a[layer] + sigma_s[layer]
        while left <= 0.0:
            left = -math.log(max(drawn(state), 1e-300))
        edge = top[layer + 1] if u[2] > 0.0 else top[layer]
        far = (edge - z) / u[2] if u[2] != 0.0 else math.inf
        if far * st <= left:
            left, z = left - far * st, edge
            beyond = layer + 2 if u[2] > 0.0 else layer
            is_through = _crosses(state, u, eta[layer + 1], eta[beyond])
            if is_through and (beyond == 0 or beyond == eta.size - 1):
                return w if beyond == 0 else 0.0
            if is_through:
                layer = beyond - 1
        else:
            z, left = z + left / st * u[2], 0.0
            w *= sigma_s[layer] / st
            _turn(state, u, g[layer])
        if w < 1e-4:
            w = 10.0 * w if drawn(state) < 0.1 else 0.0
            if w == 0.0:
                return 0.0


@numba.njit
def _crosses(state, u, here, there):
    """Reflect a direction, or refract it and return true."""
    cosine = abs(u[2])
    sine = here / there * math.sqrt(max(0.0, 1.0 - cosine * cosine))
    reflected, after = 1.0, 0.0
    if sine < 1.0:
        after = math.sqrt(1.0 - sine * sine)
        s = (here * cosine - there * after) / (here * cosine + there * after)
        p = (here * after - there * cosine) / (here * after + there * cosine)
        reflected = 0.5 * (s * s + p * p)
    if drawn(state) <= reflected:
        u[2] = -u[2]
        return False
    u[0] *= here / there
    u[1] *= here / there
    u[2] = after if u[2] > 0.0 else -after
    return True


@numba.njit
def _turn(state, u, g):
    """Turn a direction by an angle of Henyey and Greenstein's function."""
    if g == 0.0:
        cosine = 2.0 * drawn(state) - 1.0
    else:
        root = (1.0 - g * g) / (1.0 - g + 2.0 * g * drawn(state))
        cosine = min(1.0, max(-1.0, (1.0 + g * g - root * root) / (2.0 * g)))
    sine = math.sqrt(1.0 - cosine * cosine)
    psi = 2.0 * math.pi * drawn(state)
    a, b = sine * math.cos(psi), sine * math.sin(psi)
    x, y, z = u
    if abs(z) > 1.0 - 1e-12:
        u[0], u[1], u[2] = a, b, cosine if z > 0.0 else -cosine
    else:
        flat = math.sqrt(1.0 - z * z)
        u[0] = (x * z * a - y * b) / flat + x * cosine
        u[1] = (y * z * a + x * b) / flat + y * cosine
        u[2] = -a * flat + z * cosine
