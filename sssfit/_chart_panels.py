"""Pictures and differences as every sheet of them draws: pixel for pixel, with a scale."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from sssfit._chart_page import drawable
from sssfit._chart_style import WIDTH_INCHES
from sssfit._profile_bins import FloatArray

# Red where there is too much light, blue where too little: told apart by the colour blind too.
_SHADES = "RdBu_r"
_BAR_INCHES = 0.09
_LIGHTEST = 100.0  # of CIE L*: a difference amplified once goes from black to white


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
    tall = inches * shape[0] / shape[1]
    height = figure.get_figheight()
    box = (left / WIDTH_INCHES, 1 - (down + tall) / height, inches / WIDTH_INCHES, tall / height)
    axes = figure.add_axes(box)
    axes.set_axis_off()
    return axes
