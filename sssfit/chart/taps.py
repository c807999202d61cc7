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
    check_drawn,
    drawable,
    name_axes,
    new_mosaic,
    new_page,
    put_picture,
    tick,
    tick_decades,
)
from sssfit.chart.text import channel_name, method_name, shortened
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
        farthest, and the sum of all channels beside the profile's kernel, where it is known. Stages
        that add nothing, whose light only later ones read, are not drawn.

    Raises
    ------
    ArgumentError
        ``view`` is another record.
    """
    check_drawn(view, "TapsView")
    taps = view.taps
    shown = _shown_stages(view)
    pictures = len(shown) + (view.truth is not None)
    rows = math.ceil(pictures / _MOST_COLUMNS)
    columns = math.ceil(pictures / rows)
    side = min(7.8 / columns, 3.9)  # of a picture, in inches
    height = 4.4 + side * 1.1 * rows
    with new_page(height, _title(view), _subtitle(view), _notes(view)) as (figure, below):
        upper, lower = cast(Any, below.subfigures(2, height_ratios=(side * 1.1 * rows, 3.2)))
        _draw_pictures(upper, view, columns, rows)
        labels = ["irradiance" if k == 0 else f"stage {k}" for k in shown]
        handles = [Line2D([], [], **_stage_style(k, len(view.stages))) for k in shown]
        if view.truth is not None:
            labels.append("profile")
            handles.append(Line2D([], [], **_TRUE))
        lower = add_legend(lower, handles, labels)
        left, right = lower.subplots(1, 2, sharex=True, sharey=True)
        widest = _widest(view)
        name = channel_name(taps.channels, widest)
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
    distance = "the distance of the stage's farthest tap"
    notes.append(f'Over the pictures: "to", {distance}{_sizes(view)}.')
    if still := [k for k in range(len(view.stages)) if k not in _shown_stages(view)]:
        names = ", ".join("irradiance" if k == 0 else f"stage {k}" for k in still)
        notes.append(f"Weight 0 in the sum, so not drawn: {names}.")
    if len(view.channels) not in (1, _COLOURS):
        notes.append(f"Pictures show {channel_name(view.channels, _widest(view))}.")
    if (left := len(view.channels) - _COLOURS) > 0:
        notes.append(f"(b) leaves out {counted(left, 'channel')} between those drawn.")
    return notes


def _sizes(view: TapsView) -> str:
    """Explain the sizes of pixels in the stages' titles, if there are any."""
    levels = [view.taps.stages[k - 1].level for k in _shown_stages(view) if k > 0]
    least = min((each for each in levels if each > 0), default=0)
    times = "twice" if least == 1 else f"{2**least} times"
    return f'; "1/{2**least}", on pixels {times} as large' if least else ""


def _shown_stages(view: TapsView) -> list[int]:
    """Return the stages that add to the sum, 0 for the irradiance; all if none does."""
    adds = np.flatnonzero((view.taps.blend != 0.0).any(axis=1)).tolist()
    return adds or list(range(len(view.stages)))


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
    """Draw the sum of the first stages, for each number of them that adds something."""
    shown = _shown_stages(view)
    middle, half, widest = view.half_pixels, _shown_pixels(view), _widest(view)
    kept = slice(middle - half, middle + half + 1)
    sums = list(np.cumsum(view.stages[shown][:, kept, kept], axis=0))
    texts = [_stage_text(view, k) for k in shown]
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
        text = f"+ {texts[k]}" if 0 < k < len(shown) else texts[k]
        axes.text(x, y - 0.03, text, fontsize=7.5, va="bottom")


def _stage_text(view: TapsView, place: int) -> str:
    """Return a stage's place and width in words."""
    if place == 0:
        return "irradiance"
    stage = view.taps.stages[place - 1]
    size = f", 1/{2**stage.level}" if stage.level else ""
    return f"stage {place}: to {float(stage.offsets_mm.max()):.2g} mm{size}"


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
    """Return colour and dashes of a stage, distinguishable without colour too.

    The irradiance is one point, because it lights one pixel.
    """
    # The last tenth of viridis is too light on white.
    colour = mpl.colormaps["viridis"](0.9 * stage / (stages - 1))
    if stage == 0:
        return {"color": colour, "linestyle": "", "marker": "o", "markersize": 3.5}
    return {"color": colour, "linestyle": LINE_STYLES[stage % len(LINE_STYLES)], "lw": LINE_WIDTH}


def _draw_stages(axes: Axes, view: TapsView, channel: int) -> None:
    middle = view.half_pixels
    distance = np.arange(middle + 1) * view.taps.mm_per_pixel
    top = float(view.stages.sum(axis=0).max())
    for k in _shown_stages(view):
        each = view.stages[k, middle, middle:, channel]
        seen = np.where(each > 0.0, each, np.nan)
        is_inside = k == 0 and each[0] > top * 10.0**-_DECADES  # the point is whole on the axis
        axes.plot(distance, seen, clip_on=not is_inside, **_stage_style(k, len(view.stages)))
    if view.truth is not None:
        axes.plot(distance, view.truth[0, :, channel], **_TRUE)
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
    for k, (c, line) in enumerate(zip(drawn.tolist(), lines, strict=True)):
        style: Style = {"color": COLOURS[k], "linestyle": LINE_STYLES[k], "lw": LINE_WIDTH}
        name = drawable(channel_name(view.channels, c))
        axes.plot(distance, np.where(line > 0.0, line, np.nan), label=name, **style)
        if view.truth is not None:
            axes.plot(distance, view.truth[0, :, c], **_TRUE)
    axes.legend(loc="upper right", handlelength=2.8, labelspacing=0.35)
