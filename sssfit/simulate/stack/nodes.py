"""Polar directions that all layers share, through Snell's invariant p = eta sin(theta).

Panels lie between the distinct refractive indices, and a layer carries the panels up to its own
index. Fresnel reflection and Snell's law then hold node by node, flux is conserved, and the square
root at the critical angle is the end of a panel.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.optics import gauss_legendre

_FEWEST = 4  # nodes of a panel
_GRAZING = 1e-300  # square of a cosine


@dataclass(frozen=True, slots=True, eq=False)
class Directions:
    """The nodes of one medium, (n,): cosines and sines to the normal, and weights of dmu."""

    cosine: FloatArray
    sine: FloatArray
    weight: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Nodes:
    """Polar nodes of a stack, ascending in p, (n,).

    ``flux`` is eta^2 mu dmu, the same in every medium; ``lightest`` the least index that carries
    the node.
    """

    invariant: FloatArray
    flux: FloatArray
    lightest: FloatArray

    @classmethod
    def of(cls, indices: Sequence[float], count: int) -> "Nodes":
        """Place about ``count`` nodes, shared out by the range of theta in the densest medium."""
        densest, low, panels = max(indices), 0.0, []
        for number, eta in enumerate(indices):
            span = math.asin(eta / densest) - math.asin(low / densest)
            share = max(_FEWEST, round(count * span / (0.5 * math.pi)))
            panels.append(_panel(eta, low, share, is_first=number == 0))
            low = eta
        return cls(*(np.concatenate(each) for each in zip(*panels, strict=True)))

    def count_in(self, eta: float) -> int:
        """Return how many nodes a medium of this index carries; they are the first ones."""
        return int(np.sum(self.lightest <= eta + 1e-9))

    def directions(self, eta: float) -> Directions:
        """Return the nodes of a medium: mu = sqrt(1 - p^2 / eta^2)."""
        n = self.count_in(eta)
        sine = self.invariant[:n] / eta
        cosine = np.sqrt(np.maximum((1.0 - sine) * (1.0 + sine), _GRAZING))
        return Directions(cosine, sine, self.flux[:n] / (eta**2 * cosine))


def _panel(
    eta: float, low: float, count: int, *, is_first: bool
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return p, eta^2 mu dmu and eta of the nodes between two indices.

    Gauss's rule in mu of the lighter medium; in the first panel, mu = sin(pi t / 2) with Gauss's
    rule in t gathers nodes about the normal, along which the beam comes in.
    """
    t, weight = gauss_legendre(count)
    if is_first:
        weight = weight * 0.5 * math.pi * np.cos(0.5 * math.pi * t)
        t = np.sin(0.5 * math.pi * t)
    widest = math.sqrt(1.0 - (low / eta) ** 2)
    cosine, weight = widest * t[::-1], widest * weight[::-1]
    invariant = eta * np.sqrt((1.0 - cosine) * (1.0 + cosine))
    return invariant, weight * cosine * eta**2, np.full(count, eta)


def snell_reflectance(p: FloatArray, eta_from: float, eta_to: float) -> FloatArray:
    """Return Fresnel's R for unpolarised light with invariants p; 1 for total reflection."""
    reflected = np.ones_like(p)
    passes = p < min(eta_from, eta_to)
    if abs(eta_from - eta_to) < 1e-12:
        return np.where(passes, 0.0, 1.0)
    a, b = (np.sqrt(1.0 - (p[passes] / eta) ** 2) for eta in (eta_from, eta_to))
    s = (eta_from * a - eta_to * b) / (eta_from * a + eta_to * b)
    parallel = (eta_to * a - eta_from * b) / (eta_to * a + eta_from * b)
    reflected[passes] = 0.5 * (s**2 + parallel**2)
    return reflected
