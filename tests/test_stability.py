"""Stresses: edges of safe regions, planted failures, and boundaries that theory knows."""

import dataclasses
import json
import re
import warnings

import numpy as np
import pytest
from test_lut import ENERGY, VARIANCES
from test_profile import make_profile

from sssfit.errors import ArgumentError, FitError, SssfitWarning
from sssfit.fit import guided as fit_module
from sssfit.fit._cascade_again import followed
from sssfit.material import Layer, Material, load_material
from sssfit.methods import STRESSES
from sssfit.shapes import gaussian_cdf
from sssfit.simulate import simulate_exact, simulate_montecarlo
from sssfit.stability import (
    Curve,
    Panel,
    distance,
    gaussians,
    grid,
    guided,
    hard_light,
    imports,
    motion,
    noise,
    optics,
    stability,
    taps,
    workers,
)
from sssfit.stability.curve import Axis
from sssfit.stability.panel import BETWEEN, FROM, NEVER, SAFE, UP_TO
from sssfit.stability.subject import Subject
from sssfit.stability.ways import Way

# `stability` itself hears no warning of a fit; these call the fits beside it.
pytestmark = pytest.mark.filterwarnings("ignore::sssfit.errors.SssfitWarning")


@pytest.fixture(scope="module")
def profile():
    """A Gaussian of the plane for each channel."""
    edges_mm = np.linspace(0.0, 8.0, 801)
    within = ENERGY * gaussian_cdf(edges_mm[:, None], VARIANCES)
    return make_profile(edges_mm, np.diff(within, axis=0), beyond_grid=ENERGY - within[-1])


def panel_of(*curves, mild=1.0, limit=1.0, is_log=True, **axis):
    return Panel("noise", "title", Axis("x", mild, **axis), "y", limit, curves, "breaks", is_log)


def finding_of(y, mild, x=(1.0, 10.0, 100.0, 1000.0), **more):
    panel = panel_of(Curve("a", np.array(x), np.array(y), **more), mild=mild)
    return next(panel.findings())


def test_a_crossing_is_interpolated_between_its_points_and_they_are_its_uncertainty():
    found = finding_of([0.01, 0.1, 10.0, 100.0], mild=1.0)  # log y crosses half-way
    assert found.kind == UP_TO
    assert found.below is None
    assert found.above.at == pytest.approx(10.0**1.5)
    assert (found.above.low, found.above.high) == (10.0, 100.0)
    assert found.words == "up to 31.6 (10 to 100)"


def test_the_quartiles_over_seeds_are_the_uncertainty_where_there_are_seeds():
    y = np.array([100.0, 10.0, 0.1, 0.01])
    found = finding_of(y, mild=1000.0, low=y / 3.0, high=y * 3.0)
    assert found.kind == FROM
    assert found.below.at == pytest.approx(10.0**1.5)
    # log10 y falls by 2 a decade, so a factor of 3 moves the crossing by half its logarithm.
    assert found.below.low == pytest.approx(10.0 ** (1.5 - 0.5 * np.log10(3.0)))
    assert found.below.high == pytest.approx(10.0 ** (1.5 + 0.5 * np.log10(3.0)))


def test_a_curve_that_other_seeds_may_take_over_the_limit_has_an_uncertain_end():
    y = np.array([0.5, 0.2, 0.1, 0.05])
    found = finding_of(y, mild=1000.0, low=y / 4.0, high=y * 4.0)
    assert found.kind == FROM
    assert (found.below.at, found.below.low) == (1.0, 1.0)
    # high is 2 at 1 and 0.8 at 10; its logarithm crosses 0 at this share of the decade.
    assert found.below.high == pytest.approx(10.0 ** (np.log(2.0) / np.log(2.5)))
    assert finding_of(y, mild=1000.0, low=y, high=y * 1.5).kind == SAFE


@pytest.mark.parametrize(
    ("y", "mild", "kind", "words"),
    [
        ([0.1, 0.2, 0.3, 0.4], 1.0, SAFE, "everywhere that was tried"),
        ([2.0, 2.0, 3.0, 0.1], 1.0, NEVER, "nowhere that was tried"),
        ([10.0, 0.1, 0.1, np.inf], 10.0, BETWEEN, "3.16 (1 to 10) to 316 (100 to 1e+03)"),
        ([0.1, 0.1, np.inf, 0.1], 1.0, UP_TO, "up to 31.6 (10 to 100)"),
        ([0.1, 10.0, 0.1, 0.1], 1000.0, FROM, "from 31.6 (10 to 100)"),
    ],
)
def test_safe_is_what_hangs_together_with_the_mild_place(y, mild, kind, words):
    found = finding_of(y, mild)
    assert found.kind == kind
    assert found.words == words


