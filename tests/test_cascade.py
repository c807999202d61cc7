"""Cascades: the spectrum they are fitted by, what the fit promises, and what a picture shows."""

import functools
import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
import shared_work
from reference_pixels import one_over_r_profile

from sssfit import fit
from sssfit.compare.motion import motion
from sssfit.errors import FitError
from sssfit.fit import cascade, fit_taps, make_target, structures
from sssfit.fit._chain_pairs import PairChain, _sum
from sssfit.fit._chain_stars import StarChain
from sssfit.fit._spectrum import graded_frequencies, search_targets, spectral_target
from sssfit.grid import paper_grid
from sssfit.kernel import Taps
from sssfit.kernel.structure import cost_of_chain, parse, text_of
from sssfit.material import load_material
from sssfit.measure.score import measure
from sssfit.profile import full_kernel
from sssfit.render.reference import render_reference
from sssfit.render.taps import render_taps
from sssfit.scene.made import make_scene
from sssfit.scene.record import Scene
from sssfit.simulate import simulate_exact
from sssfit.simulate.truth import exact_with_all_light


@pytest.fixture(scope="module")
def skin1():
    return simulate_exact(load_material("skin1"))


def chain_of(profile, structure, aliasing=0.0, spectrum="natural", support_mm=9.0):
    target = make_target(profile, 0.3, support_mm)
    lit = list(range(profile.n_channels))
    kind = StarChain if "*" in structure or "x" in structure else PairChain
    return kind(spectral_target(target, lit, spectrum), parse(structure), aliasing)


def taps_of(chain, x, pitch=0.3):
    """The table of taps of some parameters."""
    numbers = chain.numbers(x)
    stages = tuple(
        cascade.Stage(
            shape.level,
            shape.kind,
            offsets * pitch * 2.0**shape.level,
            weights,
            shape.angle_degrees,
        )
        for shape, offsets, weights in zip(
            chain.shapes, numbers.offsets, numbers.weights, strict=True
        )
    )
    names = tuple(f"c{k}" for k in range(chain.channels))
    none = np.full(chain.channels, np.nan)
    errors = {"spectral": none, "energy": none}
    return Taps("test", pitch, names, True, stages, numbers.blend, errors, {})


# The spectrum


