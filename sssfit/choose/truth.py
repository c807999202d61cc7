"""How many photons are enough: walks of growing length, fitted like the chosen kernel."""

import math
import time
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sssfit.arrays import plain
from sssfit.choose.options import Option
from sssfit.choose.views import Views
from sssfit.errors import (
    FitError,
    RenderError,
    SimulationError,
    SssfitError,
    SssfitWarning,
    StoppedError,
)
from sssfit.grid import RadialGrid, make_grid
from sssfit.material import Material
from sssfit.messages import note, number
from sssfit.methods import TRANSPORT
from sssfit.profile import Profile
from sssfit.simulate import simulate_montecarlo
from sssfit.simulate._deterministic import check_is_material
from sssfit.simulate.truth import exact_with_all_light, radius_of

WALK_PHOTONS = 10_000_000  # the papers' number
_WORTH_A_NOTE = 1e-3  # of the light


def truth_of(
    source: Material | Profile, *, seed: int, threads: int | None
) -> tuple[Profile, float]:
    """Return a material's exact profile, or a walk's where that is refused; and the seconds.

    A profile is its own truth.

    The exact one has all of the light: marble's kernels, 2.2 % of whose red lies beyond the paper's
    grid, were .39 Delta E off on the head at best. Refused are thin slabs that scatter far ahead
    and stacks of hundreds of layers. None is reduced to isotropic scattering: skin1's coefficients
    with g = 0.8 had then a Delta E of 5.3 against the walk.
    """
    if isinstance(source, Profile):
        return source, 0.0
    check_is_material(source)
    begun = time.perf_counter()
    grid = make_grid(source)  # a walk would have it, too
    try:
        profile = exact_with_all_light(source, grid, math.inf, threads=threads)
    except StoppedError:
        raise
    except SimulationError as refusal:
        why = str(refusal).rstrip(".").partition(";")[0]
        note(f"{why}: tracing 1e7 photons for the true profile instead.")
        profile = simulate_montecarlo(source, photons=WALK_PHOTONS, seed=seed, threads=threads)
    return profile, time.perf_counter() - begun


def note_truth(source: Material | Profile) -> None:
    """Say, before a choice is made, what a profile cannot tell."""
    if isinstance(source, Material):
        return
    missing = source.beyond_grid.sum() / max(source.diffuse_reflectance.sum(), 1e-300)
    if missing > _WORTH_A_NOTE:
        note(
            f"{number(missing, '.2g%')} of the light lies beyond the profile's grid. The true "
            "picture spreads it evenly, or lacks it where the border is black, and a kernel has it "
            "near the beam: simulate with a larger radius."
        )


def material_of(source: Material | Profile) -> Material | None:
    """Return the material whose walks can be compared with the profile.

    None for a profile without coefficients behind it, for one under a beam, and for one that is not
    by transport: a model's error would be taken for noise.
    """
    if isinstance(source, Material):
        return source
    record = source.meta.get("material")
    is_transport = source.meta.get("method") in TRANSPORT and "beam" not in source.meta
    if not is_transport or not isinstance(record, Mapping):
        return None
    try:
        return Material.from_dict(record)
    except SssfitError:  # a name alone, or a record that was edited
        return None


def name_of(source: Material | Profile) -> str:
    """Return what messages call it."""
    if isinstance(source, Material):
        return source.name
    return source.material_name or "the profile"


def check_colours(source: Material | Profile) -> None:
    """Refuse channels that no display shows: Delta E needs grey or red, green and blue."""
    if source.n_channels not in (1, 3):
        raise RenderError(
            f"{name_of(source)} has {source.n_channels} channels; Delta E needs 1 (grey) or 3 "
            "(red, green, blue)."
        )


COUNTS = (10_000, 100_000, 1_000_000, 10_000_000)


@dataclass(frozen=True, slots=True)
class PhotonNeed:
    """Photons of a walk whose profile, fitted in the same way, stays within the tolerance.

    Parameters
    ----------
    photons : int, optional
        The fewest of ``COUNTS``; None where none would do.
    counts : tuple of int
        What was tried, up to that.
    errors : tuple of float
        Error of the worst view by each, in the figure the tolerance is of; inf where the profile
        cannot be fitted.
    seconds : tuple of float [s]
        What each walk took, compilation included; its fit and its pictures are not.
    truth_method : str
        How the profile that the choice was made on was found.
    truth_seconds : float [s]
        What it took.
    """

    photons: int | None
    counts: tuple[int, ...]
    errors: tuple[float, ...]
    seconds: tuple[float, ...]
    truth_method: str
    truth_seconds: float

    def to_dict(self) -> dict[str, Any]:
        """Return the figures as ``sssfit choose --json`` has them; None for an error of inf."""
        return plain(
            {
                "photons": self.photons,
                "tried": self.counts,
                "errors": self.errors,
                "seconds": self.seconds,
                "profile_seconds": self.truth_seconds,
            }
        )


def photons_needed(
    material: Material | None, option: Option, views: Views, seed: int, truth_seconds: float
) -> PhotonNeed | None:
    """Trace 1e4 photons, ten times as many, ..., until the option is within the tolerance.

    None without a material to walk through.
    """
    if material is None:
        return None
    walked = views.profile.photons
    if walked is not None and seed == views.profile.meta.get("seed"):
        seed ^= 1  # a shorter walk of the same seed would be a part of the truth
    errors: list[float] = []
    seconds: list[float] = []
    enough = walked
    counts = [each for each in COUNTS if walked is None or each < walked]
    for photons in counts:
        error, took = _error_and_seconds(material, option, views, photons, seed)
        errors.append(error)
        seconds.append(took)
        if errors[-1] <= views.tolerance:
            enough = photons
            break
    method = str(views.profile.meta.get("method"))
    return PhotonNeed(
        enough, tuple(counts[: len(errors)]), tuple(errors), tuple(seconds), method, truth_seconds
    )


def _error_and_seconds(
    material: Material, option: Option, views: Views, photons: int, seed: int
) -> tuple[float, float]:
    """Return the error of the worst view, and what the walk took; its warnings are in the error."""
    truth = views.profile
    radius_mm = radius_of(RadialGrid(float(truth.r_edges_mm[1]), truth.n_annuli))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SssfitWarning)
        begun = time.perf_counter()
        walk = simulate_montecarlo(
            material, photons=photons, seed=seed, radius_mm=radius_mm, threads=views.threads
        )
        took = time.perf_counter() - begun
        try:
            return views.score_of_option(option, walk, wider=1.0).error, took
        except FitError:  # a dark channel that no photon came back in
            return float("inf"), took
