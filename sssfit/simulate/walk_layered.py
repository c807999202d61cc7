"""The walk of ``sssfit._jit.layered`` in batches, for any stack of layers and any g.

Channels that scatter alike (same sigma_s and g in every layer) share a walk; others have their own
walk on the same random streams, so that their noise is similar. A batch includes all of them, so
that every channel of a profile has the same number of photons.
"""

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from sssfit._jit import layered_walk
from sssfit.grid import RadialGrid
from sssfit.material import Material
from sssfit.simulate._directions import EVERYWHERE, Directions, check_cells
from sssfit.simulate._walks import BATCH_PHOTONS, Sums, Tally, channels_with_equal_scattering


@dataclass(frozen=True, slots=True)
class LayeredWalk:
    """The walks of one layered material, with the inputs of the compiled code.

    ``diffuse`` lights the stack evenly from all directions instead of along the normal, for tests
    of reciprocity.
    """

    materials: tuple[Material, ...]
    grids: tuple[RadialGrid, ...]
    seed: int
    photons: int
    diffuse: bool = False
    directions: Directions = EVERYWHERE
    groups: tuple[tuple[layered_walk.Stack, layered_walk.Bins], ...] = field(init=False)

    def __post_init__(self) -> None:
        material, grid = self.materials[0], self.grids[0]
        cosines = self.directions.above(material), self.directions.below()
        groups = tuple(
            (
                _stack(material, members),
                layered_walk.Bins(1.0 / grid.dr_mm, grid.annuli, members, *cosines),
            )
            for members in channels_with_equal_scattering(material)
        )
        object.__setattr__(self, "groups", groups)

    def trace(self, batch: int) -> Tally:
        """Walk one batch of every group; the result depends only on seed and batch number."""
        tally = self.empty_tally()
        tally.photons = min(BATCH_PHOTONS, self.photons - batch * BATCH_PHOTONS)
        for stack, bins in self.groups:
            tally.flights += layered_walk.trace_batch(
                self.seed,
                batch,
                tally.photons,
                self.materials[0].first_scattering_layer,
                self.diffuse,
                stack,
                bins,
                tally.ledger,
            )
        return tally

    def prepare(self) -> None:
        """Load or compile the machine code."""
        layered_walk.ENTRY.load()

    def empty_tally(self) -> Tally:
        """Return a tally with all sums zero."""
        material, cells = self.materials[0], self.grids[0].annuli + 1
        n, bins = material.n_channels, self.groups[0][1]
        check_cells(cells * (bins.above.size + 1) * n, self.directions)
        ledger = layered_walk.Ledger(
            reflected=np.zeros((cells * (bins.above.size + 1), n, 2)),
            transmitted=np.zeros((cells * (bins.below.size + 1), n, 2)),
            absorbed=np.zeros((len(material.layers), n)),
            unfinished=np.zeros((n, 2)),
            roulette=np.zeros((n, 2)),
        )
        return Tally(ledger)

    def sums(self, tally: Tally, index: int) -> Sums:
        """Return the sums of the only material (``index`` 0)."""
        ledger = tally.ledger
        finite = np.isfinite(self.materials[index].layers[-1].thickness_mm)
        shape = (self.grids[0].annuli + 1, -1, self.materials[0].n_channels, 2)
        below = ledger.transmitted.reshape(shape) if finite else None
        return Sums(
            photons=tally.photons,
            **self.directions.split(ledger.reflected.reshape(shape), below),
            absorbed=ledger.absorbed,
            unfinished=ledger.unfinished,
            roulette=ledger.roulette,
        )


def _stack(material: Material, members: npt.NDArray[np.int64]) -> layered_walk.Stack:
    """Lay out the tables of a group; its walk follows each layer's least absorbing channel."""
    layers = material.layers
    sigma_a = np.array([layer.sigma_a_per_mm[members] for layer in layers])
    sigma_s = np.array([layer.sigma_s_per_mm[members[0]] for layer in layers])
    least = sigma_a.min(axis=1)
    sigma_t = least + sigma_s
    scatters = sigma_t > 0.0
    rows = np.zeros((len(layers) + 2, 4), np.float32)
    rows[:, 0] = np.inf
    rows[1:-1, 0] = [layer.thickness_mm for layer in layers]
    rows[1:-1, 1] = np.divide(1.0, sigma_t, out=np.full_like(least, np.inf), where=scatters)
    rows[1:-1, 2] = np.divide(least, sigma_t, out=np.zeros_like(least), where=scatters)
    rows[1:-1, 3] = [1.0 - layer.g[members[0]] for layer in layers]
    excess = np.zeros((len(layers) + 2, members.size), np.float32)
    excess[1:-1] = sigma_a - least[:, None]
    return layered_walk.Stack(rows.ravel(), _crossings(material, rows).ravel(), excess.ravel())


def _crossings(material: Material, rows: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Table of interfaces (L + 2, 2, 3): index over that beyond, thickness and mean free path."""
    eta = np.array([material.eta_above, *(one.eta for one in material.layers), material.eta_below])
    crossings = np.zeros((len(rows), 2, 3), np.float32)
    for layer in range(1, len(rows) - 1):
        for direction, beyond in enumerate((layer + 1, layer - 1)):
            crossings[layer, direction] = eta[layer] / eta[beyond], *rows[beyond, :2]
    return crossings
