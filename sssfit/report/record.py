"""What a report holds: pictures, kernels with their exports, the comparison, charts' records."""

import dataclasses
import shlex
from collections.abc import Callable, Collection, Sequence
from typing import Any

from sssfit import __version__
from sssfit.compare.budget import Budget, error_budgets
from sssfit.compare.comparison import Comparison
from sssfit.compare.models import ModelComparison, compare_models
from sssfit.compare.pareto import compare_kernels
from sssfit.compare.spectrum import Spectrum, compute_spectrum
from sssfit.errors import FitError, RenderError, SimulationError
from sssfit.fit import MM_PER_PIXEL, make_target
from sssfit.kernel import Taps
from sssfit.material import Material
from sssfit.messages import note
from sssfit.profile import Profile
from sssfit.render import render
from sssfit.report.kernels import Fitted, ShownKernel, command_of, shown_candidates
from sssfit.report.pack import packed_picture
from sssfit.report.pictures import SIDE, Shown, own_scene, shown_pictures
from sssfit.simulate.truth import true_profile

PHOTONS = 200_000  # of the walk in the models' chart and the budget: half a second
ERROR, COST = "delta-e", "fetches"
_COLOURS = 3  # channels of a picture that the page can show
_TIMED_SECONDS = 2.0
_COMMANDS = ("sssfit simulate {} --method exact", "sssfit compare {}", "sssfit report {}")
_MOST_DRAWN = 12  # kernels whose pictures a page without WebGL2 has

Watch = Callable[[int, int, str], None]


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class Report:
    """All that a page shows of a material.

    Parameters
    ----------
    name : str
        The page's title: the material's name, or that of the profile's file.
    profile : Profile
        What truths and kernels are made from.
    pictures : tuple of Shown
    kernels : tuple of ShownKernel
        Every kernel of the comparison, in its order.
    comparison : Comparison
        On the picture that the page opens with, and on disk and edge.
    spectrum : Spectrum
    models : ModelComparison, optional
    budgets : tuple of Budget
        None of either for a profile, or a material that the exact solver does not cover.
    commands : tuple of str
        The command lines that make the figures again.
    """

    name: str
    profile: Profile
    pictures: tuple[Shown, ...]
    kernels: tuple[ShownKernel, ...]
    comparison: Comparison
    spectrum: Spectrum
    models: ModelComparison | None
    budgets: tuple[Budget, ...]
    commands: tuple[str, ...]

    @property
    def front(self) -> list[str]:
        """Labels of the kernels that no other beats on the first picture, cheapest first."""
        first = self.comparison.pictures[0].name
        return [row.label for row in self.comparison.front(first, ERROR, COST)]

    def to_dict(self) -> dict[str, Any]:
        """Return what the page's scripts read, all of it JSON."""
        return {
            "name": self.name,
            "front": self.front,
            "pictures": [each.to_dict() for each in self.pictures],
            "kernels": [each.to_dict() for each in self.kernels],
            "drawn": self._drawn(),
            "rows": self.comparison.to_dict()["rows"],
        }

    def _drawn(self) -> dict[str, Any]:
        """Return the first picture by the kernels of the front, for a page without WebGL2."""
        by_label = {each.label: each.taps for each in self.kernels}
        first = self.pictures[0].reference
        return {
            label: packed_picture(render(first.scene, by_label[label], border=first.border))
            for label in self.front[:_MOST_DRAWN]
        }

    def figures(self) -> dict[str, Any]:
        """Return the figures that ``sssfit report --json`` prints."""
        return {
            "name": self.name,
            "kernels": [each.label for each in self.kernels],
            "pictures": [each.key for each in self.pictures],
            "front": self.front,
        }

    def provenance(self) -> list[tuple[str, str]]:
        """Return names and values of what the figures depend on."""
        meta = self.profile.meta
        found = [
            ("sssfit", __version__),
            ("profile", str(meta.get("method") or "unknown")),
            ("sha256 of the profile", self.profile.sha256),
            ("sha256 of the material", str(meta.get("material_sha256") or "unknown")),
            ("photons of the profile", str(meta.get("photons") or "none, not sampled")),
            ("seed of the profile", str(meta.get("seed") if meta.get("photons") else "none")),
            ("pixel of the kernels", f"{self.comparison.mm_per_pixel:g} mm"),
            ("threads of the timings", str(self.comparison.threads)),
        ]
        if self.models is not None:
            walk = self.models.walk.profile
            words = f"{walk.photons:,} photons, seed {walk.meta.get('seed')}"
            found.append(("walk of models and budget", words))
        return found


