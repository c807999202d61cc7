"""Profile to kernel: one method per file, ``fit_x(profile, ...)`` to a FitResult or a TapsFit.

``METHODS`` maps the names of the command line to the methods; its entries come from
``sssfit.methods``. Every ``fit_x`` takes a profile and, by keyword, ``mm_per_pixel`` (0.3 by
default), ``support_mm`` and its own settings; the fits of separable kernels also take
``normalize``.

The package can also be called like the function `fit`: ``sssfit.fit(profile, "svd", rank=3)``.
"""

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from sssfit.arrays import check_kinds, check_settings, true_or_false
from sssfit.errors import FitError
from sssfit.fit._result import FitResult, TapsFit
from sssfit.fit._target import MM_PER_PIXEL, Pitch, make_target, pitch_of, support_of
from sssfit.fit.artist import fit_artist
from sssfit.fit.burley import fit_burley
from sssfit.fit.falloff import fit_falloff
from sssfit.fit.gaussians import fit_gaussians
from sssfit.fit.guided import fit_guided
from sssfit.fit.preintegrated import fit_preintegrated
from sssfit.fit.svd import fit_svd
from sssfit.fit.weighted import fit_weighted
from sssfit.kernel import SeparableKernel, Taps
from sssfit.messages import shown
from sssfit.methods import FITS, SEPARABLE, TAPS
from sssfit.profile import Profile

__all__ = [
    "METHODS",
    "MM_PER_PIXEL",
    "FitMethod",
    "FitResult",
    "Pitch",
    "TapsFit",
    "fit",
    "fit_artist",
    "fit_burley",
    "fit_falloff",
    "fit_gaussians",
    "fit_guided",
    "fit_pitches",
    "fit_preintegrated",
    "fit_result",
    "fit_separable",
    "fit_svd",
    "fit_taps",
    "fit_weighted",
    "make_target",
    "pitch_of",
    "support_of",
]


@dataclass(frozen=True, slots=True)
class FitMethod:
    """A method of fitting a kernel to a profile."""

    fit: Callable[..., FitResult]
    summary: str


METHODS = {name: FitMethod(each.load(), each.summary) for name, each in SEPARABLE.items()}


def fit_result(
    profile: Profile | str | Path,
    method: str = "cascade",
    *,
    taps: int | None = None,
    place: str | None = None,
    smooth: bool = False,
    **settings: Any,
) -> FitResult | TapsFit:
    """Fit a kernel of either kind to a profile, and return it with how it was found.

    Parameters
    ----------
    profile : Profile, str or Path
        The record, or the path of a ``.profile.npz`` file.
    method : str
        A name of ``sssfit.methods.FITS``; by default a cascade, of 24 fetches.
    taps : int, optional
        Thin a separable kernel to so many bilinear fetches a pass; see ``sssfit.fit.on_taps``.
    place : str, optional
        Where the taps lie, "cumulative", "quadratic" or "fitted".
    smooth : bool
        Take most of the noise out of a walk's profile first (`sssfit.profile.smooth`).
    **settings
        Keyword arguments of the method's ``fit_x``: ``rank``, ``mm_per_pixel``, ...

    Returns
    -------
    FitResult, or TapsFit from the methods of ``sssfit.methods.TAPS`` and with ``taps``

    Raises
    ------
    FitError
        The method is unknown, or cannot fit this profile with these settings.
    ArgumentError
        The method has no such setting.
    ProfileError
        The file cannot be read as a profile, or a profile to smooth has no standard errors.
    """
    if not isinstance(method, str) or method not in FITS:
        raise FitError(f"method = {shown(method)}; expected one of {', '.join(FITS)}.")
    check_kinds(FITS[method], settings | {"taps": taps}, FitError)
    true_or_false("smooth", smooth, FitError)
    if place is not None and taps is None:
        raise FitError(f"place = {shown(place)} is where taps lie; give their number as `taps`.")
    if smooth:
        from sssfit.profile.smooth import smoothed  # scipy's splines, which few fits need

        profile = smoothed(_loaded(profile))
    if method in TAPS:
        if place is not None:
            raise FitError(f"place = {shown(place)} is of separable kernels; leave it out.")
        return fit_taps(profile, method, **({} if taps is None else {"taps": taps}), **settings)
    profile = _loaded(profile)
    dense = fit_separable(profile, method, **settings)
    if taps is None:
        return dense
    from sssfit.fit.on_taps import PLACES, on_taps  # scipy.optimize: 0.3 s

    begun = time.perf_counter()
    pictures = {key: settings[key] for key in ("spectrum", "irradiance") if key in settings}
    thinned = on_taps(dense.kernel, taps, place=place or PLACES[0], profile=profile, **pictures)
    seconds = dense.seconds + time.perf_counter() - begun
    return TapsFit(thinned, sum(dense.evaluations), seconds)


