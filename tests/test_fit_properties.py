"""What every fit promises, over random materials: energy, symmetry, signs, files, passes."""

import tempfile
from pathlib import Path

import numpy as np
import pytest
from checks import medium
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import convolve2d

from sssfit.compare.candidates import candidates
from sssfit.fit import METHODS, support_of
from sssfit.kernel import SeparableKernel
from sssfit.material import load_material
from sssfit.simulate import simulate_burley, simulate_dipole, simulate_exact

pytestmark = pytest.mark.filterwarnings("ignore::sssfit.errors.SssfitWarning")


CASES = [
    ("svd", {}),
    ("svd", {"rank": 2, "energy": "keep"}),
    ("gaussians", {"terms": 3}),
    ("gaussians", {"terms": 2, "signed": True}),
    ("gaussians", {"terms": 2, "free_energy": True}),
    ("gaussians", {"terms": 3, "energy": "keep"}),
    ("weighted", {}),
    ("weighted", {"rank": 3}),
    ("preintegrated", {}),
    ("preintegrated", {"energy": "keep"}),
    ("guided", {"k": 0.0}),
    ("guided", {"k": 3.0, "centre_bound": 0.5}),
    ("artist", {}),
    ("artist", {"target": "kernel"}),
    ("artist", {"near_mm2": 0.2, "far_mm2": [1.0, 3.0], "weight": 0.3}),
    ("falloff", {}),
    ("burley", {}),
    ("burley", {"energy": "keep"}),
]
ARRAYS = ("signs", "weights", "relative_frobenius_error", "energy_error", "scale")
every_case = pytest.mark.parametrize(("method", "own"), CASES, ids=str)


@st.composite
def fits(draw):
    """A profile of two channels and pixels for it: 7 to 41 that hold 99.9 % of its energy."""
    mean_free_path_mm = draw(st.floats(0.05, 5.0))
    albedos = np.array(draw(st.lists(st.floats(0.05, 0.9995), min_size=2, max_size=2)))
    eta = draw(st.floats(1.0, 1.5))
    material = medium((1.0 - albedos) / mean_free_path_mm, albedos / mean_free_path_mm, eta)
    simulate = draw(st.sampled_from([simulate_dipole, simulate_burley]))
    grid = {"dr_mm": 0.2 * mean_free_path_mm, "radius_mm": 40.0 * mean_free_path_mm}
    profile = simulate(material, **grid)
    pixels = draw(st.integers(3, 20))
    return profile, {"mm_per_pixel": support_of(profile) / pixels}


def promised(method, own):
    """Whether the kernel has the profile's energy whatever the support cuts off."""
    return own.get("energy") != "keep" and not own.get("free_energy")


@pytest.mark.parametrize("pixels", [13, 31])
def test_candidates_are_compared_at_the_same_energy(pixels):
    """On supports that cut off a third and a tenth of skin1's red."""
    profile = simulate_exact(load_material("skin1"))
    for each in candidates(pixels, most_terms=4):
        result = each.fit(profile, 0.3, 0.15 * (pixels - 1))
        assert result.kernel.pixels == pixels
        if promised(each.method, each.settings):
            np.testing.assert_allclose(result.energy_error, 0.0, atol=1e-9, err_msg=each.label)
        else:
            assert each.label.endswith(", kept")


def test_every_method_is_held_to_this():
    assert {method for method, _ in CASES} == set(METHODS)


def check_energies(method, own, kernel, profile):
    total = profile.diffuse_reflectance
    whole = np.array([kernel.full(c).sum() for c in range(2)])
    np.testing.assert_allclose(kernel.energy, whole, rtol=1e-11)
    np.testing.assert_allclose(kernel.energy_error, whole / total - 1.0, rtol=0, atol=1e-12)
    assert (kernel.scale == 1.0).all()
    if promised(method, own):
        np.testing.assert_allclose(whole, total, rtol=1e-8)
    elif method in ("preintegrated", "burley"):  # lines' and the model's share of the support
        assert (whole < total * (1.0 + 1e-12)).all()
    if method == "gaussians" and not own.get("free_energy"):
        weights = [sum(each["weights"]) for each in kernel.parameters.values()]
        np.testing.assert_allclose(weights, total, rtol=1e-10)


