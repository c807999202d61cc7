"""Runs a sequence: a scene under a light that changes, by every renderer of the registry."""

from collections.abc import Callable, Collection

import numpy as np

from sssfit.arrays import FloatArray, check_record, is_whole
from sssfit.errors import ArgumentError
from sssfit.messages import did_you_mean, shown
from sssfit.methods import LIGHTS, RENDERERS
from sssfit.motion.adaptive import TARGET_VARIANCE
from sssfit.motion.frames import Frames
from sssfit.motion.record import MovingLight, Track, cold_frames
from sssfit.motion.reproject import Shift
from sssfit.motion.ways import MOST_FRAMES, Task, Way
from sssfit.profile import Profile
from sssfit.scene.record import Scene

FRAMES = 100
_FEWEST_FRAMES = 2
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
        A name of ``sssfit.methods.LIGHTS``.
    length : int
        Number of frames, 2 to 100 000; means leave out the first ones (`cold_frames`).
    target_variance : float
        Target variance, as in `AdaptiveRenderer`.
    shift : (int, int) [pixels]
        By how much the picture moves down and right in every frame.
    ways : collection of str, optional
        Names of ``sssfit.methods.RENDERERS``, by default all; "variates" always runs.
    seed : int
    threads : int, optional
        By default all cores; results do not depend on them.
    watch : callable, optional
        Given every picture: (name, number of the frame, array (H, W, C)).
    progress : callable, optional
        Told (frames done, of how many, the renderer's name).

    Returns
    -------
    MovingLight

    Raises
    ------
    ArgumentError, RenderError, FitError
        A setting is out of range, or the scene and the profile do not fit.
    """
    asked = _asked(ways)
    frames = make_frames(profile, scene, light=light, length=length, shift=shift, threads=threads)
    truths = frames.truths()
    tracks: dict[str, Track] = {}
    for k, name in enumerate(asked):
        fetches = tracks[_FIRST].mean_fetches if _FIRST in tracks else 0.0
        way = RENDERERS[name].load()(Task(frames, target_variance, fetches, seed))

        def told(frame: int, picture: FloatArray, name: str = name, k: int = k) -> None:
            if watch is not None:
                watch(name, frame, picture)
            if progress is not None:
                progress(k * length + frame + 1, len(asked) * length, RENDERERS[name].summary)

        tracks[name] = _tracked(name, way, frames, truths, told)
    squares = [np.square(truths(k)).mean() for k in list(frames)[cold_frames(length) :]]
    return MovingLight(
        material=profile.label,
        scene=scene.name,
        light=light,
        mm_per_pixel=scene.mm_per_pixel,
        height=scene.height,
        width=scene.width,
        shift=frames.shift,
        intensity=frames.intensity,
        target_variance=target_variance,
        seed=seed,
        level=float(np.sqrt(np.mean(squares))),
        tracks=[tracks[name] for name in asked],
    )


def _tracked(
    name: str,
    way: Way,
    frames: Frames,
    truths: Callable[[int], FloatArray],
    told: Callable[[int, FloatArray], None],
) -> Track:
    """Render all frames by one renderer."""
    fetches, mse = [], []
    for k in frames:
        seen, price = way.picture(k)
        fetches.append(price)
        mse.append(float(np.square(seen - truths(k)).mean()))
        told(k, seen)
    label = RENDERERS[name].summary
    return Track(name, label, np.array(fetches), np.array(mse), **way.maps())


def make_frames(
    profile: Profile,
    scene: Scene,
    *,
    light: str = "strobe",
    length: int = FRAMES,
    shift: Shift = (0, 0),
    threads: int | None = None,
) -> Frames:
    """Return the frames of a sequence; parameters and errors are those of `moving_light`."""
    check_record("profile", profile, Profile, ArgumentError)
    check_record("scene", scene, Scene, ArgumentError)
    if light not in LIGHTS:
        near = did_you_mean(str(light), list(LIGHTS))
        raise ArgumentError(f"light {shown(light)}: {near}expected one of {', '.join(LIGHTS)}.")
    if not (is_whole(length) and _FEWEST_FRAMES <= length <= MOST_FRAMES):
        raise ArgumentError(
            f"length = {shown(length)}; expected {_FEWEST_FRAMES} to {MOST_FRAMES} frames."
        )
    of_frame = LIGHTS[light].load()
    intensity = np.array([of_frame(k) for k in range(length)])
    scene = scene.for_channels(profile.channels)
    return Frames(scene, profile, intensity, _checked_shift(shift), threads)


def _asked(ways: Collection[str] | None) -> list[str]:
    """Return the renderers in the order of their registry; refuse unknown ones."""
    for each in ways or ():
        if each not in RENDERERS:
            near = did_you_mean(str(each), list(RENDERERS))
            raise ArgumentError(
                f"renderer {shown(each)}: {near}expected some of {', '.join(RENDERERS)}."
            )
    return [each for each in RENDERERS if not ways or each in ways or each == _FIRST]


def _checked_shift(shift: Shift) -> Shift:
    is_pair = isinstance(shift, tuple | list) and len(shift) == 2
    if not is_pair or not all(map(is_whole, shift)):
        raise ArgumentError(f"shift = {shown(shift)}; expected two whole numbers of pixels.")
    return int(shift[0]), int(shift[1])
