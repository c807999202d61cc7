"""Heads in a row: where they stand, what savings leave out, and the paper's table."""

import numpy as np
import pytest
from meshes import sphere

from sssfit.crowd.frame import measure_frame
from sssfit.crowd.row import Row
from sssfit.crowd.runner import savings_of
from sssfit.crowd.table import ALL, PUBLISHED, measure_table
from sssfit.errors import ArgumentError
from sssfit.fit import fit_result
from sssfit.material import load_material
from sssfit.render.texture import Savings
from sssfit.simulate import simulate_dipole

SMALL = (60, 96)


@pytest.fixture(scope="module")
def kernel():
    profile = simulate_dipole(load_material("skin1"))
    return fit_result(
        profile, "gaussian-chain", blur="published", stages="1-1", mm_per_pixel=1.0
    ).kernel


def row(heads=2, distance=8.0, **changes):
    return Row(heads, distance, resolution=SMALL, mesh=sphere(rows=24, columns=48), **changes)


def test_heads_stand_side_by_side_around_the_middle():
    three = row(3, spacing_units=2.0)
    np.testing.assert_allclose(three.offsets_mm, [[-200.0, 0, 0], [0, 0, 0], [200.0, 0, 0]])
    height = np.ptp(three.shape.positions_mm[:, 1])
    assert height == pytest.approx(250.0)
    assert three.camera.distance_mm == 800.0


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"heads": 0}, "heads = 0"),
        ({"heads": 65}, "1 to 64"),
        ({"heads": True}, "whole number"),
        ({"distance": 1.0}, "more than half a head"),
        ({"distance": float("nan")}, "distance_units"),
        ({"spacing_units": 0.0}, "spacing_units = 0"),
    ],
)
def test_rows_that_cannot_be_are_refused_in_one_line(changes, said):
    with pytest.raises(ArgumentError) as caught:
        row(**changes)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_culled_and_clipped_pictures_are_the_same_inside(kernel):
    """Farther than the kernel reaches from outlines and from the border."""
    found = measure_frame(
        row(5, 6.0), kernel, savings=Savings(culled="face", clipped=True), map_size=128
    )
    saved, whole = found.work["saved"], found.work["whole"]
    assert saved.largest_inside < 1e-9
    assert saved.texels_convolved < 0.6 * whole.texels_convolved
    assert whole.mean_delta_e == 0.0
    assert found.to_dict()["speed_up_texels"] == found.speed_up[0]
    assert "times fewer texels" in found.text()


def test_smaller_maps_far_away_show_little(kernel):
    found = measure_frame(row(1, 20.0), kernel, savings=Savings(by_depth=True), map_size=256)
    assert found.map_sizes[0] < 80
    assert 0.0 < found.work["saved"].mean_delta_e < 0.5


def test_every_cell_leaves_out_as_much_as_the_papers(kernel):
    found = measure_table(
        kernel, heads=(1, 4), distances=(2.5, 20.0), map_size=64, resolution=SMALL
    )
    assert (found.texels >= PUBLISHED[[0, 2]][:, [0, 3]]).all()


def test_savings_are_chosen_by_name():
    assert savings_of(None) == ALL
    assert savings_of(["depth"]) == Savings(by_depth=True)
    with pytest.raises(ArgumentError, match="culled, depth, clipped"):
        savings_of(["cull"])
