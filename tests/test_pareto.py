"""Kernels by error and cost: the front, and rows against what judges them one at a time."""

import dataclasses
import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from reference_front import literal_front
from reference_pixels import make_profile

from sssfit.compare import pareto
from sssfit.compare.candidates import (
    BUDGETS,
    CASCADES,
    DISKS,
    Candidate,
    candidates,
    every_candidate,
    missing,
)
from sssfit.compare.comparison import COSTS, ERRORS, check_error, pareto_front, verdicts
from sssfit.compare.evaluate import evaluate
from sssfit.compare.pareto import check_scenes, compare_kernels
from sssfit.compare.references import border_of, evaluated_scene
from sssfit.errors import FitError, RenderError
from sssfit.material import load_material
from sssfit.measure.score import COLOUR_FIGURES, measure
from sssfit.methods import FITS, Method
from sssfit.render.reference import render_reference
from sssfit.render.separable import render_separable
from sssfit.scene.made import make_scene
from sssfit.scene.record import Scene
from sssfit.simulate import simulate_exact

PITCH = 1.0
SOME = (
    Candidate("svd 1", "svd", 1, {"rank": 1}),
    Candidate("svd 2", "svd", 2, {"rank": 2}),
    Candidate("svd 2, kept", "svd", 2, {"rank": 2, "energy": "keep"}),
    Candidate("gaussians 2", "gaussians", 2, {"terms": 2}),
    Candidate("pre-integrated", "preintegrated", 1),
)
IMPOSSIBLE = Candidate("svd 0", "svd", 0, {"rank": 0})
# Few values, so that ties are common; NaN and inf among them.
FIGURES = st.sampled_from([0.0, 1.0, 2.0, 3.0, float("nan"), float("inf")]) | st.floats(0, 9)


@pytest.fixture(scope="module")
def skin1():
    return simulate_exact(load_material("skin1"))


@pytest.fixture(scope="module")
def scenes():
    return [make_scene(name, height=64, width=64, mm_per_pixel=PITCH) for name in ("disk", "head")]


@pytest.fixture(scope="module")
def comparison(skin1, scenes):
    return compare_kernels(skin1, scenes, candidates=SOME)


def flat(value=0.5, name="flat", pitch=PITCH):
    return Scene(name, np.full((8, 8, 1), value), pitch)


@given(st.lists(st.tuples(FIGURES, FIGURES), max_size=12))
def test_the_front_is_the_literal_one(points):
    cost, error = [each[0] for each in points], [each[1] for each in points]
    assert pareto_front(cost, error).tolist() == literal_front(cost, error)


@given(st.lists(st.tuples(FIGURES, FIGURES), max_size=12))
def test_along_the_front_cost_rises_and_error_falls(points):
    cost, error = np.array(points, dtype=float).reshape(-1, 2).T
    front = pareto_front(cost, error)
    order = np.argsort(cost[front])
    assert (np.diff(cost[front][order]) > 0).all()
    assert (np.diff(error[front][order]) < 0).all()
    assert front.any() == (np.isfinite(cost) & np.isfinite(error)).any()


def test_of_equal_points_the_first_is_kept():
    assert pareto_front([2, 2, 2], [0.3, 0.1, 0.1]).tolist() == [False, True, False]
    assert pareto_front([], []).tolist() == []


@pytest.mark.parametrize("points", [([1, 2], [1]), ([[1, 2]], [[1, 2]]), (1.0, 1.0)])
def test_points_that_do_not_pair_are_refused(points):
    with pytest.raises(RenderError, match="two lists of one length"):
        pareto_front(*points)


def test_rows_are_what_judge_and_measure_say(skin1, scenes, comparison):
    rows = iter(comparison.rows)
    for candidate in SOME:
        fit = candidate.fit(skin1, PITCH, None)
        for scene in scenes:
            row, shown = next(rows), evaluated_scene(scene, skin1)
            border = {"disk": "zero", "head": "mirror"}[scene.name]
            alone = evaluate(shown, fit.kernel, skin1, border=border)
            truth = render_reference(shown, skin1, border=border)
            picture = render_separable(shown, fit.kernel, border=border)
            score = measure(picture, truth, mask=shown.mask)
            assert (row.label, row.method) == (candidate.label, candidate.method)
            assert (row.picture, row.rank) == (scene.name, fit.kernel.rank)
            keys = (*COLOUR_FIGURES, "relative_l2", "rmse", "psnr_db")
            for key in keys:
                assert getattr(row, key) == getattr(alone.score, key) == getattr(score, key)
            np.testing.assert_array_equal(row.energy_drift, score.energy_drift)
            np.testing.assert_array_equal(row.radial_asymmetry, alone.asymmetry)
            np.testing.assert_array_equal(
                row.relative_frobenius_error, fit.relative_frobenius_error
            )
            assert row.stop_reasons == fit.stop_reasons
            assert row.passes == 2 * candidate.terms
            assert row.all_passes == row.passes
            used = fit.kernel.weights.any(axis=2)  # far weights of a Gaussian are 0
            assert row.fetches == 2 * np.count_nonzero(used) <= row.passes * comparison.pixels
            # In half floats: a pass reads and writes 8 bytes, and adding reads 8 more.
            assert row.bytes_per_pixel == 8 * (2 * row.passes + candidate.terms - 1)
            assert row.kernel_bytes == 4 * candidate.terms * comparison.pixels * 3
            assert row.taps is row.structure is None
            assert row.is_dense
            assert row.seconds_per_megapixel > 0 < row.fit_seconds
    assert next(rows, None) is None


