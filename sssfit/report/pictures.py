"""The pictures of a page: what is lit, the truth by the profile's whole 2D kernel, what counts."""

import dataclasses
import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.compare.references import Reference, references
from sssfit.fit import MM_PER_PIXEL
from sssfit.messages import note
from sssfit.profile import Profile
from sssfit.report.pack import packed_bytes, packed_picture
from sssfit.scene.load import load_scene
from sssfit.scene.made import EDGE_DEGREES, make_scene
from sssfit.scene.record import Scene

SIDE = 256  # pixels of a picture at most: nine heads of three channels then take 2 MB
LIGHTS = (45.0, 0.0, 80.0)  # degrees of the key light to the left of the view axis
# A frame in which distances are those of pixels; pixels of 0.3 mm are 0.6 m away.
ROWS, FOV_DEGREES = 1080, 30.0
_HALF = 0.5  # of a block must be on the object for the reduced pixel to be
FARTHER = (1, 2, 3)  # heads by how many times the pixels of the kernels theirs are


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """A picture of the page.

    Parameters
    ----------
    key : str
        Short and unique, for addresses: "head-45-600".
    name : str
        "head", "disk", "edge", or the name of a file.
    light_degrees, distance_mm : float, optional
        Where a head's light and its camera are.
    reference : Reference
        The lit scene with its mask, the border, the truth and its exposure.
    """

    key: str
    name: str
    light_degrees: float | None
    distance_mm: float | None
    reference: Reference

    @property
    def scene(self) -> Scene:
        """What is lit."""
        return self.reference.scene

    def to_dict(self) -> dict[str, Any]:
        """Return what the page reads."""
        scene = self.scene
        counts = np.ones(scene.irradiance.shape[:2]) if scene.mask is None else scene.mask > 0
        return {
            "key": self.key,
            "name": self.name,
            "light": self.light_degrees,
            "distance": self.distance_mm,
            "mm_per_pixel": scene.mm_per_pixel,
            "border": self.reference.border,
            "exposure": self.reference.exposure,
            "irradiance": packed_picture(scene.irradiance),
            "truth": packed_picture(self.reference.truth),
            "mask": packed_bytes(np.asarray(counts, dtype=np.uint8).tobytes()),
        }


def distance_of(mm_per_pixel: float) -> float:
    """Return the distance [mm] at which a frame of `ROWS` and `FOV_DEGREES` has such pixels."""
    return 0.5 * ROWS * mm_per_pixel / math.tan(math.radians(FOV_DEGREES) / 2.0)


def own_scene(irradiance: str, mm_per_pixel: float | None, side: int = SIDE) -> Scene:
    """Return a user's picture, reduced to ``side`` pixels, which is noted.

    Raises
    ------
    RenderError, FileError
        As `load_scene`.
    """
    return _reduced(load_scene(irradiance, mm_per_pixel, otherwise=MM_PER_PIXEL), side)


def shown_pictures(
    profile: Profile,
    mm_per_pixel: float,
    *,
    own: Scene | None = None,
    side: int = SIDE,
    threads: int | None = None,
    progress: Callable[[str], None] = lambda name: None,  # noqa: ARG005
) -> tuple[Shown, ...]:
    """Render the pictures of a page: heads, a disk, an edge, and a user's own.

    Parameters
    ----------
    profile : Profile
        What the truths are made from.
    mm_per_pixel : float [mm]
        Pixel size of disk, edge and the nearest head.
    own : Scene, optional
        A user's picture, which comes first.
    side : int
        Rows and columns.
    threads : int, optional
    progress : callable, optional
        Called with the name of each picture before it is made.

    Raises
    ------
    RenderError
        As `render_reference`.
    """
    found = []
    for key, name, light, distance, scene in _scenes(mm_per_pixel, own, side, threads):
        progress(key)
        (reference,) = references([scene], profile, threads=threads)
        found.append(Shown(key, name, light, distance, reference))
    return tuple(found)


def _scenes(
    mm_per_pixel: float, own: Scene | None, side: int, threads: int | None
) -> Iterator[tuple[str, str, float | None, float | None, Scene]]:
    """Yield key, name, light, distance and scene of each picture."""
    size = {"height": side, "width": side}
    if own is not None:
        yield "own", own.name, None, None, own
    for farther in FARTHER:
        pitch = farther * mm_per_pixel
        distance = distance_of(pitch)
        for light in LIGHTS:
            lit: dict[str, Any] = {"light_degrees": light, "distance_mm": distance}
            head = make_scene("head", **size, mm_per_pixel=pitch, **lit, threads=threads)
            yield f"head-{light:g}-{farther}", "head", light, distance, head
    for made in flat_scenes(mm_per_pixel, side):
        yield made.name, made.name, None, None, made


def flat_scenes(mm_per_pixel: float, side: int) -> list[Scene]:
    """Return the disk and the edge, without what counts of them."""
    flat: dict[str, dict[str, Any]] = {"disk": {}, "edge": {"angle_degrees": EDGE_DEGREES}}
    size: dict[str, Any] = {"height": side, "width": side, "mm_per_pixel": mm_per_pixel}
    return [make_scene(name, **size, **turned) for name, turned in flat.items()]


def _reduced(scene: Scene, side: int) -> Scene:
    """Return a picture whose sides are at most ``side``, by means of square blocks of pixels."""
    factor = math.ceil(max(scene.height, scene.width) / side)
    if factor == 1:
        return scene
    note(
        f"{scene.name}: {scene.width} x {scene.height} pixels are scaled down by {factor} to "
        f"fit the page's {side} x {side}; its kernels are for pixels of "
        f"{scene.mm_per_pixel * factor:.4g} mm."
    )
    mask = None
    if scene.mask is not None:
        part = _means((scene.mask[..., None] > 0).astype(np.float64), factor)[..., 0]
        mask = (part >= _HALF).astype(np.int32)
    light = _means(scene.irradiance, factor)
    return Scene(
        scene.name,
        light,
        scene.mm_per_pixel * factor,
        mask=mask,
        channel_names=scene.channel_names,
    )


def _means(picture: FloatArray, factor: int) -> FloatArray:
    """Return the means of blocks of a picture (H, W, C); blocks at its ends may be smaller."""
    rows, columns = (np.arange(0, n, factor) for n in picture.shape[:2])
    sums = np.add.reduceat(np.add.reduceat(picture, rows, axis=0), columns, axis=1)
    heights = np.diff(np.append(rows, picture.shape[0]))
    widths = np.diff(np.append(columns, picture.shape[1]))
    means: FloatArray = sums / (heights[:, None] * widths)[..., None]
    return means
