"""docs/engines.md has every preset, and its numbers are the program's."""

from pathlib import Path

import make_engines
import numpy as np
import pytest

from sssfit.compare.inversions import compute_inversions
from sssfit.export.presets import preset, preset_of
from sssfit.export.presets.source import source_of
from sssfit.material import load_material
from sssfit.methods import PRESETS
from sssfit.simulate import simulate_exact
from sssfit.simulate.half_space import LIGHTS

PAGE = (Path(__file__).parents[1] / "docs" / "engines.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def source():
    return source_of(simulate_exact(load_material("skin1")))


@pytest.mark.parametrize("name", PRESETS)
def test_the_page_walks_into_every_engine(name):
    assert f"### {preset(name).engine}\n" in PAGE
    assert name in make_engines.STEPS


def test_the_tables_are_those_of_the_script():
    for made in (make_engines.overview, make_engines.cross_section, make_engines.colours):
        assert made() in PAGE, f"{made.__name__}: run python docs/make_engines.py"


def test_the_formula_is_right_to_0_002_under_diffuse_light_only():
    """Without an interface; its colours are 22 to 1 % too dark there under normal light."""
    found = {each: compute_inversions(make_engines.COLOURS, light=each) for each in LIGHTS}
    diffuse, normal = found["diffuse"], found["normal"]
    assert round(float(np.abs(diffuse.seen[0] - diffuse.colour).max()), 3) == 0.002
    dark = 100.0 * (1.0 - normal.seen / normal.colour)
    assert dark[:2, [0, -1]].round().tolist() == [[22.0, 1.0], [66.0, 6.0]]
    assert "by 22 % (C = 0.05) to 1 % (C = 0.95)" in PAGE
    assert "66 to 6 % at eta 1.4" in PAGE


# The separable kernels take a second each, and their walks are those of iryoku.
@pytest.mark.parametrize("name", ["unreal", "hdrp", "babylon", "openpbr", "mitsuba", "gltf"])
def test_the_walk_of_skin1_is_the_programs(source, name):
    assert make_engines.walk(name, source, source.profile) in PAGE


def test_the_walks_begin_where_the_page_says(source):
    for step in make_engines.begin(source):
        assert step in PAGE


def test_a_choice_of_the_page_is_one(source):
    assert preset_of("openpbr", source.profile, mm_per_unit=1000)["mm_per_unit"] == 1000.0
