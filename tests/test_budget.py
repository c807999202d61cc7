"""The error budget: each cause by a closed form or by other code, and what they add up to."""

import functools
import json
from fractions import Fraction

import numpy as np
import pytest
from figures import assert_legible
from matplotlib.figure import Figure
from reference_render import random_kernel

from sssfit.chart.budget import budget_figure
from sssfit.cli import main
from sssfit.compare._budget_causes import make_sources, stored, true_picture
from sssfit.compare.budget import error_budget, error_budgets
from sssfit.compare.evaluate import evaluate
from sssfit.errors import FitError, KernelError, RenderError, SimulationError
from sssfit.fit import fit_svd, fit_taps
from sssfit.fit.on_taps import on_taps
from sssfit.kernel import SeparableKernel
from sssfit.material import load_material, parse_material
from sssfit.measure.score import COLOUR_FIGURES
from sssfit.profile import Profile
from sssfit.render.reference import render_reference
from sssfit.render.separable import render_separable
from sssfit.render.taps import render_taps
from sssfit.scene.made import make_scene
from sssfit.scene.record import Scene
from sssfit.simulate import simulate, simulate_exact, simulate_montecarlo

PHOTONS = 100_000
MATERIALS = ("skin1", "wholemilk", "ketchup")


def scene_of(name="edge", size=64, mm_per_pixel=1.0, **options):
    return make_scene(name, height=size, width=size, mm_per_pixel=mm_per_pixel, **options)


def noise_scene(size=12, mm_per_pixel=0.3):
    light = np.random.default_rng(3).uniform(size=(size, size, 1))
    return Scene("random", light, mm_per_pixel)


def cause(budget, name):
    return next(each for each in budget.causes if each.name == name)


@functools.cache
def exact_of(name):
    return simulate_exact(load_material(name))


@functools.cache
def budget_of(name):
    return error_budget(load_material(name), scene_of(), photons=PHOTONS)


@pytest.fixture(params=MATERIALS)
def budget(request):
    return budget_of(request.param)


@pytest.fixture(scope="module")
def milk():
    scenes = [scene_of("edge"), scene_of("disk")]
    return error_budgets(load_material("wholemilk"), scenes, photons=PHOTONS, storage="float64")


def norm(picture):
    return float(np.linalg.norm(picture))


def test_causes_and_interaction_make_the_whole(budget):
    parts = [c.difference for c in budget.causes if c.is_in_whole]
    assert len(parts) == 4
    total = sum(parts) + budget.interaction.difference
    np.testing.assert_allclose(total, budget.whole.difference, rtol=0, atol=1e-15)
    bound = sum(map(norm, parts)) + norm(budget.interaction.difference)
    assert norm(budget.whole.difference) <= bound
    shares = [budget.share(c) for c in (*budget.causes, budget.interaction) if c.is_in_whole]
    assert np.nansum(shares) == pytest.approx(1.0, abs=1e-9)


def test_the_interaction_is_smaller_than_the_second_largest_cause(budget):
    sizes = sorted(norm(c.difference) for c in budget.causes if c.is_in_whole)
    assert norm(budget.interaction.difference) < sizes[-2]


def test_the_whole_is_the_kernel_a_user_has(budget):
    # The verbs' way to it: the walk on its own grid, its fit, weights in half float.
    walk = simulate_montecarlo(budget.material, photons=PHOTONS)
    kernel = fit_svd(walk, rank=3, mm_per_pixel=1.0).kernel
    found = evaluate(scene_of(), stored(kernel, "half"))
    picture = budget.truth + budget.whole.difference
    # One more ulp of a weight where sums are taken in another order: half float has 2^-11.
    np.testing.assert_allclose(picture, found.picture, rtol=2.0**-11)
    assert budget.kernel.rank == 3


