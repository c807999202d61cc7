"""The colours of a sweep over wavelengths: one for each combination of its other axes.

``sssfit.sweep.swatches`` reads them from a store, ``sssfit.chart.swatches`` draws them.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from sssfit.arrays import FloatArray, plain
from sssfit.measure.daylight import srgb_of_xyz, xyz_weights

_OUTSIDE = 0.5 / 255.0  # of a code: what 8 bits do not show


@dataclass(frozen=True, eq=False)
class Swatches:
    """Reflectances over wavelengths, and what colour each spectrum has in daylight.

    Parameters
    ----------
    name : str
        Name of the material that was varied.
    method : str
        Method of the simulation.
    wavelengths_nm : (n,) [nm]
    axes : mapping of str to (m,)
        The values of each other axis, in the order of the dimensions.
    units : mapping of str to str
        The unit of each other axis; "1" for none.
    reflectance, stderr : (..., n) [1]
        Diffuse reflectance and its standard error; NaN where a point is not finished.
    """

    name: str
    method: str
    wavelengths_nm: FloatArray
    axes: Mapping[str, FloatArray]
    units: Mapping[str, str]
    reflectance: FloatArray
    stderr: FloatArray

    @cached_property
    def xyz(self) -> FloatArray:
        """X, Y, Z (..., 3) under D65 for the CIE 1931 observer, of a white Y = 1; NaN as above."""
        return self.reflectance @ xyz_weights(self.wavelengths_nm)

    @cached_property
    def luminance_stderr(self) -> FloatArray:
        """Standard error of Y (...)."""
        weights = xyz_weights(self.wavelengths_nm)[:, 1]
        return np.asarray(np.sqrt(((self.stderr * weights) ** 2).sum(axis=-1)))

    @cached_property
    def codes(self) -> FloatArray:
        """SRGB codes (..., 3), not clipped."""
        return srgb_of_xyz(self.xyz)

    @property
    def missing(self) -> int:
        """Number of swatches whose spectrum is not finished."""
        return int(np.isnan(self.xyz[..., 1]).sum())

    @property
    def outside(self) -> int:
        """Number of swatches that sRGB does not have."""
        far = (self.codes < -_OUTSIDE) | (self.codes > 1.0 + _OUTSIDE)
        return int(far.any(axis=-1).sum())

    def hexadecimal(self, position: tuple[int, ...]) -> str | None:
        """Return the 8-bit code of a swatch, clipped, as #rrggbb; None if it is not finished."""
        code = self.codes[position]
        if np.isnan(code).any():
            return None
        return "#" + "".join(f"{round(255.0 * each):02x}" for each in np.clip(code, 0.0, 1.0))

    def to_dict(self) -> dict[str, Any]:
        """Return all colours as JSON values; X, Y, Z and code are nested as the axes are."""
        shape = self.reflectance.shape[:-1]
        hexadecimal = np.empty(shape, dtype=object)
        for position in np.ndindex(shape):
            hexadecimal[position] = self.hexadecimal(position)
        found: dict[str, Any] = plain(
            {
                "material": self.name,
                "method": self.method,
                "observer": "CIE 1931 2 degrees",
                "illuminant": "D65",
                "wavelengths_nm": self.wavelengths_nm,
                "axes": dict(self.axes),
                "units": dict(self.units),
                "xyz": self.xyz,
                "luminance_stderr": self.luminance_stderr,
                "srgb": hexadecimal.tolist(),
                "outside_srgb": self.outside,
                "missing": self.missing,
            }
        )
        return found
