"""Transforms of several stacks at one wavenumber, with the modes of layers that they share."""

import functools
import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.simulate.stack.assembly import Assembly, Transforms, reflected_at, transforms_at
from sssfit.simulate.stack.azimuth import FEWEST, Azimuth, azimuth_of
from sssfit.simulate.stack.gaps import Gap, resolved
from sssfit.simulate.stack.modes import Modes, modes_of
from sssfit.simulate.stack.phase import Medium
from sssfit.simulate.stack.single import single_transform
from sssfit.simulate.stack.slabs import Slab, SlabStack

_DEEP = 14.0  # k z from which a layer goes on without end: exp(-14) is 8e-7
_SEEN = 1e-3  # share of the light in a beam that needs the forward peak's greater depth
_STEEPEST = 1e-3  # least 1 - g^2, so that g near 1 asks for no infinite depth
_NEXT_TO_ZERO = 1e-2  # of the least wavenumber, in place of 0 where 0 is singular
# A layer that ends and hardly absorbs carries light to what is below it by the difference of two
# modes, of rates +-r with r^2 = k^2 at sigma_a = 0. That is known to 3e-7 of the light where r is
# 1e-3 of the extinction, to 3e-6 at 3e-4, and lost at 1e-5: so R(0) is extrapolated from there.
_HARDLY = 3e-4
_KNOWN = 1e-3
# Of the wavenumber that it is extrapolated from, the decay of a layer without end, or of one much
# thicker than its paths are long, below which R(k) is not a + b k^2: there it has a term in that
# layer's own rate, sqrt(k^2 + decay^2), too.
_FAST = 39.0
_SMALLER = 0.1  # with clear layers, of whose R(k) the third term is k^2 log k


@dataclass(frozen=True)
class Family:
    """Stacks with the same nodes, some of whose layers may be the same."""

    stacks: tuple[SlabStack, ...]

    @cached_property
    def longest(self) -> float:
        """The longest reduced mean free path [mm]."""
        return max(1.0 / each.reduced_sigma_t for each in self._scattering)

    @cached_property
    def least_wavenumber(self) -> float:
        """The first wavenumber above 0 [1/mm]: a 20th of the slowest decay, within limits."""
        thickest = max(sum(slab.thickness for slab in each.slabs) for each in self.stacks)
        return self._first(max(min(self._decays), 1.0 / thickest))

    def _first(self, decay: float) -> float:
        return max(1e-4 / self.longest, min(0.03 / self.longest, decay / 20.0))

    @cached_property
    def _decays(self) -> list[float]:
        """Rates at which light fades sideways; where nothing absorbs, through a layer's ends."""
        ends = [[each.thickness for each in stack.slabs] for stack in self.stacks]
        deepest = max(sum(filter(math.isfinite, each)) for each in ends)
        return [
            max(each.diffuse_rate, 1.0 / deepest) if _hardly_absorbs(each) else each.diffuse_rate
            for each in self._scattering
        ]

    @cached_property
    def near_zero(self) -> tuple[tuple[float, float], ...]:
        """Weights and wavenumbers of what stands for R(0)."""
        pairs = list(zip(self._scattering, self._decays, strict=True))
        lossless = [(slab.sigma_t, decay) for slab, decay in pairs if _hardly_absorbs(slab)]
        if not lossless:
            return ((1.0, _NEXT_TO_ZERO * self.least_wavenumber if self.is_singular else 0.0),)
        extinctions, decays = zip(*lossless, strict=True)
        first = self._first(min(decays)) * (_SMALLER if self.has_clear_layers else 1.0)
        k = min(0.5 * first, _KNOWN * max(extinctions))
        slowest = min(
            rate for slab, rate in pairs if _hardly_absorbs(slab) or math.isinf(slab.thickness)
        )
        return tuple(zip(_weights(slowest / k), (k, 2.0 * k, 4.0 * k), strict=False))

    @property
    def scatters_back(self) -> bool:
        """Whether any layer scatters light back rather than ahead."""
        return any(slab.g < 0.0 for slab in self._scattering)

    @cached_property
    def is_singular(self) -> bool:
        """Whether k = 0 is singular: a layer that hardly absorbs, or a clear one."""
        slowest = min(each.diffuse_rate for each in self._scattering)
        return slowest < self.least_wavenumber or self.has_clear_layers

    @property
    def has_clear_layers(self) -> bool:
        """Whether light passes any layer without loss."""
        return any(slab.is_clear for each in self.stacks for slab in each.slabs)

    @property
    def _scattering(self) -> list[Slab]:
        return [slab for each in self.stacks for slab in each.scattering]


