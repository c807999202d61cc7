"""The parts of ``sssfit compare``: what is compared, its kernels and its budget, with progress."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sssfit.methods import DEON_SKIN

from ._input import load_source
from ._options import Common
from ._output import (
    check_outputs,
    finish,
    held,
    held_charts,
    say,
    say_notes,
    target,
    write,
    write_chart,
)
from ._progress import say_if_compiling, step_progress, walk_progress

if TYPE_CHECKING:
    from sssfit.compare.budget import Budget
    from sssfit.compare.comparison import Comparison
    from sssfit.material import Material
    from sssfit.profile import Profile
    from sssfit.scene.record import Scene

_PHOTONS = 10**6


@contextlib.contextmanager
def held_outputs(
    charts: Sequence[str | None],
    tables: Sequence[str | None],
    inputs: Sequence[str],
    given: Mapping[str, Any],
) -> Iterator[None]:
    """Check that everything can be written, and keep other runs off it, before the work begins."""
    from sssfit.compare.table import check_table_name, is_table_file

    written = [Path(each) for each in tables if each]
    for path in written:
        check_table_name(path)
    drawn = [target(each) for each in charts if each]
    check_outputs([*drawn, *written])
    with (
        held_charts(drawn, inputs=inputs, force=given["force"]),
        held(written, is_table_file, inputs=inputs, force=given["force"]),
    ):
        yield


def profile_of(source: Material | Profile, common: Common) -> Profile:
    """Return the true profile of a material, compiling the solver; a profile is its own."""
    from sssfit.profile import Profile
    from sssfit.simulate.truth import true_profile

    if isinstance(source, Profile):
        return source
    if source.is_semi_infinite:
        say_if_compiling(common, solver=True)
    return true_profile(source, threads=common.threads)


def scenes_of(
    names: Sequence[str], first: Profile | None, given: Mapping[str, Any], common: Common
) -> list[Scene]:
    """Make or read the pictures; ``first`` is the profile where its pixels were asked for."""
    from sssfit.fit import MM_PER_PIXEL, pitch_of
    from sssfit.scene.load import load_scenes

    asked = {key: given[key] for key in ("size", "layer", "mask")} | {"seed": common.seed}
    pitch = given["mm_per_pixel"] if first is None else pitch_of(first, "profile")
    scenes, notes = load_scenes(names, pitch, otherwise=MM_PER_PIXEL, **asked)
    say_notes(common, notes)
    return scenes


def compared(
    profile: Profile,
    scenes: Sequence[Scene],
    chart: str | None,
    table: str | None,
    given: Mapping[str, Any],
    common: Common,
) -> Comparison:
    """Fit and evaluate every kernel of a profile; write chart and table, which are held by now."""
    from sssfit.chart import figure_of
    from sssfit.compare import compare_kernels
    from sssfit.compare.comparison import check_error
    from sssfit.compare.table import table_text

    front = {key: given[key] for key in ("error", "cost")}
    check_error(given["error"], profile.n_channels)
    with step_progress(profile.material_name or "profile", quiet=common.quiet) as show:
        found = compare_kernels(profile, scenes, threads=common.threads, progress=show)
    if chart is not None:
        write_chart(figure_of(found, **front), target(chart))
    if table is not None:
        text = table_text(found, Path(table).suffix.lower(), **front)
        write(text.encode(), Path(table))
    return found


def check_budget(name: str) -> None:
    """Refuse a profile where a budget is all that was asked for: it has no light to trace."""
    from sssfit.errors import ProfileError

    if name == DEON_SKIN:
        raise ProfileError(f"{name} has no coefficients to simulate with; name a material.")
    if name == "-" or name.endswith(".npz"):
        raise ProfileError(
            f"{name} is a profile, and a budget simulates a material: name that, such as skin1 or "
            "a .toml file of your own."
        )


def budgets_of(
    name: str,
    source: Material | Profile,
    scenes: Sequence[Scene],
    settings: Mapping[str, Any],
    given: Mapping[str, Any],
    common: Common,
) -> list[Budget]:
    """Make the error budget on each picture, and draw it; ``settings`` are of the fit.

    Where there is none, that is said, unless it is all that was asked for.
    """
    from sssfit.chart import figure_of
    from sssfit.compare.budget import error_budgets
    from sssfit.errors import SimulationError
    from sssfit.material import Material

    is_all = given["what"] == "budget"
    if not isinstance(source, Material):
        say(common, f"No budget: {name} is a profile, and a budget simulates a material.")
        return []
    say_if_compiling(common, walk=source, solver=True)
    try:
        with walk_progress(source.name, quiet=common.quiet) as show:
            budgets = error_budgets(
                source,
                scenes,
                photons=given["photons"] or _PHOTONS,
                seed=common.seed,
                method=given["method"],
                settings=settings or None,
                model=given["model"],
                threads=common.threads,
                progress=show,
            )
    except SimulationError as error:
        if is_all:
            raise
        say(common, f"No budget: {error}")
        return []
    if given["budget_chart"] is not None:
        write_chart(figure_of(budgets), target(given["budget_chart"]))
    return budgets


def budget_and_kernels(
    name: str,
    pictures: Sequence[str],
    settings: Mapping[str, Any],
    given: Mapping[str, Any],
    common: Common,
) -> None:
    """Do both parts, or the one that was asked for, and print them; ``settings`` are of the fit."""
    from sssfit.compare.table import budget_text, kernels_text

    figures: dict[str, Any] = {"rows": []}
    front, what, texts = (given["error"], given["cost"]), given["what"], []
    if what == "budget":
        check_budget(name)
    charts = [given["chart"], given["budget_chart"]]
    with held_outputs(charts, [given["table"]], [name, *pictures], given):
        source = load_source(name)
        first = profile_of(source, common) if given["mm_per_pixel"] == "profile" else None
        scenes = scenes_of(pictures, first, given, common)
        if what != "budget":
            profile = first or profile_of(source, common)
            found = compared(profile, scenes, given["chart"], given["table"], given, common)
            figures = found.to_dict(*front)
            texts.append(kernels_text(found, *front))
        budgets = []
        if what != "kernels":
            budgets = budgets_of(name, source, scenes, settings, given, common)
    each = [one.to_dict() for one in budgets]
    budget = {**each[0], "rows": [row for one in each for row in one["rows"]]} if each else None
    output = [given[key] for key in ("budget_chart", "chart", "table") if given[key]]
    texts = [*map(budget_text, each), *texts, *([f"Wrote {', '.join(output)}"] if output else [])]
    whole = {"command": "compare", "output": output, **figures, "budget": budget}
    finish(common, whole, "\n\n".join(texts), to_stderr="-" in output)


def fronts(
    outputs: Mapping[str, tuple[str | None, str | None]],
    pictures: Sequence[str],
    given: Mapping[str, Any],
    common: Common,
) -> None:
    """Compare the kernels of materials, print their fronts, and write a chart and a table of each.

    ``outputs`` has chart and table by the name of the material. Of --all, one that fails is named
    at the end, and the others are done.
    """
    from sssfit.compare.table import fronts_text, left_out_lines
    from sssfit.errors import FitError, SssfitError

    done, wrote, failed = [], [], []
    charts, tables = zip(*outputs.values(), strict=True)
    several = given["every"] or given["paper"]
    inputs = [*([] if several else outputs), *pictures]
    with held_outputs(charts, tables, inputs, given):
        first = None
        if given["mm_per_pixel"] == "profile":  # of one material, as was checked
            first = profile_of(load_source(next(iter(outputs))), common)
        scenes = scenes_of(pictures, first, given, common)
        for name, files in outputs.items():
            try:
                profile = first or profile_of(load_source(name), common)
                done.append(compared(profile, scenes, *files, given, common))
                wrote += [each for each in files if each]
            except SssfitError as error:
                if not several:
                    raise
                failed.append(f"{name}: {error}")
    if done:
        say_notes(common, [line for each in done for line in left_out_lines(each)])
        figures = {
            "command": "compare",
            "output": wrote,
            "error": given["error"],
            "cost": given["cost"],
            "materials": [each.profile.material_name for each in done],
            "rows": [row for each in done for row in each.to_dict()["rows"]],
        }
        text = fronts_text(done, given["error"], given["cost"])
        text += f"\nWrote {', '.join(wrote)}" if wrote else ""
        finish(common, figures, text, to_stderr="-" in wrote)
    if failed:
        raise FitError(f"{len(failed)} of {len(outputs)} materials failed; {' '.join(failed)}")
