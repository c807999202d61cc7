"""Calls of the closed forms in ``pixels``; nothing here needs numba."""

from ctypes import c_double, c_int64

import numpy as np
import numpy.typing as npt

from sssfit._jit.machine_code import Array, Entry

FloatArray = npt.NDArray[np.float64]

ENTRY = Entry(
    "pixels",
    (
        *(c_int64, c_int64, c_int64, c_int64),  # is_plane, edges, channels, half_pixels
        c_double,  # pitch
        *(Array(np.float64), Array(np.float64, 2), Array(np.float64)),  # radii, densities, energies
    ),
)


def line_energy(
    radii: FloatArray, densities: FloatArray, pitch: float, half_pixels: int
) -> FloatArray:
    """Return the energy in strips of one pixel's width at x >= 0, (half_pixels+1, C).

    Parameters
    ----------
    radii : array (m,)
        The outer edges of the annuli, increasing.
    densities : array (m, C)
        Densities of the annuli inside these edges, per area.
    pitch : float
        Width of a pixel, in the unit of the radii.
    half_pixels : int
    """
    return _energy((half_pixels + 1,), radii, densities, pitch)


def quadrant_energy(
    radii: FloatArray, densities: FloatArray, pitch: float, half_pixels: int
) -> FloatArray:
    """Return the energy in the pixels of a quadrant, axes included, (half+1, half+1, C).

    Parameters are those of `line_energy`.
    """
    return _energy((half_pixels + 1, half_pixels + 1), radii, densities, pitch)


def _energy(
    pixels: tuple[int, ...], radii: FloatArray, densities: FloatArray, pitch: float
) -> FloatArray:
    edges, channels = densities.shape
    if len(radii) != edges:
        raise ValueError(f"{len(radii)} radii and {edges} densities; expected as many.")
    energies = np.zeros((*pixels, channels))
    given = np.ascontiguousarray(radii), np.ascontiguousarray(densities), energies.reshape(-1)
    ENTRY(len(pixels) == 2, edges, channels, pixels[0] - 1, pitch, *given)
    return energies
