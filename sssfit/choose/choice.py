"""The cheapest kernel whose picture stays within a tolerance.

What is judged is CIE Delta E 2000 of a picture against the profile's own 2D kernel, its 95th
percentile unless another figure is asked for (``views``); what counts as cheap is weights
applied to a pixel, ties going to the smaller error (``options``). Neither depends on a
clock, so the same seed gives the same choice.

No blur at all is tried first, then every option in the order of its cost until one will do. Left
out are supports too narrow for any kernel: those to which the profile's own kernel cannot be cut
(its energy kept) without leaving the tolerance, except for the widest of them.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sssfit.arrays import FloatArray, plain
from sssfit.choose.options import (
    Option,
    by_cost,
    half_pixels,
    options,
    split_guided,
    supports,
)
from sssfit.choose.truth import (
    PhotonNeed,
    check_colours,
    is_exact,
    material_of,
    name_of,
    note_truth,
    photons_needed,
    truth_of,
)
from sssfit.choose.views import (
    LEAST_MM_PER_PIXEL,
    TOLERANCES,
    WIDER,
    Views,
    checked_scene,
    head_scenes,
    mm_per_pixel_at,
)
from sssfit.compare.evaluate import timed
from sssfit.compare.references import evaluated_scene
from sssfit.errors import FitError, RenderError
from sssfit.fit import FitResult, support_of
from sssfit.material import Material
from sssfit.measure.score import COLOUR_FIGURES
from sssfit.profile import Profile
from sssfit.render.separable import render_separable
from sssfit.scene.record import Scene

__all__ = ["TOLERANCES", "Choice", "PhotonNeed", "Step", "choose", "is_exact", "mm_per_pixel_at"]

# Kernels of 8193 pixels: skin1 on pixels of .005 mm. On finer ones a picture of 512 pixels shows
# less than a ninth of the kernel, and the search would take hours.
MOST_HALF_PIXELS = 4096


@dataclass(frozen=True, slots=True)
class Step:
    """One option that was tried.

    Parameters
    ----------
    option : Option, optional
        None is no blur: irradiance times diffuse reflectance.
    taps_per_pixel : int
        Its cost.
    error : float
        The figure that the tolerance is of, on its worst view; on the first that was out of
        tolerance, where one was.
    delta_e_2000_mean, delta_e_2000_p95, delta_e_2000_p99, share_above_1 : float
        Of that view; see `ImageScore`.
    mm_per_pixel : float [mm]
        Of that view.
    within : bool
        Whether every view is within the tolerance, wider ones within 95 % of it.
    """

    option: Option | None
    taps_per_pixel: int
    error: float
    delta_e_2000_mean: float
    delta_e_2000_p95: float
    delta_e_2000_p99: float
    share_above_1: float
    mm_per_pixel: float
    within: bool

    @property
    def label(self) -> str:
        """In words, without the support."""
        return "no blur" if self.option is None else self.option.candidate.label

    def to_dict(self) -> dict[str, Any]:
        """Return a row of ``sssfit choose --json``; without a method it is no blur."""
        option = self.option
        return plain(
            {
                "label": self.label,
                "method": option and option.candidate.method,
                "rank": option.candidate.terms if option else 0,
                "settings": option.candidate.settings if option else {},
                "share": option and option.share,
                "support_mm": option and option.support_mm,
                "pixels": option.pixels if option else 1,
                "taps_per_pixel": self.taps_per_pixel,
                "error": self.error,
                **{key: getattr(self, key) for key in COLOUR_FIGURES},
                "mm_per_pixel": self.mm_per_pixel,
                "within": self.within,
            }
        )


@dataclass(frozen=True, slots=True, eq=False)
class Choice:
    """The cheapest that will do, and why neither less nor more is needed.

    Parameters
    ----------
    profile : Profile
        What the kernel is fitted to and the truth is made from.
    mm_per_pixel : float [mm]
    tolerance : float
        Largest error.
    tolerance_of : str
        A key of `TOLERANCES`: which figure of Delta E 2000 the error is.
    scenes : tuple of Scene
        The pictures; the first has the pixels asked for. Empty where none was needed.
    steps : tuple of Step
        Everything tried, in order; the first is no blur.
    chosen : Step, optional
        None where the profile, or the head, is under a pixel.
    fit : FitResult, optional
        None where no blur is needed.
    runner_up : Step, optional
        The next best that will do as well.
    cheaper : Step, optional
        The next cheaper step, which will not do.
    dearer : tuple of Step
        What another term, a wider support and the dearest option would give.
    photons : PhotonNeed, optional
        How few photons would have done; None where no blur is needed, or where no walk can tell:
        the profile is of no material, or not by transport.
    seconds_per_megapixel : float, optional [s]
        Measured, of the chosen kernel.
    too_narrow : tuple of int
        Pixels of the supports that were left out: the true kernel itself cannot be cut to them.
    unfitted : tuple of str
        Candidates that cannot be fitted to this profile: seven Gaussians to six annuli, say.
    """

    profile: Profile
    mm_per_pixel: float
    tolerance: float
    tolerance_of: str
    scenes: tuple[Scene, ...] = ()
    steps: tuple[Step, ...] = ()
    chosen: Step | None = None
    fit: FitResult | None = None
    runner_up: Step | None = None
    cheaper: Step | None = None
    dearer: tuple[Step, ...] = ()
    photons: PhotonNeed | None = None
    seconds_per_megapixel: float | None = None
    too_narrow: tuple[int, ...] = ()
    unfitted: tuple[str, ...] = ()

    @property
    def wider_tolerance(self) -> float:
        """Largest error of a close-up's wider views."""
        return WIDER * self.tolerance

    @property
    def support_mm(self) -> float:
        """Radius that keeps 99.9 % of every channel [mm]."""
        return support_of(self.profile)

    def to_dict(self) -> dict[str, Any]:
        """Return the figures that ``sssfit choose --json`` prints; no kernel where none is needed.

        ``rows`` has every step that was tried, in order.
        """
        steps = {"chosen": self.chosen, "runner_up": self.runner_up, "cheaper": self.cheaper}
        return plain(
            {
                "material": self.profile.material_name,
                "profile_method": self.profile.meta.get("method"),
                "mm_per_pixel": self.mm_per_pixel,
                "support_mm": self.support_mm,
                "tolerance": self.tolerance,
                "tolerance_of": self.tolerance_of,
                "pictures": [
                    {
                        "irradiance": each.name,
                        "width": each.width,
                        "height": each.height,
                        "mm_per_pixel": each.mm_per_pixel,
                    }
                    for each in self.scenes
                ],
                "kernel": self._kernel_figures(),
                **{key: each and each.to_dict() for key, each in steps.items()},
                "dearer": [each.to_dict() for each in self.dearer],
                "too_narrow": self.too_narrow,
                "unfitted": self.unfitted,
                "photons": self.photons and self.photons.to_dict(),
                "rows": [each.to_dict() for each in self.steps],
            }
        )

    def _kernel_figures(self) -> dict[str, Any] | None:
        """Return what was fitted, and what it takes; None where no blur is needed."""
        if self.fit is None:
            return None
        kernel = self.fit.kernel
        return {
            "method": kernel.method,
            "rank": kernel.rank,
            "pixels": kernel.pixels,
            "support_mm": kernel.support_mm,
            "seconds_per_megapixel": self.seconds_per_megapixel,
            "relative_frobenius_error": self.fit.relative_frobenius_error,
        }


