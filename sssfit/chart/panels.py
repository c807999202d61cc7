"""Pictures, planes of kernels and differences as every chart draws them, with their scales."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colorbar import Colorbar
from matplotlib.colors import Normalize, SymLogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from sssfit.arrays import FloatArray
from sssfit.chart.page import WIDTH_INCHES, drawable
from sssfit.profile import full_kernel

# Red where there is too much light, blue where too little: told apart by the colour blind too.
_SHADES = "RdBu_r"
_BAR_INCHES = 0.09
_LIGHTEST = 100.0  # of CIE L*: a difference amplified once goes from black to white
_DECADES = 5  # of energies per pixel, on either side of what is drawn linearly


def draw_picture(
    figure: Figure, left: float, down: float, picture: FloatArray, inches: float
) -> Axes:
    """Put sRGB codes (H, W, 3) that many inches wide at a place in inches from the top left."""
    axes = _place(figure, left, down, picture.shape[:2], inches)
    axes.imshow(np.clip(picture, 0.0, 1.0), interpolation="nearest")
    return axes


def draw_difference(
    figure: Figure,
    left: float,
    down: float,
    difference: FloatArray,
    inches: float,
    amplified: float,
) -> Axes:
    """Put a difference (H, W) of lightness there, white where it is 0."""
    axes = _place(figure, left, down, (difference.shape[0], difference.shape[1]), inches)
    axes.imshow(difference, norm=_norm(amplified), cmap=_SHADES, interpolation="nearest")
    return axes


def draw_bar(
    figure: Figure, left: float, down: float, inches: float, amplified: float, label: str
) -> None:
    """Explain the colours of differences."""
    height = figure.get_figheight()
    box = (left / WIDTH_INCHES, 1 - (down + _BAR_INCHES) / height)
    cax = figure.add_axes((*box, inches / WIDTH_INCHES, _BAR_INCHES / height))
    most = _LIGHTEST / amplified
    bar = figure.colorbar(
        ScalarMappable(_norm(amplified), _SHADES), cax=cax, orientation="horizontal"
    )
    bar.set_ticks([-most, -0.5 * most, 0.0, 0.5 * most, most])
    bar.ax.xaxis.set_major_formatter("{x:g}")
    bar.set_label(drawable(label))


def _norm(amplified: float) -> Normalize:
    return Normalize(-_LIGHTEST / amplified, _LIGHTEST / amplified)


def _place(figure: Figure, left: float, down: float, shape: tuple[int, ...], inches: float) -> Axes:
    """Add axes for rows and columns, without a frame's ticks."""
    axes = place_panel(figure, left, down, inches, inches * shape[0] / shape[1])
    axes.set_axis_off()
    return axes


def place_panel(figure: Figure, left: float, down: float, width: float, tall: float) -> Axes:
    """Add axes, all in inches from the top left corner of the page."""
    height = figure.get_figheight()
    box = (left / WIDTH_INCHES, 1 - (down + tall) / height, width / WIDTH_INCHES, tall / height)
    return figure.add_axes(box)


def draw_plane(
    axes: Axes, quadrant: FloatArray, half_mm: float, norm: Normalize, shades: str
) -> None:
    """Show the whole plane of a quadrant, which reaches so far from the middle to its rim."""
    extent = (-half_mm, half_mm, -half_mm, half_mm)
    axes.imshow(
        full_kernel(quadrant), norm=norm, cmap=shades, extent=extent, interpolation="nearest"
    )
    axes.grid(visible=False)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))


def signed_norm(values: FloatArray, decades: int = _DECADES) -> SymLogNorm:
    """Scale values of either sign: linear about 0, then the decades up to the largest."""
    most = float(np.abs(values).max()) or 1.0
    linear = 10.0 ** (math.floor(math.log10(most)) - decades)
    return SymLogNorm(linear, vmin=-most, vmax=most, base=10)


def tick_powers(bar: Colorbar, norm: SymLogNorm) -> None:
    """Write 0 and two powers of ten on either side of a signed scale."""
    linear, most = round(math.log10(norm.linthresh)), math.floor(math.log10(norm.vmax or 1.0))
    powers = linear + (most - linear) // 2, most
    ticks = [10.0**each for each in powers]
    words = [f"10^{{{each}}}" for each in powers]
    bar.set_ticks([-ticks[1], -ticks[0], 0.0, *ticks])
    bar.set_ticklabels([f"$-{words[1]}$", f"$-{words[0]}$", "0", *(f"${each}$" for each in words)])
    bar.ax.minorticks_off()
