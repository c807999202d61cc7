"""Pictures to bytes, through OpenImageIO; the same picture gives the same bytes."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit._image_files import MAKER
from sssfit._image_read import SCALE_KEY
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
) -> bytes:
    """Return the whole file of (H, W, C) float32, or uint16 for PNG.

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
    spec.alpha_channel = -1
    spec.attribute("Software", MAKER)
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
            if not (target.open(str(path), spec) and target.write_image(packed) and target.close()):
                raise FileError(f"the picture cannot be written: {target.geterror().strip()}.")
            return path.read_bytes()
    except OSError as error:
        raise FileError(f"the picture cannot be written: {reason(error)}.") from error
