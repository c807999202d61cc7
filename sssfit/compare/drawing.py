"""What a chart draws of a file: the record that is in it, or one that is computed from it."""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from typing import Any

from sssfit.compare.guide import compute_guide
from sssfit.compare.kernel_view import view_kernel
from sssfit.compare.models import compare_models, material_of_walk
from sssfit.compare.spectrum import compute_spectrum
from sssfit.compare.swatches import Swatches
from sssfit.compare.taps_view import view_taps
from sssfit.errors import ProfileError
from sssfit.kernel import SeparableKernel, Taps
from sssfit.material import Material
from sssfit.material.checks import is_name
from sssfit.messages import note
from sssfit.profile import Profile
from sssfit.profile.directions import angular_reflectance
from sssfit.profile.frequency import frequency_response

_OF_PROFILES = {
    "spectrum": "`spectrum = True`",
    "guide": "`guide = True`",
    "frequency": "`frequency = True`",
    "angles": "`angles = True`",
}
COMPUTED = ("kernel", "taps", "models", "spectrum", "guide", "frequency", "angles", "swatches")


def drawn_of(found: Any, view: str, name: str) -> tuple[Any, str, str | None]:
    """Return what is drawn of a record, the kind of chart, and what the record was made from.

    Parameters
    ----------
    found : Profile, SeparableKernel, Taps, Material, SoFar or Swatches
    view : str
        "models", "spectrum", "guide", "frequency", "angles", or "" for the record's own chart.
    name : str
        The record's file in messages.

    Raises
    ------
    ProfileError
        The view is of profiles, and the record is none.
    """
    if view in _OF_PROFILES and not isinstance(found, Profile):
        asked = _OF_PROFILES[view]
        raise ProfileError(f"{name} is not a profile; {asked} draws one, a .profile.npz file.")
    if isinstance(found, Swatches):
        return found, "swatches", found.name
    if isinstance(found, Material):
        return found, view or "material", found.name
    if isinstance(found, Profile):
        return found, view or "profile", found.material_name
    if isinstance(found, SeparableKernel | Taps):
        made_of, kind = found.meta.get("material"), "taps" if isinstance(found, Taps) else "kernel"
        return found, kind, f"{made_of}.{found.method}" if is_name(made_of) else None
    first, count = found.profiles[0], len(found.profiles)
    if count > 1:
        note(f"Drawing {first.label}, the first of the walk's {count} materials.")
    return first, "checkpoint", first.material_name


def computed(
    found: Any,
    kind: str,
    profile: Profile | None = None,
    *,
    ks: Sequence[float] | None = None,
    channel: str | None = None,
    mm_per_pixel: Any = None,
    photons: int | None = None,
    seed: int = 1,
    threads: int | None = None,
    walk: Callable[[str], AbstractContextManager[Any]] = lambda label: nullcontext(),  # noqa: ARG005
) -> Any:
    """Return the record that a chart draws.

    Parameters
    ----------
    found : Profile, SeparableKernel, Taps, Material or Swatches
    kind : str
        One of `drawn_of`; what is not in `COMPUTED` is drawn as it is.
    profile : Profile, optional
        The profile that a kernel was fitted to.
    ks, channel, mm_per_pixel
        As `compute_guide`, `compute_spectrum` and `view_kernel`.
    photons, seed, threads
        As `compare_models`.
    walk : callable
        Takes a label, and returns a context whose value is told the walk's progress.
    """
    own = {"ks": ks, "channel": channel}
    asked: dict[str, Any] = {key: value for key, value in own.items() if value is not None}
    if kind == "kernel":
        return view_kernel(found, profile, channels=None if channel is None else [channel])
    if kind == "taps":
        return view_taps(found, profile)
    if kind == "guide":
        return compute_guide(found, mm_per_pixel=mm_per_pixel, **asked)
    if kind == "spectrum":
        return compute_spectrum(found, mm_per_pixel=mm_per_pixel)
    if kind == "frequency":
        return frequency_response(found)
    if kind == "angles":
        return angular_reflectance(found)
    if kind != "models":
        return found
    past = found if isinstance(found, Profile) else None
    material = material_of_walk(past) if past else found
    settings: dict[str, Any] = {"walk": past, "photons": photons, "seed": seed}
    with walk(material.name) as show:
        return compare_models(material, **settings, threads=threads, progress=show)
