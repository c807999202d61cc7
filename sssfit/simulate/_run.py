"""A run: batches on threads, summed in order, saved at intervals, and ended at the target.

The end of a run depends on its seed and never on threads or the clock: the target error is checked
after whole batches, at fixed numbers of batches.
"""

import math
from collections import deque
from collections.abc import Callable, Generator, Iterator, Mapping
from concurrent.futures import Future
from contextlib import closing, contextmanager
from dataclasses import dataclass
from datetime import timedelta
from time import perf_counter

from sssfit._jit import thread_pool
from sssfit.arrays import FloatArray
from sssfit.errors import SimulationError, SweepError
from sssfit.simulate._checkpoint import Checkpoint, State
from sssfit.simulate._elsewhere import Elsewhere, from_elsewhere
from sssfit.simulate._walks import BATCH_PHOTONS, Tally, Walk, relative_errors

REPORT_SECONDS = 0.1
# A channel that returned no light in as many photons as a default run has would need 10 000 times
# more for an error of 1 %.
HOPELESS_PHOTONS = 10_000_000


@dataclass(frozen=True, slots=True)
class Progress:
    """Progress of a walk: photons done and in total, seconds, and the relative error so far.

    With a target error ``photons`` is an estimate, assuming that the error falls as 1/sqrt(N), and
    at most the limit. ``relative_error`` is that of the last check: the largest standard error of F
    over all annulus edges, as a share of F at the last edge, of the worst channel; infinite until
    every channel has energy on its grid. A resumed walk counts its earlier photons and seconds.
    """

    photons_done: int
    photons: int
    seconds: float
    relative_error: float

    def time_left(self, first: "Progress") -> str:
        """Return how long the rest takes at the rate since the ``first`` report, as h:mm:ss.

        That rate knows neither compilation nor earlier sittings.
        """
        done = self.photons_done - first.photons_done
        if self.photons == self.photons_done:
            return "0:00:00"
        if done <= 0:
            return "-:--:--"
        rest = (self.photons - self.photons_done) / done * (self.seconds - first.seconds)
        return str(timedelta(seconds=round(rest)))


@dataclass(frozen=True, slots=True)
class EndCondition:
    """The end of a run: a number of photons, or a check that finds the target error met."""

    photons: int
    target_error: float | None = None

    def is_reached(self, photons_done: int, error: float) -> bool:
        """Return whether a run with these photons and this error is complete."""
        if photons_done >= self.photons:
            return True
        return self.is_met(error) and is_check(photons_done)

    def is_met(self, error: float) -> bool:
        """Return whether an error is under the target; False without a target."""
        return self.target_error is not None and error < self.target_error

    def expected_photons(self, photons_done: int, error: float) -> int:
        """Estimate the total number of photons: N (error / target)^2, at most the limit."""
        if self.target_error is None or math.isinf(error):
            return self.photons
        ratio = max(1.0, error / self.target_error)
        return math.ceil(min(float(self.photons), photons_done * ratio * ratio))


def is_check(photons: int) -> bool:
    """Whether the error is checked after this many photons: whole batches, 32 times per doubling.

    A run overshoots its target by at most 1 in 32; skin1's checks take 0.4 % of a thousand batches.
    """
    batches, rest = divmod(photons, BATCH_PHOTONS)
    return rest == 0 and batches % (1 << max(0, batches.bit_length() - 6)) == 0


@dataclass(slots=True)
class _Monitor:
    """Checks between batches: the error, the end of the run, and progress reports."""

    task: Walk
    ending: EndCondition
    state: State
    progress: Callable[[Progress], None] | None
    error: float = math.inf
    reported: float = -math.inf

    def check_error(self) -> None:
        """Update the error if a check is due, or at the end."""
        photons = self.state.tally.photons
        if not is_check(photons) and photons < self.ending.photons:
            return
        errors = relative_errors(self.task, self.state.tally)
        self.error = float(errors.max())
        self.state.least_error = min(self.state.least_error, self.error)
        if self.ending.target_error is not None and photons >= HOPELESS_PHOTONS:
            _check_target_is_reachable(self.task, photons, errors)

    def is_finished(self) -> bool:
        """Whether the run is complete."""
        return self.ending.is_reached(self.state.tally.photons, self.error)

    def report(self, *, now: bool = False) -> None:
        """Report the progress: ``now``, or if the last report is long enough ago."""
        photons = self.state.tally.photons
        is_due = now or self.state.seconds - self.reported > REPORT_SECONDS
        if self.progress and photons and is_due:
            self.reported = self.state.seconds
            expected = self.ending.expected_photons(photons, self.error)
            self.progress(Progress(photons, expected, self.state.seconds, self.error))


