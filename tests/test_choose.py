"""The cheapest that will do: rendered again, held against what is cheaper, near and far."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import shared_work
from reference_pixels import make_profile

import sssfit.choose.choice as rooms
import sssfit.choose.truth as truths
from sssfit.choose import truth as photon_walks
from sssfit.choose.choice import choose, mm_per_pixel_at
from sssfit.choose.options import PREINTEGRATED, Option, check_caps, options
from sssfit.choose.report import sentences, step_line
from sssfit.choose.truth import material_of, photons_needed
from sssfit.choose.views import Views, checked_scene, head_scenes
from sssfit.errors import FitError, RenderError, SimulationError, SssfitError
from sssfit.fit import fit_result
from sssfit.fit.structures import STRUCTURES, WIDTHS_PIXELS, between, width_pixels
from sssfit.kernel import structure
from sssfit.material import Layer, Material, load_material, material_names
from sssfit.measure.score import COLOUR_FIGURES, measure
from sssfit.profile import Profile
from sssfit.render.reference import render_reference
from sssfit.render.taps import render_taps
from sssfit.scene.made import make_scene
from sssfit.scene.record import Scene
from sssfit.simulate import (
    simulate_deon_skin,
    simulate_dipole,
    simulate_exact,
    simulate_montecarlo,
)

FRAME = (128, 128)
NEAR_MM = 0.65  # 83 mm of the head: one wider view beside it


@pytest.fixture(scope="module")
def skin1():
    return load_material("skin1")


@pytest.fixture(scope="module")
def choice(skin1):
    return choose(skin1, mm_per_pixel=NEAR_MM, frame=FRAME)


def rendered_again(profile, option, mm_per_pixel, distance_mm=600.0, fitted_to=None, size=128):
    """Score on the head, from fitting to measuring with the parts one by one."""
    scene = make_scene(
        "head", height=size, width=size, mm_per_pixel=mm_per_pixel, distance_mm=distance_mm
    )
    fitted = fit_result(
        fitted_to or profile, option.method, mm_per_pixel=mm_per_pixel, **option.settings
    )
    picture = render_taps(scene, fitted.kernel)
    truth = render_reference(scene, profile)
    return measure(picture, truth, mask=scene.mask)


@pytest.mark.parametrize(("of", "tolerance"), [("p95", 1.0), ("p99", 1.5), ("mean", 0.3)])
def test_the_choice_will_do_and_the_next_cheaper_will_not(skin1, of, tolerance):
    found = choose(skin1, mm_per_pixel=0.7, frame=FRAME, tolerance=tolerance, tolerance_of=of)
    assert found.tolerance_of == of
    exact = simulate_exact(skin1)
    assert len(found.scenes) == 1  # 90 mm: no wider view
    figure = f"delta_e_2000_{of}"
    chosen = rendered_again(exact, found.chosen.option, 0.7)
    assert getattr(chosen, figure) <= tolerance
    assert found.chosen.error == pytest.approx(getattr(chosen, figure), rel=1e-9)
    for key in COLOUR_FIGURES:
        assert getattr(found.chosen, key) == pytest.approx(getattr(chosen, key), rel=1e-9)
    known = options(width_pixels(exact, 0.7))
    place = known.index(found.chosen.option)
    assert found.cheaper.option == known[place - 1]
    assert found.dearer.option == known[place + 1]
    assert getattr(rendered_again(exact, known[place - 1], 0.7), figure) > tolerance
    for step in (found.cheaper, found.dearer):
        again = getattr(rendered_again(exact, step.option, 0.7), figure)
        assert step.error == pytest.approx(again, rel=1e-9)
        assert step.within == (again <= tolerance)


def test_nothing_cheaper_that_was_tried_will_do(choice):
    cheaper = [each for each in choice.steps if each.fetches < choice.chosen.fetches]
    assert cheaper[0].option is None
    assert not any(each.within for each in cheaper)
    assert all(each.error > choice.tolerance for each in cheaper)
    assert choice.cheaper == max(cheaper, key=lambda each: each.fetches)


def test_half_of_the_options_is_left_by_each_that_is_tried(choice):
    """No option twice, and no more than the halving, two neighbours and no blur."""
    tried = [each.option for each in choice.steps]
    assert len(set(map(id, tried))) == len(tried)
    assert len(tried) <= 3 + math.ceil(math.log2(len(options(20.0)) + 1))


@pytest.mark.parametrize(("fetches", "passes"), [(14.0, None), (100.0, 4), (None, 2), (12.0, 6)])
@pytest.mark.parametrize("width", [5.0, *WIDTHS_PIXELS, 40.0])
def test_options_are_those_that_none_cheaper_beats(fetches, passes, width):
    found = options(width, fetches, passes)
    assert found
    costs = [each.fetches for each in found]
    assert costs == sorted(costs)
    known = [each.known for each in found]
    assert known == sorted(known, reverse=True)
    every = [each for each in options_of_all(width) if each.fetches <= (fetches or 1e9)]
    every = [each for each in every if each.passes <= (passes or 1e9)]
    assert {each.label for each in found} <= {each.label for each in every}
    for each in every:  # nothing within the budgets is nearer for as little
        assert any(other.fetches <= each.fetches and other.known <= each.known for other in found)


def options_of_all(width):
    """Every known table, from its own fit's cost."""
    for text, known in STRUCTURES.items():
        cost = structure.cost_of_chain(structure.parse(text))
        yield Option(f"cascade {text}", "cascade", cost.fetches, cost.passes, between(known, width))
    for taps, known in PREINTEGRATED.items():
        yield Option(f"pre-integrated on {taps} taps", "", 2 * taps, 2, between(known, width))


