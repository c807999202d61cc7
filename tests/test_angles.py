"""Exit angles and apertures of both walks, against theory, the scalar MCML and one another."""

import csv
import dataclasses
import math

import numpy as np
import pytest
import reference
from checks import LIMIT, chi_square_sigmas, medium, standard_error
from checks_layers import STACKS, layer, stack, sums_of
from figures import assert_legible

from sssfit.chart.angles import angles_figure
from sssfit.errors import KernelError, ProfileError, SimulationError
from sssfit.export import exported
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
from sssfit.simulate import (
    Checkpoint,
    read_checkpoint,
    simulate_exact,
    simulate_montecarlo,
)
from sssfit.simulate._directions import Directions
from sssfit.simulate.stack.angles import energies_by_angle
from sssfit.simulate.walk_layered import LayeredWalk

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


def test_angles_take_as_many_directions_as_the_tolerance_asks_for():
    """28 and 36 of them, which were all there were, differ by 2e-4 of such a medium's light."""
    edges = np.linspace(0.0, 0.5 * np.pi, 7)
    few, many = (
        energies_by_angle(medium(0.1, 1.0, 1.0, g=-0.95), edges, each) for each in (1e-2, 1e-5)
    )
    off = np.abs(few["angle_reflected"] - many["angle_reflected"])
    assert (off <= few["angle_reflected_stderr"]).all()
    assert many["angle_reflected_stderr"].max() < 1e-5 < 1e-4 < few["angle_reflected_stderr"].max()


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


def test_the_widest_aperture_sees_everything(caplog):
    asked = {"photons": 20_000, "dr_mm": 0.1, "radius_mm": 1.0}
    whole = simulate_montecarlo(load_material("skin1"), **asked)
    with caplog.at_level("INFO", logger="sssfit"):
        Directions(aperture=1.0).note_wide(load_material("skin1"))
        assert not caplog.text
        found = simulate_montecarlo(load_material("skin1"), numerical_aperture=1.2, **asked)
    assert "`numerical_aperture = 1.2` is above 1, the index above the surface" in caplog.text
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
    with pytest.raises(ProfileError, match="have them with `angles = 30`"):
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


# Table and chart


def test_the_table_has_every_digit(skin):
    found = exported([skin], "angles")
    rows = list(csv.reader(found.content.decode().splitlines()[3:]))
    values = np.array(rows[1:], float)
    curve = angular_reflectance(skin)
    np.testing.assert_array_equal(values[:, 2:5], curve.per_sr)
    np.testing.assert_array_equal(values[:, 5:8], curve.per_sr_stderr)
    np.testing.assert_array_equal(values[:, 8:], curve.lambertian)


def test_only_profiles_have_a_table_of_angles(skin):
    with pytest.raises(KernelError, match="of one profile"):
        exported([skin, skin], "angles")


def test_the_chart_is_legible_and_its_curves_are_the_record(skin):
    curve = angular_reflectance(skin)
    figure = assert_legible(lambda: angles_figure(curve))
    left, right = figure.axes[-2:]
    drawn = [line.get_ydata() for line in left.lines]
    assert any(np.array_equal(each, curve.per_sr[:, 0]) for each in drawn)
    assert any(np.array_equal(each, curve.lambertian[:, 2]) for each in drawn)
    assert any(np.array_equal(each.get_ydata(), curve.ratio[:, 1]) for each in right.lines)


def test_noise_alone_is_what_lambertian_light_misplaces():
    """Multinomial counts of a Lambertian medium: the mean of 200 draws is the claimed one."""
    edges = np.linspace(0.0, 0.5 * np.pi, 16)
    shares, rng, n = lambertian_shares(edges, 1.0), np.random.default_rng(4), 10_000
    found = []
    for _ in range(200):
        energy = (rng.multinomial(n, shares) / n)[None, :, None]
        stderr = np.sqrt(energy * (1.0 - energy) / (n - 1))
        curve = angular_reflectance(lit_from_all_sides(edges, energy, stderr, n))
        found.append((float(curve.misplaced[0]), float(curve.misplaced_stderr[0])))
    misplaced, claimed = np.array(found).T
    error = misplaced.std() / math.sqrt(200.0)
    assert abs(misplaced.mean() - claimed.mean()) < LIMIT * error