def test_pictures_are_named_with_the_exposure_of_their_truth(skin1, scenes, comparison):
    for scene, picture in zip(scenes, comparison.pictures, strict=True):
        shown = evaluated_scene(scene, skin1)
        kernel = SOME[0].fit(skin1, PITCH, None).kernel
        score = evaluate(shown, kernel, skin1, border=border_of(shown)).score
        assert dataclasses.astuple(picture) == (scene.name, 64, 64, score.exposure)


def test_fronts_are_those_of_each_picture(comparison):
    for picture in ("disk", "head"):
        rows = comparison.rows_of(picture)
        assert [row.label for row in rows] == [each.label for each in SOME]
        for error in ERRORS:
            for cost in COSTS:
                wanted = literal_front(
                    [row.rounded_cost(cost) for row in rows], [row.error(error) for row in rows]
                )
                found = [(error, cost) in row.fronts for row in rows]
                assert found == wanted
                front = comparison.front(picture, error, cost)
                # Not beaten by the figures as measured either, which are not rounded.
                exact = [row.cost(cost) for row in front], [row.error(error) for row in front]
                assert all(literal_front(*exact))


@pytest.mark.parametrize("cost", COSTS)
@pytest.mark.parametrize("error", ERRORS)
def test_verdicts_weigh_all_pictures_alike_and_name_the_worst(comparison, error, cost):
    wanted = []
    for candidate in SOME:
        rows = [row for row in comparison.rows if row.label == candidate.label]
        worst = max(rows, key=lambda row: row.error(error))
        wanted.append(
            {
                "label": candidate.label,
                "cost": rows[0].rounded_cost(cost),
                "typical_error": math.prod(row.error(error) for row in rows) ** (1 / len(rows)),
                "error": worst.error(error),
                "picture": worst.picture,
                "delta_e_2000_p95": max(row.delta_e_2000_p95 for row in rows),
            }
        )
    front = literal_front(*([each[key] for each in wanted] for key in ("cost", "typical_error")))
    wanted = [each for each, is_on in zip(wanted, front, strict=True) if is_on]
    wanted.sort(key=lambda each: each["cost"])
    for each in wanted:
        each["typical_error"] = pytest.approx(each["typical_error"], rel=1e-12)
    assert [dataclasses.asdict(each) for each in verdicts(comparison, error, cost)] == wanted


def test_the_95_percent_of_a_verdict_are_those_of_every_picture(comparison):
    disk, head = (row for row in comparison.rows if row.label == "svd 1")
    disk = dataclasses.replace(disk, relative_l2=0.5, delta_e_2000_p95=1.0)
    head = dataclasses.replace(head, relative_l2=0.1, delta_e_2000_p95=7.0)
    for rows in ((disk, head), (head, disk)):
        (found,) = verdicts(dataclasses.replace(comparison, rows=rows), "l2", "fetches")
        assert (found.error, found.picture, found.delta_e_2000_p95) == (0.5, disk.picture, 7.0)


def test_the_same_call_gives_the_same_rows_but_for_seconds(skin1, scenes, comparison):
    again = compare_kernels(skin1, scenes, candidates=SOME, threads=1)
    for row, other in zip(comparison.rows, again.rows, strict=True):
        for field in dataclasses.fields(row):
            if "seconds" in field.name:
                continue
            one, two = (getattr(each, field.name) for each in (row, other))
            if field.name == "fronts":
                one, two = ({each for each in own if "seconds" not in each} for own in (one, two))
            np.testing.assert_array_equal(one, two)


def test_all_candidates_are_tried_unless_some_are_named(skin1):
    seen, scene = [], make_scene("disk", height=32, width=32, mm_per_pixel=4.0)
    quick = {"progress": lambda *each: seen.append(each), "timed_seconds": 0.0}
    found = compare_kernels(skin1, [scene], **quick)
    wanted = [each.label for each in every_candidate(found.pixels)]
    assert [row.label for row in found.rows] == wanted
    steps = [*wanted, "timing"]
    assert seen == [(k, len(wanted), step) for k, step in enumerate(steps)]


