"""A kernel beside the profile that it approximates, as a figure: `kernel_figure`.

``sssfit.compare.kernel_view`` computes the record.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, cast

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.cm import ScalarMappable
from matplotlib.colorbar import Colorbar
from matplotlib.colors import LogNorm, Normalize, SymLogNorm
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.ticker import (
    FixedLocator,
    FuncFormatter,
    LogLocator,
)

from sssfit.arrays import FloatArray
from sssfit.chart.page import (
    COLOURS,
    LINE_STYLES,
    LINE_WIDTH,
    Style,
    add_legend,
    add_table,
    check_drawn,
    draw_plane,
    draw_steps,
    drawable,
    name_axes,
    new_page,
    signed_norm,
    tick_decades,
    tick_powers,
)
from sssfit.chart.text import channel_name, count, method_name, shortened
from sssfit.messages import counted

if TYPE_CHECKING:
    from sssfit.compare.kernel_view import KernelView
    from sssfit.kernel import SeparableKernel

_PASS_INCHES, _ROW_INCHES, _LINE_INCHES = 2.1, 1.76, 0.165  # heights of panels, of the table
_WIDTHS = 4.4  # width of planes and slices together, in images
_MIDDLE = 0.2  # share of a pixel where the step of the middle one begins on a logarithmic axis
_PASS_DECADES, _SLICE_DECADES, _IMAGE_DECADES, _DIFFERENCE_DECADES = 4, 7, 5, 3
_AXIS: Style = {"color": COLOURS[2], "linestyle": "-"}
_DIAGONAL: Style = {"color": COLOURS[0], "linestyle": LINE_STYLES[1]}
_PALE: Style = {"linestyle": "-", "lw": 3.2, "alpha": 0.3}


def kernel_figure(view: KernelView) -> Figure:
    """Draw a kernel's passes, its 2D kernel beside the true one, their difference and slices.

    Parameters
    ----------
    view : KernelView

    Returns
    -------
    matplotlib.figure.Figure
        8 inches wide. For each channel a panel of the passes [1/mm] over the distance from the
        middle [mm], and a row: the profile's energy per area [1/mm^2] and the kernel's, their
        difference in each pixel as a share of the channel's energy, and both along the axis and the
        diagonal. Without a profile only the kernel is drawn.

    Raises
    ------
    ArgumentError
        ``view`` is another record.
    """
    check_drawn(view, "KernelView")
    heads, rows = _table(view)
    labels = _term_labels(view)
    planes = _ROW_INCHES * len(rows) + 0.9  # with their colour bars
    height = 1.4 + _LINE_INCHES * (len(rows) + len(labels) / 2) + _PASS_INCHES + planes
    title, subtitle = _title(view.kernel), _subtitle(view.kernel)
    with new_page(height, title, subtitle, _notes(view)) as (figure, below):
        handles = [Line2D([], [], **_term_style(t, len(labels))) for t in range(len(labels))]
        below = add_legend(add_table(below, heads, rows), handles, labels)
        upper, lower = cast(Any, below.subfigures(2, height_ratios=(_PASS_INCHES, planes)))
        _draw_passes(upper, view)
        _draw_planes(lower, view)
    return figure


def _title(kernel: SeparableKernel) -> str:
    material = kernel.meta.get("material")
    name = f"{shortened(str(material), 24)}: " if material else ""
    terms = counted(kernel.rank, "term")
    return f"{name}{shortened(kernel.method, 24)} kernel, {terms}"


def _subtitle(kernel: SeparableKernel) -> str:
    """Return text about the pixels and the origin of the kernel."""
    meta = kernel.meta
    parts = [f"{kernel.pixels} x {kernel.pixels} pixels of {kernel.mm_per_pixel:.4g} mm"]
    if method := meta.get("profile_method"):
        photons = f", {count(meta['photons'])} photons" if meta.get("photons") else ""
        parts.append(f"profile: {method_name(method)}{photons}")
    if version := meta.get("version"):
        parts.append(f"sssfit {shortened(str(version))}")
    return " · ".join(parts)


def _table(view: KernelView) -> tuple[list[str], list[tuple[str, list[str]]]]:
    """Return the heads, and name and figures of each channel."""
    heads = ["", "energy", "energy error", "Frobenius error", "energy misplaced"]
    columns = (view.energy_error, view.relative_frobenius_error, view.misplaced)
    rows = []
    for k, c in enumerate(view.channels):
        shares = ["" if each is None else _percent(float(each[k])) for each in columns]
        name = channel_name(view.kernel.channels, c)
        rows.append((name, [f"{view.energy[k]:.5f}", *shares]))
    return heads if view.misplaced is not None else [*heads[:4], ""], rows


def _percent(share: float) -> str:
    if math.isnan(share):
        return "unknown"
    if abs(share) < 1e-6:
        return "<0.0001 %"
    percent = 100.0 * share
    if abs(percent) >= 99.5:  # two digits would need an exponent
        return f"{percent:.0f} %"
    return f"{percent:#.2g}".rstrip(".") + " %"


def _term_labels(view: KernelView) -> list[str]:
    """Name each term with its sign, or with the signs of the channels if they differ."""
    kernel = view.kernel
    labels = []
    for t in range(kernel.rank):
        signs = ["+" if kernel.signs[t, c] > 0 else "−" for c in view.channels]  # noqa: RUF001
        said = signs[0]
        if len(set(signs)) > 1:
            names = (channel_name(kernel.channels, c) for c in view.channels)
            said = ", ".join(f"{name} {sign}" for name, sign in zip(names, signs, strict=True))
        labels.append(f"term {t + 1} ({said})")
    return labels


def _term_style(term: int, terms: int) -> Style:
    """Return colour and dashes of a term, distinguishable without colour too."""
    # The last tenth of viridis is too light on white.
    colour = mpl.colormaps["viridis"](0.9 * term / (terms - 1)) if terms > 1 else COLOURS[2]
    width = LINE_WIDTH if terms <= len(LINE_STYLES) else 0.8
    return {"color": colour, "linestyle": LINE_STYLES[term % len(LINE_STYLES)], "lw": width}


def _draw_passes(upper: SubFigure, view: KernelView) -> None:
    """Draw each channel's passes in its own panel, on shared scales."""
    kernel = view.kernel
    half = kernel.weights[:, kernel.half_pixels :][:, :, view.channels] / kernel.mm_per_pixel
    edges = _edges(kernel.half_pixels, kernel.mm_per_pixel)
    panels = upper.subplots(1, len(view.channels), sharex=True, sharey=True, squeeze=False)[0]
    for k, c in enumerate(view.channels):
        axes = panels[k]
        # Set the scales first, because a channel without light has no value for a logarithmic one.
        _scale_distance(axes, edges)
        _scale_passes(axes, half)
        for t in range(kernel.rank):
            draw_steps(axes, half[t, :, k], edges, snap=False, **_term_style(t, kernel.rank))
        title = f"passes, {channel_name(kernel.channels, c)}"
        name_axes(axes, title, "distance from the middle (mm)", "" if k else "weight (1/mm)")


