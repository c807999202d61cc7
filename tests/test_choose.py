"""The cheapest that will do: rendered again, held against what is cheaper, near and far."""

import math

import numpy as np
import pytest

import sssfit.compare._all_light as all_light
import sssfit.compare._choose_truth as truths
import sssfit.compare.choose as rooms
from sssfit.compare._choose_options import SHARES, supports
from sssfit.compare.choose import choose, is_exact, mm_per_pixel_at
from sssfit.compare.metrics import measure
from sssfit.errors import FitError, RenderError, SimulationError, SssfitError
from sssfit.fit import METHODS
from sssfit.material import Layer, Material, load_material, material_names
from sssfit.render.irradiance import make_scene
from sssfit.render.reference import render_reference
from sssfit.render.scene import Scene
from sssfit.render.separable import render_separable
from sssfit.simulate import simulate_exact

FRAME = (128, 128)


@pytest.fixture(scope="module")
def skin1():
    return load_material("skin1")


@pytest.fixture(scope="module")
def choice(skin1):
    return choose(skin1, mm_per_pixel=0.6, frame=FRAME)


def rendered_again(profile, option, mm_per_pixel, distance_mm=600.0):
    """Mean Delta E on the head, from fitting to measuring with the parts one by one."""
    scene = make_scene(
        "head", height=128, width=128, mm_per_pixel=mm_per_pixel, distance_mm=distance_mm
    )
    fitted = METHODS[option.candidate.method].fit(
        profile,
        mm_per_pixel=mm_per_pixel,
        support_mm=option.support_mm,
        **option.candidate.settings,
    )
    picture = render_separable(scene, fitted.kernel)
    truth = render_reference(scene, profile)
    return measure(picture, truth, mask=scene.mask).delta_e_2000_mean


@pytest.mark.filterwarnings("ignore::sssfit.errors.SssfitWarning")
@pytest.mark.parametrize("tolerance", [1.0, 0.3])
def test_the_choice_will_do_and_the_next_cheaper_will_not(skin1, tolerance):
    found = choose(skin1, mm_per_pixel=0.7, frame=FRAME, tolerance=tolerance)
    exact = simulate_exact(skin1)
    assert len(found.scenes) == 1  # 90 mm: no wider view
    chosen = rendered_again(exact, found.chosen.option, 0.7)
    assert chosen <= tolerance
    assert chosen == pytest.approx(found.chosen.delta_e_2000_mean, rel=1e-9)
    assert rendered_again(exact, found.runner_up.option, 0.7) <= tolerance
    assert rendered_again(exact, found.cheaper.option, 0.7) > tolerance
    assert found.cheaper.taps_per_pixel < found.chosen.taps_per_pixel
    assert found.runner_up.taps_per_pixel >= found.chosen.taps_per_pixel


def test_nothing_cheaper_that_was_tried_will_do(choice):
    cheaper = [each for each in choice.steps if each.taps_per_pixel < choice.chosen.taps_per_pixel]
    assert cheaper[0].option is None
    assert not any(each.within for each in cheaper)
    assert all(each.delta_e_2000_mean > choice.tolerance for each in cheaper)


def test_the_kernel_is_the_one_that_was_judged(choice):
    kernel, option = choice.fit.kernel, choice.chosen.option
    assert (kernel.method, kernel.rank) == (option.candidate.method, option.candidate.terms)
    assert (kernel.pixels, kernel.mm_per_pixel) == (option.pixels, 0.6)
    assert choice.chosen.taps_per_pixel == 2 * kernel.rank * kernel.pixels


def test_the_same_choice_twice(skin1, choice):
    again = choose(skin1, mm_per_pixel=0.6, frame=FRAME, threads=1)
    assert again.steps == choice.steps
    assert (again.chosen, again.runner_up, again.cheaper, again.dearer) == (
        *(choice.chosen, choice.runner_up, choice.cheaper, choice.dearer),
    )
    np.testing.assert_array_equal(again.fit.kernel.weights, choice.fit.kernel.weights)
    assert again.photons.delta_e_2000_mean == choice.photons.delta_e_2000_mean


def test_few_photons_are_enough_where_the_tolerance_is_wide(choice):
    need = choice.photons
    assert need.truth_method == "exact"
    assert need.photons == need.counts[-1]
    assert need.delta_e_2000_mean[-1] <= choice.tolerance
    assert all(each > choice.tolerance for each in need.delta_e_2000_mean[:-1])


def test_supports_keep_their_share_of_every_channel(skin1):
    profile = simulate_exact(skin1)
    found = supports(profile, 0.1)
    assert [share for share, _ in found] == list(SHARES)
    for share, radius in found:
        within = profile.cumulative_at(np.array([radius]))[0] / profile.total_on_grid
        assert within.min() >= share - 1e-12
        before = profile.cumulative_at(np.array([radius - profile.r_edges_mm[1]]))[0]
        assert (before / profile.total_on_grid).min() < share