def test_taps_and_formats_are_what_a_shader_adds(budget):
    """Each against the step before it: dense, on 25 taps, with rounded pictures between passes."""
    kernel = fit_svd(exact_of(budget.material.name), rank=3, mm_per_pixel=1.0).kernel
    taps = on_taps(kernel, 25)
    dense = render_separable(budget.scene, kernel)
    thinned = render_taps(budget.scene, taps)
    rounded = render_taps(budget.scene, taps, intermediate="half")
    for name, wanted in (
        ("taps, 25 a pass", thinned - dense),
        ("pictures between passes, half", rounded - thinned),
    ):
        each = cause(budget, name)
        assert not each.is_in_whole
        np.testing.assert_allclose(each.difference, wanted, rtol=0, atol=1e-13)
        is_whole = name.startswith("taps") and kernel.pixels == 25  # every pixel has its tap
        assert (np.abs(wanted).max() < 1e-9) == is_whole
    names = {each.name for each in budget.causes}
    # The decomposition's weights have both signs, which R11G11B10 does not hold.
    assert "pictures between passes, r11g11b10" not in names


def test_causes_are_ordered_by_mean_delta_e(budget):
    for group in (True, False):
        seen = [c.score.delta_e_2000_mean for c in budget.causes if c.is_in_whole == group]
        assert seen == sorted(seen, reverse=True)


def test_separability_and_the_grid_are_what_judge_finds_for_the_exact_profile(milk):
    for found in milk:
        profile = exact_of(found.material.name)
        kernel = fit_svd(profile, rank=3, mm_per_pixel=1.0).kernel
        judged = render_separable(found.scene, kernel)
        parts = ("separability", "energy beyond the grid")
        ours = sum(cause(found, name).difference for name in parts)
        np.testing.assert_allclose(found.truth + ours, judged, rtol=0, atol=1e-12)


def test_separability_alone_is_judges_score_where_no_light_is_beyond(budget):
    if budget.beyond_grid.max() > 1e-5:
        pytest.skip("light lies beyond the grid")
    profile = exact_of(budget.material.name)
    kernel = fit_svd(profile, rank=3, mm_per_pixel=1.0).kernel
    judged = evaluate(budget.scene, kernel, truth=budget.truth).score
    ours = cause(budget, "separability").score
    # 1e-6 of the light is not on the grid; Delta E is of some 100 steps of lightness.
    assert ours.delta_e_2000_mean == pytest.approx(judged.delta_e_2000_mean, abs=1e-3)
    assert ours.relative_l2 == pytest.approx(judged.relative_l2, abs=2e-6)


def test_the_truth_is_the_references_picture_where_the_grid_holds_all():
    scene = scene_of("disk", 64, 2.0)  # reaches 126 mm: three times skin1's grid
    found = error_budget(load_material("skin1"), scene, photons=PHOTONS)
    truth = render_reference(scene, exact_of("skin1"))
    np.testing.assert_allclose(found.truth, truth, rtol=0, atol=2e-6)


def test_light_beyond_the_grid_is_its_share_of_the_mean_where_the_picture_ends_sooner():
    scene = noise_scene()
    found = error_budget(load_material("wholemilk"), scene, photons=PHOTONS, radius_mm=6.0)
    assert found.beyond_grid.min() > 1e-3
    lost = cause(found, "energy beyond the grid, if lost").difference
    even = found.beyond_grid * scene.irradiance.mean()
    np.testing.assert_allclose(lost, -np.broadcast_to(even, lost.shape), rtol=1e-9)


def test_a_fit_that_rescales_puts_the_light_beyond_into_its_kernel(milk):
    for found in milk:
        cut = 1.0 - found.beyond_grid / exact_of(found.material.name).diffuse_reflectance
        parts = ("separability", "energy beyond the grid")
        by_kernel = found.truth + sum(cause(found, each).difference for each in parts)
        # Rescaling multiplies the kernel, so all it adds is a share of its own picture.
        put = by_kernel * (1.0 - cut)
        gap = "energy beyond the grid", "energy beyond the grid, if lost"
        added = cause(found, gap[0]).difference - cause(found, gap[1]).difference
        np.testing.assert_allclose(added, put, rtol=1e-9, atol=1e-15)


def test_a_fit_that_keeps_the_least_error_loses_the_light_beyond():
    found = error_budget(
        load_material("wholemilk"),
        scene_of("disk", 16),
        photons=PHOTONS,
        settings={"rank": 3, "energy": "keep"},
    )
    lost, here = (
        cause(found, f"energy beyond the grid{each}").difference for each in (", if lost", "")
    )
    np.testing.assert_array_equal(lost, here)
    assert found.whole.score.energy_drift[0] < -0.02


