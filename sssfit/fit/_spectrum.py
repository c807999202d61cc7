"""The kernel's spectrum, weighted as pictures are: what cascades and weighted terms are fitted to.

Pictures are not white. Edges at random places and natural images have the power 1/f^2, so an error
of the kernel's spectrum K^(wx, wy) is seen with the weight

    S(wx, wy) = 1 / (4 sin^2(wx/2) + 4 sin^2(wy/2)),

the power of the discrete Laplacian's inverse. White weights give the Frobenius norm.

One picture E has its own power. Mirrored at its border it is a sum of cosines, which an even kernel
only scales, and by Parseval

    |K * E - K~ * E|^2 = sum over k of |E^_k|^2 (K^(w_k) - K~^(w_k))^2,    w_k = pi k / N,

with E^ its orthonormal cosine transform (DCT-II), so the weighted misfit is the squared error of
the rendered picture. Mirrored pictures have no edges but their own: no window is needed.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import FitError
from sssfit.fit._target import Target
from sssfit.messages import counted, printable, shown
from sssfit.scene.load import load_scene
from sssfit.scene.made import MADE, check_pictures
from sssfit.scene.record import Scene

SPECTRA = ("natural", "white")
Pictures: TypeAlias = str | Scene  # a word of SPECTRA, or the picture itself
# Share of the natural spectrum in a picture's own, so that frequencies that it lacks have a weight.
# A fit that is no worse in the mixture than the natural one, the best for the second part, is no
# worse for the picture.
_FLOOR = 1e-3
_ROWS = 512  # of made pictures, as `load_scene` makes them
# The lowest frequency above 0 is that of a picture of so many pixels, or of one that holds the
# kernel. Over a graded grid of 72 a side the optimum of a cascade is that over 256 (a trial's).
_PICTURE_PIXELS = 256
_FREQUENCIES, _GRADING = 72, 2.2
# Of those asked for. A search takes .75 of the time on fewer, or .5 with stars. With a last
# descent on all, of the misfits of ten structures for skin1 and chicken1 six are lower by 1 % or
# more, three higher.
_SEARCHED = 40
_DECIMALS = 7  # of a share of the energy that a search sees; the exact solver is off by 5e-6


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
        Half width of the kernel.
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


def pictures_of(
    target: Target, spectrum: str | None, irradiance: str | Path | Scene | None
) -> Pictures:
    """Return what a kernel is for: a word for the spectrum, or one picture, read and checked.

    Parameters
    ----------
    target : Target
        The kernel's pixels, which are also those of a made picture.
    spectrum : {"natural", "white"}, optional
        By default natural, unless there is a picture.
    irradiance : str, Path or Scene, optional
        A made picture's name, a file, or a scene.

    Raises
    ------
    FitError
        Both are given; the picture has other pixels or channels, is smaller than the kernel or of
        one colour.
    ArgumentError, FileError, RenderError
        There is no such picture, or it cannot be read.
    """
    if irradiance is None:
        return "natural" if spectrum is None else spectrum
    if spectrum is not None:
        raise FitError(
            f"`spectrum = {printable(str(spectrum))}` beside a picture, which has a spectrum of "
            "its own; leave out one of the two."
        )
    scene = irradiance if isinstance(irradiance, Scene) else _loaded(target, str(irradiance))
    scene = scene.for_channels(target.profile.channels)
    _check_picture(target, scene)
    return scene


def recorded(pictures: Pictures) -> dict[str, str]:
    """Return the setting that a kernel's file keeps of them."""
    if isinstance(pictures, Scene):
        return {"irradiance": pictures.name}
    return {"spectrum": pictures}


def _loaded(target: Target, name: str) -> Scene:
    check_pictures([name])
    if name not in MADE or name == "head":
        return load_scene(name, otherwise=target.mm_per_pixel)
    rows = max(_ROWS, 2 * target.half_pixels + 1)
    return load_scene(name, target.mm_per_pixel, size=(rows, rows))


