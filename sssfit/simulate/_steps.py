"""How many steps a photon walk takes, predicted from the coefficients: tasks are sized by it.

A step is a free path. Walks in a medium that hardly absorbs are long: a walk ends where it leaves,
or where its weight is under the roulette's threshold, after N = ln(1e4) / -ln(albedo) collisions.
With diffusion, D = 1/3 of a squared mean free path a step, a walk that begins at z from the surface
of a slab and is stopped at a rate k has

    E = (1 - cosh((L/2 - z) / s) / cosh(L/2 / s)) / k,  s = sqrt(D / k),

where L is the thickness between extrapolated surfaces, at which internal reflection lies farther
out. k = pi / (4 N) stops a half space's walks as early as a cut after N steps does. Lengths are in
reduced mean free paths; a step of those is 1 / (1 - g) real ones. Predictions are within a factor
of two of what walks take (``tests/test_sweep_steps.py``), which is enough to size tasks.
"""

import math

import numpy as np
import numpy.typing as npt

from sssfit._jit.half_space_walk import COLLISION_CAP
from sssfit.arrays import FloatArray
from sssfit.material import Material
from sssfit.optics import entering_of_diffuse
from sssfit.simulate._walks import ROULETTE_THRESHOLD, channels_with_equal_scattering
from sssfit.simulate.montecarlo import has_fast_walk

_DIFFUSION = 1.0 / 3.0
_EXTRAPOLATION = 0.71  # of a mean free path, without internal reflection
_SEEN = 20.0  # reduced mean free paths over which layers count, where less is not to be seen


def steps_per_photon(material: Material) -> float:
    """Predict the steps of all walks that one photon stands for: one for each group of channels."""
    if has_fast_walk(material):  # all channels on one path
        largest = int(np.argmax(material.layers[0].albedo))
        return _steps(material, np.array([largest]))
    return sum(_steps(material, each) for each in channels_with_equal_scattering(material))


def _steps(material: Material, members: npt.NDArray[np.int64]) -> float:
    """Predict the steps of a walk, which follows the least absorbing channel in each layer."""
    sigma_a = np.array([each.sigma_a_per_mm[members].min() for each in material.layers])
    sigma_s = np.array([each.sigma_s_per_mm[members[0]] for each in material.layers])
    forward = np.array([1.0 - each.g[members[0]] for each in material.layers])
    thickness = np.array([each.thickness_mm for each in material.layers])
    reduced = sigma_a + forward * sigma_s
    if not reduced.any():
        return float(len(reduced))
    depth = np.where(reduced > 0.0, reduced * thickness, 0.0)
    share = _shares(depth)
    stopped = float(share @ _stopping_rates(sigma_a, sigma_s, forward))
    above, below = _surfaces(material)
    steps = _mean_steps(float(depth.sum()), stopped, above, below)
    steps /= float(share @ (reduced / np.maximum(sigma_a + sigma_s, 1e-300)))
    # A thin slab is left before light is diffuse: at most so many collisions on the way through.
    real = float((np.where(reduced > 0.0, (sigma_a + sigma_s) * thickness, 0.0)).sum())
    passes = 1.0 + max(above, below) / _EXTRAPOLATION  # 2 / (1 - R)
    most = passes * real * (1.0 + 0.25 * float(depth.sum()))
    return len(reduced) - 1 + -math.expm1(-real) * (1.0 + min(steps, most))


def _shares(depth: FloatArray) -> FloatArray:
    """Return what each layer of an optical depth counts for, falling off from the top."""
    edges = np.concatenate([[0.0], np.cumsum(depth)])
    weights = -np.diff(np.exp(-edges / _SEEN))
    shares: FloatArray = weights / weights.sum()
    return shares


def _stopping_rates(sigma_a: FloatArray, sigma_s: FloatArray, forward: FloatArray) -> FloatArray:
    """Return each layer's rate k, per reduced mean free path."""
    sigma_t = np.maximum(sigma_a + sigma_s, 1e-300)
    loss = -np.log(np.maximum(sigma_s / sigma_t, 1e-300))
    collisions = np.clip(
        -math.log(ROULETTE_THRESHOLD) / np.maximum(loss, 1e-300), 1.0, COLLISION_CAP
    )
    rates: FloatArray = (
        0.25 * math.pi / collisions / np.maximum((sigma_a + forward * sigma_s) / sigma_t, 1e-300)
    )
    return rates


def _surfaces(material: Material) -> tuple[float, float]:
    """Return how far outside of the top and bottom light is extrapolated to vanish."""
    above = material.layers[0].eta / material.eta_above
    below = material.layers[-1].eta / material.eta_below
    return _extrapolated(above), _extrapolated(below)


def _extrapolated(eta: float) -> float:
    """Return .71 (1 + R) / (1 - R), where R of diffuse light inside is 1 - entering / eta^2."""
    escapes = min(entering_of_diffuse(eta) / eta**2, 1.0)
    return _EXTRAPOLATION * (2.0 - escapes) / escapes


def _mean_steps(depth: float, rate: float, above: float, below: float) -> float:
    """Return E of the module's head for an optical depth, which may be infinite."""
    length, begin = depth + above + below, min(1.0, 0.5 * depth) + above
    scale = math.sqrt(_DIFFUSION / rate)
    if length / scale > 50.0:
        stays = math.exp(-begin / scale)
    else:
        stays = math.cosh((0.5 * length - begin) / scale) / math.cosh(0.5 * length / scale)
    return (1.0 - stays) / rate