@pytest.mark.parametrize("width", [0.5, 5.0, 60.0])
def test_the_least_budget_buys_the_cheapest_table(width):
    (cheapest, *_) = options(width)
    check_caps(cheapest.fetches, None)
    assert options(width, cheapest.fetches) == [cheapest]
    with pytest.raises(RenderError, match="expected a number from 6 up"):
        check_caps(cheapest.fetches - 0.1, None)


@pytest.mark.parametrize("budget", [{"fetches": 12.0}, {"fetches": 100.0, "passes": 2}])
def test_within_a_budget_the_least_error_is_chosen(skin1, budget, monkeypatch):
    quick(monkeypatch)
    found = choose(skin1, mm_per_pixel=NEAR_MM, frame=FRAME, **budget)
    assert found.tolerance is None
    assert found.photons is None
    kernel = found.fit.kernel
    assert kernel.fetches <= budget["fetches"]
    assert kernel.passes <= budget.get("passes", 99)
    tried = [each for each in found.steps if each.option]
    assert [each.option for each in tried[:3]] == options(
        width_pixels(found.profile, NEAR_MM), **budget
    )[-3:]
    assert found.chosen == min(tried, key=lambda each: each.error)
    assert (found.fetches, found.passes) == (budget["fetches"], budget.get("passes"))


def judged(monkeypatch, errors):
    """Choices on given errors, an option each, within a tolerance of 1."""
    found = [Option(f"option {k}", "", 8.0 + k, 2, 9.0 - k) for k in range(len(errors))]
    views = SimpleNamespace(tolerance=1.0, tolerance_of="p95")
    search = rooms._Search(views, found, found, None)

    def step(option):
        error = errors[found.index(option)]
        figures = dict.fromkeys(COLOUR_FIGURES, error)
        return rooms.Step(option, error, **figures, mm_per_pixel=0.3, within=error <= 1.0)

    monkeypatch.setattr(search, "_evaluated", step)
    return search


@pytest.mark.parametrize(
    ("errors", "place"),
    [
        ([9, 7, 5, 3, 0.9, 0.5], 4),
        ([0.9, 0.8, 0.7], 0),
        ([9, 7, 5, 3, 2, 0.9, 1.2], 5),  # the last is worse than the one before
        ([9, 7, 5, 3, 0.9, 1.1, 1.2], 4),
        ([9, 7, 0.9, 3, 0.8, 0.7], 2),  # the last but one cheaper holds, too
        ([9, 0.95, 0.9, 3, 0.8, 0.7], 1),
    ],
)
def test_the_cheapest_that_holds_is_found_though_errors_do_not_always_fall(
    monkeypatch, errors, place
):
    search = judged(monkeypatch, errors)
    assert search._cheapest() == place
    assert place == 0 or not search.tried[place - 1].within


