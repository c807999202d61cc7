"""What a kernel is applied to: a picture of irradiance, with geometry if it has one."""

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray
from sssfit.errors import RenderError
from sssfit.formats.colours import as_light, positive

if TYPE_CHECKING:
    from sssfit.formats.pictures import Image


_MOST_OBJECTS = 2**31 - 1  # numbers of 32 bits
_HALF = 0.5  # of coverage: a pixel of an outline belongs to what covers more of it


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """Irradiance on pixels, linear light, with the buffers a renderer would have beside it.

    Arrays are stored as read-only float64, channel axis last. H rows from the top, W columns.

    Parameters
    ----------
    name : str
        What it is, for reports: a made picture's name or a file's.
    irradiance : array (H, W, C)
        What arrives at the surface, at least 0. C = 1 serves kernels of any number of channels.
    mm_per_pixel : float [mm]
        Size of a pixel on the surface; for a perspective view that of the plane at ``distance_mm``.
    distance_mm : float, optional [mm]
        From the eye to that plane; None for a flat picture, seen from straight above.
    depth_mm : array (H, W), optional [mm]
        Distance along the view axis from the eye; inf where nothing is.
    mask : array (H, W) of int, optional
        Which translucent object a pixel belongs to, 1 and up; 0 for everything else.
    specular : array (H, W, C) or (H, W, 1), optional
        Light reflected at the surface: never blurred, added afterwards.
    thickness_mm : array (H, W), optional [mm]
        How far light travels inside the object to this point from the light's side.
    back_irradiance : array (H, W, C) or (H, W, 1), optional
        Irradiance where that light enters.
    alpha : array (H, W), optional
        Coverage of a picture from a file: carried along for what is written, never blurred.
    alpha_is_multiplied : bool
        Whether the irradiance holds the light times the coverage.

    Raises
    ------
    RenderError
        A buffer has another shape than the irradiance, or holds NaN or negative values.
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

    @classmethod
    def from_image(
        cls, image: "Image", mm_per_pixel: float, *, alpha_is_mask: bool = False
    ) -> "Scene":
        """Return a picture from a file as irradiance on a flat surface.

        Parameters
        ----------
        image : Image
            Of ``sssfit.formats.pictures.load_image``.
        mm_per_pixel : float [mm]
        alpha_is_mask : bool
            The object is what alpha covers by half or more: there the light is taken without
            alpha; all else is dark and of mask 0.

        Raises
        ------
        RenderError
            Alpha is to be the mask, and there is none, or it covers nothing.
        """
        # Renderers' filters leave some alpha a little below 0.
        alpha = None if image.alpha is None else np.maximum(image.alpha, 0.0)
        if not alpha_is_mask:
            return cls(
                image.name,
                image.pixels,
                mm_per_pixel,
                alpha=alpha,
                alpha_is_multiplied=image.alpha_is_multiplied,
            )
        if alpha is None:
            raise RenderError(f"{image.name} has no alpha that could be the mask.")
        inside = alpha >= _HALF
        if not inside.any():
            raise RenderError(
                f"{image.name}: alpha is under {_HALF:g} everywhere; nothing is left."
            )
        share = np.where(inside, alpha, 1.0) if image.alpha_is_multiplied else 1.0
        light = np.where(inside[..., None], image.pixels / np.expand_dims(share, -1), 0.0)
        return cls(image.name, light, mm_per_pixel, mask=inside.astype(np.int32), alpha=alpha)

    def __post_init__(self) -> None:
        shape = as_light(self.irradiance, f"{self.name}: irradiance").shape
        if len(shape) != 3 or 0 in shape:
            raise RenderError(
                f"{self.name}: irradiance of shape {shape}; expected rows, columns and channels, "
                "at least one of each."
            )
        positive(self.mm_per_pixel, f"{self.name}: mm_per_pixel")
        for field in ("irradiance", "specular", "thickness_mm", "back_irradiance", "depth_mm"):
            self._store(field, np.float64)
        self._store("alpha", np.float64)
        self._store("mask", np.int32)

    def _store(self, field: str, dtype: npt.DTypeLike) -> None:
        """Check a buffer against the irradiance and keep it read-only."""
        given = getattr(self, field)
        if given is None:
            return
        values = as_light(given, f"{self.name}: {field}")
        if values.shape[:2] != np.shape(self.irradiance)[:2]:
            raise RenderError(
                f"{self.name}: {field} is {values.shape[:2]} and irradiance "
                f"{np.shape(self.irradiance)[:2]}; expected the same rows and columns."
            )
        # Only depth may be infinite: where the eye sees past the object.
        bad = np.isnan(values) if field == "depth_mm" else ~np.isfinite(values)
        if bad.any() or (values < 0).any():
            what = "NaN or infinite" if bad.any() else "negative"
            count = int(bad.sum()) if bad.any() else int((values < 0).sum())
            raise RenderError(
                f"{self.name}: {field} has {count} {what} values; expected numbers from 0 up."
            )
        if field == "mask" and ((values % 1.0 != 0.0) | (values > _MOST_OBJECTS)).any():
            raise RenderError(
                f"{self.name}: mask holds other values than whole numbers up to {_MOST_OBJECTS}."
            )
        # Row after row, in any case: sums over pixels in another order round otherwise.
        kept = values.astype(dtype, order="C")
        kept.setflags(write=False)
        object.__setattr__(self, field, kept)

    def corner(self, pixels: int) -> "Scene":
        """Return the scene's upper left corner, so many pixels wide and high."""
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
        """Channels of the irradiance; 1 serves kernels of any number."""
        return int(self.irradiance.shape[2])

    @property
    def fov_degrees(self) -> float | None:
        """Vertical field of view, from tan(fov / 2) = H / 2 * mm_per_pixel / distance_mm."""
        if self.distance_mm is None:
            return None
        half_height_mm = 0.5 * self.height * self.mm_per_pixel
        return float(np.degrees(2.0 * np.arctan(half_height_mm / self.distance_mm)))
