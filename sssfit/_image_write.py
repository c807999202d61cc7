"""Pictures to bytes, through OpenImageIO; the same picture gives the same bytes."""

import contextlib
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit._image_files import MAKER, without_lines_of_libpng
from sssfit._image_read import SCALE_KEY, one_line
from sssfit.errors import FileError
from sssfit.files import reason, temporary_folder

# The library would put in the time of writing, and a picture made twice would differ.
_DATE = "1980:01:01 00:00:00"


def image_bytes(
    pixels: npt.NDArray[Any],
    *,
    format: str,
    channels: Sequence[str],
    mm_per_pixel: float | None,
    has_alpha: bool,
    is_multiplied: bool,
) -> bytes:
    """Return the whole file of (H, W, C) float32, or uint16 for PNG; alpha is the last channel.

    The library writes to names only, so a folder of our own takes the file first.

    Raises
    ------
    FileError
        That folder cannot be written to.
    """
    import OpenImageIO  # 0.2 s

    height, width, count = pixels.shape
    spec = OpenImageIO.ImageSpec(
        width, height, count, pixels.dtype.name.replace("float32", "float")
    )
    spec.channelnames = tuple(channels)
    spec.attribute("Software", MAKER)
    spec.alpha_channel = count - 1 if has_alpha else -1
    if has_alpha and not is_multiplied:
        spec.attribute("oiio:UnassociatedAlpha", 1)  # what it gets is what it writes
    if format == "png":
        spec.attribute("oiio:ColorSpace", "srgb_rec709_scene")
    else:
        spec.attribute("DateTime", _DATE)
        # TIFF is left plain: not every reader knows the predictor that compressed floats have.
        spec.attribute("compression", "zip" if format == "exr" else "none")
    if format == "exr" and mm_per_pixel is not None:
        spec.attribute(SCALE_KEY, repr(float(mm_per_pixel)))
    try:
        with temporary_folder() as folder:
            path = folder / f"picture.{format}"
            target = OpenImageIO.ImageOutput.create(str(path))
            # Other layouts in memory are refused.
            packed = np.ascontiguousarray(pixels)
            assert target is not None  # these formats are part of the library
            with without_lines_of_libpng() if format == "png" else contextlib.nullcontext():
                is_written = (
                    target.open(str(path), spec) and target.write_image(packed) and target.close()
                )
            if not is_written:
                said = one_line(target.geterror())
                raise FileError(f"the picture cannot be written: {said}.")
            return path.read_bytes()
    except OSError as error:
        raise FileError(f"the picture cannot be written: {reason(error)}.") from error