def test_nothing_within_names_the_best_of_the_last(monkeypatch):
    search = judged(monkeypatch, [9, 7, 5, 3, 1.2, 1.1, 1.3])
    with pytest.raises(RenderError, match=r"the best of .*, option 5, has 1\.1"):
        search._cheapest()


def test_of_equal_fetches_fewer_passes_are_cheaper(monkeypatch):
    search = judged(monkeypatch, [9.0, 8.0, 7.0])
    star, taps = (replace(search.options[1], passes=passes) for passes in (1, 2))
    steps = [rooms.Step(each, 9.0, *[9.0] * 4, mm_per_pixel=0.3, within=False)
             for each in (search.options[0], taps, star)]  # fmt: skip
    search.steps = steps
    assert search._next_cheaper(steps[1]) == steps[2]
    assert search._next_cheaper(steps[2]) == steps[0]


def test_no_blur_is_taken_where_a_budget_has_nothing_better(skin1, monkeypatch):
    quick(monkeypatch)
    real = rooms._Search._evaluated

    def evaluated(self, option):
        step = real(self, option)
        return replace(step, error=0.0) if option is None else step

    monkeypatch.setattr(rooms._Search, "_evaluated", evaluated)
    found = choose(skin1, mm_per_pixel=0.7, frame=(48, 48), fetches=11.0)
    assert found.chosen.option is None
    assert found.fit is None


def test_dearer_looks_beyond_the_budget(skin1, monkeypatch):
    quick(monkeypatch)
    found = choose(skin1, mm_per_pixel=0.7, frame=(48, 48), fetches=10.5)
    assert found.dearer.fetches > 10.5 >= found.chosen.fetches


def test_a_tolerance_and_a_budget_hold_together(skin1, monkeypatch):
    quick(monkeypatch)
    view = {"mm_per_pixel": NEAR_MM, "frame": FRAME}
    free = choose(skin1, tolerance=0.5, **view)
    held = choose(skin1, tolerance=0.5, fetches=100.0, passes=4, **view)
    assert held.chosen.within
    assert held.fit.kernel.passes <= 4 < free.fit.kernel.passes
    with pytest.raises(RenderError, match=r"nothing is within .* of 0\.5: the best of .*, .* has"):
        choose(skin1, tolerance=0.5, fetches=10.0, **view)


def test_unless_told_otherwise_95_percent_of_the_pixels_are_within_1(choice):
    assert (choice.tolerance, choice.tolerance_of) == (1.0, "p95")
    assert choice.chosen.error == choice.chosen.delta_e_2000_p95
    assert choice.chosen.share_above_1 <= 0.05
    assert choice.cheaper.share_above_1 > 0.05


def test_the_kernel_is_the_one_that_was_judged(choice):
    kernel, option = choice.fit.kernel, choice.chosen.option
    assert (kernel.method, kernel.mm_per_pixel) == (option.method, NEAR_MM)
    assert (kernel.fetches, kernel.passes) == (option.fetches, option.passes)
    assert (choice.chosen.fetches, choice.chosen.passes) == (kernel.fetches, kernel.passes)
    scene = choice.scenes[0]
    truth = render_reference(scene, choice.profile)
    score = measure(render_taps(scene, kernel), truth, mask=scene.mask)
    again = rendered_again(choice.profile, option, NEAR_MM)
    assert score.delta_e_2000_p95 == pytest.approx(again.delta_e_2000_p95, rel=1e-9)
    assert score.delta_e_2000_p95 <= choice.chosen.error  # which is that of the worst view


def test_the_same_choice_twice(skin1, choice):
    with shared_work.alone():
        again = choose(skin1, mm_per_pixel=NEAR_MM, frame=FRAME, threads=1)
    assert again.steps == choice.steps
    assert (again.chosen, again.cheaper, again.dearer) == (
        *(choice.chosen, choice.cheaper, choice.dearer),
    )
    assert again.fit.kernel.to_dict() == choice.fit.kernel.to_dict()
    assert again.photons.errors == choice.photons.errors