@pytest.mark.parametrize(
    "structure", ["1-2", "1|1", "2|1-1", "1|1|1", "*", "1|*-1", "*|*", "2x", "1x|2x-1"]
)
def test_the_spectrum_is_that_of_points_at_all_places(skin1, structure):
    """Halving sees a point by its place among the texels; the fit is to the mean over places."""
    chain = chain_of(skin1, structure)
    x = chain.start(np.random.default_rng(2))
    taps = taps_of(chain, x)
    size, period = 64, 2 ** chain.shapes[-1].level
    w = chain.target.frequencies
    mean = np.zeros((3, w.size, w.size))
    for dy, dx in itertools.product(range(period), repeat=2):
        point = np.zeros((size, size, 1))
        point[size // 2 + dy, size // 2 + dx] = 1.0
        seen = render_taps(Scene("a point", point, 0.3), taps)
        rows, columns = (np.arange(size) - size // 2 - each for each in (dy, dx))
        along_y, along_x = (np.cos(np.outer(w, each)) for each in (rows, columns))
        mean += np.einsum("wy,yxc,vx->cwv", along_y, seen, along_x, optimize=True) / period**2
    np.testing.assert_allclose(chain.spectrum(x), mean, rtol=0, atol=1e-12)


@pytest.mark.parametrize("structure", ["1|1-2", "*|1"])
def test_stages_that_a_fit_shrinks_to_nothing_are_still_a_table(skin1, structure):
    """Offsets far below a texel, or the same in double precision; a choice's fits ended there."""
    chain = chain_of(skin1, structure)
    x = chain.start(np.random.default_rng(2))
    x[chain.step_parameters] = -40.0
    written = x.copy()
    written[chain.step_parameters] = np.log(taps_of(chain, x).stages[0].offsets_mm[0] / 0.3)
    np.testing.assert_allclose(chain.spectrum(written), chain.spectrum(x), rtol=0, atol=1e-8)


def test_the_wanted_spectrum_is_the_kernels(skin1):
    target = make_target(skin1, 0.3, 9.0)
    found = spectral_target(target, [0, 1, 2], "white")
    half = target.half_pixels
    place = np.arange(-half, half + 1)
    for c in range(3):
        kernel = full_kernel(target.quadrant(c))
        kernel *= skin1.diffuse_reflectance[c] / kernel.sum()
        waves = np.exp(-1j * np.outer(found.frequencies, place))
        np.testing.assert_allclose(found.wanted[c], waves @ kernel @ waves.T, atol=1e-13)


@pytest.mark.parametrize("pictures", ["natural", "white"])
def test_the_last_digits_of_a_profile_change_no_search(skin1, pictures):
    """Profiles apart by 3e-15, as two versions of a solver may be, ask for the same bits."""
    noise = 1.0 + 3e-15 * np.random.default_rng(4).standard_normal(skin1.annulus_energy.shape)
    other = replace(skin1, annulus_energy=skin1.annulus_energy * noise)
    found, again = (
        search_targets(make_target(each, 0.3, 9.0), [0, 1, 2], pictures) for each in (skin1, other)
    )
    assert [len(each.frequencies) for each in found] == [38, 65]
    for own, theirs in zip(found, again, strict=True):
        np.testing.assert_array_equal(own.wanted, theirs.wanted)
        np.testing.assert_array_equal(own.power, theirs.power)
        assert (own.energy == 1.0).all()
    exact = spectral_target(make_target(skin1, 0.3, 9.0), [0, 1, 2], pictures)
    apart = found[1].wanted - exact.wanted / exact.energy[:, None, None]
    assert 1e-9 < np.abs(apart).max() < 6e-8


def test_weights_of_the_spectra(skin1):
    target = make_target(skin1, 0.3, 9.0)
    natural, white = (spectral_target(target, [0], each) for each in ("natural", "white"))
    w, cell = graded_frequencies(target.half_pixels)
    for each in (natural, white):
        assert float((each.power * each.wanted**2).sum()) == pytest.approx(1.0)
    share = natural.power[0, 5, 9] / natural.power[0, 5, 2]
    sine = 4 * np.sin(w / 2) ** 2
    assert share == pytest.approx((sine[5] + sine[2]) / (sine[5] + sine[9]) * cell[9] / cell[2])
    assert natural.power[0, 0, 0] == 0.0
    assert white.power[0, 5, 9] / white.power[0, 5, 2] == pytest.approx(cell[9] / cell[2])
    assert w[0] == 0.0
    assert cell.sum() == pytest.approx(np.pi, rel=0.02)


@pytest.mark.parametrize(
    "structure", ["1", "1-2", "1|1-2", "1|2|1", "*", "*|1-*", "2|*-*", "2x", "1|1x-*"]
)
def test_derivatives_are_those_of_differences(skin1, structure):
    chain = chain_of(skin1, structure)
    x = chain.start(np.random.default_rng(3))
    value, gradient = chain.value_and_gradient(x)
    error = chain.target.error(chain.spectrum(x))
    assert value == pytest.approx(float((error**2).sum()), rel=1e-12)
    for k in range(chain.size):
        step = np.zeros(chain.size)
        step[k] = 1e-5
        after, before = (chain.value_and_gradient(x + s * step)[0] for s in (1, -1))
        assert gradient[k] == pytest.approx((after - before) / 2e-5, abs=1e-8, rel=1e-6)


@pytest.mark.parametrize("structure", ["1|1-2|1", "*|1-*|*"])
def test_derivatives_of_aliasing_are_those_of_differences(skin1, structure):
    chain, plain = chain_of(skin1, structure, 0.7), chain_of(skin1, structure)
    x = chain.start(np.random.default_rng(3))
    value, gradient = chain.value_and_gradient(x)
    assert value > plain.value_and_gradient(x)[0] + 1e-5
    for k in range(chain.size):
        step = np.zeros(chain.size)
        step[k] = 1e-5
        after, before = (chain.value_and_gradient(x + s * step)[0] for s in (1, -1))
        assert gradient[k] == pytest.approx((after - before) / 2e-5, abs=1e-8, rel=1e-6)


@pytest.mark.parametrize("structure", ["1|1-2", "*|1-*", "1-1x"])
@pytest.mark.parametrize("logarithm", [-1e4, 1e4])
def test_steps_that_a_line_search_throws_far_out_are_finite(skin1, structure, logarithm):
    chain = chain_of(skin1, structure, 0.7)
    x = chain.start(np.random.default_rng(4))
    x[chain.step_parameters] = logarithm
    value, gradient = chain.value_and_gradient(x)
    assert math.isfinite(value)
    assert np.isfinite(gradient).all()
    assert np.isfinite(chain.hessian(x)).all()


def test_the_matrix_of_aliasing_is_that_of_its_residuals_slopes(skin1):
    chain = chain_of(skin1, "1|1-2", 0.7)
    x = chain.start(np.random.default_rng(4))

    def residuals(x):
        passed = chain._blurs(x).chain
        parts = [
            np.sqrt((0.7 if images else 1.0) * chain.target.power)
            * _sum(part * view.x, part * view.y, chain._blend(x)[view.stages])
            for images, view in enumerate(chain.views)
            for part in [passed[:, view.stages]]
        ]
        return np.concatenate([each.ravel() for each in parts])

    steps = 1e-5 * np.eye(chain.size)
    rows = np.array([(residuals(x + each) - residuals(x - each)) / 2e-5 for each in steps])
    np.testing.assert_allclose(chain.hessian(x), 2 * rows @ rows.T, atol=1e-8)


@pytest.mark.parametrize("structure", ["1-2|1", "*|1", "2-1-1"])
def test_parameters_of_a_tables_numbers_are_those_it_was_made_of(skin1, structure):
    chain = chain_of(skin1, structure)
    x = chain.start(np.random.default_rng(3))
    found = chain.start_from(cascade.numbers_of(taps_of(chain, x), [0, 1, 2], 0.3))
    np.testing.assert_allclose(chain.spectrum(found), chain.spectrum(x), rtol=0, atol=1e-14)
    again = chain.start_from(chain.numbers(found))
    np.testing.assert_allclose(again, found, rtol=0, atol=1e-12)


@pytest.mark.parametrize(("structure", "level"), [("1|1-2", 1), ("1|1|2", 1), ("1|1|2", 2)])
def test_aliasing_is_what_halved_pictures_show_of_a_wave(skin1, structure, level):
    """The image of a wave along x, at its frequency less 2 pi / 2^level, in a rendered picture."""
    chain = chain_of(skin1, structure)
    taps = taps_of(chain, chain.start(np.random.default_rng(8)))
    size, k = 64, 41 if level == 1 else 13
    w = np.pi * k / size  # mirrored at its ends it is a wave of 2 x 64 pixels
    wave = 1.0 + np.cos(w * (np.arange(size) + 0.5))
    scene = Scene("wave", np.broadcast_to(wave[None, :, None], (size, size, 1)), 0.3)
    shown = render_taps(scene, taps)[0]
    spectrum = np.abs(np.fft.rfft(np.concatenate((shown, shown[::-1])), axis=0)) / size
    image = np.pi * 2.0 / 2.0**level - w
    exact = PairChain(replace(chain.target, frequencies=np.array([w])), chain.shapes, 1.0)
    x = chain.start(np.random.default_rng(8))
    passed = exact._blurs(x).chain[:, :, 0]
    view = exact.views[level]
    seen = (passed[:, view.stages] * view.x[:, 0] * exact._blend(x).T[:, view.stages]).sum(axis=1)
    place = round(abs(image) * size / np.pi)
    np.testing.assert_allclose(spectrum[place], np.abs(seen), rtol=1e-9)
    assert np.abs(seen).min() > 1e-4


@pytest.mark.parametrize("structure", ["1|1-2", "*|1-*"])
def test_the_matrix_is_that_of_the_residuals_slopes(skin1, structure):
    """Twice the slopes of the weighted spectrum times themselves: Gauss and Newton."""
    chain = chain_of(skin1, structure)
    x = chain.start(np.random.default_rng(4))
    root, rows = np.sqrt(chain.target.power), []
    for k in range(chain.size):
        step = np.zeros(chain.size)
        step[k] = 1e-5
        after, before = (chain.spectrum(x + s * step) for s in (1, -1))
        rows.append((root * (after - before) / 2e-5).ravel())
    np.testing.assert_allclose(chain.hessian(x), 2 * np.array(rows) @ np.array(rows).T, atol=1e-8)


@pytest.mark.parametrize("aliasing", [0.0, 0.7])
def test_pairs_are_the_same_in_one_dimension_and_in_two(skin1, aliasing):
    one = chain_of(skin1, "1|1-2|1", aliasing)
    two = StarChain(one.target, one.shapes, aliasing)
    x = one.start(np.random.default_rng(6))
    for ours, theirs in zip(
        (*one.misfit(x), one.matrix(x), one.spectrum(x)),
        (*two.misfit(x), two.matrix(x), two.spectrum(x)),
        strict=True,
    ):
        np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("structure", ["1|1", "*|*"])
def test_an_offset_beyond_the_kernel_is_held_back(skin1, structure):
    """The graded frequencies cannot tell it from one inside."""
    chain = chain_of(skin1, structure)
    x = chain.start(np.random.default_rng(5))
    last = chain.step_parameters[-1]
    half = make_target(skin1, 0.3, 9.0).half_pixels
    x[last] = np.log(1.5 * half / 2)  # texels of the second level
    value, gradient = chain.value_and_gradient(x)
    misfit = float((chain.target.error(chain.spectrum(x)) ** 2).sum())
    assert value - misfit == pytest.approx(0.01 * np.log(1.5) ** 2)
    assert gradient[last] > 0.0
    step = np.zeros(chain.size)
    step[last] = 1e-5
    after, before = (chain.value_and_gradient(x + s * step)[0] for s in (1, -1))
    assert gradient[last] == pytest.approx((after - before) / 2e-5, rel=1e-5)


# The fit


@pytest.fixture(scope="module")
def fitted(skin1):
    return fit_taps(skin1, "cascade", stages="1|1-1", seed=3)


def test_everything_is_positive_and_energy_is_exact(skin1, fitted):
    taps = fitted.kernel
    assert (taps.blend >= 0.0).all()
    assert all((each.weights >= 0.0).all() for each in taps.stages)
    np.testing.assert_allclose(taps.energy, skin1.diffuse_reflectance, rtol=1e-9)
    np.testing.assert_allclose(taps.errors["energy"], 0.0, atol=1e-9)
    assert taps.meta["profile_sha256"] == skin1.sha256
    assert taps.meta["settings"]["stages"] == "1|1-1"
    assert fitted.to_dict()["structure"] == "1|1-1"


def test_the_same_seed_gives_the_same_bits(skin1, fitted):
    with shared_work.alone():
        again = fit(skin1, "cascade", stages="1|1-1", seed=3)
    assert again.blend.tobytes() == fitted.kernel.blend.tobytes()
    for ours, theirs in zip(again.stages, fitted.kernel.stages, strict=True):
        assert ours.offsets_mm.tobytes() == theirs.offsets_mm.tobytes()


def test_the_error_is_that_over_all_frequencies(skin1, fitted):
    """The graded grid against all frequencies of a picture of 256 x 256."""
    w = np.arange(257) * np.pi / 256
    ends = np.where(np.isin(np.arange(257), (0, 256)), 0.5, 1.0)
    sine = 4 * np.sin(w / 2) ** 2
    power = np.outer(ends, ends) / np.maximum(sine[:, None] + sine, sine[1])
    power[0, 0] = 0.0
    target = make_target(skin1, 0.3, cascade._reach_mm(skin1, 0.3))
    cosines = np.cos(np.outer(w, np.arange(target.half_pixels + 1))) * target.copies
    for c in range(3):
        wanted = cosines @ target.quadrant(c) @ cosines.T
        wanted *= skin1.diffuse_reflectance[c] / wanted[0, 0]
        apart = _spectrum_of(fitted.kernel, c, w) - wanted
        error = np.sqrt((power * apart**2).sum() / (power * wanted**2).sum())
        assert error == pytest.approx(fitted.kernel.errors["spectral"][c], rel=0.05)


def _spectrum_of(taps, channel, w):
    """The mean spectrum of a chain at frequencies w, straight from the formula."""
    total = np.full((w.size, w.size), taps.blend[0, channel])
    chain, back, level = np.ones(w.size), np.ones(w.size), 0
    for stage, row in zip(taps.stages, taps.blend[1:], strict=True):
        while level < stage.level:
            half = 2.0**level * w / 2
            chain = chain * np.cos(half)
            back = back * (0.75 * np.cos(half) + 0.25 * np.cos(3 * half))
            level += 1
        line = stage.pass_weights(taps.mm_per_pixel * 2.0**level)[:, channel]
        place = np.arange(line.size) - line.size // 2
        chain = chain * (np.cos(np.outer(2.0**level * w, place)) @ line)
        total += row[channel] * np.outer(chain * back, chain * back)
    return total


def test_white_pictures_are_another_optimum(skin1):
    """Each spectrum's own fit is the better one under it."""
    fits = {each: fit_taps(skin1, stages="1-1", spectrum=each) for each in ("natural", "white")}
    target = make_target(skin1, 0.3, cascade._reach_mm(skin1, 0.3))
    for each in fits:
        judge = spectral_target(target, [0, 1, 2], each)
        errors = {
            name: (
                judge.error(
                    np.stack([_spectrum_of(fit.kernel, c, judge.frequencies) for c in range(3)])
                )
                ** 2
            ).sum()
            for name, fit in fits.items()
        }
        assert min(errors, key=errors.get) == each


def test_a_channel_without_light_stays_black(skin1):
    energy = skin1.annulus_energy.copy()
    energy[:, 1] = 0.0
    beyond = skin1.beyond_grid * [1, 0, 1]
    dark = replace(skin1, annulus_energy=energy, beyond_grid=beyond)
    taps = fit_taps(dark, stages="1|1").kernel
    assert (taps.blend[:, 1] == 0.0).all()
    assert taps.errors["spectral"][1] == 0.0
    np.testing.assert_allclose(taps.energy, dark.diffuse_reflectance, rtol=1e-9)


@pytest.mark.parametrize("lengths_mm", [[0.4], [0.1, 0.4, 0.2, 0.6]])
def test_any_number_of_channels(lengths_mm):
    profile = one_over_r_profile(100, 0.1, lengths_mm)
    taps = fit_taps(profile, stages="1|1", mm_per_pixel=0.5).kernel
    assert taps.channels == profile.channels
    np.testing.assert_allclose(taps.energy, profile.diffuse_reflectance, rtol=1e-9)


# Budgets


@pytest.mark.parametrize("width", [5.0, 40.0, *structures.WIDTHS_PIXELS])
@pytest.mark.parametrize("budget", [7, 10, 11.95, 12.5, 14, 17, 20, 24, 28, 36, 60, 100])
def test_the_best_known_structure_within_a_budget_is_taken(budget, width):
    found = cascade.structure_for(budget, None, None, width)
    within = {
        text: structures.between(known, width)
        for text, known in structures.STRUCTURES.items()
        if cost_of_chain(parse(text)).fetches <= budget
    }
    assert within[text_of(found)] <= 1.15 * min(within.values())
    for text, error in within.items():  # nothing in fewer passes is as good
        if cost_of_chain(parse(text)).passes < cost_of_chain(found).passes:
            assert error > 1.15 * min(within.values())


def test_errors_between_two_widths_follow_their_logarithms():
    narrow, wide = structures.WIDTHS_PIXELS
    assert structures.between((1.0, 16.0), (narrow * wide) ** 0.5) == pytest.approx(4.0)
    for width in (narrow, 0.3, 0.0):
        assert structures.between((1.0, 16.0), width) == pytest.approx(1.0)
    for width in (wide, 1e4):
        assert structures.between((1.0, 16.0), width) == pytest.approx(16.0)


def test_the_width_is_that_of_ninety_per_cent_of_the_widest_channel():
    profile = one_over_r_profile(2000, 0.01, [0.4, 1.6])  # F(r) = 1 - exp(-r / length)
    assert structures.width_pixels(profile, 0.2) == pytest.approx(8.0 * np.log(10.0), rel=0.01)


@pytest.mark.slow
def test_the_known_widths_are_those_of_their_materials():
    found = [structures.width_pixels(whole_profile(each), 0.3) for each in ("skin1", "chicken1")]
    assert found == pytest.approx(structures.WIDTHS_PIXELS, rel=0.01)


def test_passes_and_halvings_are_limits():
    for passes in (2, 4, 6, 8, 10, 12):
        found = cascade.structure_for(30, None, passes, 22.6)
        assert cost_of_chain(found).passes <= passes
    for passes in (1, 5, 6):  # stars
        found = cascade.structure_for(30, None, passes, 22.6)
        assert cost_of_chain(found).passes == passes
    for budget in (36, 60):
        full = cascade.structure_for(budget, None, None, 22.6, full_resolution=True)
        assert max(each.level for each in full) == 0
        assert cost_of_chain(full).fetches > 0.7 * budget
    full = cascade.structure_for(36, None, None, 22.6, full_resolution=True)
    assert structures.STRUCTURES["-".join(str(each.pairs) for each in full)][0] <= 1.9


@pytest.mark.slow
@pytest.mark.parametrize(("place", "name"), [(0, "skin1"), (1, "chicken1")])
@pytest.mark.parametrize("text", structures.STRUCTURES)
def test_known_structures_leave_what_is_said_of_them(text, place, name):
    profile = whole_profile(name)
    shown = mean_p99(fit(profile, "cascade", stages=text), profile)
    assert shown == pytest.approx(structures.STRUCTURES[text][place], rel=0.1)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"fetches": 6.9}, "fetches = 6.9; expected a number from 7 up"),
        ({"fetches": float("nan")}, "fetches = nan; expected"),
        ({"fetches": 10, "stages": "1-1|2-2"}, "the stages 1-1|2-2 take"),
        ({"stages": "1-1|2-2", "passes": 6}, "allow more, or use fewer or smaller stages"),
        ({"stages": "1-x"}, "stages = '1-x'; expected numbers of tap pairs"),
        ({"passes": 1, "fetches": 8}, "no known cascade has at most 8 fetches and 1 pass"),
        ({"spectrum": "pink"}, "spectrum = 'pink'; expected 'natural' or 'white'"),
        ({"stages": "1", "mm_per_pixel": -1.0}, "mm_per_pixel = -1"),
    ],
)
def test_bad_settings_are_one_line(skin1, settings, said):
    with pytest.raises(FitError) as caught:
        fit_taps(skin1, **settings)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("pitch", "kept"), [(0.3, 0.9999), (0.1, 0.9999), (0.02, 0.999)])
