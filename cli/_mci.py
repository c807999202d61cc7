"""MCML input files as a material of ``sssfit simulate``: one profile a run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sssfit.material import Material


def is_mci(name: str | None) -> bool:
    """Whether a name given for a material means an MCML input file."""
    return name is not None and name.lower().endswith(".mci")


def load_runs(
    path: str, number: int | None, given: dict[str, Any]
) -> tuple[list[Material], list[dict[str, Any]]]:
    """Return the materials of the runs of a file, or of one, and what to simulate each with.

    ``given`` holds dr_mm and radius_mm, and photons for a walk, as the options have them; the
    file's own stand for those that were not given.
    """
    from sssfit.errors import MaterialError
    from sssfit.formats.mci import load_mci

    runs = load_mci(path)
    if number is not None:
        if number > len(runs):
            raise MaterialError(f"{path} has no run {number}; give --run 1 to {len(runs)}.")
        runs = runs[number - 1 : number]
    settings = [
        given
        | {
            "dr_mm": given["dr_mm"] or run.grid.dr_mm,
            "radius_mm": given["radius_mm"] or run.grid.radius_mm,
        }
        for run in runs
    ]
    # A target error alone decides when a walk ends; then the file's photons are no limit either.
    if "photons" in given and given["photons"] is None and given["target_error"] is None:
        for run, own in zip(runs, settings, strict=True):
            own["photons"] = run.photons
    return [run.material for run in runs], settings
