"""``sssfit sweep``: a plan of many points to one store of profiles."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from sssfit.messages import note

from ._options import Common, common_options, options, refuse
from ._output import finish, stem_of
from ._progress import step_progress
from ._verb_options import SWEEP


@click.command(short_help="Simulate all points of a plan.")
@click.argument("plan")
@options(*SWEEP)
@common_options
@click.pass_context
def sweep(context: click.Context, /, plan: str, common: Common, **given: Any) -> None:
    """Simulate every point of PLAN and store the profiles in one Zarr folder.

    PLAN is a TOML file: a base material, axes over its coefficients (lists, ranges, tables of
    wavelengths in CSV), the method and, if kernels are wanted, a [fit]. Results are the same bits
    with any number of workers, here or on a cluster. xarray opens the store. A sweep that was
    killed or stopped keeps every finished point, and --resume computes the others.

    \b
      sssfit sweep plan.toml --dry-run
      sssfit sweep plan.toml -o skin.zarr
      sssfit sweep plan.toml -o skin.zarr --resume
      sssfit sweep plan.toml --scheduler tcp://10.0.0.5:8786
    """
    if given["resume"] and given["force"]:
        raise click.UsageError("--resume continues the store and --force replaces it; give one.")
    if given["dry_run"]:
        refuse(given, dict.fromkeys(("output", "resume", "force"), "a sweep that is not dry"))
    from sssfit.process import asked_to_stop
    from sssfit.sweep import estimate, load_plan, sweep_to_store

    is_given = context.get_parameter_source("seed") is ParameterSource.COMMANDLINE
    loaded = load_plan(plan, seed=common.seed if is_given else None)
    where = {"threads": common.threads, "scheduler": given["scheduler"]}
    if given["dry_run"]:
        expected = estimate(loaded, **where)
        finish(common, expected.to_dict(), expected.text())
        return
    path = Path(given["output"] or f"{stem_of(plan)}.zarr")
    how = {"resume": given["resume"], "force": given["force"]}
    with asked_to_stop() as stop, step_progress("points") as step:
        found = sweep_to_store(loaded, path, **where, **how, stop=stop, progress=step)
    is_stopped = not found.is_complete and not found.failures
    if is_stopped:
        note("Interrupted: finished points are kept; `resume = True` computes the others.")
    finish(common, {"output": [str(path)], **found.to_dict()}, f"{found.text()}\nWrote {path}")
    if found.failure:
        raise click.ClickException(found.failure)
    if is_stopped:
        sys.exit(130)