def choose(
    source: Material | Profile,
    *,
    mm_per_pixel: float,
    scene: Scene | None = None,
    distance_mm: float = 600.0,
    frame: tuple[int, int] = (1080, 1920),
    tolerance: float = 1.0,
    tolerance_of: str = "p95",
    seed: int = 1,
    threads: int | None = None,
    progress: Callable[[Step], None] | None = None,
) -> Choice:
    """Find the cheapest method, support and rank that keep within a tolerance.

    Parameters
    ----------
    source : Material or Profile
        A material's exact profile is the truth; where there is no exact method (slabs, layers), a
        walk of 1e7 photons. A profile is the truth itself.
    mm_per_pixel : float [mm]
        `mm_per_pixel_at` has it for a distance, a field of view and the rows of a frame.
    scene : Scene, optional
        Judged on in place of the head, its middle 512 x 512 pixels at most, within its mask.
    distance_mm : float [mm]
        From the eye to the head, 100 or more.
    frame : tuple of int
        Rows and columns that are rendered; of more than 512 the middle ones show the head.
    tolerance : float
        Largest error, above 0.
    tolerance_of : str
        A key of `TOLERANCES`: "p95", "p99" or "mean" of Delta E 2000.
    seed : int
        Of the walks.
    threads : int, optional
        By default all cores; the choice does not depend on it.
    progress : callable, optional
        Called with every step.

    Raises
    ------
    RenderError
        A value out of its range, a picture of one colour, or nothing within the tolerance.
    SimulationError, FitError
        No profile, or one that cannot be fitted.
    """
    note_truth(source)
    _check(mm_per_pixel, tolerance, tolerance_of)
    check_colours(source)
    own = None if scene is None else checked_scene(scene, mm_per_pixel)
    profile, seconds = truth_of(source, seed=seed, threads=threads)
    if not (profile.total_on_grid > 0.0).any():
        raise FitError(f"{name_of(source)} returns no light: there is nothing to blur.")
    support_mm = support_of(profile)
    _check_kernel(support_mm, mm_per_pixel)
    given = (profile, mm_per_pixel, tolerance, tolerance_of)
    if half_pixels(support_mm, mm_per_pixel) == 0:
        return Choice(*given)
    scenes = (
        [evaluated_scene(own, profile)]
        if own
        else head_scenes(mm_per_pixel, distance_mm, frame, threads)
    )
    if not any(each.mask is None or (each.mask > 0).any() for each in scenes):
        return Choice(*given, tuple(scenes))
    views = Views(profile, scenes, threads, tolerance=tolerance, tolerance_of=tolerance_of)
    return _Search(views, progress).run(material_of(source), seconds, seed)


