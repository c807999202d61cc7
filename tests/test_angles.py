"""Exit angles and apertures of both walks, against theory, the scalar MCML and one another."""

import dataclasses
import math

import numpy as np
import pytest
import reference
from checks import LIMIT, chi_square_sigmas, medium, standard_error
from checks_layers import STACKS, layer, stack, sums_of

from sssfit.errors import ProfileError, SimulationError
from sssfit.grid import RadialGrid
from sssfit.material import load_material
from sssfit.optics import entering_of_diffuse
from sssfit.profile import Profile
from sssfit.profile.beam import Beam, under_beam
from sssfit.profile.directions import (
    angular_reflectance,
    lambertian_shares,
    radiance,
    solid_angles,
)
from sssfit.simulate import Checkpoint, read_checkpoint, simulate_montecarlo
from sssfit.simulate._directions import Directions
from sssfit.simulate._walks import LayeredWalk

PHOTONS, BINS = 100_000, 15
SLAB = STACKS["clear gap inside, backward g"]


@pytest.fixture(scope="module")
def skin():
    return simulate_montecarlo(load_material("skin1"), photons=PHOTONS, angles=BINS)


@pytest.fixture(scope="module")
def slab():
    return simulate_montecarlo(SLAB, photons=PHOTONS, dr_mm=0.1, radius_mm=2.0, angles=BINS)


def energies(profile):
    return np.vstack([profile.annulus_energy, profile.beyond_grid])


# Sums


def test_angles_add_up_to_the_profile_to_the_last_bit(skin, slab):
    for each in (skin, slab):
        np.testing.assert_array_equal(each.angle_reflected.sum(axis=1), energies(each))
    through = np.vstack([slab.annulus_transmittance, slab.beyond_grid_transmittance])
    np.testing.assert_array_equal(slab.angle_transmitted.sum(axis=1), through)