def test_the_truth_keeps_all_energy(milk):
    for found in milk:
        drift = found.truth.mean(axis=(0, 1)) / found.scene.irradiance.mean()
        exact = exact_of(found.material.name).diffuse_reflectance
        np.testing.assert_allclose(drift, exact, rtol=1e-6)


def test_the_truths_grid_is_widened_and_its_start_is_the_users():
    material = load_material("wholemilk")
    sources = make_sources(material, 60.0, photons=10_000)
    ours, theirs = sources.on_grid(sources.exact), exact_of("wholemilk")
    assert sources.exact.beyond_grid.max() < 1e-4 < theirs.beyond_grid.max()
    assert sources.exact.r_edges_mm.tolist() == sources.walk.r_edges_mm.tolist()
    np.testing.assert_allclose(ours.r_edges_mm, theirs.r_edges_mm)
    np.testing.assert_allclose(ours.annulus_energy, theirs.annulus_energy, atol=2e-4)
    np.testing.assert_allclose(ours.beyond_grid, theirs.beyond_grid, atol=2e-4)
    assert isinstance(ours, Profile)


def test_noise_falls_with_the_root_of_the_photons():
    # The squared error of a walk has the mean V / photons; how well six walks tell it, and the
    # ratio of two such means, the walks themselves say.
    scene, material = scene_of("edge", 32), load_material("skin1")
    truth = true_picture(scene, exact_of("skin1"))
    few, many = (
        np.array(
            [
                np.square(true_picture(scene, walk) - truth).sum()
                for seed in range(1, 7)
                for walk in [simulate_montecarlo(material, photons=photons, seed=seed)]
            ]
        )
        for photons in (10_000, 100_000)
    )
    spread = np.hypot(*(each.std(ddof=1) / each.mean() / np.sqrt(6) for each in (few, many)))
    assert spread < 0.7  # else any ratio would do
    assert abs(np.log(few.mean() / many.mean()) - np.log(10.0)) < 4.0 * spread


def test_storage_in_double_precision_is_nothing(milk):
    for found in milk:
        here = cause(found, "storage, float64")
        assert here.is_in_whole
        assert not here.difference.any()
        assert here.score.delta_e_2000_mean == 0.0


def test_stored_weights_are_steps_of_their_format():
    kernel = fit_svd(exact_of("skin1"), rank=3, mm_per_pixel=0.5).kernel
    np.testing.assert_array_equal(stored(kernel, "float64").weights, kernel.weights)
    half = stored(kernel, "half").weights
    # 11 bits: rounding is up to 2^-11 of the weight, or 2^-25 where it is under 2^-14.
    bound = np.maximum(2.0**-11 * abs(kernel.weights), 2.0**-25)
    assert (abs(half - kernel.weights) <= bound).all()
    assert (half != kernel.weights).any()
    with pytest.raises(KernelError, match=r"4-bit.*float64, float32, half, 8-bit"):
        stored(kernel, "4-bit")


def test_bytes_have_a_scale_a_channel_and_a_sign_only_where_it_is_needed():
    # By hand: the largest weight is 1, 2 and 0; a channel without negative weights has 255 steps.
    middle = [0.4, 1.0, 0.4], [0.3, 2.0, 0.3], [0.0, 0.0, 0.0]
    second = [0.12, 0.0, 0.12], [-0.7, 0.9, -0.7], [0.0, 0.0, 0.0]
    weights = np.array([middle, second]).transpose(0, 2, 1)
    found = stored(random_kernel(2, 1, 3, 1, weights=weights), "8-bit").weights
    expected = {
        (0, 0, 0): Fraction(102, 255),
        (0, 1, 0): Fraction(1),
        (1, 0, 0): Fraction(31, 255),  # 30.6
        (0, 0, 1): Fraction(2 * 19, 127),  # 19.05
        (1, 0, 1): Fraction(-2 * 44, 127),  # -44.45
        (1, 1, 1): Fraction(2 * 57, 127),  # 57.15
    }
    for place, value in expected.items():
        assert found[place] == pytest.approx(float(value), rel=1e-12), place
    assert not found[:, :, 2].any()