def test_the_target_keeps_the_light_on_pixels_of_any_size(skin1, pitch, kept):
    """Cut off at 320 pixels of .02 mm a table was 8.8 off on an edge; it is .26 now."""
    target, _ = cascade.whole_target(skin1, pitch, None)
    reach = np.array([target.mm_per_pixel * (target.half_pixels + 1)])
    assert (skin1.cumulative_at(reach)[0] >= kept * skin1.total_on_grid).all()


@pytest.mark.slow
@pytest.mark.parametrize("pitch", [0.02, 0.04])
def test_close_ups_are_as_near(skin1, pitch):
    """Of 512 x 512 pixels near an edge; 8.8 and 4.1 where the target ended at 320 pixels."""
    scene = make_scene("edge", height=512, width=512, mm_per_pixel=pitch)
    taps = fit(skin1, "cascade", mm_per_pixel=pitch)
    shown = measure(render_taps(scene, taps), render_reference(scene, skin1))
    assert shown.delta_e_2000_p99 < 0.5


@pytest.mark.parametrize("method", ["cascade", "gaussian-chain", "pyramid", "rotated"])
def test_pixels_wider_than_the_kernel_are_one_line(method):
    narrow = one_over_r_profile(20, 0.05, (0.1,))
    with pytest.raises(FitError, match=r"a pixel of 5 mm is wider than the support of .* mm"):
        fit(narrow, method, mm_per_pixel=5.0)


