"""The chart of stresses: its data fill the panels, a style means one method, and all is legible."""

import itertools
import json

import numpy as np
import pytest
from approval_figures import figure_lines
from figures import assert_legible, legends_of, words_of
from matplotlib.colors import to_hex

from sssfit.chart.looks import METHODS
from sssfit.chart.stability import stability_figure
from sssfit.errors import FileError
from sssfit.methods import STRESSES
from sssfit.stability import Curve, Panel, Stability
from sssfit.stability.curve import Axis

X = np.array([1.0, 10.0, 100.0, 1000.0])
# As many curves as the stresses' panels have, and the names of noise, the longest.
CURVES = {
    "noise": 11,
    "pixel-size": 8,
    "optics": 4,
    "gaussians": 2,
    "guided": 3,
    "hard-light": 2,
    "taps": 4,
    "distance": 4,
    "motion": 6,
    "grid": 7,
    "imports": 7,
}


def curve(label, k=0, **more):
    return Curve(label, X, 10.0 ** (2.0 - np.arange(4.0) - 0.1 * k), **more)


def panel(stress, labels, *, title="noise", **more):
    curves = [curve(label, k) for k, label in enumerate(labels)]
    given = {"limit": 1.0, "curves": curves, "fails": "breaks"} | more
    return Panel(stress, title, Axis("photons", 1000.0), "p99 of Delta E 2000", **given)


def record(*panels):
    return Stability("skin1", 0.3, panels)


def own(stress):
    """Labels of one stress."""
    return [f"method {k} of {stress}, smoothed" for k in range(CURVES[stress])]


def look(line):
    colours = to_hex(line.get_color()), to_hex(line.get_markerfacecolor(), keep_alpha=True)
    return *colours, line.get_marker()


def meanings(figure):
    """Each look of a panel or of the figure's legend, with the labels that have it."""
    of_legend = [
        (each.get_text(), line)
        for legend in legends_of(figure)
        for each, line in zip(legend.get_texts(), legend.get_lines(), strict=True)
    ]
    for axes in figure.axes:
        lines = [(each.get_label(), each) for each in axes.lines if each.get_marker() != "None"]
        found = {}
        for label, line in [*of_legend, *lines]:
            found.setdefault(look(line), set()).add(label)
        yield found


def test_every_stress_is_drawn_below():
    assert set(CURVES) == set(STRESSES)


@pytest.mark.parametrize("stress", CURVES)
def test_data_fill_the_panels_of_a_stress_alone(stress):
    found = record(panel(stress, own(stress)), panel(stress, own(stress), title="bias"))
    figure = assert_legible(lambda: stability_figure(found))
    values = np.concatenate([each.y for each in found.panels[0].curves])
    for axes in figure.axes:
        low, high = axes.get_ylim()
        assert 0.01 * values.min() <= low < values.min()
        assert values.max() < high <= 100.0 * values.max()
    assert all(label in words_of(figure) for label in own(stress))


def test_a_style_means_one_method_in_the_whole_figure():
    """Panels of few own methods beside shared ones have a legend of their own, and other styles."""
    both = [f"shared {k}" for k in range(11)]
    panels = [panel(stress, [*both, *own(stress)]) for stress in ("guided", "hard-light", "taps")]
    figure = assert_legible(lambda: stability_figure(record(*panels)))
    for found in meanings(figure):
        assert all(len(labels) == 1 for labels in found.values())
    assert [axes.get_legend() is not None for axes in figure.axes] == [True, True, False]


@pytest.mark.parametrize("is_log", [True, False])
def test_bars_stay_within_their_panel(is_log):
    ends = np.full(4, 0.01), np.array([3.0, 700.0, np.inf, 1.0])
    found = panel("noise", [], curves=[curve("svd", low=ends[0], high=ends[1])], is_log=is_log)
    (axes,) = stability_figure(record(found)).axes
    assert 700.0 < axes.get_ylim()[1] < 7e4


def test_a_floor_is_drawn_where_points_lie_on_it():
    measures = {"on it": 0.1, "below all": 0.01, "none": 0.0}
    for title, floor in measures.items():
        figure = stability_figure(record(panel("grid", ["svd"], title=title, floor=floor)))
        dotted = [each for each in figure.axes[0].lines if each.get_linestyle() == ":"]
        assert [list(each.get_ydata()) for each in dotted] == [[0.1, 0.1]] * (title == "on it")
        assert ("Dotted: the least that a panel shows" in words_of(figure)) is (title == "on it")


def test_panels_of_zeros_show_their_points_whole():
    """A count that is 0 everywhere lies on the axis; the limit of it may be 0 too."""
    zeros = [Curve("guided", X, np.zeros(4))]
    found = panel("guided", [], curves=zeros, limit=0.0, is_log=False)
    (axes,) = stability_figure(record(found)).axes
    assert axes.get_ylim() == pytest.approx((-0.05, 1.0))


def test_methods_look_as_in_all_charts():
    labels = ["svd 1", "svd 3, smoothed", "cascade 24", "pre-integrated, 25 taps", "burley"]
    (axes,) = stability_figure(record(panel("noise", labels))).axes
    drawn = {each.get_label(): each for each in axes.lines if each.get_marker() != "None"}
    methods = ("svd", "svd", "cascade", "preintegrated", "burley")
    for label, method in zip(labels, methods, strict=True):
        assert to_hex(drawn[label].get_color()) == METHODS[method].colour
    assert drawn["cascade 24"].get_marker() == METHODS["cascade"].marker
    assert look(drawn["svd 1"]) != look(drawn["svd 3, smoothed"])


def test_delta_e_is_written_as_in_all_charts():
    words = words_of(stability_figure(record(panel("noise", ["svd"]))))
    assert "p99 of ΔE 2000" in words
    assert "Delta E" not in words


def test_a_record_is_drawn_again_from_its_figures():
    """From what `sssfit stability --json` prints: infinite measures and bars come back."""
    refused = curve("svd", low=np.full(4, 0.01), high=np.array([3.0, np.inf, 1.0, 1.0]))
    ways = panel("noise", ["guided"]), panel("grid", [], curves=[refused], floor=0.1, is_log=False)
    found = Stability("skin1", 0.3, ways, ("Left out imports.",), 7)
    again = Stability.from_dict(json.loads(json.dumps(found.to_dict(), allow_nan=False)))
    assert again.to_dict() == found.to_dict()
    assert again.table() == found.table()
    assert figure_lines(stability_figure(again), {}) == figure_lines(stability_figure(found), {})
    told = found.to_dict()
    del told["panels"][0]["limit"]
    with pytest.raises(FileError, match="no 'limit'"):
        Stability.from_dict(told)


def test_more_methods_than_colours_have_styles_of_their_own():
    labels = [f"method {k}" for k in range(24)]
    figure = stability_figure(record(panel("noise", labels)))
    (found,) = meanings(figure)
    assert sorted(itertools.chain.from_iterable(found.values())) == sorted(labels)
