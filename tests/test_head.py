"""The lit head: meetings and shadows against literal marches, light against closed forms."""

import numpy as np
import pytest
from reference_head import blocked, first_meeting, height_at

from sssfit.errors import RenderError
from sssfit.scene._field import HeightField, Lighting, light_field
from sssfit.scene._head_shape import FLOOR_MM
from sssfit.scene._head_surface import EYE_X, EYE_Y, _roughness, bust, face
from sssfit.scene.head import FACE_HEIGHT_MM, head_scene, whole_face_mm_per_pixel

KEY = (-0.579227965, 0.573576436, 0.579227965)
KEY = tuple(np.array(KEY) / np.linalg.norm(KEY))
DISTANCE = 600.0
SEEN = {"shape": (120, 100), "mm_per_pixel": 2.0, "distance_mm": DISTANCE}


def raw(field):
    """What the literal march takes."""
    return field.heights, field.x0_mm, field.y0_mm, field.spacing_mm


def surface(height, spacing=0.5, reach=60.0):
    """A field of a formula of x and y."""
    x = np.arange(-reach, reach + spacing / 2, spacing)
    return HeightField(height(x[None, :], x[:, None]), -reach, -reach, spacing)


def plane_point(i, j):
    """Where the centre of a pixel of ``SEEN`` lies on the plane z = 0."""
    rows, columns = SEEN["shape"]
    return (j + 0.5 - columns / 2) * 2.0, (rows / 2 - i - 0.5) * 2.0


@pytest.fixture(scope="module")
def head():
    """The smooth head on nodes 1 mm apart, lit by the key light alone."""
    field = bust(1.0, 2)
    return field, light_field(field, Lighting(KEY), floor_mm=FLOOR_MM, smooth=False, **SEEN)


def test_depth_is_where_a_fine_march_goes_under(head):
    field, seen = head
    draws = np.random.default_rng(1)
    for i, j in zip(draws.integers(120, size=200), draws.integers(100, size=200), strict=True):
        expected = first_meeting(raw(field), DISTANCE, *plane_point(i, j), 0.05)
        if expected > DISTANCE - FLOOR_MM:
            assert seen.labels[i, j] == 0
            assert np.isinf(seen.depth_mm[i, j])
        else:
            # The march may step over a ridge that the ray cuts for less than its step.
            assert seen.depth_mm[i, j] == pytest.approx(expected, abs=0.05)


def test_a_point_is_dark_where_a_fine_march_is_blocked(head):
    field, seen = head
    lit = np.where(seen.labels > 0, seen.irradiance > 0.0, -1)
    same = np.ones(lit.shape, bool)
    for axis in (0, 1):
        for step in (-1, 1):
            same &= np.roll(lit, step, axis) == lit
    rows, columns = np.nonzero(same & (seen.labels > 0))
    chosen = np.random.default_rng(2).choice(rows.size, 300, replace=False)
    dark = 0
    for i, j in zip(rows[chosen], columns[chosen], strict=True):
        x, y = plane_point(i, j)
        share = seen.depth_mm[i, j] / DISTANCE
        point = (x * share, y * share, DISTANCE - seen.depth_mm[i, j])
        expected = blocked(raw(field), point, KEY, 0.02)
        assert (seen.irradiance[i, j] == 0.0) == expected, (i, j)
        dark += expected
    assert 30 < dark < 270


def test_a_tilted_plane_has_the_cosine_everywhere():
    field = surface(lambda x, y: 0.3 * x - 0.2 * y)
    seen = light_field(
        field, Lighting(KEY), shape=(40, 40), mm_per_pixel=1.0, distance_mm=DISTANCE, floor_mm=-90.0
    )
    normal = np.array((-0.3, 0.2, 1.0)) / np.sqrt(1.13)
    np.testing.assert_allclose(seen.irradiance, normal @ KEY, rtol=1e-10)
    # Depth along the axis: the ray (x, y, -D) t over the plane.
    x = np.arange(40)[None, :] - 19.5
    y = 19.5 - np.arange(40)[:, None]
    t = DISTANCE / (DISTANCE + 0.3 * x - 0.2 * y)
    np.testing.assert_allclose(seen.depth_mm, DISTANCE * t, rtol=1e-12)


