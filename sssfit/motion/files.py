"""A sequence of pictures in a folder, numbered: frame-0000.png, frame-0001.png and so on.

All of them come into the folder at the end, together, or none does. Our own frames that follow the
last one there are of an earlier, longer sequence, and are removed: a player would show them.
"""

import contextlib
import itertools
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import FileError, RenderError
from sssfit.files import check_output, locked, reason, temporary_folder
from sssfit.formats.pictures import is_image_file, save_image
from sssfit.measure.score import auto_exposure
from sssfit.messages import counted, note
from sssfit.motion.frames import Frames


class FrameFiles:
    """Writes one renderer's pictures as they come, while `held`.

    Parameters
    ----------
    folder : Path
        It is made if its own folder is there.
    name : str
        Name of the renderer whose pictures are written.
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
        self._name_of = f"frame-{{:0{digits}}}.{form}".format
        self._other = "exr" if form == "png" else "png"
        self.paths = [folder / self._name_of(k) for k in frames]
        self._name, self._channels = name, list(channels) if form == "exr" else None
        self._frames, self._force = frames, force
        self._exposure = 1.0  # an EXR keeps the light as it is
        self._aside = folder

    @contextlib.contextmanager
    def held(self) -> Iterator[None]:
        """Lock the sequence, and put it into the folder at the end; after an error there is none.

        Raises
        ------
        FileError
            The folder cannot be made, a file not written, replaced or removed, or another run
            writes them.
        """
        with _folder(self.paths[0].parent):
            for each in self.paths:
                check_output(each, is_image_file, force=self._force)
            with locked(self.paths[0]), temporary_folder(self.paths[0]) as self._aside:
                if self._channels is None:
                    self._exposure = _exposure(self._frames)
                yield
                for each in self.paths:
                    (self._aside / each.name).replace(each)
                self._remove_longer()
                self._tell_of_other()

    def _tell_of_other(self) -> None:
        """Say that an earlier sequence in the other format, which may be wanted, is still there."""
        first = self.paths[0].with_suffix(f".{self._other}")
        if is_image_file(first):
            note(
                f"{first} and what follows it stay, of an earlier run; delete them unless they are "
                "of the same sequence."
            )

    def _remove_longer(self) -> None:
        """Remove our frames that follow the last one, up to one that is missing or foreign."""
        removed: list[str] = []
        for k in itertools.count(len(self.paths)):
            path = self.paths[0].with_name(self._name_of(k))
            if not is_image_file(path):
                break
            try:
                path.unlink()
            except OSError as error:
                raise FileError(
                    f"{path} of an earlier, longer sequence cannot be removed: {reason(error)}; "
                    "the new frames are written."
                ) from None
            removed.append(path.name)
        if removed:
            last = f" to {removed[-1]}" if len(removed) > 1 else ""
            note(f"Removed {removed[0]}{last} of an earlier, longer sequence.")

    def write(self, name: str, frame: int, picture: FloatArray) -> None:
        """Write a frame, if it is of the renderer that was asked for."""
        if name != self._name:
            return
        path = self.paths[frame]
        aside = self._aside / path.name
        try:
            save_image(
                aside,
                picture,
                channels=self._channels,
                exposure=self._exposure,
                mm_per_pixel=self._frames.scene.mm_per_pixel,
            )
        except FileError as error:  # of a full disk: the user knows nothing of the folder aside
            raise FileError(str(error).replace(str(aside), str(path))) from None


@contextlib.contextmanager
def _folder(path: Path) -> Iterator[None]:
    """Make a folder, unless it is there; after an error it is gone again."""
    is_new = not path.exists()
    try:
        path.mkdir(exist_ok=True)
    except OSError as error:
        raise FileError(f"{path}: the folder cannot be made: {reason(error)}.") from None
    try:
        yield
    except BaseException:
        if is_new:
            with contextlib.suppress(OSError):  # somebody else has put something there
                path.rmdir()
        raise


def _exposure(frames: Frames) -> float:
    """Return the exposure of the brightest true frame."""
    brightest = frames.truths()(int(np.argmax(frames.intensity)))
    return auto_exposure(brightest) if brightest.any() else 1.0
