"""A kernel beside the profile it was fitted to, as a figure: `kernel_figure`.

The record comes from ``sssfit.compare.kernel_view``, which has computed everything.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, Normalize, SymLogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import (
    FixedLocator,
    FuncFormatter,
    LogLocator,
    NullFormatter,
)

from sssfit.arrays import FloatArray
from sssfit.chart.page import (
    COLOURS,
    LEFT,
    LINE_STYLES,
    LINE_WIDTH,
    RC,
    RIGHT,
    TEXT_INCHES,
    WIDTH_INCHES,
    Style,
    chart_style,
    draw_footnotes,
    draw_text,
    drawable,
    fitting,
    inches,
    name_axes,
    new_figure,
)
from sssfit.chart.panels import draw_plane, place_panel, signed_norm, tick_powers
from sssfit.chart.text import count, method_name, shortened

if TYPE_CHECKING:
    from sssfit.compare.kernel_view import KernelView
    from sssfit.kernel import SeparableKernel

_LEFT_INCHES, _RIGHT_INCHES = LEFT * WIDTH_INCHES, RIGHT * WIDTH_INCHES
_TABLE_INCHES, _LEGEND_INCHES = 0.165, 0.18
_COLUMNS = (0.25, 0.42, 0.60, 0.79)  # of the width: the table's figures
_PASS_INCHES, _PASS_GAP = 1.45, 0.12
_IMAGE_INCHES, _IMAGE_GAP = 1.42, 0.1  # a square
_ROW_INCHES = _IMAGE_INCHES + 0.33
_SLICE_GAP = 0.66  # for the slices' numbers and name
_BAR_INCHES = 0.09
_BAR_DOWN = 0.6  # under the last row: room for the name of x
_FOOT_INCHES = 0.7  # under the bars: their numbers and names, and a margin
_NOTE_INCHES = 0.145
_MIDDLE = 0.2  # of a pixel: where the step of the middle one begins on a logarithmic axis
_PASS_DECADES, _SLICE_DECADES, _IMAGE_DECADES, _DIFFERENCE_DECADES = 4, 7, 5, 3
_SHADES, _SIGNED_SHADES = "cividis", "RdBu_r"
_AXIS: Style = {"color": COLOURS[2], "linestyle": "-"}
_DIAGONAL: Style = {"color": COLOURS[0], "linestyle": LINE_STYLES[1]}
_PALE: Style = {"linestyle": "-", "lw": 3.2, "alpha": 0.3}


def kernel_figure(view: KernelView) -> Figure:
    """Draw a kernel's passes, its plane beside the true one, their difference and slices.

    Parameters
    ----------
    view : KernelView

    Returns
    -------
    matplotlib.figure.Figure
        8 inches wide. For each channel a panel of the passes [1/mm] over the distance from the
        middle [mm], and a row: the profile's energy per area [1/mm^2] and the kernel's, their
        difference in each pixel as a share of the channel's energy, and both along the axis and
        the diagonal. Without a profile only what is the kernel's.
    """
    rows = len(view.channels)
    labels = _term_labels(view)
    columns = _legend_columns(labels)
    passes = 1.04 + _TABLE_INCHES * rows + _LEGEND_INCHES * math.ceil(len(labels) / columns)
    images = passes + _PASS_INCHES + 0.78
    bars = images + _ROW_INCHES * (rows - 1) + _IMAGE_INCHES + _BAR_DOWN
    notes = _notes(view)
    with chart_style():
        figure = new_figure(bars + _FOOT_INCHES + _NOTE_INCHES * len(notes))
        _draw_head(figure, view)
        draw_footnotes(figure, notes)
        _draw_terms(figure, labels, columns, 0.84 + _TABLE_INCHES * rows)
        _draw_passes(figure, view, passes)
        norms = _image_norm(view), signed_norm(_or_zero(view.difference), _DIFFERENCE_DECADES)
        for row in range(rows):
            _draw_row(figure, view, row, images + _ROW_INCHES * row, norms)
        _draw_bars(figure, view, bars, norms)
    return figure


def _draw_head(figure: Figure, view: KernelView) -> None:
    """Title, provenance and a table: a line for each channel."""
    kernel = view.kernel
    draw_text(figure, 0.16, _title(kernel), size=12, weight="bold")
    draw_text(figure, 0.41, _subtitle(kernel))
    heads, rows = _table(view)
    for left, head in zip(_COLUMNS, heads, strict=True):
        draw_text(figure, 0.68, head, left=left, color="#444444", size=8)
    for k, (name, figures) in enumerate(rows, 1):
        draw_text(figure, 0.68 + _TABLE_INCHES * k, name)
        for left, each in zip(_COLUMNS, figures, strict=True):
            draw_text(figure, 0.68 + _TABLE_INCHES * k, each, left=left, size=8)


def _title(kernel: SeparableKernel) -> str:
    material = kernel.meta.get("material")
    name = f"{shortened(str(material), 24)}: " if material else ""
    terms = f"{kernel.rank} term{'s' if kernel.rank > 1 else ''}"
    return f"{name}{shortened(kernel.method, 24)} kernel, {terms}"


def _subtitle(kernel: SeparableKernel) -> str:
    """Say which pixels it is on, and what it was made from."""
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
    heads = ["energy", "energy error", "Frobenius error", "energy misplaced"]
    columns = (view.energy_error, view.relative_frobenius_error, view.misplaced)
    rows = []
    for k, c in enumerate(view.channels):
        shares = ["" if each is None else _percent(float(each[k])) for each in columns]
        name = shortened(view.kernel.channels[c])
        rows.append((name, [f"{view.energy[k]:.5f}", *shares]))
    return heads if view.misplaced is not None else [*heads[:3], ""], rows


def _percent(share: float) -> str:
    if math.isnan(share):
        return "unknown"
    return "<0.0001 %" if abs(share) < 1e-6 else f"{100.0 * share:.2g} %"


def _term_labels(view: KernelView) -> list[str]:
    """Name each term with its sign, or the signs of the channels where they differ."""
    kernel = view.kernel
    labels = []
    for t in range(kernel.rank):
        signs = ["+" if kernel.signs[t, c] > 0 else "−" for c in view.channels]  # noqa: RUF001
        said = signs[0]
        if len(set(signs)) > 1:
            names = (shortened(kernel.channels[c]) for c in view.channels)
            said = ", ".join(f"{name} {sign}" for name, sign in zip(names, signs, strict=True))
        labels.append(f"term {t + 1} ({said})")
    return labels


def _legend_columns(labels: Sequence[str]) -> int:
    # 0.6 inches for the line and the gap between columns.
    widest = 0.6 + max(inches(each, RC["font.size"]) for each in labels)
    rows = math.ceil(len(labels) / max(int(TEXT_INCHES / widest), 1))
    return math.ceil(len(labels) / rows)


def _draw_terms(figure: Figure, labels: Sequence[str], columns: int, down: float) -> None:
    """Explain the lines of the passes, so many inches down the page."""
    handles = [Line2D([], [], **_term_style(t, len(labels))) for t in range(len(labels))]
    figure.legend(
        handles,
        [drawable(each) for each in labels],
        ncols=columns,
        loc="upper left",
        bbox_to_anchor=(LEFT, 1 - down / figure.get_figheight()),
        borderaxespad=0,
        borderpad=0.2,
        handlelength=2.8,
        columnspacing=1.5,
    )


def _term_style(term: int, terms: int) -> Style:
    """Colour and dashes of a term: told apart without colour as well."""
    # The last tenth of viridis is too light on white.
    colour = mpl.colormaps["viridis"](0.9 * term / (terms - 1)) if terms > 1 else COLOURS[2]
    width = LINE_WIDTH if terms <= len(LINE_STYLES) else 0.8
    return {"color": colour, "linestyle": LINE_STYLES[term % len(LINE_STYLES)], "lw": width}


def _draw_passes(figure: Figure, view: KernelView, down: float) -> None:
    """Draw each channel's passes in a panel of its own, on scales that all share."""
    kernel, n = view.kernel, len(view.channels)
    half = kernel.weights[:, kernel.half_pixels :][:, :, view.channels] / kernel.mm_per_pixel
    width = (_RIGHT_INCHES - _LEFT_INCHES - _PASS_GAP * (n - 1)) / n
    edges = _edges(kernel.half_pixels, kernel.mm_per_pixel)
    for k, c in enumerate(view.channels):
        left = _LEFT_INCHES + k * (width + _PASS_GAP)
        axes = place_panel(figure, left, down, width, _PASS_INCHES)
        # Scales first: a channel without light has nothing that a logarithmic one could fit.
        _scale_distance(axes, edges)
        _scale_passes(axes, half)
        for t in range(kernel.rank):
            axes.stairs(
                half[t, :, k], edges, baseline=None, snap=False, **_term_style(t, kernel.rank)
            )
        title = f"passes, {shortened(kernel.channels[c])}"
        name_axes(axes, title, "distance from the middle (mm)", "" if k else "weight (1/mm)")
        axes.tick_params(labelleft=k == 0)


