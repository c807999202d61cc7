"""The walk of ``sssfit._jit.semi_infinite`` in batches, for half spaces with g = 0.

Every channel rides on the same paths.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from sssfit._jit import half_space_walk
from sssfit.arrays import FloatArray
from sssfit.grid import RadialGrid
from sssfit.material import Material
from sssfit.simulate._directions import EVERYWHERE, Directions, check_cells
from sssfit.simulate._walks import BATCH_PHOTONS, ROULETTE_THRESHOLD, Sums, Tally, relative_eta

ROULETTE_LEVELS = 30  # one walk in 1e30 survives this many


@dataclass(frozen=True, slots=True)
class SemiInfiniteWalk:
    """One walk for materials of one refractive index, with the inputs of the compiled code."""

    materials: tuple[Material, ...]
    grids: tuple[RadialGrid, ...]
    seed: int
    photons: int
    directions: Directions = EVERYWHERE
    eta: float = field(init=False)
    channels: half_space_walk.Channels = field(init=False)
    roulette_at: npt.NDArray[np.uint32] = field(init=False)

    def __post_init__(self) -> None:
        largest = max(float(each.layers[0].albedo.max()) for each in self.materials)
        cosines = self.directions.inside(self.materials[0])
        object.__setattr__(self, "eta", relative_eta(self.materials[0]))
        object.__setattr__(self, "channels", _channels(self.materials, self.grids, cosines))
        object.__setattr__(self, "roulette_at", roulette_schedule(largest))

    def trace(self, batch: int) -> Tally:
        """Walk one batch; the result depends only on the seed and the batch number."""
        tally = self.empty_tally()
        tally.photons = min(BATCH_PHOTONS, self.photons - batch * BATCH_PHOTONS)
        tally.flights = half_space_walk.trace_batch(
            self.seed,
            batch,
            tally.photons,
            self.eta,
            self.roulette_at,
            self.channels,
            tally.ledger,
        )
        return tally

    def prepare(self) -> None:
        """Load or compile the machine code."""
        half_space_walk.ENTRY.load()

    def empty_tally(self) -> Tally:
        """Return a tally with all sums zero."""
        n_channels = self.channels.last_bin.size
        cells = int(np.sum(self.channels.last_bin + 1)) * (self.channels.cosines.size + 1)
        check_cells(cells, self.directions)
        ledger = half_space_walk.Ledger(
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
        bins = np.stack([self._bins(ledger.bins, c) for c in own], axis=2)
        return Sums(
            photons=tally.photons,
            **self.directions.split(bins, None),
            absorbed=ledger.absorbed[None, own],
            unfinished=ledger.unfinished[own],
            roulette=ledger.roulette[own],
        )

    def _bins(self, bins: FloatArray, channel: int) -> FloatArray:
        """Return a channel's bins (n + 1, B, 2) of the ledger, those beyond the grid last."""
        first, annuli = int(self.channels.first_cell[channel]), self.channels.last_bin[channel] + 1
        directions = self.channels.cosines.size + 1
        return bins[first : first + annuli * directions].reshape(annuli, directions, 2)


def roulette_schedule(albedo: float) -> npt.NDArray[np.uint32]:
    """Return the collisions at which a walk that survived k = 0, 1, ... roulettes plays the next.

    The smallest n with albedo^n 10^k under the threshold, or the collision cap if that is smaller.
    """
    schedule = np.full(ROULETTE_LEVELS + 1, half_space_walk.COLLISION_CAP, np.uint32)
    if albedo == 1.0:
        return schedule
    decay = -math.log(albedo) if albedo > 0.0 else math.inf
    previous = 1
    for level in range(ROULETTE_LEVELS):
        under = (level * math.log(10.0) - math.log(ROULETTE_THRESHOLD)) / decay
        previous = max(previous + 1, math.floor(under) + 1)
        schedule[level] = min(previous, half_space_walk.COLLISION_CAP)
    return schedule


def _channels(
    materials: tuple[Material, ...], grids: tuple[RadialGrid, ...], cosines: FloatArray
) -> half_space_walk.Channels:
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
    directions = cosines.size + 1
    first_cell = np.concatenate([[0], np.cumsum(last_bin[:-1] + 1)]).astype(np.int64) * directions
    power_low, power_high = _power_tables(tuple(albedo.tolist()))
    return half_space_walk.Channels(
        power_low=power_low,
        power_high=power_high,
        bins_per_mean_free_path=bins_per_mfp,
        last_bin=last_bin,
        first_cell=first_cell,
        cosines=cosines,
    )


# Many short walks of one material, as a stress makes them, spent two thirds of their time here.
@lru_cache(maxsize=8)
def _power_tables(albedo: tuple[float, ...]) -> tuple[FloatArray, FloatArray]:
    """Return albedo^k for k below ``POWER_BLOCK``, and for its multiples, both (POWER_BLOCK, C)."""
    low = _powers(albedo)
    return low, _powers((low[-1] * albedo).tolist())


def _powers(base: Sequence[float]) -> FloatArray:
    """Return base^k for k below ``POWER_BLOCK``, (POWER_BLOCK, C).

    Uses Python's power, because numpy's differs in the last bit between processors.
    """
    rows = [[each**k for each in base] for k in range(half_space_walk.POWER_BLOCK)]
    return np.array(rows)
