"""The chart of a table of taps: names of channels, and what is left out."""

import dataclasses

import pytest
from figures import assert_legible, legends_of
from matplotlib.text import Text
from test_taps import taps_of

from sssfit.chart.taps import taps_figure
from sssfit.compare import view_taps


def drawn(taps):
    """The figure, the names of the sums by channel, and all text."""
    figure = assert_legible(lambda: taps_figure(view_taps(taps)))
    names = [each.get_text() for each in figure.axes[-1].get_legend().get_texts()]
    return figure, names, " ".join(each.get_text() for each in figure.findobj(Text))


@pytest.mark.parametrize("channels", [1, 2, 3, 4, 7])
def test_sums_are_named_and_the_rest_is_said_to_be_left_out(channels):
    taps = taps_of("1-1|2", channels=channels)
    _, names, words = drawn(taps)
    assert len(names) == min(channels, 3)
    assert {*names} >= {taps.channels[0], taps.channels[-1]}
    assert ("Pictures show" in words) is (channels not in (1, 3))
    assert (f"leaves out {channels - 3} channel" in words) is (channels > 3)
    assert 'farthest tap; "1/2", on pixels twice as large.' in words


def test_stages_that_add_nothing_are_named_and_not_drawn():
    """Their pictures would be black, or equal the one before."""
    whole = taps_of("1-1|2")
    blend = whole.blend.copy()
    blend[:2] = 0.0
    figure, _, words = drawn(dataclasses.replace(whole, blend=blend))
    pictures, stages, _ = figure.axes
    assert [each.get_text()[:9] for each in pictures.texts] == ["stage 2: ", "+ stage 3"]
    assert len(stages.lines) == len(pictures.images) == 2
    (legend,) = legends_of(figure)
    assert [each.get_text() for each in legend.get_texts()] == ["stage 2", "stage 3"]
    assert "Weight 0 in the sum, so not drawn: irradiance, stage 1." in words


def test_the_irradiance_is_a_point_in_the_legend_too():
    figure, _, words = drawn(taps_of("1-1|2"))
    (legend,) = legends_of(figure)
    first, second = legend.get_lines()[:2]
    assert (first.get_linestyle(), first.get_marker()) == ("None", "o")
    assert second.get_linestyle() != "None"
    assert "not drawn" not in words