def quick(monkeypatch):
    """Leave out what is looked at beside the choice, and solve each material once."""
    solved = {}

    def once(material, **settings):
        if material.name not in solved:
            solved[material.name] = truths.truth_of(material, **settings)
        return solved[material.name]

    monkeypatch.setattr(rooms, "truth_of", once)
    monkeypatch.setattr(rooms, "photons_needed", lambda *_: None)
    monkeypatch.setattr(rooms._Search, "_dearer", lambda *_: ())
    monkeypatch.setattr(rooms._Search, "_seconds", lambda *_: 0.0)


def costs(name, distances_mm, tolerance, rows):
    """Weights a pixel of the choices; 0 is no blur."""
    material = load_material(name)
    for distance in distances_mm:
        found = choose(
            material,
            mm_per_pixel=mm_per_pixel_at(distance, 30.0, rows),
            distance_mm=distance,
            frame=(rows, rows),
            tolerance=tolerance,
        )
        yield found.chosen.taps_per_pixel if found.chosen else 0


@pytest.mark.parametrize("name", ["skin1", "marble", "ketchup"])
def test_cost_never_rises_with_distance(name, monkeypatch):
    quick(monkeypatch)
    distances = np.geomspace(100.0, 50_000.0, 6)
    found = list(costs(name, distances, 1.0, 64))
    assert found == sorted(found, reverse=True)
    assert found[0] > 10
    assert found[-1] == 0


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [1.0, 0.3])
@pytest.mark.parametrize("name", material_names())
def test_cost_never_rises_with_distance_for_any_material(name, tolerance, monkeypatch):
    quick(monkeypatch)
    found = list(costs(name, np.geomspace(100.0, 50_000.0, 16), tolerance, 256))
    assert found == sorted(found, reverse=True)


def test_a_close_up_has_to_hold_on_the_wider_view(skin1, monkeypatch):
    quick(monkeypatch)
    near = choose(skin1, mm_per_pixel=0.25, distance_mm=250.0, frame=FRAME)
    pitches = [each.mm_per_pixel for each in near.scenes]
    assert pitches == [0.25, 0.5, 0.625, 0.6875]  # 32 mm, and views of 64, 80 and 88 mm
    assert near.scenes[1].distance_mm == pytest.approx(500.0)
    exact = simulate_exact(skin1)
    for mm_per_pixel, distance in ((0.25, 250.0), (0.5, 500.0)):
        assert rendered_again(exact, near.chosen.option, mm_per_pixel, distance) <= 1.0


def test_far_away_no_blur_is_needed(skin1):
    far = choose(skin1, mm_per_pixel=8.0, distance_mm=15_000.0, frame=FRAME)
    assert (far.fit, far.photons, far.chosen.option) == (None, None, None)
    scene = far.scenes[0]
    exact = simulate_exact(skin1)
    bare = measure(
        scene.irradiance * exact.diffuse_reflectance,
        render_reference(scene, exact),
        mask=scene.mask,
    )
    assert bare.delta_e_2000_mean <= 1.0
    assert far.chosen.delta_e_2000_mean == pytest.approx(bare.delta_e_2000_mean)


@pytest.mark.parametrize("mm_per_pixel", [22.0, 1e12])
def test_a_profile_under_a_pixel_needs_no_blur(skin1, mm_per_pixel):
    found = choose(skin1, mm_per_pixel=mm_per_pixel, distance_mm=45_000.0)
    assert found.support_mm == pytest.approx(21.376, abs=1e-3)
    assert (found.chosen, found.fit, found.scenes) == (None, None, ())


def test_a_picture_of_ones_own_and_its_mask(skin1):
    edge = make_scene("edge", height=96, width=700, mm_per_pixel=0.6)
    mask = np.zeros((96, 700), int)
    mask[:, 200:500] = 1
    scene = Scene("mine", edge.irradiance, 0.6, mask=mask)
    found = choose(skin1, mm_per_pixel=0.6, scene=scene, tolerance=0.5)
    middle = slice(94, 606)
    seen = Scene("middle", edge.irradiance[:, middle], 0.6)
    score = measure(
        render_separable(seen, found.fit.kernel),
        render_reference(seen, simulate_exact(skin1)),
        mask=mask[:, middle],
    )
    assert score.delta_e_2000_mean == pytest.approx(found.chosen.delta_e_2000_mean)
    assert score.delta_e_2000_mean <= 0.5