def check_shapes_signs_and_ends(method, own, result):
    kernel = result.kernel
    assert kernel.signs.shape == (kernel.rank, 2)
    assert np.isin(kernel.signs, (-1.0, 1.0)).all()
    if method != "svd" and not own.get("signed"):
        assert (kernel.signs == 1.0).all()
        assert (kernel.weights >= 0.0).all() or method == "weighted"
    np.testing.assert_array_equal(kernel.weights, kernel.weights[:, ::-1])
    assert np.isfinite(kernel.relative_frobenius_error).all()
    assert np.isfinite(kernel.energy_error).all()
    assert len(result.evaluations) == len(result.stop_reasons) == 2
    assert result.seconds > 0.0
    for evaluations, reason in zip(result.evaluations, result.stop_reasons, strict=True):
        assert evaluations >= 0
        assert reason[0].isalnum()
        assert " " in reason or reason == "converged"


def check_passes_are_the_2d_kernel(kernel):
    image = np.random.default_rng(1).random((5, 7))
    for c in range(2):
        whole = np.zeros((kernel.pixels, kernel.pixels))
        passed = 0.0
        for sign, weights in zip(kernel.signs[:, c], kernel.weights[:, :, c], strict=True):
            whole += sign * np.outer(weights, weights)
            passed = passed + sign * convolve2d(
                convolve2d(image, weights[:, None]), weights[None, :]
            )
        size = np.abs(whole).max()
        np.testing.assert_allclose(kernel.full(c), whole, rtol=0, atol=1e-13 * size)
        for other in (whole.T, whole[::-1], whole[:, ::-1]):
            np.testing.assert_allclose(whole, other, rtol=0, atol=1e-15 * size)
        in_the_plane = convolve2d(image, whole)
        size = np.abs(in_the_plane).max()
        np.testing.assert_allclose(passed, in_the_plane, rtol=0, atol=1e-12 * size)


def check_normalising_moves_the_energy_apart(method, own, kernel, unit, profile):
    np.testing.assert_allclose(unit.energy, 1.0, rtol=1e-11)
    np.testing.assert_allclose(unit.scale, kernel.energy, rtol=1e-11)
    if promised(method, own):
        np.testing.assert_allclose(unit.scale, profile.diffuse_reflectance, rtol=1e-8)
    np.testing.assert_allclose(
        unit.weights * np.sqrt(unit.scale),
        kernel.weights,
        rtol=1e-11,
        atol=1e-14 * np.abs(kernel.weights).max(),
    )
    for name in ("relative_frobenius_error", "energy_error"):
        np.testing.assert_array_equal(getattr(unit, name), getattr(kernel, name))


def check_files_bring_every_bit_back(kernel):
    with tempfile.TemporaryDirectory() as folder:
        path, again = Path(folder) / "a.kernel.json", Path(folder) / "b.kernel.json"
        kernel.save(path)
        loaded = SeparableKernel.load(path)
        loaded.save(again)
        assert again.read_bytes() == path.read_bytes()
    assert loaded.to_dict() == kernel.to_dict()
    assert loaded.mm_per_pixel == kernel.mm_per_pixel
    for name in ARRAYS:
        assert getattr(loaded, name).tobytes() == getattr(kernel, name).tobytes()


def fitted(examples):
    """Hold a case to all of it, on so many profiles."""

    @every_case
    @settings(max_examples=examples, deadline=None, derandomize=True)
    @given(fit=fits())
    def test(method, own, fit):
        profile, pixels = fit
        result = METHODS[method].fit(profile, **pixels, **own)
        kernel = result.kernel
        unit = METHODS[method].fit(profile, **pixels, **own, normalize=True).kernel
        check_energies(method, own, kernel, profile)
        check_shapes_signs_and_ends(method, own, result)
        check_passes_are_the_2d_kernel(kernel)
        check_normalising_moves_the_energy_apart(method, own, kernel, unit, profile)
        for each in (kernel, unit):
            check_files_bring_every_bit_back(each)

    return test


test_what_every_fit_promises = fitted(6)
test_what_every_fit_promises_on_many_profiles = pytest.mark.slow(fitted(100))
