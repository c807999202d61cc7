"""Stability under motion: how a kernel's error changes as light moves by parts of a pixel.

Halved pictures see light by its place among their texels, so that a table of taps may shimmer. A
point and an edge are drawn with exact coverage of pixels at positions between pixels, and compared
with the true 2D kernel on the same picture; a point is also moved by whole pixels and the result
moved back, where any change is the table's.
"""

from dataclasses import dataclass

import numpy as np

from sssfit.arrays import FloatArray, check_record, is_whole, plain
from sssfit.errors import RenderError
from sssfit.kernel import Kernel
from sssfit.measure.score import measure
from sssfit.messages import shown
from sssfit.profile import Profile
from sssfit.render import render
from sssfit.render.reference import render_reference
from sssfit.scene.patterns import centred, edge
from sssfit.scene.record import Scene

PIXELS = 129  # a side of the pictures
NEAR_PIXELS = 16  # what is judged: as far from the point, and from the middle of the edge
EDGE_DEGREES = 30.0
_WHOLE = ((0, 1), (1, 0), (1, 1))
_MOST_POSITIONS = 1000  # along an axis: a million pictures


@dataclass(frozen=True, slots=True)
class Motion:
    """99th percentiles over the pixels of Delta E 2000 as light moves.

    Parameters
    ----------
    point, edge : (float, float)
        Least and largest over the positions, against the true kernel at the same position.
    moved : float
        A point moved by a pixel, the picture moved back, against the unmoved one: the largest of
        moves along x, along y and along both.
    """

    point: tuple[float, float]
    edge: tuple[float, float]
    moved: float

    @property
    def point_change(self) -> float:
        """Largest minus smallest of the point."""
        return self.point[1] - self.point[0]

    @property
    def edge_change(self) -> float:
        """Largest minus smallest of the edge."""
        return self.edge[1] - self.edge[0]

    def to_dict(self) -> dict[str, object]:
        """Return the figures, as lists and numbers."""
        names = ("point", "point_change", "edge", "edge_change", "moved")
        return plain({name: getattr(self, name) for name in names})


def motion(kernel: Kernel, profile: Profile, *, positions: int = 10) -> Motion:
    """Return how a kernel's error changes under motion, on pixels of its own size.

    Parameters
    ----------
    kernel : SeparableKernel or Taps
    profile : Profile
        What the truth is made from.
    positions : int
        Along each axis, in steps of a pixel over this number; 10 x 10 by default.

    Raises
    ------
    RenderError
        There is no position, or the kernel does not fit the profile.
    """
    check_record("kernel", kernel, Kernel, RenderError)
    check_record("profile", profile, Profile, RenderError)
    if not is_whole(positions) or not 1 <= positions <= _MOST_POSITIONS:
        raise RenderError(
            f"positions = {shown(positions)}; expected at least 1, at most {_MOST_POSITIONS}."
        )
    if kernel.channels != profile.channels:
        raise RenderError("the kernel's channels are not the profile's; give its own profile.")
    places = [(i / positions, j / positions) for i, j in np.ndindex(positions, positions)]
    return Motion(
        _extremes(kernel, profile, [_point(kernel, *each) for each in places]),
        _extremes(kernel, profile, [_edge(kernel, *each) for each in places]),
        max(_moved(kernel, *each) for each in _WHOLE),
    )


def _point(kernel: Kernel, down: float, right: float) -> Scene:
    """Return a lit square of the size of a pixel, so far from the middle [pixels]."""
    down_part, right_part = (
        np.maximum(1.0 - np.abs(centred(PIXELS) - k), 0.0) for k in (down, right)
    )
    light = np.outer(down_part, right_part)
    return Scene("a point", light[..., None], kernel.mm_per_pixel)


def _edge(kernel: Kernel, down: float, right: float) -> Scene:
    """Return a lit half plane, moved so far [pixels]."""
    turn = np.radians(EDGE_DEGREES)
    pixels = right * np.cos(turn) - down * np.sin(turn)
    return edge(
        height=PIXELS,
        width=PIXELS,
        mm_per_pixel=kernel.mm_per_pixel,
        angle_degrees=EDGE_DEGREES,
        offset_mm=pixels * kernel.mm_per_pixel,
    )


def _extremes(kernel: Kernel, profile: Profile, scenes: list[Scene]) -> tuple[float, float]:
    """Return least and largest error over pictures."""
    errors = [_p99(_rendered(kernel, each), render_reference(each, profile)) for each in scenes]
    return min(errors), max(errors)


def _rendered(kernel: Kernel, scene: Scene) -> FloatArray:
    return np.asarray(render(scene, kernel), dtype=np.float64)


def _p99(image: FloatArray, truth: FloatArray) -> float:
    """Return the 99th percentile of Delta E near the middle."""
    at = centred(PIXELS)
    near = np.hypot(at[None, :], at[:, None]) <= NEAR_PIXELS
    return measure(image, truth, mask=near).delta_e_2000_p99


def _moved(kernel: Kernel, down: int, right: int) -> float:
    """Return what a move by whole pixels changes of the picture of a point."""
    still, moved = (_rendered(kernel, _point(kernel, *each)) for each in ((0, 0), (down, right)))
    return _p99(np.roll(moved, (-down, -right), (0, 1)), still)
