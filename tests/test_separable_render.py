"""Separable passes: against a direct loop, the 2D reference, and what fits promise of them."""

import sys

import numpy as np
import pytest
from reference_pixels import one_over_r_profile
from reference_render import convolve_directly, random_kernel

import sssfit._jit.passes  # noqa: F401
from sssfit.errors import RenderError
from sssfit.fit import fit_preintegrated, fit_svd
from sssfit.render import borders as shared
from sssfit.render.borders import BORDERS
from sssfit.render.reference import convolve, reference_quadrant
from sssfit.render.separable import apply_passes, render_separable
from sssfit.scene.record import Scene

borders = pytest.mark.parametrize("border", BORDERS)
precisions = pytest.mark.parametrize("dtype", [np.float32, np.float64])
UNIT = {np.float32: 2.0**-24, np.float64: 2.0**-53}  # half a unit in the last place of 1


def random_picture(height, width, channels, seed=1):
    return np.random.default_rng(seed).random((height, width, channels))


def rounding(picture, weights, signs, border, dtype):
    """Higham's n u bound: n roundings of a product of weights and a pixel, at most.

    A pass rounds its weight, adds the pair, multiplies, and adds at most P products; then terms
    are added up, and the pixel was rounded. Twice that: the other side of a comparison rounds too.
    """
    terms, pixels, _ = weights.shape
    largest = apply_passes(picture, np.abs(weights), np.abs(signs), border=border)
    return 2.0 * (2 * (pixels + 3) + terms + 2) * UNIT[dtype] * largest


@borders
@pytest.mark.parametrize(
    ("height", "width", "terms", "half", "given", "channels"),
    [
        (6, 9, 1, 4, 3, 3),
        (7, 5, 3, 3, 1, 2),  # one channel serves all
        (5, 3, 2, 9, 2, 2),  # wider than the picture, many reflections
        (1, 8, 1, 5, 1, 1),  # one row
        (8, 1, 2, 2, 1, 1),  # one column
        (1, 1, 2, 0, 1, 1),
        (1, 1, 1, 3, 5, 5),
        (4, 6, 2, 1, 5, 5),
    ],
)
def test_passes_equal_the_direct_loop(border, height, width, terms, half, given, channels):
    kernel = random_kernel(terms, half, channels, seed=2)
    picture = random_picture(height, width, given)
    found = render_separable(Scene("any", picture, 0.5), kernel, border=border, threads=1)
    whole = np.stack([kernel.full(c) for c in range(channels)], axis=2)
    expected = convolve_directly(picture, whole, border)
    limit = rounding(picture, kernel.weights, kernel.signs, border, np.float64)
    assert found.shape == (height, width, channels)
    assert found.dtype == np.float64
    assert (np.abs(found - expected) <= limit).all()


@precisions
def test_impulse_response_is_the_kernel_times_its_scale(dtype):
    kernel = random_kernel(3, 6, 2, seed=3, scale=[0.5, 2.0])
    picture = np.zeros((15, 17, 1))
    picture[7, 8] = 1.0
    found = render_separable(Scene("point", picture, 0.5), kernel, dtype=dtype)
    assert found.dtype == dtype
    around = np.abs(kernel.weights)
    for c in range(2):
        response = found[1:14, 2:15, c]
        most = np.einsum("tp,tq->pq", around[:, :, c], around[:, :, c]) * kernel.scale[c]
        limit = 2 * (2 * 16 + 5) * UNIT[dtype] * most
        assert (np.abs(response - kernel.scale[c] * kernel.full(c)) <= limit).all()
    assert np.count_nonzero(found) == 2 * 13 * 13


@borders
@pytest.mark.parametrize("half", [17, 40])
def test_passes_equal_the_reference_with_the_same_kernel(border, half):
    kernel = random_kernel(2, half, 3, seed=4)
    picture = random_picture(150, 31, 3)  # more rows than one block
    scene = Scene("noise", picture, 0.5)
    quadrant = np.stack([kernel.quadrant(c) for c in range(3)], axis=2)
    found = render_separable(scene, kernel, border=border)
    expected = convolve(picture, quadrant, border=border)
    limit = rounding(picture, kernel.weights, kernel.signs, border, np.float64)
    assert (np.abs(found - expected) <= limit).all()