def test_a_sphere_nears_its_cosine_with_the_square_of_the_spacing():
    errors = []
    for spacing in (1.0, 0.5, 0.25):
        field = surface(
            lambda x, y: np.sqrt(np.maximum(2500.0 - x * x - y * y, 0.0)), spacing, 45.0
        )
        seen = light_field(
            field,
            Lighting((0.0, 0.0, 1.0)),
            shape=(30, 30),
            mm_per_pixel=1.0,
            distance_mm=DISTANCE,
            floor_mm=-1.0,
            smooth=False,
        )
        # Light from the eye's side: the cosine is z / R.
        error = seen.irradiance - (DISTANCE - seen.depth_mm) / 50.0
        errors.append(float(np.sqrt(np.mean(error**2))))
    assert 3.0 < errors[0] / errors[1] < 5.0
    assert 3.0 < errors[1] / errors[2] < 5.0
    assert errors[2] < 1e-4


def test_the_shadow_of_a_step_has_its_length_to_a_fraction_of_a_pixel():
    # A wall 10 mm high that ends at x = 0; light from the left, 45 degrees up: 10 mm of shadow.
    field = surface(lambda x, y: np.where(x < -0.01, 10.0, 0.0) + 0.0 * y, 0.05, 20.0)
    light = (-np.sqrt(0.5), 0.0, np.sqrt(0.5))
    seen = light_field(
        field, Lighting(light), shape=(4, 44), mm_per_pixel=0.7, distance_mm=1e5, floor_mm=-1.0
    )
    ground = seen.irradiance[:, 22:] / np.sqrt(0.5)
    # The wall's face is one cell wide, x = -0.05 to 0; 21 samples a pixel at the edge.
    assert (0.7 * (1.0 - ground).sum(axis=1)) == pytest.approx(np.full(4, 9.975), abs=0.06)
    assert ((ground > 0.1) & (ground < 0.9)).any(), "no pixel shows part of the edge"


def test_a_slanted_shadow_has_many_shades_not_steps():
    field = surface(lambda x, y: np.where(x < 0.3 * y, 5.0, 0.0), 0.1, 20.0)
    light = (-np.sqrt(0.5), 0.0, np.sqrt(0.5))
    seen = light_field(
        field, Lighting(light), shape=(20, 44), mm_per_pixel=0.5, distance_mm=1e5, floor_mm=-1.0
    )
    ground = seen.irradiance[:, 28:] / np.sqrt(0.5)
    # Of 21 samples, five of them on a coarser pattern that alone would make four shades.
    shades = np.unique(np.round(21.0 * ground[(ground > 0.01) & (ground < 0.99)]))
    assert shades.size > 6


def test_shadows_come_from_outside_the_fine_field_too():
    flat = surface(lambda x, y: 0.0 * (x + y), 0.5, 10.0)
    wall = surface(lambda x, y: np.where(np.abs(x + 40.0) < 5.0, 100.0, 0.0) + 0.0 * y, 1.0)
    light = (-np.sqrt(0.5), 0.0, np.sqrt(0.5))
    view = {"shape": (8, 8), "mm_per_pixel": 1.0, "distance_mm": DISTANCE, "floor_mm": -1.0}
    assert (light_field(flat, Lighting(light), **view).irradiance > 0.7).all()
    assert not light_field(flat, Lighting(light), coarse=wall, **view).irradiance.any()


def test_buffers_agree_about_the_background():
    scene = head_scene(height=96, width=128, mm_per_pixel=2.5, detail_mm=0.0)
    nothing = scene.mask == 0
    assert 0.2 < nothing.mean() < 0.9
    assert np.isinf(scene.depth_mm[nothing]).all()
    assert np.isfinite(scene.depth_mm[~nothing]).all()
    assert not scene.irradiance[nothing].any()
    assert not scene.specular[nothing].any()
    assert scene.irradiance.max() <= 1.0 + 0.06 + 0.05