def test_unknown_methods_are_named(skin1):
    with pytest.raises(FitError, match="method = 'svd'; expected one of cascade"):
        fit_taps(skin1, "svd")
    with pytest.raises(FitError, match="expected one of cascade, disk, svd, "):
        fit(skin1, "cascada")


def test_aliasing_weighed_in_makes_light_stiller(skin1, monkeypatch):
    still = fit_taps(skin1, stages="1-1|2-2|2-2", still=True).kernel
    usual = fit_taps(skin1, stages="1-1|2-2|2-2").kernel
    monkeypatch.setattr(cascade, "ALIASING", 0.0)
    blind = fit_taps(skin1, stages="1-1|2-2|2-2").kernel
    moved = [motion(each, skin1, positions=1).moved for each in (still, usual, blind)]
    assert moved[0] < moved[1] < moved[2]
    assert moved[0] <= 0.7
    assert moved[1] <= 0.85
    assert mean_p99(usual, skin1) < mean_p99(blind, skin1)


# What a picture shows


PICTURES = [
    ("disk", {"radius_mm": 19.2}),
    *(("edge", {"angle_degrees": angle}) for angle in (0, 15, 30, 45)),
    *(("head", {}), ("points", {}), ("highlights", {})),
]


@functools.cache
def whole_profile(name):
    material = load_material(name)
    return exact_with_all_light(material, paper_grid(material), 150.0)


