"""Pictures of linear light, to and from EXR, TIFF and PNG files; HDR, JPG and TGA are read too.

Files are recognised by content. 8- and 16-bit pictures are decoded from sRGB, floating point is
linear; the result has the primaries of sRGB. `Image.notes` lists the conversions.
"""

import contextlib
import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray
from sssfit.errors import FileError, RenderError
from sssfit.files import reason, temporary_folder, write_atomically
from sssfit.formats._layers import LARGEST_BYTES
from sssfit.formats._picture_files import (
    FORMATS,
    MAKER,
    as_path,
    called,
    image_format,
    is_image_file,
    without_lines_of_libpng,
)
from sssfit.formats._picture_reader import SCALE_KEY, one_line, read_image
from sssfit.formats.colours import (
    as_float32,
    as_format_has_it,
    as_light,
    channel_names,
    check_alpha,
    check_values,
    png_codes,
    positive,
    srgb_decode,
    srgb_encode,
)
from sssfit.messages import shown

# The library would write the current time, so a picture written twice would differ.
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

    The library writes to named files only, so the file first goes to a temporary folder.

    Raises
    ------
    FileError
        The temporary folder cannot be written.
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
        spec.attribute("oiio:UnassociatedAlpha", 1)  # the library writes the values unchanged
    if format == "png":
        spec.attribute("oiio:ColorSpace", "srgb_rec709_scene")
    else:
        spec.attribute("DateTime", _DATE)
        # TIFF is not compressed, because not every reader supports the predictor of compressed
        # floats.
        spec.attribute("compression", "zip" if format == "exr" else "none")
    if format == "exr" and mm_per_pixel is not None:
        spec.attribute(SCALE_KEY, repr(float(mm_per_pixel)))
    try:
        with temporary_folder() as folder:
            path = folder / f"picture.{format}"
            target = OpenImageIO.ImageOutput.create(str(path))
            # The library does not accept other layouts in memory.
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


__all__ = [
    "Image",
    "image_format",
    "is_image_file",
    "load_image",
    "save_image",
    "srgb_decode",
    "srgb_encode",
]


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class Image:
    """A picture of linear light. Arrays are stored as read-only float64.

    Parameters
    ----------
    pixels : array (H, W, C)
        Linear light; row 0 is the top.
    channels : tuple of str
        Names of the channels: ("R", "G", "B"), ("Y",) for grey, or others from an EXR.
    mm_per_pixel : float, optional [mm]
        Size of a pixel; None if the file does not say.
    alpha : array (H, W), optional
        Coverage, stored separately from the colour.
    alpha_is_multiplied : bool
        Whether ``pixels`` are multiplied by the coverage, as in an EXR.
    name : str
        The file's name without its folder.
    notes : tuple of str
        Conversions of the file's values, as text for stderr.

    Raises
    ------
    RenderError
        An array does not hold real numbers, or has the wrong shape.
    """

    pixels: FloatArray
    channels: tuple[str, ...]
    mm_per_pixel: float | None = None
    alpha: FloatArray | None = None
    alpha_is_multiplied: bool = False
    name: str = ""
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        self._store("pixels", 3)
        if self.alpha is not None:
            self._store("alpha", 2)
            if self.alpha.shape != self.pixels.shape[:2]:
                raise RenderError(
                    f"alpha of shape {self.alpha.shape} for a picture of {self.pixels.shape[:2]}; "
                    "expected the same rows and columns."
                )

    def _store(self, field: str, dimensions: int) -> None:
        """Store an array read-only, in C order."""
        kept = np.array(as_light(getattr(self, field), field), order="C")
        if kept.ndim != dimensions:
            raise RenderError(
                f"{field} of shape {kept.shape}; expected {dimensions} dimensions: rows, columns"
                f"{' and channels' if dimensions == 3 else ''}."
            )
        kept.setflags(write=False)
        object.__setattr__(self, field, kept)


