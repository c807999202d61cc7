"""The exact solver against theory, against brute force, against the photon walk, and itself."""

import threading
from dataclasses import replace

import checks
import checks_exact
import numpy as np
import pytest
import reference
import reference_exact
from scipy import special

from sssfit.errors import SimulationError, StoppedError
from sssfit.grid import make_grid
from sssfit.material import Layer, Material, load_material
from sssfit.optics import normal_transmittance
from sssfit.profile import Profile
from sssfit.simulate import _depth, half_space
from sssfit.simulate._depth import (
    _Equation,
    _integrate_over_w,
    _panels,
    _tables,
    decay_rate,
    respond,
    respond_to_diffuse_light,
)
from sssfit.simulate._mixture import (
    mixture_of,
    single_scattering_beyond,
    single_scattering_of_diffuse_light,
)
from sssfit.simulate.exact import simulate_exact
from sssfit.simulate.half_space import (
    _LEVELS,
    _errors,
    _Solution,
    _stderr,
    diffuse_reflectance,
    entering_light,
)

FEW = ("skin1", "ketchup")
FINER = 5e-6  # a tolerance that these meet with one more resolution than by default


@pytest.fixture(scope="module")
def plain():
    """The plainest medium, by default settings."""
    return simulate_exact(checks.medium(0.3, 0.7, 1.3))


@pytest.fixture(scope="module")
def skin1():
    return checks_exact.exact_profiles(("skin1",), 1e-4)[0]


def test_totals_are_chandrasekhars():
    albedos = [0.1, 0.5, 0.9, 0.99, 0.999]
    theory = [reference.chandrasekhar_total(each) for each in albedos]
    np.testing.assert_allclose(diffuse_reflectance(albedos, 1.0), theory, rtol=0, atol=1e-8)
    profile = simulate_exact(checks.medium(1.0 - np.array(albedos), np.array(albedos), 1.0))
    np.testing.assert_allclose(profile.diffuse_reflectance, theory, rtol=0, atol=1e-5)


def test_totals_under_diffuse_light_are_chandrasekhars():
    albedos = [0.0, 0.1, 0.5, 0.9, 0.99, 0.999]
    theory = [reference.chandrasekhar_diffuse_total(each) for each in albedos]
    found = diffuse_reflectance(albedos, 1.0, light="diffuse")
    np.testing.assert_allclose(found, theory, rtol=0, atol=1e-8)


@pytest.mark.parametrize(("eta", "albedo", "seed"), [(1.3, 0.9, 1), (1.3, 0.5, 2), (2.0, 0.9, 3)])
def test_totals_under_diffuse_light_are_a_literal_walks(eta, albedo, seed):
    photons = 500_000
    specular, left = np.array(reference.diffuse_light_walk(seed, photons, albedo, eta)) / photons
    for share, expected in (
        (specular, 1.0 - entering_light(eta, "diffuse")),
        (left, diffuse_reflectance([albedo], eta, light="diffuse")[0]),
    ):
        stderr = np.sqrt(share * (1.0 - share) / photons)
        assert abs(share - expected) < checks.LIMIT * stderr


@pytest.mark.parametrize("eta", [1.001, 1.1, 1.3, 1.5, 2.0, 4.0])
def test_a_beam_along_the_normal_enters_by_fresnel(eta):
    assert entering_light(eta) == pytest.approx(1.0 - ((eta - 1.0) / (eta + 1.0)) ** 2, abs=1e-15)


@pytest.mark.parametrize("eta", [1.0, 1.0001, 1.3, 2.0, 4.0])
def test_energy_of_diffuse_light_is_conserved_at_every_albedo(eta):
    albedos = np.array([0.0, 0.001, 0.3, 0.9, 0.999, 0.99999, 1.0 - 1e-12, 1.0])
    response = respond_to_diffuse_light(eta, albedos, _LEVELS[3].depth)
    total = diffuse_reflectance(albedos, eta, light="diffuse")
    np.testing.assert_allclose(
        total + response.absorbed, entering_light(eta, "diffuse"), rtol=0, atol=5e-8
    )


def test_single_scattering_of_diffuse_light_is_its_closed_form():
    assert single_scattering_of_diffuse_light(1.0) == pytest.approx(
        2.0 / 3.0 * (1.0 - np.log(2.0)), abs=1e-10
    )
    for eta in (1.3, 2.0):
        # At albedo 1e-7 what is scattered twice is some 1e-7 of what is scattered once.
        found = diffuse_reflectance([1e-7], eta, light="diffuse")[0] / 1e-7
        assert found == pytest.approx(reference_exact.single_scattering_of_diffuse(eta), rel=1e-6)


