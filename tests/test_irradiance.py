"""Made pictures against areas, spectra and ratios that are known."""

import numpy as np
import pytest

from sssfit.errors import RenderError
from sssfit.scene.made import MADE, make_scene, options_of
from sssfit.scene.patterns import centred, disk_coverage, half_plane_coverage

SIZE = {"height": 60, "width": 80, "mm_per_pixel": 0.5}


def subsampled(inside, height, width, n=64):
    """Share of n x n points of each pixel inside a shape given in pixels from the middle, y up."""
    x = (np.arange(width * n) + 0.5) / n - width / 2
    y = height / 2 - (np.arange(height * n) + 0.5) / n
    hits = inside(x[None, :], y[:, None])
    return hits.reshape(height, n, width, n).mean(axis=(1, 3))


@pytest.mark.parametrize("name", MADE)
def test_a_made_picture_is_grey_named_and_the_same_twice(name):
    one, two = (make_scene(name, **SIZE) for _ in range(2))
    assert one.name == name
    assert one.irradiance.shape == (60, 80, 1)
    assert one.mm_per_pixel == 0.5
    np.testing.assert_array_equal(one.irradiance, two.irradiance)


@pytest.mark.parametrize("name", MADE)
def test_one_pixel_is_a_picture(name):
    options = {"period_mm": 3.0} if name == "stripes" else {}
    scene = make_scene(name, height=1, width=1, mm_per_pixel=1.0, **options)
    assert scene.irradiance.shape == (1, 1, 1)


@pytest.mark.parametrize("shape", [(60, 80), (61, 81)])
@pytest.mark.parametrize("radius_mm", [0.1, 0.25, 3.3, 12.345])
def test_the_disk_has_its_area(shape, radius_mm):
    height, width = shape
    scene = make_scene("disk", height=height, width=width, mm_per_pixel=0.5, radius_mm=radius_mm)
    area = scene.irradiance.sum() * 0.5**2
    assert area == pytest.approx(np.pi * radius_mm**2, rel=1e-12)


def test_the_disk_is_a_quarter_of_the_smaller_side_and_symmetric():
    light = make_scene("disk", **SIZE).irradiance[..., 0]
    assert light.sum() == pytest.approx(np.pi * 15.0**2, rel=1e-12)
    np.testing.assert_allclose(light, light[::-1, ::-1], atol=1e-13)
    np.testing.assert_allclose(light[:, 10:70], light[:, 10:70].T, atol=1e-13)


def test_each_pixel_of_the_disk_holds_what_it_covers():
    light = disk_coverage(centred(24), centred(21), 8.7)
    points = subsampled(lambda x, y: np.hypot(x, y) < 8.7, 21, 24)
    # The edge crosses at most 2 x 64 of the 4096 points' cells; half of each may be wrong.
    assert np.abs(light - points).max() < 1.0 / 64.0
    assert set(np.unique(light[8:12, 10:14])) == {1.0}


def test_a_disk_larger_than_the_picture_fills_it():
    assert (make_scene("disk", **SIZE, radius_mm=1000.0).irradiance == 1.0).all()


@pytest.mark.parametrize("angle", [0.0, 30.0, 45.0, 90.0, -117.0, 260.0])
def test_each_pixel_of_the_edge_holds_what_it_covers(angle):
    light = make_scene("edge", **SIZE, angle_degrees=angle, offset_mm=0.81).irradiance[..., 0]
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    points = subsampled(lambda x, y: x * c + y * s > 1.62, 60, 80)
    assert np.abs(light - points).max() < 1.0 / 64.0


@pytest.mark.parametrize("angle", [0.0, 30.0, 45.0, 90.0])
def test_the_edge_has_its_area(angle):
    # Through the middle of the picture: half of it, whatever the angle.
    assert make_scene("edge", **SIZE, angle_degrees=angle).irradiance.mean() == pytest.approx(0.5)
    # A row at 30 degrees: the line crosses at x = (offset - y sin) / cos.
    light = make_scene("edge", **SIZE, angle_degrees=30.0, offset_mm=1.0).irradiance[..., 0]
    y = 30.0 - np.arange(60) - 0.5
    crossing = (2.0 - y * np.sin(np.pi / 6)) / np.cos(np.pi / 6)
    np.testing.assert_allclose(light.sum(axis=1), 40.0 - crossing, rtol=1e-12)