def load_image(
    path: str | Path, *, layer: str | None = None, largest_bytes: float = LARGEST_BYTES
) -> Image:
    """Read a picture as linear light.

    From an EXR it takes R, G, B of the first part that has them, or of the only layer that has
    them, else Y, else all channels; its data window is placed in the picture, with black around.
    Palettes become RGB, grey stays one channel. Primaries other than those of sRGB are converted
    with white kept: the chromaticities of an EXR, PRIMARIES of a Radiance file, cHRM of a PNG.
    Negative values that result are set to 0. Radiance's EXPOSURE and COLORCORR are divided out.

    Parameters
    ----------
    path : str or Path
        An EXR, Radiance HDR, TIFF, PNG, JPG or TGA file, recognised by its content; only TGA files
        of the first version also need their ending.
    layer : str, optional
        Layer of an EXR: the part of its channels' names before the last dot, or the name of a part.
    largest_bytes : float [bytes]
        Limit of the memory for rendering the picture, 32 bytes for each of its values.

    Returns
    -------
    Image
        The upright picture; 8- and 16-bit values are sRGB-decoded (IEC 61966-2-1) unless the file
        says that they are linear.

    Raises
    ------
    FileError
        The file is missing, unreadable, damaged, truncated, of another format, or uses a
        compression that the library lacks.
    RenderError
        The picture is too large, has no usable channels, has several layers and none is selected,
        or has NaN, infinite or negative values.
    """
    source = as_path(path)
    largest = positive(largest_bytes, "largest_bytes")
    if layer is not None and not isinstance(layer, str):
        raise RenderError(f"layer = {shown(layer)}; expected a name.")
    image = Image(**read_image(source, layer, largest))
    origin = called(source)
    check_values(image.pixels, image.channels, origin, negative=False)
    if image.alpha is not None:
        check_values(image.alpha[..., None], ("alpha",), origin, negative=True)
    return image


def save_image(
    target: str | Path | BinaryIO,
    pixels: npt.ArrayLike,
    *,
    channels: Sequence[str] | None = None,
    format: str | None = None,
    exposure: float = 1.0,
    mm_per_pixel: float | None = None,
    alpha: npt.ArrayLike | None = None,
    alpha_is_multiplied: bool = False,
) -> tuple[str, ...]:
    """Write linear light: unchanged float32 to EXR or TIFF, 16-bit sRGB to PNG.

    A PNG holds ``exposure`` times the light, clipped to 0 to 1 and sRGB-encoded. By the conventions
    of the formats, an EXR holds the light times alpha and a PNG the light without it; a TIFF says
    which. Files are written completely or not at all, and the same picture gives the same bytes.

    Parameters
    ----------
    target : path or binary stream
        Where to write.
    pixels : array (H, W, C)
        Linear light; row 0 is the top.
    channels : sequence of str, optional
        Names for EXR; needed for other counts than 1 (Y) and 3 (R, G, B), which only EXR can hold.
    format : str, optional
        "exr", "tiff" or "png"; by default from the ending.
    exposure : float
        Factor for PNG; the other formats keep the light unchanged.
    mm_per_pixel : float, optional [mm]
        Stored in the header of an EXR, from which `load_image` reads it.
    alpha : array (H, W), optional
        Coverage, for pictures of 1 or 3 channels.
    alpha_is_multiplied : bool
        Whether ``pixels`` are multiplied by the coverage.

    Returns
    -------
    tuple of str
        Conversions of the values, as text for stderr.

    Raises
    ------
    FileError
        The file cannot be written; an older one stays unchanged.
    RenderError
        The values are not finite, or do not fit the format.
    """
    chosen = format or image_format(target)
    if chosen not in FORMATS:
        raise FileError(f"format {shown(chosen)}: pictures are written as {', '.join(FORMATS)}.")
    light = as_light(pixels, "the picture")
    exposure = positive(exposure, "exposure")
    pitch = None if mm_per_pixel is None else positive(mm_per_pixel, "mm_per_pixel")
    names = channel_names(light, channels, chosen)
    check_values(light, names, "the picture", negative=True)
    coverage = None if alpha is None else check_alpha(alpha, light, names)
    light, is_multiplied, done = as_format_has_it(light, coverage, alpha_is_multiplied, chosen)
    values: npt.NDArray[np.uint16] | npt.NDArray[np.float32]
    clipped: tuple[str, ...] = ()
    if chosen == "png":
        values, clipped = png_codes(light, exposure, coverage)
    else:
        values = as_float32(light, exposure, coverage)
    data = image_bytes(
        values,
        format=chosen,
        channels=names if coverage is None else (*names, "A"),
        mm_per_pixel=pitch,
        has_alpha=coverage is not None,
        is_multiplied=is_multiplied,
    )
    if isinstance(target, str | Path):
        _write(as_path(target), data)
    else:
        target.write(data)
    return (*done, *clipped)


def _write(path: Path, data: bytes) -> None:
    """Write the whole file or nothing."""
    try:
        write_atomically(path, lambda stream: stream.write(data))
    except OSError as error:  # a name that is invalid in every file system
        raise FileError(f"{called(path)} cannot be written: {reason(error)}.") from None
