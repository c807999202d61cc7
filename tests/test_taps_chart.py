"""The chart of a table of taps: names of channels, and what is left out."""

import numpy as np
import pytest
from matplotlib.text import Text
from test_taps import taps_of

from sssfit.chart.taps import taps_figure
from sssfit.compare import view_taps


def drawn(taps):
    """The names beside the sums by channel with their places, and all text below."""
    figure = taps_figure(view_taps(taps))
    names = {
        each.get_text(): each.xy
        for axes in figure.axes
        for each in axes.texts
        if hasattr(each, "xy")
    }
    return names, " ".join(each.get_text() for each in figure.findobj(Text))


@pytest.mark.parametrize("channels", [1, 2, 3, 4, 7])
def test_names_of_equal_channels_are_apart_and_the_rest_is_said_to_be_left_out(channels):
    taps = taps_of("1-1|2", channels=channels)
    names, words = drawn(taps)
    assert len(names) == min(channels, 3)
    assert {*names} >= {taps.channels[0], taps.channels[-1]}
    heights = np.sort([float(place[1]) for place in names.values()])
    assert (heights[1:] > 2.0 * heights[:-1]).all()
    assert ("Pictures show" in words) is (channels not in (1, 3))
    assert (f"leaves out {channels - 3} channel" in words) is (channels > 3)
