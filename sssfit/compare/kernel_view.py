"""A kernel beside the profile it was fitted to: 2D kernels, difference, slices.

``sssfit.chart`` draws the record.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sssfit.arrays import FloatArray, check_record, plain
from sssfit.errors import KernelError
from sssfit.kernel import SeparableKernel
from sssfit.messages import printable, shown
from sssfit.profile import Profile

MOST_CHANNELS = 3
# Of an image's edge: more than a chart prints, so that a kernel of 16 000 pixels makes no more.
_MOST_PIXELS = 600


@dataclass(frozen=True, slots=True, eq=False)
class KernelView:
    """K channels of a kernel, times its scale, on a quadrant of h + 1 pixels.

    Images are means over blocks of ``block`` x ``block`` pixels, m + 1 of them from the middle one
    outwards; slices are of single pixels. Without a profile all of ``true_*``, ``difference`` and
    ``misplaced`` are None.

    Parameters
    ----------
    kernel : SeparableKernel
    profile : Profile or None
        What it is compared with.
    channels : tuple of K int
        Numbers of the kernel's channels.
    block : int
        Odd; 1 up to 600 pixels.
    image, true_image : array (K, m+1, m+1) [1/mm^2]
        Energy per area of the kernel and of the profile.
    difference : array (K, m+1, m+1) [1]
        Kernel less profile in each pixel, as a share of the channel's energy.
    axis, true_axis : array (K, h+1) [1/mm^2]
        Slice along the axis: pixels (i, 0), at i pitches from the middle.
    diagonal, true_diagonal : array (K, h+1) [1/mm^2]
        Slice along the diagonal: pixels (i, i), at sqrt(2) i pitches.
    energy : array (K,) [1]
        Sum of the 2D kernel.
    energy_error, relative_frobenius_error : array (K,) [1]
        Energy against the diffuse reflectance, - 1; ||K - R_d|| / ||R_d|| over the kernel's
        pixels. Without a profile what the fit has recorded; NaN where it has not.
    misplaced : array (K,) [1]
        Half the sum of |K - R_d| over the kernel's pixels, as a share of the channel's energy.
    """

    kernel: SeparableKernel
    profile: Profile | None
    channels: tuple[int, ...]
    block: int
    image: FloatArray
    true_image: FloatArray | None
    difference: FloatArray | None
    axis: FloatArray
    true_axis: FloatArray | None
    diagonal: FloatArray
    true_diagonal: FloatArray | None
    energy: FloatArray
    energy_error: FloatArray
    relative_frobenius_error: FloatArray
    misplaced: FloatArray | None

    def to_dict(self) -> dict[str, Any]:
        """Return the figures of ``sssfit chart --json`` of a kernel: a value for each channel."""
        kernel = self.kernel
        return plain(
            {
                "material": kernel.meta.get("material"),
                "method": kernel.method,
                "rank": kernel.rank,
                "pixels": kernel.pixels,
                "mm_per_pixel": kernel.mm_per_pixel,
                "channels": [kernel.channels[c] for c in self.channels],
                "energy": self.energy,
                "energy_error": self.energy_error,
                "relative_frobenius_error": self.relative_frobenius_error,
                "misplaced": self.misplaced,
            }
        )


def view_kernel(
    kernel: SeparableKernel,
    profile: Profile | None = None,
    *,
    channels: Sequence[str] | None = None,
) -> KernelView:
    """Lay a kernel beside a profile.

    Parameters
    ----------
    kernel : SeparableKernel
    profile : Profile, optional
        With the kernel's channels, by name.
    channels : sequence of str, optional
        Names; by default all of three or fewer, of more the first, the middle and the last.

    Raises
    ------
    KernelError
        The profile has other channels, or there is no such channel.
    ProfileError
        The kernel has too many pixels for the profile's to be computed.

    Examples
    --------
    >>> from sssfit.fit import fit_svd
    >>> from sssfit.material import load_material
    >>> from sssfit.simulate import simulate_exact
    >>> profile = simulate_exact(load_material("skin1"))
    >>> view = view_kernel(fit_svd(profile, mm_per_pixel=0.3).kernel, profile)
    >>> (100 * view.misplaced).round(1).tolist()
    [5.3, 2.6, 1.0]
    """
    check_record("kernel", kernel, SeparableKernel, KernelError)
    check_record("profile", profile, Profile | None, KernelError)
    chosen = _chosen(kernel, channels)
    if profile is not None and profile.channels != kernel.channels:
        raise KernelError(
            f"the kernel has channels {', '.join(kernel.channels)} and the profile "
            f"{', '.join(profile.channels)}; give the profile that the kernel was fitted to."
        )
    area_mm2 = kernel.mm_per_pixel**2
    ours = [kernel.scale[c] * kernel.quadrant(c) / area_mm2 for c in chosen]
    image, axis, diagonal = _images_and_slices(ours, block := _block(kernel.pixels))
    energy = (kernel.scale * kernel.energy)[list(chosen)]
    against = _recorded(kernel, chosen) if profile is None else {}
    if profile is not None:
        total = profile.diffuse_reflectance[list(chosen)]
        pixels = kernel.mm_per_pixel, kernel.half_pixels
        true = [profile.quadrant_kernel(*pixels, channel=c) / area_mm2 for c in chosen]
        against = _compare_with_profile(true, ours, total, block, area_mm2)
        against["energy_error"] = _shares_of(energy - total, total)
    return KernelView(
        kernel=kernel,
        profile=profile,
        channels=chosen,
        block=block,
        image=image,
        axis=axis,
        diagonal=diagonal,
        energy=energy,
        **against,
    )


def _images_and_slices(quadrants: Sequence[FloatArray], block: int) -> tuple[FloatArray, ...]:
    """Return images (K, m+1, m+1), and slices (K, h+1) along the axis and the diagonal."""
    cuts = (lambda each: _blocks(each, block)), (lambda each: each[0]), np.diagonal
    return tuple(np.stack([cut(each) for each in quadrants]) for cut in cuts)


def _recorded(kernel: SeparableKernel, chosen: Sequence[int]) -> dict[str, Any]:
    """Return what a view has without a profile: the errors that the fit recorded."""
    names = ("true_image", "true_axis", "true_diagonal", "difference", "misplaced")
    errors = ("energy_error", "relative_frobenius_error")
    recorded = {name: getattr(kernel, name)[list(chosen)] for name in errors}
    return {**dict.fromkeys(names), **recorded}


def _compare_with_profile(
    true: Sequence[FloatArray],
    ours: Sequence[FloatArray],
    total: FloatArray,
    block: int,
    area_mm2: float,
) -> dict[str, FloatArray]:
    """Return what a view has with a profile; ``total`` (K,) is each channel's energy."""
    apart = [mine - theirs for mine, theirs in zip(ours, true, strict=True)]
    image, axis, diagonal = _images_and_slices(true, block)
    return {
        "true_image": image,
        "true_axis": axis,
        "true_diagonal": diagonal,
        "difference": _shares_of(area_mm2 * _images_and_slices(apart, block)[0], total),
        "relative_frobenius_error": _shares_of(_norms(apart), _norms(true)),
        "misplaced": _shares_of(
            np.array([0.5 * area_mm2 * _sum(np.abs(each)) for each in apart]), total
        ),
    }