def _check(mm_per_pixel: float, tolerance: float, tolerance_of: str) -> None:
    """Refuse values out of their range, before anything is simulated."""
    if tolerance_of not in TOLERANCES:
        raise RenderError(
            f"tolerance_of = {tolerance_of!r}; expected one of {', '.join(TOLERANCES)}."
        )
    if not (math.isfinite(tolerance) and tolerance > 0.0):
        raise RenderError(f"tolerance = {tolerance:g}; expected a Delta E above 0.")
    if not LEAST_MM_PER_PIXEL <= mm_per_pixel < math.inf:
        raise RenderError(
            f"mm_per_pixel = {mm_per_pixel:g}; expected a length from {LEAST_MM_PER_PIXEL:g} mm up."
        )


def _check_kernel(support_mm: float, mm_per_pixel: float) -> None:
    """Refuse pixels on which a kernel is too wide to be searched for."""
    if support_mm / mm_per_pixel > MOST_HALF_PIXELS:
        raise RenderError(
            f"on pixels of {mm_per_pixel:.3g} mm a kernel of +-{support_mm:.3g} mm has "
            f"{2.0 * support_mm / mm_per_pixel:.3g} pixels, and {2 * MOST_HALF_PIXELS + 1} are the "
            f"most; expected pixels of {support_mm / MOST_HALF_PIXELS:.2g} mm or more."
        )


