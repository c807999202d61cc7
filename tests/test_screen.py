"""Screen space against a literal shader, flat convolution, and what masks and slopes must do."""

import math
import runpy
from pathlib import Path

import numpy as np
import pytest
from reference_screen import exact_pass, pixels_per_mm, slow_flat, slow_screen

from sssfit import shapes
from sssfit.errors import RenderError
from sssfit.kernel import SeparableKernel
from sssfit.render.screen import LERP_SIGMAS, lerp_falloff, render_screen, second_moments
from sssfit.scene.record import Scene

ROOT = Path(__file__).parents[1]
PITCH_MM, DISTANCE_MM = 0.5, 300.0


def make_kernel(weights, signs=None, *, pitch_mm=PITCH_MM, scale=None, parameters=None):
    """A kernel from passes (T, P, C)."""
    terms, _, channels = np.shape(weights)
    return SeparableKernel(
        method="by hand",
        mm_per_pixel=pitch_mm,
        channels=tuple("RGB"[:channels]),
        signs=np.ones((terms, channels)) if signs is None else signs,
        weights=weights,
        relative_frobenius_error=np.full(channels, np.nan),
        energy_error=np.full(channels, np.nan),
        scale=np.ones(channels) if scale is None else scale,
        parameters=parameters or {},
        meta={},
    )


def random_kernel(rng, terms=2, half=3, channels=3, **more):
    """Signed, symmetric passes whose energies are those of no material."""
    side = rng.normal(size=(terms, half + 1, channels))
    return make_kernel(
        np.concatenate((side[:, :0:-1], side), axis=1),
        rng.choice((-1.0, 1.0), (terms, channels)),
        scale=rng.uniform(0.2, 1.0, channels),
        **more,
    )


def gaussian_kernel(variance_mm2, *, pitch_mm=PITCH_MM, half=8, **more):
    """One Gaussian, sampled, of energy 1."""
    x = pitch_mm * np.arange(-half, half + 1)
    half_pass = np.exp(-(x**2) / (2 * variance_mm2))
    return make_kernel((half_pass / half_pass.sum())[None, :, None], pitch_mm=pitch_mm, **more)


def make_scene(irradiance, depth_mm=DISTANCE_MM, **more):
    """A scene in perspective; a number is the depth everywhere."""
    height, width, _ = irradiance.shape
    more = {"mm_per_pixel": PITCH_MM, "distance_mm": DISTANCE_MM} | more
    depth = np.broadcast_to(depth_mm, (height, width))
    return Scene("test", irradiance, depth_mm=depth, **more)


