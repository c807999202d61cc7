"""The true picture: irradiance convolved with the pixels of a profile in two dimensions, by FFT.

The picture is continued past its rim as the border says, far enough that the circular convolution
never wraps around. The spectrum of an even kernel is real and even, so the cosine transform (DCT-I)
of one quadrant, a quarter of the size of a full transform, holds all of it. Rows that the border
repeats are transformed along x only once, and unneeded rows are not transformed back, so the cost
stays near that of one forward and one inverse transform of the continued picture.
"""

import dataclasses
import math

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray
from sssfit.errors import RenderError
from sssfit.messages import shown
from sssfit.process import thread_count
from sssfit.profile import Profile
from sssfit.profile.pixels import checked_support
from sssfit.render.borders import (
    check_channels,
    check_memory,
    check_sums,
    scene_for,
    source_indices,
)
from sssfit.scene.record import Scene

ComplexArray = npt.NDArray[np.complex128]

_MIN_REACH = 256


def render_reference(
    scene: Scene, profile: Profile, *, border: str = "mirror", threads: int | None = None
) -> FloatArray:
    """Convolve irradiance with a profile's own 2D kernel on the scene's pixels.

    Light that leaves beyond the profile's grid, or beyond the kernel's pixels, is replaced by the
    mean irradiance far away: the picture's mean with mirrored borders, the mean of its corners with
    clamped ones. A constant picture therefore returns all of the diffuse reflectance.

    Parameters
    ----------
    scene : Scene
        A flat picture: only its irradiance and pixel size are used.
    profile : Profile
        A profile of any method; `reference_quadrant` has the kernel and the remaining energy.
    border : str
        One of ``sssfit.render.borders.BORDERS``.
    threads : int, optional
        Threads to use, by default all cores; the result does not depend on them.

    Returns
    -------
    array (H, W, C)
        Radiant exitance, in the irradiance's unit.

    Raises
    ------
    RenderError
        The channels do not match, the border is unknown, the memory limit is exceeded, or sums of
        the light are above the largest number.
    """
    if not isinstance(profile, Profile):
        raise RenderError(f"profile = {shown(profile)}; expected a Profile.")
    scene = scene_for(scene, profile.channels)
    thread_count(threads)  # raises before the kernel's pixels are computed
    half = reference_half_pixels(profile, scene.mm_per_pixel, scene.height, scene.width)
    _plan(scene.height, scene.width, half, profile.n_channels, border)
    quadrant, left_out = reference_quadrant(profile, scene.mm_per_pixel, scene.height, scene.width)
    with np.errstate(over="ignore", invalid="ignore"):  # checked below
        picture = convolve(scene.irradiance, quadrant, border=border, threads=threads)
        picture += left_out * far_irradiance(scene.irradiance, border)
    # The transforms add up all pixels, with a margin on both sides.
    check_sums(picture, scene, math.prod(padded_shape(scene.height, scene.width, half, border)))
    # Rounding of the transforms, 1e-16 of the largest pixel, would give negative light.
    return np.maximum(picture, 0.0, out=picture) if quadrant.min() >= 0.0 else picture


def far_irradiance(irradiance: FloatArray, border: str) -> FloatArray:
    """Return the mean irradiance (1 or C,) of a picture's continuation, far from the picture."""
    if border == "zero":
        return np.zeros(1)
    seen = irradiance[:: max(len(irradiance) - 1, 1), :: max(irradiance.shape[1] - 1, 1)]
    mean: FloatArray = (irradiance if border == "mirror" else seen).mean(axis=(0, 1))
    return mean


def reference_half_pixels(profile: Profile, mm_per_pixel: float, height: int, width: int) -> int:
    """Return the half width h of the true kernel: its whole grid, or what 256 pixels need.

    Larger pictures use more. Without the minimum, small pictures had kernels cut to their own size,
    and with mirrored borders 20 x 20 pixels of 0.4 mm were .6 % off for skin1.
    """
    covering = checked_support(profile.r_edges_mm[-1], mm_per_pixel, None, dimensions=1)[1]
    return min(covering, max(height, width, _MIN_REACH) - 1)


def reference_quadrant(
    profile: Profile, mm_per_pixel: float, height: int, width: int
) -> tuple[FloatArray, FloatArray]:
    """Return the true kernel for a picture of that size, and the energy outside it.

    Two pixels of a picture are at most max(H, W) - 1 apart along either axis, so light that travels
    farther than that (or 255, in small pictures), or beyond the profile's grid, is left out. Zero
    borders lose nothing; mirror and clamp lack the light of reflections farther out.

    Returns
    -------
    array (h+1, h+1, C), array (C,)
        Energies of the pixels of one quadrant with both axes; diffuse reflectance minus their sum.
    """
    half = reference_half_pixels(profile, mm_per_pixel, height, width)
    quadrant = profile.quadrant_kernel(mm_per_pixel, half)
    copies = np.where(np.arange(half + 1) == 0, 1.0, 2.0)
    energy = np.einsum("i,k,ikc->c", copies, copies, quadrant)
    return quadrant, profile.diffuse_reflectance - energy