def _scale_passes(axes: Axes, values: FloatArray) -> None:
    """Scale weights logarithmically, on either side of 0 where there are some on either side."""
    most = float(np.abs(values).max()) or 1.0
    least = most * 10.0**-_PASS_DECADES
    if values.min() >= 0.0:
        axes.set_yscale("log", nonpositive="clip")
        axes.set_ylim(least, 2.0 * most)
        _tick_decades(axes.yaxis, 6)
    else:
        axes.set_yscale("symlog", linthresh=least, linscale=0.5)
        axes.set_ylim(min(2.0 * float(values.min()), -least), 2.0 * most)
        _tick_signed(axes.yaxis, least, most)
        axes.axhline(0.0, color="#888888", lw=0.5, zorder=1)


def _tick_signed(axis: Axis, least: float, most: float) -> None:
    """Tick 0 and every second power of ten on either side of it."""
    top = math.floor(math.log10(2.0 * most))
    powers = range(top, math.floor(math.log10(least)), -2)
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
    _tick_decades(axes.xaxis, 5)


def _tick_decades(axis: Axis, most: int) -> None:
    """Tick powers of ten; 2 and 5 have numbers too where an axis with limits is short."""
    axis.set_major_locator(LogLocator(numticks=most))
    axis.set_minor_locator(LogLocator(subs=(2, 5)))
    low, high = axis.get_view_interval()
    axis.set_minor_formatter("{x:g}" if math.log10(high / low) < 1.3 else NullFormatter())