@functools.cache
def pictures_and_truths(profile, pitch, size):
    """Scenes and their true pictures: those of skin1 at .3 mm are asked for five times."""
    scenes = [
        make_scene(name, height=size, width=size, mm_per_pixel=pitch, **settings)
        for name, settings in PICTURES
    ]
    return [(each, render_reference(each, profile)) for each in scenes]


def mean_p99(taps, profile, size=256):
    found = [
        measure(render_taps(scene, taps), truth, mask=scene.mask).delta_e_2000_p99
        for scene, truth in pictures_and_truths(profile, taps.mm_per_pixel, size)
    ]
    return float(np.mean(found))


# The figures: the mean over the pictures of the 99th percentile of Delta E.
@pytest.mark.parametrize(
    ("budget", "passes", "most"),
    [
        pytest.param(14, None, 1.4, marks=pytest.mark.slow),
        pytest.param(17, None, 0.5, marks=pytest.mark.slow),
        pytest.param(20, 6, 0.4, marks=pytest.mark.slow),
        (24, None, 0.25),  # what the README promises
    ],
)
def test_skin1_is_as_near_as_was_asked(skin1, budget, passes, most):
    taps = fit(skin1, "cascade", fetches=budget, passes=passes)
    assert taps.fetches <= budget
    assert taps.passes <= (passes or 99)
    assert mean_p99(taps, skin1) <= most