def test_a_pixel_has_the_light_of_its_normal(head):
    # Key, fill and ambient light with their highlights, literally, from a normal by differences:
    # the mean of four nodes' central differences is the central difference of bilinear heights.
    field, key_only = head
    fill, strengths, exponent, face_on = (0.6, 0.0, 0.8), (1.0, 0.06, 0.05), 20.0, 0.028
    lighting = Lighting(KEY, fill, strengths, exponent, face_on)
    seen = light_field(field, lighting, floor_mm=FLOOR_MM, smooth=False, **SEEN)
    chosen = np.random.default_rng(4).choice(np.argwhere(seen.labels > 0), 300, replace=False)
    dark = 0
    for i, j in chosen:
        x, y = plane_point(i, j)
        share = seen.depth_mm[i, j] / DISTANCE
        slope = [
            height_at(*raw(field), x * share + dx, y * share + dy)
            - height_at(*raw(field), x * share - dx, y * share - dy)
            for dx, dy in ((1.0, 0.0), (0.0, 1.0))
        ]
        normal = np.array((-slope[0], -slope[1], 2.0))
        normal /= np.linalg.norm(normal)
        eye = np.array((-x, -y, DISTANCE))
        eye /= np.linalg.norm(eye)
        is_lit = key_only.irradiance[i, j] > 0.0
        irradiance = strengths[2] * (1.0 + normal[1]) / 2.0
        specular = 0.0
        for light, strength in ((KEY, strengths[0] * is_lit), (fill, strengths[1])):
            half = (np.array(light) + eye) / np.linalg.norm(np.array(light) + eye)
            fresnel = face_on + (1.0 - face_on) * (1.0 - half @ eye) ** 5
            cosine = max(normal @ light, 0.0)
            irradiance += strength * cosine
            bright = fresnel * (exponent + 8.0) / 8.0 * max(normal @ half, 0.0) ** exponent
            specular += strength * cosine * bright
        assert seen.irradiance[i, j] == pytest.approx(irradiance, rel=1e-9), (i, j)
        assert seen.specular[i, j] == pytest.approx(specular, rel=1e-9, abs=1e-15), (i, j)
        dark += not is_lit
    assert 30 < dark < 270


def test_light_of_planes():
    view = {"shape": (3, 3), "mm_per_pixel": 0.01, "distance_mm": 1e5, "floor_mm": -90.0}
    # Lamp and eye on the axis: .028 (20 + 8) / 8.
    flat = surface(lambda x, y: 0.0 * (x + y))
    seen = light_field(flat, Lighting((0.0, 0.0, 1.0), exponent=20.0, face_on=0.028), **view)
    np.testing.assert_allclose(seen.specular, 0.0980, rtol=1e-9)
    np.testing.assert_allclose(seen.irradiance, 1.0, rtol=1e-12)
    # Ambient light alone: half of 1 + .2 / sqrt(1.13).
    tilted = surface(lambda x, y: 0.3 * x - 0.2 * y)
    seen = light_field(tilted, Lighting(KEY, strengths=(0.0, 0.0, 1.0)), **view)
    np.testing.assert_allclose(seen.irradiance, 0.594072, atol=5e-7)
    # Fill light alone, from below the plane's horizon and from above it.
    for fill, cosine in (((0.6, 0.0, 0.8), 0.62 / np.sqrt(1.13)), ((0.8, -0.6, 0.0), 0.0)):
        seen = light_field(tilted, Lighting(KEY, fill, (0.0, 1.0, 0.0)), **view)
        np.testing.assert_allclose(seen.irradiance, cosine, rtol=1e-9, atol=1e-15)


def test_the_face_is_symmetric_under_light_from_the_front():
    scene = head_scene(
        height=101, width=120, mm_per_pixel=2.0, light_degrees=0.0, detail_mm=0.0, smooth=False
    )
    light = scene.irradiance[..., 0]
    np.testing.assert_array_equal(scene.mask, scene.mask[:, ::-1])
    seen = scene.mask > 0
    np.testing.assert_allclose(scene.depth_mm[seen], scene.depth_mm[:, ::-1][seen], rtol=1e-9)
    np.testing.assert_allclose(light, light[:, ::-1], atol=1e-6)


def test_one_thread_or_three_make_the_same_bits():
    size = {"height": 48, "width": 64, "mm_per_pixel": 0.3}
    one, three = (head_scene(**size, threads=threads) for threads in (1, 3))
    for name in ("irradiance", "specular", "depth_mm", "mask"):
        np.testing.assert_array_equal(getattr(one, name), getattr(three, name))


def test_a_crop_and_the_whole_show_the_same_place():
    whole = head_scene(height=200, width=200, mm_per_pixel=0.5, detail_mm=0.0, smooth=False)
    crop = head_scene(height=40, width=40, mm_per_pixel=0.5, detail_mm=0.0, smooth=False)
    part = np.s_[80:120, 80:120]
    np.testing.assert_allclose(crop.depth_mm, whole.depth_mm[part], rtol=1e-9)
    # Outside the crop shadows come from the coarse grid: their edges may move by part of a pixel.
    moved = np.abs(crop.irradiance - whole.irradiance[part]) > 1e-9
    assert moved.mean() < 0.02