@dataclass(frozen=True)
class Sampler:
    """A family in ``count`` discrete directions on either side, ``azimuths`` of them a quarter."""

    family: Family
    count: int
    azimuths: int = FEWEST

    @cached_property
    def assemblies(self) -> tuple[Assembly, ...]:
        """The stacks in discrete directions."""
        return tuple(Assembly.of(each, self.count, self.azimuths) for each in self.family.stacks)

    @cached_property
    def most_sigma_t(self) -> float:
        """The largest extinction with delta-M scaling [1/mm]."""
        return max(each.sigma_t for assembly in self.assemblies for each in assembly.media)

    def azimuth(self, k: float) -> Azimuth:
        """Return the rule in phi that all stacks share."""
        return azimuth_of(k, min(each.least_sigma_t for each in self.assemblies), self.azimuths)

    def at_zero(self) -> list[Transforms]:
        """Return the total of each stack, without the beam."""
        parts = []
        for weight, k in self.family.near_zero:
            known = KnownModes(k, self.azimuth(k))
            found = [transforms_at(each, k, known.azimuth, known) for each in self.assemblies]
            parts.append([each.times(weight) for each in found])
        return [functools.reduce(Transforms.plus, each) for each in zip(*parts, strict=True)]

    def at(self, k: float) -> FloatArray:
        """Return R(k) and T(k) of each stack less single scattering, (2 stacks,)."""
        if k == 0.0:
            parts = [weight * self._at(0.0, near) for weight, near in self.family.near_zero]
            found: FloatArray = np.sum(parts, axis=0)
            return found
        return self._at(k, k)

    def _at(self, k: float, near: float) -> FloatArray:
        """Return what is asked for at k, by the modes of a wavenumber near it."""
        known = KnownModes(near, self.azimuth(near))
        found = [
            _multiple(each, k, known, gap(k) if gap and k in gap else None)
            for each, gap in zip(self.assemblies, self.gaps, strict=True)
        ]
        return np.array(found).ravel()

    @cached_property
    def gaps(self) -> tuple[Gap | None, ...]:
        """Where each stack's T(k) is interpolated, if anywhere."""
        return tuple(self._gap(each) if each.has_bottom else None for each in self.assemblies)

    def _gap(self, assembly: Assembly) -> Gap | None:
        depths = [each.thickness for each in assembly.media]
        first = resolved(self.count, self.azimuths) / sum(depths)
        last = 1.001 * _forward_depth(assembly) / depths[-1]  # just above it

        def transmitted(k: float) -> float:
            return _multiple(assembly, k, KnownModes(k, self.azimuth(k)))[1]

        return Gap(first, last, transmitted) if first < last else None


class KnownModes:
    """Modes at one wavenumber, of layers that were met before."""

    def __init__(self, k: float, azimuth: Azimuth) -> None:
        self.k, self.azimuth = k, azimuth
        self._found: dict[tuple[float, ...], Modes] = {}

    def __call__(self, medium: Medium) -> Modes:
        """Return the modes of a layer."""
        slab = medium.slab
        key = slab.sigma_a, slab.sigma_s, slab.g, slab.eta
        if key not in self._found:
            self._found[key] = modes_of(medium, self.k, self.azimuth)
        return self._found[key]


def _weights(decay: float) -> list[float]:
    """Return the weights of R(1), R(2) and perhaps R(4) in R(0).

    R(k) is a + b k^2, and + c sqrt(k^2 + decay^2) of the slowest layer without end.
    """
    if decay > _FAST:
        return [4.0 / 3.0, -1.0 / 3.0]
    k = np.array([1.0, 2.0, 4.0])
    terms = np.stack([np.ones(3), np.hypot(k, decay), k**2])
    found: list[float] = np.linalg.solve(terms, [1.0, decay, 0.0]).tolist()
    return found


def _hardly_absorbs(slab: Slab) -> bool:
    """Tell whether light crosses a layer that ends, at k = 0, by modes that are nearly one."""
    return math.isfinite(slab.thickness) and slab.diffuse_rate < _HARDLY * slab.sigma_t


def _multiple(
    assembly: Assembly, k: float, known: KnownModes, through: float | None = None
) -> tuple[float, float]:
    """Return R(k) and T(k) less the light that is scattered once and leaves.

    ``through`` is T(k) where it is known already.
    """
    azimuth = known.azimuth
    once_k = known.k if k > 0.0 else 0.0
    top = assembly.last_seen(k, _depth_above(assembly)) if k > 0.0 else None
    above: float | None = None
    if top is not None or not assembly.has_bottom or through is not None:
        above = reflected_at(assembly, known.k, azimuth, known, top)
    if not assembly.has_bottom:
        through = 0.0
    elif through is None and k * assembly.media[-1].thickness > _forward_depth(assembly):
        below = assembly.mirrored
        through = reflected_at(below, known.k, azimuth, known, 0)
        through -= single_transform(below, once_k, azimuth, 0)
    if above is None or through is None:
        both = transforms_at(assembly, known.k, azimuth, known)
        above = both.reflected if above is None else above
        if through is None:
            once = single_transform(assembly.mirrored, once_k, azimuth)
            through = both.transmitted - once
    return above - single_transform(assembly, once_k, azimuth, top), through


def _forward_depth(assembly: Assembly) -> float:
    """Return k z that matters to a beam on its way out.

    The pole of Henyey and Greenstein's function at cos = (1 + g^2) / 2 g slows exp(-k z) to
    exp(-k z (1 - g^2) / (1 + g^2)), also of light that turns back twice.
    """
    g = max(abs(each.slab.g) for each in assembly.media if each.slab.scatters)
    return _DEEP * (1.0 + g**2) / max(1.0 - g**2, _STEEPEST)


def _depth_above(assembly: Assembly) -> float:
    """Return k z that matters to the light that leaves above."""
    returning = max(
        float(up) * each.attenuation
        for up, each in zip(assembly.beam.up, assembly.media, strict=True)
    )
    return _forward_depth(assembly) if returning > _SEEN else _DEEP