def test_a_linear_axis_is_interpolated_linearly():
    curve = Curve("a", np.array([1.0, 2.0, 3.0]), np.array([0.0, 0.5, 1.5]))
    panel = panel_of(curve, is_log=False)
    panel = dataclasses.replace(panel, axis=Axis("x", 1.0, is_log=False))
    assert panel.edges(curve)[1].at == pytest.approx(2.5)


def test_the_table_has_a_row_for_each_method_and_stress(profile):
    found = stability(profile, only=["hard-light"], mm_per_pixel=0.25, threads=1)
    rows = [line for line in found.table().splitlines() if line.startswith("| hard-light")]
    assert len(rows) == sum(len(panel.curves) for panel in found.panels) == 6
    assert json.loads(json.dumps(found.to_dict()))["panels"][0]["stress"] == "hard-light"
    assert "hard-light: asymmetry" in found.text()


def test_a_gaussian_profile_is_healthy_and_a_cross_is_found(profile):
    """One term is exact for Gaussians; a kernel with a cross on its axes is not round."""
    found = stability(profile, only=["hard-light"], mm_per_pixel=0.25, threads=1)
    assert {each.kind for panel in found.panels for each in panel.findings()} == {SAFE}
    kernel = Way("svd", "svd", {"rank": 1}).fit(profile, 0.25)
    weights = kernel.weights.copy()
    weights[:, weights.shape[1] // 2] *= 4.0
    crossed = dataclasses.replace(kernel, weights=weights)
    subject = Subject("crossed", profile, 0.25)
    assert hard_light.unround(subject, crossed) > hard_light.ASYMMETRY_LIMIT
    scene = hard_light.highlight(0.25)
    below = dataclasses.replace(kernel, signs=-kernel.signs)
    assert hard_light._negative(hard_light.shown(below, scene)) == 1.0


def test_a_condition_number_is_that_of_the_integrals():
    variances = np.array([0.1, 1.0, 1.5])
    r = np.linspace(0.0, 30.0, 300_001)[:, None]
    values = np.exp(-0.5 * r**2 / variances)
    matrix = np.trapezoid(values[:, :, None] * values[:, None] * r[:, None], r[:, 0], axis=0)
    norms = np.sqrt(np.diag(matrix))
    wanted = np.linalg.cond(matrix / norms[:, None] / norms)
    assert optics.condition_number(variances) == pytest.approx(wanted, rel=1e-6)


def test_energy_beyond_the_grid_is_that_of_the_exact_solver():
    """It falls as the albedo does, by the exponential of the radius over the diffusion length."""
    curve = optics._beyond(Subject("s", None, 0.3), 1.4)
    lost = np.array([0.001, 0.003])
    shares = np.interp(np.log(lost), np.log(curve.x), np.log(curve.y))
    # K_1 decays as exp(-r sigma_tr), sigma_tr = sqrt(3 (1 - albedo)) near 1, at 32 mean free paths.
    sigma_tr = np.sqrt(3.0 * lost)
    assert shares[0] - shares[1] == pytest.approx(32.0 * np.diff(sigma_tr)[0], rel=0.25)
    assert (np.diff(curve.y) <= 0.0).all()


def test_models_are_worse_where_light_is_lost():
    curve = optics._model(Subject("s", None, 0.3), "dipole")
    assert (np.diff(curve.y) > 0.0).all()
    assert curve.y[0] < optics.MODEL_LIMIT < curve.y[-1]


def test_a_single_gaussian_needs_one_and_every_start_finds_it():
    """The second of two equal Gaussians is left out, so nothing coalesces."""
    edges_mm = np.linspace(0.0, 8.0, 801)
    within = 0.5 * gaussian_cdf(edges_mm[:, None], np.array([1.0]))
    subject = Subject("one", make_profile(edges_mm, np.diff(within, axis=0)), 0.25)
    assert gaussians.sums(subject, False)[0].error < 1e-6
    assert gaussians._missed(subject, (False, 1)) == 0.0
    assert gaussians.nearest(gaussians.sums(subject, False)[0]) == 0.0


@pytest.fixture(scope="module")
def walked():
    """Noise of the quick methods, of few photons and seeds."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(noise, "_LAST", 5)
        patch.setattr(noise, "_SEEDS", 8)
        ways = [Way("svd 3", "svd", {"rank": 3}), Way("pre", "preintegrated", {})]
        patch.setattr(noise, "WAYS", ways)
        patch.setattr(noise, "KERNELS", ways)
        patch.setattr(noise, "_SMOOTHED", ("svd 3",))
        return stability(load_material("skin1"), only=["noise"], threads=1).panels


def test_noise_falls_as_the_root_of_the_photons(walked):
    error, spread, _ = walked
    for curve in (*error.curves, *spread.curves):
        if "smoothed" in curve.label:  # the fewer photons, the more of their noise is taken
            continue
        slope = np.polyfit(np.log(curve.x), np.log(curve.y), 1)[0]
        # Medians of 8 seeds are known to 1.25 / sqrt(8) * 0.6 of themselves: a slope over two
        # decades to 0.08.
        assert slope == pytest.approx(-0.5, abs=0.16), curve.label


def test_smoothing_moves_the_boundary_of_noise(walked):
    """By twice as many photons at the least, and by more than the boundaries' ranges allow."""
    edges = {each.label: walked[0].edges(each)[0] for each in walked[0].curves}
    plain, smooth = edges["svd 3"], edges["svd 3, smoothed"]
    assert smooth.at < 0.5 * plain.at
    assert smooth.at < plain.low


def test_a_fit_that_chases_noise_is_found(walked, monkeypatch):
    """The same fit with noise added to its weights on purpose has a boundary at more photons."""
    real = Way.fit
    rng = np.random.default_rng(5)

    def broken(way, profile, pitch, **given):
        kernel = real(way, profile, pitch, **given)
        if profile.photons is None:
            return kernel
        shake = 1.0 + 30.0 / np.sqrt(profile.photons) * rng.standard_normal(3)
        return dataclasses.replace(kernel, weights=kernel.weights * shake)

    monkeypatch.setattr(Way, "fit", broken)
    monkeypatch.setattr(noise, "_LAST", 5)
    monkeypatch.setattr(noise, "_SEEDS", 8)
    ways = [Way("svd 3", "svd", {"rank": 3})]
    monkeypatch.setattr(noise, "WAYS", ways)
    monkeypatch.setattr(noise, "KERNELS", ways)
    monkeypatch.setattr(noise, "_SMOOTHED", ())
    found = next(stability(load_material("skin1"), only=["noise"], threads=1).panels[0].findings())
    healthy = next(walked[0].findings())
    assert healthy.kind == FROM
    assert found.kind == NEVER or found.below.at > 2.0 * healthy.below.high


def test_a_walks_noise_made_smaller_is_that_of_more_photons():
    """Of 16 walks made four times as many photons, beside 16 that were walked: within 4 sigma."""
    exact = simulate_exact(load_material("skin1"))
    subject = Subject("skin1", exact, 0.3)
    walks = [noise._walk(subject, 10_000, each) for each in range(16)]
    made = [noise.with_noise_of(exact, each, 40_000) for each in walks]
    walked = [noise._walk(subject, 40_000, 100 + each) for each in range(16)]
    rings = np.add.reduceat, np.array([0, 3, 10, 30, 100, 300])
    found, wanted, true = (
        np.array([rings[0](each.annulus_energy, rings[1], axis=0) for each in some])
        for some in (made, walked, [exact])
    )
    ratio = found.std(axis=0, ddof=1) / wanted.std(axis=0, ddof=1)
    assert np.abs(np.log(ratio)).max() < 4.0 * np.sqrt(1.0 / 15.0)  # of two spreads of 16
    error = wanted.std(axis=0, ddof=1) / np.sqrt(16.0)
    assert (np.abs(found.mean(axis=0) - true[0]) < 5.0 * error).all()
    assert made[0].photons == 40_000
    np.testing.assert_allclose(made[0].annulus_energy_stderr, 0.5 * walks[0].annulus_energy_stderr)


def test_gathered_annuli_are_those_that_the_solver_has():
    material = load_material("skin1")
    exact = simulate_exact(material)
    found = grid.gathered(exact, 4, 400)
    wanted = simulate_exact(
        material, dr_mm=4.0 * exact.r_edges_mm[1], radius_mm=float(exact.r_edges_mm[400])
    )
    np.testing.assert_allclose(found.r_edges_mm, wanted.r_edges_mm, rtol=1e-12)
    np.testing.assert_allclose(found.annulus_energy, wanted.annulus_energy, rtol=1e-5)
    np.testing.assert_allclose(found.diffuse_reflectance, wanted.diffuse_reflectance, rtol=1e-6)


def test_a_followed_cascade_stays_where_it_is_and_goes_where_the_profile_goes(profile):
    """On its own profile it is the same; on one of twice the light it has twice the energy."""
    way = Way("cascade 7", "cascade", {"fetches": 7})
    taps_of_it = way.fit(profile, 0.25, seed=1)
    subject = Subject("gaussian", profile, 0.25)
    same = followed(taps_of_it, profile)
    assert subject.error(same, subject.shows(taps_of_it)) < 0.02
    dimmer = dataclasses.replace(
        profile,
        annulus_energy=0.5 * profile.annulus_energy,
        beyond_grid=0.5 * profile.beyond_grid,
    )
    np.testing.assert_allclose(followed(taps_of_it, dimmer).energy, 0.5 * same.energy, rtol=1e-6)


def test_a_fit_that_takes_unequal_radii_for_equal_ones_is_found(profile, monkeypatch):
    """Equal radii hide it; the healthy fit keeps within the limit as far as twice the radius."""
    subject = Subject("gaussian", profile, 0.25)
    ways = [Way("pre", "preintegrated", {})]
    steps = [imports._unequal(subject, each) for each in imports._RATIOS]
    (healthy,) = subject.changes(ways, [steps], imports.LIMIT)[0]
    real = Way.fit

    def equal(way, given, pitch, **more):
        edges_mm = np.linspace(0.0, given.r_edges_mm[-1], given.n_annuli + 1)
        return real(way, dataclasses.replace(given, r_edges_mm=edges_mm), pitch, **more)

    monkeypatch.setattr(Way, "fit", equal)
    (broken,) = subject.changes(ways, [steps], imports.LIMIT)[0]
    assert healthy[0] == pytest.approx(broken[0], abs=1e-9)
    assert (np.array(healthy[: imports._RATIOS.index(1.6) + 1]) < imports.LIMIT).all()
    assert broken[1] > imports.LIMIT
    assert len(broken) == 2


def test_what_leaves_below_and_at_which_angle_is_no_subject_of_stresses(profile, monkeypatch):
    """Rings are put together and radii cut, of reflected light alone."""
    slab = Material("slab", ("R", "G", "B"), (Layer(1.3, 0.0, [0.1] * 3, [1.0] * 3, 2.0),))
    walked = simulate_montecarlo(slab, photons=2_000, angles=4)
    seen = []

    def looked_at(subject):
        seen.append(grid.gathered(subject.profile, 2, 100).n_annuli)
        seen.append(imports._unequal(subject, 2.0).n_annuli)
        return []

    monkeypatch.setattr(imports, "stress", looked_at)
    assert stability(walked, only=["imports"], threads=1).panels == ()
    assert seen[0] == 50
    assert seen[1] < 20


def test_a_guided_search_that_stays_near_its_start_is_found(profile, monkeypatch):
    """The same search, ended a tenth of the way from each level's start to its optimum."""
    subject = Subject("gaussian", profile, 0.25)
    own = subject.shows(guided._fit(subject, guided.DRAWN_K, guided.DRAWN_B).kernel)
    assert guided._from_start(own, subject, (1.0, 0)) < 0.1 * guided.LIMIT
    real = fit_module.rank_one

    def lazy(wanted, weights, start, **more):
        found = real(wanted, weights, start, **more)
        return dataclasses.replace(found, x=0.9 * start + 0.1 * found.x)

    monkeypatch.setattr(fit_module, "rank_one", lazy)
    own = subject.shows(guided._fit(subject, guided.DRAWN_K, guided.DRAWN_B).kernel)
    assert guided._from_start(own, subject, (1.0, 0)) > guided.LIMIT


@pytest.mark.parametrize(
    ("stress", "words"), [("noise", "its material"), ("pixel-size", "its mean free path")]
)
def test_what_a_profile_lacks_is_said_before_any_work(profile, monkeypatch, stress, words):
    def begun(*_):
        pytest.fail("a kernel was fitted, or a worker started")

    monkeypatch.setattr(Subject, "prepare", begun)
    monkeypatch.setattr(workers, "Workers", begun)
    with pytest.raises(FitError, match=f"{stress}: the profile does not say {words}"):
        stability(profile, only=["hard-light", stress], threads=2)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"only": ["nois"]}, "stress 'nois': did you mean noise? expected some of noise, "),
        ({"only": ["hard-light"], "mm_per_pixel": 0.0}, "`mm_per_pixel = 0.0`; expected"),
        ({"only": ["hard-light"], "mm_per_pixel": float("nan")}, "`mm_per_pixel = nan`"),
    ],
)
def test_bad_settings_get_one_line(profile, given, words):
    with pytest.raises(ArgumentError) as caught:
        stability(profile, **given)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_every_stress_is_a_file_of_its_own():
    for name, method in STRESSES.items():
        assert method.function == f"sssfit.stability.{name.replace('-', '_')}:stress"
        assert callable(method.load())
        assert re.fullmatch(r"[^.].*[^.]", method.summary)


