"""Pictures held against the true one: linear figures, Delta E 2000, SSIM, FLIP, cost."""

import subprocess
import sys

import numpy as np
import pytest
import reference_delta_e as reference
from test_taps import taps_of

from sssfit.compare import Cost, auto_exposure, cost_of, flip, measure, seconds_per_megapixel, ssim
from sssfit.errors import RenderError
from sssfit.kernel import SeparableKernel
from sssfit.measure.delta_e import BLOCK_PIXELS, delta_e_2000, lab
from sssfit.measure.score import COLOUR_FIGURES
from sssfit.methods import MEASURES, Measure


def pictures(height=20, width=24, channels=3, seed=1):
    """A picture in [0, 1] and another beside it, the same two every time."""
    rng = np.random.default_rng(seed)
    truth = rng.random((height, width, channels))
    return truth + rng.normal(scale=0.05, size=truth.shape), truth


def test_linear_figures_are_those_by_hand():
    score = measure([[[1.0, 1.0], [5.0, 3.0]]], [[[1.0, 2.0], [3.0, 4.0]]])
    assert score.rmse == pytest.approx(np.sqrt((0 + 1 + 4 + 1) / 4), rel=1e-15)
    assert score.relative_l2 == pytest.approx(np.sqrt(6 / 30), rel=1e-15)
    assert score.maximum == 2.0
    assert score.psnr_db == pytest.approx(10 * np.log10(4.0**2 / 1.5), rel=1e-15)
    np.testing.assert_allclose(score.energy_drift, [6 / 4 - 1, 4 / 6 - 1], rtol=1e-15)
    assert not score.energy_drift.flags.writeable
    assert score.ssim is None
    assert score.flip is None


@pytest.mark.parametrize("channels", [1, 2, 3, 5])
def test_identical_pictures_differ_in_nothing(channels):
    _, truth = pictures(channels=channels)
    score = measure(truth, truth, structure=True)
    assert (score.rmse, score.relative_l2, score.maximum) == (0.0, 0.0, 0.0)
    assert score.psnr_db == np.inf
    assert not score.energy_drift.any()
    assert score.ssim == pytest.approx(1.0, abs=1e-12)
    colours = [*(getattr(score, key) for key in COLOUR_FIGURES), score.flip]
    np.testing.assert_array_equal(colours, [0.0 if channels in (1, 3) else np.nan] * 5)


def test_a_measure_is_one_entry(monkeypatch):
    image, truth = pictures()
    monkeypatch.setitem(MEASURES, "new", Measure("sssfit.measure.structure:ssim", "NEW"))
    score = measure(image, truth, structure=True)
    assert list(score.to_dict())[-3:] == ["ssim", "flip", "new"]
    assert score.to_dict()["new"] == score.structure["new"] == score.ssim
    assert score.to_dict()["flip"] == score.flip
    assert measure(image, truth).to_dict()["new"] is None


def test_a_mask_gives_the_figures_of_the_cropped_picture():
    image, truth = pictures()
    mask = np.zeros(truth.shape[:2], dtype=int)
    mask[3:11, 5:] = 2
    image[0, 0] = 100.0
    masked = measure(image, truth, mask=mask)
    cropped = measure(image[3:11, 5:], truth[3:11, 5:])
    for name in ("rmse", "relative_l2", "maximum", "psnr_db", "exposure", "delta_e_2000_p99"):
        assert getattr(masked, name) == pytest.approx(getattr(cropped, name), rel=1e-13), name
    np.testing.assert_allclose(masked.energy_drift, cropped.energy_drift, rtol=1e-12)


def test_black_channels_drift_by_nothing_or_without_limit():
    truth = np.ones((2, 2, 3)) * [1.0, 0.0, 0.0]
    score = measure(truth + np.array([0.0, 0.0, 0.1]), truth)
    np.testing.assert_array_equal(score.energy_drift, [0.0, 0.0, np.inf])
    assert measure(np.ones((2, 2, 3)), np.zeros((2, 2, 3)), exposure=1.0).psnr_db == -np.inf


def test_exposure_is_of_the_truth_alone_and_of_lit_pixels():
    image, truth = pictures()
    largest = [max(pixel) for row in truth for pixel in row]
    assert auto_exposure(truth) == pytest.approx(0.8 / np.percentile(largest, 99), rel=1e-14)
    assert measure(image, truth).exposure == auto_exposure(truth)
    assert auto_exposure(4.0 * truth) == pytest.approx(auto_exposure(truth) / 4.0, rel=1e-14)
    with_dark = np.concatenate([truth, np.zeros_like(truth)], axis=1)
    assert auto_exposure(with_dark) == auto_exposure(truth)
    assert auto_exposure(with_dark, mask=with_dark[..., 0] > 0) == auto_exposure(truth)


