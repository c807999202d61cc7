"""The light that is not scattered: a beam along the normal between the interfaces."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.optics import normal_reflectance
from sssfit.simulate.stack.slabs import SlabStack


@dataclass(frozen=True, slots=True, eq=False)
class Beam:
    """Power of the beam, a share of what comes in.

    ``down`` (layers,) at the top of each layer, ``up`` (layers,) at its bottom; what it returns,
    with the first reflection, and what it passes on below.
    """

    down: FloatArray
    up: FloatArray
    reflected: float
    transmitted: float

    def absorbed(self, fading: Sequence[float]) -> tuple[float, ...]:
        """Return what each layer takes from the beam; ``fading`` is exp(-sigma_t* d)."""
        net = np.append(self.down - self.up * np.array(fading), self.transmitted)
        return tuple((-np.diff(net)).tolist())


def beam_of(stack: SlabStack, sigma_t: Sequence[float]) -> Beam:
    """Solve for the beam under extinctions (layers,) [1/mm], with all reflections of interfaces.

    b+_j = t_j b+_{j-1} e_{j-1} + r_j b-_j e_j and
    b-_j = r_{j+1} b+_j e_j + t_{j+1} b-_{j+1} e_{j+1}, with e = exp(-sigma_t* d) and
    r = ((n1 - n2) / (n1 + n2))^2.
    """
    slabs = stack.slabs
    etas = [stack.eta_above, *(each.eta for each in slabs), stack.eta_below]
    r = [normal_reflectance(a, b) for a, b in zip(etas[1:], etas[:-1], strict=True)]
    if not stack.has_bottom:
        r[-1] = 0.0
    e = [attenuation(*of) for of in zip(sigma_t, (each.thickness for each in slabs), strict=True)]
    matrix, entering = np.eye(2 * len(slabs)), np.zeros(2 * len(slabs))
    entering[0] = 1.0 - r[0]
    for j in range(len(slabs)):
        matrix[2 * j, 2 * j + 1] = -r[j] * e[j]
        matrix[2 * j + 1, 2 * j] = -r[j + 1] * e[j]
        if j > 0:
            matrix[2 * j, 2 * j - 2] = -(1.0 - r[j]) * e[j - 1]
        if j < len(slabs) - 1:
            matrix[2 * j + 1, 2 * j + 3] = -(1.0 - r[j + 1]) * e[j + 1]
    found = np.linalg.solve(matrix, entering).astype(np.float64)
    down, up = found[0::2], found[1::2]
    returned = r[0] + (1.0 - r[0]) * up[0] * e[0]
    return Beam(down, up, returned, (1.0 - r[-1]) * down[-1] * e[-1])


def attenuation(sigma_t: float, thickness: float) -> float:
    """Return exp(-sigma_t d); 0 for a layer without a bottom, even a clear one."""
    return math.exp(-sigma_t * thickness) if math.isfinite(thickness) else 0.0
