"""Pictures of linear light, to and from EXR, TIFF and PNG files; HDR, JPG and TGA are read too.

What is read is known by its content. 8- and 16-bit pictures are decoded from sRGB, floating point
is linear; light comes back in the primaries of sRGB. What was done to a file's numbers stands in
`Image.notes`.
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
        Names of the channels: ("R", "G", "B"), ("Y",) for grey, others as an EXR has them.
    mm_per_pixel : float, optional [mm]
        Size of a pixel; None where the file does not say.
    alpha : array (H, W), optional
        Coverage, kept apart from the colour.
    alpha_is_multiplied : bool
        Whether ``pixels`` hold the light times the coverage, as in an EXR.
    name : str
        The file's name without its folder.
    notes : tuple of str
        What was done to the file's numbers, in words for stderr.

    Raises
    ------
    RenderError
        An array does not hold real numbers, or has another shape.
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
        """Keep an array read-only, in the order of C."""
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

    EXR: R, G, B of the first part that has them, or of the only layer that has, else Y, else all
    channels; its window of data is put into the picture's, black around. Palettes become RGB, grey
    stays one channel. Primaries other than those of sRGB are converted, white staying white: the
    chromaticities of an EXR, PRIMARIES of a Radiance file, cHRM of a PNG. Values that would fall
    below 0 then are set to 0. Radiance's EXPOSURE and COLORCORR are taken out of the light.

    Parameters
    ----------
    path : str or Path
        An EXR, Radiance HDR, TIFF, PNG, JPG or TGA file, by its content and not by its ending, but
        for TGA files of the first version, which only their ending tells.
    layer : str, optional
        Of an EXR: what stands before the last dot in its channels' names, or the name of a part.
    largest_bytes : float [bytes]
        Refuse pictures that would need more to be rendered, 32 bytes for each of their values.

    Returns
    -------
    Image
        8- and 16-bit numbers sRGB-decoded (IEC 61966-2-1) unless the file says that they are
        linear; turned upright.

    Raises
    ------
    FileError
        Missing, unreadable, damaged, cut short, of another format, or compressed in a way that
        the library was built without.
    RenderError
        Too large, without channels that can be used, with several layers and none of them named,
        or with NaN, infinite or negative values.
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
    """Write linear light: float32 to EXR or TIFF as it is, 16-bit sRGB to PNG.

    A PNG holds ``exposure`` times the light, clipped to 0 to 1 and sRGB-encoded. With alpha, an EXR
    holds the light times it and a PNG the light without it, as these formats have it; a TIFF says
    which. Files are written whole or not at all, and the same picture gives the same bytes.

    Parameters
    ----------
    target : path or binary stream
        Where to.
    pixels : array (H, W, C)
        Linear light; row 0 is the top.
    channels : sequence of str, optional
        Names for EXR; needed for other counts than 1 (Y) and 3 (R, G, B), which only EXR can hold.
    format : str, optional
        "exr", "tiff" or "png"; by default what the ending says.
    exposure : float
        Factor for PNG; the other formats keep the light as it is.
    mm_per_pixel : float, optional [mm]
        Kept in the header of an EXR, from where `load_image` takes it.
    alpha : array (H, W), optional
        Coverage, for pictures of 1 or 3 channels.
    alpha_is_multiplied : bool
        Whether ``pixels`` hold the light times the coverage.

    Returns
    -------
    tuple of str
        What was done to the numbers, in words for stderr.

    Raises
    ------
    FileError
        The file cannot be written; an older one is untouched.
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
    except OSError as error:  # a name that no file system takes
        raise FileError(f"{called(path)} cannot be written: {reason(error)}.") from None