def _scale_passes(axes: Axes, values: FloatArray) -> None:
    """Scale weights logarithmically, on both sides of 0 if there are negative ones."""
    most = float(np.abs(values).max()) or 1.0
    least = most * 10.0**-_PASS_DECADES
    if values.min() >= 0.0:
        axes.set_yscale("log", nonpositive="clip")
        axes.set_ylim(least, 2.0 * most)
        tick_decades(axes.yaxis, 6)
    else:
        axes.set_yscale("symlog", linthresh=least, linscale=0.5)
        low = min(2.0 * float(values.min()), -least)
        axes.set_ylim(low, 2.0 * most)
        _tick_signed(axes.yaxis, least, most, low)
        axes.axhline(0.0, color="#888888", lw=0.5, zorder=1)


def _tick_signed(axis: Axis, least: float, most: float, low: float) -> None:
    """Tick 0 and every second power of ten on either side of it.

    The powers next to 0 are left out if there are decades below it too: labels would touch.
    """
    top = math.floor(math.log10(2.0 * most))
    is_crowded = low < -10.0 * least
    powers = range(top, math.floor(math.log10(least)) + is_crowded, -2)
    ticks = [sign * 10.0**each for each in powers for sign in (-1.0, 1.0)]
    axis.set_major_locator(FixedLocator([0.0, *ticks]))
    axis.set_major_formatter(FuncFormatter(lambda value, _: _power(value)))
    axis.set_minor_locator(FixedLocator([]))


def _power(value: float) -> str:
    if value == 0.0:
        return "0"
    return f"${'-' if value < 0 else ''}10^{{{round(math.log10(abs(value)))}}}$"


