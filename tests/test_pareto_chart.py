"""The chart of error over cost: what is drawn, labelled and refused, and that it can be read."""

import dataclasses
import functools
import io
import itertools

import numpy as np
import pytest
from figures import assert_legible, drawn_texts, words_of
from matplotlib.legend import Legend
from matplotlib.path import Path
from turns import in_turn

from sssfit.chart.page import lay_out, new_page, save_figure
from sssfit.chart.pareto import pareto_figure, place_labels
from sssfit.compare.candidates import Candidate
from sssfit.compare.comparison import COSTS, ERRORS
from sssfit.compare.pareto import _with_fronts, compare_kernels
from sssfit.errors import RenderError
from sssfit.material import load_material
from sssfit.methods import FITS
from sssfit.scene.made import make_scene
from sssfit.simulate import simulate_exact

PITCH = 2.0
PICTURES = ("disk", "edge", "head")


@pytest.fixture(scope="module")
def comparison():
    """Every candidate, as the verb has it, but of seconds that are the same in every run.

    With those of a busy machine a front had fewer labels than three in four.
    """
    profile = simulate_exact(load_material("skin1"))
    scenes = [make_scene(name, height=32, width=32, mm_per_pixel=PITCH) for name in PICTURES]
    found = compare_kernels(profile, scenes, timed_seconds=0.0)
    return dataclasses.replace(found, rows=_with_fronts(list(map(timed, found.rows))))


def timed(row):
    """A row that takes its seconds for what it reads and for its bytes."""
    seconds = 1e-3 * row.fetches + 1e-4 * row.bytes_per_pixel
    return dataclasses.replace(row, seconds_per_megapixel=seconds)


@pytest.fixture(scope="module")
def head_alone(comparison):
    """One of the three panels, for tests of what stands in a panel."""
    return dataclasses.replace(
        comparison, pictures=comparison.pictures[2:], rows=comparison.rows_of("head")
    )


@pytest.fixture(scope="module")
def drawn(comparison):
    """Draw the comparison, each chart once."""
    return functools.cache(lambda **chosen: pareto_figure(comparison, **chosen))


def panels_of(figure):
    return figure.axes


def texts_in(axes):
    return [each.get_text() for each in axes.texts]


def with_rows(comparison, change):
    """The same comparison with rows changed."""
    return dataclasses.replace(comparison, rows=tuple(map(change, comparison.rows)))


@pytest.mark.parametrize(("cost", "error"), in_turn(COSTS, ERRORS))
def test_every_chart_is_legible(drawn, error, cost):
    assert_legible(lambda: drawn(error=error, cost=cost))


@pytest.mark.parametrize("error", ERRORS)
@pytest.mark.parametrize("cost", COSTS)
def test_the_front_alone_is_labelled_and_joined(comparison, drawn, error, cost):
    figure = drawn(error=error, cost=cost)
    for axes, picture in zip(panels_of(figure), PICTURES, strict=True):
        front = comparison.front(picture, error, cost)
        labels = [row.label for row in front]
        drawn = texts_in(axes)
        assert [each for each in labels if each in drawn] == drawn  # one without room is left out
        assert 4 * len(drawn) >= 3 * len(labels)
        (line,) = (each for each in axes.lines if each.get_drawstyle() == "steps-post")
        points = [(row.cost(cost), row.error(error)) for row in front]
        np.testing.assert_array_equal(np.transpose(line.get_data())[:-1], points)
        full = [
            each for each in axes.lines if each.get_marker() != "None" and each.get_alpha() == 1
        ]
        assert sorted(tuple(np.ravel(each.get_data())) for each in full) == sorted(points)
        faint = [each for each in axes.lines if (each.get_alpha() or 1.0) < 0.5]
        assert len(faint) == len(comparison.rows_of(picture)) - len(front)


def test_points_of_one_cost_are_apart(comparison, drawn):
    axes = panels_of(drawn(error="delta-e", cost="passes"))[0]
    rows = [row for row in comparison.rows_of("disk") if row.passes == 2]
    left = {}
    for row, line in zip(comparison.rows_of("disk"), axes.lines, strict=False):
        left.setdefault((row.method, row.label.endswith("kept")), []).append((row, line))
    places = {
        round(float(line.get_xdata()[0]), 6)
        for own in left.values()
        for row, line in own
        if row.passes == 2
    }
    kinds = {(row.method, row.label.endswith("kept")) for row in rows}
    assert len(places) >= len(kinds)
    assert min(places) == 2.0  # the front stands at its cost


