"""Light through slabs: closed cases, the kernel's own Gaussians, and where it is added."""

import math

import numpy as np
import pytest
from scipy.integrate import quad
from test_screen import DISTANCE_MM, make_kernel, make_scene

from sssfit.errors import RenderError
from sssfit.fit import METHODS, fit_preintegrated, fit_svd
from sssfit.material import load_material
from sssfit.render.screen import render_screen
from sssfit.render.transmittance import (
    PUBLISHED,
    beyond,
    gaussians_of,
    through,
    transmittance,
    transmitted,
    with_transmitted,
)
from sssfit.shapes import SKIN_VARIANCES_MM2, SKIN_WEIGHTS
from sssfit.simulate import simulate_deon_skin, simulate_exact

ARTIST = {"near_mm2": 0.5, "far_mm2": 4.0, "weight": 0.3, "depth_variance_mm2": 4.0}
FITTED = {"variances_mm2": [0.1, 2.0], "weights": [0.3, 0.1], "relative_error": 0.0}


def kernel_of(parameters):
    """Three channels; energies .25."""
    return make_kernel(
        np.full((1, 1, 3), 0.5), parameters=dict(zip("RGB", parameters, strict=True))
    )


def test_skin_term_by_term():
    variances = np.repeat(np.array(SKIN_VARIANCES_MM2)[:, None], 3, axis=1)
    through = transmittance([0.0, 0.7, 3.0, math.inf], variances, SKIN_WEIGHTS)
    assert through.shape == (4, 3)
    # The table's weights add up to 1 in each channel, blue's but for rounding.
    np.testing.assert_allclose(through[0], 1.0, atol=1e-12)
    for row, s in zip(through, (0.0, 0.7, 3.0, math.inf), strict=True):
        for c in range(3):
            literal = sum(
                SKIN_WEIGHTS[i][c] * math.exp(-s * s / (2 * SKIN_VARIANCES_MM2[i]))
                for i in range(6)
            )
            assert row[c] == pytest.approx(literal, rel=1e-13, abs=1e-300)
    assert through[2, 0] > through[2, 1] > through[2, 2]  # ears are red


def test_shares_add_up_to_one():
    variances, shares = gaussians_of(kernel_of([FITTED, ARTIST, FITTED]))
    np.testing.assert_allclose(shares.sum(axis=0), 1.0, rtol=1e-15)
    np.testing.assert_allclose(shares[:, 0], [0.75, 0.25])
    np.testing.assert_array_equal(variances[:, 1], [0.5, 4.0])
    np.testing.assert_allclose(shares[:, 1], [0.3, 0.7])


def test_channels_with_fewer_gaussians():
    one = {"variances_mm2": [3.0], "weights": [0.2]}
    through = transmittance([1.0], *gaussians_of(kernel_of([FITTED, one, FITTED])))
    assert through[0, 1] == pytest.approx(math.exp(-1 / 6), rel=1e-15)


def test_a_dark_channel_lets_nothing_through():
    weights = np.full((1, 1, 3), 0.5)
    weights[..., 1] = 0.0
    kernel = make_kernel(weights, parameters={"R": FITTED, "B": FITTED})
    through = transmittance(0.0, *gaussians_of(kernel))
    np.testing.assert_allclose(through, [1.0, 0.0, 1.0], rtol=1e-15, atol=0)


def test_the_published_listing_has_the_variance_once_in_its_exponent():
    # Jimenez et al. 2010: exp(-d * d / v), which is ours at a thickness of sqrt 2 d.
    s = np.array([0.0, 0.5, 2.0])
    variances, weights = np.array([[0.5], [4.0]]), np.array([[0.3], [0.7]])
    listing = transmittance(s, variances, weights, widths=PUBLISHED)[:, 0]
    np.testing.assert_allclose(
        listing, [0.3 * math.exp(-d * d / 0.5) + 0.7 * math.exp(-d * d / 4.0) for d in s]
    )
    ours = transmittance(s * math.sqrt(2.0), variances, weights)[:, 0]
    np.testing.assert_allclose(listing, ours, rtol=1e-13)
    with pytest.raises(RenderError, match="widths = 0; expected a number above 0"):
        transmittance(s, variances, weights, widths=0.0)


