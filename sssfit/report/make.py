"""Makes a report: profile, pictures, kernels, comparison; beside them models and budget."""

from collections.abc import Collection, Sequence
from functools import partial
from typing import Any

from sssfit.compare.pareto import compare_kernels
from sssfit.compare.references import evaluated_scene
from sssfit.compare.spectrum import compute_spectrum
from sssfit.errors import FitError, RenderError
from sssfit.fit import MM_PER_PIXEL
from sssfit.kernel import Taps
from sssfit.material import Material
from sssfit.profile import Profile
from sssfit.report.aside import Aside
from sssfit.report.commands import commands_of
from sssfit.report.fits import (
    Steps,
    Watch,
    begun_fits,
    finished_fits,
    given_kernels,
    shown_kernel,
)
from sssfit.report.parts import parts_of
from sssfit.report.pictures import SIDE, flat_scenes, own_scene, shown_pictures
from sssfit.report.record import Report
from sssfit.simulate.truth import true_profile

PHOTONS = 200_000  # of the walk in the models' chart and the budget: half a second
_COLOURS = 3  # channels of a picture that the page can show
_TIMED_SECONDS = 2.0  # in which kernels are timed in turn


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
        Has 1 or 3 channels, which a page can show as colours.
    name : str, optional
        Name of the page of a profile that does not name its material.
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
        Size of the kernels' pixels; by default that of the picture's file, else 0.3.
    side : int
        Rows and columns of the pictures.
    photons, seed : int
        Those of the walk in models and error budget; walks of up to so many show convergence.
    threads : int, optional
        All cores by default. With more than one a second process does half of the work, and a
        script that calls this needs its ``if __name__ == "__main__":``.
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
    walk: dict[str, Any] = {"photons": photons, "seed": seed, "threads": threads}
    with Aside(threads) as aside:
        profile = source if isinstance(source, Profile) else true_profile(source, threads=threads)
        begun = begun_fits(profile, pitch, [label for label, _ in named], only, aside)
        steps.total += len(begun)
        flat = [evaluated_scene(each, profile) for each in flat_scenes(pitch, side)]
        parts = aside.begin(partial(parts_of, source, profile, flat, walk))
        pictures = shown_pictures(
            profile, pitch, own=own, side=side, threads=threads, progress=steps
        )
        fits = [*given_kernels(named), *finished_fits(begun, steps)]
        if not fits:
            raise FitError(f"{profile.material_name or 'profile'}: no kernel could be fitted.")
        steps("the comparison")
        alone = [each for each in pictures[1:] if each.name in ("disk", "edge")]
        scenes = [each.scene for each in (pictures[0], *alone)]
        timed: dict[str, Any] = {"timed_seconds": _TIMED_SECONDS, "threads": threads}
        timed["progress"] = partial(_before_timing, steps, aside)
        comparison = compare_kernels(profile, scenes, candidates=fits, **timed)
        models, budgets, convergence = parts()
    title = profile.material_name or name or "profile"
    shown = tuple(shown_kernel(each, title, pitch) for each in fits)
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


def _before_timing(steps: Steps, aside: Aside, _done: int, _of: int, name: str) -> None:
    """Let nothing else run while kernels are timed, the last step of a comparison."""
    if name == "timing":
        steps(name)
        aside.wait()
