"""What a kernel is applied to: a picture of irradiance, optionally with geometry."""

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray, ReadOnly, check_label, is_whole, true_or_false
from sssfit.errors import RenderError
from sssfit.formats.colours import as_light, names_for, positive
from sssfit.messages import counted, printable, shown

if TYPE_CHECKING:
    from sssfit.formats.pictures import Image


_MAX_OBJECTS = 2**31 - 1  # largest number of 32 bits
_LONGEST = 60  # characters of a name in a repr
_HALF = 0.5  # of coverage: a pixel on an outline belongs to the object that covers more of it
_WITH_CHANNELS = ("irradiance", "specular", "back_irradiance")


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class Scene(ReadOnly):
    """Irradiance on pixels, as linear light, with the other buffers of a renderer.

    Arrays are stored as read-only float64, channel axis last. H rows from the top, W columns.

    Parameters
    ----------
    name : str
        Name for reports, on one line: that of a made picture or of a file.
    irradiance : array (H, W, C)
        Light that arrives at the surface, at least 0. C = 1 fits kernels with any number of
        channels.
    mm_per_pixel : float [mm]
        Size of a pixel on the surface; for a perspective view that of the plane at ``distance_mm``.
    distance_mm : float, optional [mm]
        Distance of the camera from that plane; None for a flat picture seen from above.
    depth_mm : array (H, W), optional [mm]
        Distance from the camera along the view axis; inf on the background.
    mask : array (H, W) of int, optional
        Number of the translucent object of a pixel, from 1; 0 for everything else.
    specular : array (H, W, C) or (H, W, 1), optional
        Light reflected at the surface: never blurred, added afterwards. Beside irradiance of one
        channel it may have those of the kernel.
    thickness_mm : array (H, W), optional [mm]
        Path of the light inside the object to this point.
    back_irradiance : array (H, W, C) or (H, W, 1), optional
        Irradiance where that light enters; its channels are like those of ``specular``.
    alpha : array (H, W), optional
        Coverage of a picture from a file, 0 to 1, kept for the output and never blurred.
    alpha_is_multiplied : bool
        Whether the irradiance is multiplied by the coverage.
    channel_names : tuple of str, optional
        Names of the C channels in a file. Where a kernel has the same names in another order,
        `for_channels` puts them into its order; otherwise channels belong to each other by place.

    Raises
    ------
    RenderError
        A buffer has another shape than the irradiance, or holds NaN or negative values; or another
        field is invalid.
    """

    name: str
    irradiance: FloatArray
    mm_per_pixel: float
    distance_mm: float | None = None
    depth_mm: FloatArray | None = None
    mask: npt.NDArray[np.int32] | None = None
    specular: FloatArray | None = None
    thickness_mm: FloatArray | None = None
    back_irradiance: FloatArray | None = None
    alpha: FloatArray | None = None
    alpha_is_multiplied: bool = False
    channel_names: tuple[str, ...] | None = None

    @classmethod
    def from_image(
        cls, image: "Image", mm_per_pixel: float, *, alpha_is_mask: bool = False
    ) -> "Scene":
        """Return a picture from a file as irradiance on a flat surface.

        Parameters
        ----------
        image : Image
            A picture from ``sssfit.formats.pictures.load_image``. Its alpha is clipped to 0 to 1,
            beyond which the filters of renderers go a little.
        mm_per_pixel : float [mm]
        alpha_is_mask : bool
            The object is the part that alpha covers by half or more. There the light is divided by
            alpha; the rest is dark and has mask 0.

        Raises
        ------
        RenderError
            The alpha channel should be the mask, but it is missing or covers nothing.
        """
        name = image.name or "the picture"
        coverage = image.alpha
        alpha = None if coverage is None else np.clip(coverage, 0.0, 1.0)
        if not alpha_is_mask:
            return cls(
                name,
                image.pixels,
                mm_per_pixel,
                alpha=alpha,
                alpha_is_multiplied=image.alpha_is_multiplied,
                channel_names=image.channels,
            )
        if coverage is None:
            raise RenderError(f"{name} has no alpha that could be the mask.")
        inside = coverage >= _HALF
        if not inside.any():
            raise RenderError(f"{name}: alpha is under {_HALF:g} everywhere; nothing is left.")
        share = np.where(inside, coverage, 1.0) if image.alpha_is_multiplied else 1.0
        light = np.where(inside[..., None], image.pixels / np.expand_dims(share, -1), 0.0)
        return cls(
            name,
            light,
            mm_per_pixel,
            mask=inside.astype(np.int32),
            alpha=alpha,
            channel_names=image.channels,
        )

    def __post_init__(self) -> None:
        check_label("name", self.name, RenderError)
        shape = as_light(self.irradiance, f"{self.name}: irradiance").shape
        if len(shape) != 3 or 0 in shape:
            raise RenderError(
                f"{self.name}: irradiance of shape {shape}; expected rows, columns and channels, "
                "at least one of each."
            )
        for field, value in self._checked_words(shape[2]).items():
            object.__setattr__(self, field, value)
        for field in ("irradiance", "specular", "thickness_mm", "back_irradiance", "depth_mm"):
            self._store(field, np.float64)
        self._store("alpha", np.float64)
        self._store("mask", np.int32)

    def __repr__(self) -> str:
        name = printable(self.name)
        buffers = [
            each.name.removesuffix("_mm").replace("_", " ")
            for each in dataclasses.fields(self)
            if each.name != "irradiance" and isinstance(getattr(self, each.name), np.ndarray)
        ]
        more = f", with {', '.join(buffers)}" if buffers else ""
        return (
            f"<Scene {name if len(name) <= _LONGEST else name[: _LONGEST - 3] + '...'}: "
            f"{self.width} x {self.height} pixels of {self.mm_per_pixel:.4g} mm, "
            f"{counted(self.channels, 'channel')}{more}>"
        )

    def _checked_words(self, channels: int) -> dict[str, Any]:
        """Return the fields that are no buffers, as stored."""
        multiplied = f"{self.name}: alpha_is_multiplied"
        fields: dict[str, Any] = {
            "mm_per_pixel": positive(self.mm_per_pixel, f"{self.name}: mm_per_pixel"),
            "alpha_is_multiplied": true_or_false(multiplied, self.alpha_is_multiplied, RenderError),
        }
        if self.distance_mm is not None:
            fields["distance_mm"] = positive(self.distance_mm, f"{self.name}: distance_mm")
        if (names := self.channel_names) is not None:
            fields["channel_names"] = names_for(channels, names, f"{self.name}: channel_names")
        return fields

    def _store(self, field: str, dtype: npt.DTypeLike) -> None:
        """Check the shape and values of a buffer and store it read-only."""
        given = getattr(self, field)
        if given is None:
            return
        values = as_light(given, f"{self.name}: {field}")
        self._check_shape(field, values.shape)
        # Only depth may be infinite, on the background.
        bad = np.isnan(values) if field == "depth_mm" else ~np.isfinite(values)
        if bad.any() or (values < 0).any():
            what = "NaN or infinite" if bad.any() else "negative"
            count = int(bad.sum()) if bad.any() else int((values < 0).sum())
            raise RenderError(
                f"{self.name}: {field} has {counted(count, f'{what} value')}; expected numbers "
                "from 0 up."
            )
        if field == "mask" and ((values % 1.0 != 0.0) | (values > _MAX_OBJECTS)).any():
            raise RenderError(
                f"{self.name}: mask holds other values than whole numbers up to {_MAX_OBJECTS}."
            )
        if field == "alpha" and (values > 1.0).any():
            raise RenderError(
                f"{self.name}: alpha reaches {values.max():.3g}; expected coverage from 0 to 1."
            )
        # Always row-major: sums over pixels in another order round differently.
        kept = values.astype(dtype, order="C")
        kept.setflags(write=False)
        object.__setattr__(self, field, kept)

    def _check_shape(self, field: str, shape: tuple[int, ...]) -> None:
        size, channels = np.shape(self.irradiance)[:2], np.shape(self.irradiance)[2]
        if shape[:2] != size:
            raise RenderError(
                f"{self.name}: {field} is {shape[:2]} and irradiance {size}; expected the same "
                "rows and columns."
            )
        if (len(shape) == 3) != (field in _WITH_CHANNELS) or len(shape) > 3:
            has = "rows, columns and channels" if field in _WITH_CHANNELS else "rows and columns"
            raise RenderError(f"{self.name}: {field} of shape {shape}; expected {has}.")
        if len(shape) == 3 and shape[2] not in (1, channels) and (channels > 1 or shape[2] == 0):
            raise RenderError(
                f"{self.name}: {field} of shape {shape} beside irradiance of "
                f"{counted(channels, 'channel')}; expected as many channels, or one."
            )

    def for_channels(self, names: Sequence[str]) -> "Scene":
        """Return the scene with its channels in this order, if a file named them the same.

        An EXR holds its channels by the alphabet: 1050nm comes before 950nm.
        """
        own = self.channel_names
        if own is None or own == tuple(names) or sorted(own) != sorted(names):
            return self
        order = [own.index(each) for each in names]
        light = {
            field: buffer[..., order]
            for field in _WITH_CHANNELS
            if (buffer := getattr(self, field)) is not None and buffer.shape[-1] == len(own)
        }
        return dataclasses.replace(self, **light, channel_names=tuple(names))

    def corner(self, pixels: int) -> "Scene":
        """Return the upper left corner of the scene with this height and width, or all there is."""
        if not is_whole(pixels) or pixels < 1:
            raise RenderError(f"pixels = {shown(pixels)}; expected a whole number from 1 up.")
        buffers: dict[str, Any] = {
            field.name: value[:pixels, :pixels]
            for field in dataclasses.fields(self)
            if isinstance(value := getattr(self, field.name), np.ndarray)
        }
        return dataclasses.replace(self, **buffers)

    @property
    def height(self) -> int:
        """Rows."""
        return int(self.irradiance.shape[0])

    @property
    def width(self) -> int:
        """Columns."""
        return int(self.irradiance.shape[1])

    @property
    def channels(self) -> int:
        """Channels of the irradiance; 1 fits kernels with any number."""
        return int(self.irradiance.shape[2])

    @property
    def fov_degrees(self) -> float | None:
        """Vertical field of view, from tan(fov / 2) = H / 2 * mm_per_pixel / distance_mm."""
        if self.distance_mm is None:
            return None
        half_height_mm = 0.5 * self.height * self.mm_per_pixel
        return float(np.degrees(2.0 * np.arctan(half_height_mm / self.distance_mm)))