def test_known_colours():
    np.testing.assert_allclose(lab(np.ones((1, 3)))[0], [100.0, 0.0, 0.0], atol=1e-11)
    red, green, blue = lab(np.eye(3))
    # Tables round, and make them with matrices of four to seven digits.
    np.testing.assert_allclose(red, [53.24, 80.09, 67.20], rtol=0, atol=1e-2)
    np.testing.assert_allclose(green, [87.74, -86.18, 83.18], rtol=0, atol=1e-2)
    np.testing.assert_allclose(blue, [32.30, 79.19, -107.86], rtol=0, atol=1e-2)
    for found, pixel in zip((red, green, blue), np.eye(3), strict=True):
        np.testing.assert_allclose(found, reference.lab(pixel), rtol=1e-12)


def test_colour_differences_are_the_literal_ones_across_blocks():
    image, truth = (picture.reshape(-1, 3) for picture in pictures(1, BLOCK_PIXELS + 50))
    image = image.clip(0.0, 1.0)
    found = delta_e_2000(image, truth)
    for i in [*range(20), *range(BLOCK_PIXELS - 20, BLOCK_PIXELS + 50)]:
        expected = reference.delta_e_2000(reference.lab(image[i]), reference.lab(truth[i]))
        assert found[i] == pytest.approx(expected, rel=1e-9)


def test_mean_and_percentile_are_of_what_a_display_shows():
    image, truth = pictures(5, 6)
    image[0, 0] = [-1.0, 0.5, 7.0]
    shown = [np.clip(1.7 * each, 0.0, 1.0).reshape(-1, 3) for each in (image, truth)]
    expected = [
        reference.delta_e_2000(reference.lab(one), reference.lab(other))
        for one, other in zip(*shown, strict=True)
    ]
    score = measure(image, truth, exposure=1.7)
    assert score.delta_e_2000_mean == pytest.approx(np.mean(expected), rel=1e-9)
    assert score.delta_e_2000_p95 == pytest.approx(np.percentile(expected, 95), rel=1e-9)
    assert score.delta_e_2000_p99 == pytest.approx(np.percentile(expected, 99), rel=1e-9)
    assert score.share_above_1 == np.mean(np.array(expected) > 1.0)


def test_the_share_above_1_counts_pixels():
    truth = np.full((4, 25, 1), 0.2)
    image = truth.copy()
    image[0, :3] = 0.4  # far above 1
    image[1, :2] = 0.2001  # far below 1
    score = measure(image, truth, exposure=1.0)
    assert score.share_above_1 == 0.03
    assert score.delta_e_2000_p95 < 0.1 < 1.0 < score.delta_e_2000_p99


def test_one_channel_is_grey():
    image, truth = pictures(channels=1)
    grey = measure(image, truth, structure=True)
    three = measure(np.repeat(image, 3, axis=2), np.repeat(truth, 3, axis=2), structure=True)
    assert grey.delta_e_2000_mean > 1.0
    for name in ("delta_e_2000_mean", "delta_e_2000_p99", "ssim", "flip", "exposure"):
        assert getattr(grey, name) == pytest.approx(getattr(three, name), rel=1e-12), name


def test_ssim_is_the_papers_window_by_window():
    image, truth = pictures()
    mask = np.zeros(truth.shape[:2])
    mask[8:12, 2:9] = 1
    codes = [np.vectorize(reference.srgb_code)(np.clip(1.2 * p, 0, 1)) for p in (image, truth)]
    maps = [reference.ssim(codes[0][..., c], codes[1][..., c]) for c in range(3)]
    assert ssim(image, truth, 1.2) == pytest.approx(np.mean(maps), rel=1e-10)
    inside = np.mean([each[3:7, :4] for each in maps])
    assert ssim(image, truth, 1.2, mask=mask) == pytest.approx(inside, rel=1e-10)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ((1, 1, 1), (0, 0, 0)),
        ((0, 1, 0), (0, 0, 1)),
        ((0.2, 0.1, 0.05), (0.25, 0.1, 0.05)),
        ((0.5, 0.5, 0.5), (0.6, 0.5, 0.4)),
    ],
)
def test_flip_of_one_colour_each_is_the_papers_distance(one, other):
    first, second = (np.full((20, 24, 3), colour, dtype=float) for colour in (one, other))
    # The library counts in float32 and takes a root of its difference of features: what is 0 here
    # is up to sqrt(2^-24) there, an exponent of the distance.
    expected = reference.flip_of_uniform(one, other)
    rounding = 2.0**-12 * max(1.0, -np.log(expected))
    assert flip(first, second, 1.0) == pytest.approx(expected, rel=rounding)


