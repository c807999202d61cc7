"""Light through the head: lengths against a literal march and closed forms, where it is thin."""

import numpy as np
import pytest
from reference_head import first_run, height_at
from test_head import SEEN, plane_point

from sssfit.errors import RenderError
from sssfit.process import thread_count
from sssfit.scene._field import HeightField, Lighting, Solid, light_field, light_through
from sssfit.scene._head_shape import EAR_MM, FLOOR_MM
from sssfit.scene._head_surface import SOLID_MM, solid_head
from sssfit.scene.head import _direction, head_scene

DISTANCE = SEEN["distance_mm"]
STEP_MM, GAP_MM = 0.02, 0.5


def solid_of(front, back, spacing=0.5, reach=60.0):
    """A solid of two formulas of x and y, and its front as a field of its own."""
    x = np.arange(-reach, reach + spacing / 2, spacing)
    heights = [f(x[None, :], x[:, None]) + np.zeros((x.size, x.size)) for f in (front, back)]
    return Solid(*heights, -reach, -reach, spacing), HeightField(
        heights[0], -reach, -reach, spacing
    )


def points_of(depth_mm):
    """Points (H, W, 3) that the pixels of ``SEEN`` see."""
    rows, columns = SEEN["shape"]
    x, y = plane_point(np.arange(rows)[:, None], np.arange(columns)[None, :])
    share = depth_mm / DISTANCE
    return np.stack(np.broadcast_arrays(x * share, y * share, DISTANCE - depth_mm), axis=-1)


@pytest.fixture(scope="module")
def head():
    """The smooth head as a body, and its front as what is seen: no sliver lies between them."""
    solid = solid_head(thread_count(None))  # as scenes have it: it is kept for one number
    return solid, HeightField(solid.front, solid.x0_mm, solid.y0_mm, solid.spacing_mm)


def normal_of(field, point, step=0.5):
    """Of a field, by differences over a millimetre."""
    slope = [
        height_at(*field, point[0] + dx, point[1] + dy)
        - height_at(*field, point[0] - dx, point[1] - dy)
        for dx, dy in ((step, 0.0), (0.0, step))
    ]
    normal = np.array((-slope[0], -slope[1], 2.0 * step))
    return normal / np.linalg.norm(normal)


def raw(solid):
    """What the literal march takes."""
    place = (solid.x0_mm, solid.y0_mm, solid.spacing_mm)
    return (solid.front, *place), (solid.back, *place)


@pytest.mark.parametrize("light_degrees", [170.0, 110.0, 45.0])
def test_lengths_are_those_of_a_fine_march(head, light_degrees):
    solid, front = head
    light = _direction(light_degrees, 20.0)
    thickness, cosines = light_through(front, solid, light, floor_mm=FLOOR_MM, **SEEN)
    seen = light_field(
        front, Lighting(light), floor_mm=FLOOR_MM, smooth=False, behind=solid, **SEEN
    )
    points = points_of(np.where(seen.labels > 0, seen.depth_mm, 0.0))
    thin = (thickness > 0.0) & (thickness < 40.0)
    draws = np.random.default_rng(3)
    chosen = [
        *draws.choice(np.argwhere(thin), 60, replace=False),
        *draws.choice(np.argwhere((thickness == 0.0) & (seen.labels > 0)), 20, replace=False),
        *draws.choice(np.argwhere(thickness >= 40.0), 20),
    ]
    kinds = {"thick": 0, "shadowed": 0}
    for i, j in chosen:
        start, stop, again = first_run(*raw(solid), points[i, j], light, STEP_MM, GAP_MM)
        if thickness[i, j] == 0.0:
            # Lit, or in the shadow of another part: nothing comes out of the body here.
            assert start > STEP_MM or stop < 1.0, (i, j)
            assert cosines[i, j] == 0.0
            continue
        assert thickness[i, j] == pytest.approx(stop - start, abs=2.0 * STEP_MM), (i, j)
        assert (cosines[i, j] == 0.0) == again, (i, j)
        kinds["thick"] += stop - start > 40.0
        kinds["shadowed"] += again
    assert kinds["thick"] > 5


