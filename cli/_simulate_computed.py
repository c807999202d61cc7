"""The methods without photons behind ``sssfit simulate``: computed, written, reported."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ._compiling import say_if_compiling
from ._methods import METHODS
from ._outputs import PROFILE, held
from ._report import say
from ._simulate_outputs import write_profile
from ._simulate_report import figures_of, report
from ._simulate_run import Request, Walk

if TYPE_CHECKING:
    from sssfit.material import Material
    from sssfit.profile import Profile
    from sssfit.simulate import ProfileSource


def run_computed(
    method: str,
    materials: Sequence[Material | ProfileSource],
    targets: list[Path | None],
    jobs: list[Walk],
    request: Request,
) -> None:
    """Compute, write each profile as it is there, and report; a target None is stdout.

    After Ctrl-C or SIGTERM what was written by then stays; nothing half done is worth keeping.
    """
    from sssfit.errors import StoppedError
    from sssfit.profile import is_profile_file

    from ._interrupt import asked_to_stop

    rows: dict[int, dict[str, Any]] = {}
    outputs = held(
        targets, is_profile_file, inputs=request.inputs, force=request.force, named=PROFILE
    )
    with asked_to_stop() as stop, outputs:
        if method == "exact":
            say_if_compiling(request.common, solver=True)
        for group, settings in jobs:
            begun = time.perf_counter()
            try:
                profiles = _computed(method, [materials[k] for k in group], settings, stop)
            except StoppedError:
                break
            seconds = time.perf_counter() - begun
            for k, profile in zip(group, profiles, strict=True):
                write_profile(profile, targets[k])
                rows[k] = figures_of(profile, seconds) | {"path": str(targets[k] or "-")}
        if not rows:
            raise KeyboardInterrupt
        _report(rows, materials, request)


def _computed(
    method: str,
    materials: Sequence[Material | ProfileSource],
    settings: dict[str, Any],
    stop: Callable[[], bool],
) -> list[Profile]:
    """Call the method's function; those that share work between materials can be stopped."""
    from sssfit import simulate
    from sssfit.errors import StoppedError

    function = getattr(simulate, METHODS[method].function)
    if METHODS[method].shares:
        return list(function(materials, stop=stop, **settings))
    if stop():
        raise StoppedError("stopped between two materials.")
    if METHODS[method].makes is not None:
        return [function(**settings)]
    return [function(each, **settings) for each in materials]


def _report(
    rows: dict[int, dict[str, Any]], materials: Sequence[Material | ProfileSource], request: Request
) -> None:
    """Print the figures; say what was not done, and exit 130 in that case."""
    missing = [each.name for k, each in enumerate(materials) if k not in rows]
    if missing:
        say(request.common, f"Interrupted. Not done: {', '.join(missing)}.")
    report(
        [rows[k] for k in sorted(rows)],
        several=request.several,
        common=request.common,
        interrupted=bool(missing),
    )
    if missing:
        sys.exit(130)
