"""A table of taps, stage by stage, as a figure: `taps_figure`.

``sssfit.compare.taps_view`` computes the record.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, cast

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D

from sssfit.arrays import FloatArray
from sssfit.chart.page import (
    COLOURS,
    LINE_STYLES,
    LINE_WIDTH,
    Style,
    add_legend,
    name_axes,
    new_mosaic,
    new_page,
    put_picture,
    tick,
    tick_decades,
)
from sssfit.chart.text import method_name, shortened
from sssfit.messages import counted
from sssfit.profile import full_kernel

if TYPE_CHECKING:
    from sssfit.compare.taps_view import TapsView

_DECADES = 6  # of the pictures' brightness and of the slices
_COLOURS = 3  # channels that are a colour, and the most whose sums are drawn
_MOST_COLUMNS = 4
_TRUE: Style = {"color": "black", "linestyle": (0, (1, 1.5)), "lw": 1.3}


def taps_figure(view: TapsView) -> Figure:
    """Draw one point of light as it grows stage by stage, and slices of the stages.

    Parameters
    ----------
    view : TapsView

    Returns
    -------
    matplotlib.figure.Figure
        8 inches wide: the picture of one lit pixel after each stage, its brightness over six
        decades; below it, along the axis, what each stage adds in the channel that reaches
        farthest, and the sum of all channels beside the profile's kernel, where it is known.
    """
    taps = view.taps
    count = len(view.stages)
    pictures = count + (view.truth is not None)
    rows = math.ceil(pictures / _MOST_COLUMNS)
    columns = math.ceil(pictures / rows)
    side = 7.8 / columns  # of a picture, in inches
    height = 4.4 + side * 1.1 * rows
    with new_page(height, _title(view), _subtitle(view), _notes(view)) as (figure, below):
        upper, lower = cast(Any, below.subfigures(2, height_ratios=(side * 1.1 * rows, 3.2)))
        _draw_pictures(upper, view, columns, rows)
        labels = ["irradiance", *(f"stage {k}" for k in range(1, count))]
        handles = [Line2D([], [], **_stage_style(k, count)) for k in range(count)]
        handles.append(Line2D([], [], **_TRUE))
        known = view.truth is not None
        lower = add_legend(lower, handles[: count + known], [*labels, "profile"][: count + known])
        left, right = lower.subplots(1, 2, sharex=True, sharey=True)
        widest = _widest(view)
        name = shortened(taps.channels[widest])
        _draw_stages(left, view, widest)
        _draw_sums(right, view)
        name_axes(left, f"(a) what each stage adds, {name}", "distance (mm)", "per pixel")
        name_axes(right, "(b) their sum, by channel", "distance (mm)", "")
    return figure


def _title(view: TapsView) -> str:
    material = view.taps.meta.get("material")
    name = f"{shortened(str(material), 24)}: " if material else ""
    return f"{name}{shortened(view.taps.method, 24)} {view.taps.structure}, stage by stage"


def _subtitle(view: TapsView) -> str:
    taps = view.taps
    parts = [
        f"{counted(taps.fetches, 'fetch', '.4g')} a pixel in {counted(taps.passes, 'pass')}",
        f"pixels of {taps.mm_per_pixel:.4g} mm",
    ]
    if method := taps.meta.get("profile_method"):
        parts.append(f"profile: {method_name(method)}")
    return " · ".join(parts)


def _notes(view: TapsView) -> list[str]:
    """Return what the pictures show."""
    side = (2 * _shown_pixels(view) + 1) * view.taps.mm_per_pixel
    notes = [
        f"Pictures: one lit pixel in the middle of {side:.3g} mm after each stage; brightness is "
        f"the logarithm over {_DECADES} decades."
    ]
    if len(view.channels) not in (1, _COLOURS):
        notes.append(f"Pictures show {shortened(view.channels[_widest(view)])}.")
    if (left := len(view.channels) - _COLOURS) > 0:
        notes.append(f"(b) leaves out {counted(left, 'channel')} between those drawn.")
    return notes


def _widest(view: TapsView) -> int:
    """Return the channel of which the last stage has the largest share."""
    return int(np.argmax(view.taps.blend[-1] / np.maximum(view.taps.energy, 1e-300)))


def _shown_pixels(view: TapsView) -> int:
    """Return how far from the middle the sum is within the scale, at least 4 pixels."""
    middle = view.half_pixels
    line = view.stages.sum(axis=0)[middle, middle:].max(axis=1)
    last = int(np.flatnonzero(line > line[0] * 10.0**-_DECADES)[-1])
    return min(max(last + 1, 4), middle)


def _draw_pictures(upper: SubFigure, view: TapsView, columns: int, rows: int) -> None:
    """Draw the sum of the first stages, for each number of them."""
    middle, half, widest = view.half_pixels, _shown_pixels(view), _widest(view)
    kept = slice(middle - half, middle + half + 1)
    sums = list(np.cumsum(view.stages[:, kept, kept], axis=0))
    texts = ["irradiance", *_stage_texts(view)]
    if view.truth is not None:
        true = view.truth[: half + 1, : half + 1]
        sums.append(np.stack([full_kernel(true[:, :, c]) for c in range(true.shape[2])], axis=2))
        texts.append("the profile's kernel")
    top = float(max(each.max() for each in sums)) or 1.0
    gap = 0.16
    axes = new_mosaic(upper, columns * 1.05 - 0.05, rows * (1.0 + gap))
    for k, each in enumerate(sums):
        x, y = k % columns * 1.05, k // columns * (1.0 + gap) + gap
        put_picture(axes, x, y, _shaded(each, top, widest))
        axes.text(x, y - 0.03, texts[k], fontsize=7.5, va="bottom")


def _stage_texts(view: TapsView) -> list[str]:
    """Return each stage's place and width in words."""
    found = []
    for k, stage in enumerate(view.taps.stages, 1):
        size = f", 1/{2**stage.level}" if stage.level else ""
        found.append(f"+ stage {k}: to {float(stage.offsets_mm.max()):.2g} mm{size}")
    return found


