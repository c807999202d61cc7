"""Gamma beside the residual of the guided fit: the figures, the chart, the verb."""

import io
import json
import warnings

import numpy as np
import pytest
from figures import assert_legible, words_of
from reference_pixels import make_profile, one_over_r_profile

from sssfit.chart.guide import guide_figure
from sssfit.chart.page import save_figure
from sssfit.cli import main
from sssfit.compare import compute_guide
from sssfit.errors import FitError, SssfitWarning
from sssfit.fit import fit_guided, fit_preintegrated, make_target, support_of
from sssfit.fit.guided import gamma, rank_one
from sssfit.material import load_material
from sssfit.profile import full_kernel
from sssfit.simulate import simulate_exact


@pytest.fixture(scope="module")
def skin1():
    return simulate_exact(load_material("skin1"))


@pytest.fixture(scope="module")
def guide(skin1):
    return compute_guide(skin1, mm_per_pixel=0.3, channel="G")


@pytest.fixture(scope="module")
def coarse(skin1):
    """One of fewer pixels."""
    return compute_guide(skin1, mm_per_pixel=1.0, channel="G")


@pytest.fixture(scope="module")
def figure(guide):
    return guide_figure(guide)


def test_the_record_is_what_the_fits_left(skin1, guide):
    energy = skin1.diffuse_reflectance[1]
    for i, k in enumerate((0.0, 1.55, 4.0)):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SssfitWarning)
            fit = fit_guided(skin1, mm_per_pixel=0.3, k=k)
        kernel = fit.kernel
        wanted = full_kernel(skin1.quadrant_kernel(0.3, kernel.half_pixels, channel=1))
        left = wanted - kernel.full(1)
        found = full_kernel(guide.residual[i])
        np.testing.assert_allclose(found, left / energy, atol=1e-15)
        assert guide.misplaced[i] == pytest.approx(0.5 * np.abs(left).sum() / energy)
        assert guide.relative_frobenius_error[i] == pytest.approx(
            np.linalg.norm(left) / np.linalg.norm(wanted)
        )
        weights = full_kernel(guide.gamma[i])
        assert guide.weighted_residual[i] == pytest.approx(
            np.sum(weights * left**2) / np.sum(weights * wanted**2)
        )
        whole = kernel.weights[0, :, 1]
        assert guide.centre_share[i] == pytest.approx(whole[kernel.half_pixels] / whole.sum())
    assert guide.ks == (0.0, 1.55, 4.0)
    line = guide.preintegrated
    left = wanted - energy * full_kernel(line[:, None] * line)
    np.testing.assert_allclose(full_kernel(guide.preintegrated_residual), left / energy, atol=1e-15)
    assert guide.preintegrated_misplaced == pytest.approx(0.5 * np.abs(left).sum() / energy)
    weights = full_kernel(guide.preintegrated_gamma)
    assert guide.preintegrated_errors == pytest.approx(
        (
            np.linalg.norm(left) / np.linalg.norm(wanted),
            np.sum(weights * left**2) / np.sum(weights * wanted**2),
        )
    )
    np.testing.assert_allclose(guide.gamma.max(axis=(1, 2)), 1.0)


def test_the_pass_beside_it_is_the_preintegrated_one(skin1, guide):
    line = fit_preintegrated(skin1, mm_per_pixel=0.3).kernel.weights[0, :, 1]
    half = len(line) // 2
    np.testing.assert_allclose(guide.preintegrated, line[half:] / line.sum(), rtol=1e-12)