def _image_norm(view: KernelView) -> LogNorm:
    """One scale for all planes: five decades down from the largest."""
    most = max(float(each.max()) for each in (view.image, _or_zero(view.true_image))) or 1.0
    return LogNorm(most * 10.0**-_IMAGE_DECADES, most)


def _or_zero(values: FloatArray | None) -> FloatArray:
    return np.zeros(1) if values is None else values


def _draw_row(
    figure: Figure, view: KernelView, row: int, down: float, norms: tuple[LogNorm, SymLogNorm]
) -> None:
    """Draw a channel's planes and slices, their top so many inches down the page."""
    is_last = row == len(view.channels) - 1
    name = shortened(view.kernel.channels[view.channels[row]])
    for k, (title, images, is_signed) in enumerate(_planes(view)):
        axes = place_panel(figure, _left(k), down, _IMAGE_INCHES, _IMAGE_INCHES)
        shades = _SIGNED_SHADES if is_signed else _SHADES
        seen = images[row] if is_signed else _clamped_to_scale(images[row], norms[0])
        axes.set_facecolor("#bbbbbb")  # seen where the logarithm has no value
        draw_plane(axes, seen, _half_mm(view), norms[is_signed], shades)
        titles = f"{title}, {name}", title
        title = fitting(titles, RC["axes.titlesize"], _IMAGE_INCHES)
        name_axes(axes, title, "x (mm)" if is_last else "", "" if k else "y (mm)")
        axes.tick_params(labelleft=k == 0, labelbottom=is_last)
        ticks = [-_round(_half_mm(view)), 0.0, _round(_half_mm(view))]
        axes.set_xticks(ticks)
        axes.set_yticks(ticks)
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_formatter("{x:g}")
    left = _left(len(list(_planes(view)))) - _IMAGE_GAP + _SLICE_GAP
    axes = place_panel(figure, left, down, _RIGHT_INCHES - left, _IMAGE_INCHES)
    _draw_slices(axes, view, row)
    name_axes(axes, f"slices, {name}", "distance (mm)" if is_last else "", "")
    axes.set_ylabel("per mm²")
    axes.tick_params(which="both", labelbottom=is_last)


