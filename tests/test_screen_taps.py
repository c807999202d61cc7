"""Tables of taps in screen space: single fetches, the flat renderer, masks and depth."""

import numpy as np
import pytest
from reference_screen_taps import screened
from test_taps import PITCH, signed_taps, taps_of

from sssfit.errors import RenderError
from sssfit.render.screen import render_screen, second_moments
from sssfit.render.screen_taps import render_screen_taps
from sssfit.render.taps import render_taps
from sssfit.render.texels import store_of
from sssfit.render.transmittance import beyond, transmitted
from sssfit.scene.record import Scene

DISTANCE_MM = 300.0
STRUCTURES = [("1-2", True), ("1-2", False), ("1|1|2", True), ("*|1-*", True)]


def scene_of(irradiance, depth_mm=DISTANCE_MM, **more):
    """A scene in perspective; a number is the depth everywhere."""
    irradiance = irradiance[..., None] if irradiance.ndim == 2 else irradiance
    depth = np.broadcast_to(depth_mm, irradiance.shape[:2])
    more = {"mm_per_pixel": PITCH, "distance_mm": DISTANCE_MM} | more
    return Scene("test", irradiance, depth_mm=depth, **more)


def tilted(height, width, rng, noise_mm=0.2):
    """Depth of a rough plane tilted both ways, so near that its pixels differ in size."""
    y, x = np.mgrid[:height, :width]
    return DISTANCE_MM * (0.5 + 0.01 * x + 0.004 * y) + noise_mm * rng.normal(size=(height, width))


@pytest.mark.parametrize("border", ["mirror", "clamp", "zero"])
@pytest.mark.parametrize(("structure", "chained"), STRUCTURES)
def test_a_tilted_scene_of_two_objects_is_that_of_single_fetches(structure, chained, border):
    rng = np.random.default_rng(11)
    taps = taps_of(structure, chained=chained)
    mask = (rng.uniform(size=(9, 7)) > 0.2) * rng.choice([1, 2], (9, 7), p=[0.7, 0.3])
    scene = scene_of(rng.uniform(size=(9, 7)), tilted(9, 7, rng), mask=mask)
    ours = render_screen_taps(scene, taps, border=border)
    widest = None if chained else second_moments(taps.separable_kernel()).max()
    for channel in (0, 1):
        slow = screened(scene, taps, channel, border=border, variance=widest)
        np.testing.assert_allclose(ours[..., channel], slow, rtol=0, atol=1e-12)
    assert np.abs(ours - render_screen_taps(scene, taps, border=border, follow="none")).max() > 0.01


@pytest.mark.parametrize("border", ["mirror", "clamp", "zero"])
@pytest.mark.parametrize("intermediate", [None, "half"])
@pytest.mark.parametrize(("structure", "chained"), STRUCTURES)
def test_a_plane_facing_the_eye_is_the_flat_renderer(structure, chained, intermediate, border):
    taps = taps_of(structure, chained=chained)
    picture = np.random.default_rng(12).uniform(size=(37, 26, 2))
    ours = render_screen_taps(scene_of(picture), taps, border=border, intermediate=intermediate)
    flat = render_taps(
        Scene("flat", picture, PITCH), taps, border=border, intermediate=intermediate
    )
    # A sum that rounds the other way is a step of the format apart.
    np.testing.assert_allclose(ours, flat, rtol=0, atol=1e-13 if intermediate is None else 5e-4)
    assert np.median(np.abs(ours - flat)) < 1e-14


@pytest.mark.parametrize("structure", ["1-2", "1|1|2-2", "*|*-*"])
def test_a_masked_plane_is_the_flat_renderer_with_coverage(structure):
    taps, rng = taps_of(structure), np.random.default_rng(13)
    picture, mask = rng.uniform(size=(20, 31, 1)), (rng.uniform(size=(20, 31)) > 0.4).astype(int)
    ours = render_screen_taps(scene_of(picture, mask=mask), taps)
    flat = render_taps(Scene("flat", picture, PITCH), taps, coverage=mask)
    inside = mask > 0
    np.testing.assert_allclose(ours[inside], flat[inside], rtol=0, atol=1e-13)
    outside = np.broadcast_to(picture, ours.shape)[~inside]
    np.testing.assert_array_equal(ours[~inside], outside)


def test_twice_as_near_is_the_flat_renderer_on_pixels_of_half_the_size():
    taps, picture = taps_of("1-2|1"), np.random.default_rng(14).uniform(size=(16, 24, 2))
    ours = render_screen_taps(scene_of(picture, DISTANCE_MM / 2), taps)
    flat = render_taps(Scene("flat", picture, PITCH / 2), taps)
    np.testing.assert_allclose(ours, flat, rtol=0, atol=1e-13)


@pytest.mark.parametrize("follow", ["gaussian", "none"])
@pytest.mark.parametrize("taps", [taps_of("1-2|1-1|1"), taps_of("*|*-*"), signed_taps()])
def test_constant_light_on_any_shape_and_surface_is_a_constant(taps, follow):
    rng = np.random.default_rng(15)
    for _ in range(3):
        mask = (rng.uniform(size=(33, 26)) > 0.6) * rng.choice([1, 3], (33, 26))
        picture = np.where(mask > 0, 2.0, 1e6)  # a bright background
        scene = scene_of(picture, tilted(33, 26, rng, noise_mm=3.0), mask=mask)
        inside = render_screen_taps(scene, taps, follow=follow)[mask > 0]
        np.testing.assert_allclose(inside, 2.0 * np.broadcast_to(taps.energy, inside.shape), 1e-6)