@pytest.mark.parametrize(("channel", "outside"), [("R", 3e-4), ("G", 3e-5), ("B", 3e-5)])
def test_the_preintegrated_pass_is_the_best_under_gamma_p(skin1, channel, outside):
    # Eq. S.8, from a flat start; red's support leaves .1 % of the light out, and with it of rows.
    found = compute_guide(skin1, mm_per_pixel=0.5, ks=(0,), channel=channel)
    target = make_target(skin1, 0.5)
    c = "RGB".index(channel)
    start = np.full(found.preintegrated.size, 1.0 / found.pixels)
    best = rank_one(target.quadrant(c) / target.total[c], found.preintegrated_gamma, start)
    apart = 0.5 * target.copies @ np.abs(best.x - found.preintegrated)
    assert apart < outside
    # No other rank one is nearer under it, of whatever sum: the first singular vector is a_p.
    root = np.sqrt(target.quadrant(c) @ target.copies)
    weighted = full_kernel(target.quadrant(c) / (root[:, None] * root))
    values, vectors = np.linalg.eigh(weighted)
    whole = np.concatenate((root[:0:-1], root))
    np.testing.assert_allclose(np.abs(vectors[:, -1]), whole / np.linalg.norm(whole), atol=1e-9)
    assert values[-1] == pytest.approx(1.0, rel=1e-9)


def test_gamma_p_of_rows_without_light_is_not_drawn():
    energy = np.concatenate((np.full((20, 1), 0.01), np.zeros((20, 1))))
    found = compute_guide(
        make_profile(np.arange(41) * 0.1, energy), ks=(1,), mm_per_pixel=0.3, support_mm=4.0
    )
    dark = found.preintegrated == 0.0
    assert 0 < dark.sum() < dark.size
    assert np.isnan(found.preintegrated_gamma[dark]).all()
    assert np.isfinite(found.preintegrated_gamma[~dark][:, ~dark]).all()
    assert np.isfinite(found.preintegrated_errors).all()
    assert_legible(lambda: guide_figure(found))


@pytest.mark.parametrize("channel", ["R", "G", "B"])
def test_k_0_leaves_its_residual_farther_out_than_k_4(skin1, channel):
    found = compute_guide(skin1, mm_per_pixel=0.3, ks=(0, 4), channel=channel)
    x = 0.3 * np.arange(found.preintegrated.size)
    distance = np.hypot(x[:, None], x)
    off_axes = (x > 0.0)[:, None] & (x > 0.0)
    order = np.argsort(distance[off_axes])
    reach = []
    for residual in found.residual:
        within = np.cumsum(np.abs(residual[off_axes][order]))
        reach.append(distance[off_axes][order][np.searchsorted(within, 0.9 * within[-1])])
    assert reach[0] > reach[1]
    assert found.preintegrated_misplaced < found.misplaced.min()


def test_the_spike_of_a_guide_sampled_on_the_axis_is_the_known_one(skin1):
    # docs/fits.md: 257 pixels, red; a Gamma that is 0 on the axes, and not its mean over pixels.
    target = make_target(skin1, support_of(skin1) / 128.001)
    line = target.half_line()[:, 0]
    line /= target.copies @ line
    square = np.linspace(0.0, 1.0, 129) ** 2
    rising = -np.expm1(-50.0 * square)
    wanted = target.quadrant(0) / target.total[0]
    known = {1.55: (0.24, 0.20), 4.0: (0.37, 0.30)}
    assert line[0] == pytest.approx(0.11, abs=0.005)
    for k, (sampled, averaged) in known.items():
        points = (square[:, None] + square) ** (0.5 * k) * rising[:, None] * rising
        # Not quite 0: the search takes its scale from each weight's row.
        floor = 1e-14 * points.max()
        for weights, share in ((np.maximum(points, floor), sampled), (gamma(128, k), averaged)):
            assert rank_one(wanted, weights, line).x[0] == pytest.approx(share, abs=0.005)


def images(figure):
    return [axes.images[0] for axes in figure.axes if axes.images]


