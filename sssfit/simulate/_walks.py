"""What the two walks of ``sssfit._jit`` have in common: batches, tallies and their errors.

``walk_half_space`` and ``walk_layered`` are the walks. Tallies of batches are added in order.
"""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray
from sssfit.grid import RadialGrid
from sssfit.material import Material
from sssfit.messages import note
from sssfit.simulate._directions import Directions

# 16384 photons of skin1 take 4 ms, those of a medium of eta 1.3 without absorption half a second:
# short enough for Ctrl-C, long enough to hide the cost of starting a batch (about 0.1 ms).
BATCH_PHOTONS = 16_384
MAX_PHOTONS = 10**12
ROULETTE_THRESHOLD = 1e-4  # MCML's, applied to the largest weight of all channels


def note_compiling(what: str, seconds: int, is_compiled: bool) -> None:
    """Say what is about to be compiled, and how long that takes."""
    if not is_compiled:
        note(f"Compiling the {what}, some {seconds} s; it is kept for later runs where it can be.")


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
    above_by_angle: FloatArray | None = None  # (n + 1, A, C, 2), of what is reflected
    below_by_angle: FloatArray | None = None
    unseen: FloatArray | None = None  # (C,): weight outside a detector's aperture


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
    @property
    def directions(self) -> Directions: ...
    def trace(self, batch: int) -> Tally: ...
    def prepare(self) -> None: ...
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


def relative_eta(material: Material) -> float:
    """Refractive index of the top layer relative to the medium above it."""
    return material.layers[0].eta / material.eta_above


def channels_with_equal_scattering(material: Material) -> list[npt.NDArray[np.int64]]:
    """Group the channels that differ in absorption only; returns indices in their order."""
    groups: dict[bytes, list[int]] = {}
    for c in range(material.n_channels):
        scattering = [(layer.sigma_s_per_mm[c], layer.g[c]) for layer in material.layers]
        groups.setdefault(np.array(scattering).tobytes(), []).append(c)
    return [np.array(members, np.int64) for members in groups.values()]