@pytest.mark.slow
def test_skin1_at_a_tenth_of_a_millimetre_is_as_near_as_was_asked(skin1):
    taps = fit(skin1, "cascade", fetches=24, mm_per_pixel=0.1)
    assert mean_p99(taps, skin1, size=512) <= 0.2


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "budget", "most"),
    [
        *(("ketchup", 17, 0.6), ("chicken1", 17, 1.0)),
        *(
            ("marble", 24, 0.25),
            ("ketchup", 24, 0.35),
            ("chicken1", 24, 0.7),
            ("skimmilk", 24, 0.5),
        ),
        *(("skin1", 28, 0.2), ("marble", 28, 0.2), ("ketchup", 28, 0.25), ("chicken1", 28, 0.5)),
        ("skimmilk", 28, 0.3),
    ],
)
def test_other_materials_are_as_near_as_was_asked(name, budget, most):
    profile = whole_profile(name)
    assert mean_p99(fit(profile, "cascade", fetches=budget), profile) <= most


def cut_profile(name):
    """On the paper's grid, without the light beyond, and scaled to the same energy."""
    exact = simulate_exact(load_material(name))
    scale = exact.diffuse_reflectance / exact.annulus_energy.sum(axis=0)
    return replace(exact, annulus_energy=scale * exact.annulus_energy, beyond_grid=np.zeros(3))