def test_what_fits_warn_of_is_not_heard_and_filters_are_put_back(profile, monkeypatch):
    real = Way.fit

    def warning(way, *given, **more):
        warnings.warn("a doubt", SssfitWarning, stacklevel=1)
        return real(way, *given, **more)

    monkeypatch.setattr(Way, "fit", warning)
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        inside = list(warnings.filters)
        stability(profile, only=["hard-light"], mm_per_pixel=0.25, threads=1)
        assert list(warnings.filters) == inside
    assert heard == []


def test_a_table_on_other_pixels(profile):
    """On the table's own pixels it is the subject's error; far away it is another picture."""
    subject = Subject("gaussian", profile, 0.25)
    kernel = Way("pre", "preintegrated", {}, taps=9).fit(profile, 0.25)
    (own,) = distance._at_distances(subject, {"pair": kernel})
    middle = int(np.flatnonzero(own.x == 1.0)[0])
    assert own.y[middle] < min(own.y[0], own.y[-1])
    assert own.y[middle] == pytest.approx(subject.error(kernel, subject.truths()))


def test_a_plane_that_faces_the_eye_and_equal_pixels_are_the_flat_picture(profile):
    subject = Subject("gaussian", profile, 0.25)
    kernel = Way("pre", "preintegrated", {}, taps=9).fit(profile, 0.25)
    flat = subject.error(kernel, subject.truths())
    assert distance._tilted(subject, {"pair": kernel})[0].y[0] == pytest.approx(flat, rel=1e-6)
    (own,) = distance._growing(subject, {"pair": kernel})
    assert own.y[0] == pytest.approx(flat, rel=1e-6)


