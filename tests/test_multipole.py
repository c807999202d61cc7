"""The multipole against sums of images, convolutions in the plane, its limits, and the walk."""

import runpy
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
import reference_models as reference
from checks import LIMIT, medium
from checks_layers import layer, stack
from checks_models import BEYOND, DIFFUSE, WITHIN, multipole_against_walk
from scipy.interpolate import CubicSpline

from sssfit.errors import SimulationError, SssfitWarning
from sssfit.material import load_material
from sssfit.simulate import simulate_dipole, simulate_multipole
from sssfit.simulate.multipole import cumulative_from_transform


def entering(eta):
    return 1.0 - ((eta - 1.0) / (eta + 1.0)) ** 2


def cumulative_transmittance(profile):
    """T within each annulus edge (n + 1,) of the only channel."""
    return np.append(0.0, np.cumsum(profile.annulus_transmittance[:, 0]))


@pytest.mark.parametrize("sigma_tr", [0.0, 0.01, 0.3, 2.0])
@pytest.mark.parametrize("z", [0.02, 1.0, 30.0])
def test_hankel_inversion_against_closed_form(sigma_tr, z):
    r_mm = np.linspace(0.0, 60.0, 601)
    ours = cumulative_from_transform(lambda k: np.exp(-z * np.hypot(k, sigma_tr)), r_mm, z)
    d = np.hypot(r_mm, z)
    closed = np.exp(-sigma_tr * z) - z / d * np.exp(-sigma_tr * d)
    np.testing.assert_allclose(ours[:, 0], closed, rtol=0, atol=1e-13)


@pytest.mark.parametrize(
    ("sigma_a", "sigma_s", "g", "eta", "below", "thickness"),
    [
        (0.05, 1.0, 0.0, 1.4, 1.0, 5.0),
        (0.3, 0.9, 0.0, 1.0, 1.0, 2.5),
        (0.1, 20.0, 0.9, 1.5, 1.33, 3.0),
    ],
)
def test_slab_is_the_sum_of_its_images(sigma_a, sigma_s, g, eta, below, thickness):
    slab = stack(layer(sigma_a, sigma_s, g, eta, thickness), below=below)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SssfitWarning)
        profile = simulate_multipole(slab, dr_mm=0.1, radius_mm=20.0)
    a_0 = 1.0 if eta == 1.0 else reference.polynomial_mismatch(eta)
    a_d = 1.0 if eta == below else reference.polynomial_mismatch(eta / below)
    coefficients = (sigma_a, (1.0 - g) * sigma_s, a_0, a_d, thickness)
    transmittance = cumulative_transmittance(profile)
    for k in (1, 10, 60, 200):
        r = profile.r_edges_mm[k]
        for which, ours in ((0, profile.cumulative[k, 0]), (1, transmittance[k])):
            expected = reference.disk_energy(
                lambda t, which=which: reference.slab_density(t, *coefficients, 12)[which], r
            )
            assert ours == pytest.approx(entering(eta) * expected, abs=1e-12)


def test_thick_slab_is_the_dipole():
    slab = stack(layer([0.01, 0.3], [0.99, 0.7], 0.0, 1.4, 1e5))
    grid = {"dr_mm": 0.05, "radius_mm": 32.0}
    thick, dipole = (
        simulate_multipole(slab, **grid),
        simulate_dipole(stack(layer([0.01, 0.3], [0.99, 0.7], 0.0, 1.4)), **grid),
    )
    np.testing.assert_allclose(thick.cumulative, dipole.cumulative, rtol=0, atol=1e-13)
    np.testing.assert_allclose(thick.beyond_grid, dipole.beyond_grid, rtol=0, atol=1e-13)
    assert thick.transmittance.max() < 1e-100


def test_half_space_is_the_dipole():
    material = load_material("marble")
    ours, dipole = simulate_multipole(material), simulate_dipole(material)
    np.testing.assert_array_equal(ours.annulus_energy, dipole.annulus_energy)
    assert ours.meta["method"] == "multipole"
    assert ours.transmittance is None