# The 1.0 for marble is for a profile that ends at 14.6 mm; 2.2 % of its red go further.
@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "profile_of", "most"),
    [
        *(("skin1", whole_profile, 1.9), ("ketchup", whole_profile, 2.9)),
        *(("marble", cut_profile, 1.0), ("marble", whole_profile, 2.0)),
    ],
)
def test_36_fetches_at_full_resolution_are_as_near_as_was_asked(name, profile_of, most):
    profile = profile_of(name)
    taps = fit(profile, "cascade", fetches=36, full_resolution=True)
    assert max(each.level for each in taps.stages) == 0
    assert taps.fetches <= 36
    assert mean_p99(taps, profile) <= most


# The optimum of 1-1-2-2 for marble's cut profile by another program (automatic derivatives, ten
# starts, frequencies of 256 pixels): its offsets in pixels, and the misfit of its numbers.
def test_the_optimum_at_full_resolution_is_that_of_another_program():
    profile = cut_profile("marble")
    taps = fit(profile, "cascade", stages="1-1-2-2")
    found = np.concatenate([each.offsets_mm for each in taps.stages]) / 0.3
    np.testing.assert_allclose(found, [1.193, 2.452, 4.853, 10.263, 13.478, 30.371], rtol=0.005)
    assert (taps.errors["spectral"] ** 2).sum() < 4.634e-5


