"""Normalised diffusion as a profile: its energy, its radii, its three mappings."""

import math

import numpy as np
import pytest
from checks import medium
from checks_layers import layer, stack

from sssfit import shapes
from sssfit.errors import SimulationError, SssfitWarning
from sssfit.material import load_material
from sssfit.simulate import simulate_burley

SKIN = load_material("skin1")


@pytest.mark.parametrize("mapping", ["perpendicular", "diffuse", "diffuse-mfp"])
def test_profile_is_the_closed_form(mapping):
    total = np.array([0.44, 0.22, 0.13])
    profile = simulate_burley(SKIN, mapping=mapping, reflectance=total)
    paths_mm = {  # 3.67, 1.37, .68 mm: the diffuse mean free paths that papers give for skin1
        "diffuse-mfp": np.array([3.6733, 1.3665, 0.6827]),
    }.get(mapping, 1.0 / np.array([0.772, 1.05, 1.49]))
    fit = {
        "perpendicular": 1.85 - total + 7 * np.abs(total - 0.8) ** 3,
        "diffuse": 1.9 - total + 3.5 * (total - 0.8) ** 2,
        "diffuse-mfp": 3.5 + 100 * (total - 0.33) ** 4,
    }[mapping]
    s = fit / paths_mm
    r = profile.r_edges_mm[:, None]
    expected = total * (1 - np.exp(-s * r) / 4 - 3 * np.exp(-s * r / 3) / 4)
    np.testing.assert_allclose(
        profile.cumulative, expected, rtol=1e-4 if "mfp" in mapping else 1e-12
    )
    np.testing.assert_allclose(profile.diffuse_reflectance, total, rtol=1e-13)
    settings = profile.meta["settings"]
    assert (settings["mapping"], settings["reflectance"]) == (mapping, total.tolist())
    np.testing.assert_allclose(settings["s_per_mm"], s, rtol=1e-4)


def test_radii_are_those_of_the_shape():
    profile = simulate_burley(medium(0.1, 0.9, 1.3), reflectance=0.5, dr_mm=0.01, radius_mm=30.0)
    s = float(shapes.s_perpendicular(0.5))
    median = float(shapes.diffusion_radius(0.5, s))
    assert profile.cumulative_at(median)[0] == pytest.approx(0.25, abs=1e-6)


def test_without_a_reflectance_it_has_the_materials_own():
    # index-matched, along the normal: 1 - H(1) sqrt(1 - albedo), with g by the reduced albedo
    with pytest.warns(SssfitWarning, match="burley takes scattering as isotropic"):
        profile = simulate_burley(medium([0.1, 0.1, 0.5], [0.9, 9.0, 0.5], 1.0, [0.0, 0.9, 0.0]))
    np.testing.assert_allclose(profile.diffuse_reflectance, [0.41495, 0.41495, 0.11523], atol=5e-6)
    assert simulate_burley(SKIN).diffuse_reflectance[1] == pytest.approx(0.2096, abs=5e-5)
    below = stack(layer(0.1, 1.0, 0.0, 1.0), above=1.5)
    with pytest.raises(SimulationError, match=r"denser, by 1\.5"):
        simulate_burley(below)
    given = simulate_burley(below, reflectance=0.3)
    assert given.diffuse_reflectance[0] == pytest.approx(0.3)


def test_extremes():
    black = simulate_burley(medium([1.0, 0.1], [0.0, 0.9], 1.3))
    assert black.diffuse_reflectance[0] == 0.0
    assert black.diffuse_reflectance[1] > 0.0
    for sigma_a in (0.0, 1e-12):
        white = simulate_burley(medium(sigma_a, 1.0, 1.3))
        assert white.diffuse_reflectance[0] == pytest.approx(1 - (0.3 / 2.3) ** 2, abs=1e-5)
    whiter = simulate_burley(medium(1e-12, 1.0, 1.3), mapping="diffuse-mfp")
    assert whiter.diffuse_reflectance[0] == pytest.approx(1 - (0.3 / 2.3) ** 2, abs=1e-5)
    one = simulate_burley(SKIN, reflectance=0.2, dr_mm=3.0, radius_mm=3.0)
    assert one.n_annuli == 1
    many = simulate_burley(
        medium(np.full(64, 0.1), np.linspace(0.1, 6.4, 64), 1.3), reflectance=np.full(64, 0.2)
    )
    assert many.n_channels == 64


def test_anisotropy_enters_by_reduced_scattering():
    grid = {"dr_mm": 0.1, "radius_mm": 10.0}
    forward = simulate_burley(medium(0.05, 10.0, 1.4, 0.9), reflectance=0.5, **grid)
    plain = simulate_burley(medium(0.05, 1.0, 1.4), reflectance=0.5, **grid)
    np.testing.assert_allclose(forward.annulus_energy, plain.annulus_energy, rtol=1e-12)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"mapping": "searchlight"}, "perpendicular, diffuse, diffuse-mfp"),
        ({"reflectance": [0.1, 0.2]}, "each of 3 channels"),
        ({"reflectance": 1.1}, "from 0 to 1"),
        ({"reflectance": [0.1, math.nan, 0.3]}, "from 0 to 1"),
        ({"reflectance": "red"}, "from 0 to 1"),
        ({"radius_mm": 0.0}, "expected a length"),
    ],
)
def test_bad_settings_are_refused(settings, said):
    with pytest.raises(SimulationError, match=said):
        simulate_burley(SKIN, **settings)


def test_what_has_no_diffuse_mean_free_path_is_refused():
    with pytest.raises(SimulationError, match=r"channel c0.*infinite.*perpendicular"):
        simulate_burley(medium(0.0, 1.0, 1.3), mapping="diffuse-mfp")
    with pytest.raises(SimulationError, match="multipole or montecarlo"):
        simulate_burley(stack(layer(0.1, 1.0, 0.0, 1.3, 5.0)))