def convolve(
    irradiance: FloatArray,
    quadrant: FloatArray,
    *,
    border: str = "mirror",
    threads: int | None = None,
) -> FloatArray:
    """Convolve a picture with an even kernel.

    Parameters
    ----------
    irradiance : array (H, W, 1) or (H, W, C)
        A single channel is transformed once for all channels of the kernel.
    quadrant : array (h+1, h+1, C)
        A quadrant of the kernel with both its axes, as from ``Profile.quadrant_kernel``.
    border, threads
        As `render_reference`.

    Returns
    -------
    array (H, W, C)

    Raises
    ------
    RenderError
        As `render_reference`.
    """
    height, width, given = irradiance.shape
    half, channels = quadrant.shape[0] - 1, quadrant.shape[2]
    check_channels(given, channels)
    workers = thread_count(threads)
    y, x = _plan(height, width, half, channels, border)
    out = np.empty((height, width, channels))
    if given == 1:
        shared = _forward(irradiance[:, :, 0], y, x, workers)
    for c in range(channels):
        spectrum = shared if given == 1 else _forward(irradiance[:, :, c], y, x, workers)
        even = _even_spectrum(quadrant[:, :, c], y, x, workers)
        product = np.empty_like(spectrum) if given == 1 else spectrum
        _multiply(spectrum, even, product)
        out[:, :, c] = _backward(product, y, x, workers)
        del spectrum, product, even  # otherwise they coexist with the next channel's
    return out


def padded_shape(height: int, width: int, half: int, border: str) -> tuple[int, int]:
    """Return the rows and columns that `convolve` transforms for a kernel of half width h."""
    return _axis(height, half, border).length, _axis(width, half, border).length


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class _Axis:
    """One axis of the continued picture: ``size`` pixels from ``start`` on, out of ``length``."""

    size: int
    half: int
    start: int
    length: int
    sources: npt.NDArray[np.intp]

    @property
    def bins(self) -> int:
        """Number of frequencies from 0 to Nyquist's."""
        return self.length // 2 + 1

    @property
    def inside(self) -> slice:
        """Slice of the picture itself."""
        return slice(self.start, self.start + self.size)


def _axis(size: int, half: int, border: str) -> _Axis:
    """Continue an axis by the kernel's half width."""
    from scipy.fft import next_fast_len

    if border == "zero":
        # Beyond size - 1 the kernel meets black only, and both ends share one black margin.
        half = min(half, size - 1)
        start, least = 0, size + half
    else:
        start, least = half, size + 2 * half
    # Twice a fast length: the cosine transform has length / 2 + 1 points.
    length = 2 * next_fast_len(-(-least // 2), real=True)
    return _Axis(size, half, start, length, source_indices(size, start, border))


def _plan(height: int, width: int, half: int, channels: int, border: str) -> tuple[_Axis, _Axis]:
    """Return both axes, if the work on them fits in memory."""
    y, x = _axis(height, half, border), _axis(width, half, border)
    # Three complex half spectra or real arrays of their size; result; kernel. Measured: 0.6 to
    # 1.04 of it.
    spectrum = 16.0 * y.length * x.bins
    check_memory(
        3.0 * spectrum + 8.0 * channels * (height * width + (half + 1.0) ** 2),
        f"{height} x {width} pixels with a kernel of {2 * half + 1} x {2 * half + 1}",
        "render a part of the picture, or with a fitted kernel",
    )
    return y, x


def _forward(plane: FloatArray, y: _Axis, x: _Axis, workers: int) -> ComplexArray:
    """Transform the continued picture: (length of y, bins of x)."""
    from scipy.fft import fft, rfft

    wide = np.zeros((y.size, x.length))
    wide[:, x.inside] = plane
    # Copy the margins only, from contiguous memory: taking all columns from RGB took 60 ms for 2048
    # x 2048 pixels, as long as the transforms.
    for margin in (slice(0, x.start), slice(x.start + x.size, x.sources.size)):
        wide[:, margin] = np.take(wide, x.start + x.sources[margin], axis=1)
    rows = rfft(wide, axis=1, workers=workers, overwrite_x=True)
    spectrum = np.empty((y.length, x.bins), dtype=np.complex128)
    spectrum[y.sources.size :] = 0.0
    # "clip": with the default, numpy builds the rows in a temporary array and copies them.
    np.take(rows, y.sources, axis=0, out=spectrum[: y.sources.size], mode="clip")
    transformed: ComplexArray = fft(spectrum, axis=0, workers=workers, overwrite_x=True)
    return transformed


def _even_spectrum(quadrant: FloatArray, y: _Axis, x: _Axis, workers: int) -> FloatArray:
    """Return the spectrum of an even kernel, (bins of y, bins of x): real, by the DCT-I."""
    from scipy.fft import dct

    seen = np.ascontiguousarray(quadrant[: y.half + 1, : x.half + 1])
    along_x = dct(seen, type=1, n=x.bins, axis=1, workers=workers)
    spectrum: FloatArray = dct(along_x, type=1, n=y.bins, axis=0, workers=workers)
    return spectrum


def _multiply(spectrum: ComplexArray, even: FloatArray, product: ComplexArray) -> None:
    """Multiply into ``product``; rows past Nyquist's are those before it in reverse order."""
    n = len(even)
    np.multiply(spectrum[:n], even, out=product[:n])
    np.multiply(spectrum[n:], even[-2:0:-1], out=product[n:])


def _backward(spectrum: ComplexArray, y: _Axis, x: _Axis, workers: int) -> FloatArray:
    """Transform back the part inside the picture, (H, W); ``spectrum`` is overwritten."""
    from scipy.fft import ifft, irfft

    rows = ifft(spectrum, axis=0, workers=workers, overwrite_x=True)[y.inside]
    plane: FloatArray = irfft(rows, n=x.length, axis=1, workers=workers)[:, x.inside]
    return plane
