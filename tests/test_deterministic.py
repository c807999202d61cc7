"""Energies that are computed: their guards, and records without photons or errors."""

import io

import numpy as np
import pytest

from sssfit.chart.page import save_figure
from sssfit.chart.profile import profile_figure
from sssfit.errors import SimulationError
from sssfit.formats.csv import csv_text, parse_csv
from sssfit.grid import RadialGrid
from sssfit.material import load_material
from sssfit.profile import Profile
from sssfit.simulate._deterministic import (
    computed_profile,
    energies_from_beyond,
    energies_from_cumulative,
    half_space,
)

SKIN = load_material("skin1")
GRID = RadialGrid(0.1, 40)


def some_beyond():
    return np.array([0.4, 0.2, 0.1]) * np.exp(-np.outer(GRID.r_edges_mm, [1.0, 2.0, 3.0]))


def test_energies_add_up_to_the_total_either_way():
    beyond = some_beyond()
    one = energies_from_beyond(beyond)
    other = energies_from_cumulative(beyond[0] - beyond, beyond[0])
    assert one.shape == other.shape == (GRID.annuli + 1, 3)
    np.testing.assert_allclose(one.sum(axis=0), beyond[0], rtol=1e-14)
    np.testing.assert_allclose(other.sum(axis=0), beyond[0], rtol=1e-14)
    np.testing.assert_allclose(one, other, atol=1e-16)


def test_what_leaves_beyond_keeps_its_digits_in_the_tail():
    r = np.linspace(0.0, 300.0, 31)[:, None]
    energy = energies_from_beyond(np.exp(-r))
    np.testing.assert_allclose(energy[:-1], -np.exp(-r[:-1]) * np.expm1(-10.0), rtol=1e-13)


def test_falling_f_is_flattened_within_the_tolerance_and_no_further_from_the_truth():
    truth = np.linspace(0.0, 1.0, 401)[:, None]
    noise = 1e-3 * np.sin(1e4 * truth)
    noise[0] = 0.0
    energy = energies_from_cumulative(truth + noise, np.array([1.0]), tolerance=2e-2)
    assert (energy >= 0.0).all()
    assert (np.diff(truth + 0.05 * np.sin(300.0 * truth), axis=0) < 0.0).any()
    cumulative = np.concatenate(([[0.0]], np.cumsum(energy, axis=0)[:-1]))
    assert np.max(np.abs(cumulative - truth)) <= np.max(np.abs(noise)) + 1e-15
    with pytest.raises(SimulationError, match="falls by"):
        energies_from_cumulative(truth + 0.05 * np.sin(300.0 * truth), np.array([1.0]))


@pytest.mark.parametrize(
    ("cumulative", "total", "said"),
    [
        ([[0.0], [np.nan]], [1.0], "not finite"),
        ([[0.1], [0.2]], [1.0], r"F\(0\)"),
        ([[0.0], [0.2]], [0.1], "falls by 0.1"),
        ([[0.0], [0.0]], [-1e-3], "falls by 0.001"),
    ],
)
def test_bad_cumulative_is_refused(cumulative, total, said):
    with pytest.raises(SimulationError, match=said):
        energies_from_cumulative(np.array(cumulative), np.array(total))


def test_bad_energy_beyond_is_refused():
    for bad, said in (([[1.0], [1.1]], "rises"), ([[1.0], [np.inf]], "not finite")):
        with pytest.raises(SimulationError, match=said):
            energies_from_beyond(np.array(bad))


def test_nothing_scatters_is_no_energy():
    nothing = np.zeros((3, 2))
    assert not energies_from_cumulative(nothing, np.zeros(2)).any()
    assert not energies_from_beyond(nothing).any()


def test_profile_has_provenance_and_no_photons():
    energy = energies_from_beyond(some_beyond())
    profile = computed_profile(SKIN, "dipole", GRID, energy, settings={"mapping": "none"})
    assert profile.photons is None
    assert profile.meta["method"] == "dipole"
    assert profile.meta["settings"] == {"dr_mm": 0.1, "radius": "given", "mapping": "none"}
    assert profile.meta["material_sha256"] == SKIN.sha256
    np.testing.assert_allclose(profile.diffuse_reflectance, [0.4, 0.2, 0.1], rtol=1e-14)
    assert np.isnan(profile.energy_balance).all()
    assert np.isnan(profile.diffuse_reflectance_stderr).all()


def test_errors_transmittance_and_absorption_are_kept():
    energy = energies_from_beyond(some_beyond())
    profile = computed_profile(
        SKIN,
        "exact",
        GRID,
        energy,
        stderr=0.01 * energy,
        transmitted=0.5 * energy,
        absorbed=np.full((1, 3), 0.1),
        relative_error=1e-4,
    )
    np.testing.assert_array_equal(profile.annulus_energy_stderr, 0.01 * energy[:-1])
    np.testing.assert_array_equal(profile.beyond_grid_stderr, 0.01 * energy[-1])
    np.testing.assert_allclose(profile.transmittance, 0.5 * profile.diffuse_reflectance)
    specular = SKIN.specular_reflectance
    expected = specular + 1.5 * profile.diffuse_reflectance + 0.1 - 1.0
    np.testing.assert_allclose(profile.energy_balance, expected, rtol=1e-13)
    assert profile.meta["relative_error"] == 1e-4


def test_profile_without_errors_goes_through_file_table_and_chart():
    profile = computed_profile(SKIN, "dipole", GRID, energies_from_beyond(some_beyond()))
    stream = io.BytesIO()
    profile.write(stream)
    same = Profile.read(io.BytesIO(stream.getvalue()))
    np.testing.assert_array_equal(same.annulus_energy, profile.annulus_energy)
    assert dict(same.meta) == dict(profile.meta)
    table = parse_csv(csv_text(profile), "a.csv")
    np.testing.assert_array_equal(table.annulus_energy, profile.annulus_energy)
    assert np.isnan(table.annulus_energy_stderr).all()
    save_figure(profile_figure(profile), io.BytesIO(), format="png")


def test_other_than_half_spaces_are_refused_with_what_to_use():
    assert half_space(SKIN, "exact") is SKIN.layers[0]
    with pytest.raises(SimulationError, match="load_material"):
        half_space("skin1", "exact")
    record = SKIN.to_dict()
    layer = record["layers"][0]
    slab = type(SKIN).from_dict({**record, "layers": [{**layer, "thickness_mm": 1.0}]})
    with pytest.raises(SimulationError, match=r"finite thickness.*exact.*multipole"):
        half_space(slab, "exact")
    stack = type(SKIN).from_dict({**record, "layers": [{**layer, "thickness_mm": 1.0}, layer]})
    with pytest.raises(SimulationError, match=r"several layers.*dipole.*montecarlo"):
        half_space(stack, "dipole")
