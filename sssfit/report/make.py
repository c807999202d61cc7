"""Makes a report: profile, kernels, pictures, comparison, models and budget, in this order."""

from collections.abc import Callable, Collection, Sequence
from typing import Any, TypeVar

from sssfit.compare.budget import Budget, error_budgets
from sssfit.compare.convergence import Convergence, compute_convergence
from sssfit.compare.models import ModelComparison, compare_models
from sssfit.compare.pareto import compare_kernels
from sssfit.compare.spectrum import compute_spectrum
from sssfit.errors import RenderError, SimulationError
from sssfit.fit import MM_PER_PIXEL
from sssfit.kernel import Taps
from sssfit.material import Material
from sssfit.messages import note
from sssfit.profile import Profile
from sssfit.report.commands import commands_of
from sssfit.report.fits import Steps, Watch, fitted, shown_kernel
from sssfit.report.pictures import SIDE, Shown, own_scene, shown_pictures
from sssfit.report.record import Report
from sssfit.simulate.truth import true_profile

PHOTONS = 200_000  # of the walk in the models' chart and the budget: half a second
_COLOURS = 3  # channels of a picture that the page can show
# Of the chart of convergence: numbers of photons, two a decade; walks of each; the exact solver's.
_WALKS, _SEEDS, _TOLERANCES = 5, 3, (1e-4, 5e-6)
_LEAST_CONVERGING = 100_000  # photons of the longest walk; the shortest then has 1000
_TIMED_SECONDS = 2.0  # in which kernels are timed in turn


Part = TypeVar("Part")


def make_report(
    source: Material | Profile,
    *,
    name: str | None = None,
    origin: str | None = None,
    named: Sequence[tuple[str, Taps]] = (),
    kernels: Sequence[str] = (),
    irradiance: str | None = None,
    only: Collection[str] | None = None,
    mm_per_pixel: float | None = None,
    side: int = SIDE,
    photons: int = PHOTONS,
    seed: int = 1,
    threads: int | None = None,
    progress: Watch | None = None,
) -> Report:
    """Compute all that a page about a material shows.

    Parameters
    ----------
    source : Material or Profile
        Of 1 or 3 channels, which a page can show as colours.
    name : str, optional
        Of the page of a profile that does not name its material.
    origin : str, optional
        What the source was named as, in the command lines of the page; by default its title.
    named : sequence of (str, Taps)
        Tables of taps of a user's own, with their labels.
    kernels : sequence of str
        Their files, for the command lines.
    irradiance : str, optional
        A picture's file, which the page opens with.
    only : collection of str, optional
        Methods of the other kernels; by default those that are fitted in seconds.
    mm_per_pixel : float, optional [mm]
        Of the kernels' pixels; by default those of the picture's file, else 0.3.
    side : int
        Rows and columns of the pictures.
    photons, seed : int
        Of the walk in models and error budget; walks of up to so many show convergence.
    threads : int, optional
    progress : callable, optional
        Called with how many steps are done, of how many, and the name of the next.

    Raises
    ------
    RenderError
        The channels have no colour, or as `shown_pictures`.
    FitError
        No kernel could be fitted.
    """
    channels = source.n_channels
    if channels not in (1, _COLOURS):
        raise RenderError(
            f"{channels} channels have no colour; a report shows 3, or 1 as grey. Choose channels "
            "of the material, or compare its kernels by the error l2."
        )
    own = None if irradiance is None else own_scene(irradiance, mm_per_pixel, side)
    pitch = own.mm_per_pixel if own else mm_per_pixel or MM_PER_PIXEL
    steps = Steps(progress)
    steps("the exact profile")
    profile = source if isinstance(source, Profile) else true_profile(source, threads=threads)
    fits = fitted(profile, pitch, named, only, steps)
    pictures = shown_pictures(profile, pitch, own=own, side=side, threads=threads, progress=steps)
    steps("the comparison")
    alone = [each for each in pictures[1:] if each.name in ("disk", "edge")]
    scenes = [each.scene for each in (pictures[0], *alone)]
    timed: dict[str, Any] = {"timed_seconds": _TIMED_SECONDS, "threads": threads}
    comparison = compare_kernels(profile, scenes, candidates=fits, **timed)
    title = profile.material_name or name or "profile"
    shown = tuple(shown_kernel(each, title, pitch) for each in fits)
    steps("models and budget")
    walk = {"photons": photons, "seed": seed, "threads": threads}
    models, budgets, convergence = _of_material(source, pictures, walk)
    return Report(
        title,
        profile,
        pictures,
        shown,
        comparison,
        compute_spectrum(profile, mm_per_pixel=pitch),
        models,
        budgets,
        convergence,
        commands_of(
            origin or title,
            is_material=isinstance(source, Material),
            kernel=kernels,
            irradiance=irradiance,
            only=None if only is None else sorted(only),
            mm_per_pixel=mm_per_pixel,
            photons=None if photons == PHOTONS else photons,
            seed=None if seed == 1 else seed,
        ),
    )


def _of_material(
    source: Material | Profile, pictures: Sequence[Shown], walk: dict[str, Any]
) -> tuple[ModelComparison | None, tuple[Budget, ...], Convergence | None]:
    """Return what needs coefficients; a part that does not cover the material is noted."""
    if isinstance(source, Profile):
        return None, (), None
    flat = [each.scene for each in pictures if each.name in ("disk", "edge")]
    return (
        _covered("models", lambda: compare_models(source, **walk)),
        tuple(_covered("error budget", lambda: error_budgets(source, flat, **walk)) or ()),
        _covered("convergence", lambda: _convergence(source, **walk)),
    )


def _covered(what: str, make: Callable[[], Part]) -> Part | None:
    """Return a part of the page, or None with a note if it does not cover the material."""
    try:
        return make()
    except SimulationError as refusal:
        note(f"The page has no {what}: {refusal}")
        return None


def _convergence(
    material: Material, *, photons: int, seed: int, threads: int | None
) -> Convergence | None:
    """Return walks of up to so many photons; so few that no slope would be seen have none."""
    if photons < _LEAST_CONVERGING:
        return None
    numbers = [round(photons * 10 ** (-0.5 * k)) for k in reversed(range(_WALKS))]
    settings: dict[str, Any] = {"seeds": _SEEDS, "first_seed": seed, "threads": threads}
    return compute_convergence(material, photons=numbers, tolerances=_TOLERANCES, **settings)
