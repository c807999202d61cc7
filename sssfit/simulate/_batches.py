"""Walks dealt out in batches, whatever they walk through, and their tallies added in order."""

import math
import os
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from time import perf_counter
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from sssfit.grid import RadialGrid
from sssfit.material import Material

FloatArray = npt.NDArray[np.float64]

# 16384 photons of skin1 take 2 ms, of an absorption-free medium 0.3 s: short enough for Ctrl-C,
# long enough that dealing out a batch (some 0.1 ms) does not show.
BATCH_PHOTONS = 16_384
REPORT_SECONDS = 0.1


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a walk has come: photons done of all, seconds, and the relative error so far.

    ``relative_error`` is the largest standard error of F over all annulus edges, as a share of F
    at the last edge, of the worst channel; infinite until every channel has energy on its grid.
    """

    photons_done: int
    photons: int
    seconds: float
    relative_error: float


@dataclass(slots=True)
class Tally:
    """Sums over photons for all channels of a walk (weights begin at 1).

    ``ledger`` is a named tuple of float64 arrays, of whatever kind the walk books into.
    """

    ledger: Any
    photons: int = 0
    flights: int = 0

    def add(self, other: "Tally") -> None:
        """Add a batch; called in the order of the batches, since float sums depend on order."""
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
    """What can be walked in batches."""

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


def run(
    task: Walk,
    threads: int,
    progress: Callable[[Progress], None] | None,
    stop: Callable[[], bool] | None,
) -> Tally:
    """Walk all batches on ``threads`` threads; end early, in order, once ``stop`` says so."""
    total = task.empty_tally()
    begun = reported = perf_counter()
    for tally in _in_order(task, threads, stop):
        total.add(tally)
        now = perf_counter()
        if progress and (now - reported > REPORT_SECONDS or total.photons == task.photons):
            reported = now
            progress(
                Progress(total.photons, task.photons, now - begun, relative_error(task, total))
            )
    return total


def _in_order(task: Walk, threads: int, stop: Callable[[], bool] | None) -> Iterator[Tally]:
    """Tallies of batch 0, 1, 2 ... while a few more are on their way in other threads."""
    batches = iter(range(-(-task.photons // BATCH_PHOTONS)))
    pending: deque[Future[Tally]] = deque()
    with ThreadPoolExecutor(threads, thread_name_prefix="sssfit-walk") as pool:
        try:
            stopped = False
            while True:
                stopped = stopped or (stop is not None and stop())
                # Two a thread keep every core busy and bound the memory, whatever the photons.
                while not stopped and len(pending) < 2 * threads:
                    batch = next(batches, None)
                    if batch is None:
                        break
                    pending.append(pool.submit(task.trace, batch))
                if not pending:
                    return
                yield pending.popleft().result()
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def relative_error(task: Walk, tally: Tally) -> float:
    """Largest standard error of F over the annulus edges / F at the last, of the worst channel."""
    if tally.photons < 2:
        return math.inf
    return max(_worst(task.sums(tally, k)) for k in range(len(task.materials)))


def _worst(sums: Sums) -> float:
    """Return the relative error of one material's worst channel."""
    energy, squares = np.moveaxis(np.cumsum(sums.reflected[:-1], axis=0) / sums.photons, -1, 0)
    error = np.sqrt(np.max(squares - energy**2, axis=0) / (sums.photons - 1))
    # Nothing scattered, nothing back: such a channel is known exactly.
    dark = sums.absorbed.sum(axis=0) >= sums.photons * (1.0 - 1e-12)
    relative = np.divide(error, energy[-1], out=np.full_like(error, np.inf), where=energy[-1] > 0)
    return float(np.max(np.where(dark, 0.0, relative)))


def available_cores() -> int:
    """Cores this process may use (containers and ``taskset`` grant fewer than there are)."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