def test_a_model_takes_the_walks_place():
    found = error_budget(load_material("skin1"), scene_of("disk"), photons=PHOTONS, model="dipole")
    assert not cause(found, "simulation noise").is_in_whole
    inside = [each.name for each in found.causes if each.is_in_whole and each.score]
    assert inside[0] == "dipole instead of exact"
    # A kernel fitted to the dipole has the dipole's error: 13 % too bright in blue.
    assert found.whole.score.energy_drift[2] == pytest.approx(
        cause(found, "dipole instead of exact").score.energy_drift[2], abs=0.01
    )


def test_the_same_seed_gives_the_same_budget_on_any_threads():
    one, two = (
        error_budget(load_material("skin1"), noise_scene(), photons=20_000, threads=each)
        for each in (1, 2)
    )
    np.testing.assert_array_equal(one.whole.difference, two.whole.difference)


STACK = """channels = ["grey"]
[[layers]]
eta = 1.4
g = 0.5
sigma_a_per_mm = [0.1]
sigma_s_per_mm = [4.0]
thickness_mm = 2.0
[[layers]]
eta = 1.4
g = 0
sigma_a_per_mm = [0.3]
sigma_s_per_mm = [1.0]
thickness_mm = 5.0
"""


def test_a_stack_has_a_budget_against_its_exact_profile(caplog):
    material, scene = parse_material(STACK, "stack.toml"), scene_of(size=32)
    with caplog.at_level("INFO", logger="sssfit"):
        found = error_budget(material, scene, photons=20_000)
    assert any(
        "dipole, dipole-grosjean, burley, which are of such, are left out" in each
        for each in caplog.messages
    )
    names = [each.name for each in found.causes]
    assert "multipole instead of exact" in names
    assert not any("dipole instead" in each or "burley" in each for each in names)
    exact = simulate_exact(material)
    noise = true_picture(scene, simulate_montecarlo(material, photons=20_000)) - found.truth
    np.testing.assert_allclose(cause(found, "simulation noise").difference, noise, atol=2e-4)
    np.testing.assert_allclose(found.truth, true_picture(scene, exact), atol=2e-4)


def test_bad_input_is_one_line():
    skin1 = load_material("skin1")
    even = Scene("even", np.ones((8, 8, 1)), 1.0)
    with pytest.raises(RenderError, match="even is of one colour"):
        error_budget(skin1, even)
    with pytest.raises(RenderError, match="no picture"):
        error_budgets(skin1, [])
    with pytest.raises(RenderError, match=r"random has 0\.3 mm per pixel and edge 1; expected"):
        error_budgets(skin1, [scene_of(), noise_scene()])
    with pytest.raises(SimulationError, match=r"model = 'photon'.*-grosjean, burley, or"):
        error_budget(skin1, noise_scene(), model="photon")
    slab = parse_material(skin1.to_toml() + "thickness_mm = 5.0\n", "slab.toml")
    with pytest.raises(SimulationError, match="model = 'dipole'; of skin1 there is multipole, or"):
        error_budget(slab, noise_scene(), model="dipole")
    with pytest.raises(FitError, match="rank"):
        error_budget(skin1, noise_scene(), photons=1000, settings={"rank": 1000})


def test_the_chart_is_legible_and_shares_are_stacked(milk):
    assert_legible(lambda: budget_figure(milk))
    assert_legible(lambda: budget_figure(budget_of("skin1")))
    figure = budget_figure(milk)
    assert isinstance(figure, Figure)
    stacked, alone = figure.axes
    widths = {}
    for bar in stacked.patches:
        row = round(bar.get_y() + 0.5 * bar.get_height())
        widths[row] = widths.get(row, 0.0) + bar.get_width()
    assert widths == pytest.approx({0: 100.0, 1: 100.0})
    drawn = [label.get_text() for label in alone.get_yticklabels()]
    assert drawn[:2] == [each.name for each in milk[0].causes[:2]]
    assert "(dipole instead of exact)" in drawn


