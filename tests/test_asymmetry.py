"""How far a point response is from round, against closed forms, sums and real kernels."""

import numpy as np
import pytest
from scipy.special import erf, ive

from sssfit.compare import asymmetry_by_radius, radial_asymmetry
from sssfit.errors import RenderError
from sssfit.fit import fit_svd
from sssfit.material import load_material
from sssfit.profile import full_kernel
from sssfit.simulate import simulate_exact


def offsets(half):
    return np.arange(-half, half + 1.0)


@pytest.mark.parametrize(("sigma", "floor"), [(3.0, 5.7e-5), (6.0, 3.1e-6)])
def test_a_gaussian_on_pixels_is_round_to_the_stated_floor(sigma, floor):
    edges = np.append(offsets(int(5 * sigma)) - 0.5, int(5 * sigma) + 0.5)
    line = np.diff(erf(edges / (np.sqrt(2) * sigma))) / 2
    assert radial_asymmetry(np.outer(line, line)) < floor


def test_an_oval_gaussian_has_the_closed_form():
    """K = exp(-p x^2 - q y^2): with d = (p - q) / 2, mean = exp(-(p + q) r^2 / 2) I_0(d r^2)."""
    p, q, half = 1 / (2 * 8.0**2), 1 / (2 * 11.0**2), 40
    x = offsets(half)
    response = np.exp(-p * x**2 - q * x[:, None] ** 2)
    r = np.arange(1, half + 1.0)
    d = (p - q) / 2
    mean = np.exp(-(p + q) * r**2 / 2 + d * r**2) * ive(0, d * r**2)
    mean_square = np.exp(-(p + q) * r**2 + 2 * d * r**2) * ive(0, 2 * d * r**2)
    variance = mean_square - mean**2
    expected = np.sqrt(r @ variance / (r @ mean_square))
    assert expected > 0.1
    assert radial_asymmetry(response) == pytest.approx(expected, rel=1e-4)
    # Circles of 5 pixels and more; further in the variance is nothing but rounding of the spline.
    by_radius = np.sqrt(variance / mean_square)
    np.testing.assert_allclose(asymmetry_by_radius(response)[4:], by_radius[4:], rtol=1e-2)
    expected = np.sqrt(r[9:] @ variance[9:] / (r[9:] @ mean_square[9:]))
    assert radial_asymmetry(response, from_pixels=10) == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("length", [10.0, 20.0, 40.0])
def test_a_separable_exponential_has_what_a_sum_over_angles_gives(length):
    half = int(3 * length)
    line = np.exp(-np.abs(offsets(half)) / length)
    r = np.arange(1, half + 1.0)
    angles = (np.arange(10_000) + 0.5) * (np.pi / 2 / 10_000)
    values = np.exp(-r[:, None] * (np.cos(angles) + np.sin(angles)) / length)
    mean, mean_square = values.mean(axis=1), np.mean(values**2, axis=1)
    expected = np.sqrt(r @ (mean_square - mean**2) / (r @ mean_square))
    # The spline rounds the edges on the axes: a share of the order of 1 / length of K, within a
    # pixel or so on either side, which is the same share of a circle again.
    limit = 4.0 / length**2
    assert radial_asymmetry(np.outer(line, line)) == pytest.approx(expected, rel=limit)


def test_skin1_becomes_round_with_the_rank():
    profile = simulate_exact(load_material("skin1"))
    found = {}
    for rank in (1, 2, 3, 4, 6):
        fitted = fit_svd(profile, rank=rank, energy="keep", mm_per_pixel=0.1, support_mm=10.0)
        kernel = fitted.kernel
        found[rank] = [radial_asymmetry(kernel.full(c), from_pixels=4) for c in range(3)]
    figures = np.array(list(found.values()))
    assert (figures[0] > 0.6).all()
    assert (np.diff(figures, axis=0) < 0.0).all()
    quadrants = profile.quadrant_kernel(0.1, 100)
    true = [radial_asymmetry(full_kernel(quadrants[..., c]), from_pixels=4) for c in range(3)]
    assert (figures > true).all()
    np.testing.assert_allclose(figures[-1], true, rtol=0, atol=3e-3)


def test_the_figure_is_of_the_shape_alone():
    response = np.random.default_rng(4).random((9, 9))
    expected = radial_asymmetry(response)
    assert 0.0 < expected < 1.0
    assert radial_asymmetry(1e-200 * response) == pytest.approx(expected, rel=1e-12)
    assert radial_asymmetry(np.rot90(response)) == pytest.approx(expected, rel=1e-9)
    assert radial_asymmetry(np.zeros((5, 5))) == 0.0
    assert not asymmetry_by_radius(np.zeros((5, 5))).any()


@pytest.mark.parametrize(
    ("response", "changes", "fragment"),
    [
        (np.ones((5, 7)), {}, "a point response of shape (5, 7); expected one channel, square"),
        (np.ones((4, 4)), {}, "expected one channel, square, with an odd number of pixels"),
        (np.ones((5, 5, 3)), {}, "a point response of shape (5, 5, 3); expected one channel"),
        (np.ones((1, 1)), {}, "a point response of one pixel has no angles"),
        (np.full((3, 3), np.nan), {}, "a point response holds NaN or infinite values"),
        (np.ones((5, 5)), {"from_pixels": 3}, "from_pixels = 3; expected 1 to 2 for this size."),
        (np.ones((5, 5)), {"from_pixels": 0}, "from_pixels = 0; expected 1 to 2 for this size."),
    ],
)
def test_what_is_no_point_response_is_one_clear_line(response, changes, fragment):
    with pytest.raises(RenderError) as raised:
        radial_asymmetry(response, **changes)
    assert fragment in str(raised.value)
