"""The true convolution by FFT: against a direct loop, its own kernel, and what is conserved."""

import numpy as np
import pytest
from reference_pixels import make_profile, one_over_r_profile
from reference_render import convolve_directly, place, random_quadrant

from sssfit.errors import RenderError
from sssfit.profile import full_kernel
from sssfit.render import borders as shared
from sssfit.render.borders import BORDERS, source_indices
from sssfit.render.reference import convolve, reference_quadrant, render_reference
from sssfit.scene.record import Scene

borders = pytest.mark.parametrize("border", BORDERS)
EPS = np.finfo(np.float64).eps


def rounding(picture, quadrant):
    """What an FFT may be off: eps log2(n) times the root of the energies of both, and some room.

    Schatzman, "Accuracy of the discrete Fourier transform and the fast Fourier transform", 1996:
    the relative error in the L2 norm grows like eps log n.
    """
    kernel = full_kernel(quadrant)
    reach = 2 * len(kernel) + max(picture.shape)
    # A pixel of the continued picture is one of the picture's, at most its largest.
    norm = np.abs(picture).max() * reach * np.sqrt((kernel**2).sum(axis=(0, 1)).max())
    return 2.0 * EPS * np.log2(reach * reach) * norm


@borders
@pytest.mark.parametrize("size", [1, 2, 5])
@pytest.mark.parametrize("beyond", [0, 1, 4, 13])
def test_borders_are_what_the_arithmetic_says_and_what_numpy_pads(border, size, beyond):
    found = source_indices(size, beyond, border)
    by_hand = [place(i, size, border) for i in range(-beyond, size + beyond)]
    assert found.tolist() == [size if i is None else i for i in by_hand]
    mode = {"mirror": "symmetric", "clamp": "edge", "zero": "constant"}[border]
    padded = np.pad(np.arange(1, size + 1), beyond, mode=mode)
    assert (np.append(np.arange(1, size + 1), 0)[found] == padded).all()


@borders
@pytest.mark.parametrize(
    ("height", "width", "half", "given", "channels"),
    [
        (6, 9, 2, 3, 3),
        (7, 4, 3, 1, 2),  # one channel serves all
        (5, 3, 8, 2, 2),  # wider than the picture, many reflections
        (1, 8, 3, 1, 1),  # one row
        (8, 1, 2, 1, 1),  # one column
        (1, 1, 0, 1, 1),
        (1, 1, 3, 5, 5),
        (4, 6, 1, 5, 5),
        (3, 5, 0, 1, 2),  # nothing but the middle
    ],
)
def test_convolution_equals_the_direct_loop(border, height, width, half, given, channels):
    picture = np.random.default_rng(1).random((height, width, given))
    quadrant = random_quadrant(half, channels, seed=2)
    found = convolve(picture, quadrant, border=border, threads=1)
    expected = convolve_directly(picture, full_kernel(quadrant), border)
    assert found.shape == (height, width, channels)
    assert np.abs(found - expected).max() <= rounding(picture, quadrant)


@borders
@pytest.mark.parametrize(("height", "width"), [(11, 15), (12, 14)])
def test_impulse_response_is_the_kernel(border, height, width):
    quadrant = random_quadrant(4, 3, seed=3)
    picture = np.zeros((height, width, 1))
    picture[5, 6] = 2.0
    found = convolve(picture, quadrant, border=border)
    expected = np.zeros((height, width, 3))
    expected[1:10, 2:11] = 2.0 * full_kernel(quadrant)
    assert np.abs(found - expected).max() <= rounding(picture, quadrant)


def test_a_constant_picture_stays_constant_between_mirrors():
    whole = one_over_r_profile(40, 0.1, [0.5, 1.5])
    profile = make_profile(whole.r_edges_mm, whole.annulus_energy, beyond_grid=[0.25, 0.125])
    scene = Scene("even", np.full((23, 30, 1), 3.0), 0.2)
    quadrant, left_out = reference_quadrant(profile, 0.2, 23, 30)
    energy = full_kernel(quadrant).sum(axis=(0, 1))
    assert quadrant.shape == (21, 21, 2)  # 4 mm: the whole grid
    assert energy == pytest.approx(profile.total_on_grid, rel=1e-13)
    assert left_out == pytest.approx(profile.beyond_grid, abs=1e-13)
    # What lies beyond the grid comes back too.
    for border in ("mirror", "clamp"):
        found = render_reference(scene, profile, border=border)
        kept = np.broadcast_to(3.0 * profile.diffuse_reflectance, (23, 30, 2))
        assert found == pytest.approx(kept, rel=1e-12)
    # Black borders take light away, and with mirrors none is lost whatever the picture.
    dark = render_reference(scene, profile, border="zero")
    assert (dark[0, 0] < 0.5 * dark[11, 15]).all()
    noise = Scene("noise", np.random.default_rng(4).random((23, 30, 2)), 0.2)
    total = render_reference(noise, profile).sum(axis=(0, 1))
    whole = noise.irradiance.sum(axis=(0, 1)) * profile.diffuse_reflectance
    assert total == pytest.approx(whole, rel=1e-12)


