"""R(k), a medium's response to sinusoids of light, as a figure: `frequency_figure`.

``sssfit.profile.frequency`` computes the record.
"""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from sssfit.arrays import FloatArray
from sssfit.chart.page import (
    add_legend,
    channel_style,
    check_drawn,
    draw_curve,
    name_axes,
    new_page,
    say_nothing_is_drawn,
    tick,
    tick_decades,
)
from sssfit.chart.text import (
    NO_LIGHT,
    channel_label,
    in_legend,
    kind_of_error,
    left_out_note,
    legend_title,
    subtitle,
    titled,
)
from sssfit.profile.frequency import FrequencyResponse

HEIGHT_INCHES = 4.4
_TURN = 2.0 * np.pi
_FALLEN = 0.25  # of R(0), where the linear panel ends
_DECADES = 4.0  # most decades of the other's ordinate


def frequency_figure(found: FrequencyResponse) -> Figure:
    """Draw R(k) of each channel, logarithmic over k and linear over cycles per mm.

    Parameters
    ----------
    found : FrequencyResponse
        If it has more than eight channels, eight from the first to the last are drawn.

    Returns
    -------
    matplotlib.figure.Figure
        8 x 4.4 inches; bands of one standard or estimated error where it is known.

    Raises
    ------
    ArgumentError
        ``found`` is another record.
    """
    check_drawn(found, "FrequencyResponse")
    profile = found.profile
    shown = in_legend(profile.n_channels)
    title = titled(profile, "response to sinusoids of light")
    notes = [_note(found), *left_out_note(profile.n_channels - len(shown))]
    with new_page(HEIGHT_INCHES, title, subtitle(profile), notes) as (figure, below):
        styles = [channel_style(c, profile.n_channels) for c in shown]
        handles = [Line2D([], [], **each) for each in styles]
        labels = [channel_label(profile, c, is_drawn=True) for c in shown]
        rest = add_legend(below, handles, labels, title=legend_title(profile))
        left, right = rest.subplots(1, 2)
        for c, style in zip(shown, styles, strict=True):
            curve = found.response[:, c], found.stderr[:, c], style
            draw_curve(left, found.k_per_mm, *curve)
            draw_curve(right, found.k_per_mm / _TURN, *curve)
        _limit(left, right, found.k_per_mm, found.response[:, shown])
        if not found.response.any():
            for axes in (left, right):
                say_nothing_is_drawn(axes, NO_LIGHT)
        name_axes(left, "(a) logarithmic, over k", "k (rad/mm)", "R(k)")
        name_axes(right, "(b) linear, over cycles per mm", "k / 2π (1/mm)", "R(k)")
    return figure


def _note(found: FrequencyResponse) -> str:
    beyond = float((found.profile.beyond_grid / _nonzero(found.response[0])).max())
    kind = kind_of_error(found.profile)
    is_known = (found.stderr[1:] > 0.0).any()  # not under a beam, nor of diffusion models
    share = f"at most {100.0 * beyond:.2g} % of a channel"
    lost = f" Light beyond the grid, {share}, counts at k = 0 only." if beyond > 0.0 else ""
    return (
        "R(k) = 2π ∫ R_d(r) J₀(kr) r dr, the amplitude that returns of light cos(kx)"
        f"{f'; bands show ± the {kind} error' if is_known else ''}.{lost}"
    )


def _nonzero(values: FloatArray) -> FloatArray:
    return np.where(values > 0.0, values, np.inf)


def _limit(left: Axes, right: Axes, k: FloatArray, response: FloatArray) -> None:
    """End the linear panel where every channel has fallen to a quarter."""
    top = float(response.max()) or 1.0
    left.set_xscale("log")
    if response.any():
        left.set_yscale("log")
    left.set_xlim(k[1], k[-1])
    least = response[response > 0.0].min(initial=top)
    left.set_ylim(max(float(least), top * 10.0**-_DECADES) / 1.5, 1.5 * top)
    tick_decades(left.xaxis, 9)
    tick_decades(left.yaxis, 9)
    above = (response > _FALLEN * response[0]).any(axis=1)
    last = min(int(np.flatnonzero(above)[-1]) + 1 if above.any() else 1, len(k) - 1)
    right.set_xlim(0.0, k[last] / _TURN)
    right.set_ylim(0.0, 1.05 * top)
    tick(right.xaxis)
    tick(right.yaxis)
