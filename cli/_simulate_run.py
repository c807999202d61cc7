"""The runs behind ``sssfit simulate``: outputs held, profiles computed, saved, resumed, told."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sssfit.methods import SIMULATIONS

from ._options import Common
from ._output import PROFILE, held, say, write
from ._progress import say_if_compiling, walk_progress
from ._simulate_report import report

if TYPE_CHECKING:
    from sssfit.material import Material
    from sssfit.profile import Profile
    from sssfit.simulate import Checkpoint, ProfileSource, Progress


# Indices of the materials that share a run, and the keywords of the method's function.
Job = tuple[list[int], dict[str, Any]]
Made = Sequence["Material | ProfileSource"]


@dataclass(frozen=True, slots=True)
class Request:
    """What was asked for, beside materials and their settings; the last two are a walk's."""

    method: str
    force: bool
    several: bool
    common: Common
    inputs: tuple[str, ...] = ()
    checkpoint_every: float = 0.0
    resume: bool = False

    @property
    def is_walk(self) -> bool:
        """Whether photons are traced: only a walk is saved half done, and goes on."""
        return self.method == "montecarlo"


@dataclass(frozen=True, slots=True)
class _Outcome:
    """Figures of one profile, whether its run came to its end, whether a checkpoint is kept."""

    figures: dict[str, Any]
    is_complete: bool
    goes_on: bool


def run(materials: Made, targets: list[Path | None], jobs: list[Job], request: Request) -> None:
    """Compute, write each profile as its run ends, and report; a target None is stdout.

    After Ctrl-C or SIGTERM what was written by then stays, and a walk is saved as far as it came.
    """
    from sssfit.errors import StoppedError
    from sssfit.process import asked_to_stop
    from sssfit.profile import is_profile_file

    rows: dict[int, _Outcome] = {}
    outputs = held(
        targets, is_profile_file, inputs=request.inputs, force=request.force, named=PROFILE
    )
    with asked_to_stop() as stop, outputs:
        if request.is_walk:
            _check_checkpoints([targets[group[0]] for group, _ in jobs], request)
        if request.method == "exact":
            say_if_compiling(request.common, solver=True)
        one_run: Callable[..., list[_Outcome]] = _walk if request.is_walk else _computed
        for group, settings in jobs:
            own = [materials[k] for k in group], [targets[k] for k in group], settings
            try:
                found = one_run(*own, request, stop)
            except StoppedError:
                break
            rows |= zip(group, found, strict=True)
        if not rows:
            raise KeyboardInterrupt
        _report(rows, materials, request)


def _report(rows: dict[int, _Outcome], materials: Made, request: Request) -> None:
    """Print the figures; say what was interrupted or not begun, and exit 130 in that case."""
    outcomes = [rows[k] for k in sorted(rows)]
    missing = ", ".join(each.name for k, each in enumerate(materials) if k not in rows)
    interrupted = bool(missing) or not all(each.is_complete for each in outcomes)
    if interrupted and request.is_walk:
        how = "; --resume continues from there" if any(each.goes_on for each in outcomes) else ""
        left = f" Not begun: {missing}." if missing else ""
        say(
            request.common,
            f"Interrupted: the photons traced so far are saved, with their true count{how}.{left}",
        )
    elif interrupted:
        say(request.common, f"Interrupted. Not done: {missing}.")
    report(
        [each.figures for each in outcomes],
        several=request.several,
        common=request.common,
        interrupted=interrupted,
    )
    if interrupted:
        sys.exit(130)


def _computed(
    materials: Made,
    targets: list[Path | None],
    settings: dict[str, Any],
    request: Request,
    stop: Callable[[], bool],
) -> list[_Outcome]:
    """One call of the method's function; those that share work between materials can be stopped."""
    from sssfit.errors import StoppedError

    method, begun = SIMULATIONS[request.method], time.perf_counter()
    function = method.load()
    if method.shares:
        profiles = list(function(materials, stop=stop, **settings))
    elif stop():
        raise StoppedError("stopped between two materials.")
    else:
        given = [()] if method.makes is not None else [(each,) for each in materials]
        profiles = [function(*each, **settings) for each in given]
    seconds = time.perf_counter() - begun
    for profile, target in zip(profiles, targets, strict=True):
        write(profile, target)
    return [_outcome(*each, seconds) for each in zip(profiles, targets, strict=True)]