def _check_picture(target: Target, scene: Scene) -> None:
    """Refuse a picture whose power says nothing about the kernel's error."""
    pitch, pixels = target.mm_per_pixel, 2 * target.half_pixels + 1
    if abs(scene.mm_per_pixel - pitch) > 1e-6 * pitch:
        raise FitError(
            f"{scene.name} has pixels of {scene.mm_per_pixel:.7g} mm and the kernel of {pitch:.7g} "
            "mm; expected the same: give `mm_per_pixel`."
        )
    if scene.channels not in (1, target.profile.n_channels):
        raise FitError(
            f"{scene.name} has {counted(scene.channels, 'channel')} and the profile "
            f"{target.profile.n_channels}; expected as many, or one."
        )
    if min(scene.height, scene.width) < pixels:
        raise FitError(
            f"{scene.name} has {scene.width} x {scene.height} pixels and the kernel {pixels} x "
            f"{pixels}; expected a picture at least as large, or a smaller support."
        )
    flat = np.ptp(scene.irradiance, axis=(0, 1)) == 0.0
    if flat.any():
        where = f" in channel {target.profile.channels[np.argmax(flat)]}" * (scene.channels > 1)
        raise FitError(
            f"{scene.name} is of one colour{where}, which no kernel blurs; give a picture with an "
            "edge in it."
        )


def spectral_target(
    target: Target,
    channels: list[int],
    pictures: Pictures,
    grid: tuple[FloatArray, FloatArray] | None = None,
) -> SpectralTarget:
    """Return the spectrum of a target's kernel, scaled to all of its energy.

    Parameters
    ----------
    target : Target
        A profile and its pixels.
    channels : list of int
        Channels that return light.
    pictures : {"natural", "white"} or Scene
        What the kernel is for: their spectrum, or the picture.
    grid : tuple of array (n,), optional
        Frequencies and their weights; by default `graded_frequencies`.

    Raises
    ------
    FitError
        The spectrum is another word.
    """
    w, cell = graded_frequencies(target.half_pixels) if grid is None else grid
    energy = target.total[channels]
    (wanted,) = _transforms(target, channels, energy, [w])
    power = _power(channels, pictures, w, cell, wanted)
    return SpectralTarget(w, wanted, power, energy, target.half_pixels)


def search_targets(
    target: Target, channels: list[int], pictures: Pictures
) -> tuple[SpectralTarget, SpectralTarget]:
    """Return what a search is for: on the few frequencies of its steps, and on all, for its end."""
    few, many = _search_targets(target, channels, pictures, (_SEARCHED, None))
    return few, many


def search_target(
    target: Target, channels: list[int], pictures: Pictures, *, count: int | None = None
) -> SpectralTarget:
    """Return what a search is for on a number of frequencies.

    It is a share of the energy, so that this is 1, and rounded: the last digits of a profile then
    cannot decide in which of many optima the search ends.

    Parameters
    ----------
    target, channels, pictures
        As in `spectral_target`.
    count : int, optional
        As in `graded_frequencies`.

    Raises
    ------
    FitError
        As `spectral_target`.
    """
    (found,) = _search_targets(target, channels, pictures, (count,))
    return found


def _search_targets(
    target: Target, channels: list[int], pictures: Pictures, counts: Sequence[int | None]
) -> list[SpectralTarget]:
    """Return it for each of several numbers of frequencies."""
    energy = np.ones(len(channels))
    grids = [graded_frequencies(target.half_pixels, each) for each in counts]
    spectra = _transforms(target, channels, energy, [w for w, _ in grids])
    found = []
    for (w, cell), exact in zip(grids, spectra, strict=True):
        wanted = np.round(exact, _DECIMALS)
        power = _power(channels, pictures, w, cell, wanted)
        found.append(SpectralTarget(w, wanted, power, energy, target.half_pixels))
    return found