def test_no_light_crosses_the_mask_or_comes_from_infinity():
    taps, rng = taps_of("1-2|1|2"), np.random.default_rng(16)
    picture, mask = rng.uniform(size=(24, 24)), np.ones((24, 24), int)
    mask[:, 12:] = 2
    depth = np.full((24, 24), DISTANCE_MM)
    depth[20:] = np.inf
    plain = render_screen_taps(scene_of(picture, depth, mask=mask), taps)
    changed = picture.copy()
    changed[:, 12:] = 1e6
    changed[20:] = 1e6
    other = render_screen_taps(scene_of(changed, depth, mask=mask), taps)
    np.testing.assert_array_equal(other[:20, :12], plain[:20, :12])
    np.testing.assert_array_equal(other[20:], np.broadcast_to(changed[20:, :, None], (4, 24, 2)))


@pytest.mark.parametrize(("deep", "leak"), [(10.0, 2e-3), (100.0, 1e-9)])
@pytest.mark.parametrize("structure", ["1-2", "1-1|2-2|2-2"])
def test_a_step_in_depth_cuts_off(structure, deep, leak):
    """Light stays on its side of a step of many deviations of the widest stage.

    A fetch between two pixels has their mean depth; near its own side it brings a little over.
    """
    taps = taps_of(structure)
    deep_mm = deep * np.sqrt(max(each.variance_mm2.max() for each in taps.stages))
    far = np.zeros((32, 64), bool)
    far[:, 29:] = True  # at an odd column: a texel of each halved picture lies across the step
    depth = np.where(far, DISTANCE_MM + deep_mm, DISTANCE_MM)
    scene = scene_of(far.astype(float), depth)
    cut = render_screen_taps(scene, taps)
    np.testing.assert_allclose(cut[far], np.broadcast_to(taps.energy, cut[far].shape), leak)
    assert cut[~far].max() < leak
    assert render_screen_taps(scene, taps, follow="none")[~far].max() > 0.1


def test_specular_light_is_not_blurred_and_light_through_the_object_is():
    taps, rng = taps_of("1-2|1"), np.random.default_rng(17)
    picture, back = rng.uniform(size=(2, 16, 18, 2))
    mask = (rng.uniform(size=(16, 18)) > 0.3).astype(int)
    more = {"mask": mask, "thickness_mm": rng.uniform(0.0, 1.0, (16, 18)), "back_irradiance": back}
    specular = rng.uniform(size=(16, 18, 1))
    scene = scene_of(picture, specular=specular, **more)
    arrives = transmitted(scene, taps)
    assert arrives.max() > 0.01
    plain = render_screen_taps(scene_of(picture + arrives, mask=mask), taps)
    plain = np.where(mask[..., None] > 0, plain, picture)
    np.testing.assert_allclose(
        render_screen_taps(scene, taps), plain + specular, rtol=0, atol=1e-14
    )
    # The same treatment of the same buffers as a kernel's.
    kernel = render_screen(scene, taps_of("1-2", chained=False).separable_kernel())
    shown = (render_screen_taps(scene, taps) - specular)[mask == 0]
    np.testing.assert_allclose((kernel - specular)[mask == 0], shown, rtol=0, atol=1e-14)


def test_light_through_a_slab_is_that_of_the_same_kernel():
    taps, s = taps_of("1-2"), np.array([0.0, 0.3, 0.7, 1.5, np.inf])
    np.testing.assert_allclose(
        beyond(taps, s), beyond(taps.separable_kernel(), s), rtol=0, atol=1e-13
    )
    assert (np.diff(beyond(taps_of("1|1-2"), s), axis=0) < 0.0).all()


def test_threads_do_not_matter():
    taps, rng = taps_of("1-2|1"), np.random.default_rng(18)
    scene = scene_of(rng.uniform(size=(150, 160)), tilted(150, 160, rng))
    one, three = (render_screen_taps(scene, taps, threads=each) for each in (1, 3))
    np.testing.assert_array_equal(one, three)


@pytest.mark.parametrize("size", [(1, 1), (1, 5), (2, 2), (5, 1)])
def test_pictures_smaller_than_the_coarsest_level_keep_constant_light(size):
    taps = taps_of("1|2|1-1|1")
    out = render_screen_taps(scene_of(np.full(size, 3.0)), taps)
    np.testing.assert_allclose(out, 3.0 * np.broadcast_to(taps.energy, out.shape), 1e-12)


def test_weights_below_0_are_divided_once():
    taps, picture = signed_taps(), np.random.default_rng(19).uniform(size=(12, 15, 1))
    ours = render_screen_taps(scene_of(picture), taps)
    flat = render_taps(Scene("flat", picture, PITCH), taps)
    np.testing.assert_allclose(ours, flat, rtol=0, atol=1e-13)


def test_bad_settings_are_one_line():
    taps, scene = taps_of(), scene_of(np.ones((4, 5)))
    for settings, words in (
        ({"follow": "lerp"}, "follow = 'lerp'; a table of taps has gaussian or none"),
        ({"border": "round"}, "border = 'round'; expected mirror, clamp, zero"),
        ({"intermediate": "byte"}, "intermediate = 'byte'"),
    ):
        with pytest.raises(RenderError, match=words):
            render_screen_taps(scene, taps, **settings)
    with pytest.raises(RenderError, match="needs depth_mm"):
        render_screen_taps(Scene("flat", np.ones((4, 5, 1)), PITCH), taps)
    with pytest.raises(RenderError, match="expected 1 or 2 channels"):
        render_screen_taps(scene_of(np.ones((4, 5, 3))), taps)
    with pytest.raises(RenderError, match="the taps would reach"):
        render_screen_taps(scene_of(np.ones((4, 5)), 1e-12), taps)
    with pytest.raises(RenderError, match="half holds up to 65504"):
        render_screen_taps(scene_of(np.full((4, 5), 1e5)), taps, intermediate="half")
    assert store_of(None, taps) is None