def test_full_rank_svd_equals_the_true_kernel():
    profile = one_over_r_profile(60, 0.1, [0.3, 1.0])
    fitted = fit_svd(profile, rank=13, energy="keep", mm_per_pixel=0.25, support_mm=3.0).kernel
    scene = Scene("noise", random_picture(40, 30, 2), 0.25)
    expected = convolve(scene.irradiance, profile.quadrant_kernel(0.25, 12))
    found = render_separable(scene, fitted)
    # Eigenvalues are known to eps times the largest of them, and there are 13.
    limit = 13 * 13 * 2.0**-52
    assert np.abs(found - expected).max() <= limit
    # and one term less is no matter of rounding: the least eigenvalue shows, 4e-10 of the light
    less = fit_svd(profile, rank=12, energy="keep", mm_per_pixel=0.25, support_mm=3.0).kernel
    assert np.abs(render_separable(scene, less) - expected).max() > 1000.0 * limit


@pytest.mark.parametrize("normalize", [False, True])
def test_preintegrated_is_exact_on_edges_along_the_axes(normalize):
    profile = one_over_r_profile(60, 0.05, [0.3, 1.0])
    kernel = fit_preintegrated(
        profile, mm_per_pixel=0.2, support_mm=3.0, normalize=normalize
    ).kernel
    assert kernel.half_pixels == 15  # the whole grid
    across = np.where(np.arange(70) < 33, 1.0, 0.0)
    down = np.where(np.arange(50) < 20, 0.5, 2.0)
    scene = Scene("edges", (down[:, None] + across)[:, :, None], 0.2)
    quadrant, left_out = reference_quadrant(profile, 0.2, 50, 70)
    assert np.abs(left_out).max() < 1e-14
    found, expected = render_separable(scene, kernel), convolve(scene.irradiance, quadrant)
    assert found == pytest.approx(expected, rel=1e-12)
    # A disk is no sum of edges: there the same kernel is far off.
    y, x = np.mgrid[-25:25, -35:35]
    disk = Scene("disk", (np.hypot(x, y) < 10.0).astype(float)[:, :, None], 0.2)
    apart = render_separable(disk, kernel) - convolve(disk.irradiance, quadrant)
    assert np.abs(apart).max() > 0.01


def test_error_of_svd_on_a_disk_falls_with_the_rank():
    profile = one_over_r_profile(60, 0.05, [0.3, 1.0])
    y, x = np.mgrid[-32:33, -32:33]
    disk = Scene("disk", (np.hypot(x, y) < 9.0).astype(float)[:, :, None], 0.2)
    expected = convolve(disk.irradiance, reference_quadrant(profile, 0.2, 65, 65)[0])
    ring = np.abs(np.hypot(x, y) - 12.0) < 0.5
    apart, spread = [], []
    for rank in range(1, 7):
        kernel = fit_svd(profile, rank=rank, energy="keep", mm_per_pixel=0.2, support_mm=3.0).kernel
        error = render_separable(disk, kernel) - expected
        apart.append(np.sqrt((error**2).mean(axis=(0, 1))))
        # Over a ring around the disk the true picture hardly changes with the angle.
        spread.append(error[ring].std(axis=0))
    assert (np.diff(apart, axis=0) < 0.0).all()
    # The error of the whole picture falls with every term; that of one ring need not.
    assert (np.diff(spread[:3], axis=0) < 0.0).all()
    assert (np.divide(spread[5], spread[0]) < 0.01).all()
    assert (np.divide(apart[5], apart[0]) < 0.01).all()


@borders
def test_float32_is_off_by_no_more_than_its_rounding(border):
    kernel = random_kernel(3, 12, 3, seed=5)
    scene = Scene("noise", random_picture(70, 80, 3), 0.5)
    exact = render_separable(scene, kernel, border=border)
    found = render_separable(scene, kernel, border=border, dtype=np.float32)
    limit = rounding(scene.irradiance, kernel.weights, kernel.signs, border, np.float32)
    apart = np.abs(found - exact)
    assert found.dtype == np.float32
    assert (apart <= limit).all()
    assert apart.max() > UNIT[np.float32] * np.abs(exact).max() / 10  # it was float32 throughout


@borders
def test_threads_and_zeros_at_the_ends_do_not_change_a_bit(border):
    kernel = random_kernel(2, 9, 3, seed=6)
    picture = random_picture(200, 33, 3)
    weights = np.pad(kernel.weights, ((0, 0), (11, 11), (0, 0)))
    one = apply_passes(picture, kernel.weights, kernel.signs, border=border, threads=1)
    for threads in (2, 5, None):
        found = apply_passes(picture, weights, kernel.signs, border=border, threads=threads)
        assert np.array_equal(one, found)


