"""Pictures in a mosaic, planes of kernels and differences, with their colour scales."""

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colorbar import Colorbar
from matplotlib.colors import Normalize, SymLogNorm
from matplotlib.figure import SubFigure
from matplotlib.ticker import MaxNLocator

from sssfit.arrays import FloatArray
from sssfit.profile import full_kernel

# Red where there is too much light, blue where too little, safe for colour blindness.
_SHADES = "RdBu_r"
_LIGHTEST = 100.0  # range of CIE L*: an amplified difference of this size goes from black to white
_DECADES = 5  # decades of energies per pixel, on either side of the linear part


def new_mosaic(below: SubFigure, width: float, height: float) -> Axes:
    """Make a plane for pictures: lengths are in widths of one, y points down, ticks only name."""
    axes = below.subplots()
    axes.set(xlim=(0.0, width), ylim=(height, 0.0), aspect="equal")
    axes.set(xticks=[], yticks=[])
    axes.tick_params(length=0, top=True, labeltop=True, labelbottom=False)
    axes.spines[:].set_visible(False)
    axes.grid(visible=False)
    return axes


def put_picture(axes: Axes, x: float, y: float, picture: FloatArray) -> None:
    """Draw sRGB codes (H, W, 3) with the upper left corner at (x, y)."""
    _put(axes, x, y, np.clip(picture, 0.0, 1.0))


def put_difference(
    axes: Axes, x: float, y: float, difference: FloatArray, amplified: float
) -> None:
    """Draw a difference (H, W) of lightness, white where it is 0."""
    _put(axes, x, y, difference, norm=_norm(amplified), cmap=_SHADES)


def draw_bar(below: SubFigure, axes: Axes, amplified: float, label: str) -> None:
    """Draw the colour bar of differences, under a mosaic."""
    most = _LIGHTEST / amplified
    below.colorbar(
        ScalarMappable(_norm(amplified), _SHADES),
        ax=axes,
        location="bottom",
        label=label,
        ticks=[-most, -0.5 * most, 0.0, 0.5 * most, most],
        format="{x:g}",
        shrink=0.4,
        aspect=35,
        pad=0.1 / axes.get_ylim()[0],  # share of the mosaic's height: a tenth of a picture
    )


def _put(axes: Axes, x: float, y: float, image: FloatArray, **style: Any) -> None:
    extent = (x, x + 1.0, y + image.shape[0] / image.shape[1], y)
    axes.imshow(image, extent=extent, interpolation="nearest", **style)


def _norm(amplified: float) -> Normalize:
    return Normalize(-_LIGHTEST / amplified, _LIGHTEST / amplified)


def draw_plane(
    axes: Axes, quadrant: FloatArray, half_mm: float, norm: Normalize, shades: str
) -> None:
    """Draw the whole plane of a quadrant with this half width."""
    extent = (-half_mm, half_mm, -half_mm, half_mm)
    axes.imshow(
        full_kernel(quadrant), norm=norm, cmap=shades, extent=extent, interpolation="nearest"
    )
    axes.grid(visible=False)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))


def signed_norm(values: FloatArray, decades: int = _DECADES) -> SymLogNorm:
    """Return a scale for signed values: linear around 0, then decades up to the largest."""
    most = float(np.abs(values).max()) or 1.0
    linear = 10.0 ** (math.floor(math.log10(most)) - decades)
    return SymLogNorm(linear, vmin=-most, vmax=most, base=10)


def tick_powers(bar: Colorbar, norm: SymLogNorm) -> None:
    """Label 0 and powers of ten: the largest on either side, one more above 0."""
    linear, most = round(math.log10(norm.linthresh)), math.floor(math.log10(norm.vmax or 1.0))
    middle = linear + (most - linear) // 2
    bar.set_ticks([-(10.0**most), 0.0, 10.0**middle, 10.0**most])
    bar.set_ticklabels([f"$-10^{{{most}}}$", "0", f"$10^{{{middle}}}$", f"$10^{{{most}}}$"])
    bar.ax.minorticks_off()
