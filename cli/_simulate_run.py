"""The walks behind ``sssfit simulate``: outputs checked and locked, walked, saved, resumed."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ._compiling import say_if_compiling
from ._options import Common
from ._outputs import PROFILE, held
from ._report import say
from ._simulate_outputs import write_profile
from ._simulate_report import figures_of, report

if TYPE_CHECKING:
    from sssfit.material import Material
    from sssfit.profile import Profile
    from sssfit.simulate import Checkpoint, Progress


# Indices of the materials that share a walk, and the keywords of simulate_montecarlo_many.
Walk = tuple[list[int], dict[str, Any]]


@dataclass(frozen=True, slots=True)
class Request:
    """What was asked for, beside materials and their settings; the last two are the walk's."""

    force: bool
    several: bool
    common: Common
    inputs: tuple[str, ...] = ()
    checkpoint_every: float = 0.0
    resume: bool = False


@dataclass(frozen=True, slots=True)
class _Outcome:
    """Figures of one profile, whether its walk came to its end, whether a checkpoint is kept."""

    figures: dict[str, Any]
    is_complete: bool
    goes_on: bool


def run_walks(
    materials: list[Material], targets: list[Path | None], walks: list[Walk], request: Request
) -> None:
    """Walk, write each profile as its walk ends, and report; a target None is stdout."""
    from sssfit.errors import StoppedError
    from sssfit.profile import is_profile_file

    from ._interrupt import asked_to_stop

    rows: dict[int, _Outcome] = {}
    outputs = held(
        targets, is_profile_file, inputs=request.inputs, force=request.force, named=PROFILE
    )
    with asked_to_stop() as stop, outputs:
        _check_checkpoints([targets[group[0]] for group, _ in walks], request)
        for group, settings in walks:
            own = [materials[k] for k in group], [targets[k] for k in group], settings
            try:
                found = _walk_group(*own, request, stop)
            except StoppedError:
                break
            rows |= zip(group, found, strict=True)
        if not rows:
            raise KeyboardInterrupt
        _report(rows, materials, request)


def _report(rows: dict[int, _Outcome], materials: list[Material], request: Request) -> None:
    """Print the figures; say what was interrupted or not begun, and exit 130 in that case."""
    outcomes = [rows[k] for k in sorted(rows)]
    missing = [each.name for k, each in enumerate(materials) if k not in rows]
    interrupted = bool(missing) or not all(each.is_complete for each in outcomes)
    if interrupted:
        how = "; --resume goes on from there" if any(each.goes_on for each in outcomes) else ""
        left = f" Not begun: {', '.join(missing)}." if missing else ""
        say(
            request.common,
            f"Interrupted: what was done by then is saved, with its true photon count{how}.{left}",
        )
    report(
        [each.figures for each in outcomes],
        several=request.several,
        common=request.common,
        interrupted=interrupted,
    )
    if interrupted:
        sys.exit(130)


def _walk_group(
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
        say(request.common, f"There is no {checkpoint.path} to go on from: starting.")
    profiles, seconds = _walk(materials, settings, request, checkpoint, stop)
    for profile, target in zip(profiles, targets, strict=True):
        try:
            write_profile(profile, target)
        except FileError as error:
            if checkpoint is None or not checkpoint.is_ours():
                raise
            raise FileError(
                f"{str(error).rstrip('.')}; {checkpoint.path} is kept: --resume goes on from it."
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


def _walk(
    materials: list[Material],
    settings: dict[str, Any],
    request: Request,
    checkpoint: Checkpoint | None,
    stop: Callable[[], bool],
) -> tuple[list[Profile], float]:
    """One walk for all ``materials``, with a progress bar; the profiles and seconds of walking."""
    from sssfit.simulate import simulate_montecarlo_many

    from ._progress import walk_progress

    common = request.common
    last: list[Progress] = []
    say_if_compiling(common, walk=materials[0])
    label = materials[0].name if len(materials) == 1 else f"{len(materials)} materials"
    resumes = request.resume and checkpoint is not None and checkpoint.path.exists()
    with walk_progress(label, quiet=common.quiet) as show:

        def note(now: Progress) -> None:
            if resumes and not last and checkpoint:
                say(common, f"Going on from {checkpoint.path}: {now.photons_done:,} photons done.")
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
    from sssfit.simulate import is_complete

    figures = figures_of(profile, seconds) | {"path": str(target or "-")}
    return _Outcome(figures, is_complete(profile), goes_on)
