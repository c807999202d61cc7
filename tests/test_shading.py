"""What docs/cascades.md says of cascades in a shader, recomputed, and the figures asked for."""

import re
import runpy
from pathlib import Path

import pytest

from sssfit.fit import fit_taps
from sssfit.material import load_material
from sssfit.simulate import simulate_exact

DOCS = Path(__file__).parents[1] / "docs"
# Mean and 99th percentile of 1-1|2-2|2-2 on the disk, the halves and the strip, as first measured.
FIRST = ((0.44, 3.0), (0.57, 3.2), (0.93, 8.0))


@pytest.fixture(scope="module")
def script():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(DOCS))
        return runpy.run_path(str(DOCS / "make_shading.py"))


@pytest.fixture(scope="module")
def skin1():
    return simulate_exact(load_material("skin1"))


@pytest.fixture(scope="module")
def cascade(script, skin1):
    return {script["BEST"]: fit_taps(skin1, stages=script["BEST"]).kernel}


def numbers(row):
    return [float(each) for each in re.findall(r"\d+\.\d+", row)]


def check_in_page(row):
    """The page has the row, but for what another processor rounds."""
    page = (DOCS / "cascades.md").read_text(encoding="utf-8").splitlines()
    begin = re.split(r"\d+\.\d\d", row)[0]
    rows = [numbers(each) for each in page if each.startswith(begin)]
    assert pytest.approx(numbers(row), abs=0.02) in rows, "run: python docs/make_shading.py"


def test_formats_between_passes(script, cascade, skin1):
    for row in script["format_rows"](cascade[script["BEST"]], skin1):
        check_in_page(row)
        assert numbers(row)[1] < (0.3 if "r11" in row else 0.05)


def test_borders_of_objects(script, cascade, skin1):
    (row,) = script["border_rows"](cascade, skin1)
    found = numbers(row)
    check_in_page(row)
    for k, most in enumerate(FIRST):
        assert found[2 * k] <= most[0]
        assert found[2 * k + 1] <= most[1]


def test_a_slope_of_60_degrees(script, cascade, skin1):
    rows = list(script["tilt_rows"](cascade, skin1))
    for row, most in zip(rows, (2.9, 2.6, 12.0), strict=True):
        check_in_page(row)
        facing, followed, left = numbers(row)[1::2]
        assert facing < followed < left
        assert followed < most
