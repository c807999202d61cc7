"""The causes of an error budget: profiles and kernels with one thing wrong, and what that does."""

import dataclasses
import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from sssfit.arrays import FloatArray, ReadOnly
from sssfit.compare.candidates import Candidate
from sssfit.compare.covered import model_profiles
from sssfit.errors import KernelError, RenderError
from sssfit.fit.on_taps import LEAST_TAPS, on_taps
from sssfit.grid import RadialGrid, make_grid
from sssfit.kernel import Kernel, SeparableKernel, Stage, Taps
from sssfit.material import Material
from sssfit.measure.score import ImageScore, measure
from sssfit.messages import note, shown
from sssfit.profile import Profile
from sssfit.render import render
from sssfit.render.full_resolution import render_full_resolution
from sssfit.render.reference import convolve, reference_quadrant
from sssfit.render.separable import render_separable
from sssfit.render.taps import render_taps
from sssfit.scene.patterns import DISK_RADIUS_MM
from sssfit.scene.record import Scene
from sssfit.simulate import Progress, simulate
from sssfit.simulate.truth import exact_with_all_light, radius_of

# What leaves a slab below is no part of a picture.
_NOTHING_BELOW: dict[str, Any] = dict.fromkeys(
    (
        "annulus_transmittance",
        "beyond_grid_transmittance",
        "annulus_transmittance_stderr",
        "beyond_grid_transmittance_stderr",
    )
)
STORAGES = {"float64": "float64", "float32": "float32", "half": "half float", "8-bit": "8 bit"}


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class Sources:
    """Profiles of one material on the same wide annuli; the first ``annuli`` are the grid.

    Parameters
    ----------
    exact, walk : Profile
        The truth, and the photon walk.
    models : mapping of str to Profile
        Those that are of such a material, by name.
    annuli : int
        Annuli of the grid that a user's simulation has; the others hold what lies beyond it.
    """

    exact: Profile
    walk: Profile
    models: dict[str, Profile]
    annuli: int

    def on_grid(self, profile: Profile) -> Profile:
        """Return the profile as simulated on the grid: what is further out is but a sum."""
        far, kept = slice(self.annuli, None), slice(self.annuli)
        stderr = np.vstack((profile.annulus_energy_stderr[far], profile.beyond_grid_stderr))
        return dataclasses.replace(
            profile,
            r_edges_mm=profile.r_edges_mm[: self.annuli + 1],
            annulus_energy=profile.annulus_energy[kept],
            annulus_energy_stderr=profile.annulus_energy_stderr[kept],
            beyond_grid=profile.annulus_energy[far].sum(axis=0) + profile.beyond_grid,
            beyond_grid_stderr=np.sqrt((stderr**2).sum(axis=0)),
            **_NOTHING_BELOW,
        )

    def cut(self, profile: Profile) -> Profile:
        """Return the profile without the light beyond the grid."""
        return dataclasses.replace(
            self.on_grid(profile),
            beyond_grid=np.zeros(profile.n_channels),
            beyond_grid_stderr=np.zeros(profile.n_channels),
        )


