"""Kernels for one picture: its power, what a fit gains by it, and pictures that have none."""

import functools

import numpy as np
import pytest
from scipy import ndimage

from sssfit.errors import ArgumentError, FitError
from sssfit.fit import fit_result, fit_taps, fit_weighted, make_target
from sssfit.fit._spectrum import (
    _FLOOR,
    even_frequencies,
    pictures_of,
    power_of,
    spectral_target,
)
from sssfit.fit.on_taps import on_taps
from sssfit.formats.pictures import save_image
from sssfit.kernel import Taps
from sssfit.material import load_material
from sssfit.profile import full_kernel
from sssfit.render.separable import render_separable
from sssfit.render.taps import render_taps
from sssfit.scene.load import load_scene
from sssfit.scene.made import make_scene
from sssfit.scene.record import Scene
from sssfit.simulate import simulate_exact

PICTURES = ("head", "edge", "points")


@pytest.fixture(scope="module")
def skin1():
    return simulate_exact(load_material("skin1"))


def scene_of(light, pitch=0.6, name="own"):
    return Scene(name, np.asarray(light, dtype=float), pitch)


def noise(rows, columns, channels=1, seed=1):
    return np.random.default_rng(seed).uniform(0.0, 1.0, (rows, columns, channels))


# The power


def test_all_of_a_pictures_power_but_its_means_is_kept():
    light = noise(40, 57)[..., 0]
    w, _ = even_frequencies(9)
    power = power_of(light, w)
    # What lies below the first frequency goes to that of the mean in part.
    assert power.sum() <= np.sum((light - light.mean()) ** 2)
    assert power.sum() == pytest.approx(np.sum((light - light.mean()) ** 2), rel=0.02)
    np.testing.assert_allclose(power, power.T)


def test_a_wave_has_the_power_of_its_frequency():
    w, _ = even_frequencies(9)  # 20 of them, pi / 19 apart
    wave = np.cos(np.pi * 6 / 38 * (np.arange(38) + 0.5))
    power = power_of(np.outer(np.ones(30), wave), w)
    expected = np.zeros((20, 20))
    expected[0, 3] = expected[3, 0] = 0.5 * 30 * 19
    np.testing.assert_allclose(power, expected, atol=1e-9)


def test_the_misfit_is_the_squared_error_of_the_rendered_picture(skin1):
    """Against a plain convolution with mirrors; the floor's part is that of natural pictures."""
    light = ndimage.gaussian_filter(noise(81, 90, 3), (2, 2, 0))
    target = make_target(skin1, 0.6, 6.0)
    grid = even_frequencies(40)  # the picture's own frequencies, or nearly
    result = fit_weighted(skin1, rank=1, mm_per_pixel=0.6, support_mm=6.0)
    half = result.kernel.weights[:, result.kernel.half_pixels :]
    for c in range(3):
        own, natural = (
            spectral_target(target, [c], each, grid) for each in (scene_of(light), "natural")
        )
        seen = half[:, :, c] @ own.cosines(target).T
        errors = [each.error((seen.T @ seen)[None])[0] for each in (own, natural)]
        dense = full_kernel(target.quadrant(c))
        dense *= skin1.diffuse_reflectance[c] / dense.sum()
        plane = light[..., c]
        truth = ndimage.convolve(plane, dense, mode="reflect")
        ours = ndimage.convolve(plane, result.kernel.full(c), mode="reflect")
        misfit = np.sum((ours - truth) ** 2) / np.sum((truth - truth.mean()) ** 2)
        assert (errors[0] ** 2 - _FLOOR * errors[1] ** 2) / (1 - _FLOOR) == pytest.approx(
            misfit, rel=0.03
        )


# The fits


