"""The walk of ``sssfit._jit.layered`` in batches: any stack of layers, any g.

Channels that scatter alike (same sigma_s and g in every layer) share a walk; others have their own
walk on the same random streams, so that their noise is similar. A batch includes all of them, so
that every channel of a profile has the same number of photons.
"""

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from sssfit._jit import layered as walk
from sssfit.grid import RadialGrid
from sssfit.material import Material
from sssfit.simulate._batches import BATCH_PHOTONS, Sums, Tally


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
    groups: tuple[tuple[walk.Stack, walk.Bins], ...] = field(init=False)

    def __post_init__(self) -> None:
        material, grid = self.materials[0], self.grids[0]
        groups = tuple(
            (_stack(material, members), walk.Bins(1.0 / grid.dr_mm, grid.annuli, members))
            for members in channels_with_equal_scattering(material)
        )
        object.__setattr__(self, "groups", groups)

    def trace(self, batch: int) -> Tally:
        """Walk one batch of every group; the result depends only on seed and batch number."""
        tally = self.empty_tally()
        tally.photons = min(BATCH_PHOTONS, self.photons - batch * BATCH_PHOTONS)
        for stack, bins in self.groups:
            tally.flights += walk.trace_batch(
                np.uint64(self.seed),
                np.int64(batch),
                tally.photons,
                self.materials[0].first_scattering_layer,
                self.diffuse,
                stack,
                bins,
                tally.ledger,
            )
        return tally

    def empty_tally(self) -> Tally:
        """Return a tally with all sums zero."""
        material, cells = self.materials[0], self.grids[0].annuli + 1
        n = material.n_channels
        ledger = walk.Ledger(
            reflected=np.zeros((cells, n, 2)),
            transmitted=np.zeros((cells, n, 2)),
            absorbed=np.zeros((len(material.layers), n)),
            unfinished=np.zeros((n, 2)),
            roulette=np.zeros((n, 2)),
        )
        return Tally(ledger)

    def sums(self, tally: Tally, index: int) -> Sums:
        """Return the sums of the only material (``index`` 0)."""
        ledger = tally.ledger
        finite = np.isfinite(self.materials[index].layers[-1].thickness_mm)
        return Sums(
            photons=tally.photons,
            reflected=ledger.reflected,
            transmitted=ledger.transmitted if finite else None,
            absorbed=ledger.absorbed,
            unfinished=ledger.unfinished,
            roulette=ledger.roulette,
        )


def channels_with_equal_scattering(material: Material) -> list[npt.NDArray[np.int64]]:
    """Group the channels that differ in absorption only; returns indices in their order."""
    groups: dict[bytes, list[int]] = {}
    for c in range(material.n_channels):
        scattering = [(layer.sigma_s_per_mm[c], layer.g[c]) for layer in material.layers]
        groups.setdefault(np.array(scattering).tobytes(), []).append(c)
    return [np.array(members, np.int64) for members in groups.values()]


def _stack(material: Material, members: npt.NDArray[np.int64]) -> walk.Stack:
    """Lay out the layers for a group; its walk follows each layer's least absorbing channel."""
    layers = material.layers
    sigma_a = np.array([layer.sigma_a_per_mm[members] for layer in layers])
    sigma_s = np.array([layer.sigma_s_per_mm[members[0]] for layer in layers])
    least = sigma_a.min(axis=1)
    sigma_t = least + sigma_s
    edges_mm = np.concatenate([[0.0], np.cumsum([layer.thickness_mm for layer in layers])])
    capture = np.divide(least, sigma_t, out=np.zeros_like(least), where=sigma_t > 0.0)
    return walk.Stack(
        top_mm=edges_mm[:-1].astype(np.float32),
        bottom_mm=edges_mm[1:].astype(np.float32),
        sigma_t_per_mm=sigma_t.astype(np.float32),
        capture=capture.astype(np.float32),
        back=np.array([1.0 - layer.g[members[0]] for layer in layers], np.float32),
        eta=np.array([material.eta_above, *(each.eta for each in layers), material.eta_below]),
        excess_per_mm=sigma_a - least[:, None],
    )
