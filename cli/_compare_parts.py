"""The parts of ``sssfit compare``: computed, written, and put into figures and words."""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sssfit.methods import DEON_SKIN

from ._compare_input import material_of, profile_of, scenes_of
from ._compare_report import budget_text, fronts_text, kernels_text, sheet_text
from ._options import Common
from ._output import (
    check_outputs,
    finish,
    finish_one,
    held,
    held_charts,
    say,
    target,
    write,
    write_chart,
)
from ._progress import say_if_compiling, step_progress, walk_progress

if TYPE_CHECKING:
    from sssfit.compare.comparison import Comparison
    from sssfit.profile import Profile
    from sssfit.scene.record import Scene

PICTURES = "disk,edge,points,head"
_PHOTONS = 10**6

Part = tuple[dict[str, Any], str]  # figures, and the same for people


def first_read(name: str, given: Mapping[str, Any], common: Common) -> Profile | None:
    """Return the profile where the pictures are made on its pixels, so that it is read first."""
    return profile_of(name, common) if given["mm_per_pixel"] == "profile" else None


def scenes_asked(
    given: Mapping[str, Any], common: Common, profile: Profile | None = None
) -> tuple[list[Scene], float]:
    """Make or read the pictures that were asked for; the size of their pixels [mm].

    ``profile`` is there where its pixels were asked for.
    """
    from sssfit.fit import pitch_of

    pitch = given["mm_per_pixel"] if profile is None else pitch_of(profile, "profile")
    options = given["size"], pitch, common
    return scenes_of(names_of(given), *options, layer=given["layer"], mask=given["mask"])


def names_of(given: Mapping[str, Any]) -> list[str]:
    """Return the pictures that were asked for, by name or file."""
    return [name for each in given["pictures"] or (PICTURES,) for name in each.split(",")]


@contextlib.contextmanager
def held_outputs(
    charts: Sequence[str],
    tables: Sequence[str],
    given: Mapping[str, Any],
    *,
    inputs: Sequence[str] = (),
) -> Iterator[None]:
    """Check that everything can be written, and keep other runs off it, before the work begins."""
    from sssfit.compare.table import FORMATS, is_table_file
    from sssfit.errors import FileError

    for name in tables:
        if Path(name).suffix.lower() not in FORMATS:
            raise FileError(
                f"{name}: tables are Markdown, CSV or JSON; end it in .md, .csv or .json."
            )
    drawn, written = [target(each) for each in charts], [Path(each) for each in tables]
    check_outputs([*drawn, *written])
    read = [*inputs, *names_of(given)]
    with (
        held_charts(drawn, inputs=read, force=given["force"]),
        held(written, is_table_file, inputs=read, force=given["force"]),
    ):
        yield


def compared(
    profile: Profile,
    scenes: tuple[list[Scene], float],
    given: Mapping[str, Any],
    common: Common,
) -> Comparison:
    """Fit and judge every kernel of a profile, with a progress bar in a terminal."""
    from sssfit.compare import compare_kernels
    from sssfit.compare.comparison import check_error

    check_error(given["error"], profile.n_channels)
    with step_progress(profile.material_name or "profile", quiet=common.quiet) as show:
        return compare_kernels(
            profile,
            scenes[0],
            mm_per_pixel=scenes[1],
            threads=common.threads,
            progress=show,
        )


def write_kernels(
    comparison: Comparison, given: Mapping[str, Any], chart: str | None, table: str | None
) -> None:
    """Write chart and table, each whole or not at all; they are held by now."""
    from sssfit.chart.pareto import pareto_figure
    from sssfit.compare.table import table_text

    front = given["error"], given["cost"]
    if chart is not None:
        write_chart(pareto_figure(comparison, error=front[0], cost=front[1]), target(chart))
    if table is not None:
        text = table_text(comparison, Path(table).suffix.lower(), *front)
        write(text.encode(), Path(table))


def kernels(comparison: Comparison, given: Mapping[str, Any]) -> Part:
    """Put a comparison into figures, with what the verdict is made from, and into words."""
    from sssfit.compare.comparison import verdicts

    front = given["error"], given["cost"]
    figures = {
        "error": front[0],
        "cost": front[1],
        **comparison.to_dict(),
        "verdict": [dataclasses.asdict(each) for each in verdicts(comparison, *front)],
    }
    return figures, kernels_text(comparison, *front)