def _clamped_to_scale(image: FloatArray, norm: LogNorm) -> FloatArray:
    """Bring what is below a scale, but above 0, to its darkest shade; the rest is grey."""
    return np.where(image > 0.0, np.maximum(image, norm.vmin or 0.0), 0.0)


def _planes(view: KernelView) -> Iterator[tuple[str, FloatArray, bool]]:
    """Yield title, images (K, m+1, m+1), and whether they have a sign."""
    if view.true_image is not None:
        yield "profile", view.true_image, False
    yield "kernel", view.image, False
    if view.difference is not None:
        yield "difference", view.difference, True


def _left(column: int) -> float:
    """Where a column of images begins [inches]."""
    return _LEFT_INCHES + column * (_IMAGE_INCHES + _IMAGE_GAP)


def _half_mm(view: KernelView) -> float:
    """Distance from the middle to the rim of the images [mm]."""
    return (len(view.image[0]) - 0.5) * view.block * view.kernel.mm_per_pixel


def _round(half_mm: float) -> float:
    """Return the largest 1, 2 or 5 times a power of ten whose number stays clear of the rim."""
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
        axes.legend(loc="lower left", fontsize=7.5, handlelength=2.4, labelspacing=0.25)


def _scale_slices(axes: Axes, view: KernelView) -> None:
    """Scale both axes logarithmically, alike for all channels."""
    kernel = view.kernel
    _scale_distance(axes, _edges(kernel.half_pixels, math.sqrt(2.0) * kernel.mm_per_pixel))
    axes.set_xlim(left=_MIDDLE * kernel.mm_per_pixel)
    axes.set_yscale("log")
    every = (np.abs(view.axis), np.abs(view.diagonal), _or_zero(view.true_axis))
    most = max(float(each.max()) for each in every) or 1.0
    axes.set_ylim(most * 10.0**-_SLICE_DECADES, 3.0 * most)
    _tick_decades(axes.yaxis, 5)


def _draw_steps(axes: Axes, values: FloatArray, edges: FloatArray, style: Style) -> None:
    """Draw what is above 0 as steps from pixel to pixel."""
    positive = np.where(values > 0.0, values, np.nan)
    axes.stairs(positive, edges, baseline=None, snap=False, **style)


def _draw_bars(
    figure: Figure, view: KernelView, down: float, norms: tuple[LogNorm, SymLogNorm]
) -> None:
    """Explain the colours of the images, under them."""
    planes = [is_signed for *_, is_signed in _planes(view)]
    plain = planes.count(False)
    wide = _left(plain) - _IMAGE_GAP - _LEFT_INCHES
    _draw_bar(figure, _LEFT_INCHES, down, wide, norms[0], "energy per mm²")
    if any(planes):
        left = _left(plain)
        label = "difference: energy per pixel, of the channel's"
        _draw_bar(figure, left + 0.12, down, _IMAGE_INCHES + 0.9, norms[1], label)


def _draw_bar(
    figure: Figure, left: float, down: float, width: float, norm: Normalize, label: str
) -> None:
    axes = place_panel(figure, left, down, width, _BAR_INCHES)
    shades = _SIGNED_SHADES if isinstance(norm, SymLogNorm) else _SHADES
    extend = "neither" if isinstance(norm, SymLogNorm) else "min"
    mappable = ScalarMappable(norm, shades)
    bar = figure.colorbar(mappable, cax=axes, orientation="horizontal", extend=extend)
    bar.set_label(label)
    if isinstance(norm, SymLogNorm):
        tick_powers(bar, norm)
    else:
        bar.ax.xaxis.set_major_locator(LogLocator(numticks=4))
        bar.ax.minorticks_off()


def _notes(view: KernelView) -> list[str]:
    """Say what is drawn, and how to read it."""
    kernel = view.kernel
    scaled = "" if np.all(kernel.scale == 1.0) else "scale times the "
    notes = [
        f"Kernel: {scaled}sum over terms of sign x pass x pass. Steps are pixels; the first is the "
        "middle one."
    ]
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
