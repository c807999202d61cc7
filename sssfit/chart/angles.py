"""R_d by exit angle, beside Lambert's law under Fresnel's, as a figure: `angles_figure`.

``sssfit.profile.directions`` computes the record.
"""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from sssfit.chart.page import (
    Style,
    add_legend,
    channel_style,
    check_drawn,
    draw_curve,
    name_axes,
    new_page,
    tick,
)
from sssfit.chart.text import (
    channel_label,
    channel_names,
    in_legend,
    kind_of_error,
    left_out_note,
    legend_title,
    subtitle,
    titled,
)
from sssfit.messages import by_channel
from sssfit.profile.directions import AngularReflectance

HEIGHT_INCHES = 4.4
_LAMBERT: Style = {"color": "0.45", "lw": 1.2, "linestyle": (0, (1, 1.2))}
_LEAST, _MOST = 0.5, 2.0  # ends of the ratio's ordinate: noise of nearly grazing bins is cut


def angles_figure(found: AngularReflectance) -> Figure:
    """Draw R_d(alpha) of each channel, and its ratio to cos alpha times Fresnel's transmittance.

    Parameters
    ----------
    found : AngularReflectance
        If it has more than eight channels, eight from the first to the last are drawn.

    Returns
    -------
    matplotlib.figure.Figure
        8 x 4.4 inches; bands of one standard or estimated error.

    Raises
    ------
    ArgumentError
        ``found`` is another record.
    """
    check_drawn(found, "AngularReflectance")
    profile = found.profile
    shown = in_legend(profile.n_channels)
    title = titled(profile, "light by exit angle")
    notes = [_note(found), *left_out_note(profile.n_channels - len(shown))]
    with new_page(HEIGHT_INCHES, title, subtitle(profile), notes) as (figure, below):
        styles = [channel_style(c, profile.n_channels) for c in shown]
        handles = [Line2D([], [], **each) for each in (*styles, _LAMBERT)]
        labels = [channel_label(profile, c, is_drawn=True) for c in shown] + ["Lambert, Fresnel"]
        rest = add_legend(below, handles, labels, title=legend_title(profile))
        left, right = rest.subplots(1, 2)
        x = found.angles_deg
        for c, style in zip(shown, styles, strict=True):
            lambertian, error = found.lambertian[:, c], found.per_sr_stderr[:, c]
            left.plot(x, lambertian, **_LAMBERT)
            draw_curve(left, x, found.per_sr[:, c], error, style)
            scale = np.where(lambertian > 0.0, lambertian, np.inf)
            draw_curve(right, x, found.ratio[:, c], error / scale, style)
        right.axhline(1.0, **_LAMBERT)
        _limit(left, right, found, shown)
        name_axes(left, "(a) by exit angle", "exit angle (degrees)", "$R_d$ (1/sr)")
        name_axes(right, "(b) over Lambert and Fresnel", "exit angle (degrees)", "ratio")
    return figure


def _note(found: AngularReflectance) -> str:
    names = channel_names(found.profile.channels)
    kind = kind_of_error(found.profile)
    alone = "the estimated error" if kind == "estimated" else "noise"
    shares = by_channel(names, (100.0 * found.misplaced).tolist(), ".2g")
    noise = by_channel(names, (100.0 * found.misplaced_stderr).tolist(), ".2g")
    return (
        "Dotted: the same energy by the cosine times Fresnel's transmittance, as shaders assume. "
        f"Of the light, at other angles than there, in %: {shares}; by {alone} alone {noise}. "
        f"Bands: ± the {kind} error."
    )


def _limit(left: Axes, right: Axes, found: AngularReflectance, shown: list[int]) -> None:
    top = float(np.maximum(found.per_sr, found.lambertian)[:, shown].max()) or 1.0
    left.set_ylim(0.0, 1.05 * top)
    ratio = found.ratio[:, shown]
    known = ratio[np.isfinite(ratio)]
    if known.size:
        low, high = np.clip([known.min(), known.max()], _LEAST, _MOST)
        right.set_ylim(min(low - 0.05, 0.9), max(high + 0.05, 1.1))
    for axes in (left, right):
        axes.set_xlim(0.0, 90.0)
        axes.set_xticks(range(0, 91, 15))
        tick(axes.yaxis)