def test_a_small_picture_sees_a_part_of_the_kernel_and_the_rest_is_told():
    whole = one_over_r_profile(40, 0.1, [0.5, 1.5])
    profile = make_profile(whole.r_edges_mm, whole.annulus_energy, beyond_grid=[0.25, 0.125])
    quadrant, left_out = reference_quadrant(profile, 0.01, 5, 9)
    assert quadrant.shape == (256, 256, 2)  # of 401
    energy = full_kernel(quadrant).sum(axis=(0, 1))
    assert left_out + energy == pytest.approx(profile.diffuse_reflectance, rel=1e-13)
    assert (left_out > profile.beyond_grid + 1e-3).all()
    # Black borders: the part that is left out changes no pixel.
    scene = Scene("small", np.random.default_rng(5).random((5, 9, 2)), 0.01)
    found = render_reference(scene, profile, border="zero")
    expected = convolve(scene.irradiance, profile.quadrant_kernel(0.01), border="zero")
    assert found == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("border", ["mirror", "clamp"])
def test_light_from_far_away_is_the_mean_of_the_continuation(border):
    """A profile's outer annulus, cut off and put beyond the grid, comes back all but the same."""
    edges = np.array([0.0, 0.2, 1.0, 60.0])
    whole = make_profile(edges, np.array([[0.1], [0.2], [0.3]]))
    cut = make_profile(edges[:3], np.array([[0.1], [0.2]]), beyond_grid=[0.3])
    scene = Scene("small", np.random.default_rng(5).random((6, 8, 1)), 0.25)
    true = render_reference(scene, whole, border=border)
    found = render_reference(scene, cut, border=border)
    # The picture's own rows and columns, continued, are 2 R (W + H) of the annulus's pi R^2: 3.7 %.
    assert found == pytest.approx(true, abs=0.037 * 0.3)
    assert np.abs(found - render_reference(scene, cut, border="zero")).min() > 0.1


def test_rounding_leaves_no_negative_light():
    profile = one_over_r_profile(40, 0.1, [0.5, 1.5])
    light = np.zeros((64, 64, 1))
    light[0, 0] = 1e4
    assert convolve(light, profile.quadrant_kernel(0.2)).min() < 0.0
    assert render_reference(Scene("spot", light, 0.2), profile).min() >= 0.0


@borders
def test_threads_do_not_change_a_bit(border):
    picture = np.random.default_rng(6).random((33, 70, 3))
    quadrant = random_quadrant(20, 3, seed=7)
    one = convolve(picture, quadrant, border=border, threads=1)
    assert np.array_equal(one, convolve(picture, quadrant, border=border, threads=3))
    # and one channel transformed once is that channel transformed three times
    gray = convolve(picture[:, :, :1], quadrant, border=border, threads=1)
    thrice = convolve(np.repeat(picture[:, :, :1], 3, axis=2), quadrant, border=border, threads=1)
    assert np.array_equal(gray, thrice)


def test_what_cannot_be_rendered_is_refused_in_one_line():
    profile = one_over_r_profile(40, 0.1, [0.5, 1.5])
    three = Scene("three", np.ones((4, 4, 3)), 0.2)
    gray = Scene("gray", np.ones((4, 4, 1)), 0.2)
    with pytest.raises(RenderError, match="picture has 3 channels and the kernel 2; expected 2,"):
        render_reference(three, profile)
    with pytest.raises(RenderError, match="border = 'wrap'; expected mirror, clamp, zero"):
        render_reference(gray, profile, border="wrap")
    for threads in (0, 1.5):
        with pytest.raises(RenderError, match=f"threads = {threads}; expected a whole number"):
            render_reference(gray, profile, threads=threads)


def test_a_picture_too_large_is_refused_before_anything_is_allocated():
    # 20000 x 20000 that take no memory themselves
    picture = np.broadcast_to(np.ones((1, 1, 1)), (20000, 20000, 1))
    assert shared.LARGEST_BYTES == 8e9
    with pytest.raises(RenderError, match=r"^20000 x 20000 pixels .* 12\.\d GB of .* than 8 GB;"):
        convolve(picture, np.ones((1, 1, 1)))