class _Search:
    """The steps, and the pictures they are tried on."""

    def __init__(self, views: Views, progress: Callable[[Step], None] | None) -> None:
        self.views, self.progress = views, progress
        self.steps: list[Step] = []
        self.unfitted: list[str] = []

    def run(self, material: Material | None, seconds: float, seed: int) -> Choice:
        """Try no blur, then options by cost; then what is beside the one that will do."""
        views, pitch = self.views, self.views.scenes[0].mm_per_pixel
        given = (views.profile, pitch, views.tolerance, views.tolerance_of, tuple(views.scenes))
        nothing = self._try(None)
        if nothing is not None and nothing.within:
            return Choice(*given, steps=tuple(self.steps), chosen=nothing)
        every = supports(views.profile, pitch)
        kept = self._useful_supports(every)
        found = options(kept, pitch)
        chosen, runner_up = self._cheapest(found)
        if chosen is None or chosen.option is None:
            raise RenderError(self._too_tight())
        fitted = chosen.option.fit(views.profile, pitch)
        if fitted is None:
            raise FitError(f"{chosen.label} has no kernel on pixels of {pitch:.4g} mm.")
        return Choice(
            *given,
            steps=tuple(self.steps),
            chosen=chosen,
            fit=fitted,
            runner_up=runner_up,
            cheaper=_next_cheaper(self.steps, chosen),
            dearer=self._dearer(chosen.option, found),
            photons=photons_needed(material, chosen.option, views, seed, seconds),
            seconds_per_megapixel=self._seconds(fitted),
            too_narrow=tuple(
                2 * half_pixels(radius, pitch) + 1
                for share, radius in every
                if (share, radius) not in kept
            ),
            unfitted=tuple(dict.fromkeys(self.unfitted)),
        )

    def _try(self, option: Option | None) -> Step | None:
        """Judge an option and keep its step; None where it cannot be fitted."""
        step = self._evaluated(option)
        if step is not None:
            self.steps.append(step)
            if self.progress:
                self.progress(step)
        return step

    def _evaluated(self, option: Option | None) -> Step | None:
        try:
            found = self.views.score_of_option(option)
        except FitError:
            if option is None:
                raise
            self.unfitted.append(option.candidate.label)
            return None
        return Step(
            option=option,
            taps_per_pixel=option.taps_per_pixel if option else 0,
            error=found.error,
            **{key: getattr(found.score, key) for key in COLOUR_FIGURES},
            mm_per_pixel=found.mm_per_pixel,
            within=found.within,
        )

    def _useful_supports(self, found: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
        """Leave out supports to which even the true kernel cannot be cut, except for the widest.

        That one is kept so that the next cheaper step is one that was tried.
        """
        pitch = self.views.scenes[0].mm_per_pixel
        for k, (_, radius) in enumerate(found):
            if self.views.error_of_cut(half_pixels(radius, pitch)) <= self.views.tolerance:
                return list(found[max(k - 1, 0) :])
        return list(found[-1:])

    def _cheapest(self, found: Sequence[Option]) -> tuple[Step | None, Step | None]:
        """Return the cheapest option within the tolerance and the next best that is too."""
        within: list[Step] = []
        for group in by_cost(found):
            quick, slow = split_guided(group)
            steps = [self._try(each) for each in quick]
            if not within and not any(each and each.within for each in steps):
                steps += [self._try(each) for each in slow]
            best = [each for each in steps if each and each.within]
            within += sorted(best, key=lambda each: each.error)
            if len(within) > 1:
                break
        first, second, *_ = (*within, None, None)
        return first, second

    def _dearer(self, chosen: Option, found: Sequence[Option]) -> tuple[Step, ...]:
        """Judge one term more, the next wider support, and the dearest of all."""
        terms = chosen.candidate.terms + 1
        more = [
            each
            for each in found
            if (each.candidate.label, each.share) == (f"svd {terms}", chosen.share)
        ]
        wider = [
            each
            for each in found
            if each.candidate == chosen.candidate and each.pixels > chosen.pixels
        ]
        dearest = [each for each in found if each.candidate.method == "svd"][-1:]
        picked: list[Option] = []
        for option in (*more, *wider[:1], *dearest):
            if option != chosen and option not in picked:
                picked.append(option)
        evaluated = (self._evaluated(each) for each in picked)
        return tuple(each for each in evaluated if each is not None)

    def _seconds(self, fitted: FitResult) -> float:
        """Measure what the chosen kernel takes [s a megapixel]."""

        def render(scene: Scene) -> FloatArray:
            blurred = render_separable(scene, fitted.kernel, threads=self.views.threads)
            return np.asarray(blurred, dtype=np.float64)

        return timed(render, self.views.scenes[0])[1]

    def _too_tight(self) -> str:
        best = min(self.steps, key=lambda each: each.error)
        return (
            f"nothing is within a Delta E ({self.views.tolerance_of}) of {self.views.tolerance:g}: "
            f"the best of {len(self.steps)}, {best.label}, has {best.error:.2g} on pixels of "
            f"{best.mm_per_pixel:.3g} mm; give a larger tolerance."
        )


def _next_cheaper(steps: Sequence[Step], chosen: Step) -> Step | None:
    """Return the step that costs the most of those that cost less; the best of several such."""
    below = [each for each in steps if each.taps_per_pixel < chosen.taps_per_pixel]
    return max(below, key=lambda each: (each.taps_per_pixel, -each.error), default=None)