def test_the_nose_casts_a_shadow_on_the_cheek_away_from_the_light():
    scene = head_scene(height=200, width=200, mm_per_pixel=1.0, detail_mm=0.0)
    # 21 mm to either side of the middle, below the nose's wings.
    row, left, right = 100 + 36, 100 - 21, 100 + 21
    assert scene.irradiance[row, left, 0] > 0.5
    assert scene.irradiance[row, right, 0] < 0.11


def test_real_size():
    y = np.arange(-140.0, 140.0, 0.5)[:, None]
    x = np.arange(-100.0, 100.0, 0.5)[None, :]
    z, eyes = face(x, y)
    tip = np.unravel_index(z.argmax(), z.shape)
    assert abs(x[0, tip[1]]) <= 0.5
    assert -24.0 < y[tip[0], 0] < -12.0
    assert 20.0 < z.max() < 26.0
    middle = z[:, 200]
    chin = y[1:][np.diff(middle) > 4.0].min()
    crown = y[:, 0][middle > -110.0].max()
    assert 225.0 < crown - chin < 240.0
    opening = eyes > 0.0
    columns = x[0][opening.any(axis=0) & (x[0] > 0)]
    assert 26.0 < np.ptp(columns) < 32.0
    assert columns.min() < EYE_X < columns.max()
    assert opening[np.argmin(np.abs(y[:, 0] - EYE_Y)), np.argmin(np.abs(x[0] - EYE_X))]


def test_the_halves_meet_without_a_crease():
    y = np.arange(-95.0, 125.0, 0.25)[:, None]
    z, _ = face(np.array([[0.0, 0.01]]), y)
    # Smooth and symmetric: the slope is 0 in the middle, and 0.005 mm off it the curvature's
    # 0.005 / R: a ridge of 1 mm radius would have 0.005; the eye sees creases from 0.02 on.
    assert np.abs(np.diff(z, axis=1) / 0.01).max() < 0.01


def test_pores_show_close_up_and_are_left_out_of_coarse_grids():
    smooth, rough = (
        head_scene(height=60, width=60, mm_per_pixel=0.1, detail_mm=d) for d in (0.0, 0.1)
    )
    relief = rough.depth_mm - smooth.depth_mm
    # A pore is 0.04 to 0.1 mm deep; a few overlap, and the roughness beside them is about as high.
    assert 0.02 < np.std(relief) < 0.1
    # From pixel to pixel the light changes more than over the smooth nose.
    steps = [np.std(np.diff(scene.irradiance, axis=0)) for scene in (rough, smooth)]
    assert steps[0] > 2.0 * steps[1]
    x = np.arange(0.0, 50.0, 2.5)
    assert not _roughness(x[None, :], x[:, None], 2.5).any()


def test_the_whole_face_fits():
    mm_per_pixel = whole_face_mm_per_pixel(100, 160)
    assert mm_per_pixel == pytest.approx(FACE_HEIGHT_MM / 100)
    scene = head_scene(height=100, width=160, mm_per_pixel=mm_per_pixel, detail_mm=0.0)
    assert (scene.mask == 2).any()
    # The chin's edge, where the neck is 30 mm behind.
    assert np.diff(scene.depth_mm[60:, 80]).max() > 20.0
    assert whole_face_mm_per_pixel(1000, 100) == pytest.approx(1.65)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"distance_mm": 20.0}, "distance_mm = 20; expected 100"),
        ({"distance_mm": float("nan")}, "distance_mm = nan"),
        ({"light_degrees": float("nan")}, "light_degrees = nan; expected -180 to 180"),
        ({"light_up_degrees": 90.0}, "light_up_degrees = 90"),
        ({"detail_mm": -1.0}, "detail_mm = -1; expected 0 to 0.5"),
        ({"fill": 2.0}, "fill = 2"),
        ({"height": -1}, "height = -1; expected a whole number"),
        ({"height": 0}, "height = 0; expected a whole number"),
        ({"mm_per_pixel": 0.0}, "mm_per_pixel = 0; expected a number above 0"),
    ],
)
def test_bad_values_are_named_in_one_line(options, message):
    with pytest.raises(RenderError, match=f"head: {message}") as caught:
        head_scene(**{"height": 8, "width": 8, "mm_per_pixel": 1.0, **options})
    assert "\n" not in str(caught.value)