def _edges(half_pixels: int, pitch_mm: float) -> FloatArray:
    """Edges of the pixels of a half line (h+2,) [mm]; the middle one reaches a log axis's edge."""
    edges = pitch_mm * (np.arange(half_pixels + 2, dtype=np.float64) - 0.5)
    edges[0] = _MIDDLE * pitch_mm
    return edges


def _scale_distance(axes: Axes, edges: FloatArray) -> None:
    axes.set_xscale("log")
    axes.set_xlim(edges[0], edges[-1])
    tick_decades(axes.xaxis, 5)


def _image_norm(view: KernelView) -> LogNorm:
    """Return one scale for all planes: five decades down from the largest value."""
    most = max(float(each.max()) for each in (view.image, _or_zero(view.true_image))) or 1.0
    return LogNorm(most * 10.0**-_IMAGE_DECADES, most)


def _or_zero(values: FloatArray | None) -> FloatArray:
    return np.zeros(1) if values is None else values


def _draw_planes(lower: SubFigure, view: KernelView) -> None:
    """Draw a row for each channel, with its planes and slices, and the colour bars under them."""
    planes = list(_planes(view))
    norms = _image_norm(view), signed_norm(_or_zero(view.difference), _DIFFERENCE_DECADES)
    rows, widths = len(view.channels), [*[1.0] * len(planes), _WIDTHS - len(planes)]
    panels = lower.subplots(rows, len(widths), squeeze=False, sharex="col", width_ratios=widths)
    names = [channel_name(view.kernel.channels, channel) for channel in view.channels]
    is_long = max(map(len, names)) > 6  # such a name has room beside the images, not over them
    for row, name in enumerate(names):
        for axes, (title, images, is_signed) in zip(panels[row], planes, strict=False):
            _draw_plane(axes, images[row], _half_mm(view), norms[is_signed])
            name_axes(axes, title if is_long else f"{title}, {name}", "", "")
        _draw_slices(panels[row, -1], view, row)
        name_axes(panels[row, -1], f"slices, {name}", "", "per mm²")
        panels[row, 0].set_ylabel(f"{drawable(name)}\ny (mm)" if is_long else "y (mm)")
        panels[row, 0].tick_params(labelleft=True)
    for axes in panels[-1]:
        axes.set_xlabel("x (mm)")
    panels[-1, -1].set_xlabel("distance (mm)")
    _draw_bars(lower, panels, [is_signed for *_, is_signed in planes], norms)


def _draw_plane(axes: Axes, image: FloatArray, half_mm: float, norm: Normalize) -> None:
    """Draw the whole plane of a quadrant, with tick labels in the first column only."""
    if isinstance(norm, LogNorm):
        image = _clamped_to_scale(image, norm)
    axes.set_facecolor("#bbbbbb")  # shown where the logarithm has no value
    draw_plane(axes, image, half_mm, norm, _shades(norm))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(FixedLocator([-_round(half_mm), 0.0, _round(half_mm)]))
        axis.set_major_formatter("{x:g}")
    axes.tick_params(labelleft=False)


def _shades(norm: Normalize) -> str:
    return "RdBu_r" if isinstance(norm, SymLogNorm) else "cividis"


def _clamped_to_scale(image: FloatArray, norm: LogNorm) -> FloatArray:
    """Clip values above 0 to the darkest shade of a scale; the rest is grey."""
    return np.where(image > 0.0, np.maximum(image, norm.vmin or 0.0), 0.0)


def _planes(view: KernelView) -> Iterator[tuple[str, FloatArray, bool]]:
    """Yield title, images (K, m+1, m+1), and whether they are signed."""
    if view.true_image is not None:
        yield "profile", view.true_image, False
    yield "kernel", view.image, False
    if view.difference is not None:
        yield "difference", view.difference, True


def _half_mm(view: KernelView) -> float:
    """Return the distance from the middle to the rim of the images [mm]."""
    return (len(view.image[0]) - 0.5) * view.block * view.kernel.mm_per_pixel


def _round(half_mm: float) -> float:
    """Return the largest 1, 2 or 5 times a power of ten whose label fits inside the rim."""
    most = 0.75 * half_mm
    power = 10.0 ** math.floor(math.log10(most))
    return max(each * power for each in (1.0, 2.0, 5.0) if each * power <= most)