def test_flicker_is_the_change_of_the_error_and_not_of_the_light():
    """An error that stays is no flicker, one that jumps by a frame is found."""
    rng = np.random.default_rng(2)
    truths = [rng.uniform(0.2, 1.0, (8, 8, 3)) for _ in range(4)]
    steady = [each + 0.1 for each in truths]
    assert motion._flicker(steady, truths) < 1e-6
    planted = [*steady[:3], steady[3] + 0.05]
    assert motion._flicker(planted, truths) > 0.5


def test_spots_stay_in_place_on_smaller_pixels():
    near, far = motion._spots(0.3, 0.5), motion._spots(0.3, 1.0)
    assert near.mm_per_pixel == 0.15
    rows = slice(24, 72)
    quarter = near.irradiance.reshape(48, 2, 48, 2, 1).mean(axis=(1, 3))
    np.testing.assert_allclose(quarter, far.irradiance[rows, rows], atol=0.12)


def test_light_of_8_bits_loses_more_the_dimmer_it_is(profile):
    subject = Subject("gaussian", profile, 0.25)
    kernel = Way("pre", "preintegrated", {}, taps=9).fit(profile, 0.25)
    found = taps._eight_bits(subject, ("pair", kernel, "rgba8"))
    assert found.y[-1] > 4.0 * found.y[0]
    still = taps._jittered(subject, ("pair", kernel, 1))
    assert still.y[0] == 1e-3 < still.y[-1]
