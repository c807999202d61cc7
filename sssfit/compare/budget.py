"""The error budget: why a kernel's picture differs from the true one, each cause apart.

The truth is irradiance convolved with the exact profile's whole 2D kernel; light from further than
the picture reaches is the picture's mean. One cause at a time is switched on against it, and what
it does to the picture is its difference. Differences are pictures and add up: their sum, and the
`interaction` that is stated, make the difference of the kernel that a user has. Norms and Delta E
of differences do not add up, since differences cancel in places.

``_budget_causes`` has the profiles, and what each cause does.
"""

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from sssfit.arrays import FloatArray, ReadOnly, plain
from sssfit.compare._budget_causes import (
    STORAGES,
    Cause,
    Switches,
    causes_of,
    everything,
)
from sssfit.compare.candidates import Candidate
from sssfit.compare.covered import MODELS, models_of
from sssfit.compare.references import check_one_pitch, evaluated_scene
from sssfit.errors import FitError, RenderError, SimulationError
from sssfit.kernel import Kernel, SeparableKernel, Taps
from sssfit.material import Material
from sssfit.measure.delta_e import selected_pixels, selection
from sssfit.measure.score import COLOUR_FIGURES, ImageScore
from sssfit.messages import shown
from sssfit.scene.record import Scene
from sssfit.simulate import Progress

__all__ = ["MODELS", "STORAGES", "Budget", "Cause", "error_budget", "error_budgets"]


PHOTONS = 1_000_000
_ROW_FIGURES = (*COLOUR_FIGURES, "relative_l2", "energy_drift")


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class Budget(ReadOnly):
    """What a kernel loses on one picture, by cause.

    Parameters
    ----------
    material : Material
    scene : Scene
    photons, seed : int
        Those of the walk.
    radius_mm : float [mm]
        Radius of the grid that the kernel's profile is on.
    beyond_grid : array (C,) [1]
        Energy beyond that grid, by the exact solution.
    model, storage : str or None, str
        As they were asked for.
    kernel : SeparableKernel or Taps
        What a user has, with every cause on.
    truth : array (H, W, C)
        The true picture.
    causes : tuple of Cause
        First those that are in the whole, then alternatives to them; largest first by mean Delta E,
        or by relative L2 where there is no colour.
    whole : Cause
        All at once: the picture of ``kernel`` against the truth.
    interaction : Cause
        The whole less the sum of its causes.
    """

    material: Material
    scene: Scene
    photons: int
    seed: int
    radius_mm: float
    beyond_grid: FloatArray
    model: str | None
    storage: str
    kernel: Kernel
    truth: FloatArray
    causes: tuple[Cause, ...]
    whole: Cause
    interaction: Cause

    def __post_init__(self) -> None:
        for name in ("beyond_grid", "truth"):
            values = np.array(getattr(self, name), dtype=np.float64)
            values.setflags(write=False)
            object.__setattr__(self, name, values)

    def share(self, cause: Cause) -> float:
        """Return which part of the whole's squared error a cause makes up; NaN where there is none.

        <d, D> / <D, D> of its difference d and the whole's, D, over channels and the pixels that
        count. Shares of the causes in the whole and of the interaction add up to 1; a share is
        negative where the cause makes up for others.
        """
        selected = selection(self.scene.mask, self.truth)
        part, whole = (
            selected_pixels(each, selected).ravel()
            for each in (cause.difference, self.whole.difference)
        )
        square = float(whole @ whole)
        return float(part @ whole) / square if square > 0.0 else math.nan

    def to_dict(self) -> dict[str, Any]:
        """Return the figures that ``sssfit compare --json`` prints, a row for each cause.

        Then a row for the interaction and one for the whole.
        """
        return plain(
            {
                "material": self.material.name,
                "channels": self.material.channels,
                "method": self.kernel.method,
                "rank": self.kernel.rank if isinstance(self.kernel, SeparableKernel) else None,
                "structure": self.kernel.structure if isinstance(self.kernel, Taps) else None,
                "model": self.model,
                "storage": self.storage,
                "photons": self.photons,
                "seed": self.seed,
                "mm_per_pixel": self.scene.mm_per_pixel,
                "radius_mm": self.radius_mm,
                "beyond_grid": self.beyond_grid,
                "rows": [self._row(each) for each in (*self.causes, self.interaction, self.whole)],
            }
        )

    def _row(self, cause: Cause) -> dict[str, Any]:
        """Figures of a cause, and of the picture it is on."""
        return {
            "picture": self.scene.name,
            "width": self.scene.width,
            "height": self.scene.height,
            "cause": cause.name,
            "in_whole": cause.is_in_whole,
            **{key: getattr(cause.score, key, None) for key in _ROW_FIGURES},
            "share_of_whole": self.share(cause),
            "hint": cause.hint,
        }


