"""Stresses every method until it breaks, and says where it is safe.

`stability` runs the stresses of ``sssfit.methods.STRESSES`` on a material; a new one is one file
with a function from a `Subject` to panels, and one entry there. What its ``KERNELS`` names is
fitted beforehand, with those of the other stresses, so that no worker waits for another's search.
What its ``check`` refuses is refused before a worker starts or a kernel is fitted.
"""

import contextlib
import dataclasses
import importlib
import math
import warnings
from collections.abc import Callable, Collection, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sssfit.errors import ArgumentError, FitError, SssfitWarning
from sssfit.files import has_mark
from sssfit.material import Material
from sssfit.messages import did_you_mean, shown
from sssfit.methods import STRESSES, TAPS
from sssfit.process import one_blas_thread, thread_count
from sssfit.profile import Profile
from sssfit.profile.npz import DIRECTED, OPTIONAL
from sssfit.stability.curve import Curve, Edge
from sssfit.stability.panel import Finding, Panel
from sssfit.stability.record import MARK, Stability

if TYPE_CHECKING:
    from sssfit.stability.subject import Subject
    from sssfit.stability.ways import Way

__all__ = ["Curve", "Edge", "Finding", "Panel", "Stability", "is_stability_table", "stability"]

_Step = Callable[[int, int, str], None]
_Stress = Callable[[Any], list[Panel]]


def stability(
    source: Material | Profile,
    *,
    only: Collection[str] | None = None,
    mm_per_pixel: float = 0.3,
    seed: int = 1,
    threads: int | None = None,
    is_whole: bool = False,
    progress: _Step | None = None,
) -> Stability:
    """Stress the fits of a material until they break.

    Parameters
    ----------
    source : Material or Profile
        A profile is taken as the truth; stresses that walk need to know its material.
    only : collection of str, optional
        Names of stresses, by default all that the source allows.
    mm_per_pixel : float [mm]
        Where pixels are not what is made harder.
    seed : int
        Seed of walks and searches.
    threads : int, optional
        Processes that share the work, by default as many as there are cores; a script that calls
        this needs its ``if __name__ == "__main__":`` then. With 1 there is none but the caller's.
        Results do not depend on them.
    is_whole : bool
        Whether 1e7 photons are walked, and cascades are searched again for every walk and have as
        many sizes as the others.
    progress : callable, optional
        Told (done, of how many, the next one's name).

    Returns
    -------
    Stability

    Raises
    ------
    ArgumentError
        A stress is unknown.
    SssfitError
        A process was killed.
    FitError
        A stress that was named needs a material, and the profile does not say its own; or no kernel
        can be made.
    """
    from sssfit.simulate import simulate_exact  # numba, and half a second for all of these
    from sssfit.stability.subject import Subject
    from sssfit.stability.workers import Workers

    names = _named(only)
    if not (math.isfinite(mm_per_pixel) and mm_per_pixel > 0.0):
        raise ArgumentError(f"`mm_per_pixel = {mm_per_pixel}`; expected a length above 0.")
    profile = source if isinstance(source, Profile) else simulate_exact(source)
    # Kernels know neither what leaves below nor angles, and stresses make other annuli.
    unseen: dict[str, Any] = dict.fromkeys((*OPTIONAL, *DIRECTED))
    profile = dataclasses.replace(profile, **unseen)
    name = profile.material_name or "unknown"
    subject = Subject(name, profile, mm_per_pixel, seed, threads, is_whole)
    loaded = {each: STRESSES[each].load() for each in names}
    stresses, notes = _possible(loaded, subject, is_named=only is not None)
    panels: list[Panel] = []
    with warnings.catch_warnings(), one_blas_thread(), contextlib.ExitStack() as ends:
        warnings.simplefilter("ignore", SssfitWarning)  # what fits warn of is what a stress finds
        if (count := thread_count(threads)) > 1:
            workers = ends.enter_context(Workers(count, subject))
            subject = dataclasses.replace(subject, workers=workers)
        for k, (each, stress) in enumerate(stresses.items()):
            if progress is not None:
                progress(k, len(stresses), each)
            if k == 0:
                subject.prepare(_kernels(stresses.values()))
            try:
                panels += stress(subject)
            except FitError as error:
                if only is not None:
                    raise
                notes.append(f"Left out {each}: {error}")
    return Stability(name, mm_per_pixel, tuple(panels), tuple(notes), seed)


def _possible(
    stresses: "dict[str, _Stress]", subject: "Subject", *, is_named: bool
) -> "tuple[dict[str, _Stress], list[str]]":
    """Return the stresses that the subject allows, and a note on each of the others.

    Raises FitError where stresses were named and one of them is not possible.
    """
    possible, notes = {}, []
    for name, stress in stresses.items():
        check = getattr(importlib.import_module(stress.__module__), "check", None)
        try:
            if check is not None:
                check(subject)
        except FitError as error:
            if is_named:
                raise
            notes.append(f"Left out {name}: {error}")
        else:
            possible[name] = stress
    return possible, notes


def _kernels(stresses: Iterable[Callable[..., object]]) -> "list[Way]":
    """Return what stresses want of the profile itself, the searches first, which take longest."""
    modules = [importlib.import_module(each.__module__) for each in stresses]
    ways = [way for module in modules for way in getattr(module, "KERNELS", ())]
    return sorted(ways, key=lambda each: each.method not in TAPS)


def _named(only: Collection[str] | None) -> list[str]:
    """Return the stresses in the order of their table; refuse unknown ones."""
    for each in only or ():
        if each not in STRESSES:
            near = did_you_mean(each, list(STRESSES))
            known = ", ".join(STRESSES)
            raise ArgumentError(f"stress {shown(each)}: {near}expected some of {known}.")
    return [each for each in STRESSES if not only or each in only]


def is_stability_table(path: Path) -> bool:
    """Return whether a file is a table that we wrote."""
    return has_mark(path, {MARK.encode(): b""})