def test_what_lies_beyond_is_by_quadrature_what_abel_has():
    # a(x) constant in each pixel: 2 int_s a(x) x / sqrt(x^2 - s^2) dx, with t^2 = x^2 - s^2.
    line = np.array([0.02, 0.1, 0.3, 0.16, 0.3, 0.1, 0.02])
    kernel = make_kernel(line[None, :, None], pitch_mm=0.5)
    density = line / line.sum() / 0.5
    for s in (0.0, 0.1, 0.25, 0.6, 1.3, 1.7499, 1.75, 9.0):
        reach = math.sqrt(max(1.75**2 - s * s, 0.0))
        kinks = [math.sqrt(x * x - s * s) for x in (0.25, 0.75, 1.25) if x > s]

        def integrand(t, s=s):
            x = math.hypot(t, s)
            return 2.0 * density[min(int(x / 0.5 + 0.5), 3) + 3]

        expected = quad(integrand, 0.0, reach, points=kinks or None)[0] if reach else 0.0
        assert beyond(kernel, s)[0] == pytest.approx(expected, abs=1e-9)
    assert beyond(kernel, np.inf)[0] == 0.0


def test_any_kernel_of_gaussians_has_their_transmittance():
    # Made of pixels and not of variances: what one Gaussian has beyond s is exp(-s^2 / 2v).
    profile = simulate_deon_skin()
    s = np.array([0.0, 0.1, 0.5, 1.0, 2.0, 4.0, 8.0])
    wanted = transmittance(s, np.repeat(np.array(SKIN_VARIANCES_MM2)[:, None], 3, 1), SKIN_WEIGHTS)
    line = fit_preintegrated(profile, mm_per_pixel=0.02, support_mm=14.0).kernel
    terms = fit_svd(profile, rank=8, mm_per_pixel=0.02, support_mm=12.0).kernel
    for kernel in (line, terms):
        apart = np.abs(through(kernel, s) - wanted).max(axis=1)
        # At .1 mm the narrowest Gaussian shows, whose deviation is four of these pixels.
        assert (apart < np.where(s == 0.1, 7e-3, 4e-4)).all()


@pytest.mark.filterwarnings("ignore::sssfit.errors.SssfitWarning")
@pytest.mark.parametrize("method", METHODS)
def test_every_method_lets_light_through_about_as_its_profile_does(method):
    # The share of a material's light that leaves beyond s, by F; kernels are more or less near it.
    profile = simulate_exact(load_material("skin1"))
    kernel = METHODS[method].fit(profile, mm_per_pixel=0.2, support_mm=20.0).kernel
    s = np.array([0.0, 0.5, 1.0, 2.0, 4.0])
    wanted = 1.0 - profile.cumulative_at(s) / profile.diffuse_reflectance
    found = through(kernel, s)
    np.testing.assert_allclose(found[0], 1.0, atol=1e-12)
    assert (np.diff(found, axis=0) < 0.0).all()
    # Measured: .013, .016, .053, .084; one pass and not a round kernel: .14, .13, .15.
    known = {"preintegrated": 0.015, "burley": 0.02, "svd": 0.06, "gaussians": 0.09}
    np.testing.assert_allclose(found, wanted, atol=known.get(method, 0.16))


def test_terms_of_minus_sign_take_no_light_away():
    wide, narrow = (np.exp(-((np.arange(-40, 41) * 0.1) ** 2) / (2 * v)) for v in (0.5, 2.0))
    passes = np.stack([wide / wide.sum(), 0.9 * narrow / narrow.sum()])[..., None]
    kernel = make_kernel(passes, signs=np.array([[1.0], [-1.0]]), pitch_mm=0.1)
    assert (beyond(kernel, np.linspace(0.0, 6.0, 50)) >= 0.0).all()


def test_a_scene_takes_up_what_comes_through():
    kernel = make_kernel(np.full((1, 1, 3), 0.5), parameters=dict.fromkeys("RGB", FITTED))
    front, back = np.full((2, 2, 1), 0.25), np.array([[[0.0], [1.0]], [[2.0], [0.5]]])
    scene = make_scene(front, thickness_mm=np.full((2, 2), 1.0), back_irradiance=back)
    joined = with_transmitted(scene, kernel)
    literal = 0.75 * math.exp(-1 / 0.2) + 0.25 * math.exp(-1 / 4.0)
    np.testing.assert_allclose(joined.irradiance, 0.25 + back * literal * np.ones(3), rtol=1e-14)
    assert joined.thickness_mm is None
    assert joined.back_irradiance is None
    np.testing.assert_allclose(render_screen(joined, kernel), render_screen(scene, kernel))
    with pytest.raises(RenderError, match="test has no thickness and no light behind it"):
        with_transmitted(joined, kernel)


