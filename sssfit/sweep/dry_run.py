"""What a sweep would take, from a short calibration: points, photons, time and bytes.

The calibration does what the sweep will do, in small: it starts the workers, which import and
compile, has them walk a few thousand photons of points of little, middling and much work, or solve
such points, and writes those to a store that is then deleted.
"""

import time
from concurrent.futures import wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from sssfit.errors import SweepError
from sssfit.messages import filled
from sssfit.simulate.batches import BATCH_PHOTONS, code_version
from sssfit.sweep.axes import Axis
from sssfit.sweep.layout import bytes_of
from sssfit.sweep.made import make_store
from sssfit.sweep.plan import Plan
from sssfit.sweep.pools import LOST, Pool, pool_for
from sssfit.sweep.store import Store
from sssfit.sweep.tasks import Done, Part, Task, assembled, perform, point_steps, tasks_of

_SAMPLES = 5  # points, from the shortest to the longest
_MOST_BUSY = 16  # workers that do a sample at the same time
_LOOKS_SECONDS = 0.2
_WRITTEN = 32  # points of the store that is written


@dataclass(frozen=True, slots=True)
class Estimate:
    """What a sweep would take.

    Parameters
    ----------
    plan : Plan
    workers : int
    start_seconds : float [s]
        Until the workers have imported and compiled what they need.
    work_seconds : float [s]
        Work of all points, on one worker.
    write_seconds : float [s]
        Writing all points, by this process.
    tasks : int
    longest_seconds : float [s]
        The longest task, for which the others may wait at the end.
    """

    plan: Plan
    workers: int
    start_seconds: float
    work_seconds: float
    write_seconds: float
    tasks: int
    longest_seconds: float

    @property
    def seconds(self) -> float:
        """Estimated duration [s]; a single worker writes as well, others are written for."""
        shared = self.work_seconds / self.workers
        work = shared + self.write_seconds if self.workers == 1 else max(shared, self.write_seconds)
        return self.start_seconds + max(work, self.longest_seconds)

    def to_dict(self) -> dict[str, Any]:
        """Return the figures of ``sssfit sweep --dry-run --json``."""
        photons = self.plan.photons
        return {
            "dry_run": True,
            "material": self.plan.base.name,
            "method": self.plan.method,
            "axes": {axis.name: len(axis.values) for axis in self.plan.axes},
            "points": self.plan.count,
            "photons": None if photons is None else photons * self.plan.count,
            "annuli": self.plan.grid.annuli,
            "dr_mm": self.plan.grid.dr_mm,
            "bytes": bytes_of(self.plan),
            "workers": self.workers,
            "tasks": self.tasks,
            "start_seconds": self.start_seconds,
            "work_seconds": self.work_seconds,
            "write_seconds": self.write_seconds,
            "longest_task_seconds": self.longest_seconds,
            "seconds": self.seconds,
        }

    def text(self) -> str:
        """Return the printed report."""
        figures = self.to_dict()
        lines = [
            "{material} by {method}: {points:#point} (" + self.plan.shape_in_words + ")",
            "{annuli:#annulus} of {dr_mm:.4g} mm, " + f"{figures['bytes'] / 1e6:.3g} MB",
            *(["{photons:.3g} photons"] if figures["photons"] else []),
            "about {seconds:.3g} s on {workers:#worker}: {start_seconds:.2g} s to start, "
            "{work_seconds:.3g} s of work, {write_seconds:.2g} s to write",
            "{tasks:#task}, the longest {longest_task_seconds:.2g} s",
        ]
        return "\n".join(filled(line, figures) for line in lines)


def estimate(plan: Plan, *, threads: int | None = None, scheduler: str | None = None) -> Estimate:
    """Estimate what a sweep would take on the workers that it would have.

    Parameters
    ----------
    plan : Plan
    threads, scheduler
        As in `sssfit.sweep.sweep_to_store`.

    Raises
    ------
    SweepError
        The workers cannot be reached or have other code, or a sample cannot be computed.
    PlanError
        A point's material is invalid.
    """
    _ = plan.grid
    steps = {index: point_steps(plan, index) for index in range(plan.count)}
    samples = _samples(steps)
    begun = time.perf_counter()
    with pool_for(plan, threads, scheduler) as pool:
        _timed(plan, samples[0], pool)
        start = time.perf_counter() - begun
        timed = [_timed(plan, index, pool) for index in samples]
        tasks = list(tasks_of(plan, range(plan.count), pool.workers))
        workers = pool.workers
    fit, write = _after(plan, samples[0], timed[0][1])
    known = [steps[index] for index in samples]
    seconds = np.interp([*steps.values()], known, [each for each, _ in timed]) + fit
    longest = max(sum(seconds[part.index] / part.count for part in each.parts) for each in tasks)
    return Estimate(
        plan,
        workers,
        start,
        float(seconds.sum()),
        write * plan.count,
        len(tasks),
        float(longest),
    )


def _samples(steps: dict[int, float]) -> list[int]:
    """Return points from the shortest to the longest."""
    ordered = sorted(steps, key=lambda each: steps[each])
    count = min(_SAMPLES, len(ordered))
    return [ordered[round(k * (len(ordered) - 1) / max(count - 1, 1))] for k in range(count)]


def _timed(plan: Plan, index: int, pool: Pool) -> tuple[float, Done]:
    """Return the seconds of a point while all workers are busy, and its result or first batch."""
    part, share = Part(index, last=0 if plan.photons is None else 1), 1.0
    if plan.photons is not None and plan.photons > BATCH_PHOTONS:
        part, share = Part(index, 0, 2, 0, 1), BATCH_PHOTONS / plan.photons
    task = Task((part,), 0.0, code_version())
    begun = time.perf_counter()
    done = [pool.submit(task) for _ in range(min(pool.workers, _MOST_BUSY))]
    while wait(done, _LOOKS_SECONDS).not_done:
        pool.check()
    try:
        ((found,), *_) = [each.result() for each in done]
    except BrokenProcessPool:
        raise SweepError(f"{LOST}.") from None
    if found.failure is not None:
        raise SweepError(f"the point at {plan.label(index)} cannot be computed: {found.failure}")
    return (time.perf_counter() - begun) / share, found


def _after(plan: Plan, index: int, done: Done) -> tuple[float, float]:
    """Return the seconds of a point's fit, where it was not timed with it, and of its writing."""
    fit = 0.0
    if done.tally is not None:
        profile = assembled(plan, index, done.tally)
        task = Task((Part(index),), 0.0, code_version(), profile)
        perform(plan, task)  # which imports what fits need
        begun = time.perf_counter()
        (done,) = perform(plan, task)
        fit = time.perf_counter() - begun if plan.fit is not None else 0.0
    small = _first_points(plan)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "trial.zarr"
        make_store(path, small)
        store = Store(path, small)
        begun = time.perf_counter()
        for k in range(small.count):
            store.add(replace(done, part=Part(k)))
        store.flush()
        return fit, (time.perf_counter() - begun) / small.count


def _first_points(plan: Plan) -> Plan:
    """Return the plan of a few points, on the grid of all of them."""
    *others, last = plan.axes
    axes = (*(_shortened(each, 1) for each in others), _shortened(last, _WRITTEN))
    return replace(plan, axes=axes, dr_mm=plan.grid.dr_mm, radius_mm=plan.grid.radius_mm)


def _shortened(axis: Axis, count: int) -> Axis:
    columns = {name: each[:count] for name, each in axis.columns.items()}
    return replace(axis, values=axis.values[:count], columns=columns)