@pytest.mark.parametrize("angle", [0.0, 1e-7, 12.3, 45.0, 90.0])
def test_an_edge_and_its_opposite_make_white(angle):
    one = make_scene("edge", **SIZE, angle_degrees=angle, offset_mm=0.4).irradiance
    other = make_scene("edge", **SIZE, angle_degrees=angle + 180.0, offset_mm=-0.4).irradiance
    np.testing.assert_allclose(one + other, 1.0, atol=1e-12)


def test_the_edges_sides_are_as_documented():
    right = make_scene("edge", **SIZE).irradiance[..., 0]
    assert right[:, :40].max() == 0.0
    assert right[:, 40:].min() == 1.0
    upper = make_scene("edge", **SIZE, angle_degrees=90.0).irradiance[..., 0]
    assert upper[:30].min() == pytest.approx(1.0)
    assert upper[30:].max() == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_array_equal(
        half_plane_coverage(np.array([-0.25, 0.0, 0.25]), 0.0), [0.25, 0.5, 0.75]
    )


def test_stripes_have_their_mean_period_and_contrast():
    # 16 whole periods of 5 pixels: one line of the spectrum beside the mean.
    light = make_scene("stripes", **SIZE, period_mm=2.5).irradiance[..., 0]
    assert np.ptp(light, axis=0).max() < 1e-12
    spectrum = np.fft.rfft(light[0]) / 80
    assert spectrum[0].real == pytest.approx(0.5, abs=1e-12)
    # Averaged over a pixel of 1/5 period: sinc(1/5), half of it on either side of zero.
    assert abs(spectrum[16]) == pytest.approx(0.25 * np.sinc(0.2), rel=1e-12)
    rest = np.delete(np.abs(spectrum), [0, 16])
    assert rest.max() < 1e-12
    assert light[0, 39:41].min() > 0.8, "bright in the middle"


def test_slanted_stripes_are_averages_over_pixels():
    light = make_scene("stripes", **SIZE, period_mm=1.7, angle_degrees=37.0).irradiance[..., 0]
    c, s = np.cos(np.radians(37.0)), np.sin(np.radians(37.0))
    points = subsampled(lambda x, y: 0.5 + 0.5 * np.cos(2 * np.pi * (x * c + y * s) / 3.4), 60, 80)
    # The midpoint rule with 64 points a pixel: (2 pi / 3.4 / 64)^2 / 24 of the amplitude.
    np.testing.assert_allclose(light, points, atol=1e-4)


def test_the_separable_pattern_is_a_sum_of_two():
    light = make_scene("separable", **SIZE, period_mm=7.0).irradiance[..., 0]
    mixed = light - light[:1] - light[:, :1] + light[0, 0]
    assert np.abs(mixed).max() < 1e-15
    assert light.min() >= 0.0
    assert light.max() <= 1.0
    assert np.ptp(light, axis=0).min() > 0.4
    assert np.ptp(light, axis=1).min() > 0.4


def test_points_are_single_pixels_at_their_spacing():
    light = make_scene("points", **SIZE, spacing_mm=10.0).irradiance[..., 0]
    rows, columns = np.nonzero(light)
    assert light[30, 40] == 1.0
    assert set(light[rows, columns]) == {1.0}
    assert sorted(set(rows)) == [10, 30, 50]
    assert sorted(set(columns)) == [0, 20, 40, 60]
    # 32 pixels apart by default: rows 30; columns 8, 40, 72.
    assert np.count_nonzero(make_scene("points", **SIZE).irradiance) == 3


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_noise_falls_as_one_over_f(seed):
    light = make_scene("noise", height=256, width=256, mm_per_pixel=1.0, seed=seed).irradiance
    spectrum = np.fft.fft2(light[..., 0])
    frequency = np.hypot(*np.meshgrid(np.fft.fftfreq(256), np.fft.fftfreq(256), indexing="ij"))
    half = (np.fft.fftfreq(256) > 0)[None, :] & (frequency > 0)
    x, y = np.log(frequency[half]), np.log(np.abs(spectrum[half]))
    # A line's slope and its own standard error; amplitudes of white noise scatter independently.
    (slope, _), covariance = np.polyfit(x, y, 1, cov=True)
    assert abs(slope + 1.0) < 4.0 * np.sqrt(covariance[0, 0])
    assert np.sqrt(covariance[0, 0]) < 0.02