def test_a_line_at_one_marks_what_is_just_noticeable(drawn):
    for error, wanted in (("delta-e", 1), ("p99", 1), ("l2", 0)):
        for axes in panels_of(drawn(error=error, cost="fetches")):
            flat = [each for each in axes.lines if list(each.get_ydata()) == [1.0, 1.0]]
            assert len(flat) == wanted


def test_title_and_notes_say_what_was_compared(comparison, drawn):
    figure = drawn(error="delta-e", cost="fetches")
    text = words_of(figure)
    exposure = f"exposure {comparison.pictures[0].exposure:.3g}"
    for part in (
        "skin1: mean ΔE 2000 against fetches",
        "Exact solution",
        f"{comparison.pixels} x {comparison.pixels} pixels of 2 mm",
        "disk, 32 × 32 pixels, " + exposure,  # noqa: RUF001
        f"dense kernels of {comparison.pixels} pixels at their weights",
        "Of disk and edge, what is within 21.4 mm of light or border counts",
    ):
        assert part in text
    threads = pareto_figure(dataclasses.replace(comparison, threads=1), cost="seconds")
    assert "on 1 thread of this machine" in words_of(threads)


def test_methods_have_a_colour_and_a_marker_of_their_own(comparison, drawn):
    axes = panels_of(drawn(error="delta-e", cost="fetches"))[0]
    looks, sizes = {}, {}
    for row, line in zip(comparison.rows_of("disk"), axes.lines, strict=False):
        looks.setdefault(row.method, set()).add((line.get_color(), line.get_marker()))
        sizes.setdefault(row.is_dense, set()).add(line.get_markersize())
    assert all(len(each) == 1 for each in looks.values())
    assert len({next(iter(each))[0] for each in looks.values()}) == len(looks) >= 13
    assert len({next(iter(each))[1] for each in looks.values()}) == len(looks)
    assert max(sizes[True]) < min(sizes[False])  # what no shader applies is small


def test_a_method_without_a_style_has_spare_ones_and_its_name_in_the_legend(
    comparison, monkeypatch
):
    for name in ("new", "newer"):
        monkeypatch.setitem(FITS, name, FITS["svd"])

    def renamed(row):
        named = {"burley": "new", "svd": "newer"}.get(row.method, row.method)
        return dataclasses.replace(row, method=named)

    found = dataclasses.replace(with_rows(comparison, renamed), pictures=comparison.pictures[:1])
    figure = pareto_figure(found)
    (legend,) = [each for each in figure.findobj(Legend) if each.get_texts()]
    looks = {
        text.get_text(): (line.get_color(), line.get_marker())
        for text, line in zip(legend.get_texts(), legend.get_lines(), strict=True)
    }
    assert looks["newer"] == looks.pop("newer, energy kept")
    colours, markers = zip(*looks.values(), strict=True)
    assert markers.count(looks["new"][1]) == markers.count(looks["newer"][1]) == 1
    assert colours.count(looks["new"][0]) == colours.count(looks["newer"][0]) == 1
    (axes,) = panels_of(figure)
    drawn = {(line.get_color(), line.get_marker()) for line in axes.lines}
    assert {looks["new"], looks["newer"]} <= drawn


@pytest.mark.parametrize(
    "change",
    [
        pytest.param(lambda _: {"delta_e_2000_mean": 0.0}, id="no error at all"),
        pytest.param(lambda _: {"delta_e_2000_mean": 3.0}, id="all alike"),
        pytest.param(lambda row: {"delta_e_2000_mean": 1e-3 * row.delta_e_2000_mean}, id="small"),
        pytest.param(lambda _: {"fetches": 42}, id="one cost"),
        pytest.param(lambda row: {"label": f"{row.label}, of a long name"}, id="long labels"),
    ],
)
def test_strange_figures_are_drawn(head_alone, change):
    found = with_rows(head_alone, lambda row: dataclasses.replace(row, **change(row)))
    assert_legible(lambda: pareto_figure(found))


def test_one_kernel_and_one_picture_are_drawn(comparison):
    profile = comparison.profile
    scenes = [make_scene("points", height=32, width=48, mm_per_pixel=PITCH)]
    one = [Candidate("svd 1", "svd", 1, {"rank": 1}), Candidate("svd 0", "svd", 0, {"rank": 0})]
    found = compare_kernels(profile, scenes, candidates=one)
    figure = assert_legible(lambda: pareto_figure(found))
    text = words_of(figure)
    assert "Could not be fitted: svd 0." in text
    assert "made edge" not in text