def _draw_slices(axes: Axes, view: KernelView, row: int) -> None:
    """Draw kernel and profile along the axis and the diagonal."""
    kernel = view.kernel
    pitches = kernel.mm_per_pixel, math.sqrt(2.0) * kernel.mm_per_pixel
    slices = (
        (view.true_axis, view.axis, pitches[0], _AXIS, "axis"),
        (view.true_diagonal, view.diagonal, pitches[1], _DIAGONAL, "diagonal"),
    )
    _scale_slices(axes, view)
    for true, ours, pitch, style, name in slices:
        edges = _edges(kernel.half_pixels, pitch)
        if true is not None:
            _draw_steps(axes, true[row], edges, style | _PALE)
        _draw_steps(axes, ours[row], edges, style)
        _draw_steps(axes, -ours[row], edges, style | {"linestyle": LINE_STYLES[3], "lw": 0.8})
        axes.plot([], [], label=name, **style)
    if view.true_axis is not None:
        axes.plot([], [], label="profile (wide)", **(_PALE | {"color": "#666666"}))
    if row == 0:
        axes.legend(loc="lower left", handlelength=2.4, labelspacing=0.25)


def _scale_slices(axes: Axes, view: KernelView) -> None:
    """Scale both axes logarithmically, equally for all channels."""
    kernel = view.kernel
    _scale_distance(axes, _edges(kernel.half_pixels, math.sqrt(2.0) * kernel.mm_per_pixel))
    axes.set_xlim(left=_MIDDLE * kernel.mm_per_pixel)
    axes.set_yscale("log")
    every = (np.abs(view.axis), np.abs(view.diagonal), _or_zero(view.true_axis))
    most = max(float(each.max()) for each in every) or 1.0
    axes.set_ylim(most * 10.0**-_SLICE_DECADES, 3.0 * most)
    tick_decades(axes.yaxis, 5)


def _draw_steps(axes: Axes, values: FloatArray, edges: FloatArray, style: Style) -> None:
    """Draw values above 0 as steps from pixel to pixel."""
    positive = np.where(values > 0.0, values, np.nan)
    draw_steps(axes, positive, edges, snap=False, **style)


def _draw_bars(
    lower: SubFigure,
    panels: npt.NDArray[Any],
    is_signed: list[bool],
    norms: tuple[LogNorm, SymLogNorm],
) -> None:
    """Draw the colour bars of the images, under them."""
    plain = is_signed.count(False)
    bar = _bar(lower, panels[:, :plain], norms[0], "energy per mm²", extend="min")
    bar.ax.xaxis.set_major_locator(LogLocator(numticks=4))
    bar.ax.minorticks_off()
    if any(is_signed):
        label = "share of the channel's energy in a pixel"
        tick_powers(_bar(lower, panels[:, plain:-1], norms[1], label), norms[1])


def _bar(
    lower: SubFigure, beside: npt.NDArray[Any], norm: Normalize, label: str, **style: Any
) -> Colorbar:
    shades = ScalarMappable(norm, _shades(norm))
    bar = lower.colorbar(shades, ax=beside, location="bottom", pad=0.03, aspect=20, **style)
    # That of a narrow bar extends to the right, where there is room.
    bar.set_label(label, loc="left")
    return bar


def _notes(view: KernelView) -> list[str]:
    """Return the notes on the panels."""
    kernel = view.kernel
    scaled = "" if np.all(kernel.scale == 1.0) else "scale times the "
    notes = [
        f"Kernel: {scaled}sum over terms of sign x pass x pass. Steps are pixels; the first is the "
        "middle one."
    ]
    if left := len(kernel.channels) - len(view.channels):
        notes.append(f"Not drawn: {counted(left, 'channel')}.")
    images = [view.image, *([] if view.true_image is None else [view.true_image])]
    if any((each == 0.0).any() for each in images):
        notes.append("Images are grey where there is no light.")
    if any((each < 0.0).any() for each in (view.image, view.axis, view.diagonal)):
        notes.append("Where the kernel is below 0, images are grey, and slices dotted (its size).")
    if view.profile is None:
        notes.append("Errors are those that the fit recorded; there is no profile beside it here.")
    else:
        notes.append(
            "Difference: kernel less profile; red where there is too much light, blue where too "
            "little. Misplaced: half the sum of |difference|."
        )
    if view.block > 1:
        notes.append(f"Images: means over {view.block} x {view.block} pixels.")
    return notes