def test_light_along_the_normal_and_view_along_it_change_places():
    # Helmholtz: what leaves along the normal under diffuse light is R_d of a beam along it.
    eta, albedo = 1.3, 0.9
    equation = _Equation.of(0.0, eta, _LEVELS[2].depth)
    depths, weights = equation.panels.nodes.ravel(), equation.panels.weights.ravel()
    seen = replace(equation, escape=normal_transmittance(eta) * np.exp(-depths) / (4.0 * eta**2))
    first = 4.0 * eta**2 * equation.escape
    multiple = seen.solve(first, np.array([albedo])).multiple[0]
    once = albedo * np.sum(weights * first * seen.escape)
    assert multiple + once == pytest.approx(diffuse_reflectance([albedo], eta)[0], abs=1e-7)


# At an index of 1.0001 each wavenumber takes five times as long, and a smaller grid has fewer.
@pytest.mark.parametrize(
    ("eta", "radius_mm"),
    [(1.0, None), (1.0001, 2.0), pytest.param(1.3, None, marks=pytest.mark.slow), (2.0, None)],
)
def test_without_absorption_everything_comes_back(eta, radius_mm):
    profile = simulate_exact(checks.medium([0.0], [1.0], eta), radius_mm=radius_mm)
    assert profile.diffuse_reflectance[0] == pytest.approx(
        1.0 - profile.specular_reflectance, abs=1e-6
    )
    assert profile.absorbed[0, 0] == 0.0


@pytest.mark.parametrize("eta", [1.0, 1.3, 1.5, 2.0])
def test_single_scattering_is_its_closed_form(eta):
    radii = np.array([0.0, 1e-4, 0.003, 0.05, 0.7, 3.0, 20.0])
    beyond = single_scattering_beyond(radii, eta, 0.05)
    theory = [reference.single_scattering_cumulative(r, 1.0, eta) for r in (*radii[1:], 1e9)]
    np.testing.assert_allclose(beyond[0] - beyond[1:], theory[:-1], rtol=0, atol=1e-9)
    assert beyond[0] == pytest.approx(theory[-1], abs=1e-9)


@pytest.mark.parametrize(
    ("k", "eta"),
    [
        *((0.0, 1.0), (0.7, 1.0), (12.0, 1.0), (0.7, 1.3)),
        pytest.param(0.0, 1.3, marks=pytest.mark.slow),
        pytest.param(3.0, 1.5, marks=pytest.mark.slow),
    ],
)
def test_double_scattering_is_brute_force(k, eta):
    # At albedo 1e-6 what is scattered three times is a millionth of what is scattered twice.
    albedo = 1e-6
    theory = reference_exact.double_scattering(k, eta, nodes=6)  # 3e-8 from 8 and 10
    for level in _LEVELS[1:3]:
        solved = respond(k, eta, np.array([albedo]), level.depth).multiple[0]
        assert solved / albedo**2 == pytest.approx(theory, abs=2e-7)


@pytest.mark.parametrize("eta", [1.0, 1.001, 1.3, 2.0])
def test_energy_is_conserved_at_every_albedo(eta):
    albedos = np.array([0.001, 0.3, 0.9, 0.999, 0.99999, 1.0 - 1e-12])
    response = respond(0.0, eta, albedos, _LEVELS[2].depth)
    once = albedos * single_scattering_beyond(np.zeros(1), eta, 0.05)
    enters = 1.0 - ((eta - 1.0) / (eta + 1.0)) ** 2
    np.testing.assert_allclose(response.multiple + once + response.absorbed, enters, atol=1e-7)


def test_an_integral_is_that_of_its_distance_alone():
    distances = np.geomspace(1e-9, 40.0, 300)  # more than one block of them
    whole = _integrate_over_w(distances, 0.7, lambda tau, p: p / tau)[0]
    alone = [_integrate_over_w(each, 0.7, lambda tau, p: p / tau) for each in distances[:, None]]
    np.testing.assert_allclose(whole, np.ravel(alone), rtol=1e-13)


