"""A profile drawn like the plots of "Separable Subsurface Scattering", Jimenez et al. 2015.

Supplement G: 2 pi r R_d linear and logarithmic, R_d against mean free paths, and the 2D profile.
"""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogFormatterSciNotation, LogLocator

from sssfit.arrays import FloatArray
from sssfit.chart import text as words
from sssfit.chart.data import Picture, drawn_radius_mm, picture
from sssfit.chart.page import (
    Style,
    add_legend,
    channel_style,
    check_drawn,
    draw_steps,
    lay_out,
    name_axes,
    new_page,
    say_nothing_is_drawn,
    tick,
)
from sssfit.profile import Profile
from sssfit.profile.bins import Bins, mean_free_paths_mm, merged

HEIGHT_INCHES = 6.0
_UNWEIGHTED = r"$R_d$ (1/mm²)"
_DECADES = 10  # most decades of a log axis: a profile without noise would continue to underflow
_GREY_DECADES = 6
_LINEAR_SHARE = 0.995


def profile_figure(profile: Profile) -> Figure:
    """Draw a profile: four plots on one page, with error bands.

    Parameters
    ----------
    profile : Profile
        A profile of any method; error bands and merged annuli only if it has photons.

    Returns
    -------
    matplotlib.figure.Figure
        8 x 6 inches; 2 pi r R_d [1/mm] over r [mm], linear and logarithmic; R_d [1/mm^2] over r in
        mean free paths (in mm if the material is unknown); R_d(x, y) over mm, in colour for three
        channels, else the first channel in shades of grey.

    Raises
    ------
    ArgumentError
        ``profile`` is another record.
    """
    check_drawn(profile, "Profile")
    bins = [merged(profile, channel) for channel in range(profile.n_channels)]
    shown = picture(profile, bins)
    notes = words.footnotes(profile, words.image_note(profile, shown))
    title, subtitle = words.title(profile), words.subtitle(profile)
    with new_page(HEIGHT_INCHES, title, subtitle, notes) as (figure, below):
        below = _draw_legend(below, profile, bins)
        panels = below.subplots(2, 2)
        _draw_linear(panels[0, 0], profile, bins)
        _draw_logarithmic(panels[0, 1], profile, bins)
        _draw_unweighted(panels[1, 0], profile, bins)
        _draw_image(below, panels[1, 1], profile, shown)
        if not profile.diffuse_reflectance.any():
            for axes in panels.flat[:3]:
                say_nothing_is_drawn(axes, words.NO_LIGHT)
        below.align_ylabels(panels)
        lay_out(figure)
        _cut_to_squares(panels[1, 1], shown)
    return figure


def _draw_legend(below: SubFigure, profile: Profile, bins: list[Bins]) -> SubFigure:
    """Draw the legend with channels and totals; return the rest for panels."""
    shown = words.in_legend(profile.n_channels)
    handles = [Line2D([], [], **channel_style(k, profile.n_channels)) for k in shown]
    labels = [words.channel_label(profile, k, is_drawn=bool(bins[k].is_drawn.any())) for k in shown]
    return add_legend(below, handles, labels, title=words.legend_title(profile))


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
    name_axes(axes, *words.of_paths(profile, paths_mm), _UNWEIGHTED)


def _draw_curves(
    axes: Axes, edges: list[FloatArray], values: list[tuple[FloatArray, FloatArray]]
) -> None:
    """Draw a step per bin, and a band of one standard error for the channels in the legend."""
    named = words.in_legend(len(edges))
    for channel, (mean, error) in enumerate(values):
        style = channel_style(channel, len(edges))
        if axes.get_yscale() == "log":
            mean = np.where(mean > 0, mean, np.nan)  # a gap
        if channel not in named:
            draw_steps(axes, mean, edges[channel], lw=0.3, snap=False, color=style["color"])
            continue
        draw_steps(axes, mean, edges[channel], snap=False, **style)
        low, high = mean - error, mean + error
        if np.isfinite(low).any():
            band: Style = {"lw": 0, "alpha": 0.3, "snap": False, "color": style["color"]}
            draw_steps(axes, high, edges[channel], baseline=low, **band)


def _limit_decades(axes: Axes, values: list[FloatArray]) -> float:
    """From the peak down to the least value drawn, or ten decades; returns the bottom."""
    positive = np.concatenate([each[each > 0] for each in values])
    peak = positive.max(initial=0.0) or 1.0
    bottom = max(positive.min(initial=peak), peak * 10.0**-_DECADES) / 2
    axes.set_ylim(bottom, peak * 2)
    axes.yaxis.set_major_locator(LogLocator(numticks=7))
    # Within 1.3 decades 2 and 5 are labelled as well: there may be one power of ten, or none.
    axes.yaxis.set_minor_locator(LogLocator(subs=(2, 5)))
    axes.yaxis.set_minor_formatter(LogFormatterSciNotation(minor_thresholds=(1.3, 1.3)))
    tick(axes.xaxis)
    return float(bottom)


def _draw_image(below: SubFigure, axes: Axes, profile: Profile, shown: Picture) -> None:
    """Fill the panel with the centre of R_d(x, y): in colour, or one channel in shades of grey."""
    if profile.n_channels == 3:
        axes.imshow(shown.screen_colours(), **_placed(shown))
        title = "(d) 2D profile, tone-mapped"
    else:
        peak = shown.per_mm2.max() or 1.0
        scale = LogNorm(max(shown.per_mm2.min(), peak * 10.0**-_GREY_DECADES), peak, clip=True)
        shades = axes.imshow(shown.per_mm2[:, :, 0], cmap="gray", norm=scale, **_placed(shown))
        below.colorbar(shades, ax=axes, label=_UNWEIGHTED, aspect=25)
        title = f"(d) log 2D profile of {words.channel_name(profile.channels, 0)}"
    axes.grid(visible=False)
    tick(axes.xaxis)
    tick(axes.yaxis)
    name_axes(axes, title, "x (mm)", "y (mm)")


def _cut_to_squares(axes: Axes, shown: Picture) -> None:
    """Crop the picture, which is wider than its panel, so that its pixels are square."""
    box = axes.get_window_extent()
    half_width_mm = shown.half_height_mm * box.width / box.height
    axes.set_xlim(-half_width_mm, half_width_mm)


def _placed(shown: Picture) -> Style:
    width, height = shown.half_width_mm, shown.half_height_mm
    extent = (-width, width, -height, height)
    return {"extent": extent, "interpolation": "bilinear", "aspect": "auto"}
