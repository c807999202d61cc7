"""A profile drawn as the plots of "Separable Subsurface Scattering", Jimenez et al. 2015.

Supplement G: 2 pi r R_d linear and logarithmic, R_d against mean free paths, and the 2D profile.
"""

import math

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogFormatterSciNotation, LogLocator

from sssfit.arrays import FloatArray
from sssfit.chart import text as words
from sssfit.chart.data import Picture, drawn_radius_mm, picture
from sssfit.chart.page import (
    COLOURS,
    HEIGHT_INCHES,
    LEFT,
    LINE_STYLES,
    LINE_WIDTH,
    RC,
    RIGHT,
    ROW_GAP_INCHES,
    TEXT_INCHES,
    WIDTH_INCHES,
    Style,
    chart_style,
    draw_footnotes,
    draw_text,
    drawable,
    inches,
    name_axes,
    new_figure,
    tick,
)
from sssfit.profile import Profile
from sssfit.profile.bins import Bins, mean_free_paths_mm, merged

_UNWEIGHTED = r"$R_d$ (1/mm²)"
_DECADES = 10  # most of a log axis: a profile without noise would go on to underflow
_GREY_DECADES = 6
_LINEAR_SHARE = 0.995


def profile_figure(profile: Profile) -> Figure:
    """Draw a profile: four plots on one page, with error bands.

    Parameters
    ----------
    profile : Profile
        Of any method; error bands and merged annuli only where it has photons.

    Returns
    -------
    matplotlib.figure.Figure
        8 x 6 inches; 2 pi r R_d [1/mm] over r [mm], linear and logarithmic; R_d [1/mm^2] over r in
        mean free paths (in mm where the material is unknown); R_d(x, y) over mm, in colour for
        three channels, else the first channel in shades of grey.
    """
    bins = [merged(profile, channel) for channel in range(profile.n_channels)]
    shown = picture(profile, bins)
    with chart_style():
        figure = new_figure()
        top = _draw_head(figure, profile, bins)
        notes = words.footnotes(profile, words.image_note(profile, shown))
        bottom = draw_footnotes(figure, notes)
        panels = figure.subplots(2, 2)
        height = 0.5 * ((top - bottom) * HEIGHT_INCHES - ROW_GAP_INCHES)
        rows_apart = ROW_GAP_INCHES / height
        figure.subplots_adjust(LEFT, bottom, RIGHT, top, wspace=0.24, hspace=rows_apart)
        _draw_linear(panels[0, 0], profile, bins)
        _draw_logarithmic(panels[0, 1], profile, bins)
        _draw_unweighted(panels[1, 0], profile, bins)
        _draw_image(figure, panels[1, 1], profile, shown)
        figure.align_ylabels(panels)
    return figure


def _draw_head(figure: Figure, profile: Profile, bins: list[Bins]) -> float:
    """Title, provenance and legend; the height of what is left, as a fraction."""
    draw_text(figure, 0.16, words.title(profile), size=12, weight="bold")
    draw_text(figure, 0.41, words.subtitle(profile))
    draw_text(figure, 0.64, words.legend_title(profile), color="#444444", size=8)
    shown = words.in_legend(profile.n_channels)
    handles = [Line2D([], [], **_line_style(k, profile.n_channels)) for k in shown]
    labels = [
        drawable(words.channel_label(profile, k, is_drawn=bool(bins[k].is_drawn.any())))
        for k in shown
    ]
    # 0.6 inches for the line and the gap between columns.
    widest = 0.6 + max(inches(label, RC["font.size"]) for label in labels)
    columns = min(max(int(TEXT_INCHES / widest), 1), 4, len(labels))
    legend = figure.legend(
        handles,
        labels,
        ncols=columns,
        loc="upper left",
        bbox_to_anchor=(LEFT, 1 - 0.71 / HEIGHT_INCHES),
        borderaxespad=0,
        borderpad=0.2,
        handlelength=2.8,
        columnspacing=1.5,
    )
    rows = math.ceil(len(labels) / columns)
    return 1 - (0.98 + 0.18 * rows) / HEIGHT_INCHES


def _line_style(channel: int, n_channels: int) -> Style:
    """Colour and dashes of a channel: told apart without colour as well."""
    dashes = LINE_STYLES[channel % (3 if n_channels <= 3 else len(LINE_STYLES))]
    if n_channels <= len(COLOURS):
        return {"color": COLOURS[channel], "linestyle": dashes}
    # The last tenth of viridis is too light on white.
    return {
        "color": mpl.colormaps["viridis"](0.9 * channel / (n_channels - 1)),
        "linestyle": dashes,
    }


def _draw_linear(axes: Axes, profile: Profile, bins: list[Bins]) -> None:
    _draw_curves(axes, [each.edges_mm for each in bins], [each.per_mm() for each in bins])
    tops = [
        np.nan_to_num(mean + np.nan_to_num(error)).max() for mean, error in map(Bins.per_mm, bins)
    ]
    axes.set_xlim(0, drawn_radius_mm(profile, _LINEAR_SHARE, range(len(bins))))
    axes.set_ylim(0, 1.05 * max(tops) or 1)
    tick(axes.xaxis)
    tick(axes.yaxis)
    reach = f"r to {100 * _LINEAR_SHARE:g} % of the energy on the grid"
    name_axes(axes, f"(a) linear, {reach}", "r (mm)", words.WEIGHTED)