def fit_pitches(
    profile: Profile | str | Path, method: str, pitches: Sequence[Pitch | None], **settings: Any
) -> Iterator[tuple[int, FitResult | TapsFit]]:
    """Fit a kernel for each of several pixel sizes, from the largest to the smallest.

    The search for a cascade of the same ``stages`` also starts from the previous table, so that the
    tables can be mixed: skin1 between .075 and .15 mm leaves a Delta E of .23 in place of 2.

    Parameters
    ----------
    profile : Profile, str or Path
    method : str
        A name of ``sssfit.methods.FITS``.
    pitches : sequence of float [mm]
        Or "profile", for the width of its first annulus.
    **settings
        As in `fit_result`, errors too; a ``like`` serves the first of the fits.

    Yields
    ------
    int, FitResult or TapsFit
        The number of the pixel size among the pitches, and its kernel, as soon as it is fitted.
    """
    source = _loaded(profile)
    sizes = [pitch_of(source, each) for each in pitches]
    for number in sorted(range(len(sizes)), key=sizes.__getitem__, reverse=True):
        found = fit_result(source, method, mm_per_pixel=pitches[number], **settings)
        yield number, found
        settings |= {"like": found.kernel} if method == "cascade" else {}


def fit_separable(profile: Profile | str | Path, method: str = "svd", **settings: Any) -> FitResult:
    """Fit a separable kernel to a profile, and return it with its errors and stop reasons.

    Parameters
    ----------
    profile : Profile, str or Path
        The record, or the path of a ``.profile.npz`` file.
    method : str
        A name of `METHODS`.
    **settings
        Keyword arguments of the method's ``fit_x``: ``rank``, ``mm_per_pixel``, ...

    Returns
    -------
    FitResult

    Raises
    ------
    FitError
        The method is unknown, or cannot fit this profile with these settings.
    ArgumentError
        The method has no such setting.
    ProfileError
        The file cannot be read as a profile.
    """
    if not isinstance(method, str) or method not in METHODS:
        raise FitError(f"method = {shown(method)}; expected one of {', '.join(METHODS)}.")
    check_settings(METHODS[method].fit, settings, f"the fit {method}")
    return METHODS[method].fit(_loaded(profile), **settings)


def fit_taps(profile: Profile | str | Path, method: str = "cascade", **settings: Any) -> TapsFit:
    """Fit a table of taps to a profile, and return it with the effort it took.

    Parameters
    ----------
    profile : Profile, str or Path
        The record, or the path of a ``.profile.npz`` file.
    method : str
        A name of ``sssfit.methods.TAPS``.
    **settings
        Keyword arguments of the method's ``fit_x``: ``fetches``, ``stages``, ...

    Raises
    ------
    FitError, ProfileError
        As `fit_separable`.
    """
    if not isinstance(method, str) or method not in TAPS:
        raise FitError(f"method = {shown(method)}; expected one of {', '.join(TAPS)}.")
    function = TAPS[method].load()
    check_settings(function, settings, f"the fit {method}")
    found: TapsFit = function(_loaded(profile), **settings)
    return found


def _loaded(profile: object) -> Profile:
    if isinstance(profile, str | Path):
        profile = Profile.load(profile)
    if not isinstance(profile, Profile):
        raise FitError(f"profile = {shown(profile)}; expected a Profile, or the path of its file.")
    return profile


def fit(
    profile: Profile | str | Path, method: str = "cascade", **settings: Any
) -> SeparableKernel | Taps:
    """Fit a kernel to a profile.

    Parameters and errors are those of `fit_result`, which also has stop reasons and seconds.

    Returns
    -------
    SeparableKernel, or Taps from the methods of ``sssfit.methods.TAPS`` and with ``taps``
    """
    return fit_result(profile, method, **settings).kernel


class _CallableRoom(ModuleType):
    """Makes the package callable, because `import sssfit.fit` binds it to the function's name."""

    def __call__(
        self, profile: Profile | str | Path, method: str = "cascade", **settings: Any
    ) -> SeparableKernel | Taps:
        return fit(profile, method, **settings)

    __call__.__doc__ = fit.__doc__


sys.modules[__name__].__class__ = _CallableRoom