@pytest.mark.parametrize("channels", [2, 4])
def test_light_from_behind_has_the_kernels_channels_or_one(channels):
    kernel = make_kernel(np.full((1, 1, 3), 0.5), parameters=dict.fromkeys("RGB", FITTED))
    front, back = np.ones((2, 2, 1)), np.ones((2, 2, channels))
    scene = make_scene(front, thickness_mm=np.ones((2, 2)), back_irradiance=back)
    for function in (transmitted, with_transmitted):
        with pytest.raises(RenderError, match=f"2, {channels}.* for a kernel of 3 channels; exp"):
            function(scene, kernel)


def test_light_from_behind_joins_before_the_blur():
    rng = np.random.default_rng(3)
    pass_ = np.array([0.2, 0.5, 0.2])[None, :, None] * np.ones(3)
    kernel = make_kernel(pass_, parameters=dict.fromkeys("RGB", FITTED))
    front, back = rng.random((5, 6, 3)), rng.random((5, 6, 1))
    thickness = rng.uniform(0.0, 5.0, (5, 6))
    out = render_screen(make_scene(front, thickness_mm=thickness, back_irradiance=back), kernel)
    literal = 0.75 * np.exp(-(thickness**2) / 0.2) + 0.25 * np.exp(-(thickness**2) / 4.0)
    joined = render_screen(make_scene(front + back * literal[..., None]), kernel)
    np.testing.assert_allclose(out, joined, rtol=1e-13)
    # A slab without thickness is lit from behind as from the front, diffuse reflectance once.
    thin = make_scene(0 * front, thickness_mm=0 * thickness, back_irradiance=np.ones((5, 6, 1)))
    np.testing.assert_allclose(render_screen(thin, kernel), 0.9**2, rtol=1e-13)


def test_what_is_no_object_has_nothing_behind_it():
    mask = np.array([[0, 1]])
    scene = make_scene(
        np.full((1, 2, 1), 0.5),
        DISTANCE_MM,
        mask=mask,
        thickness_mm=np.zeros((1, 2)),
        back_irradiance=np.ones((1, 2, 1)),
    )
    out = render_screen(scene, kernel_of([FITTED] * 3))
    np.testing.assert_allclose(out[0], [[0.5] * 3, [1.5 * 0.25] * 3])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((1.0, [1.0], [1.0]), "expected the same"),
        ((1.0, [[1.0]], [[1.0, 2.0]]), "expected the same"),
        ((1.0, [[0.0]], [[1.0]]), "above 0"),
        ((1.0, [[1.0]], [[math.nan]]), "above 0"),
        ((-1.0, [[1.0]], [[1.0]]), "negative or NaN"),
        (([1.0, math.nan], [[1.0]], [[1.0]]), "negative or NaN"),
    ],
)
def test_bad_figures_are_one_line(arguments, words):
    with pytest.raises(RenderError, match=words):
        transmittance(*arguments)


def test_gaussians_that_are_not_there_are_refused():
    with pytest.raises(RenderError, match='method "by hand" has no Gaussians'):
        gaussians_of(kernel_of([{}] * 3))
    cancelled = {"variances_mm2": [1.0, 2.0], "weights": [0.5, -0.5]}
    with pytest.raises(RenderError, match=r"channel G: .* no sum above 0"):
        gaussians_of(kernel_of([FITTED, cancelled, FITTED]))


@pytest.mark.parametrize("field", ["thickness_mm", "back_irradiance"])
def test_one_buffer_alone_is_refused(field):
    value = np.ones((2, 2)) if field == "thickness_mm" else np.ones((2, 2, 1))
    scene = make_scene(np.ones((2, 2, 1)), **{field: value})
    with pytest.raises(RenderError, match="give both or neither"):
        render_screen(scene, kernel_of([FITTED] * 3))
