"""The profiles of an unfinished photon walk, as if the run had ended at its checkpoint.

A run saves its sums in a checkpoint (``_checkpoint``); ``_assemble`` makes a profile from them as
at the end of a run.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, BinaryIO

from sssfit._jit import source_key
from sssfit.errors import MaterialError, SimulationError
from sssfit.files import source_of
from sssfit.grid import RadialGrid
from sssfit.material import Material
from sssfit.messages import shown
from sssfit.profile import Profile
from sssfit.simulate._checkpoint import (
    FORMAT,
    CheckpointError,
    open_checkpoint,
    read_meta,
    read_state,
    settings_of,
)
from sssfit.simulate._directions import directions_of
from sssfit.simulate._finished import profile_of
from sssfit.simulate._run import EndCondition
from sssfit.simulate._walks import MAX_PHOTONS, Walk, relative_errors
from sssfit.simulate.montecarlo import check_media, make_walk


@dataclass(frozen=True, slots=True, eq=False)
class SoFar:
    """State of a walk when its checkpoint was saved.

    Parameters
    ----------
    profiles : tuple of Profile
        One for each material of the walk; ``meta["checkpoint"]`` is the format of the checkpoint,
        and ``meta["version"]`` is None if another version of the walk made the sums.
    flights : int
        Free paths walked.
    seconds : float [s]
        Time of all runs together.
    relative_error : float
        Largest standard error of F(r), as a share of F at the last edge, of the worst channel.
    """

    profiles: tuple[Profile, ...]
    flights: int
    seconds: float
    relative_error: float

    def to_dict(self) -> dict[str, Any]:
        """Return the figures that ``sssfit show --json`` prints, with those of every profile."""
        return {
            "kind": "checkpoint",
            "photons": self.profiles[0].photons,
            "flights": self.flights,
            "seconds": self.seconds,
            "relative_error": self.relative_error,
            "profiles": [each.to_dict() for each in self.profiles],
        }


def read_checkpoint(source: str | Path | BinaryIO, origin: str | None = None) -> SoFar:
    """Read a checkpoint from a path or a binary stream that can seek, and make its profiles.

    Error messages call it ``origin``, by default the path, or "the checkpoint" for a stream. A grid
    with an automatic radius ("auto") is not trimmed yet.

    Raises
    ------
    FileError
        The file is missing, damaged, edited, foreign, of another format, or was saved before
        checkpoints stored their materials; the one-line message names the origin.
    """
    source = source_of(source)
    if isinstance(source, Path):
        origin = origin or str(source)
    with open_checkpoint(source, origin or "the checkpoint") as archive:
        meta = read_meta(archive)
        walk = _walk_of(meta)
        state = read_state(archive, meta, walk.empty_tally())
    tally, error = state.tally, float(relative_errors(walk, state.tally).max())
    ending = EndCondition(tally.photons)
    profiles = [
        profile_of(walk, tally, k, ending, error, trim=False) for k in range(len(walk.materials))
    ]
    is_current = meta["settings"].get("version") == source_key()
    return SoFar(
        tuple(_marked(each, is_current=is_current) for each in profiles),
        tally.flights,
        state.seconds,
        error,
    )


def _walk_of(meta: Mapping[str, Any]) -> Walk:
    """Return the walk of a checkpoint, whose materials must be those it was started with."""
    settings, records = meta["settings"], meta.get("materials")
    if records is None:
        raise CheckpointError("was saved by a version that did not keep the materials in it")
    try:
        materials = [Material.from_dict(each) for each in records]
        grids, seed = _grids(settings), int(settings["seed"])
        directions = directions_of(settings)
        check_media(materials)
        expected = settings_of(materials, grids, seed, directions)
    except (KeyError, TypeError, ValueError, MaterialError, SimulationError) as error:
        raise CheckpointError.of(
            f"its materials and grids ({shown(str(error))}) are not a walk's"
        ) from None
    for name in ("material", "dr_mm", "annuli", "photons in a batch"):
        if settings.get(name) != expected[name]:
            raise CheckpointError.of(
                f"{name} = {shown(settings.get(name))}, expected {shown(expected[name])}"
            )
    if not 0 <= seed < 2**64:
        raise CheckpointError.of(f"seed = {seed}, expected 0 to 2^64 - 1")
    return make_walk(materials, grids, seed, MAX_PHOTONS, directions)


def _grids(settings: Mapping[str, str]) -> Sequence[RadialGrid]:
    """Return the grid of each material."""
    widths, counts = (settings[name].split(", ") for name in ("dr_mm", "annuli"))
    return [RadialGrid(float(a), int(b)) for a, b in zip(widths, counts, strict=True)]


def _marked(profile: Profile, *, is_current: bool) -> Profile:
    """Record the provenance, and no version if another version made the sums."""
    meta = {**profile.meta, "checkpoint": FORMAT}
    return replace(profile, meta=meta if is_current else {**meta, "version": None})