def _draw_logarithmic(axes: Axes, profile: Profile, bins: list[Bins]) -> None:
    axes.set_yscale("log", nonpositive="clip")
    _draw_curves(axes, [each.edges_mm for each in bins], [each.per_mm() for each in bins])
    axes.set_xlim(0, profile.r_edges_mm[-1])
    _limit_decades(axes, [each.per_mm()[0] for each in bins])
    name_axes(axes, "(b) logarithmic, the whole grid", "r (mm)", words.WEIGHTED)


def _draw_unweighted(axes: Axes, profile: Profile, bins: list[Bins]) -> None:
    paths_mm = mean_free_paths_mm(profile)
    units_mm = np.ones(len(bins)) if paths_mm is None else paths_mm
    axes.set_yscale("log", nonpositive="clip")
    edges = [each.edges_mm / unit_mm for each, unit_mm in zip(bins, units_mm, strict=True)]
    values = [each.per_mm2() for each in bins]
    _draw_curves(axes, edges, values)
    bottom = _limit_decades(axes, [mean for mean, _ in values])
    ends = [
        each[1:][mean > bottom].max(initial=0.0)
        for each, (mean, _) in zip(edges, values, strict=True)
    ]
    axes.set_xlim(0, max(ends) or 1)
    if paths_mm is None:
        name_axes(axes, "(c) unweighted", "r (mm; no one mean free path)", _UNWEIGHTED)
    else:
        label = words.path_label(profile, paths_mm)
        name_axes(axes, "(c) unweighted, in mean free paths", label, _UNWEIGHTED)


def _draw_curves(
    axes: Axes, edges: list[FloatArray], values: list[tuple[FloatArray, FloatArray]]
) -> None:
    """Draw a step a bin, and a band of one standard error for the channels in the legend."""
    named = words.in_legend(len(edges))
    for channel, (mean, error) in enumerate(values):
        style = _line_style(channel, len(edges))
        if axes.get_yscale() == "log":
            mean = np.where(mean > 0, mean, np.nan)  # a gap
        if channel not in named:
            axes.stairs(
                mean, edges[channel], baseline=None, lw=0.3, snap=False, color=style["color"]
            )
            continue
        axes.stairs(mean, edges[channel], baseline=None, lw=LINE_WIDTH, snap=False, **style)
        low, high = mean - error, mean + error
        if np.isfinite(low).any():
            band: Style = {
                "fill": True,
                "lw": 0,
                "alpha": 0.3,
                "snap": False,
                "color": style["color"],
            }
            axes.stairs(high, edges[channel], baseline=low, **band)


def _limit_decades(axes: Axes, values: list[FloatArray]) -> float:
    """From the peak down to the least value drawn, or ten decades; returns the bottom."""
    positive = np.concatenate([each[each > 0] for each in values])
    peak = positive.max(initial=0.0) or 1.0
    bottom = max(positive.min(initial=peak), peak * 10.0**-_DECADES) / 2
    axes.set_ylim(bottom, peak * 2)
    axes.yaxis.set_major_locator(LogLocator(numticks=7))
    # Within 1.3 decades 2 and 5 are named as well: there may be one power of ten, or none.
    axes.yaxis.set_minor_locator(LogLocator(subs=(2, 5)))
    axes.yaxis.set_minor_formatter(LogFormatterSciNotation(minor_thresholds=(1.3, 1.3)))
    tick(axes.xaxis)
    return float(bottom)


def _draw_image(figure: Figure, axes: Axes, profile: Profile, shown: Picture) -> None:
    """Fill the panel with the centre of R_d(x, y): in colour, or one channel in shades of grey."""
    box = axes.get_position()
    if profile.n_channels == 3:
        axes.imshow(shown.screen_colours(), **_placed(shown))
        title = "(d) 2D profile, tone-mapped"
    else:
        peak = shown.per_mm2.max() or 1.0
        scale = LogNorm(max(shown.per_mm2.min(), peak * 10.0**-_GREY_DECADES), peak, clip=True)
        shades = axes.imshow(shown.per_mm2[:, :, 0], cmap="gray", norm=scale, **_placed(shown))
        beside = axes.inset_axes((1.03, 0, 0.035, 1))
        figure.colorbar(shades, cax=beside, label=_UNWEIGHTED)
        axes.set_position((box.x0, box.y0, 0.81 * box.width, box.height))
        title = f"(d) log 2D profile of {words.shortened(profile.channels[0])}"
    box = axes.get_position()
    aspect = box.width * WIDTH_INCHES / (box.height * HEIGHT_INCHES)
    axes.set_xlim(-aspect * shown.half_height_mm, aspect * shown.half_height_mm)
    axes.grid(visible=False)
    tick(axes.xaxis)
    tick(axes.yaxis)
    name_axes(axes, title, "x (mm)", "y (mm)")


def _placed(shown: Picture) -> Style:
    width, height = shown.half_width_mm, shown.half_height_mm
    extent = (-width, width, -height, height)
    return {"extent": extent, "interpolation": "bilinear", "aspect": "auto"}
