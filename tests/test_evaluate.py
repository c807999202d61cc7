"""A kernel on a picture: what counts, what is left black, what is timed."""

import numpy as np
import pytest
from checks import medium

from sssfit.compare import measure, radial_asymmetry
from sssfit.compare.evaluate import evaluate, timed
from sssfit.errors import RenderError
from sssfit.fit import fit_svd
from sssfit.profile import full_kernel
from sssfit.render.reference import render_reference
from sssfit.render.separable import render_separable
from sssfit.scene.made import make_scene
from sssfit.scene.record import Scene
from sssfit.simulate import simulate_dipole


@pytest.fixture(scope="module")
def profile():
    return simulate_dipole(medium([0.03, 0.1, 0.3], [2.0, 2.0, 2.0], 1.3), dr_mm=0.1)


@pytest.fixture(scope="module")
def kernel(profile):
    return fit_svd(profile, rank=2, mm_per_pixel=0.4).kernel


def masked_scene():
    """Light everywhere, an object in the middle."""
    mask = np.zeros((30, 24), dtype=int)
    mask[8:20, 6:16] = 1
    light = np.random.default_rng(5).random((30, 24, 1))
    return Scene("masked", light, 0.4, mask=mask)


def test_only_the_object_counts_and_is_shown(profile, kernel):
    scene = masked_scene()
    found = evaluate(scene, kernel, profile)
    picture, truth = render_separable(scene, kernel), render_reference(scene, profile)
    wanted = measure(picture, truth, mask=scene.mask)
    whole = measure(picture, truth)
    assert found.score.rmse == wanted.rmse
    assert found.score.rmse != whole.rmse
    inside = scene.mask > 0
    for shown, rendered in ((found.picture, picture), (found.truth, truth)):
        np.testing.assert_array_equal(shown[inside], rendered[inside])
        assert not shown[~inside].any()


def test_asymmetry_stands_beside_that_of_the_true_kernel(profile, kernel):
    found = evaluate(make_scene("disk", height=16, width=16, mm_per_pixel=0.4), kernel, profile)
    quadrants = profile.quadrant_kernel(0.4, kernel.half_pixels)
    for c in range(len(kernel.channels)):
        assert found.asymmetry[c] == radial_asymmetry(kernel.full(c), from_pixels=4)
        true = radial_asymmetry(full_kernel(quadrants[:, :, c]), from_pixels=4)
        assert found.true_asymmetry[c] == true
        assert true < found.asymmetry[c]


def test_small_kernels_have_no_asymmetry(profile):
    small = fit_svd(profile, rank=1, mm_per_pixel=4.0, energy="keep").kernel
    assert small.half_pixels < 4
    scene = make_scene("disk", height=16, width=16, mm_per_pixel=4.0)
    found = evaluate(scene, small, profile)
    assert np.isnan(found.asymmetry).all()
    assert np.isnan(found.true_asymmetry).all()


def test_without_a_profile_only_the_cost_is_known(kernel):
    found = evaluate(make_scene("edge", height=16, width=16, mm_per_pixel=0.4), kernel)
    assert found.truth is None
    assert found.score is None
    assert found.cost.passes == 4
    assert np.isnan(found.true_asymmetry).all()


def test_a_profile_of_other_channels_is_refused(kernel):
    scene = make_scene("edge", height=16, width=16, mm_per_pixel=0.4)
    other = simulate_dipole(medium([0.03, 0.1], [2.0, 2.0], 1.3), dr_mm=0.1)
    with pytest.raises(RenderError, match="fitted to"):
        evaluate(scene, kernel, other)


def test_a_corner_goes_first_and_is_not_the_picture():
    scene = masked_scene()
    sizes = []

    def render(shown):
        sizes.append((shown.height, shown.width, shown.mask.shape))
        return shown.irradiance

    picture, seconds = timed(render, scene)
    assert sizes[0] == (8, 8, (8, 8))
    assert sizes[1:] == [(30, 24, (30, 24))] * (len(sizes) - 1)
    assert len(sizes) == 6  # quick: three more and one before them
    assert picture is scene.irradiance
    assert seconds > 0.0
