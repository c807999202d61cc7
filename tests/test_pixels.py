"""Lines and pixels of a profile against quadrature, sampling and closed cases."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from reference_pixels import (
    disk_rectangle_area,
    edge_spread,
    kernel_energy,
    make_profile,
    one_over_r_centre_pixel,
    one_over_r_profile,
    rectangle_energy,
    row_sums,
    sampled_pixel_energy,
)
from scipy.integrate import dblquad
from scipy.special import erf

from sssfit._jit import pixel_energy, pixels
from sssfit.errors import ProfileError
from sssfit.material import load_material
from sssfit.profile import full_kernel
from sssfit.profile import pixels as integrals
from sssfit.simulate import simulate_exact

NOISY = make_profile(
    np.concatenate(([0.0], np.cumsum(np.random.default_rng(5).uniform(0.5, 1.5, 14)))),
    np.random.default_rng(6).exponential(size=(14, 2)) * np.exp(-np.arange(14) / 3)[:, None],
)


def check_rows_and_energy(profile, pitch_mm):
    line = profile.line_kernel(pitch_mm)
    quadrant = profile.quadrant_kernel(pitch_mm)
    half_line = line[len(line) // 2 :]
    np.testing.assert_allclose(row_sums(quadrant), half_line, rtol=1e-9, atol=0)
    np.testing.assert_allclose(kernel_energy(quadrant), profile.total_on_grid, rtol=1e-9)
    np.testing.assert_allclose(line.sum(axis=0), profile.total_on_grid, rtol=1e-9)
    np.testing.assert_array_equal(line, line[::-1])


@pytest.mark.parametrize("seed", range(20))
def test_disk_in_rectangle_agrees_with_quadrature(seed):
    rng = np.random.default_rng(seed)
    x0, y0 = rng.uniform(0, 3, 2) * (rng.random(2) < 0.7)
    x1, y1 = x0 + rng.uniform(0.05, 2), y0 + rng.uniform(0.05, 2)
    radius = rng.uniform(np.hypot(x0, y0), np.hypot(x1, y1))
    area = pixels.disk_pixel_area(radius, x0, x1, y0, y1)
    assert area == pytest.approx(disk_rectangle_area(radius, x0, x1, y0, y1), rel=1e-9, abs=1e-13)


@pytest.mark.parametrize("theta", [1e-8, 1e-4, 0.01, 0.1, 0.10003, 0.10006, 0.3, 1.0, 3.0])
def test_circular_segment_keeps_its_digits_at_any_angle(theta):
    terms = [theta**3 / 6]
    for n in range(2, 30):
        terms.append(-terms[-1] * theta**2 / (2 * n * (2 * n + 1)))
    expected = 7.0**2 / 2 * sum(reversed(terms))
    found = pixels.circular_segment(7.0, np.sin(theta / 2))
    assert found == pytest.approx(expected, rel=1e-12)


def test_segment_of_a_half_disk():
    # The chord is the diameter: asin is steepest here, and rounding may put its argument over 1.
    assert pixels.circular_segment(2.0, 1.0 + 3e-16) == pytest.approx(2 * np.pi)


def test_line_of_one_disk_is_its_edge_spread(monkeypatch):
    monkeypatch.setattr(integrals, "PARTS_PER_ANNULUS", 1)
    disk = make_profile([0.0, 2.5], [[0.7]])
    line = disk.line_kernel(0.3)[:, 0]
    h = len(line) // 2
    edges = (np.arange(-h, h + 2) - 0.5) * 0.3
    np.testing.assert_allclose(line, 0.7 * np.diff(edge_spread(edges, 2.5)), rtol=1e-11)


@pytest.mark.parametrize("pitch_mm", [0.8, 3.3])
def test_line_agrees_with_quadrature(pitch_mm):
    line = NOISY.line_kernel(pitch_mm)
    h, far = len(line) // 2, 2 * NOISY.r_edges_mm[-1]
    for k in (0, 1, h // 2, h):
        x0, x1 = (k - 0.5) * pitch_mm, (k + 0.5) * pitch_mm
        expected = rectangle_energy(NOISY, x0, x1, -far, far)
        np.testing.assert_allclose(line[h + k], expected, rtol=1e-9, atol=1e-13)


@pytest.mark.parametrize("pitch_mm", [0.8, 3.3])
def test_pixels_agree_with_quadrature(pitch_mm):
    quadrant = NOISY.quadrant_kernel(pitch_mm)
    h = len(quadrant) - 1
    for i, k in ((0, 0), (0, 1), (1, 1), (h // 2, h // 3), (h - 1, 2), (h, 0)):
        x0, y0 = (i - 0.5) * pitch_mm, (k - 0.5) * pitch_mm
        expected = rectangle_energy(NOISY, x0, x0 + pitch_mm, y0, y0 + pitch_mm)
        np.testing.assert_allclose(quadrant[i, k], expected, rtol=1e-9, atol=1e-13)


def test_pixels_agree_with_sampling():
    quadrant = NOISY.quadrant_kernel(0.8)
    for i, k in ((1, 1), (5, 3), (9, 8)):
        # The edge that crosses a pixel is a staircase of the samples: good to about 1 in 1000.
        expected = sampled_pixel_energy(NOISY, i, k, 0.8, 1000)
        np.testing.assert_allclose(quadrant[i, k], expected, rtol=2e-3)


@pytest.mark.parametrize("pitch_mm", [1.0, 0.37, 3.3, 7.0, 79.999999, 80.0, 400.0])
def test_rows_of_pixels_are_the_line_and_energy_is_kept(pitch_mm):
    check_rows_and_energy(one_over_r_profile(40, 1.0, [20.0, 3.0, 1e6]), pitch_mm)


@pytest.mark.parametrize("pitch_mm", [0.37, 1.0, 2.9, 100.0])
def test_rows_of_pixels_are_the_line_for_uneven_noisy_annuli(pitch_mm):
    check_rows_and_energy(NOISY, pitch_mm)


@pytest.mark.slow
def test_rows_and_energy_on_the_skin_grid():
    check_rows_and_energy(one_over_r_profile(1236, 0.034, [0.68, 3.0, 40.0]), 0.034)


@pytest.mark.slow
def test_rows_and_energy_on_the_ketchup_grid():
    profile = one_over_r_profile(3931, 0.03, [0.6, 3.0, 10.0])
    assert profile.quadrant_kernel(0.03).shape == (3932, 3932, 3)
    check_rows_and_energy(profile, 0.03)


def test_centre_pixel_of_a_one_over_r_profile():
    lengths = [20.0, 100.0, 1e6]  # in dr; 20 is the shortest mean free path a grid is made for
    profile = one_over_r_profile(400, 1.0, lengths)
    for pitch_mm in (1.0, 0.5):
        centre = profile.quadrant_kernel(pitch_mm, 0)[0, 0]
        expected = [one_over_r_centre_pixel(pitch_mm, length) for length in lengths]
        np.testing.assert_allclose(centre, expected, rtol=1e-3)
    # The pure 1/r: c p 4 ln(1 + sqrt 2) with F(dr) = 2 pi c dr, 0.561 of F(dr).
    share = profile.quadrant_kernel(1.0, 0)[0, 0, 2] / profile.cumulative[1, 2]
    assert share == pytest.approx(4 * np.log(1 + np.sqrt(2)) / (2 * np.pi), rel=1e-3)


def test_centre_pixel_of_skin1_is_as_its_docstring_says():
    # Scattering more than once adds r log r to F ~ r, which parabolas do not follow.
    skin = load_material("skin1")
    profile, fine = simulate_exact(skin), simulate_exact(skin, dr_mm=0.002, radius_mm=0.4)
    lacks = {2.0: (-0.0011, 0.0), 1.0: (0.0045, 0.0125), 0.5: (0.0105, 0.0275)}
    for annuli, (least, most) in lacks.items():
        pitch_mm = annuli * profile.r_edges_mm[1]
        centre, true = (each.quadrant_kernel(pitch_mm, 0)[0, 0] for each in (profile, fine))
        assert least < (1.0 - centre / true).min()
        assert (1.0 - centre / true).max() < most


def test_pixels_near_the_beam_of_a_one_over_r_profile():
    # Pixels 1 to 9 on the axis at p = dr: 2e-4 off at most with ten annuli subdivided; flat ones
    # from the second on would be 7 % off at pixel 1, from the tenth on 2 % at pixel 9.
    lengths = [20.0, 1e6]
    quadrant = one_over_r_profile(60, 1.0, lengths).quadrant_kernel(1.0, 9)
    for c, length in enumerate(lengths):
        for k in range(1, 10):
            expected, _ = dblquad(
                lambda y, x, length=length: (
                    np.exp(-np.hypot(x, y) / length) / (2 * np.pi * np.hypot(x, y))
                ),
                *(k - 0.5, k + 0.5, -0.5, 0.5),
                epsrel=1e-9,
            )
            assert quadrant[k, 0, c] == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("pitch_mm", [1.0, 2.9])
def test_steps_between_annuli_do_not_show_in_the_pixels(pitch_mm):
    # Flat annuli from the eleventh on put pixels up to 2 % off. Even steps of a twentieth of the
    # decay length are what the paper's grid has.
    quadrant = one_over_r_profile(150, 1.0, [20.0]).quadrant_kernel(pitch_mm, 30, channel=0)
    for i, k in ((7, 0), (12, 9), (16, 3), (20, 20), (30, 1), (30, 24)):
        expected, _ = dblquad(
            lambda y, x: np.exp(-np.hypot(x, y) / 20.0) / (2 * np.pi * np.hypot(x, y)),
            *((i - 0.5) * pitch_mm, (i + 0.5) * pitch_mm),
            *((k - 0.5) * pitch_mm, (k + 0.5) * pitch_mm),
            epsrel=1e-10,
        )
        assert quadrant[i, k] == pytest.approx(expected, rel=2e-4)


def test_flat_annuli_would_starve_the_centre_pixel(monkeypatch):
    monkeypatch.setattr(integrals, "PARTS_PER_ANNULUS", 1)
    profile = one_over_r_profile(40, 1.0, [1e6])
    share = profile.quadrant_kernel(1.0, 0)[0, 0, 0] / profile.cumulative[1, 0]
    # Not 1/pi to the last digit: the pixel's corners reach into the second annulus.
    assert 1 / np.pi - 0.02 < share < 1 / np.pi + 0.01


@pytest.mark.parametrize("pitch_in_sigmas", [0.05, 0.2, 1.0])
def test_gaussian_pixels_are_products_of_error_functions(pitch_in_sigmas):
    # A flat annulus is off its Gaussian density by at most dr max|R'| = dr R(0) exp(-1/2) / sigma,
    # so a pixel is off by at most p^2 times that, wherever it lies.
    dr_mm, sigma_mm = 0.01, 0.5
    edges = np.arange(401) * dr_mm
    profile = make_profile(edges, np.diff(-np.exp(-((edges / sigma_mm) ** 2) / 2))[:, None])
    pitch_mm = pitch_in_sigmas * sigma_mm
    quadrant = profile.quadrant_kernel(pitch_mm, 5, channel=0)
    bound = pitch_mm**2 * dr_mm * np.exp(-0.5) / (2 * np.pi * sigma_mm**3)
    pixel_edges = (np.arange(7) - 0.5) * pitch_mm
    line = np.diff(erf(pixel_edges / sigma_mm / np.sqrt(2))) / 2
    # 8 sigma of the Gaussian are on the grid: 1e-14 of it is cut off.
    np.testing.assert_allclose(quadrant, np.outer(line, line), rtol=0, atol=bound + 1e-13)


def test_finite_profile_keeps_its_density_at_the_beam():
    # Where F ~ r^2, harmonic-mean slopes would put the centre pixel 20 % high at p = dr.
    edges = np.arange(200.0)
    profile = make_profile(edges, np.diff(-np.exp(-((edges / 20) ** 2) / 2))[:, None])
    expected = erf(0.5 / 20 / np.sqrt(2)) ** 2
    assert profile.quadrant_kernel(1.0, 0)[0, 0, 0] == pytest.approx(expected, rel=0.005)


def test_subdivision_keeps_the_energy_of_each_annulus():
    edges, densities = NOISY.flat_annuli()
    energy = densities * (np.pi * np.diff(edges) * (edges[1:] + edges[:-1]))[:, None]
    first = np.searchsorted(edges, NOISY.r_edges_mm[:-1])
    assert np.isin(NOISY.r_edges_mm, edges).all()
    np.testing.assert_allclose(
        np.add.reduceat(energy, first, axis=0), NOISY.annulus_energy, rtol=1e-13
    )


def test_smaller_kernels_are_cut_from_larger_ones():
    whole = NOISY.quadrant_kernel(0.8)
    np.testing.assert_array_equal(NOISY.quadrant_kernel(0.8, 4), whole[:5, :5])
    np.testing.assert_array_equal(NOISY.quadrant_kernel(0.8, 4, channel=1), whole[:5, :5, 1])
    h = len(whole) - 1
    larger = NOISY.line_kernel(0.8, h + 2)
    assert (larger[[0, 1, -2, -1]] == 0).all()
    np.testing.assert_array_equal(larger[2:-2], NOISY.line_kernel(0.8))


def test_full_kernel_mirrors_the_quadrant():
    quadrant = NOISY.quadrant_kernel(0.8, 3)
    full = full_kernel(quadrant)
    assert full.shape == (7, 7, 2)
    np.testing.assert_array_equal(full, full[::-1, ::-1])
    np.testing.assert_array_equal(full[3:, 3:], quadrant)
    np.testing.assert_array_equal(full[:4, 3:], quadrant[::-1])


def test_default_support_is_the_fewest_pixels_that_cover_the_grid():
    profile = make_profile([0.0, 2.5], [[1.0]])
    for pitch_mm, half in ((1.0, 2), (0.999999, 3), (5.0, 0), (4.999999, 1), (1e9, 0)):
        assert len(profile.line_kernel(pitch_mm)) == 2 * half + 1


energies = arrays(
    np.float64,
    st.tuples(st.integers(1, 25), st.integers(1, 3)),
    elements=st.one_of(st.just(0.0), st.floats(1e-12, 1.0)),
)


@given(energy=energies, pixels_across=st.floats(0.2, 40), data=st.data())
@settings(max_examples=60, deadline=None)
def test_any_profile_gives_a_symmetric_nonnegative_kernel_of_its_energy(
    energy, pixels_across, data
):
    widths = data.draw(
        st.lists(st.floats(0.01, 10), min_size=len(energy), max_size=len(energy)), label="widths"
    )
    profile = make_profile(np.concatenate(([0.0], np.cumsum(widths))), energy)
    pitch_mm = profile.r_edges_mm[-1] / pixels_across
    quadrant, line = profile.quadrant_kernel(pitch_mm), profile.line_kernel(pitch_mm)
    assert (quadrant >= 0).all()
    assert (line >= 0).all()
    np.testing.assert_array_equal(quadrant, quadrant.swapaxes(0, 1))
    half_line = line[len(line) // 2 :]
    np.testing.assert_allclose(row_sums(quadrant), half_line, rtol=1e-9, atol=1e-22)
    np.testing.assert_allclose(kernel_energy(quadrant), energy.sum(axis=0), rtol=1e-9)


@pytest.mark.parametrize("integral", ["line_kernel", "quadrant_kernel"])
@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((float("nan"),), "mm_per_pixel = nan"),
        ((0.0,), "positive"),
        ((-1.0,), "positive"),
        ((float("inf"),), "finite"),
        (("wide",), "number"),
        ((1.0, -1), "half_pixels = -1"),
        ((1.0, 2.5), "whole number"),
        ((1.0, 10**9), "bytes"),
        ((1.0, 10**400), "bytes"),
        ((1e-300,), "bytes"),
    ],
)
def test_pixel_arguments_are_refused_in_one_line(integral, arguments, said):
    with pytest.raises(ProfileError, match=said) as error:
        getattr(NOISY, integral)(*arguments)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("channel", [-1, 2, 0.5])
def test_channel_that_is_not_there_is_refused(channel):
    with pytest.raises(ProfileError, match="expected 0 to 1"):
        NOISY.quadrant_kernel(1.0, channel=channel)


@pytest.mark.parametrize("radii", [1, 4])
def test_compiled_code_gets_as_many_radii_as_densities(radii):
    with pytest.raises(ValueError, match=f"{radii} radii and 3 densities; expected as many"):
        pixel_energy.line_energy(np.arange(1.0, 1.0 + radii), np.ones((3, 2)), 0.5, 2)