def test_what_is_drawn_is_what_was_computed(guide, figure):
    drawn = images(figure)
    assert len(drawn) == 8
    reach = 0.5 * guide.pixels * 0.3
    guides = [guide.preintegrated_gamma, *guide.gamma]
    residuals = [guide.preintegrated_residual, *guide.residual]
    for i, (gamma_of, residual) in enumerate(zip(guides, residuals, strict=True)):
        halfway = gamma_of[len(gamma_of) // 2, len(gamma_of) // 2]
        for image, quadrant in zip(
            drawn[2 * i : 2 * i + 2], (gamma_of / halfway, -residual), strict=True
        ):
            np.testing.assert_array_equal(image.get_array(), full_kernel(quadrant))
            assert image.get_extent() == [-reach, reach, -reach, reach]
    residuals = drawn[1::2]
    most = max(np.abs(guide.residual).max(), np.abs(guide.preintegrated_residual).max())
    for image in residuals:
        assert image.get_clim() == (-most, most)
        assert image.norm(0.0) == pytest.approx(0.5)
    alone, *passes = (axes.patches for axes in figure.axes if axes.patches)
    assert len(alone) == 1
    np.testing.assert_allclose(alone[0].get_data().values, guide.preintegrated / 0.3)
    for patches, guided in zip(passes, guide.passes, strict=True):
        line, fitted = (each.get_data().values for each in patches)
        np.testing.assert_allclose(line, guide.preintegrated / 0.3)
        np.testing.assert_allclose(fitted, guided / 0.3)
    texts = words_of(figure)
    for words in (
        "skin1, G: guide function and residual",
        "Exact solution",
        f"{guide.pixels} x {guide.pixels} pixels of 0.3 mm",
        f"{100 * guide.centre_share[2]:.1f} %",
        f"{100 * guide.misplaced[0]:.1f} %",
        f"{100 * guide.preintegrated[0]:.1f} %",
    ):
        assert words in texts


def long_names():
    meta = dict(one_over_r_profile(10, 0.1, [0.4]).meta) | {"channels": ["W" * 60]}
    return make_profile(np.arange(11) * 0.1, np.full((10, 1), 0.05), meta=meta)


ODD = {  # each with as few rows as show it; "four" has the most there are
    "noise": lambda: compute_guide(
        make_profile(
            np.arange(41) * 0.1, np.random.default_rng(2).exponential(size=(40, 1)) / 150.0
        ),
        ks=[0],
        mm_per_pixel="profile",
    ),
    "one k": lambda: compute_guide(
        one_over_r_profile(40, 0.1, [0.4]), ks=[2], mm_per_pixel="profile"
    ),
    "four": lambda: compute_guide(
        one_over_r_profile(40, 0.1, [0.4]), ks=[0, 1, 2, 4], mm_per_pixel="profile"
    ),
    "one pixel": lambda: compute_guide(one_over_r_profile(10, 0.1, [0.4]), ks=[0], mm_per_pixel=9),
    "small": lambda: compute_guide(
        one_over_r_profile(40, 1e-4, [4e-4]), ks=[4], mm_per_pixel="profile"
    ),
    "long names": lambda: compute_guide(long_names(), ks=[1.55], mm_per_pixel="profile"),
}


@pytest.mark.parametrize("name", ODD)
def test_no_text_is_cut_off_or_runs_into_another(name):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SssfitWarning)
        found = ODD[name]()
    assert_legible(lambda: guide_figure(found))


def test_skin1_is_legible_and_gives_the_same_bytes(guide, figure):
    seen, again = assert_legible(lambda: figure), guide_figure(guide)
    streams = [io.BytesIO() for _ in range(2)]
    for each, drawn in zip(streams, (seen, again), strict=True):
        save_figure(drawn, each, format="svg")
    assert streams[0].getvalue() == streams[1].getvalue()


def test_the_spike_is_in_the_record_and_the_target_warned_of_once(skin1):
    with warnings.catch_warnings():
        warnings.simplefilter("error", SssfitWarning)
        found = compute_guide(skin1, mm_per_pixel=0.3, ks=[4], channel="R")
    assert found.centre_share[0] > 0.25
    with pytest.warns(SssfitWarning) as caught:
        compute_guide(one_over_r_profile(10, 0.1, [0.4]), mm_per_pixel=9)
    assert len(caught) == 1


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"ks": []}, "0 values of k; expected one to 4"),
        ({"ks": [1] * 5}, "5 values of k"),
        ({"ks": [5]}, r"k = 5 is outside \[0, 4\]"),
        ({"channel": "X"}, "there is no channel X; expected one of c0, c1"),
        ({"channel": "c0"}, "channel c0 returns no light"),
    ],
)
def test_bad_settings_are_one_line(settings, words):
    names = {"channels": ["c0", "c1"]}
    meta = dict(one_over_r_profile(10, 0.1, [0.4]).meta) | names
    profile = make_profile(np.arange(11) * 0.1, np.outer(np.full(10, 0.05), [0.0, 1.0]), meta=meta)
    assert compute_guide(profile, mm_per_pixel="profile").channel == 1
    with pytest.raises(FitError, match=words):
        compute_guide(profile, mm_per_pixel="profile", **settings)