def test_photons_are_tried_until_a_walk_will_do(skin1, choice):
    need = choice.photons
    assert need.truth_method == "exact"
    walk = simulate_montecarlo(skin1, photons=need.photons, seed=1)
    views = [(each.mm_per_pixel, each.distance_mm) for each in choice.scenes]
    assert len(views) > 1
    again = [
        rendered_again(choice.profile, choice.chosen.option, *view, fitted_to=walk)
        for view in views
    ]
    worst = max(each.delta_e_2000_p95 for each in again)
    assert need.errors[-1] == pytest.approx(worst, rel=1e-6)
    assert need.counts == tuple(10**k for k in range(4, 4 + len(need.counts)))
    assert need.photons == need.counts[-1]


def needed(monkeypatch, errors, *, walked=None, own_seed=5):
    """photons_needed of walks whose errors are given; the seeds that were walked with, too."""
    left, seeds = iter(errors), []

    def error_of(material, option, views, photons, seed):
        seeds.append(seed)
        return next(left), 0.25

    monkeypatch.setattr(photon_walks, "_error_and_seconds", error_of)
    meta = {"method": "exact"} if walked is None else {"method": "montecarlo", "seed": own_seed}
    profile = SimpleNamespace(photons=walked, meta=meta)
    views = SimpleNamespace(profile=profile, tolerance=0.5)
    return photons_needed("material", "option", views, 5, 0.0), seeds


def test_photons_stop_at_the_tolerance_and_not_at_twice_it(monkeypatch):
    found, seeds = needed(monkeypatch, [3.0, 0.99, 0.5001, 0.4])
    assert (found.photons, found.counts) == (10**7, (10**4, 10**5, 10**6, 10**7))
    assert found.errors == (3.0, 0.99, 0.5001, 0.4)
    assert seeds == [5, 5, 5, 5]
    found, _ = needed(monkeypatch, [3.0, 0.5, 0.4])
    assert (found.photons, found.counts) == (10**5, (10**4, 10**5))
    found, _ = needed(monkeypatch, [3.0, 2.0, 1.0, 0.6])
    assert (found.photons, len(found.counts)) == (None, 4)


def test_seconds_are_those_of_the_walks_alone(monkeypatch):
    clock = [0.0]

    def walk(*_, photons, **__):
        clock[0] += photons / 1e4
        return "walk"

    def score(*_, **__):
        clock[0] += 100.0  # a fit, and a picture of every view
        return SimpleNamespace(error=0.7 if clock[0] < 150.0 else 0.3)

    monkeypatch.setattr(photon_walks, "simulate_montecarlo", walk)
    monkeypatch.setattr(photon_walks, "time", SimpleNamespace(perf_counter=lambda: clock[0]))
    profile = SimpleNamespace(photons=None, meta={}, r_edges_mm=np.array([0.0, 0.1]), n_annuli=1)
    views = SimpleNamespace(profile=profile, tolerance=0.5, threads=1, score_of_option=score)
    assert photons_needed("material", "option", views, 5, 0.0).seconds == (1.0, 10.0)


def test_a_walk_is_not_held_against_a_part_of_itself(monkeypatch):
    found, seeds = needed(monkeypatch, [3.0, 2.0], walked=10**6)
    assert (found.photons, found.counts) == (10**6, (10**4, 10**5))
    assert 5 not in seeds
    _, seeds = needed(monkeypatch, [3.0, 2.0], walked=10**6, own_seed=4)
    assert 4 not in seeds


@pytest.mark.parametrize(
    ("errors", "within", "worst"),
    [
        ([0.99, 0.94, 0.5], True, 0.99),
        ([0.5, 0.94, 0.7], True, 0.94),
        ([0.5, 0.951, 0.7], False, 0.951),  # a wider view may have 95 %
        ([0.5, 0.7, 0.96], False, 0.96),
        ([1.001, 0.5, 0.5], False, 1.001),
    ],
)
def test_a_wider_view_may_not_take_all_of_the_tolerance(skin1, monkeypatch, errors, within, worst):
    scenes = [
        make_scene("edge", height=8, width=8, mm_per_pixel=0.5 + k) for k in range(len(errors))
    ]
    views = Views(simulate_exact(skin1), scenes, None, tolerance=1.0, tolerance_of="p99")
    seen = []

    def measured(k, picture):
        seen.append(k)
        return SimpleNamespace(delta_e_2000_p99=errors[k], delta_e_2000_mean=7.0)

    monkeypatch.setattr(views, "_measured", measured)
    found = views.score_of_option(None)
    assert (found.within, found.error) == (within, worst)
    assert found.mm_per_pixel == 0.5 + errors.index(worst)
    if not within:
        assert seen[-1] == errors.index(worst)  # looks no further
    # For a walk's noise the wider views have all of it.
    assert views.score_of_option(None, wider=1.0).within == (max(errors) <= 1.0)


