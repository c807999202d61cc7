"""The work of a sweep in tasks: what a worker does, wherever it runs.

A part is a whole point, or a range of a walk's batches; which ranges depends on the plan alone, so
that sums are made of the same parts with one worker or twenty. A task is one or several parts that
go to a worker together. `perform` is pure: a plan and a task give the same results everywhere.
"""

import contextlib
import io
import math
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from sssfit.errors import SweepError
from sssfit.messages import without_notes
from sssfit.methods import SIMULATIONS
from sssfit.profile import Profile
from sssfit.simulate.batches import (
    BATCH_PHOTONS,
    Tally,
    code_version,
    profile_of_tally,
    steps_per_photon,
    trace_range,
    walk_of,
)
from sssfit.simulate.half_space import covers
from sssfit.sweep.plan import Plan
from sssfit.sweep.plan_checks import in_keys

# At 4 to 6 ns a step a task takes two seconds, of which the 5 ms of client and scheduler are a
# four-hundredth, and at the end of a sweep no worker waits longer than that for another.
TASK_STEPS = 4e8
# What other methods take for a point, in such steps: .2 s and 1 s of the exact solvers, 5 ms.
_HALF_SPACE_STEPS, _STACK_STEPS, _DIFFUSION_STEPS = 4e7, 2e8, 1e6
_FIT_STEPS = 2e8
_TASKS_PER_WORKER = 8  # at least, where there are points enough


@dataclass(frozen=True, slots=True)
class Part:
    """A point, or the batches from ``first`` to before ``last`` of one of its walks.

    ``count`` is the number of parts of its point, ``number`` its own among them.
    """

    index: int
    number: int = 0
    count: int = 1
    first: int = 0
    last: int = 0


@dataclass(frozen=True, slots=True)
class Task:
    """Parts that a worker does in one go, and the code that it has to do them with.

    ``profile`` is there where the parts are done and only the fit is left.
    """

    parts: tuple[Part, ...]
    steps: float
    code: str
    profile: Profile | None = None


@dataclass(frozen=True, slots=True)
class Done:
    """The result of a part: a profile with its kernel's JSON, or a tally, or why there is none."""

    part: Part
    profile: Profile | None = None
    kernel: str | None = None
    tally: Tally | None = None
    failure: str | None = None


def point_steps(plan: Plan, index: int) -> float:
    """Predict the work of a point, in steps of a walk; without its fit."""
    if plan.photons is not None:
        return plan.photons * steps_per_photon(plan.material(index))
    if plan.method != "exact":
        return _DIFFUSION_STEPS
    material = plan.material(index)
    is_plain = covers(material, similarity=bool(plan.settings.get("similarity")))
    return material.n_channels * (_HALF_SPACE_STEPS if is_plain else _STACK_STEPS) / 3.0


def parts_of(plan: Plan, index: int, steps: float) -> list[Part]:
    """Return the parts of a point; of a walk, ranges of batches of about `TASK_STEPS` each."""
    if plan.photons is None:
        return [Part(index)]
    batches = math.ceil(plan.photons / BATCH_PHOTONS)
    size = max(1, round(batches * TASK_STEPS / steps))
    firsts = range(0, batches, size)
    return [
        Part(index, k, len(firsts), first, min(first + size, batches))
        for k, first in enumerate(firsts)
    ]


def tasks_of(plan: Plan, indices: Sequence[int], workers: int) -> Iterator[Task]:
    """Yield the tasks of some points, the longest points first; small points share a task."""
    code = code_version()
    steps = {index: point_steps(plan, index) for index in indices}
    full = min(TASK_STEPS, sum(steps.values()) / (_TASKS_PER_WORKER * workers))
    parts: list[Part] = []
    gathered, fit = 0.0, 0.0 if plan.fit is None else _FIT_STEPS
    for index in sorted(indices, key=lambda each: -steps[each]):
        for part in parts_of(plan, index, steps[index]):
            own = steps[index] / part.count + fit
            if parts and gathered + own > full:
                yield Task(tuple(parts), gathered, code)
                parts, gathered = [], 0.0
            parts.append(part)
            gathered += own
    if parts:
        yield Task(tuple(parts), gathered, code)


def prepare(plan: Plan) -> None:
    """Compile the walk of the first point, which each worker would otherwise do for itself."""
    if plan.photons is None:
        return
    with contextlib.suppress(ValueError, TypeError, ArithmeticError):  # a point that will fail
        walk_of(plan.material(0), plan.grid, *_walked(plan, 0)).prepare()


def perform(plan: Plan, task: Task) -> list[Done]:
    """Do a task on one thread.

    Raises
    ------
    SweepError
        This process has other code than the one that asks, and would make other bits.
    """
    check_code(task.code)
    with warnings.catch_warnings(), without_notes():
        warnings.simplefilter("ignore")  # what they warn of is in the figures: `unfinished`
        return [_done(plan, part, task.profile) for part in task.parts]


def check_code(code: str) -> None:
    """Raise SweepError where a process has other code than ``code``, and would make other bits."""
    if code != code_version():
        raise SweepError(
            f"a worker has other code of sssfit ({code_version()}) than the process that asks "
            f"({code}); install the same version on all machines."
        )


def _done(plan: Plan, part: Part, profile: Profile | None) -> Done:
    try:
        if profile is None and plan.photons is not None:
            walk = walk_of(plan.material(part.index), plan.grid, *_walked(plan, part.index))
            tally = trace_range(walk, part.first, part.last)
            if part.count > 1:
                return Done(part, tally=tally)
            profile = profile_of_tally(walk, tally)
        elif profile is None:
            profile = _solved(plan, part.index)
        kernel = None if plan.fit is None else kernel_text(profile, plan)
    except (ValueError, TypeError, ArithmeticError, np.linalg.LinAlgError) as error:
        return Done(part, failure=in_keys(error))
    return Done(part, profile, kernel)


def _walked(plan: Plan, index: int) -> tuple[int, int]:
    """Return the seed and the photons of a point's walk."""
    return plan.point_seed(index), plan.photons or 0


def assembled(plan: Plan, index: int, tally: Tally) -> Profile:
    """Return the profile of a point from the tally of all of its parts."""
    walk = walk_of(plan.material(index), plan.grid, *_walked(plan, index))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return profile_of_tally(walk, tally)


def _solved(plan: Plan, index: int) -> Profile:
    """Return the profile of a method without photons."""
    chosen, grid, material = SIMULATIONS[plan.method], plan.grid, plan.material(index)
    how = dict(plan.settings) | {"dr_mm": grid.dr_mm, "radius_mm": grid.radius_mm}
    if chosen.shares:
        (profile,) = chosen.load()([material], threads=1, **how)
    else:
        profile = chosen.load()(material, **how)
    found: Profile = profile
    return found


def kernel_text(profile: Profile, plan: Plan) -> str:
    """Return the JSON of the kernel that the plan's fit makes of a profile."""
    from sssfit.fit import fit_result  # which takes .5 s that most sweeps do not need

    stream = io.BytesIO()
    fit_result(profile, **dict(plan.fit or {})).kernel.write(stream)
    return stream.getvalue().decode()
