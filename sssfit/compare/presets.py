"""What engines show of a material: every preset's own diffusion beside the exact kernel.

A preset is converted, its engine's model is rendered on pictures, as a profile in the plane or by
the taps of the engine's shader, and measured against the convolution with the true profile.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit.arrays import plain
from sssfit.errors import KernelError, RenderError
from sssfit.export.presets import Parameters, engine_look, preset_of
from sssfit.export.presets.source import source_of
from sssfit.material import Material
from sssfit.measure.score import measure
from sssfit.messages import table
from sssfit.methods import PRESETS
from sssfit.profile import Profile
from sssfit.render.reference import render_reference
from sssfit.render.taps import render_taps
from sssfit.scene.record import Scene
from sssfit.simulate.truth import true_profile

PICTURES = ("edge", "disk", "head")


@dataclass(frozen=True, slots=True)
class PresetErrors:
    """How far an engine's pictures are from the true ones.

    Parameters
    ----------
    parameters : Parameters
    mean, p95, p99 : tuple of float
        Delta E 2000 of each picture: mean and percentiles over its pixels.
    """

    parameters: Parameters
    mean: tuple[float, ...]
    p95: tuple[float, ...]
    p99: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class PresetComparison:
    """All presets of a material on the same pictures.

    Parameters
    ----------
    material : str
    pictures : tuple of str
    mm_per_pixel : float [mm]
    rows : tuple of PresetErrors
        The best first, by the worst picture's p95.
    left_out : mapping of str to str
        Presets that cannot carry the material, and why.
    """

    material: str
    pictures: tuple[str, ...]
    mm_per_pixel: float
    rows: tuple[PresetErrors, ...]
    left_out: dict[str, str]

    def to_dict(self) -> dict[str, Any]:
        """Return the figures of ``sssfit compare --what presets --json``."""
        return plain(
            {
                "material": self.material,
                "pictures": list(self.pictures),
                "mm_per_pixel": self.mm_per_pixel,
                "presets": [
                    {
                        **each.parameters.to_dict(),
                        **{key: list(getattr(each, key)) for key in ("mean", "p95", "p99")},
                    }
                    for each in self.rows
                ],
                "left_out": self.left_out,
            }
        )

    def text(self) -> str:
        """Return a table for a terminal: 95th percentiles, and warnings."""
        head = ["preset", *(f"{each}, mean / p95" for each in self.pictures)]
        rows = [
            [
                each.parameters.preset.name,
                *(f"{a:.2f} / {b:.2f}" for a, b in zip(each.mean, each.p95, strict=True)),
            ]
            for each in self.rows
        ]
        title = f"{self.material}: Delta E 2000 of every engine's own diffusion"
        told: dict[str, list[str]] = {}
        for each in self.rows:
            for words in each.parameters.warnings:
                told.setdefault(words, []).append(each.parameters.preset.name)
        notes = [f"{', '.join(names)}: {words}" for words, names in told.items()]
        notes += [f"{name}: left out, {why}" for name, why in self.left_out.items()]
        return "\n".join([title, table(head, rows), *notes])


def compare_presets(
    source: Material | Profile,
    scenes: Sequence[Scene],
    *,
    threads: int | None = None,
    progress: Callable[[int, int, str], None] | None = None,
) -> PresetComparison:
    """Render what every preset's engine shows, and measure it against the true profile.

    Parameters
    ----------
    source : Material or Profile
        Has three channels.
    scenes : sequence of Scene
        Flat pictures.
    threads : int, optional
    progress : callable, optional
        Told (done, of how many, the next one's name).

    Raises
    ------
    KernelError
        The source has other channels than three, or a channel reflects nothing.
    RenderError
        There is no picture.
    """
    if not scenes:
        raise RenderError("no picture to compare presets on; expected at least one.")
    profile = source if isinstance(source, Profile) else true_profile(source, threads=threads)
    truths = [render_reference(each, profile, threads=threads) for each in scenes]
    rows, left_out = list[PresetErrors](), dict[str, str]()
    one = source_of(profile)  # so that what presets share is computed once
    for k, name in enumerate(PRESETS):
        if progress is not None:
            progress(k, len(PRESETS), name)
        try:
            found = preset_of(name, one)
        except KernelError as refusal:
            left_out[name] = str(refusal)
        else:
            rows.append(_errors(found, scenes, truths, threads))
    title = rows[0].parameters.title
    ordered = tuple(sorted(rows, key=lambda each: max(each.p95)))
    pitch = scenes[0].mm_per_pixel
    return PresetComparison(title, tuple(each.name for each in scenes), pitch, ordered, left_out)


def _errors(
    parameters: Parameters,
    scenes: Sequence[Scene],
    truths: Sequence[npt.NDArray[np.float64]],
    threads: int | None,
) -> PresetErrors:
    look = engine_look(parameters)
    scores = []
    for scene, truth in zip(scenes, truths, strict=True):
        picture: npt.NDArray[np.floating[Any]]
        if isinstance(look, Profile):
            picture = render_reference(scene, look, threads=threads)
        else:
            picture = render_taps(scene, look, threads=threads)
        scores.append(measure(picture, truth, mask=scene.mask))
    return PresetErrors(
        parameters,
        tuple(each.delta_e_2000_mean for each in scores),
        tuple(each.delta_e_2000_p95 for each in scores),
        tuple(each.delta_e_2000_p99 for each in scores),
    )
