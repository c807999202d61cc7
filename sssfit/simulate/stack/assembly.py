"""A stack in discrete directions, and its transforms at one wavenumber.

R(k) and T(k) are the two-dimensional Fourier transforms of what leaves above and below around the
beam, without the beam itself. Deep layers that no light of a large wavenumber comes back from are
left out: light at depth z holds exp(-k z).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.simulate.stack import embedding
from sssfit.simulate.stack.azimuth import FEWEST, Azimuth
from sssfit.simulate.stack.beam import Beam, beam_of
from sssfit.simulate.stack.embedding import Floor, Interface, Span, flux_of, fluxes_of
from sssfit.simulate.stack.modes import Modes
from sssfit.simulate.stack.nodes import Nodes, snell_reflectance
from sssfit.simulate.stack.phase import Medium, medium_of
from sssfit.simulate.stack.slabs import SlabStack

ModesOf = Callable[[Medium], Modes]


@dataclass(frozen=True)
class Assembly:
    """A stack in discrete directions.

    ``media`` from the top down, their ``beam``, the indices around, and the ``nodes`` of all.
    """

    media: tuple[Medium, ...]
    beam: Beam
    eta_above: float
    eta_below: float
    nodes: Nodes

    @classmethod
    def of(cls, stack: SlabStack, count: int, azimuths: int = FEWEST) -> "Assembly":
        """Discretise a stack with about ``count`` nodes on either side, and those in azimuth."""
        nodes = Nodes.of(stack.indices, count)
        made = {
            each: medium_of(each, nodes, 2 * azimuths, is_seen_through=stack.is_seen_through)
            for each in set(stack.slabs)
        }
        media = tuple(made[each] for each in stack.slabs)
        beam = beam_of(stack, [each.sigma_t for each in media])
        return cls(media, beam, stack.eta_above, stack.eta_below, nodes)

    @cached_property
    def mirrored(self) -> "Assembly":
        """The stack upside down, with the same light in it: T of this one is its R."""
        beam = replace(self.beam, down=self.beam.up[::-1], up=self.beam.down[::-1])
        return Assembly(self.media[::-1], beam, self.eta_below, self.eta_above, self.nodes)

    @cached_property
    def reflected_at_top(self) -> FloatArray:
        """Fresnel's R of the first layer's nodes at the upper surface (n,)."""
        return _reflected_out(self.media[0], self.eta_above)

    @cached_property
    def reflected_at_bottom(self) -> FloatArray:
        """Fresnel's R of the last layer's nodes at the lower surface (n,)."""
        return _reflected_out(self.media[-1], self.eta_below)

    @property
    def has_bottom(self) -> bool:
        """Whether light can leave below."""
        return math.isfinite(self.media[-1].thickness)

    @cached_property
    def least_sigma_t(self) -> float:
        """The least extinction of the layers that scatter [1/mm]."""
        return min(each.sigma_t for each in self.media if each.slab.scatters)

    def last_seen(self, k: float, depth: float) -> int | None:
        """Return the layer in which k z passes ``depth``; None if all layers count."""
        z = 0.0
        for j, medium in enumerate(self.media):
            z += medium.thickness
            if math.isinf(z):
                return None if j == len(self.media) - 1 else j
            if k * z > depth:
                return j
        return None


@dataclass(frozen=True, slots=True, eq=False)
class Transforms:
    """Diffuse light at one wavenumber: R above, T below, and what each layer absorbs at k = 0."""

    reflected: float
    transmitted: float
    absorbed: tuple[float, ...]

    def times(self, factor: float) -> "Transforms":
        """Return a multiple."""
        absorbed = tuple(factor * each for each in self.absorbed)
        return Transforms(factor * self.reflected, factor * self.transmitted, absorbed)

    def plus(self, other: "Transforms") -> "Transforms":
        """Return a sum."""
        absorbed = tuple(a + b for a, b in zip(self.absorbed, other.absorbed, strict=True))
        both = self.reflected + other.reflected, self.transmitted + other.transmitted
        return Transforms(*both, absorbed)


def reflected_at(
    assembly: Assembly, k: float, azimuth: Azimuth, modes: ModesOf, last: int | None = None
) -> float:
    """Return R(k); layer ``last`` goes on without end, and those below it are left out."""
    rising = _rising(assembly, k, azimuth, modes, last)
    return flux_of(assembly.media[0], rising, 1.0 - assembly.reflected_at_top)


def leaving_by_node(assembly: Assembly, k: float, azimuth: Azimuth, modes: ModesOf) -> FloatArray:
    """Return the parts of R(k) that leave in the directions of the first layer's nodes (n,)."""
    rising = _rising(assembly, k, azimuth, modes, None)
    return fluxes_of(assembly.media[0], rising, 1.0 - assembly.reflected_at_top)


