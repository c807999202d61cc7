"""What docs/cascades.md says of disks and of engines' samplers, recomputed."""

import itertools
import re
import runpy
from pathlib import Path

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from sssfit.compare.engines import engines

DOCS = Path(__file__).parents[1] / "docs"


@pytest.fixture(scope="module")
def script():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(DOCS))
        return runpy.run_path(str(DOCS / "make_disks.py"))


@pytest.fixture(scope="module")
def skin1(script):
    return script["whole_profile"]("skin1")


@pytest.fixture(scope="module")
def pictures(script, skin1):
    return script["cases"](skin1)


def numbers(row):
    return [float(each) for each in re.findall(r"\d+\.\d\d\b", row)]


def check_in_page(row):
    """The page has the row, but for what another processor rounds."""
    page = (DOCS / "cascades.md").read_text(encoding="utf-8").splitlines()
    begin = re.split(r"\d+\.\d\d\b", row)[0]
    rows = [numbers(each) for each in page if each.startswith(begin)]
    assert pytest.approx(numbers(row), abs=0.02) in rows, "run: python docs/make_disks.py"
    return numbers(row)


@pytest.mark.parametrize("label", ["Babylon.js 40", "EEVEE 16", "iryoku 25"])
def test_engines_in_one_frame(script, skin1, pictures, label):
    (engine,) = [each for each in engines() if each.label == label]
    given = label, engine.fetches, engine.passes, lambda each: engine.render(each, skin1)
    found = check_in_page(script["sampler_row"](*given, pictures))
    assert len(found) == 5


@pytest.mark.slow
def test_all_rows(script, skin1, pictures):
    samplers = [check_in_page(each) for each in script["sampler_rows"](skin1, pictures)]
    cascade, *others = [each[-1] for each in samplers]
    assert len(others) == len(engines())
    assert min(others) > 5.0 * cascade  # at most a fifth of any of them, at any number of fetches
    for taps in script["DISKS"]:
        rows = [check_in_page(each) for each in script["disk_rows"](skin1, pictures, taps)]
        assert len(rows) == 3
        assert min(each[-2] for each in rows) > 5.0 * cascade


def test_no_mark_of_a_sampler_covers_another(monkeypatch):
    """Five samplers of about 40 fetches and about the same error, as HDRP's and Babylon's are."""
    monkeypatch.syspath_prepend(str(DOCS))
    fetches = runpy.run_path(str(DOCS / "make_fetches.py"))
    figure = Figure(figsize=(8.0, 5.6), dpi=200)
    axes = figure.subplots()
    axes.set(xscale="log", yscale="log", xlim=(5.4, 240.0), ylim=(0.07, 130.0))
    samplers = [("", n, 1, error) for n, error in
                ((40, 22.1), (40, 20.6), (41, 21.0), (42, 16.0), (80, 16.0))]  # fmt: skip
    FigureCanvasAgg(figure)
    fetches["tie"](axes, "abcde", samplers)
    figure.canvas.draw()
    marks = sorted(axes.texts, key=lambda each: each.get_text())
    assert [each.xy for each in marks] == [(n, error) for _, n, _, error in samplers]
    circles = [each.get_bbox_patch().get_window_extent() for each in marks]
    middles = np.array([0.5 * (each.p0 + each.p1) for each in circles])
    for i, j in itertools.combinations(range(len(marks)), 2):
        between = np.hypot(*(middles[i] - middles[j]))
        assert between >= 0.5 * (circles[i].width + circles[j].width)
    assert marks[4].get_position()[0] == pytest.approx(80.0)  # whoever stands alone stays