def test_flip_sees_less_of_fine_squares_further_away_and_only_in_the_mask():
    truth = np.full((64, 64, 3), 0.3)
    squares = np.indices((64, 64)).sum(axis=0) % 2
    image = truth + 0.04 * (squares[..., None] - 0.5)
    near, middle, far = (flip(image, truth, 1.0, pixels_per_degree=ppd) for ppd in (10, 30, 60))
    assert near > 2.0 * middle > 4.0 * far > 0.0
    image[:, 32:] = truth[:, 32:]
    corner = np.zeros((64, 64))
    corner[:8, -8:] = 1
    assert flip(image, truth, 1.0, mask=corner) < 1e-3 * flip(image, truth, 1.0, mask=1 - corner)


@pytest.mark.parametrize(
    ("changes", "fragment"),
    [
        ({"image": np.ones((4, 5, 3))}, "image is (4, 5, 3) and truth (4, 4, 3); expected the"),
        ({"image": np.full((4, 4, 3), np.nan)}, "image has 48 NaN or infinite values"),
        ({"truth": np.full((4, 4, 3), np.inf)}, "truth has 48 NaN or infinite values"),
        ({"image": np.ones((4, 4)), "truth": np.ones((4, 4))}, "image has shape (4, 4); expected"),
        ({"image": np.ones((0, 4, 3)), "truth": np.ones((0, 4, 3))}, "at least one of each"),
        ({"exposure": -1.0}, "exposure = -1; expected a factor above 0."),
        ({"exposure": np.nan}, "exposure = nan; expected a factor above 0."),
        ({"mask": np.ones((4, 3))}, "mask is (4, 3) and the picture (4, 4); expected the same"),
        ({"mask": np.zeros((4, 4))}, "mask has no pixel above 0; expected some of the object"),
        ({"truth": np.zeros((4, 4, 3))}, "truth is black: no exposure can be found; give one."),
        ({"truth": np.full((4, 4, 3), 1e-320)}, "truth is black: no exposure can be found"),
        ({"structure": True}, "has no 11 x 11 window for SSIM inside it; give a larger one."),
    ],
)
def test_bad_pictures_are_one_clear_line(changes, fragment):
    given = {"image": np.ones((4, 4, 3)), "truth": np.ones((4, 4, 3))} | changes
    with pytest.raises(RenderError) as raised:
        measure(**given)
    assert fragment in str(raised.value)
    assert "\n" not in str(raised.value)


def test_flip_refuses_what_has_no_colour_or_no_distance():
    with pytest.raises(RenderError, match=r"FLIP of 2 channels; expected 3, or 1 for grey\."):
        flip(*pictures(channels=2), 1.0)
    with pytest.raises(RenderError, match=r"pixels_per_degree = 0; expected a number above 0\."):
        flip(*pictures(), 1.0, pixels_per_degree=0.0)


@pytest.mark.parametrize(
    ("function", "module", "name"),
    [(ssim, "skimage.metrics", "scikit-image"), (flip, "flip_evaluator", "flip-evaluator")],
)
def test_a_missing_extra_is_named(monkeypatch, function, module, name):
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(RenderError, match=rf'needs {name}.*install "sssfit\[metrics\]"\.$'):
        function(*pictures())


def test_comparing_does_not_wait_for_what_it_may_not_need():
    heavy = {"colour", "skimage", "flip_evaluator", "scipy.ndimage", "matplotlib"}
    program = f"import sys, sssfit.compare; assert not {heavy} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", program], check=True, timeout=60)


def test_comparing_colours_leaves_how_numpy_prints():
    program = """
import sys
import numpy as np
from sssfit.compare import measure
before = np.get_printoptions()
measure(np.ones((1, 1, 3)), np.ones((1, 1, 3)))
assert "colour" in sys.modules
assert np.get_printoptions() == before
"""
    subprocess.run([sys.executable, "-W", "error", "-c", program], check=True, timeout=60)


