"""Heads in a row: where they stand, what savings leave out, and the paper's table."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from meshes import quad, sphere

import sssfit.crowd.table
from sssfit.chart import figure_of
from sssfit.crowd.frame import measure_frame
from sssfit.crowd.row import Row
from sssfit.crowd.runner import savings_of
from sssfit.crowd.table import ALL, PUBLISHED, SpeedUpTable, measure_table
from sssfit.errors import ArgumentError, RenderError
from sssfit.fit import fit_result
from sssfit.formats.pictures import load_image
from sssfit.material import load_material
from sssfit.render.bloom import bloomed
from sssfit.render.texture import Savings
from sssfit.render.texture_level import Level
from sssfit.render.texture_lookup import look_up
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


def test_a_mesh_without_height_is_refused_in_one_line():
    flat = quad()
    flat = dataclasses.replace(flat, positions_mm=flat.positions_mm[:, [0, 2, 1]], normals=None)
    with pytest.raises(RenderError, match=r"^quad: the mesh is 0 mm high .*100 wide and 100 deep"):
        Row(1, 10.0, mesh=flat)


def test_the_camera_stands_before_a_mesh_deeper_than_it_is_high():
    """Four times: half the depth of a head 2.5 units high is 5, and 10 mm before it are cut off."""
    ball = sphere(rows=6, columns=12)
    deep = dataclasses.replace(ball, positions_mm=ball.positions_mm * [1, 1, 4], normals=None)
    with pytest.raises(ArgumentError, match=r"distance_units = 5.1.*more than 5.1, as sphere at a"):
        Row(1, 5.1, mesh=deep)
    assert Row(1, 5.101, mesh=deep).shape.positions_mm[:, 2].max() == pytest.approx(500.0)


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


def test_without_a_head_in_view_nothing_is_said_of_texels(kernel):
    found = measure_frame(row(2, 2.5, spacing_units=8.0), kernel, savings=ALL, map_size=64)
    assert found.work["saved"].texels_convolved == 0
    assert found.to_dict()["speed_up_texels"] is None
    assert "\nno texel in view is convolved, " in found.text()
    assert np.isnan(SpeedUpTable(((found,),)).texels).all()


def test_smaller_maps_far_away_show_little(kernel):
    found = measure_frame(row(1, 20.0), kernel, savings=Savings(by_depth=True), map_size=256)
    assert found.map_sizes[0] < 80
    assert 0.0 < found.work["saved"].mean_delta_e < 0.5


def test_every_cell_leaves_out_as_much_as_the_papers(kernel):
    found = measure_table(
        kernel, heads=(1, 4), distances=(2.5, 20.0), map_size=64, resolution=SMALL
    )
    assert (found.texels >= PUBLISHED[[0, 2]][:, [0, 3]]).all()


def test_unless_told_otherwise_the_table_is_the_papers(monkeypatch):
    seen = []
    monkeypatch.setattr(
        *(sssfit.crowd.table, "measure_frame"), lambda row, *_, **__: SimpleNamespace(row=row)
    )
    found = measure_table(None, progress=lambda *told: seen.append(told))
    np.testing.assert_array_equal(found.published, PUBLISHED)
    assert (found.heads[-1], found.distances[-1]) == (16, 100.0)
    assert seen[0] == (0, 30, "1 at 2.5 units")
    assert seen[-1] == (29, 30, "16 at 100 units")


@pytest.mark.slow
def test_the_whole_table_is_measured(kernel):
    found = measure_table(kernel, map_size=16, resolution=(6, 8))
    np.testing.assert_array_equal(found.published, PUBLISHED)
    assert (found.texels > 1.0).all()


def test_savings_are_chosen_by_name():
    assert savings_of(None) == ALL
    assert savings_of(["none"]) == Savings()
    assert savings_of(["depth"]) == Savings(by_depth=True)
    with pytest.raises(ArgumentError, match="culled, depth, clipped"):
        savings_of(["cull"])


def test_the_table_has_the_papers_cells_and_says_so_where_it_has_none(kernel):
    found = measure_table(
        *(kernel,), heads=(1, 3), distances=(5.0, 7.0), map_size=32, resolution=SMALL
    )
    assert (found.heads, found.distances) == ((1, 3), (5.0, 7.0))
    assert found.published[0, 0] == 1.10
    assert np.isnan(found.published[1]).all()
    assert found.to_dict()["published"] == [[1.10, None], [None, None]]
    ratio = [
        each.work["saved"].texels_convolved / each.work["screen"].texels_convolved
        for each in found.frames[1]
    ]
    np.testing.assert_allclose(found.over_screen[1], ratio)
    figure = figure_of(found)
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert titles[2] == "(c) texture over screen space"


def test_screen_space_is_near_texture_space_where_the_surface_faces_the_eye(kernel):
    """Both diffuse in mm of the surface; they part at outlines."""
    found = measure_frame(row(1, 8.0), kernel, savings=Savings(), map_size=256)
    assert found.work["screen"].mean_delta_e < 1.0
    assert found.work["saved"].mean_delta_e == 0.0


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_bloom_moves_light_and_keeps_it(share):
    picture = np.zeros((64, 80, 3))
    picture[30:34, 40:44] = 10.0
    found = bloomed(picture, share)
    np.testing.assert_allclose(found.sum(axis=(0, 1)), picture.sum(axis=(0, 1)))
    core = found[30:34, 40:44].sum() / picture.sum()
    assert core == pytest.approx(1.0) if share == 0.0 else 1.0 - share < core < 1.0
    assert (found >= 0.0).all()


def test_bloom_of_a_point_is_its_three_gaussians():
    """Widths are parts of the picture's height."""
    picture = np.zeros((251, 251, 1))
    picture[125, 125] = 1.0
    found = bloomed(picture, 1.0)[:, :, 0]
    x = np.arange(251) - 125.0
    wide = [np.exp(-0.5 * (x / (part * 251)) ** 2) for part in (0.004, 0.016, 0.064)]
    wanted = sum(
        share * np.outer(each, each) / each.sum() ** 2
        for share, each in zip((0.5, 0.3, 0.2), wide, strict=True)
    )
    np.testing.assert_allclose(found, wanted, atol=2e-5)