def _shaded(light: FloatArray, top: float, channel: int) -> FloatArray:
    """Return sRGB codes (H, W, 3): 0 to 1 over the decades below the brightest.

    Unless there are three channels, they are those of one of them.
    """
    with np.errstate(divide="ignore"):
        codes = 1.0 + np.log10(light / top) / _DECADES
    shown = np.clip(codes, 0.0, 1.0)
    grey = shown.shape[2] != _COLOURS
    return np.repeat(shown[:, :, [channel]], _COLOURS, axis=2) if grey else shown


def _stage_style(stage: int, stages: int) -> Style:
    """Return colour and dashes of a stage, distinguishable without colour too."""
    # The last tenth of viridis is too light on white.
    colour = mpl.colormaps["viridis"](0.9 * stage / (stages - 1))
    return {"color": colour, "linestyle": LINE_STYLES[stage % len(LINE_STYLES)], "lw": LINE_WIDTH}


def _draw_stages(axes: Axes, view: TapsView, channel: int) -> None:
    middle = view.half_pixels
    distance = np.arange(middle + 1) * view.taps.mm_per_pixel
    for k, each in enumerate(view.stages[:, middle, middle:, channel]):
        seen = np.where(each > 0.0, each, np.nan)
        marker: Style = {"marker": "o", "markersize": 3.5} if k == 0 else {}
        axes.plot(distance, seen, **_stage_style(k, len(view.stages)), **marker)
    if view.truth is not None:
        axes.plot(distance, view.truth[0, :, channel], **_TRUE)
    top = float(view.stages.sum(axis=0).max())
    axes.set_yscale("log", nonpositive="clip")
    axes.set_ylim(top * 10.0**-_DECADES, 3.0 * top)
    axes.set_xlim(0.0, distance[_shown_pixels(view)])
    tick(axes.xaxis)
    tick_decades(axes.yaxis, 8)


def _draw_sums(axes: Axes, view: TapsView) -> None:
    middle = view.half_pixels
    distance = np.arange(middle + 1) * view.taps.mm_per_pixel
    count = len(view.channels)
    drawn = np.linspace(0, count - 1, min(count, _COLOURS)).round().astype(int)
    lines = view.stages.sum(axis=0)[middle, middle:][:, drawn].T
    widths = (lines >= 1e-4 * lines[:, :1]).sum(axis=1) * (lines[:, 0] > 0.0)
    rank = np.argsort(np.argsort(-widths, kind="stable")).tolist()
    for k, (c, line) in enumerate(zip(drawn.tolist(), lines, strict=True)):
        style: Style = {"color": COLOURS[k], "linestyle": LINE_STYLES[k], "lw": LINE_WIDTH}
        axes.plot(distance, np.where(line > 0.0, line, np.nan), **style)
        # Each name on its own decade, the widest on the highest: lines of one width would have all
        # names in one place.
        is_above = line >= 0.01 * 0.1 ** rank[k] * line[0]
        place = min(int(np.count_nonzero(is_above)), middle)
        axes.annotate(
            shortened(view.channels[c]),
            (distance[place], line[place]),
            xytext=(4, 3),
            textcoords="offset points",
            color=COLOURS[k],
        )
        if view.truth is not None:
            axes.plot(distance, view.truth[0, :, c], **_TRUE)
