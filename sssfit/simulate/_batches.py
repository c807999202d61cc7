"""A walk dealt out in batches: what the compiled code is given, and its tallies added in order."""

import math
import os
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from sssfit._jit import semi_infinite as walk
from sssfit.grid import RadialGrid
from sssfit.material import Material

FloatArray = npt.NDArray[np.float64]

# 16384 photons of skin1 take 2 ms, of an absorption-free medium 0.3 s: short enough for Ctrl-C,
# long enough that dealing out a batch (some 0.1 ms) does not show.
BATCH_PHOTONS = 16_384
ROULETTE_THRESHOLD = 1e-4  # MCML's; of the largest channel's weight
ROULETTE_LEVELS = 30  # one walk in 1e30 survives so many


@dataclass(slots=True)
class Tally:
    """Sums over photons for the channels of all materials of one walk (weights begin at 1)."""

    ledger: walk.Ledger
    photons: int = 0
    flights: int = 0

    def add(self, other: "Tally") -> None:
        """Add a batch; called in the order of the batches, since float sums depend on order."""
        for mine, theirs in zip(self.ledger, other.ledger, strict=True):
            mine += theirs
        self.photons += other.photons
        self.flights += other.flights


@dataclass(frozen=True, slots=True)
class Walk:
    """One walk: the materials it serves, their grids, and what the compiled code wants to know."""

    materials: tuple[Material, ...]
    grids: tuple[RadialGrid, ...]
    seed: int
    photons: int
    eta: float = field(init=False)
    channels: walk.Channels = field(init=False)
    roulette_at: npt.NDArray[np.uint32] = field(init=False)

    def __post_init__(self) -> None:
        largest = max(float(each.layers[0].albedo.max()) for each in self.materials)
        object.__setattr__(self, "eta", relative_eta(self.materials[0]))
        object.__setattr__(self, "channels", _channels(self.materials, self.grids))
        object.__setattr__(self, "roulette_at", roulette_schedule(largest))

    def trace(self, batch: int) -> Tally:
        """Walk one batch; what comes back depends on the seed and the batch's number alone."""
        tally = self.empty_tally()
        tally.photons = min(BATCH_PHOTONS, self.photons - batch * BATCH_PHOTONS)
        tally.flights = walk.trace_batch(
            np.uint64(self.seed),
            np.int64(batch),
            tally.photons,
            self.eta,
            self.roulette_at,
            self.channels,
            tally.ledger,
        )
        return tally

    def empty_tally(self) -> Tally:
        """All sums zero."""
        n_channels = self.channels.last_bin.size
        cells = int(np.sum(self.channels.last_bin + 1))
        ledger = walk.Ledger(
            bins=np.zeros((cells, 2)),
            absorbed=np.zeros(n_channels),
            unfinished=np.zeros((n_channels, 2)),
            roulette=np.zeros((n_channels, 2)),
        )
        return Tally(ledger)

    def cells(self, channel: int) -> slice:
        """Where a channel's bins stand in the ledger, the one beyond the grid last."""
        first = int(self.channels.first_cell[channel])
        return slice(first, first + int(self.channels.last_bin[channel]) + 1)


def relative_errors(task: Walk, tally: Tally) -> FloatArray:
    """Largest standard error of F over the annulus edges / F at the last, per channel (C,).

    Infinite where nothing has come back within the grid; 0 where sigma_s = 0 and nothing can.
    """
    errors = np.zeros(task.channels.last_bin.size)
    for channel in range(errors.size):
        if task.channels.power_low[1, channel] == 0.0:
            continue
        sums = np.cumsum(tally.ledger.bins[task.cells(channel)][:-1], axis=0)
        energy, squares = sums.T / tally.photons
        if energy[-1] == 0.0 or tally.photons < 2:
            errors[channel] = math.inf
            continue
        # Rounding may leave -1e-17 where all photons carry the same weight.
        variance = max(0.0, float(np.max(squares - energy**2))) / (tally.photons - 1)
        errors[channel] = math.sqrt(variance) / float(energy[-1])
    return errors


def relative_eta(material: Material) -> float:
    """Refractive index of the top layer relative to what is above it."""
    return material.layers[0].eta / material.eta_above


def available_cores() -> int:
    """Cores this process may use (containers and ``taskset`` grant fewer than there are)."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def roulette_schedule(albedo: float) -> npt.NDArray[np.uint32]:
    """At how many collisions a walk that survived k = 0, 1, ... roulettes plays the next.

    The smallest n with albedo^n 10^k under the threshold; the collision cap where that is larger.
    """
    schedule = np.full(ROULETTE_LEVELS + 1, walk.COLLISION_CAP, np.uint32)
    if albedo == 1.0:
        return schedule
    decay = -math.log(albedo) if albedo > 0.0 else math.inf
    previous = 1
    for level in range(ROULETTE_LEVELS):
        under = (level * math.log(10.0) - math.log(ROULETTE_THRESHOLD)) / decay
        previous = max(previous + 1, math.floor(under) + 1)
        schedule[level] = min(previous, walk.COLLISION_CAP)
    return schedule


def _channels(materials: tuple[Material, ...], grids: tuple[RadialGrid, ...]) -> walk.Channels:
    """Lay the channels of all materials side by side."""
    albedo = np.concatenate([each.layers[0].albedo for each in materials])
    bins_per_mfp = np.concatenate(
        [
            each.layers[0].mean_free_path_mm / grid.dr_mm
            for each, grid in zip(materials, grids, strict=True)
        ]
    )
    counts = [each.n_channels for each in materials]
    last_bin = np.repeat([grid.annuli for grid in grids], counts).astype(np.int64)
    first_cell = np.concatenate([[0], np.cumsum(last_bin[:-1] + 1)]).astype(np.int64)
    return walk.Channels(
        power_low=_powers(albedo),
        power_high=_powers(_powers(albedo)[-1] * albedo),
        bins_per_mean_free_path=bins_per_mfp,
        last_bin=last_bin,
        first_cell=first_cell,
    )


def _powers(base: FloatArray) -> FloatArray:
    """base^k for k below ``POWER_BLOCK``, (POWER_BLOCK, C).

    Python's own power: numpy's differs in the last bit between processors.
    """
    rows = [[float(each) ** k for each in base] for k in range(walk.POWER_BLOCK)]
    return np.array(rows)
