"""Light in a whole stack at one wavenumber: layers put on one another from the bottom up.

All that lies below a depth acts as a floor: what comes up is L- = R L+ + s. A layer turns the floor
under it into one above it, and so does an interface (invariant embedding; Chandrasekhar 1960,
"Radiative Transfer", chapter 7). Decaying exponentials only, so that no thickness overflows.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray
from sssfit.errors import SimulationError
from sssfit.simulate.stack.azimuth import Azimuth
from sssfit.simulate.stack.modes import Modes, times
from sssfit.simulate.stack.nodes import snell_reflectance
from sssfit.simulate.stack.phase import Medium


@dataclass(frozen=True, slots=True, eq=False)
class Floor:
    """What lies below: L- = ``matrix`` L+ + ``source``."""

    matrix: FloatArray
    source: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Span:
    """A layer on its floor, by amplitudes a: L+ = down a + down_source at its top, L- with up.

    ``bottom`` gives L+ at its bottom from a; None without one.
    """

    down: FloatArray
    down_source: FloatArray
    up: FloatArray
    up_source: FloatArray
    bottom: Callable[[FloatArray], FloatArray] | None

    def floor(self) -> Floor:
        """Return the layer with all below it as a floor."""
        matrix: FloatArray = np.asarray(np.linalg.solve(self.down.T, self.up.T), np.float64).T
        return Floor(matrix, self.up_source - matrix @ self.down_source)

    def amplitudes(self, entering: FloatArray) -> FloatArray:
        """Return a from L+ at the top."""
        return np.asarray(np.linalg.solve(self.down, entering - self.down_source), np.float64)


def span_without_end(modes: Modes, down: float, up: float) -> Span:
    """Return a layer that goes on without end; beams of these powers pass through its top."""
    along = down * modes.beam_along + up * modes.beam_against
    against = down * modes.beam_against + up * modes.beam_along
    return Span(modes.along, along, modes.against, against, None)


def span_of(medium: Medium, modes: Modes, down: float, up: float, floor: Floor) -> Span:
    """Return a layer on a floor: modes a decay from the top, modes b from the bottom, b = G a + h.

    (U - R V) b = (R U - V) e a + R p+ - p- + s at the bottom, with e = exp(-lambda d).

    Raises
    ------
    SimulationError
        Modes a and b are the same to rounding.
    """
    if modes.is_rounded:
        raise SimulationError(
            f"a layer of {medium.thickness:g} mm absorbs too little beside its scattering of "
            f"{medium.slab.sigma_s:g} per mm for the exact solution; use `method = montecarlo`."
        )
    u, v, beam = modes.along, modes.against, medium.attenuation
    e = np.exp(-modes.rate * medium.thickness)
    ue, ve = times(u, e), times(v, e)
    top = (
        down * modes.beam_along + up * beam * modes.beam_against,
        down * modes.beam_against + up * beam * modes.beam_along,
    )
    bottom = (
        down * beam * modes.beam_along + up * modes.beam_against,
        down * beam * modes.beam_against + up * modes.beam_along,
    )
    driven = floor.matrix @ ue - ve
    source = floor.matrix @ bottom[0] - bottom[1] + floor.source
    solved = np.linalg.solve(u - floor.matrix @ v, np.column_stack((driven, source)))
    g, h = solved[:, :-1], solved[:, -1]

    def leaves(a: FloatArray) -> FloatArray:
        found: FloatArray = ue @ a + v @ (g @ a + h) + bottom[0]
        return found

    return Span(u + ve @ g, ve @ h + top[0], v + ue @ g, ue @ h + top[1], leaves)


def span_of_clear(medium: Medium, k: float, azimuth: Azimuth, floor: Floor) -> Span:
    """Return a layer that does not scatter, on a floor; its amplitudes are L+ at the top."""
    e = _passage(medium, k, azimuth)
    size = len(e)

    def leaves(a: FloatArray) -> FloatArray:
        found: FloatArray = e @ a
        return found

    up = e @ floor.matrix @ e
    return Span(np.eye(size), np.zeros(size), up, e @ floor.source, leaves)


def bottom_floor(medium: Medium, eta_below: float, orders: int) -> Floor:
    """Return the lowest interface, above which no light comes from below."""
    p = medium.slab.eta * medium.directions.sine
    reflected = np.tile(snell_reflectance(p, medium.slab.eta, eta_below), orders)
    return Floor(np.diag(reflected), np.zeros(reflected.size))


@dataclass(frozen=True, slots=True, eq=False)
class Interface:
    """Fresnel reflection between two layers, in variables sqrt(w) L of either.

    ``places_above``, ``places_below``: the nodes that both carry. x_below = ``scale`` t x_above for
    transmitted light, L_b = (eta_b / eta_a)^2 t L_a.
    """

    places_above: npt.NDArray[np.intp]
    places_below: npt.NDArray[np.intp]
    reflected_above: FloatArray
    reflected_below: FloatArray
    transmitted: FloatArray
    scale: FloatArray

    @classmethod
    def of(cls, above: Medium, below: Medium, orders: int) -> "Interface":
        """Return the interface between two layers; nodes of only one are totally reflected."""
        shared = min(above.n, below.n)
        etas = above.slab.eta, below.slab.eta
        p = above.directions.sine[:shared] * etas[0]
        r = snell_reflectance(p, *etas)
        weights = below.directions.weight[:shared] / above.directions.weight[:shared]
        reflected = [np.append(r, np.ones(each.n - shared)) for each in (above, below)]
        places = [
            (np.arange(orders)[:, None] * each.n + np.arange(shared)).ravel()
            for each in (above, below)
        ]
        return cls(
            places[0],
            places[1],
            np.tile(reflected[0], orders),
            np.tile(reflected[1], orders),
            np.tile(1.0 - r, orders),
            np.tile(np.sqrt(weights) * (etas[1] / etas[0]) ** 2, orders),
        )

    def floor_above(self, below: Floor) -> Floor:
        """Return the floor seen from above: L+ = t L+_a + r L-, L- = R L+ + s below."""
        here, there = self.places_below, self.places_above
        driven = below.matrix[:, here] * (self.transmitted * self.scale)
        system = np.eye(len(below.matrix)) - below.matrix * self.reflected_below
        solved = np.linalg.solve(system, np.column_stack((driven, below.source)))
        passed = (self.transmitted / self.scale)[:, None] * solved[here]
        matrix, source = np.diag(self.reflected_above), np.zeros(self.reflected_above.size)
        matrix[there[:, None], there] += passed[:, :-1]
        source[there] = passed[:, -1]
        return Floor(matrix, source)

    def entering(self, from_above: FloatArray, below: Floor) -> FloatArray:
        """Return L+ under the interface from L+ above it: (1 - r R) L+ = t L+_a + r s."""
        driven = self.reflected_below * below.source
        driven[self.places_below] += self.transmitted * self.scale * from_above[self.places_above]
        system = np.eye(len(below.matrix)) - self.reflected_below[:, None] * below.matrix
        return np.asarray(np.linalg.solve(system, driven), dtype=np.float64)


def light_at_top(span: Span, reflected: FloatArray) -> FloatArray:
    """Return the amplitudes of the first layer, L+ = r L- at its top."""
    system = span.down - reflected[:, None] * span.up
    driven = reflected * span.up_source - span.down_source
    return np.asarray(np.linalg.solve(system, driven), np.float64)


def flux_of(medium: Medium, radiance: FloatArray, share: FloatArray | float = 1.0) -> float:
    """Return 2 pi sum w mu share L of the azimuthal order 0, from variables sqrt(2 w) L."""
    return 2.0 * math.pi * float(_weights(medium, share) @ radiance[: medium.n])


def fluxes_of(medium: Medium, radiance: FloatArray, share: FloatArray) -> FloatArray:
    """Return the terms of `flux_of`, node by node."""
    found: FloatArray = 2.0 * math.pi * _weights(medium, share) * radiance[: medium.n]
    return found


def _weights(medium: Medium, share: FloatArray | float) -> FloatArray:
    return np.sqrt(0.5 * medium.directions.weight) * medium.directions.cosine * share


def _passage(medium: Medium, k: float, azimuth: Azimuth) -> FloatArray:
    """Return exp(-(sigma_a + k sin(theta) C) d / mu) node by node; C is skew, iC Hermitian."""
    orders, n, node = azimuth.orders, medium.n, np.arange(medium.n)
    length = medium.thickness / medium.directions.cosine
    turns, axes = np.linalg.eigh(1j * azimuth.streaming)
    phase = np.exp(1j * (k * length * medium.directions.sine)[:, None] * turns)
    fading = np.exp(-np.minimum(medium.sigma_t * length, 700.0))
    blocks = (axes * phase[:, None, :]) @ axes.conj().T
    found = np.zeros((orders, n, orders, n))
    found[:, node, :, node] = fading[:, None, None] * blocks.real
    return found.reshape(orders * n, orders * n)
