"""The walks of ``sssfit._jit`` in batches, ``semi_infinite`` and ``layered``, and their tallies.

`SemiInfiniteWalk` is for half spaces with g = 0: every channel rides on the same paths.

`LayeredWalk` is for any stack of layers and any g. Channels that scatter alike (same sigma_s and g
in every layer) share a walk; others have their own walk on the same random streams, so that their
noise is similar. A batch includes all of them, so that every channel of a profile has the same
number of photons. Tallies of batches are added in order.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from sssfit._jit import compiled_before, layered, layered_entry, layered_tally, semi_infinite
from sssfit.arrays import FloatArray
from sssfit.grid import RadialGrid
from sssfit.material import Material
from sssfit.messages import note
from sssfit.simulate._directions import EVERYWHERE, Directions, check_cells

# 16384 photons of skin1 take 4 ms, those of a medium of eta 1.3 without absorption half a second:
# short enough for Ctrl-C, long enough to hide the cost of starting a batch (about 0.1 ms).
BATCH_PHOTONS = 16_384
MAX_PHOTONS = 10**12


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
    def first_call(self) -> Callable[[], object] | None: ...
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
    groups: tuple[tuple[layered_entry.Stack, layered_tally.Bins], ...] = field(init=False)

    def __post_init__(self) -> None:
        material, grid = self.materials[0], self.grids[0]
        cosines = self.directions.above(material), self.directions.below()
        groups = tuple(
            (
                _stack(material, members),
                layered_tally.Bins(1.0 / grid.dr_mm, grid.annuli, members, *cosines),
            )
            for members in channels_with_equal_scattering(material)
        )
        object.__setattr__(self, "groups", groups)

    def trace(self, batch: int) -> Tally:
        """Walk one batch of every group; the result depends only on seed and batch number."""
        tally = self.empty_tally()
        tally.photons = min(BATCH_PHOTONS, self.photons - batch * BATCH_PHOTONS)
        for stack, bins in self.groups:
            tally.flights += layered.trace_batch(
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

    def first_call(self) -> Callable[[], object] | None:
        """Return a walk of no photons, if its code need only be loaded."""
        return partial(replace(self, photons=0).trace, 0) if compiled_before("layered") else None

    def empty_tally(self) -> Tally:
        """Return a tally with all sums zero."""
        material, cells = self.materials[0], self.grids[0].annuli + 1
        n, bins = material.n_channels, self.groups[0][1]
        check_cells(cells * (bins.above.size + 1) * n, self.directions)
        ledger = layered_tally.Ledger(
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


def channels_with_equal_scattering(material: Material) -> list[npt.NDArray[np.int64]]:
    """Group the channels that differ in absorption only; returns indices in their order."""
    groups: dict[bytes, list[int]] = {}
    for c in range(material.n_channels):
        scattering = [(layer.sigma_s_per_mm[c], layer.g[c]) for layer in material.layers]
        groups.setdefault(np.array(scattering).tobytes(), []).append(c)
    return [np.array(members, np.int64) for members in groups.values()]


def _stack(material: Material, members: npt.NDArray[np.int64]) -> layered_entry.Stack:
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
    return layered_entry.Stack(rows.ravel(), _crossings(material, rows).ravel(), excess.ravel())


def _crossings(material: Material, rows: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Table of interfaces (L + 2, 2, 3): index over that beyond, thickness and mean free path."""
    eta = np.array([material.eta_above, *(one.eta for one in material.layers), material.eta_below])
    crossings = np.zeros((len(rows), 2, 3), np.float32)
    for layer in range(1, len(rows) - 1):
        for direction, beyond in enumerate((layer + 1, layer - 1)):
            crossings[layer, direction] = eta[layer] / eta[beyond], *rows[beyond, :2]
    return crossings


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
    directions: Directions = EVERYWHERE
    eta: float = field(init=False)
    channels: semi_infinite.Channels = field(init=False)
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
        tally.flights = semi_infinite.trace_batch(
            np.uint64(self.seed),
            np.int64(batch),
            tally.photons,
            self.eta,
            self.roulette_at,
            self.channels,
            tally.ledger,
        )
        return tally

    def first_call(self) -> Callable[[], object] | None:
        """Return a walk of no photons, if its code need only be loaded."""
        known = compiled_before("semi_infinite")
        return partial(replace(self, photons=0).trace, 0) if known else None

    def empty_tally(self) -> Tally:
        """Return a tally with all sums zero."""
        n_channels = self.channels.last_bin.size
        cells = int(np.sum(self.channels.last_bin + 1)) * (self.channels.cosines.size + 1)
        check_cells(cells, self.directions)
        ledger = semi_infinite.Ledger(
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


def relative_eta(material: Material) -> float:
    """Refractive index of the top layer relative to the medium above it."""
    return material.layers[0].eta / material.eta_above


def roulette_schedule(albedo: float) -> npt.NDArray[np.uint32]:
    """Return the collisions at which a walk that survived k = 0, 1, ... roulettes plays the next.

    The smallest n with albedo^n 10^k under the threshold, or the collision cap if that is smaller.
    """
    schedule = np.full(ROULETTE_LEVELS + 1, semi_infinite.COLLISION_CAP, np.uint32)
    if albedo == 1.0:
        return schedule
    decay = -math.log(albedo) if albedo > 0.0 else math.inf
    previous = 1
    for level in range(ROULETTE_LEVELS):
        under = (level * math.log(10.0) - math.log(ROULETTE_THRESHOLD)) / decay
        previous = max(previous + 1, math.floor(under) + 1)
        schedule[level] = min(previous, semi_infinite.COLLISION_CAP)
    return schedule


def _channels(
    materials: tuple[Material, ...], grids: tuple[RadialGrid, ...], cosines: FloatArray
) -> semi_infinite.Channels:
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
    return semi_infinite.Channels(
        power_low=_powers(albedo),
        power_high=_powers(_powers(albedo)[-1] * albedo),
        bins_per_mean_free_path=bins_per_mfp,
        last_bin=last_bin,
        first_cell=first_cell,
        cosines=cosines,
    )


def _powers(base: FloatArray) -> FloatArray:
    """Return base^k for k below ``POWER_BLOCK``, (POWER_BLOCK, C).

    Uses Python's power, because numpy's differs in the last bit between processors.
    """
    rows = [[float(each) ** k for each in base] for k in range(semi_infinite.POWER_BLOCK)]
    return np.array(rows)
