"""Table 1 of "Faster rendering of human skin": how much work three savings leave out.

Jimenez and Gutierrez 2008: heads in a row from 1 to 16, distances from 2.5 to 100 units, the time
without savings over the time with all three. Ours has texels convolved beside the time.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sssfit.arrays import FloatArray, plain
from sssfit.crowd.frame import measure_frame
from sssfit.crowd.record import CrowdFrame
from sssfit.crowd.row import Row
from sssfit.kernel import Kernel
from sssfit.messages import table
from sssfit.render.texture import Savings

HEADS = (1, 2, 4, 8, 16)
DISTANCES = (2.5, 5.0, 10.0, 20.0, 50.0, 100.0)
PUBLISHED = np.array(
    [
        (1.17, 1.10, 1.39, 1.48, 1.53, 1.61),
        (1.40, 1.10, 1.46, 1.63, 1.88, 1.88),
        (1.66, 1.39, 1.58, 1.89, 2.10, 2.26),
        (1.86, 1.67, 1.95, 2.01, 2.34, 2.59),
        (2.01, 1.90, 2.28, 2.41, 2.50, 2.77),
    ]
)
ALL = Savings(culled="vertex", by_depth=True, clipped=True)
# Both a quarter of the paper's, so that a pixel of the picture has as many texels.
MAP_SIZE, RESOLUTION = 512, (300, 480)


@dataclass(frozen=True, slots=True, eq=False)
class SpeedUpTable:
    """The measured table.

    Parameters
    ----------
    frames : tuple of tuple of CrowdFrame
        By heads, then by distance.
    """

    frames: tuple[tuple[CrowdFrame, ...], ...]

    @property
    def heads(self) -> tuple[int, ...]:
        """Number of heads of each row of the table."""
        return tuple(row[0].row.heads for row in self.frames)

    @property
    def distances(self) -> tuple[float, ...]:
        """Distance of each column [100 mm]."""
        return tuple(each.row.distance_units for each in self.frames[0])

    @property
    def published(self) -> FloatArray:
        """The paper's speed-ups of these cells; NaN where it has none."""
        known = {
            (heads, distance): PUBLISHED[i, k]
            for i, heads in enumerate(HEADS)
            for k, distance in enumerate(DISTANCES)
        }
        return np.array([[known.get((i, k), np.nan) for k in self.distances] for i in self.heads])

    @property
    def texels(self) -> FloatArray:
        """Texels convolved without savings over those with all three."""
        return np.array([[each.speed_up[0] for each in row] for row in self.frames])

    @property
    def seconds(self) -> FloatArray:
        """The same of the time."""
        return np.array([[each.speed_up[1] for each in row] for row in self.frames])

    @property
    def over_screen(self) -> FloatArray:
        """Texels convolved with all three over pixels that screen space convolves."""
        return np.array(
            [
                [
                    each.work["saved"].texels_convolved
                    / max(each.work["screen"].texels_convolved, 1)
                    for each in row
                ]
                for row in self.frames
            ]
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the figures of ``sssfit scene --table --json``."""
        return plain(
            {
                "heads": self.heads,
                "distances": self.distances,
                "published": [[_known(each) for each in row] for row in self.published],
                "texels": self.texels,
                "seconds": self.seconds,
                "over_screen": self.over_screen,
                "frames": [[each.to_dict() for each in row] for row in self.frames],
            }
        )

    def text(self) -> str:
        """Return the table for a terminal: texels, seconds and published."""
        rows = []
        columns = self.texels, self.seconds, self.published
        for heads, *values in zip(self.heads, *columns, strict=True):
            for name, line in zip(("texels", "time", "published"), values, strict=True):
                label = f"{heads}, {name}"
                rows.append([label, *("-" if np.isnan(each) else f"{each:.2f}" for each in line)])
        return table(["heads", *(f"{each:g}" for each in self.distances)], rows)


def _known(value: float) -> float | None:
    return None if np.isnan(value) else float(value)


def measure_table(
    kernel: Kernel,
    *,
    savings: Savings = ALL,
    map_size: int = MAP_SIZE,
    resolution: tuple[int, int] = RESOLUTION,
    threads: int | None = None,
    progress: Callable[[int, int, str], None] | None = None,
    heads: Sequence[int] = HEADS,
    distances: Sequence[float] = DISTANCES,
    **geometry: Any,
) -> SpeedUpTable:
    """Render every cell of the table with and without savings.

    Parameters
    ----------
    kernel : SeparableKernel or Taps
    savings : Savings
    map_size : int
        Side of a whole map; the paper's is 2048.
    resolution : (int, int)
        Rows and columns; the paper's are 1200 and 1920.
    threads : int, optional
    progress : callable, optional
        Told (done, of how many, the next one's name).
    heads, distances : sequence
        The paper's by default.
    **geometry
        Those of `Row`: ``head_units``, ``spacing_units``, ``fov_degrees``.
    """
    rows = []
    for i, count in enumerate(heads):
        line = []
        for k, distance in enumerate(distances):
            if progress is not None:
                done = i * len(distances) + k
                progress(done, len(heads) * len(distances), f"{count} at {distance:g} units")
            row = Row(count, distance, resolution=resolution, **geometry)
            line.append(
                measure_frame(row, kernel, savings=savings, map_size=map_size, threads=threads)
            )
        rows.append(tuple(line))
    return SpeedUpTable(tuple(rows))