def quick(monkeypatch):
    """Leave out what is looked at beside the choice, and solve each material once."""
    solved = {}

    def once(material, **settings):
        if isinstance(material, Profile):
            return material, 0.0
        if material.name not in solved:
            solved[material.name] = truths.truth_of(material, **settings)
        return solved[material.name]

    monkeypatch.setattr(rooms, "truth_of", once)
    monkeypatch.setattr(rooms, "photons_needed", lambda *_: None)
    monkeypatch.setattr(rooms._Search, "_seconds", lambda *_: 0.0)


def costs(name, distances_mm, tolerance, rows):
    """Fetches a pixel of the choices; 0 is no blur."""
    material = load_material(name)
    for distance in distances_mm:
        found = choose(
            material,
            mm_per_pixel=mm_per_pixel_at(distance, 30.0, rows),
            distance_mm=distance,
            frame=(rows, rows),
            tolerance=tolerance,
        )
        yield found.chosen.fetches if found.chosen else 0


@pytest.mark.parametrize(
    "name",
    ["skin1", *(pytest.param(each, marks=pytest.mark.slow) for each in ("marble", "ketchup"))],
)
def test_cost_never_rises_with_distance(name, monkeypatch):
    quick(monkeypatch)
    distances = np.geomspace(100.0, 50_000.0, 5)
    found = list(costs(name, distances, 1.0, 48))
    assert found == sorted(found, reverse=True)
    assert found[0] > 7
    assert found[-1] == 0


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [1.0, 0.3])
@pytest.mark.parametrize("name", material_names(paper=True))
def test_cost_never_rises_with_distance_for_any_material(name, tolerance, monkeypatch):
    quick(monkeypatch)
    found = list(costs(name, np.geomspace(100.0, 50_000.0, 16), tolerance, 256))
    assert found == sorted(found, reverse=True)


@pytest.mark.parametrize(
    ("frame", "rows", "columns"), [((96, 128), 96, 128), ((90, 700), 90, 512), ((700, 90), 512, 90)]
)
def test_the_head_is_the_middle_of_the_frame(frame, rows, columns):
    (scene,) = head_scenes(1.0, 600.0, frame, None)
    wanted = make_scene("head", height=rows, width=columns, mm_per_pixel=1.0, distance_mm=600.0)
    np.testing.assert_array_equal(scene.irradiance, wanted.irradiance)
    np.testing.assert_array_equal(scene.mask, wanted.mask)


def test_of_a_picture_of_ones_own_the_middle_counts():
    rng = np.random.default_rng(4)
    light, mask = rng.random((520, 600, 1)), rng.integers(0, 2, (520, 600))
    kept = checked_scene(Scene("own", light, 0.6, mask=mask), 0.6)
    np.testing.assert_array_equal(kept.irradiance, light[4:516, 44:556])
    np.testing.assert_array_equal(kept.mask, mask[4:516, 44:556])


def test_a_close_up_has_to_hold_on_the_wider_view(skin1, monkeypatch):
    quick(monkeypatch)
    near = choose(skin1, mm_per_pixel=0.5, distance_mm=250.0, frame=(64, 64))
    pitches = [each.mm_per_pixel for each in near.scenes]
    assert pitches == [0.5, 1.0, 1.25, 1.375]  # 32 mm, and views of 64, 80 and 88 mm
    assert near.scenes[1].distance_mm == pytest.approx(500.0)
    exact = simulate_exact(skin1)
    for mm_per_pixel, distance in ((0.5, 250.0), (1.0, 500.0)):
        again = rendered_again(exact, near.chosen.option, mm_per_pixel, distance, size=64)
        assert again.delta_e_2000_p95 <= 1.0