def test_kernels_on_taps_are_those_of_the_dense_ones_within_a_budget(skin1, scenes):
    """Each is fitted as it is alone, and costs its terms and a first pass that they share."""
    wanted = [each for each in every_candidate(41) if each.label.startswith(("svd 2", "artist on"))]
    found = compare_kernels(skin1, scenes[1:], support_mm=20.0, candidates=wanted)
    rows = {row.label: row for row in found.rows}
    assert "svd 2" in rows
    for candidate in wanted:
        row = rows[candidate.label]
        assert row.taps == candidate.taps
        if candidate.taps is None:
            continue
        assert row.label == f"{candidate.dense_label} on {row.taps} taps"
        assert row.fetches == (row.rank + 1) * row.taps
        assert row.passes == row.all_passes == row.rank + 1
        assert min(abs(row.fetches - each) for each in BUDGETS) < 2 * (row.rank + 1)
        assert not row.is_dense
        assert row.stop_reasons == ()
        assert np.isnan(row.relative_frobenius_error).all()
        alone = candidate.fit(skin1, PITCH, 20.0)
        score = evaluate(evaluated_scene(scenes[1], skin1), alone.kernel, skin1).score
        assert row.delta_e_2000_p99 == score.delta_e_2000_p99


def test_no_kernel_has_more_taps_than_pixels_or_a_budget_allows():
    for pixels in (3, 9, 41, 143, 1001):
        found = [each for each in every_candidate(pixels) if each.taps]
        assert found
        for each in found:
            assert each.taps % 2 == 1
            assert 3 <= each.taps <= pixels
            assert (each.terms + 1) * each.taps <= max(BUDGETS)
        assert len({each.label for each in found}) == len(found)


def test_cascades_stand_at_their_fetches_and_stages(skin1, scenes):
    cascade = next(each for each in every_candidate(41) if each.method == "cascade")
    found = compare_kernels(skin1, scenes, candidates=[cascade, SOME[0]])
    row = found.rows[0]
    kernel = cascade.fit(skin1, PITCH, None).kernel
    assert row.label == f"cascade {CASCADES[0]}"
    assert row.structure == kernel.structure
    assert row.rank is row.taps is None
    assert (row.fetches, row.passes) == (kernel.fetches, kernel.passes)
    assert row.all_passes == kernel.cost.all_passes > row.passes
    assert row.bytes_per_pixel == kernel.bytes_per_pixel("half")
    assert row.fetches <= CASCADES[0]
    assert not row.is_dense


def test_disks_stand_at_their_fetches_in_one_pass(skin1, scenes):
    disks = [each for each in every_candidate(41) if each.method == "disk"]
    found = compare_kernels(skin1, scenes[:1], support_mm=6.0, candidates=[*disks, SOME[0]])
    for taps, candidate, row in zip(DISKS, disks, found.rows, strict=False):
        assert row.label == f"disk {taps}"
        assert (row.fetches, row.passes, row.bytes_per_pixel) == (taps, 1, 16.0)
        kernel = candidate.fit(skin1, PITCH, 6.0).kernel
        assert kernel.stages[0].offsets_mm.max() < 6.0 + PITCH / 2
        assert not row.is_dense
    assert [each.label for each in every_candidate(4) if each.method == "disk"] == ["disk 16"]


def test_only_the_methods_asked_for_are_compared(skin1, scenes):
    found = compare_kernels(skin1, scenes[:1], only=["preintegrated", "artist"])
    assert {row.method for row in found.rows} == {"preintegrated", "artist"}
    wanted = [each.label for each in every_candidate(found.pixels, ["preintegrated", "artist"])]
    assert [row.label for row in found.rows] == wanted
    assert {each.method for each in every_candidate(9)} > {"cascade", "svd", "weighted"}
    dense = {each.label for each in candidates(9)}
    assert {each.label for each in every_candidate(9)} > dense


def test_a_fit_of_which_nothing_is_said_is_compared_with_its_defaults(monkeypatch):
    before = every_candidate(41)
    monkeypatch.setitem(FITS, "new", Method("sssfit.fit.svd:fit_svd", "-"))
    monkeypatch.setitem(FITS, "newer", Method("sssfit.fit.disk:fit_disk", "-", makes_taps=True))
    found = [each for each in every_candidate(41) if each not in before]
    assert [(each.label, each.method, each.terms) for each in found] == [
        ("new", "new", 1),
        *((f"new on {taps} taps", "new", 1) for taps in (5, 11, 25)),
        ("newer", "newer", 0),
    ]
    assert missing(41, 0.3, ["new", "newer"]) == []