def test_angles_change_the_profile_by_rounding_only(skin, slab):
    plain = simulate_montecarlo(load_material("skin1"), photons=PHOTONS)
    np.testing.assert_allclose(energies(skin), energies(plain), rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(
        skin.annulus_energy_stderr, plain.annulus_energy_stderr, rtol=1e-9, atol=1e-15
    )
    plain = simulate_montecarlo(SLAB, photons=PHOTONS, dr_mm=0.1, radius_mm=2.0)
    np.testing.assert_allclose(slab.transmittance, plain.transmittance, rtol=1e-13)


@pytest.mark.parametrize("material", [load_material("skin1"), SLAB], ids=["half space", "slab"])
def test_threads_and_resumed_runs_give_the_same_bits(material, tmp_path):
    asked = {"dr_mm": 0.1, "radius_mm": 2.0, "angles": 7}
    whole = simulate_montecarlo(material, photons=PHOTONS, threads=1, **asked)
    save = Checkpoint(tmp_path / "half.checkpoint", 0.0)
    simulate_montecarlo(material, photons=50_000, threads=2, checkpoint=save, **asked)
    again = simulate_montecarlo(material, photons=PHOTONS, threads=2, checkpoint=save, **asked)
    np.testing.assert_array_equal(again.angle_reflected, whole.angle_reflected)
    np.testing.assert_array_equal(again.angle_reflected_stderr, whole.angle_reflected_stderr)
    with pytest.raises(SimulationError, match=r"angles = 7 \(now 8\)"):
        simulate_montecarlo(material, photons=PHOTONS, checkpoint=save, **asked | {"angles": 8})


def test_an_automatic_radius_keeps_the_angles():
    found = simulate_montecarlo(
        load_material("ketchup"), photons=PHOTONS, radius_mm="auto", angles=5
    )
    assert len(found.angle_reflected) == found.n_annuli + 1
    np.testing.assert_array_equal(found.angle_reflected.sum(axis=1), energies(found))


def test_a_beam_spreads_every_angle(slab):
    found = under_beam(slab, Beam("flat", 0.5))
    np.testing.assert_allclose(
        found.angle_reflected.sum(axis=0), slab.angle_reflected.sum(axis=0), atol=1e-12
    )
    np.testing.assert_allclose(found.angle_reflected.sum(axis=1), energies(found), atol=1e-12)


# Theory and the scalar loop


def test_chandrasekhars_law_of_diffuse_reflection():
    """Isotropic half space, normal light: R_d(mu) = a/(4 pi) mu / (1 + mu) H(mu) H(1) per sr."""
    albedo, photons, bins = 0.9, 1_000_000, 30
    found = simulate_montecarlo(
        medium(1.0 - albedo, albedo, 1.0), photons=photons, dr_mm=1.0, radius_mm=5.0, angles=bins
    )
    expected = reference.chandrasekhar_by_angle(albedo, found.exit_angle_edges_rad)
    assert expected.sum() == pytest.approx(reference.chandrasekhar_total(albedo), abs=1e-6)
    curve = angular_reflectance(found)
    solid = solid_angles(curve.edges_rad)
    ours, error = curve.per_sr[:, 0] * solid, curve.per_sr_stderr[:, 0] * solid
    sigmas, _ = chi_square_sigmas(ours - expected, error**2)
    assert abs(sigmas) < LIMIT


def test_the_layered_walk_has_the_angles_of_the_half_space():
    material, grid = load_material("skin1"), RadialGrid(0.5, 3)
    fast = simulate_montecarlo(
        material, photons=PHOTONS, dr_mm=grid.dr_mm, radius_mm=1.5, angles=BINS
    )
    n, directions = 200_000, Directions(BINS)
    sums = sums_of(LayeredWalk((material,), (grid,), 7, n, directions=directions)).above_by_angle
    entering = 1.0 - material.specular_reflectance
    ours = entering * sums[..., 0] / n
    variance = (entering * standard_error(sums[..., 0], sums[..., 1], n)) ** 2
    apart, variance = ours - fast.angle_reflected, variance + fast.angle_reflected_stderr**2
    for c in range(3):
        sigmas, _ = chi_square_sigmas(apart[..., c].ravel(), variance[..., c].ravel())
        assert abs(sigmas) < LIMIT


def test_both_sides_of_a_slab_against_the_scalar_mcml(slab):
    layers = SLAB.layers
    sums = reference.scalar_layered_walk(
        3,
        PHOTONS,
        *(
            np.array([getattr(each, name)[0] for each in layers])
            for name in ("sigma_a_per_mm", "sigma_s_per_mm", "g")
        ),
        np.array([SLAB.eta_above, *(each.eta for each in layers), SLAB.eta_below]),
        np.array([each.thickness_mm for each in layers]),
        SLAB.specular_reflectance,
        0,
        10.0,
        1,
        angles=BINS,
    )
    for theirs, ours, error in (
        (sums[0], slab.angle_reflected, slab.angle_reflected_stderr),
        (sums[1], slab.angle_transmitted, slab.angle_transmitted_stderr),
    ):
        w, squares = (theirs[:, k].reshape(2, BINS).sum(axis=0) for k in (0, 1))
        mean = ours[..., 0].sum(axis=0)
        own = (PHOTONS - 1) * error[..., 0] ** 2 + ours[..., 0] ** 2
        variance = (own.sum(axis=0) - mean**2) / (PHOTONS - 1)
        variance += standard_error(w, squares, PHOTONS) ** 2
        sigmas, _ = chi_square_sigmas(mean - w / PHOTONS, variance)
        assert abs(sigmas) < LIMIT


def test_densities_are_those_of_mcml(skin):
    """R_d(alpha) sin alpha, and R_d(r, alpha) cos alpha, over angles and area, are the energy."""
    curve, each = angular_reflectance(skin), radiance(skin)
    middles = np.radians(curve.angles_deg)
    width = np.diff(curve.edges_rad)
    # MCML's own solid angle, 2 pi sin(alpha) times the width, is 1.0005 of ours at 6 degrees
    total = (curve.per_sr * 2.0 * np.pi * (np.sin(middles) * width)[:, None]).sum(axis=0)
    np.testing.assert_allclose(total, skin.diffuse_reflectance, rtol=6e-4)
    area = np.pi * np.diff(skin.r_edges_mm**2)[:, None]
    seen = (each * (np.pi * np.sin(2.0 * middles) * width)[:, None]).sum(axis=1) * area
    np.testing.assert_allclose(seen, skin.annulus_energy, rtol=2e-3, atol=1e-15)


def test_lambertian_light_under_fresnel():
    edges = np.linspace(0.0, 0.5 * np.pi, 91)
    np.testing.assert_allclose(lambertian_shares(edges, 1.0), np.diff(np.sin(edges) ** 2))
    shares = lambertian_shares(edges, 1.4)
    assert shares.sum() == pytest.approx(1.0, abs=1e-14)
    # what leaves is what enters of diffuse light (reciprocity): the first bin is nearly normal
    normal = (1.0 - (0.4 / 2.4) ** 2) * math.sin(edges[1]) ** 2 / entering_of_diffuse(1.4)
    assert shares[0] == pytest.approx(normal, rel=1e-6)


# Apertures


@pytest.mark.parametrize("above", [1.0, 1.33])
def test_an_aperture_sees_the_angles_within_it(above):
    material = stack(layer([0.1, 0.2], 2.0, 0.5, 1.4, 1.0), above=above)
    asked = {"photons": 50_000, "dr_mm": 0.1, "radius_mm": 1.0}
    angles = simulate_montecarlo(material, angles=9, **asked)
    found = simulate_montecarlo(
        material, numerical_aperture=above * math.sin(math.radians(30.0)), **asked
    )
    within = angles.angle_reflected[:, :3].sum(axis=1)
    np.testing.assert_allclose(energies(found), within, rtol=1e-12)
    unseen = angles.angle_reflected[:, 3:].sum(axis=(0, 1))
    np.testing.assert_allclose(found.outside_aperture, unseen, rtol=1e-12)
    np.testing.assert_allclose(found.transmittance, angles.transmittance, rtol=1e-13)
    np.testing.assert_allclose(found.energy_balance, angles.energy_balance, atol=1e-13)
    assert found.meta["settings"]["numerical_aperture"] > 0.49


def test_an_aperture_of_the_half_space(skin):
    found = simulate_montecarlo(
        load_material("skin1"), photons=PHOTONS, numerical_aperture=math.sin(math.radians(60.0))
    )
    within = skin.angle_reflected[:, :10].sum(axis=1)
    np.testing.assert_allclose(energies(found), within, rtol=1e-12, atol=1e-18)
    balance = LIMIT * np.array(found.meta["energy_balance_stderr"]) + 1e-12
    assert (np.abs(found.energy_balance) < balance).all()


def test_the_widest_aperture_sees_everything():
    asked = {"photons": 20_000, "dr_mm": 0.1, "radius_mm": 1.0}
    whole = simulate_montecarlo(load_material("skin1"), **asked)
    found = simulate_montecarlo(load_material("skin1"), numerical_aperture=1.2, **asked)
    np.testing.assert_array_equal(found.annulus_energy, whole.annulus_energy)
    assert not found.outside_aperture.any()


# Files and bad input


def test_a_file_keeps_angles_and_says_its_version(skin, tmp_path):
    skin.save(tmp_path / "a.profile.npz")
    found = Profile.load(tmp_path / "a.profile.npz")
    assert found.meta["format"] == "sssfit.profile/2"
    for field in dataclasses.fields(Profile):
        if field.name != "meta":
            np.testing.assert_array_equal(getattr(found, field.name), getattr(skin, field.name))
    assert len(found.to_dict()["exit_angles"]) == BINS


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda p: {"meta": {**p.meta, "format": "sssfit.profile/1"}}, "format"),
        (lambda p: {"angle_reflected": 1.1 * p.angle_reflected}, "adds up to other energies"),
        (lambda p: {"angle_reflected": p.angle_reflected[:-1]}, "angle_reflected has shape"),
        (lambda _: {"angle_reflected_stderr": None}, "go together"),
        (lambda _: {"exit_angle_edges_rad": None}, "without exit_angle_edges_rad"),
        (lambda p: {"exit_angle_edges_rad": 2.0 * p.exit_angle_edges_rad}, "from 0 to pi/2"),
        (lambda _: {"outside_aperture": np.zeros(2)}, "outside_aperture has shape"),
    ],
)
def test_what_no_walk_makes_is_refused(skin, change, said):
    with pytest.raises(ProfileError, match=said):
        dataclasses.replace(skin, **change(skin))


