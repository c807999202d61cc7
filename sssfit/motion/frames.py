"""The frames of a sequence: a scene that moves by whole pixels, under a light that changes."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.motion.reproject import Shift
from sssfit.profile import Profile
from sssfit.render.reference import render_reference
from sssfit.scene.record import Scene


@dataclass(frozen=True, slots=True, eq=False)
class Frames:
    """The frames of a sequence: a scene, moved by whole pixels and lit by a factor.

    Parameters
    ----------
    scene : Scene
        At the intensity 1; what leaves it on one side comes in on the other.
    profile : Profile
        The profile of the truth.
    intensity : array (F,)
    shift : (int, int) [pixels]
        Down and right, of every frame after the first.
    threads : int, optional
    """

    scene: Scene
    profile: Profile
    intensity: FloatArray
    shift: Shift
    threads: int | None

    def __iter__(self) -> Iterator[int]:
        return iter(range(len(self.intensity)))

    def at(self, frame: int) -> Scene:
        """Return the irradiance of a frame."""
        moved = np.roll(self.scene.irradiance, self.moved(frame), axis=(0, 1))
        return Scene(self.scene.name, self.intensity[frame] * moved, self.scene.mm_per_pixel)

    def moved(self, frame: int) -> Shift:
        """Return how far a frame's picture has moved."""
        return frame * self.shift[0], frame * self.shift[1]

    def linear(self, rendered: Callable[[Scene], FloatArray]) -> Callable[[int], FloatArray]:
        """Return what renders a frame by its number, once for all frames that do not move."""
        if self.shift != (0, 0):
            return lambda frame: rendered(self.at(frame))
        still = rendered(self.scene)
        return lambda frame: self.intensity[frame] * still

    def truths(self) -> Callable[[int], FloatArray]:
        """Return the pictures of the true kernel, by the frame's number."""
        return self.linear(
            lambda scene: render_reference(scene, self.profile, threads=self.threads)
        )
