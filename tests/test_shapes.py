"""Gaussians and normalised diffusion: published figures, quadrature, inverses."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from sssfit import shapes

RADII = [1e-9, 1e-4, 0.1, 1.0, 3.0, 10.0, 40.0]


def disk_energy(density, r):
    """The energy of a density within r, by quadrature in the plane, cut where scales change."""
    cuts = [0.0, *(each for each in (1e-3, 0.3, 3.0, 12.0) if each < r), r]
    return sum(
        quad(lambda t: 2.0 * math.pi * t * density(t), a, b, epsabs=0, epsrel=1e-12)[0]
        for a, b in pairwise(cuts)
    )


@pytest.mark.parametrize("v", [0.0064, 1.0, 7.41])
@pytest.mark.parametrize("r", RADII)
def test_gaussian_disk(r, v):
    expected = disk_energy(lambda t: float(shapes.gaussian_density(t, v)), r)
    assert shapes.gaussian_cdf(r, v) == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize("x", [0.0, 0.4, -2.0])
def test_gaussian_marginal_is_the_density_along_a_line(x):
    line, _ = quad(lambda y: float(shapes.gaussian_density(math.hypot(x, y), 1.7)), -40, 40)
    assert shapes.gaussian_marginal(x, 1.7) == pytest.approx(line, rel=1e-10)


@pytest.mark.parametrize(
    ("left", "right"), [(-0.05, 0.05), (0.0, 1e-6), (0.9, 1.1), (-3.5, -2.5), (9.0, 11.0), (-1, 2)]
)
def test_gaussian_line_integral_against_quadrature(left, right):
    expected, _ = quad(
        lambda x: float(shapes.gaussian_marginal(x, 0.7)), left, right, epsabs=0, epsrel=1e-13
    )
    assert shapes.gaussian_line_integral(left, right, 0.7) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("s", [0.2, 1.0, 9.0])
@pytest.mark.parametrize("r", RADII)
def test_diffusion_disk(r, s):
    expected = disk_energy(lambda t: float(shapes.diffusion_density(t, s)), r)
    assert shapes.diffusion_cdf(r, s) == pytest.approx(expected, rel=1e-10)
    assert shapes.diffusion_beyond(r, s) == pytest.approx(1.0 - expected, abs=1e-11)


def test_diffusion_has_the_figures_of_its_closed_form():
    assert shapes.diffusion_cdf(16.0, 1.0) == pytest.approx(0.99637901, abs=5e-9)
    assert shapes.diffusion_radius(0.5, 1.0) == pytest.approx(1.55218, abs=5e-6)
    assert shapes.diffusion_radius(0.9, 1.0) == pytest.approx(6.06223, abs=5e-6)
    assert shapes.diffusion_radius([0.0, 1.0], 2.0).tolist() == [0.0, math.inf]
    assert np.isnan(shapes.diffusion_radius([-0.1, 1.1, math.nan], 1.0)).all()


@given(st.floats(1e-300, 1.0 - 1e-12), st.floats(1e-6, 1e6))
def test_diffusion_radius_inverts_the_cdf(share, s):
    r = shapes.diffusion_radius(share, s)
    assert shapes.diffusion_cdf(r, s) == pytest.approx(share, rel=1e-13)


@given(st.floats(1e-15, 1e-3))
def test_diffusion_radius_is_as_good_in_the_tail(beyond):
    r = shapes.diffusion_radius(1.0 - beyond, 1.0)
    assert shapes.diffusion_beyond(r, 1.0) == pytest.approx(1.0 - (1.0 - beyond), rel=1e-13)


@pytest.mark.parametrize("x", [0.02, 0.5, 3.0, -3.0, 20.0])
def test_diffusion_marginal_is_the_density_along_a_line(x):
    def on_line(t):  # y = |x| sinh t
        return float(shapes.diffusion_density(abs(x) * math.cosh(t), 1.3)) * abs(x) * math.cosh(t)

    line = 2.0 * quad(on_line, 0.0, 12.0, epsabs=0, epsrel=1e-12, limit=200)[0]
    assert shapes.diffusion_marginal(x, 1.3) == pytest.approx(line, rel=1e-10)


def test_diffusion_marginal_has_its_second_moment_and_unit_energy():
    s = 1.7
    moment, _ = quad(lambda x: 2.0 * x * x * shapes.diffusion_marginal(x, s), 0.0, 60.0)
    assert moment == pytest.approx(7.0 / s**2, rel=1e-8)
    assert shapes.diffusion_line_integral(-np.inf, np.inf, s) == 1.0
    assert np.isinf(shapes.diffusion_marginal(0.0, s))


@pytest.mark.parametrize("s", [0.1, 1.0, 30.0])
@pytest.mark.parametrize(
    ("left", "right"),
    [(0.0, 1e-6), (0.0, 0.05), (-0.05, 0.05), (0.1, 0.9), (0.9, 1.1), (-3.5, -2.5), (9.0, 70.0)],
)
def test_diffusion_line_integral_against_quadrature(left, right, s):
    def marginal(x):
        return float(shapes.diffusion_marginal(x, s))

    # t^3 in place of x takes the logarithm at 0 to where quadrature does not see it
    def grown(x):
        root = abs(x) ** (1.0 / 3.0)
        cuts = np.linspace(0.0, root, 30)
        return math.copysign(
            sum(
                quad(lambda t: 3.0 * t * t * marginal(t**3), a, b, epsabs=0, epsrel=1e-12)[0]
                for a, b in pairwise(cuts)
            ),
            x,
        )

    expected = grown(right) - grown(left)
    assert shapes.diffusion_line_integral(left, right, s) == pytest.approx(expected, abs=1e-11)


def test_diffusion_line_integral_keeps_digits_in_the_tail_and_adds_up():
    x = np.array([30.0, 31.0, 500.0, 501.0])
    far = shapes.diffusion_line_integral(x[::2], x[1::2], 1.0)
    direct = [
        quad(lambda t: float(shapes.diffusion_marginal(t, 1.0)), a, a + 1.0, epsabs=0)[0]
        for a in x[::2]
    ]
    np.testing.assert_allclose(far, direct, rtol=1e-12)
    edges = np.linspace(-40.5, 40.5, 82)
    pixels = shapes.diffusion_line_integral(edges[:-1], edges[1:], 0.7)
    np.testing.assert_array_equal(pixels, pixels[::-1])
    whole = shapes.diffusion_line_integral(-40.5, 40.5, 0.7)
    assert pixels.sum() == pytest.approx(float(whole), rel=1e-14)