@pytest.mark.parametrize("eta", [1.0 + 1e-8, 1.0 + 1e-7, 1.0 + 1e-6, 1.00001, 1.0001, 1.001, 1.01])
def test_all_light_comes_back_at_an_index_just_above_one(eta):
    returned = diffuse_reflectance([1.0], eta)[0]
    assert returned == pytest.approx(entering_light(eta), abs=5e-8 if eta <= 1.001 else 1e-8)


@pytest.mark.parametrize("k", [0.0, 0.3, 20.0])
@pytest.mark.parametrize("eta", [1.000001, 1.0005, 1.3, 3.0])
def test_interpolated_entries_of_tables_are_those_that_would_be_computed(monkeypatch, eta, k):
    resolution = _LEVELS[1].depth
    panels = _panels(np.hypot(1.0, k), resolution)
    _, (direct, _, _, escape, _) = _tables(k, eta, panels, resolution)
    monkeypatch.setattr(_depth, "_COARSER", 1)
    _, (all_direct, _, _, all_escape, _) = _tables(k, eta, panels, resolution)
    np.testing.assert_allclose(direct, all_direct, rtol=0, atol=1e-11)
    np.testing.assert_allclose(escape, all_escape, rtol=0, atol=1e-11)


@pytest.mark.parametrize("albedo", [0.0, 0.01, 0.05, 0.0501, 0.3, 1 - 1e-5, 1 - 2e-6, 1 - 1e-9])
def test_decay_rate_solves_its_equation(albedo):
    rate = decay_rate(albedo)
    assert 0.0 <= rate <= 1.0
    if 0.06 < albedo < 1.0:
        assert albedo * np.arctanh(rate) / rate == pytest.approx(1.0, abs=1e-9)


def test_mixture_inverts_a_transform_with_a_closed_form():
    # int_a^b 2q/(k^2+q^2) dq = log((k^2+b^2)/(k^2+a^2)) comes from 2 (K0(a r) - K0(b r)) beyond r.
    a, b = 0.3, 8.0
    k = 0.3 * np.sinh(np.linspace(0.0, 6.0, 40))
    scale = np.log(b**2 / a**2)
    mixture = mixture_of(k, np.log((k**2 + b**2) / (k**2 + a**2)) / scale, 0.1)
    r = np.geomspace(1e-3, 30.0, 60)
    theory = 2.0 * (special.k0(a * r) - special.k0(b * r)) / scale
    np.testing.assert_allclose(mixture.beyond(r), theory, rtol=0, atol=1e-6)
    assert mixture.misfit < 1e-6
    assert (mixture.weights > 0.0).all()


def test_what_is_no_mixture_is_found_out():
    k = np.linspace(0.0, 30.0, 60)
    assert mixture_of(k, np.exp(-((k - 10.0) ** 2)), 0.1).misfit > 0.1


def test_edges_agree_with_a_much_finer_run():
    for name, apart, claimed in checks_exact.shares_apart(FEW, fine=FINER):
        assert apart > 0.0, f"{name}: the runs have the same resolution"
        assert apart < 1e-4, name
        assert claimed < 1e-4, name
        assert apart < claimed, f"{name}: the error estimate is too small"


@pytest.mark.slow
def test_edges_agree_with_a_much_finer_run_for_all():
    for name, apart, claimed in checks_exact.shares_apart():
        assert apart < min(1e-4, claimed), name


def test_profile_is_that_of_the_walk():
    for figure in checks_exact.against_walk(2_000_000, names=("skin1",)):
        assert abs(figure.sigmas) < checks.LIMIT, figure


def test_eleven_profiles_are_those_of_the_walk():
    for figure in checks_exact.against_walk(150_000):
        assert abs(figure.sigmas) < checks.LIMIT, figure


@pytest.mark.slow
def test_eleven_profiles_are_those_of_the_walk_in_full():
    for figure in checks_exact.against_walk(100_000_000, tolerance=checks_exact.FINE):
        assert abs(figure.sigmas) < checks.LIMIT, figure


def test_error_is_kept_as_standard_error(skin1):
    profile = skin1
    worst = np.max(profile.diffuse_reflectance_stderr / profile.diffuse_reflectance)
    # Squares of annuli add up to that of F; an annulus's own difference can exceed its step.
    assert profile.meta["relative_error"] <= worst * (1.0 + 1e-9)
    assert worst < 3.0 * profile.meta["relative_error"]
    assert (profile.diffuse_reflectance_stderr >= profile.cumulative_stderr[-1]).all()
    assert profile.photons is None
    assert profile.meta["settings"]["tolerance"] == 1e-4