def test_the_noise_lies_between_0_and_1_around_one_half():
    light = make_scene("noise", **SIZE, seed=5).irradiance
    assert light.mean() == pytest.approx(0.5, abs=1e-12)
    assert light.min() >= 0.0
    assert light.max() <= 1.0
    assert max(0.5 - light.min(), light.max() - 0.5) == pytest.approx(0.5, abs=1e-12)
    assert not np.array_equal(light, make_scene("noise", **SIZE, seed=6).irradiance)


def test_highlights_are_a_thousand_times_as_bright():
    light = make_scene("highlights", **SIZE, count=5, seed=3).irradiance[..., 0]
    assert light.max() / light.min() == 1000.0
    assert light.min() == 0.5
    # Apart from each other and whole, spots hold 5 disks of 1.5 pixels; else less.
    energy = (light - 0.5).sum() / 499.5
    assert 0.0 < energy <= 5 * np.pi * 1.5**2 * (1.0 + 1e-12)
    one = make_scene("highlights", **SIZE, count=1, radius_mm=1.0).irradiance
    assert (one - 0.5).sum() / 499.5 == pytest.approx(np.pi * 2.0**2, rel=1e-12)


def test_none_stands_for_the_default():
    one = make_scene("disk", **SIZE, radius_mm=None).irradiance
    np.testing.assert_array_equal(one, make_scene("disk", **SIZE).irradiance)
    assert options_of("edge") == ("angle_degrees", "offset_mm")


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("dsik", {}, "no made picture 'dsik'; expected one of head, disk, edge, separable"),
        ("disk", {"period_mm": 1.0}, "disk: no option 'period_mm'; expected one of radius_mm."),
        ("disk", {"height": 0}, "disk: height = 0; expected a whole number, 1 or more."),
        ("disk", {"width": 2.5}, "disk: width = 2.5; expected a whole number"),
        ("disk", {"width": float("nan")}, "disk: width = nan; expected a whole number"),
        ("disk", {"height": 100_000, "width": 100_000}, "would take 1.2e+03 GB to render"),
        (
            "disk",
            {"mm_per_pixel": -1.0},
            "disk: mm_per_pixel = -1; expected a number above 0, up to",
        ),
        ("head", {"mm_per_pixel": 1e-320}, "head: mm_per_pixel = 9.99989e-321; expected 1e-12 to"),
        ("disk", {"radius_mm": 0.0}, "disk: radius_mm = 0; expected a number above 0, up to"),
        ("edge", {"angle_degrees": float("nan")}, "edge: angle_degrees = nan; expected a finite"),
        ("edge", {"offset_mm": float("inf")}, "edge: offset_mm = inf; expected a finite"),
        ("stripes", {"period_mm": 0.99}, "period_mm = 0.99 is under two pixels of 0.5 mm"),
        ("stripes", {"period_mm": float("nan")}, "stripes: period_mm = nan"),
        ("separable", {"period_mm": 0.5}, "separable: period_mm = 0.5 is under two pixels"),
        ("points", {"spacing_mm": 0.6}, "points: spacing_mm = 0.6 is under two pixels"),
        ("points", {"spacing_mm": float("nan")}, "points: spacing_mm = nan"),
        ("highlights", {"count": 0}, "highlights: count = 0; expected a number above 0, up to"),
        ("highlights", {"seed": -1}, "highlights: seed = -1; expected a whole number from 0"),
        ("noise", {"seed": 1.5}, "noise: seed = 1.5; expected a whole number from 0"),
    ],
)
def test_bad_values_are_named_in_one_line(name, options, message):
    with pytest.raises(RenderError) as caught:
        make_scene(name, **{**SIZE, **options})
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
