"""The artist's kernel fitted to pictures: what is judged, and how near it comes."""

import json
from pathlib import Path

import numpy as np
import pytest
from reference_pixels import make_profile

from sssfit.cli import main
from sssfit.compare.evaluate import evaluate
from sssfit.compare.pictures import PIXELS, picture_error
from sssfit.errors import RenderError
from sssfit.fit import fit_artist, make_target
from sssfit.kernel import SeparableKernel
from sssfit.material import load_material
from sssfit.measure.score import measure
from sssfit.render.reference import render_reference
from sssfit.render.separable import render_separable
from sssfit.scene.made import make_scene
from sssfit.shapes import gaussian_cdf
from sssfit.simulate import simulate_exact

# A trial in advance, skin1 on 200 x 200 pixels of .3 mm; the line fit has 3.65, 1.86 and .93 there.
TRIAL = {"disk": 1.08, "edge": 0.40, "head": 0.33}


@pytest.fixture(scope="module")
def skin1():
    return simulate_exact(load_material("skin1"))


@pytest.fixture(scope="module")
def fitted(skin1):
    return fit_artist(skin1, mm_per_pixel=0.3, target=picture_error)


@pytest.fixture
def no_patience(monkeypatch):
    """End the search early."""
    monkeypatch.setattr("sssfit.fit.artist._MAX_EVALUATIONS", 30)


def numbers(kernel):
    """(w, log v_near, log v_far) of every channel (3, C)."""
    found = [kernel.parameters[name] for name in kernel.channels]
    near, far = (np.log([each[key] for each in found]) for key in ("near_mm2", "far_mm2"))
    return np.stack(([each["weight"] for each in found], near, far))


def gaussian_profile(variances, totals):
    """A Gaussian a channel: a kernel that one pass meets."""
    edges = np.linspace(0.0, 6.0, 601)
    within = np.array(totals) * gaussian_cdf(edges[:, None], np.array(variances))
    return make_profile(edges, np.diff(within, axis=0), beyond_grid=totals - within[-1])


