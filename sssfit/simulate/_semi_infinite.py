"""The walk of ``sssfit._jit.semi_infinite`` in batches: half spaces, g = 0, every channel."""

import math
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from sssfit._jit import semi_infinite as walk
from sssfit.arrays import FloatArray
from sssfit.grid import RadialGrid
from sssfit.material import Material
from sssfit.simulate._batches import BATCH_PHOTONS, Sums, Tally

# MCML's roulette threshold, applied to the largest weight of all channels.
ROULETTE_THRESHOLD = 1e-4
ROULETTE_LEVELS = 30  # one walk in 1e30 survives this many


@dataclass(frozen=True, slots=True)
class SemiInfiniteWalk:
    """One walk for materials of one refractive index, with the inputs of the compiled code."""

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
        """Walk one batch; the result depends only on the seed and the batch number."""
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
        """Return a tally with all sums zero."""
        n_channels = self.channels.last_bin.size
        cells = int(np.sum(self.channels.last_bin + 1))
        ledger = walk.Ledger(
            bins=np.zeros((cells, 2)),
            absorbed=np.zeros(n_channels),
            unfinished=np.zeros((n_channels, 2)),
            roulette=np.zeros((n_channels, 2)),
        )
        return Tally(ledger)

    def sums(self, tally: Tally, index: int) -> Sums:
        """Return one material's part of a tally."""
        first = sum(each.n_channels for each in self.materials[:index])
        own = range(first, first + self.materials[index].n_channels)
        ledger = tally.ledger
        return Sums(
            photons=tally.photons,
            reflected=np.stack([ledger.bins[self._cells(c)] for c in own], axis=1),
            transmitted=None,
            absorbed=ledger.absorbed[None, own],
            unfinished=ledger.unfinished[own],
            roulette=ledger.roulette[own],
        )

    def _cells(self, channel: int) -> slice:
        """Positions of a channel's bins in the ledger, the one beyond the grid last."""
        first = int(self.channels.first_cell[channel])
        return slice(first, first + int(self.channels.last_bin[channel]) + 1)


def relative_eta(material: Material) -> float:
    """Refractive index of the top layer relative to the medium above it."""
    return material.layers[0].eta / material.eta_above


def roulette_schedule(albedo: float) -> npt.NDArray[np.uint32]:
    """Return the collisions at which a walk that survived k = 0, 1, ... roulettes plays the next.

    The smallest n with albedo^n 10^k under the threshold, or the collision cap if that is smaller.
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
    """Return base^k for k below ``POWER_BLOCK``, (POWER_BLOCK, C).

    Uses Python's power, because numpy's differs in the last bit between processors.
    """
    rows = [[float(each) ** k for each in base] for k in range(walk.POWER_BLOCK)]
    return np.array(rows)