def slope(height, width, degrees, mm_per_pixel=PITCH_MM):
    """Depth of a plane tilted about the vertical, nearly seen from straight above."""
    x = mm_per_pixel * (np.arange(width) - width // 2)
    return 1e6 + np.tan(np.radians(degrees)) * np.broadcast_to(x, (height, width))


@pytest.fixture
def rng():
    return np.random.default_rng(7)


VARIANCES_MM2, FALLOFF_PER_MM = (4.0, 9.0, 2.0), 0.11
GIVEN = {
    "none": {},
    "lerp": {"falloff_per_mm": FALLOFF_PER_MM},
    "gaussian": {"depth_variance_mm2": VARIANCES_MM2},
}


def keep_of(follow):
    """By channel, the share of a sample's light that stays, as the papers have it."""

    def keep(channel):
        def share(dz, scale):
            if follow == "lerp":
                return 1 - min(FALLOFF_PER_MM * abs(dz), 1.0)
            if follow == "gaussian":
                return np.exp(-((dz / scale) ** 2) / (2 * VARIANCES_MM2[channel]))
            return 1.0

        return share

    return keep


@pytest.mark.parametrize("border", ["mirror", "clamp", "zero"])
@pytest.mark.parametrize(
    ("follow", "lost"),
    [
        *(("gaussian", each) for each in ("mean", "middle", "none")),
        *(("lerp", "middle"), ("none", "mean")),
    ],
)
def test_all_options_against_the_literal_shader(rng, border, follow, lost):
    shape = (7, 9)
    scene = make_scene(
        rng.random((*shape, 3)),
        rng.uniform(150.0, 155.0, shape),
        mask=rng.integers(0, 3, shape),
        specular=rng.random((*shape, 1)),
    )
    kernel, scale = random_kernel(rng), rng.uniform(0.1, 2.0, shape)
    settings = {"scale": scale, "border": border, "lost": lost}
    slow = slow_screen(scene, kernel, keep=keep_of(follow), **settings)
    for threads in (1, 3):
        fast = render_screen(
            scene, kernel, follow=follow, threads=threads, **settings, **GIVEN[follow]
        )
        np.testing.assert_allclose(fast, slow, rtol=0, atol=1e-12)


@pytest.mark.parametrize("border", ["mirror", "clamp", "zero"])
@pytest.mark.parametrize("follow", ["none", "lerp", "gaussian"])
def test_a_plane_facing_the_eye_is_a_flat_convolution(rng, border, follow):
    # 4 rows: the kernel reaches beyond the picture's mirror image.
    irradiance, kernel = rng.random((4, 11, 3)), random_kernel(rng, half=5)
    seen = render_screen(make_scene(irradiance), kernel, follow=follow, border=border)
    flat = slow_flat(irradiance, kernel, border) * kernel.scale
    np.testing.assert_allclose(seen, flat, rtol=0, atol=1e-12)


def test_the_distance_is_the_field_of_view(rng):
    scene = make_scene(rng.random((6, 8, 1)))
    for depth_mm in (20.0, 300.0, 7000.0):
        from_distance = DISTANCE_MM / (depth_mm * PITCH_MM)
        assert pixels_per_mm(scene, depth_mm) == pytest.approx(from_distance, rel=1e-14)


def test_twice_as_far_is_half_the_blur():
    irradiance = np.zeros((65, 65, 1))
    irradiance[32, 32] = 1.0
    # Two pixels a sample at the distance, one at twice the distance: no interpolation.
    kernel = gaussian_kernel(6.0, pitch_mm=2 * PITCH_MM, half=7)
    x = np.arange(65) - 32
    deviations = []
    for depth_mm in (DISTANCE_MM, 2 * DISTANCE_MM):
        point = render_screen(make_scene(irradiance, depth_mm), kernel)[..., 0]
        assert point.sum() == pytest.approx(1.0, abs=1e-14)
        deviations.append(np.sqrt(x**2 @ point.sum(axis=0)))
    assert deviations[0] == pytest.approx(2 * deviations[1], rel=1e-12)


def test_both_directions_scale_alike_in_a_wide_picture():
    irradiance = np.zeros((31, 101, 1))
    irradiance[15, 50] = 1.0
    point = render_screen(make_scene(irradiance), gaussian_kernel(1.0), border="zero")[..., 0]
    np.testing.assert_allclose(point[15, 42:59], point[7:24, 50], rtol=0, atol=1e-15)


@pytest.mark.parametrize("follow", ["none", "lerp", "gaussian"])
def test_even_light_stays_even_on_any_surface(rng, follow):
    shape = (9, 12)
    scene = make_scene(
        np.ones((*shape, 1)), rng.uniform(100.0, 110.0, shape), mask=rng.integers(1, 3, shape)
    )
    kernel = random_kernel(rng)
    out = render_screen(scene, kernel, follow=follow, scale=rng.uniform(0.0, 2.0, shape))
    even = np.broadcast_to(kernel.energy * kernel.scale, out.shape)
    np.testing.assert_allclose(out, even, rtol=0, atol=1e-12)


@pytest.mark.parametrize("follow", ["none", "lerp", "gaussian"])
def test_no_light_crosses_the_mask(rng, follow):
    shape = (12, 14)
    mask = np.ones(shape, int)
    mask[:, 6:], mask[8:, 3:9] = 2, 0
    depth = rng.uniform(120.0, 125.0, shape)
    before = rng.random((*shape, 3))
    kernel = random_kernel(rng, half=5)
    for changed in (0, 1, 2):
        after = np.where((mask == changed)[..., None], 1000 * rng.random((*shape, 3)), before)
        one, other = (
            render_screen(make_scene(each, depth, mask=mask), kernel, follow=follow)
            for each in (before, after)
        )
        elsewhere = mask != changed
        np.testing.assert_array_equal(one[elsewhere], other[elsewhere])
        assert (one[~elsewhere] != other[~elsewhere]).all()


def test_what_is_no_object_comes_back_as_it_was(rng):
    shape = (6, 8)
    mask, depth = rng.integers(0, 2, shape), rng.uniform(200.0, 300.0, shape)
    mask[2, 3], mask[4, 5], mask[1, 1] = 1, 2, 0
    depth[mask == 0] = 0.0
    # In the mask, but the eye meets nothing there: this is no object either.
    depth[2, 3] = depth[4, 5] = np.inf
    irradiance = rng.random((*shape, 1))
    out = render_screen(make_scene(irradiance, depth, mask=mask), random_kernel(rng))
    for nothing in (mask == 0, np.isinf(depth)):
        assert nothing.any()
        expected = np.broadcast_to(irradiance, out.shape)[nothing]
        np.testing.assert_array_equal(out[nothing], expected)
    object_mask = (mask > 0) & np.isfinite(depth)
    assert (out[object_mask] != irradiance[object_mask]).all()
    assert np.isfinite(out).all()


def test_no_light_comes_from_a_pixel_of_infinite_depth(rng):
    irradiance, depth = rng.random((1, 9, 1)), np.full((1, 9), DISTANCE_MM)
    depth[0, 4] = np.inf
    kernel = gaussian_kernel(1.0, half=3)
    mask = np.ones((1, 9), int)
    dark = render_screen(make_scene(irradiance, depth, mask=mask), kernel)
    irradiance[0, 4] = 1000.0
    bright = render_screen(make_scene(irradiance, depth, mask=mask), kernel)
    np.testing.assert_array_equal(np.delete(dark, 4, axis=1), np.delete(bright, 4, axis=1))
    assert bright[0, 4, 0] == 1000.0


def test_scale_zero_leaves_a_pixel_unblurred(rng):
    irradiance, kernel = rng.random((8, 9, 3)), random_kernel(rng)
    scale = np.ones((8, 9))
    scale[:, 4] = 0.0
    scene = make_scene(irradiance, rng.uniform(100.0, 110.0, (8, 9)))
    unblurred = irradiance * kernel.energy * kernel.scale
    everywhere = render_screen(scene, kernel, scale=0.0)
    np.testing.assert_allclose(everywhere, unblurred, rtol=0, atol=1e-12)
    column = render_screen(scene, kernel, scale=scale)
    np.testing.assert_allclose(column[:, 4], unblurred[:, 4], rtol=0, atol=1e-12)
    assert (np.abs(column - unblurred)[:, 5] > 1e-6).all()


def test_specular_light_is_not_blurred(rng):
    irradiance, specular = rng.random((6, 7, 3)), rng.random((6, 7, 3))
    kernel = random_kernel(rng)
    without = render_screen(make_scene(irradiance), kernel)
    out = render_screen(make_scene(irradiance, specular=specular), kernel)
    np.testing.assert_array_equal(out, without + specular)


@pytest.mark.parametrize("degrees", [0.0, 30.0, 60.0])
def test_one_gaussian_on_a_slope_is_narrower_by_its_cosine(degrees):
    # exp(-dz^2 / 2v) with dz = x tan: variance v cos^2 in the picture, sum cos, which is the area
    # of the surface that a pixel sees. So the mean, and not the middle, makes up for it.
    irradiance = np.zeros((1, 401, 1))
    irradiance[0, 200] = 1.0
    kernel = gaussian_kernel(4.0, pitch_mm=0.1, half=150)
    scene = make_scene(irradiance, slope(1, 401, degrees, 0.1), mm_per_pixel=0.1, distance_mm=1e6)
    settings = {"depth_variance_mm2": 4.0, "border": "zero"}
    x = 0.1 * (np.arange(401) - 200)
    # Of one row the vertical pass sees its own middle weight only.
    middle = kernel.weights[0, 150, 0]
    lost, mean = (
        render_screen(scene, kernel, lost=lost, **settings)[0, :, 0] / middle
        for lost in ("none", "mean")
    )
    cosine = np.cos(np.radians(degrees))
    assert lost.sum() == pytest.approx(cosine, rel=1e-4)
    assert mean.sum() == pytest.approx(1.0, rel=1e-4)
    assert x**2 @ mean == pytest.approx(4.0 * cosine**2, rel=1e-3)


@pytest.mark.parametrize(("near", "far", "dz"), [(1.0, 6.0, 0.0), (3.0, 3.0, 2.5)])
def test_the_depth_factor_is_exact_in_a_plane_and_for_one_width(near, far, dz):
    x = PITCH_MM * np.arange(-16, 17)
    flat = exact_pass(x, 0.0, near, far, 0.6)
    irradiance = np.zeros((1, 33, 1))
    irradiance[0, 16] = 1.0
    # All but the middle lie dz deeper: what the lit pixel gives to each is the exact form.
    depth = np.full((1, 33), 1e9 + dz)
    depth[0, 16] = 1e9
    out = render_screen(
        make_scene(irradiance, depth, distance_mm=1e9),
        make_kernel(flat[None, :, None]),
        depth_variance_mm2=max(near, far),
        lost="none",
        border="zero",
    )[0, :, 0]
    exact = exact_pass(x, np.where(x == 0, 0.0, dz), near, far, 0.6)
    np.testing.assert_allclose(out, exact * flat[16], rtol=1e-6, atol=0)


def test_variances_come_from_the_kernel(rng):
    kernel = gaussian_kernel(4.0, half=30)
    assert second_moments(kernel)[0] == pytest.approx(4.0, rel=1e-10)
    assert lerp_falloff(kernel) == pytest.approx(1 / (LERP_SIGMAS * 2.0), rel=1e-10)
    artist = gaussian_kernel(4.0, half=30, parameters={"R": {"depth_variance_mm2": 1.0}})
    scene = make_scene(rng.random((9, 9, 1)), rng.uniform(300.0, 303.0, (9, 9)))
    for own, given in ((artist, 1.0), (kernel, second_moments(kernel))):
        np.testing.assert_array_equal(
            render_screen(scene, own), render_screen(scene, kernel, depth_variance_mm2=given)
        )
    np.testing.assert_array_equal(
        render_screen(scene, kernel, follow="lerp"),
        render_screen(scene, kernel, follow="lerp", falloff_per_mm=lerp_falloff(kernel)),
    )


def test_the_lerp_ends_where_the_listing_ends_it_for_table_1():
    # RR-02-12: s = saturate(300 D sssWidth |dz|) (appendix A), the width of table 1, and the
    # released shader's 20 degrees. The outermost sample, 2 sssWidth away, is for 3 mm of skin.
    width = 0.014
    end = 1.0 / (300.0 / math.tan(math.radians(0.5 * 20.0)) * width)
    red = [weights[0] for weights in shapes.SKIN_WEIGHTS]
    sigma_mm = math.sqrt(np.dot(red, shapes.SKIN_VARIANCES_MM2))
    assert pytest.approx(end / (2.0 * width) * 3.0 / sigma_mm, abs=0.05) == LERP_SIGMAS
    kernel = gaussian_kernel(4.0, half=30)
    assert 1.0 / lerp_falloff(kernel) == pytest.approx(3.8 * 2.0, rel=1e-10)


def test_a_kernel_of_one_pixel_and_a_picture_of_one(rng):
    kernel = make_kernel(np.full((1, 1, 3), 0.5))
    irradiance = rng.random((1, 1, 3))
    out = render_screen(make_scene(irradiance), kernel)
    np.testing.assert_allclose(out, 0.25 * irradiance, rtol=1e-15)


@pytest.mark.parametrize(
    ("fields", "settings", "words"),
    [
        ({"depth_mm": None}, {}, "needs depth_mm"),
        ({"distance_mm": None}, {}, "needs distance_mm"),
        ({"depth_mm": np.zeros((4, 5))}, {}, "depth_mm is 0 in 20 pixels"),
        ({"depth_mm": np.full((4, 5), 1e-300)}, {}, "would reach"),
        (
            {"irradiance": np.ones((4, 5, 1)), "specular": np.ones((4, 5, 2))},
            {},
            "specular of shape",
        ),
        ({"irradiance": np.ones((4, 5, 2))}, {}, "irradiance of shape"),
        ({}, {"follow": "lurp"}, "follow = 'lurp'; expected one of none, lerp, gaussian"),
        ({}, {"lost": "all"}, "lost = 'all'"),
        ({}, {"border": "wrap"}, "border = 'wrap'"),
        ({}, {"scale": -1.0}, "scale has values"),
        ({}, {"scale": np.full((4, 5), np.nan)}, "scale has values"),
        ({}, {"scale": np.ones((5, 4))}, "scale has shape"),
        ({}, {"depth_variance_mm2": 0.0}, "depth_variance_mm2 = 0"),
        ({}, {"depth_variance_mm2": (1.0, 2.0)}, "one or 3"),
        ({}, {"follow": "lerp", "falloff_per_mm": -1.0}, "falloff_per_mm = -1"),
        ({}, {"threads": 0}, "threads = 0"),
    ],
)
def test_bad_input_is_one_line(rng, fields, settings, words):
    whole = {"irradiance": np.ones((4, 5, 3)), "depth_mm": np.full((4, 5), 300.0)}
    scene = Scene("bad", **({"mm_per_pixel": 0.5, "distance_mm": 300.0} | whole | fields))
    with pytest.raises(RenderError, match=words) as error:
        render_screen(scene, random_kernel(rng), **settings)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("field", ["depth_mm", "mask", "thickness_mm", "alpha", "specular"])
def test_buffers_of_a_scene_have_their_number_of_axes(field):
    """Rows and columns, and channels of light alone."""
    wrong = (4, 5) if field == "specular" else (4, 5, 1)
    with pytest.raises(RenderError, match=rf"^bad: {field} of shape .*; expected rows") as error:
        Scene("bad", np.ones((4, 5, 3)), 0.5, **{field: np.ones(wrong)})
    assert str(wrong) in str(error.value)


@pytest.mark.parametrize("field", ["specular", "back_irradiance"])
def test_light_of_a_scene_has_as_many_channels_everywhere_or_one(field):
    """Beside irradiance of one channel it may have any."""
    for channels, fitting in ((3, (1, 3)), (1, (1, 2, 3, 4))):
        for count in range(5):
            buffers = {"irradiance": np.ones((4, 5, channels)), field: np.ones((4, 5, count))}
            if count in fitting:
                assert getattr(Scene("good", mm_per_pixel=0.5, **buffers), field).shape[2] == count
            else:
                with pytest.raises(RenderError, match=rf"^bad: {field} of shape \(4, 5, {count}\)"):
                    Scene("bad", mm_per_pixel=0.5, **buffers)


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"name": None}, "^name = None; expected a text that prints on one line"),
        ({"name": "a\nb"}, r"^name = 'a\\nb'; expected a text"),
        (
            {"mm_per_pixel": 10**400},
            "^bad: mm_per_pixel = 1000.*; expected a number above 0",
        ),
        ({"distance_mm": 0.0}, "^bad: distance_mm = 0; expected a number above 0"),
        ({"distance_mm": "1m"}, "^bad: distance_mm = '1m'; expected a number above 0"),
        ({"alpha": np.full((4, 5), 5.0)}, "^bad: alpha reaches 5; expected coverage from 0 to 1"),
        ({"alpha_is_multiplied": "no"}, "^bad: alpha_is_multiplied = 'no'; expected True or False"),
        ({"channel_names": 3}, "^bad: channel_names = 3 for 3 channels; give each one name"),
        ({"channel_names": ("R", "G", 3)}, "^bad: channel_names = .* for 3 channels; give each"),
    ],
)
def test_fields_of_a_scene_are_checked(fields, words):
    with pytest.raises(RenderError, match=words) as error:
        Scene(**{"name": "bad", "irradiance": np.ones((4, 5, 3)), "mm_per_pixel": 0.5} | fields)
    assert "\n" not in str(error.value)


def test_the_documented_figures_are_up_to_date():
    """Those of the steepest slope, whose rows are the last of their tables."""
    page = (ROOT / "docs" / "screen-space.md").read_text(encoding="utf-8")
    made = runpy.run_path(str(ROOT / "docs" / "make_screen.py"))
    section = made["section"](made["SLOPES"][-1:])
    missing = [line for line in section.splitlines() if line not in page]
    assert missing == [], "run: python docs/make_screen.py"


@pytest.mark.slow
def test_the_whole_documented_section_is_up_to_date():
    section = runpy.run_path(str(ROOT / "docs" / "make_screen.py"))["section"]()
    page = (ROOT / "docs" / "screen-space.md").read_text(encoding="utf-8")
    assert section in page, "run: python docs/make_screen.py"