def lit_from_all_sides(edges, energy, stderr, photons):
    """A profile whose light is in one annulus, with its angles."""
    one, none = np.ones((1, 1)), np.zeros(1)
    meta = {"format": "sssfit.profile/2", "channels": ["grey"], "photons": photons}
    return Profile(
        np.array([0.0, 1.0]), one, 0.0 * one, none, none, 0.0, np.zeros((0, 1)), none, None, meta,
        exit_angle_edges_rad=edges, angle_reflected=energy, angle_reflected_stderr=stderr,
    )  # fmt: skip


# The exact solver, at k = 0


@pytest.mark.parametrize("albedo", [0.5, 0.99])
def test_the_solver_has_chandrasekhars_law_to_eight_digits(albedo):
    edges = np.linspace(0.0, 0.5 * np.pi, 16)
    found = energies_by_angle(medium(1.0 - albedo, albedo, 1.0), edges, 1e-4)
    expected = reference.chandrasekhar_by_angle(albedo, edges, nodes=100)
    # the reference's trapezia are good to 2e-8
    np.testing.assert_allclose(found["angle_reflected"][0, :, 0], expected, atol=3e-8)
    assert found["angle_reflected_stderr"].max() < 1e-8


def test_the_walk_has_the_angles_of_the_solver(slab, skin):
    exact = energies_by_angle(load_material("skin1"), skin.exit_angle_edges_rad, 1e-4)
    pairs = [(skin, "angle_reflected", exact)]
    exact = energies_by_angle(SLAB, slab.exit_angle_edges_rad, 1e-4)
    pairs += [(slab, name, exact) for name in ("angle_reflected", "angle_transmitted")]
    for walk, name, truth in pairs:
        mean, error = getattr(walk, name), getattr(walk, f"{name}_stderr")
        square = ((PHOTONS - 1) * error**2 + mean**2).sum(axis=0)
        mean = mean.sum(axis=0)
        variance = (square - mean**2) / (PHOTONS - 1)
        for c in range(mean.shape[1]):
            apart = mean[:, c] - truth[name][0, :, c]
            sigmas, _ = chi_square_sigmas(apart, variance[:, c])
            assert abs(sigmas) < LIMIT


def test_an_exact_profile_has_angles_that_add_up_to_its_total(tmp_path):
    found = simulate_exact(load_material("skin1"), dr_mm=0.5, radius_mm=10.0, angles=6)
    assert found.angle_reflected.shape == (1, 6, 3)
    total = found.angle_reflected.sum(axis=(0, 1))
    np.testing.assert_allclose(total, found.diffuse_reflectance, atol=1e-6)
    assert found.meta["settings"]["angles"] == 6
    found.save(tmp_path / "e.npz")
    assert Profile.load(tmp_path / "e.npz").angle_reflected.shape == (1, 6, 3)
    with pytest.raises(ProfileError, match="for all annuli together only"):
        radiance(found)


def test_the_beam_is_in_the_first_bin():
    """Straight through a slab of index 1.5, once: (1 - R)^2 exp(-1.3)."""
    material = stack(layer(0.3, 1.0, 0.5, 1.5, 1.0))
    found = energies_by_angle(material, np.linspace(0.0, 0.5 * np.pi, 91), 1e-4)
    through = (1.0 - (0.5 / 2.5) ** 2) ** 2 * math.exp(-1.3)
    first, second = found["angle_transmitted"][0, :2, 0]
    assert through < first < 1.01 * through
    assert second < 0.01 * through
