"""Light that is scattered once and leaves without a reflection on its way out.

It is taken out of the transforms in the same discrete directions, and put back in closed form as an
integral over directions: this removes the delta-like part of R_d(r) near the beam. The peak of the
phase function that delta-M leaves in the beam is missing from both.
"""

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.optics import gauss_legendre
from sssfit.simulate.stack.assembly import Assembly
from sssfit.simulate.stack.azimuth import Azimuth
from sssfit.simulate.stack.nodes import snell_reflectance
from sssfit.simulate.stack.phase import Medium, henyey_greenstein

_SMALL = 1e-9  # optical depth below which (1 - exp(-y d)) / y is d
_PANEL_ENDS = np.geomspace(1e-5, 0.5, 28)  # of mu, graded towards 0 and likewise towards 1
_NODES = 12  # of a panel


def single_transform(
    assembly: Assembly, k: float, azimuth: Azimuth, last: int | None = None
) -> float:
    """Return the part of R(k) in discrete directions; ``last`` as in `reflected_at`.

    2 pi sum_i w_i t_i sum_j w_j Re [b+ Q- I(alpha + sigma) + b- Q+ e^{-sigma d} I(alpha - sigma)]
    e^{-sum alpha d} with alpha = (sigma + i k s cos phi_j) / mu and I(x) = (1 - e^{-x d}) / x.
    """
    size = assembly.nodes.invariant.size
    lost, total = np.zeros((size, azimuth.cosine.size), complex), 0.0
    passed = np.zeros(size)
    passed[: assembly.media[0].n] = 1.0 - assembly.reflected_at_top
    for j, medium in enumerate(assembly.media[: None if last is None else last + 1]):
        if j > 0:
            passed *= _passed(assembly, j)
        n, thickness = medium.n, math.inf if j == last else medium.thickness
        sine, cosine = medium.directions.sine[:, None], medium.directions.cosine[:, None]
        alpha = (medium.sigma_t + 1j * k * sine * azimuth.cosine) / cosine
        if medium.slab.scatters:
            down, up = float(assembly.beam.down[j]), float(assembly.beam.up[j])
            back = _integral(alpha + medium.sigma_t, thickness)
            once = down * medium.backward[:, None] * back
            up *= medium.attenuation
            if up > 0.0:
                coming = _integral(alpha - medium.sigma_t, thickness)
                once = once + up * medium.forward[:, None] * coming
            leaving = (once * np.exp(-lost[:n])).real @ azimuth.weight
            total += 2.0 * math.pi * float((medium.directions.weight * passed[:n]) @ leaving)
        if math.isfinite(thickness):
            lost[:n] += alpha * thickness
    return total


def single_cumulative(assembly: Assembly, radii: FloatArray) -> FloatArray:
    """Return the light that leaves above within each radius [mm], in closed form (n,).

    2 pi int dmu t e^{-sum sigma d / mu} {b+ sigma_s p(-mu) (1 - e^{-(sigma/mu + sigma) z}) /
    (sigma/mu + sigma) + b- e^{-sigma d} Q+ (1 - e^{-(sigma/mu - sigma) z}) / (sigma/mu - sigma)},
    z = (r - sum d tan(theta)) / tan(theta) between 0 and d.
    """
    found = np.zeros(radii.size)
    for j, medium in enumerate(assembly.media):
        if medium.slab.scatters:
            found += _layers_part(assembly, j, medium, radii)
    return found


def _layers_part(assembly: Assembly, j: int, medium: Medium, radii: FloatArray) -> FloatArray:
    """Return the part of one layer's scattering, (n,)."""
    path = [assembly.eta_above, *(each.slab.eta for each in assembly.media[: j + 1])]
    p, flux = _directions(min(path))
    sine = p / medium.slab.eta
    cosine = np.sqrt((1.0 - sine) * (1.0 + sine))
    weight = 2.0 * math.pi * flux / (medium.slab.eta**2 * cosine)
    for above, below in pairwise(path):
        weight = weight * (1.0 - snell_reflectance(p, below, above))
    aside = np.zeros(p.size)
    for each in assembly.media[:j]:
        own = p / each.slab.eta
        own_cosine = np.sqrt((1.0 - own) * (1.0 + own))
        aside += each.thickness * own / own_cosine
        weight = weight * np.exp(-each.thickness * each.sigma_t / own_cosine)
    depth = np.clip((radii[:, None] - aside) * cosine / sine, 0.0, medium.thickness)
    return _emitted(assembly, j, medium, cosine, depth) @ weight


def _emitted(
    assembly: Assembly, j: int, medium: Medium, cosine: FloatArray, depth: FloatArray
) -> FloatArray:
    """Return what each direction gets from the part of a layer down to a depth below its top."""
    sigma_t = medium.sigma_t
    down, up = float(assembly.beam.down[j]), float(assembly.beam.up[j]) * medium.attenuation
    back = medium.slab.sigma_s * henyey_greenstein(-cosine, medium.slab.g)
    found: FloatArray = down * back * _integral(sigma_t / cosine + sigma_t, depth)
    if up > 0.0:
        found = found + up * medium.ahead(cosine) * _integral(sigma_t / cosine - sigma_t, depth)
    return found


def _integral(rate: Any, depth: FloatArray | float) -> Any:
    """Return int_0^d e^{-x z} dz = (1 - e^{-x d}) / x; real or complex."""
    if isinstance(depth, float) and math.isinf(depth):
        return 1.0 / rate
    is_small = np.abs(rate * depth) < _SMALL
    divisor = np.where(rate == 0.0, 1.0, rate)
    return np.where(is_small, depth, -np.expm1(-rate * depth) / divisor)


def _directions(eta: float) -> tuple[FloatArray, FloatArray]:
    """Return p and eta^2 mu dmu of directions in a medium, on panels graded to both ends of mu."""
    ends = np.concatenate([[0.0], _PANEL_ENDS, 1.0 - _PANEL_ENDS[-2::-1], [1.0]])
    pieces = list(_panels(ends))
    cosine, weight = (np.concatenate(each) for each in zip(*pieces, strict=True))
    return eta * np.sqrt((1.0 - cosine) * (1.0 + cosine)), eta**2 * cosine * weight


def _panels(ends: FloatArray) -> Iterator[tuple[FloatArray, FloatArray]]:
    for a, b in pairwise(ends.tolist()):
        yield gauss_legendre(_NODES, a, b)


def _passed(assembly: Assembly, j: int) -> FloatArray:
    """Return 1 - R_F of all nodes between layers j - 1 and j; 0 for nodes of only one of them."""
    above, below = assembly.media[j - 1], assembly.media[j]
    found = np.zeros(assembly.nodes.invariant.size)
    shared = min(above.n, below.n)
    p = assembly.nodes.invariant[:shared]
    found[:shared] = 1.0 - snell_reflectance(p, below.slab.eta, above.slab.eta)
    return found