def test_channels_of_different_reach_do_not_touch_each_other():
    kernel = random_kernel(2, 10, 3, seed=7)
    weights = kernel.weights.copy()
    weights[:, :6, 1] = weights[:, -6:, 1] = 0.0
    weights[1, :, 2] = 0.0  # one term less
    picture = random_picture(20, 30, 3)
    together = apply_passes(picture, weights, kernel.signs)
    for c in range(3):
        of_one = [each[..., c : c + 1] for each in (picture, weights, kernel.signs)]
        assert np.array_equal(together[:, :, c : c + 1], apply_passes(*of_one))


@precisions
def test_compiled_passes_and_the_same_as_plain_python_agree_to_the_bit(monkeypatch, dtype):
    picture = random_picture(7, 9, 2).astype(dtype)
    kernel = random_kernel(2, 5, 2, seed=8)
    compiled = [apply_passes(picture, kernel.weights, kernel.signs, border=b) for b in BORDERS]
    module = sys.modules["sssfit._jit.passes"]
    for name in ("fill_line", "sum_line", "add_rows", "pass_across", "pass_down"):
        monkeypatch.setattr(module, name, getattr(module, name).py_func)
    plain = [apply_passes(picture, kernel.weights, kernel.signs, border=b) for b in BORDERS]
    assert [each.tobytes() for each in compiled] == [each.tobytes() for each in plain]


def test_the_picture_and_the_kernel_have_to_match():
    kernel = random_kernel(1, 2, 3, seed=9)

    def scene(channels=1, pitch=0.5):
        return Scene("wall", np.ones((4, 4, channels)), pitch)

    render_separable(scene(pitch=0.5 * (1 + 9e-7)), kernel)
    with pytest.raises(RenderError, match=r"kernel has 0\.5 mm .* wall 0\.25; fit .* 0\.25`\."):
        render_separable(scene(pitch=0.25), kernel)
    with pytest.raises(RenderError, match=r"kernel has 0\.5 mm .* wall 0\.500001;"):
        render_separable(scene(pitch=0.500001), kernel)
    with pytest.raises(RenderError, match="picture has 2 channels and the kernel 3; expected 3"):
        render_separable(scene(channels=2), kernel)
    with pytest.raises(RenderError, match="border = 'wrap'; expected mirror, clamp, zero"):
        render_separable(scene(), kernel, border="wrap")
    with pytest.raises(RenderError, match="threads = 0; expected a whole number from 1 up"):
        render_separable(scene(), kernel, threads=0)
    with pytest.raises(RenderError, match="dtype = float16; expected float32 or float64"):
        render_separable(scene(), kernel, dtype=np.float16)
    with pytest.raises(RenderError, match="dtype = 'foo'; expected float32 or float64"):
        render_separable(scene(), kernel, dtype="foo")
    bright = Scene("sun", np.full((4, 4, 3), 1e39), 0.5)
    with pytest.raises(RenderError, match=r"sun: light of 1e\+39 is above 3.4e\+38.* float64"):
        render_separable(bright, kernel, dtype=np.float32)
    assert np.isfinite(render_separable(bright, kernel)).all()
    near = Scene("sun", np.full((4, 4, 3), 3.4e38), 0.5)  # mirrored pixels are added first
    with pytest.raises(RenderError, match=r"sums of light of 3\.4e\+38 are above .* float64"):
        render_separable(near, kernel, dtype=np.float32)
    most = Scene("sun", np.full((4, 4, 3), 1.7e308), 0.5)
    with pytest.raises(RenderError, match=r"number of float64; scale it down"):
        render_separable(most, kernel)


def test_a_picture_too_large_is_refused(monkeypatch):
    monkeypatch.setattr(shared, "LARGEST_BYTES", 1000.0)
    kernel = random_kernel(1, 2, 3, seed=9)
    render_separable(Scene("wall", np.ones((3, 4, 1)), 0.5), kernel)
    with pytest.raises(RenderError, match=r"^wall: 4 x 4 pixels would take .* GB of memory, more"):
        render_separable(Scene("wall", np.ones((4, 4, 1)), 0.5), kernel)
