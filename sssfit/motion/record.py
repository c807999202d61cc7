"""What a sequence of frames shows: samples and errors over time, of every renderer."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sssfit.arrays import FloatArray, plain
from sssfit.messages import counted, table

COLD = 10  # frames at the start that means leave out: histories begin


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """One renderer over the frames.

    Parameters
    ----------
    name : str
        "fixed", "without", "variates", "ahead", "separable" or "cascade".
    label : str
        For charts and tables.
    fetches : array (F,)
        Mean over the pixels of a frame: of a sampler its samples.
    mse : array (F,)
        Mean square error of a frame against the true kernel's picture, over pixels and channels, in
        squared units of radiant exitance.
    variance, counts : array (H, W), optional
        Moving variance of one sample, and samples, in the last frame; of adaptive samplers.
    """

    name: str
    label: str
    fetches: FloatArray
    mse: FloatArray
    variance: FloatArray | None = None
    counts: FloatArray | None = None

    @property
    def mean_fetches(self) -> float:
        """Mean over the frames, without the first ten."""
        return float(np.mean(self.fetches[COLD:]))

    @property
    def rmse(self) -> float:
        """Root of the mean square error over the frames, without the first ten."""
        return float(np.sqrt(np.mean(self.mse[COLD:])))

    def to_dict(self) -> dict[str, Any]:
        """Return the figures for JSON."""
        return {
            "name": self.name,
            "label": self.label,
            "mean_fetches": self.mean_fetches,
            "rmse": self.rmse,
            "fetches": self.fetches,
            "frame_rmse": np.sqrt(self.mse),
        }


@dataclass(frozen=True, slots=True, eq=False)
class MovingLight:
    """A scene under light that changes, rendered frame by frame.

    Parameters
    ----------
    material, scene, light : str
    mm_per_pixel : float [mm]
    height, width : int
    shift : (int, int) [pixels]
        Down and right, of every frame.
    intensity : array (F,)
        Of the light.
    target_variance : float
    seed : int
    level : float
        Root of the mean square of the true frames, without the first ten.
    tracks : sequence of Track
    """

    material: str
    scene: str
    light: str
    mm_per_pixel: float
    height: int
    width: int
    shift: tuple[int, int]
    intensity: FloatArray
    target_variance: float
    seed: int
    level: float
    tracks: Sequence[Track]

    def track(self, name: str) -> Track:
        """Return a renderer's track; KeyError where it did not run."""
        return {each.name: each for each in self.tracks}[name]

    def saving(self, name: str) -> float | None:
        """Return the share of samples saved against no control variates, at the same target."""
        names = {each.name for each in self.tracks}
        if not {name, "without"} <= names:
            return None
        return 1.0 - self.track(name).mean_fetches / self.track("without").mean_fetches

    def to_dict(self) -> dict[str, Any]:
        """Return the figures of ``sssfit motion --json``."""
        return plain(
            {
                "material": self.material,
                "irradiance": self.scene,
                "light": self.light,
                "frames": len(self.intensity),
                "height": self.height,
                "width": self.width,
                "mm_per_pixel": self.mm_per_pixel,
                "shift": self.shift,
                "target_variance": self.target_variance,
                "seed": self.seed,
                "level": self.level,
                "saving": {name: self.saving(name) for name in ("variates", "ahead")},
                "intensity": self.intensity,
                "tracks": [each.to_dict() for each in self.tracks],
            }
        )

    def text(self) -> str:
        """Return the means as columns of text."""
        rows = [
            [
                each.label,
                f"{each.mean_fetches:.2f}",
                f"{each.rmse:.4f}",
                f"{100.0 * each.rmse / self.level:.1f} %" if self.level > 0.0 else "-",
            ]
            for each in self.tracks
        ]
        heads = ["renderer", "fetches a pixel", "rmse", "of the light"]
        head = (
            f"{self.material}, {self.scene} under {self.light} light: "
            f"{counted(len(self.intensity), 'frame')} of {self.width} x {self.height} pixels, "
            f"target variance {self.target_variance:g}"
        )
        saved = [
            f"{self.track(name).label}: {100.0 * share:.1f} % fewer samples than without control "
            "variates"
            for name in ("variates", "ahead")
            if (share := self.saving(name)) is not None
        ]
        return "\n".join([head, table(heads, rows), *saved])