def test_standard_errors_cover_annuli_and_sums():
    fine = _Solution(np.array([1.0, 0.7, 0.4, 0.1]), 0.0, 0.0)
    coarse = _Solution(np.array([1.0, 0.6, 0.4, 0.2]), 0.0, 0.0)
    errors = _errors(fine, coarse)
    np.testing.assert_allclose(errors, [0.1, 0.0, 0.1, 0.0], atol=1e-15)
    stderr = _stderr(fine, coarse, errors)
    # Annuli differ by -0.1, 0.1, 0.1 and what lies beyond by -0.1, while F is off by 0.1 at most.
    np.testing.assert_allclose(stderr, 0.1)
    assert (np.sqrt(np.cumsum(stderr**2)) >= np.maximum.accumulate(errors)).all()


def test_the_error_is_never_below_the_energy_that_is_missing():
    answer = _Solution(np.array([1.0, 0.7, 0.4, 0.1]), 0.0, 0.05)
    np.testing.assert_array_equal(_errors(answer, answer), 0.05)


def test_energy_that_is_missing_counts_as_error(plain, monkeypatch):
    material, total = checks.medium(0.3, 0.7, 1.3), plain.diffuse_reflectance[0]
    # Three thousandths of the light are said to have come in that neither leave nor are absorbed.
    monkeypatch.setattr(
        half_space, "normal_transmittance", lambda eta: normal_transmittance(eta) + 0.003
    )
    profile = simulate_exact(material, tolerance=0.1)
    assert profile.meta["relative_error"] == pytest.approx(0.003 / total, rel=1e-3)
    np.testing.assert_allclose(profile.meta["energy_balance_stderr"], 0.003, rtol=1e-3)
    assert (profile.diffuse_reflectance_stderr >= 0.00299).all()
    monkeypatch.setattr(half_space, "_LEVELS", _LEVELS[:2])  # others take ten times longer
    with pytest.raises(SimulationError, match="cannot be met"):
        simulate_exact(material, tolerance=0.01)


def test_a_finer_tolerance_gives_a_smaller_error():
    material = checks.medium(0.3, 0.7, 1.3)
    fine = simulate_exact(material, tolerance=5e-6)
    assert fine.meta["relative_error"] <= 5e-6


def test_profile_has_no_noise(skin1):
    assert (skin1.annulus_energy > 0.0).all()
    assert (np.diff(skin1.reflectance_per_mm2, axis=0) < 0.0).all()


def test_profile_goes_through_a_file(plain, tmp_path):
    plain.save(tmp_path / "x.profile.npz")
    again = Profile.load(tmp_path / "x.profile.npz")
    np.testing.assert_array_equal(again.cumulative_stderr, plain.cumulative_stderr)


def test_materials_share_work_and_keep_their_answers(skin1):
    alone = skin1, simulate_exact(load_material("ketchup"))
    for shared, each in zip(checks_exact.exact_profiles(FEW, 1e-4), alone, strict=True):
        error = np.hypot(shared.cumulative_stderr, each.cumulative_stderr)
        assert (np.abs(shared.cumulative - each.cumulative) <= error).all(), shared.label


def test_threads_do_not_change_the_result():
    material = checks.medium([0.3, 0.001], [0.7, 1.0], 1.3)
    one, two = (simulate_exact(material, threads=n, tolerance=0.01) for n in (1, 2))
    np.testing.assert_array_equal(one.annulus_energy, two.annulus_energy)


def test_unit_of_length_does_not_matter(plain):
    far = simulate_exact(checks.medium(0.0003, 0.0007, 1.3))
    np.testing.assert_allclose(plain.annulus_energy, far.annulus_energy, rtol=1e-9)


def test_similarity_is_used_where_it_is_asked_for_and_on_record(plain):
    similar = simulate_exact(checks.medium(0.3, 2.8, 1.3, g=0.75), similarity=True)
    np.testing.assert_allclose(similar.annulus_energy, plain.annulus_energy, rtol=1e-9)
    assert similar.meta["settings"]["similarity"] is True
    assert plain.meta["settings"]["similarity"] is False


def test_only_the_relative_index_counts(plain):
    layer = Layer(1.95, 0.0, [0.3], [0.7])
    immersed = simulate_exact(Material("x", ("c0",), (layer,), eta_above=1.5))
    np.testing.assert_allclose(immersed.annulus_energy, plain.annulus_energy, rtol=1e-9)