def test_light_that_true_pictures_lack_is_noted(comparison, drawn):
    profile = comparison.profile
    beyond = np.array([0.0, 0.01, 0.0]) * profile.total_on_grid / 0.99
    found = dataclasses.replace(
        comparison, profile=dataclasses.replace(profile, beyond_grid=beyond)
    )
    assert found.missing_share == pytest.approx([0.0, 0.01, 0.0])
    figure = pareto_figure(found)
    assert "lies up to 1 % of a channel's light" in words_of(figure)
    assert "Beyond the profile's grid" not in words_of(drawn(error="delta-e", cost="fetches"))
    assert_legible(lambda: figure)


def test_names_of_pictures_may_be_long_and_strange(head_alone):
    name = "a picture $with_a^name$ that \u4e2d goes on and on.exr"
    found = dataclasses.replace(
        with_rows(head_alone, lambda row: dataclasses.replace(row, picture=name)),
        pictures=(dataclasses.replace(head_alone.pictures[0], name=name),),
    )
    assert_legible(lambda: pareto_figure(found))


def test_no_delta_e_without_colour(comparison):
    from reference_pixels import make_profile

    two = make_profile([0.0, 1.0], [[0.3, 0.2]])
    with pytest.raises(RenderError, match="Delta E of 2 channels"):
        pareto_figure(dataclasses.replace(comparison, profile=two))


def test_the_same_comparison_gives_the_same_bytes(comparison, drawn):
    """Of a chart in which no other test measures labels: as SVG it was drawn at another scale."""
    which = {"error": "l2", "cost": "passes"}
    files = [io.BytesIO(), io.BytesIO()]
    figures = drawn(**which), pareto_figure(comparison, **which)
    for file, figure in zip(files, figures, strict=True):
        save_figure(figure, file, format="svg")
    assert files[0].getvalue() == files[1].getvalue()


@pytest.mark.parametrize("many", [2, 12, 40])
def test_labels_never_meet_however_dense_the_front(many):
    rng = np.random.default_rng(many)
    x, y = np.sort(rng.uniform(0.5, 0.6, many)), np.sort(rng.uniform(0.4, 0.9, many))[::-1]
    with new_page(3.0, "labels", "a dense front") as (figure, below):
        axes = below.subplots()
        axes.set(xlim=(0, 1), ylim=(0, 1))
        lay_out(figure)
        names = [f"kernel {k}" for k in range(many)]
        place_labels(axes, list(zip(x, y, strict=True)), names, level=y[0] - 0.05)
    assert texts_in(axes)
    assert_legible(lambda: figure)
    for _, box in [each for each in drawn_texts(figure) if each[0].startswith("kernel")]:
        pixels = axes.transData.transform(np.transpose([x, y]))
        assert not box.y0 < axes.transData.transform((0.5, y[0] - 0.05))[1] < box.y1
        assert not any(box.contains(*each) for each in pixels)


@pytest.mark.parametrize("cost", COSTS)
def test_labels_are_read_as_their_own_points(comparison, drawn, cost):
    """They are clear of every marker and of the front's line, nearest to their point, and tied."""
    figure = drawn(error="delta-e", cost=cost)
    for axes, picture in zip(panels_of(figure), PICTURES, strict=True):
        front = {row.label: k for k, row in enumerate(comparison.front(picture, "delta-e", cost))}
        lines = {each.get_drawstyle(): each for each in axes.lines}
        corners = axes.transData.transform(np.transpose(lines["steps-post"].get_data()))
        marked = [each for each in axes.lines if each.get_marker() != "None"]
        markers = axes.transData.transform([np.ravel(each.get_data()) for each in marked])
        ties = [each for each in axes.lines if each.get_color() == "#999999" and each.get_lw() < 1]
        for text in axes.texts:
            box = text.get_window_extent()
            assert not any(box.padded(8.0).contains(*each) for each in markers)
            for (x, y), (x_next, y_next) in itertools.pairwise(corners):
                corner = (x_next, y)
                for side in ((x, y), corner), (corner, (x_next, y_next)):
                    assert not Path(side).intersects_bbox(box)
            apart = [np.hypot(*(np.clip(each, box.min, box.max) - each)) for each in corners[:-1]]
            own = front[text.get_text()]
            assert int(np.argmin(apart)) == own
            starts = [axes.transData.transform((e.get_xdata()[0], e.get_ydata()[0])) for e in ties]
            assert any(np.allclose(each, corners[own], atol=0.1) for each in starts)
