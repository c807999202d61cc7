"""All that ``sssfit compare`` tells of a material, a part at a time, in figures and in words.

The parts are records: kernels by error and cost (``pareto``), error budgets (``budget``) and a
contact sheet (``sheet``); ``table`` writes them in words, ``sssfit.chart`` draws them.
"""

from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from typing import Any

from sssfit.compare.budget import PHOTONS, Budget, error_budgets
from sssfit.compare.comparison import Comparison, check_error
from sssfit.compare.pareto import compare_kernels
from sssfit.compare.presets import PresetComparison, compare_presets
from sssfit.compare.sheet import Sheet, compute_sheet
from sssfit.compare.table import (
    budget_text,
    fronts_text,
    kernels_text,
    left_out_lines,
    sheet_text,
)
from sssfit.errors import FitError, ProfileError, RenderError, SimulationError
from sssfit.fit import MM_PER_PIXEL, Pitch, pitch_of
from sssfit.material import Material
from sssfit.messages import note
from sssfit.methods import DEON_SKIN
from sssfit.profile import Profile
from sssfit.scene.load import load_scenes
from sssfit.scene.record import Scene
from sssfit.simulate.truth import true_profile

Part = Comparison | list[Budget] | Sheet | PresetComparison
Watch = Callable[[str], AbstractContextManager[Any]]


def scenes_for(
    profile: Profile | None, names: Sequence[str], mm_per_pixel: Pitch | None, **settings: Any
) -> list[Scene]:
    """Return the pictures that kernels are compared on.

    Parameters
    ----------
    profile : Profile, optional
        Whose first annulus is a pixel's width, for ``mm_per_pixel = "profile"``.
    names : sequence of str
    mm_per_pixel : float or "profile", optional [mm]
        By default from the first file that has it, else 0.3.
    **settings
        Those of `load_scenes`.
    """
    if mm_per_pixel == "profile":
        if profile is None:
            raise RenderError("pixels of a profile's width need the profile; give a length in mm.")
        mm_per_pixel = pitch_of(profile, mm_per_pixel)
    return load_scenes(names, mm_per_pixel, otherwise=MM_PER_PIXEL, **settings)


def compare(
    source: Material | Profile,
    scenes: Sequence[Scene],
    what: str | None = None,
    *,
    name: str,
    profile: Profile | None = None,
    error: str = "delta-e",
    only: Collection[str] | None = None,
    mm_per_pixel: Pitch | None = None,
    photons: int | None = None,
    threads: int | None = None,
    steps: Watch = lambda label: nullcontext(),  # noqa: ARG005
    walk: Watch = lambda label: nullcontext(),  # noqa: ARG005
    **fit: Any,
) -> Iterator[Part]:
    """Yield the parts of a comparison, each when it is done.

    Parameters
    ----------
    source : Material or Profile
        A half space, or a profile, which has no budget.
    scenes : sequence of Scene
        Not needed for a sheet.
    what : str, optional
        "kernels", "front", "budget", "presets" or "sheet"; by default kernels, then a budget where
        there is one.
    name : str
        The source's name in messages.
    profile : Profile, optional
        The source's profile, where it is computed already.
    error : str
        The error of the front that will be drawn: those of Delta E need channels with a colour.
    only : collection of str, optional
        Methods of the kernels that are compared; by default all.
    mm_per_pixel : float or "profile", optional [mm]
        Pixel size of a sheet.
    photons : int, optional
        Photons of the budget's walk; by default 1e6.
    threads : int, optional
    steps, walk : callable
        Take a label, and return a context whose value is called with the progress: of
        `compare_kernels` and of the walk.
    **fit
        Seed, method, settings and model of the budget; see `error_budgets`.

    Raises
    ------
    SssfitError
        As `compare_kernels`, `error_budgets` and `compute_sheet`.
    """
    if what == "presets":
        with steps(name) as show:
            yield compare_presets(source, scenes, threads=threads, progress=show)
        return
    if what != "budget" and profile is None:
        profile = profile_of(source, threads=threads)
    if profile is not None and what == "sheet":
        yield compute_sheet(profile, mm_per_pixel=mm_per_pixel, threads=threads)
    elif profile is not None and what != "budget":
        check_error(error, profile.n_channels)
        with steps(profile.material_name or "profile") as show:
            kernels = compare_kernels(profile, scenes, only=only, threads=threads, progress=show)
        yield kernels
    if what in (None, "budget") and isinstance(source, Profile):
        note(f"No budget: {name} is a profile, and a budget simulates a material.")
    elif what in (None, "budget") and isinstance(source, Material):
        # A default that the fit refuses, such as rank 3 on 3 pixels, costs the budget and no more.
        refusals = (SimulationError,) if fit.get("settings") else (SimulationError, FitError)
        fit |= {"photons": photons or PHOTONS, "threads": threads}
        try:
            with walk(source.name) as show:
                budgets = error_budgets(source, scenes, progress=show, **fit)
        except refusals as refusal:
            if what == "budget":
                raise
            note(f"No budget: {refusal}")
        else:
            yield budgets


def profile_of(source: Material | Profile, *, threads: int | None = None) -> Profile:
    """Return a material's exact profile; a profile is its own."""
    return source if isinstance(source, Profile) else true_profile(source, threads=threads)


def check_budget(name: str) -> None:
    """Refuse the name of a profile where a budget is all that is asked for.

    Raises
    ------
    ProfileError
    """
    if name == DEON_SKIN:
        raise ProfileError(f"{name} has no coefficients to simulate with; name a material.")
    if name == "-" or name.endswith(".npz"):
        raise ProfileError(
            f"{name} is a profile, and a budget simulates a material: name that, such as skin1 or "
            "a .toml file of your own."
        )


def told(
    what: str | None, parts: Sequence[Part], wrote: Sequence[str], error: str, cost: str
) -> tuple[dict[str, Any], str]:
    """Return the figures of the parts as ``sssfit compare --json`` prints them, and their words.

    Of fronts the parts are a comparison for each material; ``wrote`` names the files.
    """
    kernels = [each for each in parts if isinstance(each, Comparison)]
    figures: dict[str, Any] = {"output": list(wrote)}
    if isinstance(parts[0], Sheet | PresetComparison):
        figures |= parts[0].to_dict()
        text = f"{sheet_text(figures) if isinstance(parts[0], Sheet) else parts[0].text()}\n"
        wrote = ["a PNG to stdout"] if "-" in wrote else wrote
    elif what == "front":
        figures |= _fronts(kernels, error, cost)
        text = f"{fronts_text(kernels, error, cost)}\n"
    else:
        budgets = [one.to_dict() for each in parts if isinstance(each, list) for one in each]
        rows = [row for each in budgets for row in each["rows"]]
        figures |= kernels[0].to_dict(error, cost) if kernels else {"rows": []}
        figures["budget"] = {**budgets[0], "rows": rows} if budgets else None
        of_kernels = (kernels_text(each, error, cost) for each in kernels)
        text = "".join(f"{each}\n\n" for each in (*map(budget_text, budgets), *of_kernels))
    return figures, f"{text}Wrote {', '.join(wrote)}" if wrote else text.rstrip("\n")


def _fronts(done: Sequence[Comparison], error: str, cost: str) -> dict[str, Any]:
    """Return the figures of several materials' fronts; what could not be fitted is noted."""
    for each in done:
        for line in left_out_lines(each):
            note(line)
    return {
        "error": error,
        "cost": cost,
        "materials": [each.profile.material_name for each in done],
        "rows": [row for each in done for row in each.to_dict()["rows"]],
    }