def test_cost_counts_what_a_shader_does():
    weights = np.random.default_rng(3).random((3, 4, 2))
    weights = np.concatenate([weights[:, :0:-1], weights], axis=1)
    weights[1] = 0.0
    weights[2, :, 0] = 0.0  # one channel without a term does not save its passes
    nothing = np.full(2, np.nan)
    kernel = SeparableKernel(
        method="svd",
        mm_per_pixel=0.1,
        channels=("a", "b"),
        signs=np.ones((3, 2)),
        weights=weights,
        relative_frobenius_error=nothing,
        energy_error=nothing,
        scale=np.ones(2),
        parameters={},
        meta={},
    )
    # Two terms: four passes read and write 8 bytes, and the second term is added to the first.
    assert cost_of(kernel) == Cost(28.0, 4, 4, 8.0 * (8 + 1), 2 * 7 * 2 * 4, None)
    assert cost_of(kernel, 0.5).seconds_per_megapixel == 0.5


@pytest.mark.parametrize(("channels", "textures"), [(1, 1), (3, 1), (4, 2), (5, 2)])
def test_a_texture_holds_three_channels(channels, textures):
    taps = taps_of("1-1", channels=channels)
    one = taps_of("1-1", channels=3)
    assert cost_of(taps).bytes_per_pixel == textures * cost_of(one).bytes_per_pixel
    dense = SeparableKernel(
        method="svd", mm_per_pixel=0.3, channels=taps.channels, signs=np.ones((1, channels)),
        weights=np.ones((1, 3, channels)), relative_frobenius_error=np.zeros(channels),
        energy_error=np.zeros(channels), scale=np.ones(channels), parameters={}, meta={},
    )  # fmt: skip
    assert cost_of(dense).bytes_per_pixel == textures * 8.0 * 4


def test_seconds_are_the_least_after_a_call_that_warms_up():
    calls = []
    readings = iter([0.0, 3.0, 10.0, 11.0, 20.0, 22.0])
    seconds = seconds_per_megapixel(
        lambda: calls.append(1), pixels=500_000, repeats=3, clock=lambda: next(readings)
    )
    assert seconds == 2.0
    assert len(calls) == 4
    with pytest.raises(RenderError, match="0 pixels, 5 repeats; expected at least 1 of each"):
        seconds_per_megapixel(lambda: None, pixels=0)


@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize(
    ("exposure", "colour", "size"),
    [(1e308, "white", "smaller"), (40.0, "white", "smaller"), (1e-308, "black", "larger"),
     (1e-320, "black", "larger"), (1.9e-4, "black", "larger")],
)  # fmt: skip
def test_an_exposure_that_shows_nothing_is_said_and_not_scored_0(exposure, colour, size, channels):
    truth = np.linspace(0.05, 0.7, 12).reshape(3, 4, 1) * np.ones(channels)
    with pytest.raises(RenderError) as caught:
        measure(truth * 1.1, truth, exposure=exposure)
    assert str(caught.value) == (
        f"at the exposure {exposure:g} all that is lit is {colour}, so Delta E says "
        f"nothing; use a {size} exposure, such as {auto_exposure(truth):.3g}."
    )


def test_rounding_of_the_convolution_is_no_light_that_could_be_white():
    truth = np.full((3, 4, 3), 1e-18)
    truth[1, 1] = 0.5
    truth[2, 2] = -1e-18
    with pytest.raises(RenderError, match="all that is lit is white"):
        measure(truth, truth, exposure=1e308)


@pytest.mark.parametrize("exposure", [1.0, 19.0, 3e-4])
def test_an_exposure_that_shows_something_is_scored(exposure):
    truth = np.linspace(0.05, 1.0, 12).reshape(3, 4, 1)
    assert measure(truth * 0.9, truth, exposure=exposure).exposure == exposure
    # White beside a picture that is not: that much is seen.
    assert measure(truth * 0.9, truth * 100.0, exposure=1.0).delta_e_2000_mean > 5.0
    assert measure(np.ones((2, 2, 1)), np.ones((2, 2, 1)), exposure=1.0).delta_e_2000_mean == 0.0


def test_pictures_that_are_no_colour_have_no_exposure_to_miss():
    truth = np.ones((2, 2, 2))
    assert np.isnan(measure(truth, truth, exposure=1e308).delta_e_2000_mean)