def test_far_away_no_blur_is_needed(skin1):
    far = choose(skin1, mm_per_pixel=14.0, distance_mm=28_000.0, frame=FRAME)
    assert (far.fit, far.photons, far.chosen.option) == (None, None, None)
    scene = far.scenes[0]
    exact = simulate_exact(skin1)
    bare = measure(
        scene.irradiance * exact.diffuse_reflectance,
        render_reference(scene, exact),
        mask=scene.mask,
    )
    assert bare.delta_e_2000_p95 <= 1.0
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
        render_taps(seen, found.fit.kernel),
        render_reference(seen, simulate_exact(skin1)),
        mask=mask[:, middle],
    )
    assert score.delta_e_2000_p95 == pytest.approx(found.chosen.error)
    assert score.delta_e_2000_p95 <= 0.5


def slab_of(thickness_mm=5.0):
    layer = Layer(1.3, np.zeros(1), np.array([0.1]), np.array([1.0]), thickness_mm=thickness_mm)
    return Material("slab", ("grey",), (layer,))


def refused(*_, **__):
    raise SimulationError("slab grey: 40 and 36 directions differ; give .002, or montecarlo.")


def test_a_slab_is_held_against_its_exact_profile(monkeypatch):
    quick(monkeypatch)
    found = choose(slab_of(), mm_per_pixel=1.4, frame=(64, 64))
    assert found.profile.meta["method"] == "exact"
    assert found.profile.meta["settings"]["solver"] == "layer"
    assert found.chosen.within


def test_a_grid_that_no_method_can_have_is_said_once(caplog):
    layer = Layer(1.4, np.zeros(3), np.array([1e-6, 0.1, 1.0]), np.array([0.001, 8.0, 1.0]))
    wide = Material("wide", ("R", "G", "B"), (layer,))
    with (
        pytest.raises(SimulationError, match="over the limit of 100000"),
        caplog.at_level("INFO", logger="sssfit"),
    ):
        choose(wide, mm_per_pixel=1.4, frame=(64, 64))
    assert caplog.messages == []


def test_what_the_exact_solver_refuses_is_held_against_a_walk(monkeypatch, caplog):
    monkeypatch.setattr(truths, "WALK_PHOTONS", 20_000)
    monkeypatch.setattr(truths, "exact_with_all_light", refused)
    slab, view = slab_of(), {"mm_per_pixel": 1.4, "frame": (64, 64)}
    with caplog.at_level("INFO", logger="sssfit"):
        found = choose(slab, **view)
    assert caplog.messages == [
        "slab grey: 40 and 36 directions differ: tracing 1e7 photons for the true profile instead."
    ]
    assert found.profile.photons == 20_000
    assert found.photons.truth_method == "montecarlo"
    assert found.photons.counts == (10_000,)
    assert found.chosen.within
    other = choose(found.profile, **view, seed=7)
    assert (other.profile, other.chosen) == (found.profile, found.chosen)
    assert other.photons.errors != found.photons.errors


def test_the_seed_is_the_walks(monkeypatch):
    monkeypatch.setattr(truths, "WALK_PHOTONS", 1000)
    monkeypatch.setattr(truths, "exact_with_all_light", refused)
    slab = slab_of()
    first, second = (
        choose(slab, mm_per_pixel=8.0, frame=FRAME, seed=seed).profile for seed in (1, 2)
    )
    for seed, found in ((1, first), (2, second)):
        walk = simulate_montecarlo(slab, photons=1000, seed=seed)
        np.testing.assert_array_equal(found.annulus_energy, walk.annulus_energy)
    assert (first.annulus_energy != second.annulus_energy).any()


def test_a_profile_is_its_own_truth(skin1, choice, monkeypatch):
    quick(monkeypatch)
    given = simulate_exact(skin1)
    found = choose(given, mm_per_pixel=NEAR_MM, frame=FRAME)
    assert found.profile is given
    assert found.steps == choice.steps  # skin1's grid has all of the light
    nameless = replace(given, meta={**given.meta, "material": None, "material_sha256": None})
    assert choose(nameless, mm_per_pixel=NEAR_MM, frame=FRAME).chosen == choice.chosen