def make_sources(
    material: Material,
    reach_mm: float,
    *,
    photons: int,
    seed: int = 1,
    radius_mm: float | None = None,
    threads: int | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Sources:
    """Simulate a material by the exact solver, the photon walk and its models.

    The truth's grid is doubled until at most 0.01 % of any channel's light lies beyond it, or the
    picture ends: light beyond the user's grid then falls where it belongs.

    Parameters
    ----------
    material : Material
    reach_mm : float [mm]
        How far apart two pixels of the picture can be along an axis.
    photons, seed, threads, progress
        Those of the walk; see ``simulate_montecarlo``.
    radius_mm : float, optional [mm]
        The grid of which the budget says what it loses; by default the paper's.

    Raises
    ------
    SimulationError
        The exact solver refuses the material, or settings are out of range.
    """
    grid = make_grid(material, radius_mm=radius_mm)
    exact = exact_with_all_light(material, grid, reach_mm, threads=threads)
    wide_mm = radius_of(RadialGrid(grid.dr_mm, exact.n_annuli))
    walk = simulate(
        material,
        "montecarlo",
        photons=photons,
        seed=seed,
        radius_mm=wide_mm,
        threads=threads,
        progress=progress,
    )
    total = exact.diffuse_reflectance
    models, left_out = model_profiles(material, total, dr_mm=grid.dr_mm, radius_mm=wide_mm)
    for line in left_out:
        note(line)
    return Sources(exact, walk, models, grid.annuli)


def _reach_mm(scene: Scene, grid_mm: float) -> float:
    """Return how far two pixels can be apart [mm]; disks are enlarged by what their light takes."""
    least = math.ceil(2.0 * (DISK_RADIUS_MM + grid_mm) / scene.mm_per_pixel)
    height, width = (
        max(each, least) if scene.name == "disk" else each for each in (scene.height, scene.width)
    )
    return scene.mm_per_pixel * math.hypot(height - 1, width - 1)


def stored(kernel: Kernel, storage: str) -> Kernel:
    """Return the kernel after its weights have been stored and read back.

    Of a table of taps these are the weights beside the middle and the blend; the middle is what
    they leave of 1.

    Parameters
    ----------
    kernel : SeparableKernel or Taps
    storage : str
        "float64" changes nothing; "float32"; "half", IEEE 754 binary16; "8-bit", whole numbers
        with one scale a channel, its largest weight: 0 to 255, or -127 to 127 where a weight of
        the channel is negative.

    Raises
    ------
    KernelError
        No such storage.
    """
    if storage not in STORAGES:
        raise KernelError(f"storage = {shown(storage)}; expected one of {', '.join(STORAGES)}.")
    if isinstance(kernel, SeparableKernel):
        return dataclasses.replace(kernel, weights=_rounded(kernel.weights, storage))
    stages = tuple(_stored_stage(each, storage) for each in kernel.stages)
    blend = _rounded(kernel.blend[None], storage)[0]
    return dataclasses.replace(kernel, stages=stages, blend=blend)


def _stored_stage(stage: Stage, storage: str) -> Stage:
    """Round the weights of a stage beside the middle."""
    weights = np.array(stage.weights)
    beside = _rounded(weights[None, 1:], storage)[0]
    weights[0] += stage.copies * (weights[1:] - beside).sum(axis=0)
    weights[1:] = beside
    return dataclasses.replace(stage, weights=weights)


def _rounded(weights: FloatArray, storage: str) -> FloatArray:
    """Return weights (T, P, C) as they are read back."""
    if storage == "8-bit":
        return _eight_bit(weights)
    kinds = {"float64": np.float64, "float32": np.float32, "half": np.float16}
    kept: FloatArray = weights.astype(kinds[storage]).astype(np.float64)
    return kept


def _eight_bit(weights: FloatArray) -> FloatArray:
    """Round weights (T, P, C) to steps of each channel's largest one."""
    largest = np.abs(weights).max(axis=(0, 1))
    steps = np.where((weights < 0.0).any(axis=(0, 1)), 127.0, 255.0)
    unit = np.where(largest > 0.0, largest, 1.0) / steps
    rounded: FloatArray = np.round(weights / unit) * unit
    return rounded


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class Cause(ReadOnly):
    """One reason why a picture differs from the truth.

    Parameters
    ----------
    name : str
    hint : str
        What to do about it.
    is_in_whole : bool
        Whether the kernel that a user has contains it; if not, it is an alternative.
    difference : array (H, W, C)
        The picture with this cause alone less the true one.
    score : ImageScore
        Score of truth + difference against the truth, within the scene's mask.
    """

    name: str
    hint: str
    is_in_whole: bool
    difference: FloatArray
    score: ImageScore

    def __post_init__(self) -> None:
        self.difference.setflags(write=False)


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class Switches:
    """Profiles and kernels with which causes are switched on.

    Parameters
    ----------
    sources : Sources
    on_grid : Profile
        The exact one on the user's grid; what is beyond is known as a sum.
    cut : Profile
        The same without the light beyond.
    kernel, kernel_of_cut : Kernel
        Fitted to these two.
    whole : Kernel
        Fitted to the walk, or to the model, on the grid.
    model, storage : str or None, str
    """

    sources: Sources
    on_grid: Profile
    cut: Profile
    kernel: Kernel
    kernel_of_cut: Kernel
    whole: Kernel
    model: str | None
    storage: str

    @classmethod
    def make(
        cls,
        material: Material,
        scenes: Sequence[Scene],
        fit: Candidate,
        *,
        model: str | None,
        storage: str,
        radius_mm: float | None = None,
        **walk: Any,
    ) -> "Switches":
        """Simulate the profiles as far as the scenes reach, and fit the kernels.

        ``radius_mm`` and ``walk`` are of `make_sources`.
        """
        grid_mm = radius_of(make_grid(material, radius_mm=radius_mm))
        reach_mm = max(_reach_mm(each, grid_mm) for each in scenes)
        sources = make_sources(material, reach_mm, radius_mm=radius_mm, **walk)
        mm_per_pixel = scenes[0].mm_per_pixel
        on_grid, cut = sources.on_grid(sources.exact), sources.cut(sources.exact)
        simulated = sources.walk if model is None else sources.models[model]
        kernel, kernel_of_cut, whole = (
            fit.fit(each, mm_per_pixel, None).kernel
            for each in (on_grid, cut, sources.on_grid(simulated))
        )
        return cls(sources, on_grid, cut, kernel, kernel_of_cut, whole, model, storage)

    @property
    def whole_stored(self) -> Kernel:
        """What a user has."""
        return stored(self.whole, self.storage)


def causes_of(
    scene: Scene, switches: Switches, threads: int | None
) -> tuple[FloatArray, list[Cause]]:
    """Return the true picture (H, W, C), and every cause."""
    truth = true_picture(scene, switches.sources.exact, threads)
    differences = [
        *_of_profiles(scene, switches, truth, threads),
        *_of_kernels(scene, switches, truth, threads),
        *_of_shaders(scene, switches.kernel, threads),
    ]
    return truth, [_measured(scene, truth, *each) for each in differences]


def everything(
    scene: Scene,
    switches: Switches,
    truth: FloatArray,
    causes: Sequence[Cause],
    threads: int | None,
) -> tuple[Cause, Cause]:
    """Return the whole, and what it has beyond the sum of its causes."""
    whole = render(scene, switches.whole_stored, threads=threads) - truth
    parts = [each.difference for each in causes if each.is_in_whole]
    interaction = whole - np.sum(parts, axis=0)
    return (
        _measured(scene, truth, "everything at once", "the kernel that a user has", True, whole),
        _measured(scene, truth, "interaction", "the whole less its causes", True, interaction),
    )


def true_picture(scene: Scene, profile: Profile, threads: int | None = None) -> FloatArray:
    """Convolve with a profile's 2D kernel and keep all of its energy (H, W, C).

    What comes from further than the picture reaches or from beyond the profile's grid is the mean
    of the picture, as it is of one that is mirrored again and again.
    """
    shape = scene.mm_per_pixel, scene.height, scene.width
    quadrant, left_out = reference_quadrant(profile, *shape)
    far = left_out * scene.irradiance.mean(axis=(0, 1))
    picture: FloatArray = convolve(scene.irradiance, quadrant, threads=threads) + far
    return picture


_Difference = tuple[str, str, bool, FloatArray]


def _of_profiles(
    scene: Scene, switches: Switches, truth: FloatArray, threads: int | None
) -> Iterator[_Difference]:
    """Yield name, hint, whether it is in the whole and difference of what profiles do."""
    sources, model = switches.sources, switches.model
    walked = true_picture(scene, sources.walk, threads) - truth
    hint = "more photons: 4 times as many halve it"
    yield "simulation noise", hint, model is None, walked
    for name, profile in sources.models.items():
        instead = true_picture(scene, profile, threads) - truth
        hint = "the exact solution or the walk in place of a model"
        yield f"{name} instead of exact", hint, name == model, instead


def _of_kernels(
    scene: Scene, switches: Switches, truth: FloatArray, threads: int | None
) -> Iterator[_Difference]:
    """Yield the same of the grid's end, of the fit and of storage."""

    def rendered(kernel: Kernel) -> FloatArray:
        return np.asarray(render(scene, kernel, threads=threads), dtype=np.float64)

    cut = true_picture(scene, switches.cut, threads)
    kernel, kernel_of_cut = rendered(switches.kernel), rendered(switches.kernel_of_cut)
    # Where the fit puts the light beyond the grid: added evenly to its kernel, or nowhere.
    put = kernel - kernel_of_cut
    hint = "a larger radius of the simulated grid"
    yield "energy beyond the grid", hint, True, cut + put - truth
    hint = "a fit that keeps all energy, or a larger radius"
    yield "energy beyond the grid, if lost", hint, False, cut - truth
    if isinstance(switches.kernel_of_cut, Taps):
        full = render_full_resolution(scene, switches.kernel_of_cut)
        yield "stages", "more fetches", True, full - cut
        if switches.kernel_of_cut.stages[-1].level:
            hint = "two stages before the first halving, or none"
            yield "resolution", hint, True, kernel_of_cut - full
    else:
        yield "separability", "a higher rank, or another fit", True, kernel_of_cut - cut
    for storage in dict.fromkeys((switches.storage, "half", "8-bit")):
        kept = rendered(stored(switches.kernel, storage)) - kernel
        name, hint = f"storage, {STORAGES[storage]}", _STORAGE_HINTS[storage]
        yield name, hint, storage == switches.storage, kept


def _of_shaders(scene: Scene, kernel: Kernel, threads: int | None) -> Iterator[_Difference]:
    """Yield the same of few taps, and of the formats that a shader keeps pictures in.

    A table of taps has few already.

    A format without a sign or without as many channels has no row.
    """
    count = TAPS if isinstance(kernel, Taps) else min(TAPS, kernel.pixels)
    if count < LEAST_TAPS:
        return
    taps = kernel if isinstance(kernel, Taps) else on_taps(kernel, count)
    thinned = render_taps(scene, taps, threads=threads)
    if isinstance(kernel, SeparableKernel):
        dense = np.asarray(render_separable(scene, kernel, threads=threads), dtype=np.float64)
        yield f"taps, {count} a pass", "more taps, or a cascade", False, thinned - dense
    for each, hint in _INTERMEDIATES.items():
        try:
            rounded = render_taps(scene, taps, intermediate=each, threads=threads)
        except RenderError:
            continue
        yield f"pictures between passes, {each}", hint, False, rounded - thinned


TAPS = 25  # fetches a pass, as shaders have them
_INTERMEDIATES = {
    "half": "float32 in place of half",
    "r11g11b10": "half in place of R11G11B10",
}
_STORAGE_HINTS = {
    "float64": "nothing",
    "float32": "nothing",
    "half": "float32 in place of half",
    "8-bit": "half float in place of 8 bit",
}


def _measured(
    scene: Scene, truth: FloatArray, name: str, hint: str, is_in_whole: bool, difference: FloatArray
) -> Cause:
    """Measure one difference."""
    score = measure(truth + difference, truth, mask=scene.mask)
    return Cause(name, hint, is_in_whole, difference, score)