def test_two_layers_are_convolutions_in_the_plane():
    top, bottom = (0.2, 1.0, 3.0), (0.1, 2.0, 2.0)
    material = stack(layer(*top[:2], 0.0, 1.4, top[2]), layer(*bottom[:2], 0.0, 1.4, bottom[2]))
    pitch, half = 0.1, 200
    a = reference.polynomial_mismatch(1.4)
    planes = reference.two_layers_by_convolution(
        (*top[:2], a, top[2]), (*bottom[:2], a, bottom[2]), pitch, half
    )
    profile = simulate_multipole(material, dr_mm=0.1, radius_mm=10.0)
    totals = (profile.diffuse_reflectance[0], profile.transmittance[0])
    cumulative = (profile.cumulative[:, 0], cumulative_transmittance(profile))
    x_mm = pitch * np.arange(-half, half + 1)
    for plane, total, ours in zip(planes, totals, cumulative, strict=True):
        # smooth over a third of a mm and more: sums over pixels are integrals
        assert total == pytest.approx(entering(1.4) * pitch**2 * plane.sum(), rel=1e-5)
        weighted = CubicSpline(x_mm, 2.0 * np.pi * x_mm * plane[half]).antiderivative()
        expected = entering(1.4) * (weighted(profile.r_edges_mm) - weighted(0.0))
        np.testing.assert_allclose(ours, expected, rtol=0, atol=1e-5 * total)


def test_layer_on_deep_ground_is_the_limit_of_a_thick_second_layer():
    top = layer(0.02, 3.0, 0.0, 1.4, 1.0)
    grid = {"dr_mm": 0.1, "radius_mm": 20.0}
    ground = simulate_multipole(stack(top, layer(0.1, 1.0, 0.0, 1.3)), **grid)
    thick = simulate_multipole(stack(top, layer(0.1, 1.0, 0.0, 1.3, 500.0)), **grid)
    np.testing.assert_allclose(ground.cumulative, thick.cumulative, rtol=0, atol=1e-13)
    assert ground.transmittance is None


def test_nothing_is_lost_without_absorption():
    slab = stack(layer(0.0, 1.0, 0.0, 1.5, 5.0), layer(0.0, 3.0, 0.4, 1.3, 4.0), below=1.2)
    profile = simulate_multipole(slab)
    left = profile.specular_reflectance + profile.diffuse_reflectance + profile.transmittance
    np.testing.assert_allclose(left, 1.0, rtol=1e-12)
    ground = simulate_multipole(stack(layer(0.0, 1.0, 0.0, 1.5, 5.0), layer(0.0, 3.0, 0.0, 1.3)))
    assert ground.specular_reflectance + ground.diffuse_reflectance[0] == pytest.approx(1.0)
    almost = simulate_multipole(stack(layer(1e-12, 1.0, 0.0, 1.5, 5.0)))
    none = simulate_multipole(stack(layer(0.0, 1.0, 0.0, 1.5, 5.0)))
    np.testing.assert_allclose(almost.cumulative, none.cumulative, atol=1e-10)


def test_matched_stack_turned_over_transmits_alike():
    one, other = layer(0.01, 0.99, 0.0, 1.0, 5.0), layer(0.2, 2.0, 0.0, 1.0, 3.0)
    grid = {"dr_mm": 0.2, "radius_mm": 30.0}
    down, up = (simulate_multipole(stack(*way), **grid) for way in ((one, other), (other, one)))
    np.testing.assert_allclose(
        down.annulus_transmittance, up.annulus_transmittance, rtol=0, atol=1e-13
    )
    assert abs(down.diffuse_reflectance - up.diffuse_reflectance) > 0.1


@pytest.mark.parametrize("name", DIFFUSE)
def test_totals_are_those_of_the_walk_within_five_per_cent(name):
    for each in multipole_against_walk(DIFFUSE[name], name, 200_000):
        assert abs(each.relative) < WITHIN, each.what
        # the walk must be able to tell
        assert LIMIT * each.noise < WITHIN, each.what
        assert each.energy.sum() == pytest.approx(each.total)
        assert each.walk_energy.sum() == pytest.approx(each.walk_total)
        assert len(each.relative_by_radius) == len(each.r_mm) > 20


def test_diffusion_fails_where_it_is_said_to():
    worst = {}
    for name, material in BEYOND.items():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SssfitWarning)
            found = multipole_against_walk(material, name, 100_000)
        worst[name] = max(abs(each.relative) for each in found)
    assert min(worst.values()) > WITHIN, worst