def _chosen(kernel: SeparableKernel, names: Sequence[str] | None) -> tuple[int, ...]:
    """Return the indices of channels."""
    if names is None:
        count = len(kernel.channels)
        indices = np.linspace(0, count - 1, min(count, MOST_CHANNELS)).round()
        return tuple(int(each) for each in indices)
    if not isinstance(names, list | tuple) or not names:
        raise KernelError(f"channels = {shown(names)}; expected a list of names, or None for all.")
    for name in names:
        if name not in kernel.channels:
            raise KernelError(
                f"there is no channel {printable(str(name))}; expected one of "
                f"{', '.join(kernel.channels)}."
            )
    return tuple(kernel.channels.index(name) for name in names)


def _block(pixels: int) -> int:
    """Return the least odd number of pixels that make one of an image."""
    return next(width for width in range(1, pixels + 1, 2) if pixels <= width * _MOST_PIXELS)


def _blocks(quadrant: FloatArray, width: int) -> FloatArray:
    """Average over blocks of width x width pixels, the first around the middle one.

    Pixels at the rim that fill no block are left out.
    """
    if width == 1:
        return quadrant
    before = width // 2
    for _ in range(2):  # rows, then columns
        mirrored = np.concatenate((quadrant[before:0:-1], quadrant))
        count = len(mirrored) // width
        whole = mirrored[: count * width].reshape(count, width, -1)
        quadrant = whole.mean(axis=1).T
    return quadrant


def _sum(quadrant: FloatArray) -> float:
    """Sum over the whole plane of a quadrant."""
    copies = np.where(np.arange(len(quadrant)) == 0, 1.0, 2.0)
    return float(copies @ quadrant @ copies)


def _norms(quadrants: Sequence[FloatArray]) -> FloatArray:
    """Return the Frobenius norm of each plane."""
    return np.sqrt([_sum(each**2) for each in quadrants])


def _shares_of(values: FloatArray, totals: FloatArray) -> FloatArray:
    """Divide each channel's values by its total; 0 for a channel without light."""
    shape = (-1, *(1,) * (values.ndim - 1))
    whole = np.broadcast_to(totals.reshape(shape), values.shape)
    return np.divide(values, whole, out=np.zeros_like(values), where=whole > 0.0)