def test_a_million_photons_unless_told_otherwise(monkeypatch, capsys):
    asked = []

    def error_budgets_of(material, scenes, **settings):
        asked.append((settings["photons"], settings["seed"]))
        raise SimulationError("enough")

    monkeypatch.setattr("sssfit.compare.runner.error_budgets", error_budgets_of)
    run(capsys, "skin1", "--what", "budget", *("--picture", "disk", "--size", "8x8"))
    given = ("--photons", "2e4", "--seed", "3", "--picture", "disk", "--size", "8x8")
    run(capsys, "skin1", "--what", "budget", *given)
    assert asked == [(1_000_000, 1), (20_000, 3)]
    walked = []

    def few(material, method, *, photons, **settings):
        walked.append(photons)
        return simulate(material, method, photons=1000, **settings)

    monkeypatch.setattr("sssfit.compare._budget_causes.simulate", few)
    found = error_budgets(load_material("skin1"), [noise_scene(4)])
    assert walked == [found[0].photons] == [1_000_000]


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as ended:
        main(["compare", *arguments])
    return ended.value.code, capsys.readouterr()


def test_the_command_prints_what_the_library_finds(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    given = (
        "skin1",
        "--what",
        "budget",
        "--picture",
        "edge,disk",
        "--size",
        "64x64",
        "--photons",
        "1e5",
    )
    code, printed = run(capsys, *given, "--mm-per-pixel", "1", "--budget-chart", "b.png", "--json")
    assert code == 0
    tilted = scene_of(angle_degrees=30.0)
    found = error_budget(load_material("skin1"), tilted, photons=PHOTONS)
    whole = json.loads(printed.out)
    assert whole["output"] == ["b.png"]
    assert whole["rows"] == []
    figures = whole["budget"]
    assert (tmp_path / "b.png").read_bytes().startswith(b"\x89PNG")
    rows = {row["cause"]: row for row in figures["rows"] if row["picture"] == "edge"}
    assert {row["picture"] for row in figures["rows"]} == {"edge", "disk"}
    for each in (*found.causes, found.whole, found.interaction):
        row = rows[each.name]
        assert row["in_whole"] == each.is_in_whole
        for key in COLOUR_FIGURES:
            assert row[key] == getattr(each.score, key)
        assert row["energy_drift"] == each.score.energy_drift.tolist()
        assert row["share_of_whole"] == found.share(each)


def test_the_command_writes_a_table_and_what_to_do(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    given = ("skin1", "--what", "budget", "--picture", "head", "--size", "64x64")
    given += ("--mm-per-pixel", "2", "--photons", "1e5")
    code, printed = run(
        capsys, *given, "--method", "gaussians", "--terms", "2", "--model", "burley"
    )
    assert code == 0
    lines = printed.out.splitlines()
    assert lines[0].startswith("skin1 on head, 64 x 64 pixels of 2 mm: burley to 41.48 mm")
    assert any(line.startswith("burley instead of exact") for line in lines)
    assert any(line.startswith("(simulation noise)") for line in lines)
    assert lines[-1].startswith("First: ")


@pytest.mark.parametrize(
    ("arguments", "code", "says"),
    [
        (("skin1", "--what", "kernels", "--model", "dipole"), 2, "--model is for"),
        (("skin1", "--what", "budget", "--rank", "2", "--method", "burley"), 2, "--rank is for"),
        (("skin1", "--what", "budget", "--picture", "edge,"), 2, "no picture ''"),
        (("deon-skin", "--what", "budget"), 1, "deon-skin has no coefficients"),
        (("a.profile.npz", "--what", "budget"), 1, "is a profile, and a budget simulates"),
        (("skin1", "--what", "budget", "--budget-chart", "b.txt"), 1, "b.txt"),
    ],
)
def test_wrong_usage_is_one_line(capsys, arguments, code, says):
    found, printed = run(capsys, *arguments)
    assert found == code
    assert says in printed.err


@pytest.mark.parametrize(
    ("sign", "steps"),
    # .3 / .5 of 255 is 153, .1237 / .5 is 63.09; of 127 they are 76.2 and 31.4.
    [(1.0, [63.0, 153.0, 255.0, 153.0, 63.0]), (-1.0, [-31.0, -76.0, -127.0, -76.0, -31.0])],
)
def test_8_bits_are_whole_steps_of_the_largest_weight(sign, steps):
    kernel = SeparableKernel(
        method="by hand",
        mm_per_pixel=0.1,
        channels=("Y",),
        signs=np.ones((1, 1)),
        weights=sign * np.array([0.1237, 0.3, 0.5, 0.3, 0.1237])[None, :, None],
        relative_frobenius_error=np.zeros(1),
        energy_error=np.zeros(1),
        scale=np.ones(1),
        parameters={},
        meta={},
    )
    found = stored(kernel, "8-bit").weights.ravel() / 0.5 * max(np.abs(steps))
    np.testing.assert_allclose(found, steps, rtol=0, atol=1e-9)


# Of a cascade


@functools.cache
def cascade_budget(stages, storage="half"):
    settings = {"stages": stages}
    scene = scene_of("points", 96, 0.6)
    return error_budget(
        *(load_material("skin1"), scene),
        photons=PHOTONS,
        method="cascade",
        settings=settings,
        storage=storage,
    )


def test_a_cascades_causes_make_the_whole_and_have_the_halvings_apart():
    budget = cascade_budget("1|1-1")
    inside = {each.name for each in budget.causes if each.is_in_whole}
    assert inside == {
        *("stages", "resolution", "simulation noise", "energy beyond the grid"),
        "storage, half float",
    }
    parts = sum(each.difference for each in budget.causes if each.is_in_whole)
    total = parts + budget.interaction.difference
    np.testing.assert_allclose(total, budget.whole.difference, rtol=0, atol=1e-15)
    assert sum(map(budget.share, (*budget.causes, budget.interaction))) - sum(
        budget.share(each) for each in budget.causes if not each.is_in_whole
    ) == pytest.approx(1.0)


def test_resolution_is_what_rendering_has_beyond_the_mean_over_places():
    """The table fitted to the light on the grid alone, at the four places among the texels."""
    budget = cascade_budget("1|1-1")
    walk = make_sources(load_material("skin1"), 96 * 0.6 * 1.5, photons=PHOTONS)
    taps = fit_taps(walk.cut(walk.exact), stages="1|1-1", mm_per_pixel=0.6).kernel
    scene = budget.scene
    mean = np.zeros((96, 96, 3))
    for dy in (0, 1):
        for dx in (0, 1):
            light = np.roll(scene.irradiance, (dy, dx), axis=(0, 1))
            shown = render_taps(Scene("moved", light, 0.6), taps)
            mean += np.roll(shown, (-dy, -dx), axis=(0, 1)) / 4
    apart = render_taps(scene, taps) - mean
    inside = slice(40, 56)  # where the mirrors are out of reach
    found = cause(budget, "resolution").difference
    scale = np.abs(apart[inside, inside]).max()
    np.testing.assert_allclose(
        found[inside, inside], apart[inside, inside], rtol=0, atol=0.01 * scale
    )
    assert scale > 0.0


def test_a_cascade_at_full_resolution_has_no_such_cause():
    names = [each.name for each in cascade_budget("1-1").causes]
    assert "resolution" not in names
    assert "stages" in names
    assert not any(each.startswith("taps,") for each in names)


def test_stages_before_the_first_halving_make_it_matter_less():
    errors = [
        cause(cascade_budget(each), "resolution").score.delta_e_2000_p99
        for each in ("1|1-1", "1-1|1-1")
    ]
    assert errors[1] < 0.5 * errors[0]


def test_a_cascade_is_stored_with_weights_that_add_up_to_1():
    taps = cascade_budget("1|1-1", "8-bit").kernel
    for stage in taps.stages:
        sums = stage.weights[0] + 2.0 * stage.weights[1:].sum(axis=0)
        np.testing.assert_allclose(sums, 1.0, rtol=0, atol=1e-12)
        codes = stage.weights[1:] / stage.weights[1:].max(axis=0) * 255
        np.testing.assert_allclose(codes, np.round(codes), rtol=0, atol=1e-9)
    assert (cascade_budget("1|1-1", "float64").kernel.blend != taps.blend).any()


def test_a_cascades_budget_is_drawn_and_written():
    budget = cascade_budget("1|1-1")
    figures = budget.to_dict()
    assert (figures["rank"], figures["structure"]) == (None, "1|1-1")
    assert_legible(lambda: budget_figure(budget))


def test_a_disk_has_no_budget():
    with pytest.raises(FitError, match="a disk shows another picture in each frame"):
        error_budget(load_material("skin1"), scene_of(), method="disk")
