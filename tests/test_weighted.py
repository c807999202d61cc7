"""Terms fitted as pictures see them: spectrum, energy, and what they show."""

import numpy as np
import pytest

from sssfit.errors import FitError
from sssfit.fit import fit_svd, fit_weighted, make_target
from sssfit.fit._spectrum import even_frequencies, spectral_target
from sssfit.material import load_material
from sssfit.measure.score import measure
from sssfit.render.reference import render_reference
from sssfit.render.separable import render_separable
from sssfit.scene.made import make_scene
from sssfit.simulate import simulate_exact


@pytest.fixture(scope="module")
def skin1():
    return simulate_exact(load_material("skin1"))


@pytest.fixture(scope="module")
def fitted(skin1):
    return {rank: fit_weighted(skin1, rank=rank) for rank in (1, 2, 3)}


def test_squares_over_even_frequencies_are_those_over_pixels(skin1):
    """Parseval: white weights make the spectral error the Frobenius error."""
    target = make_target(skin1, 0.3, 9.0)
    white = spectral_target(target, [0], "white", even_frequencies(target.half_pixels))
    kernel = fit_svd(skin1, rank=2, mm_per_pixel=0.3, support_mm=9.0).kernel
    half = kernel.weights[:, kernel.half_pixels :, 0]
    seen = half @ white.cosines(target).T
    quadrant = target.quadrant(0)
    quadrant = quadrant * skin1.diffuse_reflectance[0] / (target.copies @ quadrant @ target.copies)
    square = np.sum(np.outer(target.copies, target.copies) * (half.T @ half - quadrant) ** 2)
    norm = np.sum(np.outer(target.copies, target.copies) * quadrant**2)
    assert white.error((seen.T @ seen)[None])[0] == pytest.approx(np.sqrt(square / norm))


# One term of the decomposition, scaled to the energy, is farther from the kernel than none.
@pytest.mark.filterwarnings("ignore::sssfit.errors.SssfitWarning")
@pytest.mark.parametrize("rank", [1, 2, 4])
def test_white_pictures_give_the_decomposition(skin1, rank):
    ours, theirs = fit_weighted(skin1, rank=rank, spectrum="white"), fit_svd(skin1, rank=rank)
    np.testing.assert_allclose(
        ours.relative_frobenius_error, theirs.relative_frobenius_error, rtol=1e-9
    )
    np.testing.assert_allclose(ours.kernel.full(0), theirs.kernel.full(0), rtol=0, atol=1e-12)


def test_no_change_of_a_pass_is_better(skin1):
    """At the optimum every direction that keeps the energy leads upwards."""
    target = make_target(skin1, 0.3, 9.0)
    result = fit_weighted(skin1, rank=2, mm_per_pixel=0.3, support_mm=9.0)
    wanted = spectral_target(target, [0], "natural", even_frequencies(target.half_pixels))
    cosines = wanted.cosines(target)
    half = result.kernel.weights[:, result.kernel.half_pixels :, 0]

    def error(passes):
        passes = passes * np.sqrt(wanted.energy[0]) / np.linalg.norm(passes @ target.copies)
        seen = passes @ cosines.T
        return float(wanted.error((seen.T @ seen)[None])[0])

    best = error(half)
    assert best == pytest.approx(result.kernel.parameters["R"]["spectral_error"])
    rng = np.random.default_rng(1)
    for size in (1e-2, 1e-3):
        for _ in range(20):
            step = rng.normal(size=half.shape) * np.abs(half) * size
            assert error(half + step) > best


# Physics, section 10: squared errors of red (a first trial), and 99th percentiles of Delta E.
@pytest.mark.parametrize(("rank", "squared"), [(1, 0.0040), (2, 0.00019), (3, 0.000015)])
def test_the_error_is_that_of_the_trial(fitted, rank, squared):
    found = fitted[rank].kernel.parameters["R"]["spectral_error"] ** 2
    assert found == pytest.approx(squared, rel=0.1)
    assert (fitted[rank].kernel.signs == 1.0).all()


TRIAL = {
    1: {"disk": 3.0, "edge": 1.9, "head": 1.4},
    2: {"disk": 0.85, "edge": 0.55, "head": 0.34},
    3: {"disk": 0.35, "edge": 0.31, "head": 0.12},
}


@pytest.mark.parametrize("rank", TRIAL)
def test_pictures_are_as_near_as_in_the_trial(skin1, fitted, rank):
    settings = {"disk": {"radius_mm": 19.2}, "edge": {"angle_degrees": 30}, "head": {}}
    for name, most in TRIAL[rank].items():
        scene = make_scene(name, height=256, width=256, mm_per_pixel=0.3, **settings[name])
        ours, truth = render_separable(scene, fitted[rank].kernel), render_reference(scene, skin1)
        found = measure(ours, truth, mask=scene.mask).delta_e_2000_p99
        assert found == pytest.approx(most, rel=0.05)


def test_two_terms_show_less_error_than_five_of_the_decomposition(skin1, fitted):
    scene = make_scene("edge", height=128, width=128, mm_per_pixel=0.3, angle_degrees=30)
    truth = render_reference(scene, skin1)
    shown = [
        measure(render_separable(scene, each), truth).delta_e_2000_p99
        for each in (fitted[2].kernel, fit_svd(skin1, rank=5).kernel)
    ]
    assert shown[0] < shown[1]


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"rank": 0}, "rank = 0; expected a whole number from 1 to 8"),
        ({"rank": 2.5}, "rank = 2.5; expected a whole number"),
        ({"rank": 9}, "rank = 9; expected"),
        ({"spectrum": "pink"}, "spectrum = 'pink'; expected 'natural' or 'white'"),
    ],
)
def test_bad_settings_are_one_line(skin1, settings, said):
    with pytest.raises(FitError) as caught:
        fit_weighted(skin1, **settings)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.filterwarnings("ignore::sssfit.errors.SssfitWarning")
def test_a_kernel_of_few_pixels_has_no_more_terms_than_pixels(skin1):
    result = fit_weighted(skin1, rank=4, mm_per_pixel=0.3, support_mm=0.3)
    assert result.kernel.rank == 2
