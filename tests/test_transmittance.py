"""Light through slabs: closed cases, the kernel's own Gaussians, and where it is added."""

import math

import numpy as np
import pytest
from test_screen import DISTANCE_MM, make_kernel, make_scene

from sssfit.errors import RenderError
from sssfit.render.screen import render_screen
from sssfit.render.transmittance import gaussians_of, transmittance
from sssfit.shapes import SKIN_VARIANCES_MM2, SKIN_WEIGHTS

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


def test_kernels_without_gaussians_are_refused():
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