def test_thin_slabs_warn_and_thinner_ones_are_refused():
    with pytest.warns(SssfitWarning, match=r"1\.8 reduced mean free paths.*montecarlo"):
        simulate_multipole(stack(layer(0.1, 9.9, 0.9, 1.4, 1.8 / 1.09)))
    with pytest.warns(SssfitWarning, match=r"5 % of the light.*without a collision"):
        simulate_multipole(stack(layer(0.1, 0.9, 0.0, 1.4, 3.0)))
    for thickness, said in ((1.0, "is 1 reduced"), (0.1, "is 0.1 reduced")):
        with pytest.raises(SimulationError, match=rf"layer 1, channel c0 {said}.*montecarlo"):
            simulate_multipole(stack(layer(0.1, 0.9, 0.0, 1.4, thickness)))


def test_slab_just_thick_enough_still_adds_up():
    with pytest.warns(SssfitWarning):
        profile = simulate_multipole(stack(layer(0.0, 1.0, 0.0, 1.4, 1.0 + 1e-9)))
    left = profile.specular_reflectance + profile.diffuse_reflectance + profile.transmittance
    np.testing.assert_allclose(left, 1.0, rtol=1e-12)


def test_clear_layers_and_strange_indices_are_refused():
    glass, milk = layer(0.0, 0.0, 0.0, 1.5, 1.0), layer(0.01, 1.0, 0.0, 1.3, 5.0)
    with pytest.raises(SimulationError, match=r"layer 1, channel c0 is clear.*montecarlo"):
        simulate_multipole(stack(glass, milk))
    with pytest.raises(SimulationError, match=r"layer 2, channel c1 is clear"):
        simulate_multipole(
            stack(
                layer([0.1, 0.1], [1.0, 1.0], 0.0, 1.3, 5.0),
                layer([0.1, 0.0], [1.0, 0.0], 0.0, 1.3, 5.0),
            )
        )
    with pytest.raises(SimulationError, match=r"index 3.*montecarlo"):
        simulate_multipole(stack(layer(0.01, 1.0, 0.0, 3.0, 5.0)))
    with pytest.raises(SimulationError, match="load_material"):
        simulate_multipole("skin1")
    with pytest.raises(SimulationError, match="expected a length"):
        simulate_multipole(stack(milk), radius_mm=0.0)


def test_absorbers_one_annulus_and_many_channels():
    black = simulate_multipole(stack(layer(1.0, 0.0, 0.0, 1.3, 6.0), layer(1.0, 0.0, 0.0, 1.3)))
    assert black.diffuse_reflectance[0] == 0.0
    slab = stack(layer(0.01, 0.99, 0.0, 1.4, 5.0))
    one = simulate_multipole(slab, dr_mm=4.0, radius_mm=4.0)
    fine = simulate_multipole(slab, dr_mm=0.5, radius_mm=4.0)
    np.testing.assert_allclose(one.annulus_energy[0], fine.total_on_grid, rtol=1e-12)
    np.testing.assert_allclose(one.transmittance, fine.transmittance, rtol=1e-12)
    sigma_s = np.linspace(1.0, 6.0, 64)
    many = simulate_multipole(stack(layer(np.full(64, 0.1), sigma_s, 0.0, 1.3, 5.0)))
    alone = simulate_multipole(
        stack(layer(0.1, sigma_s[40], 0.0, 1.3, 5.0)),
        dr_mm=many.r_edges_mm[1],
        radius_mm=many.r_edges_mm[-1],
    )
    np.testing.assert_allclose(many.cumulative[:, 40], alone.cumulative[:, 0], atol=1e-13)


def test_profile_of_a_slab_has_all_it_needs():
    profile = simulate_multipole(stack(layer(0.01, 0.99, 0.0, 1.4, 5.0)))
    assert np.isnan(profile.annulus_energy_stderr).all()
    assert profile.transmittance_stderr is None
    assert np.isnan(profile.energy_balance).all()
    assert medium(0.01, 0.99, 1.4).specular_reflectance == profile.specular_reflectance


def test_the_figure_of_the_differences_can_be_drawn(tmp_path, monkeypatch):
    script = Path(__file__).parents[1] / "docs" / "make_multipole.py"
    picture = tmp_path / "multipole.png"
    monkeypatch.setattr(sys, "argv", [str(script), "2e4", str(picture)])
    monkeypatch.setattr(sys, "path", list(sys.path))
    made = runpy.run_path(str(script), run_name="__main__")
    assert picture.read_bytes().startswith(b"\x89PNG")
    *_, rule, first, second = made["table"](
        20_000, {"slab": DIFFUSE["slab, 5 mean free paths"]}
    ).splitlines()
    assert first.startswith("| slab | R | 0.5")
    assert second.startswith("|  | T | 0.2")
    assert {line.count("|") for line in (rule, first, second)} == {13}