def _walk(
    materials: list[Material],
    targets: list[Path | None],
    settings: dict[str, Any],
    request: Request,
    stop: Callable[[], bool],
) -> list[_Outcome]:
    """One walk and its profiles written."""
    from sssfit.errors import FileError
    from sssfit.simulate import is_complete

    checkpoint = _checkpoint(targets[0], request)
    if request.resume and checkpoint and not checkpoint.path.exists():
        if profiles := _finished(materials, targets, settings):
            return [_outcome(*each, None) for each in zip(profiles, targets, strict=True)]
        say(request.common, f"No {checkpoint.path} to continue from: starting a new run.")
    profiles, seconds = _walked(materials, settings, request, checkpoint, stop)
    for profile, target in zip(profiles, targets, strict=True):
        try:
            write(profile, target)
        except FileError as error:
            if checkpoint is None or not checkpoint.is_ours():
                raise
            raise FileError(
                f"{str(error).rstrip('.')}; {checkpoint.path} is kept: --resume continues from it."
            ) from None
    if checkpoint and is_complete(profiles[0]):
        checkpoint.remove()
    goes_on = checkpoint is not None and checkpoint.is_ours()
    return [_outcome(*each, seconds, goes_on) for each in zip(profiles, targets, strict=True)]


def _check_checkpoints(targets: list[Path | None], request: Request) -> None:
    """Refuse to save a walk over a file of somebody else's; going on from one is refused anyway."""
    from sssfit.files import check_output
    from sssfit.simulate import is_checkpoint_file

    for target in targets:
        if target is not None and not request.resume:
            path = _checkpoint_path(target)
            check_output(path, is_checkpoint_file, force=request.force, inputs=request.inputs)


def _checkpoint_path(target: Path) -> Path:
    return target.with_name(f"{target.name}.checkpoint")


def _checkpoint(target: Path | None, request: Request) -> Checkpoint | None:
    """Beside the walk's first output, and so under its lock; none where that is stdout."""
    from sssfit.simulate import Checkpoint

    if target is None:
        return None
    return Checkpoint(_checkpoint_path(target), request.checkpoint_every, resume=request.resume)


def _finished(
    materials: list[Material], targets: list[Path | None], settings: dict[str, Any]
) -> list[Profile]:
    """Return the profiles of this very walk if all are there, complete; else none."""
    from sssfit.errors import ProfileError
    from sssfit.profile import Profile
    from sssfit.simulate import is_finished

    try:
        profiles = [Profile.load(target) for target in targets if target and target.exists()]
    except ProfileError:
        return []
    done = [is_finished(each, k, materials, **settings) for k, each in enumerate(profiles)]
    return profiles if len(done) == len(materials) and all(done) else []


def _walked(
    materials: list[Material],
    settings: dict[str, Any],
    request: Request,
    checkpoint: Checkpoint | None,
    stop: Callable[[], bool],
) -> tuple[list[Profile], float]:
    """One walk for all ``materials``, with a progress bar; the profiles and seconds of walking."""
    from sssfit.simulate import simulate_montecarlo_many

    common = request.common
    last: list[Progress] = []
    say_if_compiling(common, walk=materials[0])
    label = materials[0].name if len(materials) == 1 else f"{len(materials)} materials"
    resumes = request.resume and checkpoint is not None and checkpoint.path.exists()
    with walk_progress(label, quiet=common.quiet) as show:

        def note(now: Progress) -> None:
            if resumes and not last and checkpoint:
                say(
                    common, f"Continuing from {checkpoint.path}: {now.photons_done:,} photons done."
                )
            last[:] = [now]
            if show:
                show(now)

        profiles = simulate_montecarlo_many(
            materials,
            threads=common.threads,
            progress=note,
            stop=stop,
            checkpoint=checkpoint,
            **settings,
        )
    return profiles, last[-1].seconds


def _outcome(
    profile: Profile, target: Path | None, seconds: float | None, goes_on: bool = False
) -> _Outcome:
    from sssfit.simulate import is_complete, run_figures

    figures = run_figures(profile, seconds) | {"path": str(target or "-")}
    return _Outcome(figures, profile.photons is None or is_complete(profile), goes_on)
