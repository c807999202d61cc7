"""Photon walks of any kind in batches, with tallies that are added in order."""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.grid import RadialGrid
from sssfit.material import Material

# 16384 photons of skin1 take 4 ms, those of a medium of eta 1.3 without absorption half a second:
# short enough for Ctrl-C, long enough to hide the cost of starting a batch (about 0.1 ms).
BATCH_PHOTONS = 16_384
MAX_PHOTONS = 10**12


@dataclass(slots=True)
class Tally:
    """Sums over photons for all channels of a walk (weights begin at 1).

    ``ledger`` is a named tuple of float64 arrays to which the walk adds.
    """

    ledger: Any
    photons: int = 0
    flights: int = 0

    def add(self, other: "Tally") -> None:
        """Add a batch; called in the order of the batches, since float sums depend on it."""
        for mine, theirs in zip(self.ledger, other.ledger, strict=True):
            mine += theirs
        self.photons += other.photons
        self.flights += other.flights


@dataclass(frozen=True, slots=True)
class Sums:
    """One material's part of a tally; the last axis of length 2 holds sums of w and of w^2."""

    photons: int
    reflected: FloatArray  # (n + 1, C, 2), the last bin beyond the grid
    transmitted: FloatArray | None  # likewise; None for a half space
    absorbed: FloatArray  # (layers, C)
    unfinished: FloatArray  # (C, 2)
    roulette: FloatArray  # (C, 2)


class Walk(Protocol):
    """Interface of a walk in batches."""

    @property
    def materials(self) -> tuple[Material, ...]: ...
    @property
    def grids(self) -> tuple[RadialGrid, ...]: ...
    @property
    def seed(self) -> int: ...
    @property
    def photons(self) -> int: ...
    def trace(self, batch: int) -> Tally: ...
    def empty_tally(self) -> Tally: ...
    def sums(self, tally: Tally, index: int) -> Sums: ...


def relative_errors(task: Walk, tally: Tally) -> FloatArray:
    """Return the largest standard error of F over the edges / F at the last edge, (C,).

    Infinite if no light has returned within the grid; 0 if sigma_s = 0, where none can return.
    """
    each = [_errors(task.sums(tally, k), one) for k, one in enumerate(task.materials)]
    return np.concatenate(each)


def _errors(sums: Sums, material: Material) -> FloatArray:
    """Return the relative errors of one material's channels."""
    infinite = np.full(material.n_channels, np.inf)
    dark = ~np.any([layer.sigma_s_per_mm for layer in material.layers], axis=0)
    if sums.photons < 2:
        return np.where(dark, 0.0, infinite)
    energy, squares = np.moveaxis(np.cumsum(sums.reflected[:-1], axis=0) / sums.photons, -1, 0)
    # Rounding may leave -1e-17 if all photons have the same weight.
    variance = np.maximum(np.max(squares - energy**2, axis=0), 0.0) / (sums.photons - 1)
    relative = np.divide(np.sqrt(variance), energy[-1], out=infinite, where=energy[-1] > 0.0)
    return np.where(dark, 0.0, relative)
