"""What a sequence of frames shows: samples and errors over time, of every renderer."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sssfit.arrays import FloatArray, plain
from sssfit.messages import counted, number, table

_COLD = 25  # as the supplement's averages


def cold_frames(frames: int) -> int:
    """Return how many frames means leave out while histories begin: 25, at most half of all."""
    return min(_COLD, frames // 2)


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
        """Mean over the frames after the first ones, `cold_frames`."""
        return float(np.mean(self.fetches[cold_frames(len(self.fetches)) :]))

    @property
    def rmse(self) -> float:
        """Root of the mean square error over the frames after the first ones."""
        return float(np.sqrt(np.mean(self.mse[cold_frames(len(self.mse)) :])))

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
        Intensity of the light.
    target_variance : float
    seed : int
    level : float
        Root of the mean square of the true frames after the first ones.
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

    @property
    def cold(self) -> int:
        """Frames at the start that means leave out."""
        return cold_frames(len(self.intensity))

    def track(self, name: str) -> Track:
        """Return a renderer's track; KeyError where it did not run."""
        return {each.name: each for each in self.tracks}[name]

    def saving(self, name: str) -> float | None:
        """Return the share of samples saved against no control variates, at the same target."""
        names = {each.name for each in self.tracks}
        if not {name, "without"} <= names:
            return None
        return 1.0 - self.track(name).mean_fetches / self.track("without").mean_fetches

    def relative(self, track: Track) -> float | None:
        """Return a renderer's error as a share of the light; None where all frames are black."""
        return track.rmse / self.level if self.level > 0.0 else None

    def to_dict(self) -> dict[str, Any]:
        """Return the figures of ``sssfit motion --json``."""
        return plain(
            {
                "material": self.material,
                "irradiance": self.scene,
                "light": self.light,
                "frames": len(self.intensity),
                "cold_frames": self.cold,
                "height": self.height,
                "width": self.width,
                "mm_per_pixel": self.mm_per_pixel,
                "shift_down": self.shift[0],
                "shift_right": self.shift[1],
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
                f"{each.rmse:.3g}",
                number(self.relative(each), ".3g%"),
            ]
            for each in self.tracks
        ]
        heads = ["renderer", "fetches a pixel", "rmse", "of the light"]
        head = (
            f"{self.material}, {self.scene} under {self.light} light: "
            f"{counted(len(self.intensity), 'frame')} of {self.width} x {self.height} pixels, "
            f"target variance {self.target_variance:g}; means leave out the first {self.cold}"
        )
        saved = [
            f"{self.track(name).label}: {100.0 * abs(share):.1f} % "
            f"{'more' if share < 0.0 else 'fewer'} samples than without control variates"
            for name in ("variates", "ahead")
            if (share := self.saving(name)) is not None
        ]
        return "\n".join([head, table(heads, rows), *saved])