def test_a_slab_is_held_against_a_walk(monkeypatch):
    monkeypatch.setattr(truths, "WALK_PHOTONS", 20_000)
    layer = Layer(1.3, np.zeros(1), np.array([0.1]), np.array([1.0]), thickness_mm=5.0)
    found = choose(Material("slab", ("grey",), (layer,)), mm_per_pixel=0.6, frame=FRAME)
    assert found.profile.photons == 20_000
    assert found.photons.truth_method == "montecarlo"
    assert found.chosen.within


def test_pixels_from_the_frame():
    # Half the frame, 540 pixels, is 600 mm times the tangent of half the field of view.
    assert mm_per_pixel_at(600.0, 30.0, 1080) * 540 == pytest.approx(
        600.0 * math.tan(math.radians(15.0))
    )
    assert mm_per_pixel_at(1000.0, 90.0, 1000) == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("values", "word"),
    [
        ((0.0, 30.0, 1080), "distance = 0"),
        ((-1.0, 30.0, 1080), "distance = -1"),
        ((math.nan, 30.0, 1080), "distance = nan"),
        ((600.0, 0.0, 1080), "between 0 and 180"),
        ((600.0, 180.0, 1080), "between 0 and 180"),
        ((600.0, math.nan, 1080), "between 0 and 180"),
        ((600.0, 30.0, 0), "0 rows"),
    ],
)
def test_no_pixels_from_a_frame_without_size(values, word):
    with pytest.raises(RenderError, match=word):
        mm_per_pixel_at(*values)


def flat(value, mm_per_pixel=0.6):
    return Scene("flat", np.full((16, 16, 1), value), mm_per_pixel)


@pytest.mark.parametrize(
    ("settings", "word"),
    [
        ({"tolerance": 0.0}, "tolerance = 0"),
        ({"tolerance": -1.0}, "tolerance = -1"),
        ({"tolerance": math.nan}, "tolerance = nan"),
        ({"mm_per_pixel": 0.0}, "mm_per_pixel = 0"),
        ({"mm_per_pixel": math.inf}, "mm_per_pixel = inf"),
        ({"distance_mm": 50.0}, "distance_mm = 50"),
        ({"scene": flat(0.5)}, "of one colour"),
        ({"scene": flat(0.0)}, "of one colour"),
        ({"scene": flat(0.5, 0.7)}, "0.7 mm per pixel"),
        ({"scene": make_scene("edge", height=32, width=32, mm_per_pixel=5.0), "mm_per_pixel": 5.0,
          "tolerance": 1e-9}, "nothing is within"),
    ],
)  # fmt: skip
def test_bad_input_gets_one_line(skin1, settings, word):
    with pytest.raises(SssfitError, match=word) as error:
        choose(skin1, **({"mm_per_pixel": 0.6, "frame": FRAME} | settings))
    assert "\n" not in str(error.value)


def test_two_channels_have_no_colour():
    layer = Layer(1.3, np.zeros(2), np.full(2, 0.1), np.ones(2))
    with pytest.raises(RenderError, match="2 channels"):
        choose(Material("two", ("a", "b"), (layer,)), mm_per_pixel=0.6)


def test_a_material_that_fails_to_converge(skin1, monkeypatch):
    monkeypatch.setattr(
        all_light, "simulate_exact", lambda m, **_: simulate_exact(m, tolerance=1e-15)
    )
    with pytest.raises(SimulationError, match="cannot be met"):
        choose(skin1, mm_per_pixel=0.6, frame=FRAME)


def test_forward_scattering_is_walked_and_not_taken_for_isotropic():
    layer = Layer(1.3, np.array([0.8]), np.array([0.1]), np.array([5.0]))
    forward = Material("forward", ("grey",), (layer,))
    assert not is_exact(forward)
    even = Layer(1.3, np.zeros(1), np.array([0.1]), np.array([5.0]))
    assert is_exact(Material("even", ("grey",), (even,)))
    # Nor is a medium thinner optically than what is above it, which the exact solver refuses.
    assert not is_exact(Material("under-water", ("grey",), (even,), eta_above=1.33))


def test_a_material_that_returns_nothing_is_refused():
    layer = Layer(1.3, np.zeros(1), np.array([0.1]), np.zeros(1))
    with pytest.raises(FitError, match="returns no light"):
        choose(Material("black", ("grey",), (layer,)), mm_per_pixel=0.6, frame=FRAME)


def test_supports_that_are_too_narrow_are_named(skin1):
    found = choose(skin1, mm_per_pixel=0.6, frame=FRAME, tolerance=0.5)
    tried = {each.option.pixels for each in found.steps if each.option}
    assert found.too_narrow
    assert not tried & set(found.too_narrow)
    assert max(found.too_narrow) < min(tried)