def _transforms(
    target: Target, channels: list[int], energy: FloatArray, grids: Sequence[FloatArray]
) -> list[FloatArray]:
    """Return the kernel's spectrum (C, n, n) on each grid, scaled to an energy (C,)."""
    cosines = [_cosines(w, target) for w in grids]
    found = [np.empty((len(channels), w.size, w.size)) for w in grids]
    for k, (channel, total) in enumerate(zip(channels, energy, strict=True)):
        quadrant = target.quadrant(channel)
        for wanted, waves in zip(found, cosines, strict=True):
            wanted[k] = waves @ quadrant @ waves.T
            wanted[k] *= total / wanted[k, 0, 0]
    return found


def _power(
    channels: list[int], pictures: Pictures, w: FloatArray, cell: FloatArray, wanted: FloatArray
) -> FloatArray:
    """Return the weights (C, n, n) of squared errors, of which sum power wanted^2 = 1."""
    is_word = isinstance(pictures, str) and pictures in SPECTRA
    if not is_word and not isinstance(pictures, Scene):
        raise FitError(f"spectrum = {shown(pictures)}; expected {' or '.join(map(repr, SPECTRA))}.")
    power = cell[:, None] * cell
    if pictures != "white":
        sine = 4.0 * np.sin(0.5 * w) ** 2
        power[0, 0] = 0.0  # the energy is exact, where S is infinite
        power /= np.maximum(sine[:, None] + sine, sine[1])
    weights = _scaled(np.broadcast_to(power, wanted.shape), wanted)
    if isinstance(pictures, Scene):
        planes = np.moveaxis(pictures.irradiance, -1, 0)
        seen = planes[channels] if len(planes) > 1 else planes
        own = np.broadcast_to([power_of(each, w) for each in seen], wanted.shape)
        weights = (1.0 - _FLOOR) * _scaled(own, wanted) + _FLOOR * weights
    return weights


def _scaled(power: FloatArray, wanted: FloatArray) -> FloatArray:
    """Return power (C, n, n) with sum power wanted^2 = 1 for each channel."""
    norm: FloatArray = np.einsum("cij,cij->c", power, wanted**2)
    return power / norm[:, None, None]


def power_of(light: FloatArray, w: FloatArray) -> FloatArray:
    """Return the power of a mirrored picture (H, W) on frequencies w (n,), (n, n).

    What lies between two frequencies goes to both by hats, so the sum is the picture's own, but for
    its mean, which is left out. Kernels are the same along both axes, and so is the mean of the
    two.
    """
    from scipy.fft import dctn  # 0.1 s that other methods do not need

    power = dctn(light, norm="ortho") ** 2
    for _ in range(2):
        power = _at(power, w).T
    power[0, 0] = 0.0
    found: FloatArray = 0.5 * (power + power.T)
    return found


def _at(power: FloatArray, w: FloatArray) -> FloatArray:
    """Share out the rows (N, ..) of a cosine transform among frequencies w (n,), (n, ..)."""
    own = np.pi * np.arange(len(power)) / len(power)
    lower = np.clip(np.searchsorted(w, own, side="right") - 1, 0, w.size - 2)
    upper = np.clip((own - w[lower]) / (w[lower + 1] - w[lower]), 0.0, 1.0)[:, None]
    found = np.zeros((w.size, power.shape[1]))
    np.add.at(found, lower, power * (1.0 - upper))
    np.add.at(found, lower + 1, power * upper)
    return found


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


def graded_frequencies(half_pixels: int, count: int | None = None) -> tuple[FloatArray, FloatArray]:
    """Return frequencies (n,) in radians a pixel, dense near 0, and trapezoid weights (n,).

    Those of the ``count`` asked for, by default 72, that round to the same frequency of a picture
    are one: 65 of 72 and 38 of 40 for skin1 at .3 mm.
    """
    pixels = max(_PICTURE_PIXELS, 2 * half_pixels + 1)
    steps = np.linspace(0.0, 1.0, count or _FREQUENCIES) ** _GRADING
    k = np.unique(np.round(pixels * steps))
    w = np.pi * np.minimum(k, pixels - 0.5) / pixels
    apart = 0.5 * np.diff(w)
    return w, np.append(apart, 0.0) + np.append(0.0, apart)
