"""The pre-integrated kernel: where it equals the 2D convolution, and by how much where not."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.lib.stride_tricks import sliding_window_view
from reference_pixels import make_profile, one_over_r_profile
from scipy.signal import fftconvolve

from sssfit.errors import FitError, SssfitWarning
from sssfit.fit import fit_preintegrated
from sssfit.material import load_material, material_names
from sssfit.profile import full_kernel
from sssfit.simulate import simulate_dipole, simulate_exact

# Some random profiles are ones that a kernel of few terms does not suit, and it says so.
random_profiles = pytest.mark.filterwarnings("ignore:.* kernel (is farther|has not)")


def covering(profile, pitch):
    """A fit whose pixels cover the grid, and the profile's 2D kernel on them.

    With the energy on the grid: what lies beyond it the 2D kernel does not have either.
    """
    last = float(profile.r_edges_mm[-1])
    kernel = fit_preintegrated(
        profile, energy="keep", mm_per_pixel=pitch, support_mm=last + pitch
    ).kernel
    return kernel, profile.quadrant_kernel(pitch, kernel.half_pixels)


def two_passes(irradiance, kernel, channel):
    """What a shader does, a pass along each axis; the middle, which sees no edge of the image."""
    weights = kernel.weights[0, ::-1, channel]
    for axis in (0, 1):
        irradiance = sliding_window_view(irradiance, weights.size, axis) @ weights
    return irradiance


def whole_convolution(irradiance, quadrant):
    return fftconvolve(irradiance, full_kernel(quadrant), mode="valid")


@random_profiles
@settings(max_examples=40, deadline=None)
@given(
    pitch=st.floats(0.05, 7.0),
    energy=st.lists(st.floats(0.0, 0.1), min_size=2, max_size=9).filter(lambda e: sum(e) > 0.01),
    seed=st.integers(0, 2**32 - 1),
)
@pytest.mark.filterwarnings("ignore:a pixel of:sssfit.errors.SssfitWarning")
def test_equals_the_2d_convolution_on_additive_irradiance(pitch, energy, seed):
    profile = make_profile(0.25 * np.arange(len(energy) + 1), np.array(energy)[:, None])
    kernel, quadrant = covering(profile, pitch)
    size = kernel.pixels + 12
    rng = np.random.default_rng(seed)
    along_x, along_y = rng.uniform(0.0, 10.0, (2, size))
    irradiance = along_x[None, :] + along_y[:, None]
    whole = whole_convolution(irradiance, quadrant[:, :, 0])
    np.testing.assert_allclose(two_passes(irradiance, kernel, 0), whole, atol=1e-9)


@pytest.mark.parametrize("pitch", [0.1, 0.37, 1.0, 5.0])
@pytest.mark.parametrize("axis", [0, 1])
def test_equals_the_2d_convolution_at_an_edge_along_an_axis(pitch, axis):
    profile = simulate_dipole(load_material("skin1"), dr_mm=0.1, radius_mm=12.0)
    kernel, quadrant = covering(profile, pitch)
    size = kernel.pixels + 10
    edge = np.zeros((size, size))
    edge[size // 2 :] = 1.0
    edge = edge if axis == 0 else edge.T
    for c in range(3):
        whole = whole_convolution(edge, quadrant[:, :, c])
        np.testing.assert_allclose(two_passes(edge, kernel, c), whole, atol=1e-9)
    assert np.ptp(whole) > 0.1 * profile.diffuse_reflectance[2]


def step_at_45_degrees(size):
    """Irradiance 1 beyond the diagonal, 1/2 on it, 0 before: shares of the half plane."""
    x = np.arange(size) - size // 2
    return 0.5 + 0.5 * np.sign(x[None, :] + x[:, None])


@pytest.mark.parametrize("name", ["skin1", "cream", "ketchup"])
def test_an_edge_at_45_degrees_is_off_by_some_6_percent_of_the_step(name):
    profile = simulate_exact(load_material(name))
    kernel = fit_preintegrated(profile, energy="keep", mm_per_pixel=0.1).kernel
    for c in range(2):
        quadrant = profile.quadrant_kernel(0.1, kernel.half_pixels, channel=c)
        edge = step_at_45_degrees(kernel.pixels + 20)
        whole = whole_convolution(edge, quadrant)
        off = np.abs(two_passes(edge, kernel, c) - whole).max() / full_kernel(quadrant).sum()
        assert 0.05 < off < 0.07


def off_at_45_degrees(profile, pitch, channel):
    """The same figure from sums along diagonals: all that such an edge sees of a kernel."""
    kernel = fit_preintegrated(profile, energy="keep", mm_per_pixel=pitch).kernel
    whole = full_kernel(profile.quadrant_kernel(pitch, kernel.half_pixels, channel=channel))
    x = np.arange(kernel.pixels)
    apart = kernel.full(channel) - whole
    diagonal = np.bincount((x[:, None] + x).ravel(), apart.ravel())
    return np.abs(np.cumsum(diagonal) - 0.5 * diagonal).max() / whole.sum()


@pytest.mark.slow
def test_figures_of_the_45_degree_edge_in_the_docs():
    off = [
        off_at_45_degrees(simulate_exact(load_material(name)), 0.1, c)
        for name in material_names(paper=True)
        for c in range(3)
    ]
    assert round(min(off), 3) == 0.051
    assert round(max(off), 3) == 0.064


def test_sums_along_diagonals_tell_what_the_convolution_tells():
    profile = simulate_exact(load_material("skin1"), dr_mm=0.1, radius_mm=8.0)
    kernel = fit_preintegrated(profile, energy="keep", mm_per_pixel=0.4).kernel
    quadrant = profile.quadrant_kernel(0.4, kernel.half_pixels, channel=1)
    edge = step_at_45_degrees(kernel.pixels + 20)
    apart = np.abs(two_passes(edge, kernel, 1) - whole_convolution(edge, quadrant)).max()
    found = off_at_45_degrees(profile, 0.4, 1)
    assert found == pytest.approx(apart / full_kernel(quadrant).sum(), rel=1e-9)


def test_energy_outside_the_support_is_restored():
    # Supplement, S.6: ||a_p||_1 = ||R_d||_1. Red loses a third of it on 13 pixels, a tenth on 31.
    profile = simulate_exact(load_material("skin1"))
    for pixels, lost in ((13, 0.31), (31, 0.10)):
        support = {"mm_per_pixel": 0.3, "support_mm": 0.15 * (pixels - 1)}
        result = fit_preintegrated(profile, **support)
        kept = fit_preintegrated(profile, energy="keep", **support)
        assert result.kernel.pixels == pixels
        np.testing.assert_allclose(result.kernel.energy, profile.diffuse_reflectance, rtol=1e-12)
        np.testing.assert_allclose(result.energy_error, 0.0, atol=1e-12)
        assert kept.energy_error[0] == pytest.approx(-lost, abs=0.01)
        np.testing.assert_allclose(
            result.kernel.weights / result.kernel.weights[:, pixels // 2],
            kept.kernel.weights / kept.kernel.weights[:, pixels // 2],
            rtol=1e-12,
        )
        assert result.kernel.meta["settings"] == {"energy": "rescale", "normalize": False}
        assert kept.kernel.meta["settings"] == {"energy": "keep", "normalize": False}


def test_energy_beyond_the_grid_is_restored():
    profile = simulate_dipole(load_material("marble"))  # 2 % of it
    result = fit_preintegrated(profile, mm_per_pixel=0.3)
    assert (profile.beyond_grid > 0.01 * profile.diffuse_reflectance).any()
    np.testing.assert_allclose(result.kernel.energy, profile.diffuse_reflectance, rtol=1e-12)


def test_another_word_for_the_energy_is_refused():
    with pytest.raises(FitError, match="energy = 'lose'; expected 'rescale' or 'keep'"):
        fit_preintegrated(one_over_r_profile(40, 0.1, [0.5]), energy="lose", mm_per_pixel="profile")


def test_energy_kept_is_that_of_the_strips_within_the_support():
    profile = one_over_r_profile(40, 0.1, [0.5, 0.9])
    whole, _ = covering(profile, 0.1)
    np.testing.assert_allclose(whole.energy, profile.total_on_grid, rtol=1e-12)
    part = fit_preintegrated(profile, energy="keep", support_mm=1.0, mm_per_pixel="profile")
    line = profile.line_kernel(0.1, 10)
    np.testing.assert_allclose(part.kernel.energy, line.sum(axis=0), rtol=1e-12)
    np.testing.assert_allclose(part.kernel.line, line, rtol=1e-12)
    np.testing.assert_allclose(
        part.energy_error, line.sum(axis=0) / profile.diffuse_reflectance - 1.0, rtol=1e-12
    )
    normal = fit_preintegrated(
        profile, energy="keep", support_mm=1.0, normalize=True, mm_per_pixel="profile"
    ).kernel
    np.testing.assert_allclose(normal.energy, 1.0, rtol=1e-12)
    np.testing.assert_allclose(normal.scale, part.kernel.energy, rtol=1e-12)


def test_one_pixel_blurs_nothing():
    with pytest.warns(SssfitWarning, match="blurs nothing"):
        fitted = fit_preintegrated(
            one_over_r_profile(10, 0.1, [0.5]), energy="keep", mm_per_pixel=3.0
        )
    assert fitted.kernel.pixels == 1
    assert fitted.kernel.energy[0] == pytest.approx(-0.5 * np.expm1(-2.0), rel=1e-12)