def test_support_is_handed_to_the_fits(skin1, scenes):
    found = compare_kernels(skin1, scenes[:1], support_mm=4.0, candidates=SOME[:1])
    assert found.pixels == 9
    assert found.rows[0].fetches == 18


def test_what_cannot_be_fitted_is_left_out_by_name(skin1, scenes):
    found = compare_kernels(skin1, scenes, candidates=[SOME[0], IMPOSSIBLE])
    assert [row.label for row in found.rows] == ["svd 1", "svd 1"]
    ((label, reason),) = found.left_out
    assert label == "svd 0"
    assert "rank" in reason


def test_nothing_fitted_is_an_error(skin1, scenes):
    with pytest.raises(FitError, match=r"skin1: no kernel of 1 could be fitted: .*rank"):
        compare_kernels(skin1, scenes, candidates=[IMPOSSIBLE])


@pytest.mark.parametrize(
    ("only", "pitch", "reason"),
    [
        (["guided"], 0.05, "the guided fit takes 3 to 513 pixels a pass, and the kernel is of 855"),
        (["disk"], 15.0, "disks have 16 fetches or more, .* of 3 x 3 pixels of 15 mm; give a "),
        (["nope"], 2.0, "no kernel of nope is compared"),
        ([], 2.0, "there are none; give one or more"),
    ],
)
def test_no_kernel_to_compare_says_why(skin1, only, pitch, reason):
    scene = make_scene("edge", height=8, width=8, mm_per_pixel=pitch)
    with pytest.raises(FitError, match=f"^skin1: no kernel to compare: {reason}"):
        compare_kernels(skin1, [scene], only=only)


def test_a_method_asked_for_that_has_no_kernel_is_left_out_by_name():
    assert missing(41, 2.0, ["svd", "disk"]) == missing(855, 0.05, None) == []
    ((label, reason),) = missing(855, 0.05, ["svd", "guided"])
    assert (label, "513 pixels" in reason) == ("guided", True)


@pytest.mark.parametrize("value", [0.0, 0.5])
def test_a_picture_of_one_colour_is_refused(skin1, value):
    with pytest.raises(RenderError, match="flat is of one colour"):
        compare_kernels(skin1, [flat(value)], candidates=SOME)


def test_a_picture_of_one_colour_within_its_mask_is_refused():
    light, mask = np.zeros((8, 8, 1)), np.zeros((8, 8), dtype=int)
    light[:, :4], mask[:, :4] = 1.0, 1
    with pytest.raises(RenderError, match="one colour"):
        check_scenes([Scene("half", light, PITCH, mask=mask)], 3)
    check_scenes([Scene("half", light, PITCH)], 3)


def test_pictures_that_cannot_be_told_apart_or_compared_are_refused(scenes):
    with pytest.raises(RenderError, match="each once"):
        check_scenes([scenes[0], scenes[0]], 3)
    with pytest.raises(RenderError, match="one or more"):
        check_scenes([], 3)
    finer = make_scene("edge", height=8, width=8, mm_per_pixel=0.5)
    with pytest.raises(RenderError, match=r"edge has 0\.5 mm per pixel and disk 1; expected"):
        check_scenes([scenes[0], finer], 3)
    colours = Scene("colours", np.random.default_rng(1).random((8, 8, 3)), PITCH)
    with pytest.raises(RenderError, match="channels"):
        check_scenes([colours], 2)


def test_delta_e_needs_channels_that_have_a_colour(scenes):
    profile = make_profile([0.0, 2.0, 8.0], [[0.3, 0.2], [0.1, 0.1]])
    found = compare_kernels(profile, scenes, candidates=SOME[:2])
    assert all(np.isnan(row.delta_e_2000_mean) for row in found.rows)
    assert found.front("disk", "delta-e", "passes") == []
    assert found.front("disk", "l2", "passes")
    with pytest.raises(RenderError, match="Delta E of 2 channels"):
        check_error("delta-e", 2)
    check_error("l2", 2)


def test_a_truth_that_is_there_is_not_rendered_again(skin1, scenes):
    kernel = SOME[0].fit(skin1, PITCH, None).kernel
    truth = 2.0 * render_reference(scenes[0], skin1)
    found = evaluate(scenes[0], kernel, truth=truth)
    assert found.truth is truth
    score = measure(found.picture, truth)
    assert found.score.rmse == score.rmse


def test_seconds_are_by_pixels(skin1, monkeypatch):
    ticks = itertools.count()
    monkeypatch.setattr(pareto, "perf_counter", lambda: 0.001 * next(ticks))
    oblong = make_scene("disk", height=20, width=50, mm_per_pixel=PITCH)
    found = compare_kernels(skin1, [oblong], candidates=SOME[:1])
    assert found.rows[0].seconds_per_megapixel == pytest.approx(0.001 * 1e6 / (20 * 50))
