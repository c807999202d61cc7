"""Which pixels of a disk and an edge count: by distances one by one, and the same at every size."""

import math

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from sssfit.compare.candidates import Candidate
from sssfit.compare.pareto import compare_kernels
from sssfit.compare.references import border_of, evaluated_scene, references
from sssfit.errors import RenderError
from sssfit.fit import support_of
from sssfit.material import load_material
from sssfit.scene.made import make_scene
from sssfit.scene.record import Scene
from sssfit.simulate import simulate_exact

PITCH = 1.2
SOME = (
    Candidate("svd 2", "svd", 2, {"rank": 2}),
    Candidate("svd 2, kept", "svd", 2, {"rank": 2, "energy": "keep"}),
    Candidate("pre-integrated", "preintegrated", 1),
)


@pytest.fixture(scope="module")
def skin1():
    return simulate_exact(load_material("skin1"))


def scene_of(name, size, **options):
    return make_scene(name, height=size, width=size, mm_per_pixel=PITCH, **options)


def near(places, chosen, reach):
    """Whether each place has a chosen one within reach, all pairs."""
    return (cdist(places, chosen) <= reach).any(axis=1).tolist()


def test_of_a_disk_what_is_near_a_lit_pixel_counts(skin1):
    # 57.6 mm: the disk fits, its light (19.2 + 21.4 mm to every side) does not.
    scene = scene_of("disk", 48)
    found = evaluated_scene(scene, skin1)
    added = (found.width - 48) // 2
    assert found.width * PITCH >= 2.0 * (19.2 + support_of(skin1))
    inside = found.irradiance[added : added + 48, added : added + 48]
    np.testing.assert_array_equal(inside, scene.irradiance)
    assert np.count_nonzero(found.irradiance) == np.count_nonzero(scene.irradiance)
    places = list(np.ndindex(found.mask.shape))
    lit = [tuple(each) for each in np.argwhere(found.irradiance[..., 0] > 0.0)]
    expected = near(places, lit, support_of(skin1) / PITCH)
    assert found.mask.ravel().tolist() == expected


@pytest.mark.parametrize("angle", [0.0, 30.0, 90.0, 120.0])
def test_of_an_edge_what_is_near_it_and_off_its_ends_counts(skin1, angle):
    scene = scene_of("edge", 56, angle_degrees=angle)
    found = evaluated_scene(scene, skin1)
    np.testing.assert_array_equal(found.irradiance, scene.irradiance)
    light, reach = scene.irradiance[..., 0], support_of(skin1) / PITCH
    places = list(np.ndindex(light.shape))
    lit, dark = (
        [tuple(each) for each in np.argwhere(chosen)] for chosen in (light > 0.0, light < 1.0)
    )
    along = 0 if angle in (0.0, 30.0) else 1  # the axis that the edge runs along, more or less
    room = math.ceil(reach)
    expected = [
        one and other and room <= place[along] < 56 - room
        for place, one, other in zip(
            places, near(places, lit, reach), near(places, dark, reach), strict=True
        )
    ]
    assert found.mask.ravel().tolist() == expected


def test_pictures_of_ones_own_count_as_they_are(skin1):
    own = Scene("mine.exr", scene_of("disk", 48).irradiance, PITCH)
    assert evaluated_scene(own, skin1) is own
    masked = Scene("disk", own.irradiance, PITCH, mask=np.ones((48, 48), int))
    assert evaluated_scene(masked, skin1) is masked
    points = scene_of("points", 48)
    assert evaluated_scene(points, skin1) is points
    assert border_of(points) == "mirror"


def test_a_black_picture_is_refused_by_its_name(skin1):
    with pytest.raises(RenderError, match=r"^night\.exr is black; expected a picture with light\."):
        references([Scene("night.exr", np.zeros((4, 5, 3)), PITCH)], skin1)


def test_where_the_disk_does_not_fit_the_picture_stays_as_it_is(skin1):
    small = scene_of("disk", 31)  # 37.2 mm
    assert evaluated_scene(small, skin1).width == 31


@pytest.mark.parametrize("name", ["skin1", "marble"])
def test_the_size_of_the_picture_does_not_change_the_figures(name):
    # Marble has 2.2 % of its red beyond the grid, which a mirrored picture puts everywhere.
    profile = simulate_exact(load_material(name))
    found = {}
    for size in (54, 90, 128):  # 65, 108 and 154 mm
        scenes = [scene_of("disk", size), scene_of("edge", size, angle_degrees=30.0)]
        rows = compare_kernels(profile, scenes, candidates=SOME).rows
        for row in rows:
            assert row.delta_e_2000_mean > 0.05
            figures = (row.delta_e_2000_mean, row.delta_e_2000_p95, row.relative_l2)
            found.setdefault((row.label, row.picture), []).append(figures)
    for (_, picture), figures in found.items():
        # A disk's are the same but for rounding. An edge ends on other parts of pixels: they came
        # out within 0.5 %; before, a disk's differed by factors of up to 4.
        spread = np.ptp(figures, axis=0) / np.mean(figures, axis=0)
        assert spread.max() < (1e-6 if picture == "disk" else 0.015)
