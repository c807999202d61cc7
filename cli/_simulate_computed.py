"""The methods without photons behind ``sssfit simulate``: computed, written, reported."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ._methods import METHODS
from ._report import say
from ._simulate_outputs import held, write_profile
from ._simulate_report import figures_of, report
from ._simulate_run import Request, Walk

if TYPE_CHECKING:
    from sssfit.material import Material
    from sssfit.profile import Profile


def run_computed(
    method: str,
    materials: list[Material],
    targets: list[Path | None],
    jobs: list[Walk],
    request: Request,
) -> None:
    """Compute, write each profile as it is there, and report; a target None is stdout.

    Ctrl-C and SIGTERM end the computation at once: what was written by then stays, and there is
    nothing half done worth keeping.
    """
    rows: dict[int, dict[str, Any]] = {}
    with held(targets, force=request.force):
        try:
            for group, settings in jobs:
                begun = time.perf_counter()
                profiles = _computed(method, [materials[k] for k in group], settings)
                seconds = time.perf_counter() - begun
                for k, profile in zip(group, profiles, strict=True):
                    write_profile(profile, targets[k])
                    rows[k] = figures_of(profile, seconds) | {"path": str(targets[k] or "-")}
        except KeyboardInterrupt:
            if not rows:
                raise
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


def _computed(method: str, materials: list[Material], settings: dict[str, Any]) -> list[Profile]:
    """Call the method's function, with all materials where it shares work between them."""
    from sssfit import simulate

    function = getattr(simulate, METHODS[method].function)
    if METHODS[method].shares:
        return list(function(materials, **settings))
    return [function(each, **settings) for each in materials]