@pytest.mark.slow
@pytest.mark.parametrize("stages", ["1-1|2-2|2-2", "1|1|1-1|1-1|1-1"])
def test_no_start_of_64_is_much_better(skin1, stages):
    target = make_target(skin1, 0.3, cascade._reach_mm(skin1, 0.3))
    wanted = search_targets(target, [0, 1, 2], "natural")
    few, chain = (PairChain(each, parse(stages), cascade.ALIASING) for each in wanted)
    ours = chain.value_and_gradient(cascade.searched(few, chain, 1)[0])[0]
    best = np.inf
    for seed in range(64):
        rough = chain.start(np.random.default_rng([77, seed]))
        ended = cascade.descent(chain, cascade._rough(chain, rough).x, 300, gain=1e-6)
        best = min(best, ended.fun)
    assert ours <= 1.06 * best


# With aliasing left to the last descent, seeds 1, 2, 3, 4 and 6 left .67, .61, .61, .35 and .89.
@pytest.mark.parametrize(
    "seed", [2, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (3, 4, 5, 6))]
)
def test_another_seed_leaves_about_as_much(skin1, seed):
    first, other = (mean_p99(fit(skin1, fetches=14, seed=each), skin1) for each in (1, seed))
    assert max(first, other) <= 1.4 * min(first, other)
