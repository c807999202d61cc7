"""A sequence under light that changes, as a figure: `moving_light_figure`.

``sssfit.motion`` computes the record.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, NullLocator

from sssfit.arrays import FloatArray
from sssfit.chart.looks import RENDERERS, spare
from sssfit.chart.page import (
    LINE_WIDTH,
    Style,
    add_legend,
    check_drawn,
    name_axes,
    new_page,
    short_number,
    tick,
    tick_decades,
)
from sssfit.chart.text import powered

if TYPE_CHECKING:
    from sssfit.motion.record import MovingLight, Track

_HEIGHT_INCHES, _LINES_INCHES, _MAPS_INCHES = 9.9, 4.0, 4.7
_ERROR_DECADES, _DECADES = 6.0, 4.0  # most of an error and of a variance that are drawn
_SAMPLE_TICKS = (1, 2, 4, 8, 16, 32, 64)
_LEAST, _MOST = _SAMPLE_TICKS[0], _SAMPLE_TICKS[-1]
_NOTE = (
    "Without noise are the separable kernel and the cascade; all others are one frame's samples, "
    "before any filter over time. Error: root mean square over pixels and channels, against the "
    "true 2D kernel. Shaded behind the lines: the intensity of the light, from 0 up. Variance: "
    "moving, of one sample. Means in the legend leave out the first {} frames."
)


def moving_light_figure(moving: MovingLight) -> Figure:
    """Draw samples and errors over the frames, and maps of samples and variances.

    Parameters
    ----------
    moving : MovingLight

    Returns
    -------
    matplotlib.figure.Figure
        8 x 9.9 inches: fetches a pixel, logarithmic, and error over the light's mean, logarithmic,
        over the frames, with the intensity of the light shaded behind; below, of every adaptive
        sampler, samples and moving variance in the last frame.

    Raises
    ------
    ArgumentError
        ``moving`` is another record.
    """
    check_drawn(moving, "MovingLight")
    adaptive = [each for each in moving.tracks if each.variance is not None]
    title = f"{moving.material}, {moving.scene}: {moving.light} light"
    height = _HEIGHT_INCHES
    with new_page(height, title, _subtitle(moving), [_NOTE.format(moving.cold)]) as (figure, below):
        styles = {each.name: _style(each.name, k) for k, each in enumerate(moving.tracks)}
        handles = [Line2D([], [], **styles[each.name]) for each in moving.tracks]
        below = add_legend(below, handles, [_label(moving, each) for each in moving.tracks])
        ratios = (_LINES_INCHES, _MAPS_INCHES)
        upper, lower = below.subfigures(2, 1, squeeze=False, height_ratios=ratios).ravel()
        _draw_lines(upper, moving, styles)
        _draw_maps(lower, adaptive)
    return figure


def _subtitle(moving: MovingLight) -> str:
    down, right = moving.shift
    moved = f" · each moved {right} right and {down} down" if down or right else ""
    pitch = powered(f"{moving.mm_per_pixel:.4g}")
    return (
        f"{len(moving.intensity)} frames of {moving.width} x {moving.height} pixels of "
        f"{pitch} mm{moved} · target variance {moving.target_variance:g} · seed "
        f"{moving.seed}"
    )


def _label(moving: MovingLight, track: Track) -> str:
    """Return a renderer with its means: fetches and error."""
    share = moving.relative(track)
    error = "" if share is None else powered(f", error {100.0 * share:.3g} %")
    return f"{track.label}: {track.mean_fetches:.3g} fetches{error}"


def _style(name: str, k: int) -> Style:
    """Return a renderer's line; that of the k-th if it has no look of its own."""
    return (RENDERERS.get(name) or spare(name, k)).stroke(LINE_WIDTH)


def _draw_lines(place: SubFigure, moving: MovingLight, styles: dict[str, Style]) -> None:
    """Draw both panels over the frames."""
    above, under = place.subplots(2, 1, sharex=True)
    frames = np.arange(len(moving.intensity), dtype=np.float64)
    level = moving.level or 1.0
    errors = {each.name: np.sqrt(each.mse) / level for each in moving.tracks}
    for each in moving.tracks:
        above.plot(frames, each.fetches, **styles[each.name])
        seen = errors[each.name]
        under.plot(frames, np.where(seen > 0.0, seen, np.nan), **styles[each.name])
    name_axes(above, "(a) fetches of a pixel", "", "samples or fetches")
    name_axes(under, "(b) error of a frame", "frame", "rmse over the light")
    most = max(_MOST, *(float(each.fetches.max()) for each in moving.tracks))
    _log(above, 0.8, 1.4 * most)
    above.set_yticks(_SAMPLE_TICKS, [f"{each:g}" for each in _SAMPLE_TICKS])
    above.yaxis.set_minor_locator(NullLocator())
    largest = max((float(each.max()) for each in errors.values()), default=1.0) or 1.0
    seen = np.concatenate([each[each > 0.0] for each in errors.values()])
    least = float(seen.min()) if seen.size else largest / 10.0
    _log(under, max(0.7 * least, largest / 10.0**_ERROR_DECADES), 1.5 * largest)
    above.set_xlim(0, max(len(frames) - 1, 1))
    tick(under.xaxis)
    for axes in (above, under):
        _shade(axes, frames, moving.intensity)


def _log(axes: Axes, low: float, high: float) -> None:
    axes.set_yscale("log")
    axes.set_ylim(low, high)
    tick_decades(axes.yaxis, 6)
    axes.yaxis.set_major_formatter(FuncFormatter(short_number))


def _shade(axes: Axes, frames: FloatArray, intensity: FloatArray) -> None:
    """Draw the light behind the lines, from 0 to its largest over the panel's height."""
    behind = axes.twinx()
    behind.fill_between(frames, intensity, step="mid", color="#f3ecd2", lw=0)
    behind.set_ylim(0.0, 1.05 * (float(intensity.max()) or 1.0))
    behind.set_yticks([])
    behind.spines[:].set_visible(False)
    behind.grid(visible=False)
    behind.set_zorder(axes.get_zorder() - 1)
    axes.patch.set_visible(False)


def _draw_maps(place: SubFigure, adaptive: list[Track]) -> None:
    """Draw a column for each sampler: its samples, and the variance that asked for them."""
    grid = place.subplots(2, len(adaptive), squeeze=False)
    variances = [np.nan_to_num(np.asarray(each.variance)) for each in adaptive]
    largest = max(float(each.max()) for each in variances) or 1.0
    rows = (
        ("samples, last frame", [np.asarray(each.counts) for each in adaptive], _LEAST, _MOST),
        ("variance of a sample", variances, largest / 10.0**_DECADES, largest),
    )
    for k, (name, pictures, low, high) in enumerate(rows):
        for axes, picture, track in zip(grid[k], pictures, adaptive, strict=True):
            # What is less than the scale shows, 0 too, has its darkest shade.
            image = axes.imshow(
                np.maximum(picture, low),
                norm=LogNorm(low, high),
                cmap="cividis",
                interpolation="nearest",
            )
            axes.set(xticks=[], yticks=[])
            axes.spines[:].set_visible(False)
            axes.grid(visible=False)
            if k == 0:
                axes.set_title(track.label, loc="left")
        bar = place.colorbar(image, ax=list(grid[k]), label=name, shrink=0.9, aspect=14, pad=0.01)
        bar.ax.yaxis.set_minor_locator(NullLocator())
        bar.ax.yaxis.set_major_formatter(FuncFormatter(short_number))
        if k == 0:
            bar.set_ticks(_SAMPLE_TICKS)