def _rising(
    assembly: Assembly, k: float, azimuth: Azimuth, modes: ModesOf, last: int | None
) -> FloatArray:
    """Return L- under the upper surface."""
    first = _spans(assembly, k, azimuth, modes, last)[0][0]
    reflected = np.tile(assembly.reflected_at_top, azimuth.orders)
    a = embedding.light_at_top(first, reflected)
    rising: FloatArray = first.up @ a + first.up_source
    return rising


def transforms_at(assembly: Assembly, k: float, azimuth: Azimuth, modes: ModesOf) -> Transforms:
    """Return R(k), T(k) and the absorbed power, which is meant for k = 0."""
    spans, floors = _spans(assembly, k, azimuth, modes, None)
    reflected = np.tile(assembly.reflected_at_top, azimuth.orders)
    a, net, falling, top = embedding.light_at_top(spans[0], reflected), [], None, 0.0
    for j, (medium, span) in enumerate(zip(assembly.media, spans, strict=True)):
        if falling is not None:
            entering = _entering(assembly, j, falling, floors[j], azimuth.orders)
            a = span.amplitudes(entering)
        rising = span.up @ a + span.up_source
        if j == 0:
            top = flux_of(medium, rising, 1.0 - assembly.reflected_at_top)
        net.append(
            flux_of(medium, span.down @ a + span.down_source - rising)
            + float(assembly.beam.down[j] - assembly.beam.up[j] * medium.attenuation)
        )
        falling = span.bottom(a) if span.bottom is not None else None
    through = 0.0
    if falling is not None:
        through = flux_of(assembly.media[-1], falling, 1.0 - assembly.reflected_at_bottom)
    net.append(through + assembly.beam.transmitted if assembly.has_bottom else 0.0)
    return Transforms(top, through, tuple((-np.diff(net)).tolist()))


def _entering(
    assembly: Assembly, j: int, falling: FloatArray, floor: Floor, orders: int
) -> FloatArray:
    """Return L+ at the top of layer j from L+ at the bottom of the layer above it."""
    above, below = assembly.media[j - 1], assembly.media[j]
    if above.slab.eta == below.slab.eta:
        return falling
    return Interface.of(above, below, orders).entering(falling, floor)


def _spans(
    assembly: Assembly, k: float, azimuth: Azimuth, modes: ModesOf, last: int | None
) -> tuple[list[Span], list[Floor]]:
    """Return each layer on what is below it, and the floors they make, from the top down."""
    media, beam = assembly.media, assembly.beam
    count = len(media) if last is None else last + 1
    spans: list[Span] = []
    floors: list[Floor] = []
    for j in range(count - 1, -1, -1):
        medium, down, up = media[j], float(beam.down[j]), float(beam.up[j])
        if j == last or math.isinf(medium.thickness):
            span = _endless(medium, down, up, azimuth, modes)
        else:
            floor = _floor_under(assembly, j, floors, azimuth.orders)
            if medium.slab.scatters:
                span = embedding.span_of(medium, modes(medium), down, up, floor)
            else:
                span = embedding.span_of_clear(medium, k, azimuth, floor)
        spans.insert(0, span)
        if j > 0:
            floors.insert(0, span.floor())
    return spans, [Floor(np.zeros((0, 0)), np.zeros(0)), *floors]


def _endless(medium: Medium, down: float, up: float, azimuth: Azimuth, modes: ModesOf) -> Span:
    """Return a layer without end, which absorbs all light if it does not scatter."""
    if medium.slab.scatters:
        return embedding.span_without_end(modes(medium), down, up * medium.attenuation)
    size = azimuth.orders * medium.n
    none = np.zeros((size, size))
    return Span(np.eye(size), np.zeros(size), none, np.zeros(size), None)


def _floor_under(assembly: Assembly, j: int, floors: list[Floor], orders: int) -> Floor:
    """Return what lies under layer j, seen from inside it; ``floors[0]`` is the layer below."""
    medium = assembly.media[j]
    if not floors:
        return embedding.bottom_floor(medium, assembly.eta_below, orders)
    below = assembly.media[j + 1]
    if medium.slab.eta == below.slab.eta:
        return floors[0]
    return Interface.of(medium, below, orders).floor_above(floors[0])


def _reflected_out(medium: Medium, eta: float) -> FloatArray:
    p = medium.slab.eta * medium.directions.sine
    return snell_reflectance(p, medium.slab.eta, eta)
