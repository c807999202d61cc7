"""The table of taps for a scene: the cheapest within a tolerance, or the best within a budget.

What is judged is CIE Delta E 2000 of a picture against the profile's own 2D kernel, its 95th
percentile unless another figure is asked for (``views``); what counts as cheap is texture fetches a
pixel, then passes (``options``). Neither depends on a clock, so the same seed gives the same
choice.

No blur at all is tried first. Then the options that no cheaper one is expected to beat are halved
until the cheapest that will do is found, and the one before the next cheaper is tried as well, or
where none seems to do the last three: the order of their errors on other kernels and pictures is
nearly that of the kernels known (``sssfit.fit.structures``). So what is chosen holds, and the next
cheaper of those options does not; that nothing else would do for less is not proved.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

import numpy as np

from sssfit.arrays import FloatArray, check_record, plain
from sssfit.choose.options import Option, check_caps, half_pixels, options
from sssfit.choose.truth import (
    PhotonNeed,
    check_colours,
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
from sssfit.fit import TapsFit, support_of
from sssfit.fit.structures import width_pixels
from sssfit.material import Material
from sssfit.measure.score import COLOUR_FIGURES
from sssfit.messages import shown
from sssfit.profile import Profile
from sssfit.render.taps import render_taps
from sssfit.scene.record import Scene

__all__ = ["TOLERANCES", "Choice", "PhotonNeed", "Step", "choose", "mm_per_pixel_at"]

TOLERANCE = 1.0  # of Delta E, unless there is a budget: about what an eye sees side by side
# Truths of 8193 pixels: skin1 on pixels of .005 mm. On finer ones a picture of 512 pixels shows
# less than a ninth of the kernel.
MOST_HALF_PIXELS = 4096
_BEST_OF = 3  # tables within a budget that are compared: those that leave the least of skin1


@dataclass(frozen=True, slots=True)
class Step:
    """One option that was tried.

    Parameters
    ----------
    option : Option, optional
        None is no blur: irradiance times diffuse reflectance.
    error : float
        The figure that the tolerance is of, on its worst view; on the first that was out of
        tolerance, where one was.
    delta_e_2000_mean, delta_e_2000_p95, delta_e_2000_p99, share_above_1 : float
        Errors of that view; see `ImageScore`.
    mm_per_pixel : float [mm]
        Pixel size of that view.
    within : bool
        Whether every view is within the tolerance, wider ones within 95 % of it.
    """

    option: Option | None
    error: float
    delta_e_2000_mean: float
    delta_e_2000_p95: float
    delta_e_2000_p99: float
    share_above_1: float
    mm_per_pixel: float
    within: bool

    @property
    def label(self) -> str:
        """In words."""
        return "no blur" if self.option is None else self.option.label

    @property
    def fetches(self) -> float:
        """Texture fetches a pixel."""
        return 0.0 if self.option is None else self.option.fetches

    @property
    def passes(self) -> int:
        """Passes of the stages."""
        return 0 if self.option is None else self.option.passes

    def to_dict(self) -> dict[str, Any]:
        """Return a row of ``sssfit choose --json``; without a method it is no blur."""
        return plain(
            {
                "label": self.label,
                "method": self.option and self.option.method,
                "settings": self.option.settings if self.option else {},
                "fetches": self.fetches,
                "passes": self.passes,
                "error": self.error,
                **{key: getattr(self, key) for key in COLOUR_FIGURES},
                "mm_per_pixel": self.mm_per_pixel,
                "within": self.within,
            }
        )


@dataclass(frozen=True, slots=True, eq=False)
class Choice:
    """The table of taps to take, and why neither less nor more is needed.

    Parameters
    ----------
    profile : Profile
        What the table is fitted to and the truth is made from.
    mm_per_pixel : float [mm]
    tolerance : float, optional
        Largest error; None where the best within a budget was asked for.
    tolerance_of : str
        A key of `TOLERANCES`: which figure of Delta E 2000 the error is.
    fetches, passes : float and int, optional
        The budgets.
    scenes : tuple of Scene
        The pictures; the first has the pixels asked for. Empty where none was needed.
    steps : tuple of Step
        Everything tried, in order; the first is no blur.
    chosen : Step, optional
        None where the profile, or the head, is under a pixel.
    fit : TapsFit, optional
        None where no blur is needed.
    cheaper : Step, optional
        The next cheaper step.
    dearer : Step, optional
        The next dearer option, which may be beyond the budget.
    photons : PhotonNeed, optional
        How few photons would have done; None where no blur is needed, without a tolerance, or where
        no walk can tell: the profile is of no material, under a beam, or not by transport.
    seconds_per_megapixel : float, optional [s]
        Measured, of the chosen table.
    unfitted : tuple of str
        Options that cannot be fitted to this profile.
    """

    profile: Profile
    mm_per_pixel: float
    tolerance: float | None
    tolerance_of: str
    fetches: float | None = None
    passes: int | None = None
    scenes: tuple[Scene, ...] = ()
    steps: tuple[Step, ...] = ()
    chosen: Step | None = None
    fit: TapsFit | None = None
    cheaper: Step | None = None
    dearer: Step | None = None
    photons: PhotonNeed | None = None
    seconds_per_megapixel: float | None = None
    unfitted: tuple[str, ...] = ()

    @property
    def wider_tolerance(self) -> float | None:
        """Largest error of a close-up's wider views."""
        return None if self.tolerance is None else WIDER * self.tolerance

    @property
    def support_mm(self) -> float:
        """Radius that keeps 99.9 % of every channel [mm]."""
        return support_of(self.profile)

    def to_dict(self) -> dict[str, Any]:
        """Return the figures that ``sssfit choose --json`` prints; no kernel where none is needed.

        ``rows`` has every step that was tried, in order.
        """
        steps = {"chosen": self.chosen, "cheaper": self.cheaper, "dearer": self.dearer}
        return plain(
            {
                "material": self.profile.material_name,
                "profile_method": self.profile.meta.get("method"),
                "mm_per_pixel": self.mm_per_pixel,
                "support_mm": self.support_mm,
                "tolerance": self.tolerance,
                "tolerance_of": self.tolerance_of,
                "most_fetches": self.fetches,
                "most_passes": self.passes,
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
            "structure": kernel.structure,
            "fetches": kernel.fetches,
            "passes": kernel.passes,
            "all_passes": kernel.cost.all_passes,
            "bytes_per_pixel": kernel.bytes_per_pixel(),
            "seconds_per_megapixel": self.seconds_per_megapixel,
            "spectral_error": kernel.errors["spectral"],
        }


def choose(
    source: Material | Profile,
    *,
    mm_per_pixel: float,
    scene: Scene | None = None,
    distance_mm: float = 600.0,
    frame: tuple[int, int] = (1080, 1920),
    tolerance: float | None = None,
    tolerance_of: str = "p95",
    fetches: float | None = None,
    passes: int | None = None,
    seed: int = 1,
    threads: int | None = None,
    progress: Callable[[Step], None] | None = None,
) -> Choice:
    """Find the cheapest table of taps within a tolerance, or the best within a budget.

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
    tolerance : float, optional
        Largest error, above 0; by default 1, without one where ``fetches`` are given.
    tolerance_of : str
        A key of `TOLERANCES`: "p95", "p99" or "mean" of Delta E 2000.
    fetches : float, optional
        Most texture fetches a pixel, from 6 up. Without a tolerance the table that leaves the least
        error is chosen.
    passes : int, optional
        Most passes of the stages.
    seed : int
        Seed of the walks.
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
    check_record("source", source, Material | Profile, RenderError)
    note_truth(source)
    if tolerance is None and fetches is None:
        tolerance = TOLERANCE
    _check(mm_per_pixel, tolerance, tolerance_of)
    check_caps(fetches, passes)
    check_colours(source)
    own = None if scene is None else checked_scene(scene, mm_per_pixel)
    profile, seconds = truth_of(source, seed=seed, threads=threads)
    if not (profile.total_on_grid > 0.0).any():
        raise FitError(f"{name_of(source)} returns no light: there is nothing to blur.")
    support_mm = support_of(profile)
    _check_kernel(support_mm, mm_per_pixel)
    given: dict[str, Any] = {
        "profile": profile,
        "mm_per_pixel": mm_per_pixel,
        "tolerance": tolerance,
        "tolerance_of": tolerance_of,
        "fetches": fetches,
        "passes": passes,
    }
    if half_pixels(support_mm, mm_per_pixel) == 0:
        return Choice(**given)
    scenes = (
        [evaluated_scene(own, profile)]
        if own
        else head_scenes(mm_per_pixel, distance_mm, frame, threads)
    )
    if not any(each.mask is None or (each.mask > 0).any() for each in scenes):
        return Choice(**given, scenes=tuple(scenes))
    limit = math.inf if tolerance is None else tolerance
    views = Views(profile, scenes, threads, tolerance=limit, tolerance_of=tolerance_of)
    width = width_pixels(profile, mm_per_pixel)
    within, every = options(width, fetches, passes), options(width, None, passes)
    search = _Search(views, within, every, progress)
    return search.run(given, material_of(source), seconds, seed)


def _check(mm_per_pixel: float, tolerance: float | None, tolerance_of: str) -> None:
    """Refuse values out of their range, before anything is simulated."""
    if tolerance_of not in TOLERANCES:
        raise RenderError(
            f"tolerance_of = {shown(tolerance_of)}; expected one of {', '.join(TOLERANCES)}."
        )
    if tolerance is not None and not (math.isfinite(tolerance) and tolerance > 0.0):
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

    def __init__(
        self,
        views: Views,
        within: list[Option],
        every: list[Option],
        progress: Callable[[Step], None] | None,
    ) -> None:
        self.views, self.options, self.every, self.progress = views, within, every, progress
        self.steps: list[Step] = []
        self.tried: dict[int, Step | None] = {}
        self.unfitted: list[str] = []

    def run(
        self, given: Mapping[str, Any], material: Material | None, seconds: float, seed: int
    ) -> Choice:
        """Try no blur, then options; then what is beside the one that is taken."""
        views = self.views
        given = {**given, "scenes": tuple(views.scenes)}
        nothing = self._keep(self._evaluated(None))
        is_limited = math.isfinite(views.tolerance)
        if is_limited and nothing is not None and nothing.within:
            return Choice(**given, steps=tuple(self.steps), chosen=nothing)
        place = self._cheapest() if is_limited else self._best()
        chosen = self.tried[place]
        assert chosen is not None  # one that was judged
        assert chosen.option is not None
        fitted = views.fit_of(chosen.option)
        if fitted is None:
            raise FitError(f"{chosen.label} has no kernel on pixels of this size.")
        if not is_limited and nothing is not None and nothing.error <= chosen.error:
            return Choice(**given, steps=tuple(self.steps), chosen=nothing)
        return Choice(
            **given,
            steps=tuple(self.steps),
            chosen=chosen,
            fit=fitted,
            cheaper=self._next_cheaper(chosen),
            dearer=self._next_dearer(chosen),
            photons=(
                photons_needed(material, chosen.option, views, seed, seconds)
                if is_limited
                else None
            ),
            seconds_per_megapixel=self._seconds(fitted),
            unfitted=tuple(self.unfitted),
        )

    def _cheapest(self) -> int:
        """Return the place of the cheapest option that was found within the tolerance."""
        first, last = 0, len(self.options)
        while first < last:
            middle = (first + last) // 2
            if self._is_within(middle):
                last = middle
            else:
                first = middle + 1
        if last == len(self.options):
            last = next((k for k in self._last_few() if self._is_within(k)), last)
        if last == len(self.options):
            raise RenderError(self._too_tight())
        if last > 1 and self._is_within(last - 2):
            last -= 2
        while last > 0 and self._is_within(last - 1):
            last -= 1
        return last

    def _last_few(self) -> range:
        """Return the places of the options that are expected to leave the least."""
        return range(max(len(self.options) - _BEST_OF, 0), len(self.options))

    def _best(self) -> int:
        """Return the place of the option with the least error, of the last few."""
        places = [k for k in self._last_few() if self._step(k) is not None]
        if not places:
            raise FitError("no table within this budget can be fitted to the profile.")
        return min(places, key=lambda k: self.tried[k].error)  # type: ignore[union-attr]

    def _is_within(self, place: int) -> bool:
        step = self._step(place)
        return step is not None and step.within

    def _step(self, place: int) -> Step | None:
        """Judge an option once; None where it cannot be fitted."""
        if place not in self.tried:
            self.tried[place] = self._keep(self._evaluated(self.options[place]))
        return self.tried[place]

    def _keep(self, step: Step | None) -> Step | None:
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
            self.unfitted.append(option.label)
            return None
        return Step(
            option=option,
            error=found.error,
            **{key: getattr(found.score, key) for key in COLOUR_FIGURES},
            mm_per_pixel=found.mm_per_pixel,
            within=found.within,
        )

    def _next_cheaper(self, chosen: Step) -> Step | None:
        """Return the step that costs the most of those that cost less, in fetches, then passes."""
        cost = attrgetter("fetches", "passes")
        below = [each for each in self.steps if cost(each) < cost(chosen)]
        return max(below, key=cost, default=None)

    def _next_dearer(self, chosen: Step) -> Step | None:
        """Judge the next option that costs more fetches, in the budget or beyond it."""
        above = (each for each in self.every if each.fetches > chosen.fetches)
        dearer = next(above, None)
        if dearer is None:
            return None
        tried = (each for each in self.steps if each.option == dearer)
        return next(tried, None) or self._evaluated(dearer)

    def _seconds(self, fitted: TapsFit) -> float:
        """Measure what the chosen table takes [s a megapixel]."""

        def render(scene: Scene) -> FloatArray:
            blurred = render_taps(scene, fitted.kernel, threads=self.views.threads)
            return np.asarray(blurred, dtype=np.float64)

        return timed(render, self.views.scenes[0])[1]

    def _too_tight(self) -> str:
        best = min(self.steps, key=lambda each: each.error)
        return (
            f"nothing is within a Delta E ({self.views.tolerance_of}) of {self.views.tolerance:g}: "
            f"the best of {len(self.steps)}, {best.label}, has {best.error:.2g} on pixels of "
            f"{best.mm_per_pixel:.3g} mm; give a larger tolerance, more fetches or more passes."
        )