def test_a_profile_without_angles_has_no_curve():
    plain = simulate_montecarlo(load_material("skin1"), photons=2000)
    with pytest.raises(ProfileError, match="has no exit angles; compute it with `angles = 30`"):
        angular_reflectance(plain)


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"angles": 0}, "angles = 0; give a whole number"),
        ({"angles": 181}, "angles = 181"),
        ({"angles": 2.5}, "angles = 2.5; give a whole number"),
        ({"numerical_aperture": 0.0}, "numerical_aperture = 0.0; give a number above 0"),
        ({"numerical_aperture": math.nan}, "numerical_aperture = nan"),
        ({"angles": 3, "numerical_aperture": 0.2}, "leave one out"),
        ({"angles": 180, "dr_mm": 0.001, "radius_mm": 50.0}, "27,000,540 bins, more than"),
    ],
)
def test_bad_directions_are_one_line(asked, said):
    with pytest.raises(SimulationError, match=said):
        simulate_montecarlo(load_material("skin1"), photons=2000, **asked)


def test_a_checkpoint_so_far_has_angles(tmp_path):
    path = tmp_path / "a.checkpoint"
    simulate_montecarlo(
        load_material("skin1"), photons=40_000, angles=3, checkpoint=Checkpoint(path, 0.0)
    )
    (found,) = read_checkpoint(path).profiles
    np.testing.assert_array_equal(found.angle_reflected.sum(axis=1), energies(found))