@pytest.mark.parametrize("channels", [1, 12, pytest.param(24, marks=pytest.mark.slow)])
def test_any_number_of_channels(channels):
    albedos = np.linspace(0.0, 1.0, channels) if channels > 1 else np.array([0.5])
    profile = simulate_exact(checks.medium(1.0 - albedos + 1e-15, albedos, 1.3))
    assert profile.diffuse_reflectance[-1] == pytest.approx(
        diffuse_reflectance(albedos, 1.3)[-1], abs=1e-6
    )
    assert (np.diff(profile.diffuse_reflectance) > 0.0).all()


def test_without_scattering_nothing_comes_back():
    profile = simulate_exact(checks.medium([0.3, 0.3], [0.0, 0.7], 1.3))
    assert (profile.annulus_energy[:, 0] == 0.0).all()
    assert profile.absorbed[0, 0] == pytest.approx(1.0 - profile.specular_reflectance)


def test_one_annulus_holds_what_the_total_leaves(plain):
    profile = simulate_exact(checks.medium(0.3, 0.7, 1.3), dr_mm=2.0, radius_mm=2.0)
    assert profile.n_annuli == 1
    assert profile.annulus_energy[0, 0] == pytest.approx(float(plain.cumulative_at(2.0)[0]), 1e-5)
    assert profile.beyond_grid[0] == pytest.approx(
        plain.diffuse_reflectance[0] - profile.annulus_energy[0, 0], rel=1e-4
    )


def test_grid_far_inside_a_mean_free_path():
    material = checks.medium(0.3, 0.7, 1.3)
    profile = simulate_exact(material, dr_mm=1e-4, radius_mm=1e-2)
    fine = simulate_exact(material, dr_mm=1e-4, radius_mm=1e-2, tolerance=5e-6)
    np.testing.assert_allclose(profile.cumulative[1:], fine.cumulative[1:], rtol=1e-2)
    single = [reference.single_scattering_cumulative(r, 0.7, 1.3) for r in profile.r_edges_mm[1:]]
    assert (profile.cumulative[1:, 0] > single).all()


@pytest.mark.parametrize("tolerance", [0.0, -1.0, 1.0, float("nan"), float("inf")])
def test_tolerances_out_of_range_are_refused(tolerance):
    with pytest.raises(SimulationError, match="tolerance"):
        simulate_exact(checks.medium(0.3, 0.7, 1.3), tolerance=tolerance)


def test_a_tolerance_that_cannot_be_met_says_what_can():
    with pytest.raises(
        SimulationError, match=r"1e-13 cannot be met.*give `tolerance = \S+` or more"
    ):
        simulate_exact(checks.medium(0.3, 0.7, 1.0), tolerance=1e-13, radius_mm=1.0)


@pytest.mark.parametrize("radius", [0.0, -1.0, float("nan")])
def test_radii_that_are_none_are_refused(radius):
    with pytest.raises(SimulationError, match="radius_mm"):
        simulate_exact(checks.medium(0.3, 0.7, 1.3), radius_mm=radius)


def test_a_material_that_is_none_is_refused():
    with pytest.raises(SimulationError, match="load_material"):
        simulate_exact("skin1")


@pytest.mark.parametrize("light", ["normal", "diffuse"])
@pytest.mark.parametrize(("albedo", "eta"), [(1.1, 1.3), (-0.1, 1.3), (np.nan, 1.3), (0.5, 0.9)])
def test_totals_out_of_range_are_refused(albedo, eta, light):
    with pytest.raises(SimulationError, match="expected"):
        diffuse_reflectance([albedo], eta, light=light)


def test_a_light_of_another_name_is_refused():
    for call in (
        lambda: diffuse_reflectance([0.5], 1.3, light="x"),
        lambda: entering_light(1, "x"),
    ):
        with pytest.raises(SimulationError, match=r"light = 'x'; expected normal or diffuse\."):
            call()


def test_it_can_be_stopped():
    asked = threading.Event()

    def stop():
        was_asked = asked.is_set()
        asked.set()
        return was_asked

    with pytest.raises(StoppedError):
        simulate_exact(load_material("skin1"), stop=stop)


def test_grid_is_the_papers(skin1):
    np.testing.assert_array_equal(skin1.r_edges_mm, make_grid(load_material("skin1")).r_edges_mm)
