"""The renderers of a sequence: adaptive samplers, fixed sampling, and kernels without noise.

Those after the samplers have as many fetches a pixel as the sampler with control variates took, or
the fewest that they can have.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.fit import fit_separable, fit_taps
from sssfit.fit.on_taps import on_taps
from sssfit.kernel import Taps
from sssfit.motion.adaptive import AdaptiveRenderer
from sssfit.motion.frames import Frames
from sssfit.render import render
from sssfit.render.adaptive import make_sampler, render_samples

MOST_FRAMES = 100_000
_FEWEST_TAPS, _FEWEST_FETCHES = 3, 7  # of a separable kernel's pass, of a cascade

Picture = Callable[[int], tuple[FloatArray, float]]  # of a frame's number: picture, fetches a pixel


@dataclass(frozen=True, slots=True)
class Way:
    """A renderer.

    Parameters
    ----------
    label : str
        For charts and tables.
    settings : mapping
        Keywords of `AdaptiveRenderer`, for a sampler that adapts.
    at_equal_fetches : callable, optional
        For another: of frames, fetches a pixel and seed; returns what renders a frame.
    """

    label: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    at_equal_fetches: Callable[[Frames, float, int], Picture] | None = None


def of_renderer(renderer: AdaptiveRenderer, frames: Frames) -> Picture:
    """Return what renders the frames of a sequence in their order."""

    def picture(frame: int) -> tuple[FloatArray, float]:
        shift = frames.shift if frame else (0, 0)
        seen = renderer.render(frames.at(frame), shift=shift)
        return seen, float(renderer.counts.mean())

    return picture


def _fixed(frames: Frames, fetches: float, seed: int) -> Picture:
    """Return a sampler with the same samples everywhere, of other random numbers."""
    sampler = make_sampler(frames.profile, frames.scene.mm_per_pixel)
    count = max(round(fetches), 1)

    def picture(frame: int) -> tuple[FloatArray, float]:
        # Adaptive samplers draw the frames from 0 up; these begin where no sequence gets to.
        apart = frame + MOST_FRAMES
        how: dict[str, Any] = {"frame": apart, "seed": seed, "threads": frames.threads}
        return render_samples(frames.at(frame), sampler, count, **how), float(count)

    return picture


def _separable(frames: Frames, fetches: float, _seed: int) -> Picture:
    """Return a pre-integrated kernel on an odd number of taps in each of its two passes."""
    pitch = frames.scene.mm_per_pixel
    kernel = fit_separable(frames.profile, "preintegrated", mm_per_pixel=pitch).kernel
    pairs = (math.floor(fetches / 2.0) - 1) // 2
    return _of_taps(frames, on_taps(kernel, max(2 * pairs + 1, _FEWEST_TAPS)))


def _cascade(frames: Frames, fetches: float, seed: int) -> Picture:
    pitch, most = frames.scene.mm_per_pixel, max(fetches, _FEWEST_FETCHES)
    given: dict[str, Any] = {"mm_per_pixel": pitch, "fetches": most, "seed": seed}
    return _of_taps(frames, fit_taps(frames.profile, "cascade", **given).kernel)


def _of_taps(frames: Frames, taps: Taps) -> Picture:
    pictures = frames.linear(
        lambda scene: np.asarray(render(scene, taps, threads=frames.threads), dtype=np.float64)
    )
    return lambda frame: (pictures(frame), float(taps.fetches))


WAYS: Mapping[str, Way] = {
    "without": Way("adaptive, no control variates", {"has_variates": False}),
    "variates": Way("adaptive, control variates"),
    "ahead": Way("adaptive, next frame's light", {"looks_ahead": True}),
    "fixed": Way("fixed sampling", at_equal_fetches=_fixed),
    "separable": Way("separable", at_equal_fetches=_separable),
    "cascade": Way("cascade", at_equal_fetches=_cascade),
}