def test_walks_are_held_against_transport_alone(skin1):
    exact = simulate_exact(skin1)
    assert material_of(exact) == skin1
    assert material_of(simulate_dipole(skin1)) is None
    assert material_of(simulate_deon_skin()) is None
    assert (
        material_of(replace(exact, meta={**exact.meta, "material": None, "material_sha256": None}))
        is None
    )


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
        ((600.0, 1e-300, 1080), "make pixels of 9.*e-303 mm; expected 0.0005 mm"),
        ((600.0, 30.0, 10**9), r"on 1e\+09 rows make pixels of 3.*e-07 mm"),
        ((1e308, 179.9, 1), "make pixels of inf mm; expected a finite length"),
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
        ({"fetches": 5.9}, "fetches = 5.9; expected a number from 6 up"),
        ({"fetches": math.nan}, "fetches = nan; expected a number from 6 up"),
        ({"passes": 0}, "passes = 0; expected a whole number from 1 up"),
        ({"fetches": 6.0, "passes": 1}, "no known table has at most 6 fetches and 1 pass"),
        ({"tolerance_of": "p50"}, "tolerance_of = 'p50'; expected one of p95, p99, mean"),
        ({"mm_per_pixel": 1e-300}, "mm_per_pixel = 1e-300; expected a length from 0.0005 mm up"),
        ({"mm_per_pixel": 0.001}, "8193 are the most; expected pixels of 0.0052 mm or more"),
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


def test_forward_scattering_is_solved_and_not_taken_for_isotropic():
    layer = Layer(1.3, np.array([0.8]), np.array([0.1]), np.array([5.0]))
    forward = Material("forward", ("grey",), (layer,))
    found, _ = truths.truth_of(forward, seed=1, threads=1)
    expected = simulate_exact(forward, threads=1)
    assert found.diffuse_reflectance == pytest.approx(expected.diffuse_reflectance, rel=1e-12)
    assert found.meta["settings"]["similarity"] is False


def test_a_material_that_returns_nothing_is_refused():
    layer = Layer(1.3, np.zeros(1), np.array([0.1]), np.zeros(1))
    with pytest.raises(FitError, match="returns no light"):
        choose(Material("black", ("grey",), (layer,)), mm_per_pixel=0.6, frame=FRAME)


def test_what_cannot_be_fitted_to_a_profile_is_left_out_by_name(monkeypatch):
    quick(monkeypatch)
    coarse = make_profile([0.0, 1.0, 2.0, 4.0, 9.0], [[0.1], [0.1], [0.1], [0.05]])
    edge = make_scene("edge", height=48, width=48, mm_per_pixel=0.6, angle_degrees=30.0)
    real = Option.fit

    def fit(self, profile, mm_per_pixel):
        if self.fetches < 12.0:
            raise FitError("not this one")
        return real(self, profile, mm_per_pixel)

    monkeypatch.setattr(Option, "fit", fit)
    found = choose(coarse, mm_per_pixel=0.6, scene=edge, tolerance=2.0)
    assert found.unfitted
    assert not set(found.unfitted) & {each.label for each in found.steps}
    assert found.chosen.fetches >= 12.0
    with pytest.raises(FitError, match="no table within this budget can be fitted"):
        choose(coarse, mm_per_pixel=0.6, scene=edge, fetches=11.0)


def test_a_step_says_what_it_costs_and_loses():
    option = options(20.0, 12.0)[-1]
    figures = dict.fromkeys(COLOUR_FIGURES, 0.25)
    step = rooms.Step(option, 0.25, **figures, mm_per_pixel=1.6, within=True)
    said = step_line(step)
    assert said.startswith(
        "cascade 1|1|1|1|1|1: 12 fetches, Delta E 0.25 (95 % of pixels within 0.25"
    )
    assert said.endswith("within")


def test_on_pixels_as_wide_as_the_profile_few_taps_are_all_there_are(skin1):
    """A pass of three pixels has three taps, whatever the option's number."""
    option = next(each for each in options_of_all(20.0) if each.label.endswith("on 49 taps"))
    wide = replace(option, method="preintegrated", settings={"taps": 49})
    profile = simulate_exact(skin1)
    assert len(wide.fit(profile, 15.0).kernel.stages[0].offsets_mm) == 1
    assert wide.fit(profile, 30.0) is None


@pytest.mark.parametrize("names", [("guided",), ("guided", "svd")])
def test_what_cannot_be_fitted_is_named(choice, names):
    said = sentences(replace(choice, unfitted=names))
    assert f"cannot be fitted to this profile: {', '.join(names)}" in said
    assert not any("cannot be fitted" in each for each in sentences(replace(choice, unfitted=())))