def test_what_is_judged_is_the_mean_delta_e_of_whole_pictures(skin1):
    """By the renderer and the measure of `compare`, on all pixels of pictures as wide as high."""
    target = make_target(skin1, 0.3)
    coarse_mm = target.half_pixels * 0.3 / 24
    assert PIXELS * coarse_mm == pytest.approx(60.0, abs=1.0)
    hand = {"near_mm2": (1.1, 0.3, 0.02), "far_mm2": (20.0, 5.0, 0.6), "weight": (0.7, 0.8, 0.3)}
    kernel = fit_artist(
        skin1, mm_per_pixel=coarse_mm, support_mm=target.half_pixels * 0.3, **hand
    ).kernel
    means = []
    for name, own in (
        ("disk", {"radius_mm": 0.25 * PIXELS * coarse_mm}),
        ("edge", {}),
        ("head", {}),
    ):
        scene = make_scene(name, height=PIXELS, width=PIXELS, mm_per_pixel=coarse_mm, **own)
        counted = scene.mask
        if name == "disk":  # a quarter, whose middle row and column count as the others
            counted = np.zeros((PIXELS, PIXELS), np.int32)
            counted[: PIXELS // 2 + 1, : PIXELS // 2 + 1] = 1
        truth = render_reference(scene, skin1)
        exposure = measure(truth, truth, mask=scene.mask).exposure
        score = measure(render_separable(scene, kernel), truth, exposure=exposure, mask=counted)
        means.append(score.delta_e_2000_mean)
    assert picture_error(target)(numbers(kernel)) == pytest.approx(np.mean(means), rel=1e-6)


def shown(profile, kernel):
    """Mean Delta E of a kernel on 200 x 200 pixels of .3 mm: disk, edge, head."""
    found = []
    for name, own in (("disk", {"radius_mm": 15.0}), ("edge", {}), ("head", {})):
        scene = make_scene(name, height=200, width=200, mm_per_pixel=0.3, **own)
        found.append(evaluate(scene, kernel, profile).score.delta_e_2000_mean)
    return np.array(found)


def table_of_the_docs(name):
    """The figures of docs/fits.md (3, 3): line, kernel and picture; disk, edge and head."""
    page = (Path(__file__).parents[1] / "docs" / "fits.md").read_text(encoding="utf-8")
    section = page.partition("`--target picture` |")[2]
    (row,) = [line for line in section.splitlines() if line.startswith(f"| {name} |")][:1]
    return np.array([cell.split() for cell in row.split("|")[2:5]], dtype=float)


def test_skin1_is_as_near_as_in_the_trial(skin1, fitted):
    line, kernel = (
        shown(skin1, fit_artist(skin1, mm_per_pixel=0.3, target=target).kernel)
        for target in ("line", "kernel")
    )
    found = shown(skin1, fitted.kernel)
    np.testing.assert_allclose(found, list(TRIAL.values()), atol=0.015)
    assert (found < 0.7 * np.minimum(line, kernel)).all()
    np.testing.assert_allclose(table_of_the_docs("skin1"), [line, kernel, found], atol=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["marble", "ketchup", "wholemilk", "chicken1"])
def test_other_materials_are_as_near_as_the_docs_say(name):
    profile = simulate_exact(load_material(name))
    found = [
        shown(profile, fit_artist(profile, mm_per_pixel=0.3, target=target).kernel)
        for target in ("line", "kernel", picture_error)
    ]
    np.testing.assert_allclose(table_of_the_docs(name), found, atol=0.02)
    assert (found[2] < 0.8 * np.minimum(*found[:2])).all()


def test_it_ends_where_no_step_helps(skin1, fitted):
    assert fitted.stop_reasons == ("converged: the simplex has shrunk to a point",) * 3
    assert fitted.evaluations[0] < 1027
    error, x = picture_error(make_target(skin1, 0.3)), numbers(fitted.kernel)
    least, rng = error(x), np.random.default_rng(5)
    for size in (0.05, 0.3):
        for _ in range(40):
            step = rng.normal(size=(3, 3)) * size
            other = x + step * [[0.2], [1.0], [1.0]]  # of w in [0, 1] smaller ones
            other[0] = np.clip(other[0], 0.0, 1.0)
            assert error(other) > least - 2e-3


def test_numbers_do_not_depend_on_pixels_finer_than_the_pictures(skin1, fitted, monkeypatch):
    fine = fit_artist(skin1, mm_per_pixel=0.1, target=picture_error).kernel
    apart = picture_error(make_target(skin1, 0.3))
    assert apart(numbers(fine)) == pytest.approx(apart(numbers(fitted.kernel)), abs=2e-3)


def test_the_same_bits_twice(skin1, no_patience):
    first, second = (fit_artist(skin1, mm_per_pixel=0.3, target=picture_error) for _ in range(2))
    assert first.kernel.weights.tobytes() == second.kernel.weights.tobytes()


@pytest.mark.parametrize("totals", [(0.5,), (0.5, 0.3, 0.0)])
def test_gaussians_come_back(totals):
    variances = (0.5, 0.2, 0.1)[: len(totals)]
    profile = gaussian_profile(variances, np.array(totals))
    kernel = fit_artist(profile, mm_per_pixel=0.1, target=picture_error).kernel
    target = make_target(profile, 0.1)
    for c, v in enumerate(variances):
        if totals[c] == 0.0:
            assert f"c{c}" not in kernel.parameters
            continue
        found = kernel.parameters[f"c{c}"]
        share = found["weight"]
        mean = share * found["near_mm2"] + (1.0 - share) * found["far_mm2"]
        assert mean == pytest.approx(v, rel=0.03)
    x = np.zeros((3, len(totals)))
    for c, each in enumerate(kernel.parameters.values()):
        x[:, c] = each["weight"], np.log(each["near_mm2"]), np.log(each["far_mm2"])
    assert picture_error(target)(x) < 0.05


def test_two_channels_have_no_colour():
    profile = gaussian_profile((0.5, 0.2), np.array([0.5, 0.3]))
    with pytest.raises(RenderError, match="the profile has 2 channels; expected 1"):
        fit_artist(profile, mm_per_pixel=0.1, target=picture_error)


@pytest.mark.filterwarnings("ignore:a pixel of:sssfit.errors.SssfitWarning")
@pytest.mark.parametrize("pixels", [{"mm_per_pixel": 0.3, "support_mm": 1.8}, {"mm_per_pixel": 60}])
def test_narrow_supports_and_wide_pixels(skin1, pixels, no_patience):
    kernel = fit_artist(skin1, target=picture_error, **pixels).kernel
    np.testing.assert_allclose(kernel.energy, skin1.diffuse_reflectance, rtol=1e-12)


def test_the_head_is_left_out_where_no_pixel_shows_it():
    edges = np.linspace(0.0, 6e5, 601)
    within = 0.5 * gaussian_cdf(edges, 1e10)
    profile = make_profile(edges, np.diff(within)[:, None])
    error = picture_error(make_target(profile, 2e4))
    assert np.isfinite(error(np.array([[0.5], [np.log(1e10)], [np.log(1e10)]])))


def test_the_verb_fits_to_pictures(skin1, tmp_path, monkeypatch, capsys, no_patience):
    monkeypatch.chdir(tmp_path)
    skin1.save("skin1.exact.profile.npz")
    arguments = ["fit", "--method", "artist", "--target", "picture", "--mm-per-pixel", "0.3"]
    with pytest.raises(SystemExit) as ended:
        main([*arguments, "--json", "-q"])
    assert ended.value.code == 0
    figures = json.loads(capsys.readouterr().out)
    kernel = SeparableKernel.load("skin1.exact.artist.kernel.json")
    assert kernel.meta["settings"] == {"target": "picture", "by_hand": False, "normalize": False}
    expected = fit_artist(skin1, mm_per_pixel=0.3, target=picture_error)
    np.testing.assert_array_equal(kernel.weights, expected.kernel.weights)
    assert figures["evaluations"] == list(expected.evaluations)


def test_the_verb_refuses_profiles_without_colour_in_one_line(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    gaussian_profile((0.5, 0.2), np.array([0.5, 0.3])).save("a.profile.npz")
    with pytest.raises(SystemExit) as ended:
        main(["fit", "--method", "artist", "--target", "picture"])
    assert ended.value.code == 1
    err = capsys.readouterr().err
    assert err.splitlines()[-1].startswith("Error: the profile has 2 channels; expected 1 (grey)")
    assert not list(tmp_path.glob("*.kernel.json"))