def test_what_is_no_share_or_no_picture_of_colours_is_refused(kernel):
    with pytest.raises(RenderError, match="bloom = 2"):
        bloomed(np.zeros((4, 4, 3)), 2.0)
    stages = tuple(dataclasses.replace(each, weights=each.weights[:, :2]) for each in kernel.stages)
    errors = {name: each[:2] for name, each in kernel.errors.items()}
    two = dataclasses.replace(
        *(kernel,), channels=("a", "b"), blend=kernel.blend[:, :2], stages=stages, errors=errors
    )
    with pytest.raises(RenderError, match="2 channels"):
        measure_frame(row(), two, savings=Savings())


def test_a_wide_pixel_takes_the_mean_of_its_texels():
    """At widths that are powers of 2, in the middle of those texels: their mean by coverage."""
    rng = np.random.default_rng(5)
    light, cover = rng.uniform(size=(16, 16, 2)), rng.integers(0, 2, (16, 16)).astype(float)
    level = Level.of_map(cover, np.ones((16, 16, 2)))
    for n in (0, 1, 2):
        wide = 2**n
        places = np.array([[wide * 1.5 - 0.5, wide * 2.5 - 0.5]])
        found = look_up(light, level, places, np.array([float(wide)]))
        block = np.s_[wide : 2 * wide, 2 * wide : 3 * wide]
        weights = cover[block][..., None]
        wanted = (weights * light[block]).sum(axis=(0, 1)) / max(weights.sum(), 1.0)
        np.testing.assert_allclose(found[0], wanted, atol=1e-12)
    between = look_up(light, level, np.array([[2.5, 4.5]]), np.array([2.0**0.25]))
    ends = [look_up(light, level, np.array([[2.5, 4.5]]), np.array([each])) for each in (1.0, 2.0)]
    np.testing.assert_allclose(between, 0.75 * ends[0] + 0.25 * ends[1])


def test_a_pixel_shows_its_own_chart_where_that_has_texels():
    """At the border of two charts, and of a third that is in the texture nowhere."""
    charts = np.repeat([[0, 0, 0, 0, 1, 1, 1, 1]], 8, axis=0)
    level = Level.of_map(np.ones((8, 8)), np.ones((8, 8, 2)), charts)
    light, place = charts[..., None] * 1.0, np.full((3, 2), 3.5)
    for wide in (1.0, 3.0, 8.0):
        found = look_up(light, level, place, np.full(3, wide), np.array([0, 1, 2]))
        np.testing.assert_allclose(found[:, 0], [0.0, 1.0, 0.5])


def test_constant_light_stays_constant_from_any_distance():
    cover = np.random.default_rng(6).integers(0, 2, (9, 13)).astype(float)
    light = 0.3 * cover[..., None]
    level = Level.of_map(cover, np.ones((9, 13, 2)))
    np.testing.assert_allclose(level.mean(level.picked(light)), 0.3)
    places = np.stack(np.meshgrid(np.arange(9.0), np.arange(13.0)), axis=-1).reshape(-1, 2)
    found = look_up(light, level, places, np.full(len(places), 5.0))
    assert set(np.unique(found).round(12)) <= {0.0, 0.3}


def test_a_frame_is_written_with_its_scale(kernel, tmp_path):
    found = measure_frame(row(), kernel, savings=Savings(), map_size=64, screen=False)
    found.save(tmp_path / "frame.exr")
    read = load_image(tmp_path / "frame.exr")
    np.testing.assert_allclose(read.pixels, found.picture.astype(np.float32), atol=0.0)
    assert read.mm_per_pixel == found.row.camera.mm_per_pixel