def make_report(
    source: Material | Profile,
    *,
    name: str | None = None,
    named: Sequence[tuple[str, Taps]] = (),
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
    named : sequence of (str, Taps)
        Tables of taps of a user's own, with their labels.
    irradiance : str, optional
        A picture's file, which the page opens with.
    only : collection of str, optional
        Methods of the other kernels; by default those that are fitted in seconds.
    mm_per_pixel : float, optional [mm]
        Of the kernels' pixels; by default those of the picture's file, else 0.3.
    side : int
        Rows and columns of the pictures.
    photons, seed : int
        Of the walk in the models' chart and in the error budget.
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
    steps = _Steps(progress)
    steps("the exact profile")
    profile = source if isinstance(source, Profile) else true_profile(source, threads=threads)
    fits = _fits(profile, pitch, named, only, steps)
    pictures = shown_pictures(profile, pitch, own=own, side=side, threads=threads, progress=steps)
    steps("the comparison")
    alone = [each for each in pictures[1:] if each.name in ("disk", "edge")]
    scenes = [each.scene for each in (pictures[0], *alone)]
    timed: dict[str, Any] = {"timed_seconds": _TIMED_SECONDS, "threads": threads}
    comparison = compare_kernels(profile, scenes, candidates=fits, **timed)
    title = profile.material_name or name or "profile"
    word = shlex.quote(title)
    kernels = tuple(_shown(each, title, pitch) for each in fits)
    steps("models and budget")
    walk = {"photons": photons, "seed": seed, "threads": threads}
    models, budgets = _of_material(source, pictures, walk)
    return Report(
        title,
        profile,
        pictures,
        kernels,
        comparison,
        compute_spectrum(profile, mm_per_pixel=pitch),
        models,
        budgets,
        tuple(each.format(word) for each in _COMMANDS),
    )


class _Steps:
    """Counts the steps of a report as they begin; their number is known once fits are."""

    def __init__(self, report: Watch | None) -> None:
        self.report, self.done, self.total = report, 0, 16

    def __call__(self, name: str) -> None:
        if self.report is not None:
            self.report(min(self.done, self.total), self.total, name)
        self.done += 1


def _fits(
    profile: Profile,
    mm_per_pixel: float,
    named: Sequence[tuple[str, Taps]],
    only: Collection[str] | None,
    steps: _Steps,
) -> list[Fitted]:
    """Fit the candidates, each once; what cannot be fitted is noted and left out."""
    from sssfit.fit import FitResult, TapsFit

    pixels = 2 * make_target(profile, mm_per_pixel, None).half_pixels + 1
    wanted = shown_candidates(pixels, only)
    steps.total += len(wanted)
    found = [
        Fitted(label, taps.method, 0, {}, None, TapsFit(taps, 0, 0.0)) for label, taps in named
    ]
    dense: dict[str, FitResult] = {}
    for each in wanted:
        steps(each.label)
        try:
            if each.taps is not None and each.dense_label not in dense:
                dense[each.dense_label] = each.fit_dense(profile, mm_per_pixel, None)
            fit = each.fit(profile, mm_per_pixel, None, dense.get(each.dense_label))
        except FitError as error:
            note(f"{each.label} is left out: {error}")
            continue
        fields = (each.label, each.method, each.terms, each.settings, each.taps)
        found.append(Fitted(*fields, fit))
    if not found:
        raise FitError(f"{profile.material_name or 'profile'}: no kernel could be fitted.")
    return found


def _shown(fit: Fitted, title: str, mm_per_pixel: float) -> ShownKernel:
    """Return a fit as the page has it."""
    assert fit.found is not None
    assert isinstance(fit.found.kernel, Taps)
    made = fit.settings or fit.taps
    command = (
        command_of(fit, shlex.quote(f"{title}.profile.npz"), mm_per_pixel)
        if made
        else "given as a file"
    )
    return ShownKernel(fit.label, fit.found.kernel, command)


def _of_material(
    source: Material | Profile, pictures: Sequence[Shown], walk: dict[str, Any]
) -> tuple[ModelComparison | None, tuple[Budget, ...]]:
    """Return what needs coefficients; a material that the exact solver does not cover has none."""
    if isinstance(source, Profile):
        return None, ()
    flat = [each.scene for each in pictures if each.name in ("disk", "edge")]
    try:
        return compare_models(source, **walk), tuple(error_budgets(source, flat, **walk))
    except SimulationError as refusal:
        note(f"No models and no budget: {refusal}")
        return None, ()