def test_a_ball_has_its_chords_and_its_cosines():
    # Toward a light behind it, a chord from P is 2 R |N.L|, and enters at the angle it leaves at.
    radius = 40.0
    dome = lambda x, y: np.sqrt(np.maximum(radius**2 - x * x - y * y, 0.0))  # noqa: E731
    solid, front = solid_of(dome, lambda x, y: -dome(x, y), spacing=0.25, reach=45.0)
    view = {"shape": (20, 20), "mm_per_pixel": 3.0, "distance_mm": DISTANCE, "floor_mm": 1.0}
    light = np.array(_direction(115.0, 10.0))
    thickness, cosines = light_through(front, solid, tuple(light), **view)
    seen = light_field(front, Lighting((0.0, 0.0, 1.0)), smooth=False, **view)
    x = 3.0 * (np.arange(20)[None, :] - 9.5)
    y = 3.0 * (9.5 - np.arange(20)[:, None])
    share = np.where(seen.labels > 0, seen.depth_mm, 0.0) / DISTANCE
    normal = np.stack(np.broadcast_arrays(x * share, y * share, DISTANCE * (1 - share)), axis=-1)
    facing = normal @ light / radius
    inside = (seen.labels > 0) & (np.hypot(x, y) < 32.0)
    # Nodes are too far apart for the ball's equator, where both fields are upright.
    entry = normal[..., 2] - 2 * radius * facing * light[2]
    away, toward = inside & (facing < -0.05) & (np.abs(entry) > 10.0), inside & (facing > 0.05)
    assert away.sum() > 75
    assert toward.sum() > 7
    np.testing.assert_allclose(thickness[away], -2 * radius * facing[away], atol=0.05)
    np.testing.assert_allclose(cosines[away], -facing[away], atol=0.01)
    assert not thickness[toward].any()
    assert not cosines[toward].any()


@pytest.mark.parametrize("degrees", [180.0, 150.0, 120.0])
def test_a_slab_is_its_thickness_over_the_cosine(degrees):
    solid, front = solid_of(lambda x, y: 0.2 * x + 0 * y, lambda x, y: 0.2 * x + 0 * y - 3.0)
    view = {"shape": (8, 8), "mm_per_pixel": 1.0, "distance_mm": DISTANCE, "floor_mm": -50.0}
    light = np.array(_direction(degrees, 0.0))
    normal = np.array((-0.2, 0.0, 1.0)) / np.sqrt(1.04)
    thickness, cosines = light_through(front, solid, tuple(light), **view)
    np.testing.assert_allclose(thickness, 3.0 / np.sqrt(1.04) / -(normal @ light), rtol=1e-9)
    np.testing.assert_allclose(cosines, -(normal @ light), rtol=1e-9)


def test_a_light_behind_a_second_slab_does_not_come_through_the_first():
    # Two slabs 2 mm thick, 3 mm of air between them along x: the light is to the left of both.
    front = lambda x, y: np.where((np.abs(x) < 2.0) | (np.abs(x + 10) < 2.0), 20.0, -20.0) + 0 * y  # noqa: E731
    solid, field = solid_of(front, lambda x, y: -19.0 + 0 * (x + y), spacing=0.1, reach=20.0)
    view = {"shape": (1, 40), "mm_per_pixel": 1.0, "distance_mm": 1e5, "floor_mm": 0.0}
    thickness, cosines = light_through(field, solid, (-1.0, 0.0, 0.0), **view)
    x = np.arange(40) - 19.5
    # On the tops the surface is level with the light: nothing faces away; the sides are not seen.
    assert not cosines[0, np.abs(x) < 1.5].any()
    tilted = (-np.cos(0.1), 0.0, -np.sin(0.1))
    thickness, cosines = light_through(field, solid, tilted, **view)
    right, left = np.abs(x) < 1.5, np.abs(x + 10.0) < 1.5
    np.testing.assert_allclose(thickness[0, right], (x[right] + 2.0) / np.cos(0.1), atol=0.15)
    np.testing.assert_allclose(thickness[0, left], (x[left] + 12.0) / np.cos(0.1), atol=0.15)
    assert not cosines[0, right].any()
    assert (cosines[0, left] > 0.5).all()