def fronts(
    outputs: Mapping[str, Sequence[str | None]], given: Mapping[str, Any], common: Common
) -> None:
    """Compare the kernels of materials, print their fronts, and write a chart and a table of each.

    ``outputs`` has chart and table by the name of the material. Of several, one that fails is named
    at the end, and the others are done.
    """
    from sssfit.errors import FitError, SssfitError

    done: list[Comparison] = []
    wrote: list[str] = []
    failed: list[str] = []
    charts, tables = (
        [each for each in column if each] for column in zip(*outputs.values(), strict=True)
    )
    with held_outputs(charts, tables, given, inputs=() if given["every"] else list(outputs)):
        first = None if given["every"] else first_read(next(iter(outputs)), given, common)
        scenes = scenes_asked(given, common, first)
        for name, (chart, table) in outputs.items():
            try:
                profile = first or profile_of(name, common)
                done.append(compared(profile, scenes, given, common))
                write_kernels(done[-1], given, chart, table)
            except SssfitError as error:
                if not given["every"]:
                    raise
                failed.append(f"{name}: {error}")
            else:
                wrote += [each for each in (chart, table) if each]
    if done:
        _finish_fronts(done, wrote, given, common)
    if failed:
        raise FitError(f"{len(failed)} of {len(outputs)} materials failed; {' '.join(failed)}")


def _finish_fronts(
    done: Sequence[Comparison], wrote: list[str], given: Mapping[str, Any], common: Common
) -> None:
    """Print the fronts; with ``--json`` all rows."""
    for comparison in done:
        for label, reason in comparison.left_out:
            say(common, f"Left out {label}: {reason}")
    figures: dict[str, Any] = {
        "command": "compare",
        "output": wrote,
        "error": given["error"],
        "cost": given["cost"],
        "materials": [comparison.profile.material_name for comparison in done],
        "rows": [row for comparison in done for row in comparison.to_dict()["rows"]],
    }
    text = fronts_text(done, given["error"], given["cost"])
    text += f"\nWrote {', '.join(wrote)}" if wrote else ""
    finish(common, figures, text, to_stderr="-" in wrote)


def budget(
    name: str,
    scenes: Sequence[Scene],
    given: Mapping[str, Any],
    settings: Mapping[str, Any],
    common: Common,
) -> Part | None:
    """Make the error budget on each picture and draw it if asked to; the chart is held by now.

    Where there is none, that is said, unless it is all that was asked for. ``settings`` are of the
    fit.
    """
    from sssfit.errors import SimulationError

    is_all = given["what"] == "budget"
    if not is_all and (name.endswith(".npz") or name in ("-", DEON_SKIN)):
        say(common, f"No budget: {name} is a profile, and a budget simulates a material.")
        return None
    try:
        return _budget(name, scenes, given, settings, common)
    except SimulationError as error:
        if is_all:
            raise
        say(common, f"No budget: {error}")
        return None


def _budget(
    name: str,
    scenes: Sequence[Scene],
    given: Mapping[str, Any],
    settings: Mapping[str, Any],
    common: Common,
) -> Part:
    from sssfit.chart.budget import budget_figure
    from sssfit.compare.budget import error_budgets

    material = material_of(name)
    say_if_compiling(common, walk=material, solver=True)
    with walk_progress(material.name, quiet=common.quiet) as show:
        budgets = error_budgets(
            material,
            scenes,
            photons=given["photons"] or _PHOTONS,
            seed=common.seed,
            method=given["method"],
            settings=settings or None,
            model=given["model"],
            threads=common.threads,
            progress=show,
        )
    if given["budget_chart"] is not None:
        write_chart(budget_figure(budgets), target(given["budget_chart"]))
    each = [one.to_dict() for one in budgets]
    figures = {**each[0], "rows": [row for one in each for row in one["rows"]]}
    return figures, "\n\n".join(budget_text(one) for one in budgets)


def sheet(name: str, given: Mapping[str, Any], common: Common) -> None:
    """Draw a contact sheet of a profile's kernels, and print its figures."""
    from sssfit.chart.sheet import sheet_figure
    from sssfit.compare.sheet import compute_sheet

    path, pitch = target(given["chart"]), given["mm_per_pixel"]
    with held_charts([path], inputs=[name], force=given["force"]):
        profile = profile_of(name, common)
        found = compute_sheet(profile, mm_per_pixel=pitch, threads=common.threads)
        write_chart(sheet_figure(found), path)
    told = found.to_dict()
    finish_one(common, "compare", path, told, sheet_text(told), "a PNG")
