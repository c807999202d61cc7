import math
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sssfit.errors import SimulationError
from sssfit.grid import MOST_ANNULI, RadialGrid, make_grid, paper_grid
from sssfit.material import Layer, Material, load_material

SKIN1 = load_material("skin1")


def test_edges_are_multiples_of_the_ring_width():
    grid = RadialGrid(0.25, 4)
    assert grid.r_edges_mm.tolist() == [0.0, 0.25, 0.5, 0.75, 1.0]
    assert grid.r_edges_mm.dtype == np.float64
    assert grid.radius_mm == 1.0


def test_equal_mean_free_paths_give_no_ring_for_rounding():
    material = Material("m", ("R",), (Layer(1.3, 0.0, [0.1], [0.6]),))
    assert paper_grid(material).annuli == 640


def test_mean_free_paths_are_reduced_ones():
    material = Material("m", ("R",), (Layer(1.3, 0.5, [0.0], [2.0]),))
    assert paper_grid(material) == RadialGrid(0.05, 640)


def test_layers_count_together_and_clear_ones_not_at_all():
    glass = Layer(1.5, 0.0, [0.0, 0.0], [0.0, 0.0], 1.0)
    thin = Layer(1.4, 0.0, [0.0, 0.0], [4.0, 2.0], 0.5)
    ground = Layer(1.3, 0.0, [0.5, 0.5], [0.5, 0.0])
    material = Material("m", ("R", "G"), (glass, thin, ground))
    assert paper_grid(material) == RadialGrid(0.25 / 20, 32 * 2 * 80)


def test_overrides_replace_the_papers_rule_one_at_a_time():
    assert make_grid(SKIN1) == paper_grid(SKIN1)
    assert make_grid(SKIN1, dr_mm=0.1, radius_mm=1.0) == RadialGrid(0.1, 10)
    assert make_grid(SKIN1, dr_mm=0.1, radius_mm=1.01) == RadialGrid(0.1, 11)
    assert make_grid(SKIN1, dr_mm=1).annuli == math.ceil(32 / 0.772)
    assert make_grid(SKIN1, radius_mm=1.0).dr_mm == paper_grid(SKIN1).dr_mm
    assert make_grid(SKIN1, dr_mm=1.0, radius_mm=1.0) == RadialGrid(1.0, 1)


def test_rings_wider_than_the_radius_are_refused():
    """3 mm of annuli 50 mm wide were one annulus of 50 mm."""
    with pytest.raises(SimulationError, match="annuli 50 mm wide do not fit into a radius of 3 mm"):
        make_grid(SKIN1, dr_mm=50.0, radius_mm=3.0)
    with pytest.raises(SimulationError, match=r"do not fit into a radius of 0\.001 mm"):
        make_grid(SKIN1, radius_mm=0.001)


@pytest.mark.parametrize("key", ["dr_mm", "radius_mm"])
@pytest.mark.parametrize("value", [0, -1.0, math.nan, math.inf, 1e308, 5e-324, True, "1", 10**40])
def test_lengths_that_are_none_are_refused_in_one_line(key, value):
    with pytest.raises(SimulationError, match=f"^{key} = ") as caught:
        make_grid(SKIN1, **{key: value})
    assert str(caught.value).isprintable()


@pytest.mark.parametrize("annuli", [0, -1, 1.5, True, "3", math.nan])
def test_ring_counts_that_are_none_are_refused(annuli):
    with pytest.raises(SimulationError, match="whole number"):
        RadialGrid(0.1, annuli)


def test_too_many_rings_are_refused_here_too():
    assert RadialGrid(0.1, MOST_ANNULI).annuli == 100_000
    with pytest.raises(SimulationError, match="100001 annuli, over the limit of 100000"):
        RadialGrid(0.1, 100_001)


@given(st.floats(1e-9, 1e-4), st.floats(20.0, 1e6))
def test_what_a_refusal_proposes_would_do(dr_mm, radius_mm):
    with pytest.raises(SimulationError) as caught:
        make_grid(SKIN1, dr_mm=dr_mm, radius_mm=radius_mm)
    message = str(caught.value)
    proposed = re.search(r"`dr_mm = (\S+)` or more, or `radius_mm = (\S+)` or less", message)
    proposed_dr, proposed_radius = map(float, proposed.groups())
    assert make_grid(SKIN1, dr_mm=proposed_dr, radius_mm=radius_mm).annuli > 0.98 * MOST_ANNULI
    assert make_grid(SKIN1, dr_mm=dr_mm, radius_mm=proposed_radius).annuli > 0.98 * MOST_ANNULI


def test_mean_free_paths_too_far_apart_are_refused():
    material = Material("m", ("R", "G"), (Layer(1.3, 0.0, [0.0, 0.0], [0.001, 5.0]),))
    with pytest.raises(SimulationError, match=r"^m: the grid would have 3\.2e\+06 annuli"):
        paper_grid(material)
    assert make_grid(material, dr_mm=1.0).annuli == 32_000