def run(
    task: Walk,
    threads: int,
    progress: Callable[[Progress], None] | None = None,
    stop: Callable[[], bool] | None = None,
    *,
    target_error: float | None = None,
    checkpoint: Checkpoint | None = None,
    settings: Mapping[str, str] | None = None,
    elsewhere: Elsewhere | None = None,
) -> Tally:
    """Walk batches on ``threads`` threads until the photons are done or the target is met.

    Ends early, after a whole batch, when ``stop`` returns true. ``settings`` must agree with those
    of a checkpoint. ``elsewhere`` traces the batches in place of the threads; the order in which
    they are added, and so every bit, is the same.
    """
    ending = EndCondition(task.photons, target_error)
    state = State(task.empty_tally())
    if checkpoint:
        state = checkpoint.start_state(state.tally, settings or {}, task.materials)
        _check_not_finished(checkpoint, state, ending)
    monitor = _Monitor(task, ending, state, progress)
    if state.tally.photons:
        monitor.check_error()
        monitor.report(now=True)
    begun = perf_counter() - state.seconds
    if elsewhere is None:
        source = _in_order(task, threads, stop, state.tally.photons)
    else:
        source = from_elsewhere(task, elsewhere, stop, state.tally.photons)
    with _saving(checkpoint, state), closing(source) as tallies:
        for tally in tallies:
            state.tally.add(tally)
            state.seconds = perf_counter() - begun
            monitor.check_error()
            if monitor.is_finished():
                break
            monitor.report()
            if checkpoint:
                checkpoint.save_if_due(state)
    monitor.report(now=True)
    if checkpoint and state.tally.photons and not monitor.is_finished():
        checkpoint.save_at_stop(state)
    return state.tally


def _in_order(
    task: Walk, threads: int, stop: Callable[[], bool] | None, photons_done: int
) -> Generator[Tally]:
    """Yield the tallies of the remaining batches in order, while a few more are computed."""
    batches = iter(range(photons_done // BATCH_PHOTONS, -(-task.photons // BATCH_PHOTONS)))
    pending: deque[Future[Tally]] = deque()
    with thread_pool(threads, "sssfit-walk", task.prepare) as pool:
        try:
            stopped = False
            while True:
                stopped = stopped or (stop is not None and stop())
                # Two per thread keep every core busy and limit the memory for any number of
                # photons.
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


@contextmanager
def _saving(checkpoint: Checkpoint | None, state: State) -> Iterator[None]:
    """Save what was done where the machines that go on with it are lost."""
    try:
        yield
    except SweepError as error:
        if checkpoint is None or not state.tally.photons:
            raise
        checkpoint.save_at_stop(state)
        raise SweepError(
            f"{str(error).rstrip('.')}; {checkpoint.path} keeps {state.tally.photons:,} photons, "
            "and `resume = True` continues from there."
        ) from None


def _check_not_finished(checkpoint: Checkpoint, state: State, ending: EndCondition) -> None:
    """Raise an error if a run with these settings from the start would have ended earlier."""
    done = state.tally.photons
    if done > ending.photons:
        why = f"more than the {ending.photons:,} asked for"
    elif ending.is_met(state.least_error):
        why = f"more than a target error of {100.0 * (ending.target_error or 0.0):g} % takes"
    else:
        return
    raise SimulationError(
        f"{checkpoint.path} holds {done:,} photons, {why}; take them all with "
        f"`photons = {done}` alone, or start a new run with `resume = False`."
    )


def _check_target_is_reachable(task: Walk, photons: int, errors: FloatArray) -> None:
    """Raise an error that names the channel if it cannot reach the target error."""
    names = [f"{each.name} {name}" for each in task.materials for name in each.channels]
    silent = [name for name, error in zip(names, errors, strict=True) if math.isinf(error)]
    if silent:
        raise SimulationError(
            f"{photons:,} photons returned nothing within the grid in {', '.join(silent)}: no "
            "target error is in reach; widen the grid with `radius_mm`, or leave "
            "`target_error` out."
        )
