"""A sequence of pictures in a folder, numbered: frame-0000.png, frame-0001.png and so on."""

from pathlib import Path

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import FileError, RenderError
from sssfit.files import check_output, reason
from sssfit.formats.pictures import is_image_file, save_image
from sssfit.measure.score import auto_exposure
from sssfit.messages import counted
from sssfit.motion.frames import Frames


class FrameFiles:
    """Writes one renderer's pictures as they come.

    Parameters
    ----------
    folder : Path
        It is made if its own folder is there.
    name : str
        Of the renderer whose pictures are written.
    frames : Frames
        All PNG files have the exposure of its brightest true frame.
    form : str
        "png" or "exr".
    force : bool
        Whether to replace foreign files.

    Attributes
    ----------
    paths : list of Path

    Raises
    ------
    FileError
        The folder cannot be made, or a file not written or replaced.
    RenderError
        A PNG cannot hold the channels.
    """

    def __init__(
        self, folder: Path, name: str, frames: Frames, *, form: str = "png", force: bool = False
    ) -> None:
        channels = frames.profile.channels
        if form == "png" and len(channels) not in (1, 3):
            raise RenderError(
                f"a PNG holds 1 or 3 channels, and the material has "
                f"{counted(len(channels), 'channel')}; write EXR."
            )
        digits = max(len(str(len(frames.intensity) - 1)), 4)
        self.paths = [folder / f"frame-{k:0{digits}}.{form}" for k in frames]
        self._name, self._channels = name, list(channels) if form == "exr" else None
        self._mm_per_pixel = frames.scene.mm_per_pixel
        try:
            folder.mkdir(exist_ok=True)
        except OSError as error:
            raise FileError(f"{folder}: the folder cannot be made: {reason(error)}.") from None
        for each in self.paths:
            check_output(each, is_image_file, force=force)
        self._exposure = 1.0  # an EXR keeps the light as it is
        brightest = frames.truths()(int(np.argmax(frames.intensity)))
        if form == "png" and brightest.any():
            self._exposure = auto_exposure(brightest)

    def write(self, name: str, frame: int, picture: FloatArray) -> None:
        """Write a frame, if it is of the renderer that was asked for."""
        if name == self._name:
            save_image(
                self.paths[frame],
                picture,
                channels=self._channels,
                exposure=self._exposure,
                mm_per_pixel=self._mm_per_pixel,
            )