def error_budget(material: Material, scene: Scene, **settings: Any) -> Budget:
    """Return the budget on one picture; parameters and errors are those of `error_budgets`.

    Examples
    --------
    >>> from sssfit.material import load_material
    >>> from sssfit.scene.made import make_scene
    >>> scene = make_scene("disk", height=64, width=64, mm_per_pixel=0.5)
    >>> budget = error_budget(load_material("skin1"), scene, photons=100_000)
    >>> [each.name for each in budget.causes if each.is_in_whole][:2]
    ['separability', 'simulation noise']
    """
    return error_budgets(material, [scene], **settings)[0]


def error_budgets(
    material: Material,
    scenes: Sequence[Scene],
    *,
    photons: int = PHOTONS,
    seed: int = 1,
    radius_mm: float | None = None,
    method: str = "svd",
    settings: Mapping[str, Any] | None = None,
    model: str | None = None,
    storage: str = "half",
    threads: int | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> list[Budget]:
    """Take the difference of a fitted kernel's picture from the true one apart.

    Parameters
    ----------
    material : Material
        Any that the exact solver takes. The models are those of `models_of`; what is left out of
        them is noted.
    scenes : sequence of Scene
        Flat, all of the same pixel size; their profiles and kernels are shared. What counts of
        them says `evaluated_scene`.
    photons, seed, progress
        Those of the photon walk; see ``simulate_montecarlo``.
    radius_mm : float, optional [mm]
        Radius of the grid of the kernel's profile; by default the paper's.
    method, settings
        The fit, one of ``sssfit.fit.METHODS`` or "cascade", and its keywords; by default svd of
        rank 3.
    model : str, optional
        One of `models_of` the material: the kernel is fitted to it in place of the walk, and there
        is no noise.
    storage : str
        One of `STORAGES`: how the kernel's weights are kept.
    threads : int, optional
        By default all cores; nothing depends on them.

    Returns
    -------
    list of Budget
        In the order of ``scenes``.

    Raises
    ------
    SimulationError
        A material that the exact solver refuses, no such model, or settings of the walk.
    RenderError
        No scene, pixels of several sizes, a picture of one colour, or what it takes to render.
    FitError, KernelError
        No such fit or storage, or a disk, which shows another picture in each frame.
    """
    _check(material, scenes, model)
    if method == "disk":
        raise FitError("a disk shows another picture in each frame; take a budget of other fits.")
    default = {"rank": 3} if method == "svd" else {}
    fit = Candidate(method, method, 0, default if settings is None else settings)
    walk: dict[str, Any] = {"photons": photons, "seed": seed, "radius_mm": radius_mm}
    walk |= {"threads": threads, "progress": progress}
    switches = Switches.make(material, scenes, fit, model=model, storage=storage, **walk)
    about = {
        "photons": photons,
        "seed": seed,
        "radius_mm": float(switches.on_grid.r_edges_mm[-1]),
        "beyond_grid": switches.on_grid.beyond_grid,
        "model": model,
        "storage": storage,
        "kernel": switches.whole_stored,
    }
    evaluated = [evaluated_scene(each, switches.on_grid) for each in scenes]
    return [_budget(material, scene, switches, threads, about) for scene in evaluated]


def _budget(
    material: Material,
    scene: Scene,
    switches: Switches,
    threads: int | None,
    about: Mapping[str, Any],
) -> Budget:
    """Render and measure one scene's causes."""
    truth, causes = causes_of(scene, switches, threads)
    whole, interaction = everything(scene, switches, truth, causes, threads)
    return Budget(
        material=material,
        scene=scene,
        truth=truth,
        causes=tuple(sorted(causes, key=_order)),
        whole=whole,
        interaction=interaction,
        **about,
    )


def _order(cause: Cause) -> tuple[bool, float]:
    """Those in the whole first, the largest first."""
    return not cause.is_in_whole, -size_of(cause.score)


def size_of(score: ImageScore) -> float:
    """Return what causes are ordered by: mean Delta E, or relative L2 without colours."""
    seen = score.delta_e_2000_mean
    return score.relative_l2 if math.isnan(seen) else seen


def _check(material: Material, scenes: Sequence[Scene], model: str | None) -> None:
    """Refuse what has no budget, before anything is simulated."""
    own = models_of(material)
    if model is not None and model not in own:
        raise SimulationError(
            f"model = {shown(model)}; of {material.name} there is {', '.join(own)}, or none."
        )
    if not scenes:
        raise RenderError("no picture: an error budget is of at least one.")
    check_one_pitch(scenes)
    for scene in scenes:
        if np.ptp(scene.irradiance, axis=(0, 1)).max() == 0.0:
            raise RenderError(
                f"{scene.name} is of one colour, which no kernel blurs; give a picture with an "
                "edge in it."
            )
