"""What a chart draws of a file: the record that is in it, or one that is computed from it.

The views are entries of ``sssfit.methods.VIEWS``.
"""

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from typing import Any

from sssfit.compare.kernel_view import KernelView, view_kernel
from sssfit.compare.models import ModelComparison, compare_models, material_of_walk
from sssfit.compare.swatches import Swatches
from sssfit.errors import ProfileError
from sssfit.kernel import SeparableKernel, Taps
from sssfit.material import Material
from sssfit.material.checks import is_name
from sssfit.messages import note, shown
from sssfit.methods import VIEWS, imported
from sssfit.profile import Profile

# What a record is, and its file.
_FILES = {
    "Profile": ("a profile", "a .profile.npz file"),
    "SeparableKernel": ("a separable kernel", "a .kernel.json file"),
    "Taps": ("a table of taps", "a .taps.json file"),
    "Material": ("a material", "a TOML file"),
    "SoFar": ("a checkpoint", "a .checkpoint file"),
    "Swatches": ("a sweep over wavelengths", "a Zarr folder"),
}


def drawn_of(found: Any, view: str, name: str) -> tuple[Any, str, str | None]:
    """Return what is drawn of a record, the kind of chart, and what the record was made from.

    Parameters
    ----------
    found : Profile, SeparableKernel, Taps, Material, SoFar or Swatches
    view : str
        A name of ``sssfit.methods.VIEWS``, or "" for the record's own chart.
    name : str
        The record's file in messages.

    Raises
    ------
    ProfileError
        There is no such view, or it is not of such records.
    """
    kind = _kind_of(found, view, name)
    if isinstance(found, Swatches | Material):
        return found, kind, found.name
    if isinstance(found, Profile):
        return found, kind, found.material_name
    if isinstance(found, SeparableKernel | Taps):
        made_of = found.meta.get("material")
        return found, kind, f"{made_of}.{found.method}" if is_name(made_of) else None
    first, count = found.profiles[0], len(found.profiles)
    if count > 1:
        note(f"Drawing {first.label}, the first of the walk's {count} materials.")
    return first, kind, first.material_name


def _kind_of(found: Any, view: str, name: str) -> str:
    """Return the name of the view, by default of a record's own chart; refuse what has none."""
    if view and view not in VIEWS:
        raise ProfileError(f"no view {shown(view)} of a file; expected one of {', '.join(VIEWS)}.")
    record = type(found).__name__
    views = [view] if view else [key for key, each in VIEWS.items() if not each.flag]
    for key in views:
        if record in VIEWS[key].of:
            return key
    if not view:
        raise ProfileError(f"{name}: there is no chart of {record}.")
    what, files = zip(*(_FILES[each] for each in VIEWS[view].of), strict=True)
    raise ProfileError(
        f"{name} is not {' or '.join(what)}; `{view} = True` draws one, {' or '.join(files)}."
    )


def computed(found: Any, kind: str, **given: Any) -> Any:
    """Return the record that a chart draws.

    Parameters
    ----------
    found : Profile, SeparableKernel, Taps, Material or Swatches
    kind : str
        One of `drawn_of`, a name of ``sssfit.methods.VIEWS``.
    **given
        What the view ``takes``; None is as if it were not given.
    """
    if not VIEWS[kind].function:
        return found
    asked = {key: value for key, value in given.items() if value is not None}
    return imported(VIEWS[kind].function)(found, **asked)


def kernel_of(
    kernel: SeparableKernel, *, profile: Profile | None = None, channel: str | None = None
) -> KernelView:
    """Lay a kernel beside the profile that it was fitted to, in all channels or in one."""
    return view_kernel(kernel, profile, channels=None if channel is None else [channel])


def models_of(
    found: Profile | Material,
    *,
    photons: int | None = None,
    seed: int = 1,
    threads: int | None = None,
    walk: Callable[[str], AbstractContextManager[Any]] = lambda label: nullcontext(),  # noqa: ARG005
) -> ModelComparison:
    """Compute a material, or that of a photon walk, by every method.

    Parameters
    ----------
    found : Profile or Material
    photons, seed, threads
        As `compare_models`.
    walk : callable
        Takes a label, and returns a context whose value is told the walk's progress.
    """
    past = found if isinstance(found, Profile) else None
    material = material_of_walk(found) if isinstance(found, Profile) else found
    settings: dict[str, Any] = {"walk": past, "photons": photons, "seed": seed}
    with walk(material.name) as show:
        return compare_models(material, **settings, threads=threads, progress=show)
