"""What ``sssfit motion`` does: loads a scene, runs a sequence, writes one renderer's frames."""

import functools
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any

from sssfit.compare.runner import profile_of
from sssfit.errors import ArgumentError
from sssfit.fit import MM_PER_PIXEL
from sssfit.material import Material
from sssfit.messages import shown
from sssfit.motion.adaptive import TARGET_VARIANCE
from sssfit.motion.files import FrameFiles
from sssfit.motion.record import MovingLight
from sssfit.motion.run import FRAMES, make_frames, moving_light
from sssfit.profile import Profile
from sssfit.scene.load import load_scenes


def run_sequence(
    source: Material | Profile,
    irradiance: str,
    *,
    mm_per_pixel: float | None = None,
    size: tuple[int, int] | None = None,
    layer: str | None = None,
    light: str = "strobe",
    length: int = FRAMES,
    shift: tuple[int, int] = (0, 0),
    target_variance: float = TARGET_VARIANCE,
    only: Collection[str] | None = None,
    frames: str | None = None,
    form: str = "png",
    of: str = "variates",
    force: bool = False,
    seed: int = 1,
    threads: int | None = None,
    progress: Callable[[int, int, str], None] | None = None,
) -> tuple[MovingLight, list[str]]:
    """Render a sequence, and write its frames where a folder is given.

    Parameters
    ----------
    source : Material or Profile
    irradiance, mm_per_pixel, size, layer
        As `sssfit.scene.load.load_scenes`; pixels of 0.3 mm unless given.
    light, length, shift, target_variance, seed, threads, progress
        As `moving_light`.
    only : collection of str, optional
        Renderers, by default all.
    frames : str, optional
        A folder; without one no pictures are written.
    form, of, force
        As `FrameFiles`; ``of`` is the renderer whose pictures are written.

    Returns
    -------
    MovingLight, list of str
        The record, and the files of the frames.

    Raises
    ------
    SssfitError
        As the functions above.
    """
    if frames in ("", "-"):
        raise ArgumentError(f"`frames` is {shown(frames)}; expected the name of a folder.")
    profile = profile_of(source, threads=threads)
    pictures: dict[str, Any] = {"mm_per_pixel": mm_per_pixel, "size": size, "layer": layer}
    (scene,) = load_scenes([irradiance], otherwise=MM_PER_PIXEL, seed=seed, **pictures)
    how: dict[str, Any] = {"light": light, "length": length, "shift": shift, "threads": threads}
    run = functools.partial(
        moving_light,
        profile,
        scene,
        target_variance=target_variance,
        seed=seed,
        progress=progress,
        **how,
    )
    if frames is None:
        return run(ways=only), []
    sequence = make_frames(profile, scene, **how)
    files = FrameFiles(Path(frames), of, sequence, form=form, force=force)
    with files.held():
        found = run(ways=only and [*only, of], watch=files.write)
    return found, [str(each) for each in files.paths]