@pytest.fixture
def run(tmp_path, monkeypatch, capfd, skin1):
    """Run ``sssfit chart`` beside skin1's profile; give exit status, stdout and stderr."""
    monkeypatch.chdir(tmp_path)
    skin1.save(tmp_path / "skin1.profile.npz")

    def call(*arguments):
        with pytest.raises(SystemExit) as caught:
            main(["chart", *arguments])
        out, err = capfd.readouterr()
        return caught.value.code or 0, out, err

    return call


def test_the_verb_draws_the_newest_profile_and_tabulates_it(run, tmp_path, coarse):
    status, out, _ = run("--guide", "--mm-per-pixel", "1000um", "--channel", "G")
    assert status == 0
    assert (tmp_path / "skin1.guide.png").read_bytes().startswith(b"\x89PNG")
    assert "Wrote skin1.guide.png" in out
    (line,) = [each for each in out.splitlines() if each.startswith("1.55 ")]
    figures = (
        coarse.centre_share,
        coarse.misplaced,
        coarse.relative_frobenius_error,
        coarse.weighted_residual,
    )
    assert line.split() == ["1.55", *" ".join(f"{100 * each[1]:.2f} %" for each in figures).split()]
    (line,) = [each for each in out.splitlines() if each.startswith("pre-integrated ")]
    known = (coarse.preintegrated[0], coarse.preintegrated_misplaced, *coarse.preintegrated_errors)
    assert line.split()[1::2] == [f"{100 * each:.2f}" for each in known]


def test_the_verb_gives_json(run, coarse):
    status, out, err = run(
        *("--guide", "skin1.profile.npz", "--mm-per-pixel", "1", "--channel", "G"),
        *("--k", "4,0", "-o", "a.svg", "--json"),
    )
    assert (status, err) == (0, "")
    figures = json.loads(out)
    assert figures["output"] == ["a.svg"]
    assert (figures["pixels"], figures["k"]) == (coarse.pixels, [4, 0])
    np.testing.assert_allclose(figures["centre_share"], coarse.centre_share[[2, 0]])
    np.testing.assert_allclose(figures["misplaced"], coarse.misplaced[[2, 0]])
    names = ("centre_share", "misplaced", "frobenius_error", "weighted_residual")
    known = (coarse.preintegrated[0], coarse.preintegrated_misplaced, *coarse.preintegrated_errors)
    np.testing.assert_allclose([figures[f"preintegrated_{name}"] for name in names], known)


@pytest.mark.parametrize(
    ("arguments", "status", "fragment"),
    [
        (("--guide", "--spectrum"), 2, "--spectrum and --guide are two charts"),
        (("--k", "1"), 2, "--k is for the fits of --guide"),
        (("--spectrum", "--channel", "R"), 2, "--channel is for the fits of --guide"),
        (("--guide", "--k", "near"), 2, "'near' is not a valid number"),
        (("--guide", "--mm-per-pixel", "1", "--k", "4.5"), 1, "k = 4.5 is outside [0, 4]"),
        (("--guide", "--mm-per-pixel", "1", "--channel", "X"), 1, "there is no channel X"),
        (("--guide", "--mm-per-pixel", ".02"), 1, "up to 513 pixels"),
    ],
)
def test_bad_input_is_one_clear_line(run, tmp_path, arguments, status, fragment):
    code, out, err = run(*arguments)
    assert code == status
    assert out == ""
    assert fragment in err.splitlines()[-1]
    assert "Traceback" not in err
    assert not list(tmp_path.glob("*.png"))
