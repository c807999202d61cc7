"""A frame of a row of heads: what it took, and how far it is from the one without savings."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from sssfit.arrays import plain
from sssfit.crowd.row import Row
from sssfit.formats.pictures import image_format, save_image
from sssfit.measure.delta_e import exposure_of
from sssfit.messages import counted, table
from sssfit.render.bloom import bloomed
from sssfit.render.texture import Savings

Picture = npt.NDArray[np.floating[Any]]


@dataclass(frozen=True, slots=True, eq=False)
class Work:
    """What a picture took, and how far it is from the picture without savings.

    Parameters
    ----------
    texels_lit, texels_convolved : int
        Texels of maps, or pixels of a picture in screen space; those convolved are of all passes.
    seconds : mapping of str to float
        By stage.
    mean_delta_e, largest_delta_e : float
        Over visible pixels, at the exposure of the picture without savings.
    largest_inside : float
        The largest one farther than the kernel reaches from outlines and from the picture's border.
    inside_pixels : int
        How many lie there.
    """

    texels_lit: int
    texels_convolved: int
    seconds: Mapping[str, float]
    mean_delta_e: float = 0.0
    largest_delta_e: float = 0.0
    largest_inside: float = 0.0
    inside_pixels: int = 0

    @property
    def total_seconds(self) -> float:
        """Of all stages."""
        return sum(self.seconds.values())

    def to_dict(self) -> dict[str, Any]:
        """Return the figures of ``sssfit scene --json``."""
        return {
            "texels_lit": self.texels_lit,
            "texels_convolved": self.texels_convolved,
            "milliseconds": {name: 1e3 * each for name, each in self.seconds.items()},
            "total_milliseconds": 1e3 * self.total_seconds,
            "mean_delta_e": self.mean_delta_e,
            "largest_delta_e": self.largest_delta_e,
            "largest_inside": self.largest_inside if self.inside_pixels else None,
            "inside_pixels": self.inside_pixels,
        }


@dataclass(frozen=True, slots=True, eq=False)
class CrowdFrame:
    """A picture with savings, without them, and in screen space.

    Parameters
    ----------
    row : Row
    savings : Savings
    map_size : int
    map_sizes : tuple of int
        Size of each head's maps, with savings.
    picture : array (H, W, C)
        With savings.
    work : mapping of str to Work
        "saved", "whole" and "screen".
    """

    row: Row
    savings: Savings
    map_size: int
    map_sizes: tuple[int, ...]
    picture: Picture
    work: Mapping[str, Work]

    def save(
        self, target: str | Path | BinaryIO, *, format: str | None = None, bloom: float = 0.0
    ) -> None:
        """Write the picture with savings, a share ``bloom`` of its light spread by glare.

        ``format`` is "exr", "tiff" or "png", by default from the ending. A PNG has the exposure at
        which errors are measured.
        """
        form = format or image_format(target)
        lit = np.asarray(self.picture[self.picture.max(axis=-1) > 0.0], dtype=np.float64)
        save_image(
            target,
            bloomed(self.picture, bloom),
            format=form,
            exposure=exposure_of(lit) if form == "png" and lit.size else 1.0,
            mm_per_pixel=self.row.camera.mm_per_pixel,
        )

    @property
    def speed_up(self) -> tuple[float, float]:
        """How many times fewer texels are convolved, and how much less time is taken.

        The first is NaN where savings leave none, because no head is in view.
        """
        whole, saved = self.work["whole"], self.work["saved"]
        few = saved.texels_convolved
        texels = whole.texels_convolved / few if few else math.nan
        return texels, whole.total_seconds / saved.total_seconds

    def to_dict(self) -> dict[str, Any]:
        """Return the figures of ``sssfit scene --json``."""
        row, savings = self.row, self.savings
        texels, seconds = self.speed_up
        return plain(
            {
                "heads": row.heads,
                "distance_units": row.distance_units,
                "head_units": row.head_units,
                "spacing_units": row.spacing_units,
                "fov_degrees": row.fov_degrees,
                "height": row.resolution[0],
                "width": row.resolution[1],
                "culled": savings.culled,
                "by_depth": savings.by_depth,
                "clipped": savings.clipped,
                "margin": savings.margin,
                "map_size": self.map_size,
                "map_sizes": list(self.map_sizes),
                "speed_up_texels": texels,
                "speed_up_seconds": seconds,
                "work": {name: each.to_dict() for name, each in self.work.items()},
            }
        )

    def text(self) -> str:
        """Return the same for a terminal."""
        row = self.row
        texels, seconds = self.speed_up
        head = (
            f"{counted(row.heads, 'head')} of {row.head_units:g} units, {row.spacing_units:g} "
            f"apart, from {row.distance_units:g} units (100 mm each); {row.fov_degrees:g} degrees, "
            f"{row.resolution[1]} x {row.resolution[0]} pixels, maps of {self.map_size} texels"
        )
        every = self.work.values()
        rows = [
            ["texels lit", *(f"{each.texels_lit:,}" for each in every)],
            ["texels convolved", *(f"{each.texels_convolved:,}" for each in every)],
            *(
                [
                    f"{name} (ms)",
                    *(f"{1000.0 * each.seconds.get(name, 0.0):,.0f}" for each in every),
                ]
                for name in _STAGES
            ),
            ["all stages (ms)", *(f"{1e3 * each.total_seconds:,.0f}" for each in every)],
            ["mean Delta E", *(f"{each.mean_delta_e:.3f}" for each in every)],
            [
                "largest Delta E inside",
                *(f"{each.largest_inside:.3f}" if each.inside_pixels else "-" for each in every),
            ],
        ]
        heads = ["", *(_NAMES[name] for name in self.work)]
        fewer = f"{texels:.2f} times fewer texels convolved"
        worked = "no texel in view is convolved" if math.isnan(texels) else fewer
        ends = f"{worked}, {seconds:.2f} times as fast"
        return f"{head}\n{table(heads, rows)}\n{ends}"


_NAMES = {"whole": "nothing left out", "saved": "with savings", "screen": "screen space"}
_STAGES = ("shadows", "irradiance", "convolution", "picture")
