"""Runs a sequence: a scene under a light that changes, by every renderer of ``ways.WAYS``."""

from collections.abc import Callable, Collection
from typing import Any

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import ArgumentError
from sssfit.messages import did_you_mean, shown
from sssfit.motion.adaptive import TARGET_VARIANCE, AdaptiveRenderer
from sssfit.motion.frames import Frames
from sssfit.motion.lights import LIGHTS
from sssfit.motion.record import COLD, MovingLight, Track
from sssfit.motion.reproject import Shift
from sssfit.motion.ways import MOST_FRAMES, WAYS, Picture, of_renderer
from sssfit.profile import Profile
from sssfit.scene.record import Scene

FRAMES = 100
_FIRST = "variates"  # its fetches are those of the others

Watch = Callable[[str, int, FloatArray], object]
Step = Callable[[int, int, str], None]


def moving_light(
    profile: Profile,
    scene: Scene,
    *,
    light: str = "strobe",
    length: int = FRAMES,
    target_variance: float = TARGET_VARIANCE,
    shift: Shift = (0, 0),
    ways: Collection[str] | None = None,
    seed: int = 1,
    threads: int | None = None,
    watch: Watch | None = None,
    progress: Step | None = None,
) -> MovingLight:
    """Render a scene under light that changes, by every renderer.

    Parameters
    ----------
    profile : Profile
    scene : Scene
        Only its irradiance and pixel size are used; borders are mirrored.
    light : str
        A name of ``sssfit.motion.lights.LIGHTS``.
    length : int
        Number of frames, 11 to 100 000; means leave out the first ten.
    target_variance : float
        Of `AdaptiveRenderer`.
    shift : (int, int) [pixels]
        By how much the picture moves down and right in every frame.
    ways : collection of str, optional
        Names of ``WAYS``, by default all; "variates" always runs.
    seed : int
    threads : int, optional
        By default all cores; results do not depend on them.
    watch : callable, optional
        Given every picture: (name, number of the frame, array (H, W, C)).
    progress : callable, optional
        Told (done, of how many, the next one's name).

    Returns
    -------
    MovingLight

    Raises
    ------
    ArgumentError, RenderError, FitError
        A setting is out of range, or the scene and the profile do not fit.
    """
    intensity, asked = _intensity(light, length), _asked(ways)
    frames = Frames(scene, profile, intensity, _checked_shift(shift), threads)
    truths = frames.truths()
    tracks: dict[str, Track] = {}
    for done, name in enumerate(asked):
        if progress is not None:
            progress(done, len(asked), WAYS[name].label)
        way, renderer = WAYS[name], None
        if way.at_equal_fetches is not None:
            picture = way.at_equal_fetches(frames, tracks[_FIRST].mean_fetches, seed)
        else:
            how: dict[str, Any] = {"target_variance": target_variance, **way.settings}
            how |= {"seed": seed, "threads": threads}
            renderer = AdaptiveRenderer(profile, scene.mm_per_pixel, **how)
            picture = of_renderer(renderer, frames)
        tracks[name] = _tracked(name, picture, renderer, frames, truths, watch)
    squares = [np.square(truths(k)).mean() for k in list(frames)[COLD:]]
    return MovingLight(
        material=profile.label,
        scene=scene.name,
        light=light,
        mm_per_pixel=scene.mm_per_pixel,
        height=scene.height,
        width=scene.width,
        shift=frames.shift,
        intensity=intensity,
        target_variance=target_variance,
        seed=seed,
        level=float(np.sqrt(np.mean(squares))),
        tracks=[tracks[name] for name in asked],
    )


def _tracked(
    name: str,
    picture: Picture,
    renderer: AdaptiveRenderer | None,
    frames: Frames,
    truths: Callable[[int], FloatArray],
    watch: Watch | None,
) -> Track:
    """Render all frames by one renderer."""
    fetches, mse = [], []
    for k in frames:
        seen, price = picture(k)
        fetches.append(price)
        mse.append(float(np.square(seen - truths(k)).mean()))
        if watch is not None:
            watch(name, k, seen)
    maps: dict[str, Any] = {}
    if renderer is not None:
        maps = {"variance": renderer.variance, "counts": renderer.counts}
    return Track(name, WAYS[name].label, np.array(fetches), np.array(mse), **maps)


def _intensity(light: str, length: int) -> FloatArray:
    """Return the light of every frame."""
    if light not in LIGHTS:
        near = did_you_mean(str(light), list(LIGHTS))
        raise ArgumentError(f"light {shown(light)}: {near}expected one of {', '.join(LIGHTS)}.")
    is_whole = isinstance(length, int) and not isinstance(length, bool)
    if not (is_whole and COLD < length <= MOST_FRAMES):
        raise ArgumentError(
            f"`length = {shown(length)}`; expected {COLD + 1} to {MOST_FRAMES} frames."
        )
    return np.array([LIGHTS[light].intensity(k) for k in range(length)])


def _asked(ways: Collection[str] | None) -> list[str]:
    """Return the renderers in the order of their registry; refuse unknown ones."""
    for each in ways or ():
        if each not in WAYS:
            near = did_you_mean(str(each), list(WAYS))
            raise ArgumentError(
                f"renderer {shown(each)}: {near}expected some of {', '.join(WAYS)}."
            )
    return [each for each in WAYS if not ways or each in ways or each == _FIRST]


def _checked_shift(shift: Shift) -> Shift:
    is_pair = isinstance(shift, tuple | list) and len(shift) == 2
    if not is_pair or any(isinstance(k, bool) or not isinstance(k, int) for k in shift):
        raise ArgumentError(f"`shift = {shown(shift)}`; expected two whole numbers of pixels.")
    return int(shift[0]), int(shift[1])
