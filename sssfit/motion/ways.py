"""The renderers of a sequence: adaptive samplers, fixed sampling, and kernels without noise.

Each is a function of a task, ``sssfit.methods.RENDERERS`` lists them. Those that do not adapt have
as many fetches a pixel as the sampler with control variates took, or the fewest that they can have.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
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


@dataclass(frozen=True, slots=True)
class Task:
    """What a renderer is asked for.

    Parameters
    ----------
    frames : Frames
    target_variance : float
        Target variance of adaptive samplers.
    fetches : float
        Fetches a pixel, for the others.
    seed : int
    """

    frames: Frames
    target_variance: float
    fetches: float
    seed: int


@dataclass(frozen=True, slots=True)
class Way:
    """What renders a task's frames in their order.

    Parameters
    ----------
    picture : callable
        Takes a frame's number; returns the picture (H, W, C), and fetches a pixel.
    maps : callable
        After a frame: moving variance and samples (H, W) of an adaptive sampler.
    """

    picture: Callable[[int], tuple[FloatArray, float]]
    maps: Callable[[], Mapping[str, Any]] = dict


def without(task: Task) -> Way:
    """Sample adaptively, without control variates."""
    return _adaptive(task, has_variates=False)


def variates(task: Task) -> Way:
    """Sample adaptively, with control variates as in the supplement."""
    return _adaptive(task)


def ahead(task: Task) -> Way:
    """Sample adaptively, with control variates and the variance at the coming frame's light."""
    return _adaptive(task, looks_ahead=True)


def _adaptive(task: Task, **settings: Any) -> Way:
    frames = task.frames
    renderer = AdaptiveRenderer(
        frames.profile,
        frames.scene.mm_per_pixel,
        target_variance=task.target_variance,
        seed=task.seed,
        threads=frames.threads,
        **settings,
    )

    def picture(frame: int) -> tuple[FloatArray, float]:
        seen = renderer.render(frames.at(frame), shift=frames.shift if frame else (0, 0))
        return seen, float(renderer.counts.mean())

    return Way(picture, lambda: {"variance": renderer.variance, "counts": renderer.counts})


def fixed(task: Task) -> Way:
    """Take the same samples everywhere, of other random numbers than the adaptive samplers."""
    frames = task.frames
    sampler = make_sampler(frames.profile, frames.scene.mm_per_pixel)
    count = max(round(task.fetches), 1)
    how: dict[str, Any] = {"seed": task.seed, "threads": frames.threads}

    def picture(frame: int) -> tuple[FloatArray, float]:
        # Adaptive samplers draw the frames from 0 up; these begin where no sequence gets to.
        seen = render_samples(frames.at(frame), sampler, count, frame=frame + MOST_FRAMES, **how)
        return seen, float(count)

    return Way(picture)


def separable(task: Task) -> Way:
    """Apply a pre-integrated kernel on an odd number of taps in each of its two passes."""
    frames = task.frames
    pitch = frames.scene.mm_per_pixel
    kernel = fit_separable(frames.profile, "preintegrated", mm_per_pixel=pitch).kernel
    pairs = (math.floor(task.fetches / 2.0) - 1) // 2
    return _of_taps(frames, on_taps(kernel, max(2 * pairs + 1, _FEWEST_TAPS)))


def cascade(task: Task) -> Way:
    """Apply a cascade."""
    frames, most = task.frames, max(task.fetches, _FEWEST_FETCHES)
    given: dict[str, Any] = {"mm_per_pixel": frames.scene.mm_per_pixel, "fetches": most}
    return _of_taps(frames, fit_taps(frames.profile, "cascade", seed=task.seed, **given).kernel)


def _of_taps(frames: Frames, taps: Taps) -> Way:
    pictures = frames.linear(
        lambda scene: np.asarray(render(scene, taps, threads=frames.threads), dtype=np.float64)
    )
    return Way(lambda frame: (pictures(frame), float(taps.fetches)))