def true_pictures(profile, scene):
    """Of each channel, a convolution with the pixels of the profile."""
    target = make_target(profile, scene.mm_per_pixel, 12.0)
    for c in range(3):
        dense = full_kernel(target.quadrant(c))
        dense *= profile.diffuse_reflectance[c] / dense.sum()
        plane = np.pad(scene.irradiance[..., 0], len(dense) // 2, mode="symmetric")
        size = [a + b - 1 for a, b in zip(plane.shape, dense.shape, strict=True)]
        both = np.fft.rfft2(plane, size) * np.fft.rfft2(dense, size)
        reach = len(dense) - 1
        yield np.fft.irfft2(both, size)[reach : -reach or None, reach : -reach or None]


def relative_l2(kernel, scene, truths):
    """Of each channel's picture against the true one."""
    render = render_taps if isinstance(kernel, Taps) else render_separable
    shown, found = render(scene, kernel), []
    for c, truth in enumerate(truths):
        found.append(np.sum((shown[..., c] - truth) ** 2) / np.sum((truth - truth.mean()) ** 2))
    return np.sqrt(found)


@pytest.fixture(scope="module")
def scenes():
    settings = {"edge": {"angle_degrees": 20.0}}
    return {
        name: make_scene(name, height=128, width=128, mm_per_pixel=0.6, **settings.get(name, {}))
        for name in PICTURES
    }


@pytest.fixture(scope="module")
def truths(skin1, scenes):
    return {name: list(true_pictures(skin1, scene)) for name, scene in scenes.items()}


@pytest.fixture(scope="module")
def natural(skin1):
    """Kernels for natural pictures, of each rank or stages once for all pictures."""

    @functools.cache
    def fitted(fit, **settings):
        return fit(skin1, mm_per_pixel=0.6, support_mm=12.0, **settings).kernel

    return fitted


@pytest.mark.parametrize("name", PICTURES)
@pytest.mark.parametrize("rank", [1, 2])
def test_terms_for_a_picture_are_never_worse_on_it_than_natural_ones(
    skin1, scenes, truths, natural, name, rank
):
    settings = {"rank": rank, "mm_per_pixel": 0.6, "support_mm": 12.0}
    own = fit_weighted(skin1, irradiance=scenes[name], **settings).kernel
    kernels = own, natural(fit_weighted, rank=rank)
    errors = [relative_l2(each, scenes[name], truths[name]) for each in kernels]
    assert (errors[0] <= errors[1]).all()
    assert errors[0].mean() < 0.95 * errors[1].mean()
    assert own.meta["settings"]["irradiance"] == name
    assert "spectrum" not in own.meta["settings"]


@pytest.mark.parametrize("name", PICTURES)
@pytest.mark.parametrize("stages", ["1-1", "1|1", "*|*"])
def test_a_cascade_for_a_picture_is_never_worse_on_it_than_a_natural_one(
    skin1, scenes, truths, natural, name, stages
):
    settings = {"stages": stages, "mm_per_pixel": 0.6, "support_mm": 12.0}
    own = fit_taps(skin1, irradiance=scenes[name], **settings).kernel
    kernels = own, natural(fit_taps, stages=stages)
    errors = [relative_l2(each, scenes[name], truths[name]) for each in kernels]
    assert np.sum(errors[0] ** 2) <= np.sum(errors[1] ** 2)
    np.testing.assert_allclose(own.energy, skin1.diffuse_reflectance, rtol=1e-9)
    assert own.meta["settings"]["irradiance"] == name


def test_fitted_taps_have_the_objective_of_their_terms(skin1, scenes, truths):
    settings = {"rank": 1, "mm_per_pixel": 0.6, "support_mm": 12.0}
    found = {
        key: fit_result(skin1, "weighted", taps=9, place="fitted", irradiance=each, **settings)
        for key, each in (("own", scenes["edge"]), ("natural", None))
    }
    errors = {
        key: relative_l2(each.kernel, scenes["edge"], truths["edge"]) for key, each in found.items()
    }
    assert np.sum(errors["own"] ** 2) < np.sum(errors["natural"] ** 2)
    dense = fit_weighted(skin1, irradiance=scenes["edge"], **settings).kernel
    by_natural = on_taps(dense, 9, place="fitted", profile=skin1)
    assert (by_natural.errors["spectral"] != found["own"].kernel.errors["spectral"]).all()


# Where a picture comes from


def test_a_made_picture_has_the_kernels_pixels_and_is_large_enough(skin1):
    by_name = fit_weighted(skin1, rank=1, mm_per_pixel=0.6, irradiance="edge").kernel
    scene = load_scene("edge", 0.6)
    by_scene = fit_weighted(skin1, rank=1, mm_per_pixel=0.6, irradiance=scene).kernel
    np.testing.assert_array_equal(by_name.weights, by_scene.weights)
    fine = make_target(skin1, 0.03, 8.0)
    assert pictures_of(fine, None, "edge").height == 2 * fine.half_pixels + 1 > 512


def test_a_file_says_how_large_its_pixels_are_or_has_the_kernels(skin1, tmp_path):
    light = noise(80, 90, 3)
    for name, pitch in (("said.exr", 0.5), ("silent.exr", None)):
        save_image(tmp_path / name, light, mm_per_pixel=pitch)
    settings = {"rank": 1, "support_mm": 6.0}
    silent = tmp_path / "silent.exr"
    own = fit_weighted(skin1, irradiance=str(silent), mm_per_pixel=0.6, **settings).kernel
    scene = scene_of(np.float32(light), name="x")
    np.testing.assert_allclose(
        own.weights,
        fit_weighted(skin1, irradiance=scene, mm_per_pixel=0.6, **settings).kernel.weights,
    )
    said = tmp_path / "said.exr"
    with pytest.raises(FitError, match=r"said.exr has pixels of 0.5 mm and the kernel of 0.6 mm"):
        fit_weighted(skin1, irradiance=said, mm_per_pixel=0.6, **settings)
    fit_weighted(skin1, irradiance=said, mm_per_pixel=0.5, **settings)


@pytest.mark.parametrize(
    ("irradiance", "said"),
    [
        (scene_of(np.ones((64, 64, 1))), "own is of one colour, which no kernel blurs"),
        (
            scene_of(noise(64, 64, 3) * [1.0, 0.0, 1.0]),
            "own is of one colour in channel G, which no kernel blurs",
        ),
        (scene_of(noise(64, 20)), "own has 20 x 64 pixels and the kernel 21 x 21; expected"),
        (scene_of(noise(64, 64, 2)), "own has 2 channels and the profile 3; expected as many"),
        (scene_of(noise(64, 64), 0.3), "own has pixels of 0.3 mm and the kernel of 0.6 mm"),
    ],
)
@pytest.mark.parametrize("fit", [fit_weighted, fit_taps])
def test_a_picture_that_says_nothing_is_one_line(skin1, fit, irradiance, said):
    with pytest.raises(FitError) as caught:
        fit(skin1, irradiance=irradiance, mm_per_pixel=0.6, support_mm=6.0)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_picture_and_a_spectrum_do_not_go_together(skin1):
    for word in ("natural", "white"):
        with pytest.raises(FitError, match=f"`spectrum = {word}` beside a picture, which has a"):
            fit_weighted(skin1, irradiance="head", spectrum=word)
    with pytest.raises(ArgumentError, match="there is no picture 'hed'; expected head, disk"):
        fit_taps(skin1, irradiance="hed")
