"""The kernel's spectrum, weighted as pictures are: what cascades and weighted terms are fitted to.

Pictures are not white. Edges at random places and natural images have the power 1/f^2, so an error
of the kernel's spectrum K^(wx, wy) is seen with the weight

    S(wx, wy) = 1 / (4 sin^2(wx/2) + 4 sin^2(wy/2)),

the power of the discrete Laplacian's inverse. White weights give the Frobenius norm.
"""

from dataclasses import dataclass

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import FitError
from sssfit.fit._target import Target

SPECTRA = ("natural", "white")
# The lowest frequency above 0 is that of a picture of so many pixels, or of one that holds the
# kernel. Over a graded grid of 72 a side the optimum of a cascade is that over 256 (a trial's).
_PICTURE_PIXELS = 256
_FREQUENCIES, _GRADING = 72, 2.2


@dataclass(frozen=True, slots=True, eq=False)
class SpectralTarget:
    """The spectrum of a profile's kernel on a quadrant of frequencies, for C channels.

    Parameters
    ----------
    frequencies : array (n,) [radians per pixel]
        Along either axis, from 0 up.
    wanted : array (C, n, n)
        The kernel's spectrum; at 0 the energy.
    power : array (C, n, n)
        Weight of a squared error, with the cell of each node; sum power wanted^2 = 1.
    energy : array (C,)
    half_pixels : int
        Of the kernel.
    """

    frequencies: FloatArray
    wanted: FloatArray
    power: FloatArray
    energy: FloatArray
    half_pixels: int

    def cosines(self, target: Target) -> FloatArray:
        """Return the spectra (n, h+1) of the pixels of an even line."""
        return _cosines(self.frequencies, target)

    def error(self, spectrum: FloatArray) -> FloatArray:
        """Return the norm of the difference from a spectrum (C, n, n), as a share, (C,)."""
        apart = spectrum - self.wanted
        squares: FloatArray = np.einsum("cij,cij->c", self.power * apart, apart)
        return np.sqrt(squares)


def spectral_target(
    target: Target,
    channels: list[int],
    spectrum: str,
    grid: tuple[FloatArray, FloatArray] | None = None,
) -> SpectralTarget:
    """Return the spectrum of a target's kernel, scaled to all of its energy.

    Parameters
    ----------
    target : Target
        A profile and its pixels.
    channels : list of int
        Channels that return light.
    spectrum : {"natural", "white"}
        Of the pictures that the kernel is for.
    grid : tuple of array (n,), optional
        Frequencies and their weights; by default `graded_frequencies`.

    Raises
    ------
    FitError
        The spectrum is another word.
    """
    if spectrum not in SPECTRA:
        raise FitError(f"spectrum = {spectrum!r}; expected {' or '.join(map(repr, SPECTRA))}.")
    w, cell = graded_frequencies(target.half_pixels) if grid is None else grid
    cosines = _cosines(w, target)
    energy = target.total[channels]
    wanted = np.empty((len(channels), w.size, w.size))
    for row, channel, total in zip(wanted, channels, energy, strict=True):
        row[...] = cosines @ target.quadrant(channel) @ cosines.T
        row *= total / row[0, 0]
    power = cell[:, None] * cell
    if spectrum == "natural":
        sine = 4.0 * np.sin(0.5 * w) ** 2
        power[0, 0] = 0.0  # the energy is exact, where S is infinite
        power /= np.maximum(sine[:, None] + sine, sine[1])
    norm = np.einsum("ij,cij->c", power, wanted**2)
    return SpectralTarget(w, wanted, power / norm[:, None, None], energy, target.half_pixels)


def _cosines(w: FloatArray, target: Target) -> FloatArray:
    found: FloatArray = np.cos(np.outer(w, np.arange(target.half_pixels + 1))) * target.copies
    return found


def even_frequencies(half_pixels: int) -> tuple[FloatArray, FloatArray]:
    """Return evenly spaced frequencies (n,) up to pi and trapezoid weights (n,).

    They are so many that sums of squares over them are those over pixels (Parseval).
    """
    count = 2 * half_pixels + 2
    weights = np.ones(count)
    weights[[0, -1]] = 0.5
    return np.pi * np.arange(count) / (count - 1), weights


def graded_frequencies(half_pixels: int) -> tuple[FloatArray, FloatArray]:
    """Return frequencies (n,) in radians a pixel, dense near 0, and trapezoid weights (n,)."""
    pixels = max(_PICTURE_PIXELS, 2 * half_pixels + 1)
    steps = np.linspace(0.0, 1.0, _FREQUENCIES) ** _GRADING
    k = np.unique(np.round(pixels * steps))
    w = np.pi * np.minimum(k, pixels - 0.5) / pixels
    apart = 0.5 * np.diff(w)
    return w, np.append(apart, 0.0) + np.append(0.0, apart)
