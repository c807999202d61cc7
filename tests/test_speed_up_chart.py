"""The chart of the paper's table: distances have numbers, and short axes have enough of them."""

from types import SimpleNamespace

import numpy as np
import pytest
from figures import assert_legible

from sssfit.chart.speed_up import speed_up_figure
from sssfit.crowd.table import DISTANCES, HEADS, PUBLISHED


class SpeedUpTable(SimpleNamespace):
    """Stands in for the record, whose frames take minutes."""


def frame(error):
    row = SimpleNamespace(resolution=(300, 480), head_units=2.5, spacing_units=2.0, fov_degrees=30)
    return SimpleNamespace(
        row=row, map_size=512, work={"saved": SimpleNamespace(mean_delta_e=error)}
    )


def table(low, high):
    """Measures that rise from ``low`` to ``high`` with the distance."""
    rising = np.geomspace(low, high, len(DISTANCES)) * np.ones((len(HEADS), 1))
    return SpeedUpTable(
        frames=[[frame(each) for each in row] for row in rising],
        heads=HEADS,
        distances=DISTANCES,
        published=PUBLISHED,
        texels=rising,
        seconds=rising,
        over_screen=rising,
    )


def seen(axis):
    """Labels of an axis within its limits."""
    axis.get_figure(root=True).draw_without_rendering()
    low, high = axis.get_view_interval()
    ticks = [*axis.get_major_ticks(), *axis.get_minor_ticks()]
    shown = [each.label1.get_text() for each in ticks if low <= each.get_loc() <= high]
    return [each for each in shown if each]


def test_every_distance_has_its_number():
    figure = assert_legible(lambda: speed_up_figure(table(1.0, 600.0)))
    for axes in figure.axes:
        assert [float(each) for each in seen(axes.xaxis)] == list(DISTANCES)


@pytest.mark.parametrize(
    ("low", "high"), [(0.52, 4.0), (1.2, 17.0), (0.03, 1.5), (3.4, 4.0), (1.0, 600.0)]
)
def test_numbers_of_an_axis_are_alike_and_enough(low, high):
    figure = assert_legible(lambda: speed_up_figure(table(low, high)))
    labels = seen(figure.axes[3].yaxis)
    assert len(labels) >= 3
    assert len({each.startswith("$") for each in labels}) == 1