def test_ears_and_nose_are_thin_and_the_face_is_not():
    size = {"height": 105, "width": 90, "mm_per_pixel": 2.0, "detail_mm": 0.0, "transmit": True}
    scene = head_scene(light_degrees=175.0, light_up_degrees=5.0, **size)

    def at(x_mm, y_mm):
        """Pixel that shows a place of the head, of depth z = -82 for the ears."""
        share = DISTANCE / (DISTANCE + 82.0) if abs(x_mm) > 60 else 1.0
        return int(52.5 - y_mm * share / 2.0), int(45.0 + x_mm * share / 2.0)

    for side in (-1.0, 1.0):
        ear = scene.thickness_mm[at(side * 78.0, 8.0)]
        assert 0.8 * EAR_MM < ear < 2.0 * EAR_MM, "an ear"
        assert scene.back_irradiance[at(side * 78.0, 8.0)] > 0.5
    assert scene.thickness_mm[at(0.0, 0.0)] > 150.0, "from the bridge of the nose to the occiput"
    # With the light at the nose's left, its right flank is as thick as the nose is wide.
    beside = head_scene(light_degrees=80.0, light_up_degrees=5.0, **size)
    assert 5.0 < beside.thickness_mm[at(9.0, -8.0)] < 25.0
    assert beside.back_irradiance[at(9.0, -8.0)] > 0.3
    assert beside.thickness_mm[at(50.0, -10.0)] > 60.0, "the cheek"


def test_buffers_join_and_leave_the_rest_alone():
    size = {"height": 40, "width": 60, "mm_per_pixel": 4.0, "detail_mm": 0.0, "smooth": False}
    plain, carrying = head_scene(**size), head_scene(transmit=True, **size)
    assert plain.thickness_mm is None
    assert plain.back_irradiance is None
    for name in ("irradiance", "specular", "depth_mm", "mask"):
        np.testing.assert_array_equal(getattr(plain, name), getattr(carrying, name))
    nothing = carrying.mask == 0
    assert not carrying.thickness_mm[nothing].any()
    assert not carrying.back_irradiance[nothing].any()
    # Transmitted light comes where the key light itself does not.
    lit = carrying.irradiance[..., 0] > 0.06 + 0.05 + 0.01
    assert not carrying.back_irradiance[lit].any()
    one, three = (head_scene(transmit=True, threads=n, **size) for n in (1, 3))
    np.testing.assert_array_equal(one.thickness_mm, three.thickness_mm)
    np.testing.assert_array_equal(one.back_irradiance, three.back_irradiance)


def test_a_light_behind_leaves_the_face_to_the_others_and_lights_the_rim():
    size = {"height": 105, "width": 90, "mm_per_pixel": 2.0, "detail_mm": 0.0}
    scene = head_scene(light_degrees=150.0, light_up_degrees=5.0, **size)
    light = scene.irradiance[..., 0]
    assert light[52, 45] <= 0.06 + 0.05, "the nose"
    assert light[52, 45] > 0.02, "the fill light stands before the face"
    rim = light[20:36, :45].max(axis=1)
    assert (rim > 0.2).all(), "the side of the head where the light stands"
    assert light[20:36, 45:].max() < 0.12, "the other side"


def test_shadows_of_a_light_behind_are_those_of_a_fine_march(head):
    solid, front = head
    light = _direction(120.0, 20.0)
    seen = light_field(
        front, Lighting(light), floor_mm=FLOOR_MM, smooth=False, behind=solid, **SEEN
    )
    facing = light_field(
        front,
        Lighting(light, light, (0.0, 1.0, 0.0)),
        floor_mm=FLOOR_MM,
        smooth=False,
        behind=solid,
        **SEEN,
    ).irradiance
    points = points_of(np.where(seen.labels > 0, seen.depth_mm, 0.0))
    # Not grazed, where a tenth of a millimetre more or less off the surface would decide.
    chosen = np.random.default_rng(5).choice(np.argwhere(facing > 0.15), 150, replace=False)
    dark = 0
    for i, j in chosen:
        off = points[i, j] + 0.3 * normal_of(raw(solid)[0], points[i, j])
        _, stop, _ = first_run(*raw(solid), off, light, STEP_MM, GAP_MM)
        expected = 0.0 if stop > 0.0 else facing[i, j]
        assert seen.irradiance[i, j] == pytest.approx(expected, abs=1e-12), (i, j)
        dark += stop > 0.0
    assert 10 < dark < 140


def test_a_light_too_far_round_is_refused():
    with pytest.raises(RenderError, match="light_degrees = 181; expected -180 to 180"):
        head_scene(height=8, width=8, mm_per_pixel=1.0, light_degrees=181.0)


def test_the_solid_is_as_fine_as_an_ear_needs():
    assert SOLID_MM <= EAR_MM / 6.0
