"""Runs sweeps: tasks to a pool, tallies added in order, finished points to the store."""

import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from pathlib import Path

from sssfit.errors import FileError, PlanError, SweepError
from sssfit.files import locked, path_of
from sssfit.messages import note, shown
from sssfit.simulate.batches import Tally, code_version
from sssfit.sweep.made import make_store, restore
from sssfit.sweep.needed import needed
from sssfit.sweep.plan import Plan
from sssfit.sweep.pools import LOST, Pool, pool_for
from sssfit.sweep.record import SweepResults
from sssfit.sweep.store import Store, check_same, is_store
from sssfit.sweep.tasks import Done, Part, Task, assembled, tasks_of

Stop = Callable[[], bool]
Progress = Callable[[int, int, str], None]
_QUEUED = 2  # tasks that wait for each worker, so that none waits for us
_LOOKS_SECONDS = 0.2


def sweep_to_store(
    plan: Plan,
    path: str | Path,
    *,
    threads: int | None = None,
    scheduler: str | None = None,
    resume: bool = False,
    force: bool = False,
    stop: Stop = lambda: False,
    progress: Progress | None = None,
) -> SweepResults:
    """Compute all points of a plan and store them.

    Parameters
    ----------
    plan : Plan
    path : str or Path
        The Zarr folder to make.
    threads : int, optional
        Worker processes on this machine; all cores by default. A script that calls this needs its
        ``if __name__ == "__main__":`` then. With 1 there is no process but the caller's.
    scheduler : str, optional
        A Dask cluster in their place: its scheduler's address, or "local:N" for N new workers.
    resume : bool
        Compute only the points that an existing store of the same plan lacks.
    force : bool
        Replace an existing store of a sweep.
    stop : callable
        When it returns true, tasks that run on this machine are waited for, and no other begins.
    progress : callable, optional
        Called with points done, points in all and the last one's coordinates.

    Returns
    -------
    SweepResults

    Raises
    ------
    SweepError
        Points could not be computed, workers were lost or have other code, or the store is of
        another plan; what is finished is kept.
    FileError
        The store cannot be written, or is not one.
    PlanError
        A point's material is invalid.
    """
    needed("zarr", "sweep")
    path, begun = path_of(path), time.perf_counter()
    if not isinstance(plan, Plan):
        raise PlanError(f"plan = {shown(plan)}; expected a Plan; sssfit.sweep.load_plan reads one.")
    _ = plan.grid  # every point is checked before anything is written
    exists = _check_path(path, resume=resume, force=force)
    with locked(path), pool_for(plan, threads, scheduler) as pool:
        if resume and exists:
            check_same(path, plan)
            restore(path, plan)
        else:
            if resume:
                note(f"No {path} to continue from: starting a new sweep.")
            make_store(path, plan, replaces=exists)
        store = Store(path, plan)
        before = store.finished() if resume and exists else []
        missing = sorted({*range(plan.count)} - {*before})
        run = Run(plan, store, pool, len(before), stop, progress)
        run.all(missing)
    seconds = time.perf_counter() - begun
    return SweepResults(plan, path, len(before), run.done, tuple(run.failures), seconds)


def _check_path(path: Path, *, resume: bool, force: bool) -> bool:
    """Return whether there is a store to continue or replace; refuse anything else."""
    if str(path) == "-":
        raise FileError("- is stdout, and a store is a folder, which goes to a path; name one.")
    if not path.parent.is_dir():
        raise FileError(f"{path}: there is no folder {path.parent}; make it, or name another.")
    if not (path.exists() or path.is_symlink()):
        return False
    if not is_store(path):
        raise FileError(f"{path} exists and is no store of a sweep; choose another name.")
    if not (resume or force):
        raise FileError(
            f"{path} is the store of a sweep; `resume = True` computes what it lacks, and "
            "`force = True` begins again."
        )
    return True


@dataclass(slots=True)
class _Sums:
    """The tally of a point so far, and those of its parts that came before their turn."""

    total: Tally | None = None
    turn: int = 0
    early: dict[int, Tally] = field(default_factory=dict)

    def add(self, part: Part, tally: Tally) -> bool:
        """Add parts in the order of their numbers; return whether all are there."""
        self.early[part.number] = tally
        while self.turn in self.early:
            following = self.early.pop(self.turn)
            if self.total is None:
                self.total = following
            else:
                self.total.add(following)
            self.turn += 1
        return self.turn == part.count


@dataclass(slots=True)
class Run:
    """A sweep under way; `all` does it."""

    plan: Plan
    store: Store
    pool: Pool
    before: int
    stop: Stop
    progress: Progress | None
    done: int = 0
    failures: list[tuple[int, str]] = field(default_factory=list)
    _sums: dict[int, _Sums] = field(default_factory=dict)
    _failed: set[int] = field(default_factory=set)
    _more: list[Task] = field(default_factory=list)

    def all(self, indices: Sequence[int]) -> None:
        """Compute points; those that are finished are written, also where an error ends this."""
        tasks = tasks_of(self.plan, indices, self.pool.workers)
        pending: set[Future[list[Done]]] = set()
        try:
            while True:
                for task in self._next(tasks, len(pending)):
                    pending.add(self.pool.submit(task))
                if self.stop():  # what waits for a worker need not be done
                    pending = {each for each in pending if not each.cancel()}
                if not pending:
                    break
                ready, pending = wait(pending, _LOOKS_SECONDS, FIRST_COMPLETED)
                self.pool.check()
                for each in ready:
                    self._take(each)
        except BrokenProcessPool:
            raise SweepError(f"{LOST}; {self._kept()}") from None
        except CancelledError:
            raise SweepError(f"the workers were lost; {self._kept()}") from None
        except SweepError as error:
            raise SweepError(f"{str(error).rstrip('.')}; {self._kept()}") from None
        finally:
            for each in pending:
                each.cancel()
            self.store.flush()

    def _kept(self) -> str:
        kept = self.before + self.done
        return (
            f"{kept} of {self.plan.count} points are kept in {self.store.path}, and "
            "`resume = True` computes the others."
        )

    def _next(self, tasks: Iterator[Task], pending: int) -> Iterator[Task]:
        """Yield tasks until each worker has some that wait; none once it is to stop."""
        while not self.stop() and pending < (1 + _QUEUED) * self.pool.workers:
            task = self._more.pop() if self._more else next(tasks, None)
            if task is None:
                return
            pending += 1
            yield task

    def _take(self, ready: "Future[list[Done]]") -> None:
        for each in ready.result():
            part = each.part
            if part.index in self._failed:
                continue
            if each.failure is not None:
                self._failed.add(part.index)
                self._sums.pop(part.index, None)
                self.failures.append((part.index, each.failure))
            elif each.tally is None:
                self._finish(each)
            else:
                self._add(part, each.tally)

    def _add(self, part: Part, tally: Tally) -> None:
        sums = self._sums.setdefault(part.index, _Sums())
        if not sums.add(part, tally) or sums.total is None:
            return
        del self._sums[part.index]
        profile = assembled(self.plan, part.index, sums.total)
        whole = Part(part.index)
        if self.plan.fit is None:
            self._finish(Done(whole, profile))
        else:
            self._more.append(Task((whole,), 0.0, code_version(), profile))

    def _finish(self, done: Done) -> None:
        self.store.add(done)
        self.done += 1
        if self.progress:
            at = self.plan.label(done.part.index)
            self.progress(self.before + self.done, self.plan.count, at)
