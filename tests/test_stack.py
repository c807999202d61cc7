"""The solver for layers against published values, the other solver, reciprocity and energy."""

import math
import re
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
import reference
from checks import medium
from checks_layers import layer, stack

from sssfit.errors import SimulationError, StoppedError
from sssfit.material import Layer, Material, load_material
from sssfit.simulate import simulate_exact, simulate_exact_many, simulate_montecarlo
from sssfit.simulate.half_space import diffuse_reflectance
from sssfit.simulate.stack import limits, profiles
from sssfit.simulate.stack.assembly import Assembly, _spans, reflected_at, transforms_at
from sssfit.simulate.stack.azimuth import FEWEST, azimuth_of
from sssfit.simulate.stack.changes import Changes, ready
from sssfit.simulate.stack.families import families_of
from sssfit.simulate.stack.gaps import Gap
from sssfit.simulate.stack.modes import modes_of, times
from sssfit.simulate.stack.nodes import Nodes, snell_reflectance
from sssfit.simulate.stack.phase import henyey_greenstein, legendre_series, medium_of
from sssfit.simulate.stack.sampling import Family, Sampler
from sssfit.simulate.stack.single import single_cumulative, single_transform
from sssfit.simulate.stack.slabs import Slab, SlabStack, stacks_of
from sssfit.simulate.stack.solution import Answer, Errors, Side, SideErrors, Step
from sssfit.simulate.stack.spline import Spline
from sssfit.simulate.stack.tails import Tail
from sssfit.simulate.stack.transform import Wavenumbers, bessel_tail, refined

WAVENUMBERS = (0.0, 0.05, 0.7, 4.0, 30.0)
SKIN = (Slab(0.5, 20.0, 0.8, 1.45, 0.1), Slab(0.1, 10.0, 0.8, 1.38))
SLABS = (
    Slab(0.3, 8.0, 0.6, 1.4, 0.2),
    Slab(0.0, 0.0, 0.0, 1.5, 0.1),
    Slab(0.1, 4.0, 0.2, 1.33, 0.5),
)


def solved(slabs, k, count=16, **around):
    """R(k), T(k) and absorption of a stack, without the beam."""
    assembly = Assembly.of(SlabStack(tuple(slabs), **around), count)
    azimuth = azimuth_of(k, assembly.least_sigma_t)
    modes = lambda each: modes_of(each, k, azimuth)  # noqa: E731
    return assembly, transforms_at(assembly, k, azimuth, modes), azimuth, modes


def totals(slabs, count, **around):
    """R and T with the beam, which the specular reflection is a part of."""
    assembly, found, _, _ = solved(slabs, 0.0, count, **around)
    beam = assembly.beam
    return found.reflected + beam.reflected, found.transmitted + beam.transmitted


def test_a_slab_is_van_de_hulsts():
    # van de Hulst 1980, table 35: g = .75, albedo .9, optical depth 2
    found = totals([Slab(10.0, 90.0, 0.75, 1.0, 0.02)], 24)
    np.testing.assert_allclose(found, (0.09739, 0.66096), rtol=0, atol=6e-6)


def test_a_half_space_is_giovanellis():
    found = totals([Slab(10.0, 90.0, 0.0, 1.5)], 16)[0]
    assert found == pytest.approx(0.2600, abs=1e-4)  # the last digit of his table
    assert found == pytest.approx(diffuse_reflectance([0.9], 1.5)[0] + 0.04, abs=1e-6)


@pytest.mark.parametrize("albedo", [0.5, 0.9, 0.99])
def test_totals_are_chandrasekhars(albedo):
    found = totals([Slab(1.0 - albedo, albedo, 0.0, 1.0)], 16)[0]
    assert found == pytest.approx(reference.chandrasekhar_total(albedo), abs=1e-6)


@pytest.mark.parametrize("k", WAVENUMBERS)
def test_a_layer_cut_in_two_is_the_same(k):
    whole = [Slab(0.2, 10.0, 0.8, 1.4, 0.3), SKIN[1]]
    cut = [Slab(0.2, 10.0, 0.8, 1.4, 0.15)] * 2 + [SKIN[1]]
    assert solved(cut, k)[1].reflected == pytest.approx(solved(whole, k)[1].reflected, abs=1e-10)


@pytest.mark.parametrize("k", WAVENUMBERS)
@pytest.mark.parametrize("slab", SLABS)
def test_a_slab_cut_in_two_passes_on_the_same(k, slab):
    rest = [Slab(0.1, 5.0, 0.5, 1.3, 0.4)]
    k = k or 1e-3  # 0 is singular with a clear layer
    halves = [Slab(slab.sigma_a, slab.sigma_s, slab.g, slab.eta, 0.5 * slab.thickness)] * 2
    whole, cut = (solved([*each, *rest], k)[1] for each in ([slab], halves))
    assert cut.reflected == pytest.approx(whole.reflected, abs=1e-10)
    assert cut.transmitted == pytest.approx(whole.transmitted, abs=1e-10)


@pytest.mark.parametrize("slabs", [SKIN, SLABS, SLABS[::-1]])
@pytest.mark.parametrize("g", [-0.6, 0.0, 0.9])
def test_energy_is_conserved(slabs, g):
    slabs = [Slab(s.sigma_a, s.sigma_s, g * bool(s.sigma_s), s.eta, s.thickness) for s in slabs]
    k = 1e-6 if any(each.is_clear for each in slabs) else 0.0  # 0 is singular with a clear layer
    assembly, found, _, _ = solved(slabs, k)
    beam = assembly.beam
    left = found.reflected + found.transmitted + beam.reflected + beam.transmitted
    assert left + sum(found.absorbed) == pytest.approx(1.0, abs=1e-12 if k == 0.0 else 1e-9)


@pytest.mark.parametrize("k", WAVENUMBERS[:4])
def test_paths_can_be_reversed(k):
    # Helmholtz: L-(i) = sum rho(i, j) mu_j w_j L+(j) with rho symmetric, but for the sign of k.
    assembly, _, azimuth, modes = solved(SKIN, k)
    floor = _spans(assembly, k, azimuth, modes, None)[1][1].matrix
    directions = assembly.media[1].directions
    rho = floor / np.tile(directions.cosine, azimuth.orders)
    sign = np.repeat((-1.0) ** np.arange(azimuth.orders), directions.cosine.size)
    np.testing.assert_allclose(rho, sign[:, None] * rho.T * sign, rtol=0, atol=1e-9 * rho.max())


@pytest.mark.parametrize("k", [0.3, 2.0, 11.0])
def test_a_clear_layer_turns_and_fades_light_as_its_formula(k):
    clear, scattering = Slab(0.4, 0.0, 0.0, 1.4, 0.3), Slab(0.3, 2.0, 0.0, 1.4)
    # A layer that scatters next to nothing is solved by modes, one that does not by a formula.
    nearly = Slab(0.4, 1e-7, 0.0, 1.4, 0.3)
    azimuth = azimuth_of(k, 0.4)
    modes = lambda each: modes_of(each, k, azimuth)  # noqa: E731
    formula, by_modes = (
        transforms_at(Assembly.of(SlabStack((each, scattering)), 16), k, azimuth, modes).reflected
        for each in (clear, nearly)
    )
    assert formula == pytest.approx(by_modes, abs=1e-7)


def test_light_through_a_slab_is_not_lost_in_the_noise_of_directions():
    # Where k d is 20, sums over 16 directions are off by 5e-4, and over 40 too, by the azimuth.
    slabs = (Slab(0.1, 4.0, 0.5, 1.4, 0.5), Slab(0.2, 1.0, 0.1, 1.35, 1.5))
    sampler = Sampler(Family((SlabStack(slabs),)), 16)
    gap = sampler.gaps[0]
    assert gap.first == pytest.approx(5.5)
    k = np.geomspace(0.8 * gap.first, 1.2 * gap.last, 9)
    falling = np.array([sampler.at(each)[1] for each in k]) * k**2
    assert (np.diff(falling) < 0.0).all()
    assert falling[-1] > 0.0
    assert (np.abs(np.diff(falling, 2)) < 0.2 * falling[0]).all()


def test_a_gap_is_crossed_by_a_smooth_curve():
    beside = []
    gap = Gap(2.0, 5.0, lambda k: beside.append(k) or (1.0 + math.log(k)) / k**2)
    assert [k in gap for k in (2.0, 2.1, 5.0)] == [False, True, False]
    assert gap(3.0) == pytest.approx((1.0 + math.log(3.0)) / 9.0)
    assert beside == [1.6, 2.0, 5.0, 6.25]


def test_what_is_left_out_deep_below_is_not_seen():
    deep = [*SKIN[:1], Slab(0.1, 10.0, 0.8, 1.38, 2.0), Slab(3.0, 1.0, 0.3, 1.5, 1.0)]
    k = 10.0  # k z = 20 at the end of the second layer
    assembly, whole, azimuth, modes = solved(deep, k)
    cut = reflected_at(assembly, k, azimuth, modes, 1)
    assert cut == pytest.approx(whole.reflected, abs=1e-8)
    assert assembly.last_seen(k, 14.0) == 1
    assert assembly.last_seen(0.1, 14.0) is None


@pytest.mark.parametrize("slabs", [SKIN, SLABS])
def test_single_scattering_is_the_same_in_both_forms(slabs):
    # F_1(r) = r int f(k) J1(k r) dk; both are of the light that leaves without a reflection.
    assembly = Assembly.of(SlabStack(slabs), 48)
    once = single_transform(assembly, 0.0, azimuth_of(0.0, 1.0))
    total = float(single_cumulative(assembly, np.array([np.inf]))[0])
    assert once == pytest.approx(total, abs=2e-7)


def test_single_scattering_has_its_closed_form():
    assembly = Assembly.of(SlabStack((Slab(0.3, 0.7, 0.0, 1.3),)), 16)
    radii = np.array([1e-3, 0.05, 0.7, 3.0])
    theory = [reference.single_scattering_cumulative(r, 0.7, 1.3) for r in radii]
    np.testing.assert_allclose(single_cumulative(assembly, radii), theory, rtol=0, atol=1e-7)


@pytest.mark.parametrize("g", [-0.95, -0.5, 0.0, 0.7, 0.9])
@pytest.mark.parametrize("is_seen_through", [False, True])
def test_scattering_conserves_light(g, is_seen_through):
    nodes = Nodes.of((1.0, 1.4), 12)
    found = medium_of(Slab(0.2, 3.0, g, 1.4), nodes, 3, is_seen_through=is_seen_through)
    weight = found.directions.weight
    of_beam = 2.0 * math.pi * weight @ (found.forward + found.backward)
    assert of_beam == pytest.approx(found.sigma_s, rel=1e-12)
    uniform = np.sqrt(2.0 * weight)  # equal radiance from all directions
    np.testing.assert_allclose(found.even[0] @ uniform, found.sigma_s * uniform, rtol=1e-12)


@pytest.mark.parametrize(("eta", "within"), [(1.0, 3e-5), (1.4, 2e-4)])
def test_few_directions_do_where_light_is_scattered_back(eta, within):
    """With moments alone, and what they miss sent ahead, .0028 and .0025 were lost."""
    ground = (Slab(0.1, 1.0, -0.95, eta),)
    assert totals(ground, 16)[0] == pytest.approx(totals(ground, 72)[0], abs=within)


def test_light_that_turns_back_twice_is_seen_through_a_slab():
    """T(k) does not end at k d = 14, as it does where nothing returns along its own path."""
    slab = SlabStack((Slab(0.1, 1.0, -0.9, 1.4, 1.0),))
    near, far = (Sampler(Family((slab,)), 20, 7).at(k)[1] for k in (13.0, 15.0))
    assert 0.8 * near < far < near


def test_what_is_left_of_steep_scattering_counts_in_the_error():
    """Halves need no more; of 3 parts in 4 that stay, three times as much is still to come."""
    now, before = np.array([0.1, -0.2]), np.array([1.0, 0.1])
    np.testing.assert_array_equal(Tail(0.0).left(now, before), [0.1, 0.2])
    np.testing.assert_allclose(Tail(0.5).left(now, before), [0.5, 0.2])
    np.testing.assert_allclose(Tail(0.75).left(now, now), [0.3, 0.6])
    ratios = [Tail.of(SlabStack((Slab(0.1, 1.0, g, 1.4),))).ratio for g in (0.934, 0.95, -0.9)]
    assert ratios == pytest.approx([0.0, 0.95**8, 0.9**8])
    films = [SlabStack((Slab(0.1, 1.0, g, 1.4, 1.0),)) for g in (0.9, -0.9)]
    ratios = [Tail.of(film).over(8).ratio for film in films]
    assert ratios == pytest.approx([0.0, 0.9**4])


def test_the_series_is_henyey_and_greensteins():
    cosine = np.linspace(-1.0, 1.0, 9)
    series = legendre_series(0.6 ** np.arange(60.0), cosine)
    np.testing.assert_allclose(series, henyey_greenstein(cosine, 0.6), rtol=1e-9)


def test_nodes_integrate_over_every_medium():
    nodes = Nodes.of((1.0, 1.33, 1.5), 16)
    for eta in (1.0, 1.33, 1.5):
        each = nodes.directions(eta)
        for power in (0, 1, 3):
            found = each.weight @ each.cosine**power
            assert found == pytest.approx(1.0 / (power + 1.0), abs=1e-5), (eta, power)


def test_reflection_obeys_fresnel():
    p = np.array([0.0, 0.3, 0.999, 1.2])
    found = snell_reflectance(p, 1.4, 1.0)
    assert found[0] == pytest.approx((0.4 / 2.4) ** 2)
    np.testing.assert_allclose(found[:3], snell_reflectance(p[:3], 1.0, 1.4))
    assert found[3] == 1.0


def test_a_spline_is_that_of_scipy():
    from scipy.interpolate import CubicSpline

    rng = np.random.default_rng(1)
    x, values = np.sort(rng.random(40)), rng.random((40, 3))
    asked = np.linspace(-0.05, 1.05, 60).reshape(6, 10)
    expected = CubicSpline(x, values)(asked)
    np.testing.assert_allclose(Spline.through(x, values)(asked), expected, rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(
        Spline.through(x[:4], values[:4])(asked), CubicSpline(x[:4], values[:4])(asked), rtol=1e-8
    )


IMPORTS = """
import sys
from sssfit.material import Layer, Material
from sssfit.simulate import simulate
layers = Layer(1.4, [0.5], [0.5], [20.0], 0.1), Layer(1.4, [0.5], [0.1], [10.0])
simulate(Material("skin", ("red",), layers), "exact", tolerance=0.05)
print(*(each for each in ("numba", "scipy.interpolate", "scipy.optimize") if each in sys.modules))
"""


def test_layers_wait_for_no_library_that_they_do_not_need():
    found = subprocess.run([sys.executable, "-c", IMPORTS], capture_output=True, text=True)
    assert (found.returncode, found.stdout.split()) == (0, []), found.stderr


@pytest.mark.parametrize("p", [2, 3])
def test_the_tail_of_the_bessel_integral(p):
    from scipy.integrate import quad
    from scipy.special import j1

    for x in (1e-3, 0.4, 7.0, 29.0):
        near = quad(lambda t: j1(t) / t**p, x, 60.0, limit=400, epsabs=1e-13)[0]
        rest = float(bessel_tail(p, np.array([60.0]))[0])
        assert float(bessel_tail(p, np.array([x]))[0]) == pytest.approx(near + rest, rel=1e-7)


def test_the_hankel_integral_of_a_known_transform():
    # f = exp(-k h) comes from F(r) = 1 - h / sqrt(r^2 + h^2)
    h, radii = 0.7, np.array([0.01, 0.2, 1.0, 5.0, 30.0])
    waves = refined(lambda k: np.exp(-k * h)[:, None], 1e-3, 60.0, 1e-8, 1.0)
    expected = 1.0 - h / np.hypot(radii, h)
    np.testing.assert_allclose(waves.cumulative(radii)[:, 0], expected, rtol=0, atol=2e-7)
    assert isinstance(waves.halved(), Wavenumbers)


@pytest.mark.parametrize("name", [pytest.param("skin1", marks=pytest.mark.slow), "marble"])
def test_half_spaces_are_those_of_the_other_solver(name, monkeypatch):
    material = load_material(name)
    other = simulate_exact(material, tolerance=2e-5)
    monkeypatch.setattr("sssfit.simulate.half_space.covers", lambda *_, **__: False)
    ours = simulate_exact(material)
    assert ours.meta["settings"]["solver"] == "layer"
    apart = np.abs(ours.cumulative - other.cumulative) / other.diffuse_reflectance
    assert apart.max() < 6e-5
    assert ours.meta["relative_error"] < 1e-4
    np.testing.assert_allclose(ours.absorbed, other.absorbed, rtol=0, atol=1e-5)


@pytest.mark.slow
def test_eleven_half_spaces_are_those_of_the_other_solver(monkeypatch):
    from sssfit.material import material_names

    materials = [load_material(name) for name in material_names(paper=True)]
    others = simulate_exact_many(materials, tolerance=1e-5)
    monkeypatch.setattr("sssfit.simulate.half_space.covers", lambda *_, **__: False)
    for ours, other in zip(simulate_exact_many(materials), others, strict=True):
        apart = np.abs(ours.cumulative - other.cumulative) / other.diffuse_reflectance
        assert apart.max() < 6e-5, other.label


def test_materials_that_share_a_layer_share_its_modes(monkeypatch):
    dermis = layer(0.1, 10.0, 0.8, 1.4)
    skins = [stack(layer(a, 20.0, 0.8, 1.4, 0.1), dermis) for a in (0.3, 1.0)]
    assert families_of([each for skin in skins for each in stacks_of(skin)]) == [[0, 1]]
    apart = [stack(layer(0.3, 20.0, 0.8, 1.5, 0.1), dermis), skins[1]]
    assert families_of([each for skin in apart for each in stacks_of(skin)]) == [[0], [1]]
    solved_for = []
    real = modes_of
    monkeypatch.setattr(
        "sssfit.simulate.stack.sampling.modes_of",
        lambda medium, *rest: solved_for.append(medium.slab.sigma_a) or real(medium, *rest),
    )
    together = simulate_exact_many(skins, tolerance=0.01)
    assert solved_for.count(0.1) <= solved_for.count(0.3) + solved_for.count(1.0)
    shared, alone = together[1], simulate_exact(skins[1], tolerance=0.01)
    error = np.hypot(shared.cumulative_stderr, alone.cumulative_stderr)
    assert (np.abs(shared.cumulative - alone.cumulative) <= error).all()


def test_threads_do_not_change_the_result():
    two_families = medium([0.1, 0.3], [10.0, 20.0], 1.4, g=0.8)
    one, two = (simulate_exact(two_families, tolerance=0.01, threads=n) for n in (1, 2))
    assert one.meta["settings"]["solver"] == "layer"
    np.testing.assert_array_equal(one.annulus_energy, two.annulus_energy)


def test_the_error_covers_a_finer_answer():
    skin = stack(layer(0.5, 20.0, 0.8, 1.45, 0.1), layer(0.1, 10.0, 0.8, 1.38))
    coarse, fine = (simulate_exact(skin, tolerance=each) for each in (2e-3, 2e-4))
    apart = np.abs(coarse.cumulative - fine.cumulative)
    assert (apart[1:] <= coarse.cumulative_stderr[1:] + fine.cumulative_stderr[1:]).all()
    assert fine.meta["relative_error"] <= 2e-4
    assert coarse.meta["settings"]["directions"] < fine.meta["settings"]["directions"]


def test_the_error_of_a_half_space_covers_its_directions_in_azimuth(monkeypatch):
    forward = medium(2.0, 30.0, 1.4, g=0.7)
    found = simulate_exact(forward, tolerance=3e-5)
    real = profiles.quarter_of
    monkeypatch.setattr(profiles, "quarter_of", lambda *given: replace(real(*given), count=9))
    fine = simulate_exact(forward, tolerance=3e-5)
    apart = np.abs(found.cumulative - fine.cumulative)[:, 0]
    worst = int(apart.argmax())
    assert 0.0 < apart[worst] <= found.cumulative_stderr[worst, 0]


def test_light_that_nothing_scatters_goes_by_lambert_and_fresnel():
    glass = stack(layer(0.5, 0.0, 0.0, 1.5, 2.0))
    profile = simulate_exact(glass, dr_mm=0.1, radius_mm=1.0)
    r, fades = 0.04, math.exp(-1.0)
    through = (1.0 - r) ** 2 * fades / (1.0 - (r * fades) ** 2)
    assert profile.transmittance[0] == pytest.approx(through, rel=1e-12)
    returned = (1.0 - r) ** 2 * r * fades**2 / (1.0 - (r * fades) ** 2)
    assert profile.diffuse_reflectance[0] == pytest.approx(returned, rel=1e-12)
    assert profile.annulus_energy[0, 0] == profile.diffuse_reflectance[0]
    assert profile.energy_balance[0] == pytest.approx(0.0, abs=1e-14)


def test_a_channel_without_scattering_stands_beside_others():
    slab = stack(layer([0.5, 0.1], [0.0, 3.0], 0.5, 1.4, 2.0))
    profile = simulate_exact(slab, tolerance=0.01, dr_mm=0.1, radius_mm=3.0)
    assert profile.annulus_energy[5, 0] == 0.0
    assert profile.annulus_energy[5, 1] > 0.0


def test_similarity_is_used_where_it_is_asked_for():
    skin = stack(layer(0.5, 20.0, 0.8, 1.4, 0.1), layer(0.1, 10.0, 0.8, 1.4))
    reduced = stack(layer(0.5, 4.0, 0.0, 1.4, 0.1), layer(0.1, 2.0, 0.0, 1.4))
    similar = simulate_exact(skin, tolerance=0.01, similarity=True)
    np.testing.assert_allclose(
        similar.annulus_energy, simulate_exact(reduced, tolerance=0.01).annulus_energy, atol=1e-12
    )
    assert similar.meta["settings"]["similarity"] is True
    assert similar.material == skin


def test_thin_slabs_that_scatter_far_ahead_are_refused_by_name():
    thin = Material("film", ("red",), (layer(0.1, 30.0, 0.97, 1.0, 0.03),))
    with pytest.raises(
        SimulationError,
        match=r"film red.*thin slab of g = 0\.97.*`method = montecarlo`",
    ):
        simulate_exact(thin, tolerance=3e-4, dr_mm=0.01, radius_mm=0.3)


def test_a_falling_f_is_an_error_of_its_own():
    # Two numbers of directions were within .002 for a film of g = .97 whose F fell by .006.
    rising, falling = Side(np.array([0.1, 0.3]), 0.4), Side(np.array([0.1, 0.3, 0.25, 0.5]), 0.4)
    assert (rising.fall, falling.fall) == (0.0, pytest.approx(0.1))
    assert Side(np.array([0.1, -0.2]), -0.2).fall == pytest.approx(0.2)
    none = SideErrors(np.zeros(5), np.zeros(5), 0.0)
    step = Step(12, [Answer(rising, falling, (0.2,))], [Errors(none, none)])
    assert step.share(0) == pytest.approx(0.1 / 0.8)


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [1e-2, 1e-3])
def test_a_thin_film_that_scatters_far_ahead_is_right_where_it_is_not_refused(tolerance):
    film = stack(layer(0.1, 30.0, 0.97, 1.4, 0.03))
    grid = {"dr_mm": 0.01, "radius_mm": 0.5}
    ours = simulate_exact(film, tolerance=tolerance, **grid)
    walk = simulate_montecarlo(film, photons=2_000_000, **grid)
    off = np.cumsum(ours.annulus_energy - walk.annulus_energy)
    assert np.abs(off).max() < tolerance + 4.0 * walk.diffuse_reflectance_stderr[0]


def test_a_thousand_layers_are_refused_with_the_memory_they_take():
    many = stack(*[layer(0.1, 3.0, 0.5, 1.4, 0.01)] * 1000)
    with pytest.raises(SimulationError, match=r"1000 layers.*GB.*montecarlo"):
        simulate_exact(many, threads=2)


def test_hundreds_of_layers_to_a_millionth_are_refused_at_once():
    many = stack(*[layer(0.1, 3.0, 0.5, 1.4, 0.01)] * 400)
    never = lambda: pytest.fail("it began to solve")  # noqa: E731
    with pytest.raises(SimulationError, match=r"400 layers.*1e-06.*minutes.*montecarlo"):
        simulate_exact(many, tolerance=1e-6, threads=1, stop=never)
    channels = [limits.Channel("skin", each, 0.0, np.array([0.0, 1.0])) for each in stacks_of(many)]
    limits.check_time(channels, 16, 1e-4)


def test_directions_that_take_long_are_told(monkeypatch, caplog):
    """After a tenth of the time, which shows how many are needed."""
    skin = medium(0.1, 10.0, 1.4, g=0.8)
    monkeypatch.setattr(profiles, "_MANY", 0)
    with caplog.at_level("INFO", logger="sssfit"):
        simulate_exact(skin, tolerance=0.01, threads=1)
        assert not caplog.text
        monkeypatch.setattr(limits, "_WORTH_A_NOTE", 1e-3)
        simulate_exact(skin, tolerance=0.01, threads=1)
    assert re.search(
        r"a tolerance of 0.01 needs 5 directions.* some 0.\d+ s of a proc", caplog.text
    )


def test_directions_stop_where_memory_does(monkeypatch):
    skin = medium(0.1, 10.0, 1.4, g=0.8)
    channels = [limits.Channel("skin", stacks_of(skin)[0], 0.0, np.array([0.0, 1.0]))]
    limit = limits._bytes(channels, 16, FEWEST, 1)
    monkeypatch.setattr(limits, "_MOST_BYTES", limit)
    with pytest.raises(SimulationError, match="cannot be met: 16 and 12 directions"):
        simulate_exact(skin, tolerance=1e-5, threads=1)


@pytest.mark.parametrize(
    ("worst", "spline", "said"),
    [
        (2.37e-4, 2.23e-5, "give `tolerance = 0.0005` or more, or use `method = montecarlo`"),
        (4.28e-4, 3.9e-4, "give `tolerance = 0.0005` or more, or use"),
        (0.3, 0.0, "of the light; use `method = montecarlo`"),
    ],
)
def test_the_tolerance_that_is_advised_has_room_for_its_own_wavenumbers(worst, spline, said):
    """Blood of g = .995 was told 3e-4, and at 3e-4 that it was 5e-4."""
    blood = medium(0.4, 60.0, 1.4, g=0.995)
    channel = limits.Channel("blood", stacks_of(blood)[0], 0.0, np.array([0.0, 1.0]))
    side = Side(np.array([0.2, 1.0]), 1.0)
    errors = SideErrors(np.array([0.0, worst]), np.zeros(2), spline)
    step = Step(36, [Answer(side, None, (0.0,))], [Errors(errors, None)])
    assert said in str(limits.cannot_meet([channel], 0, step, 1e-4))


@pytest.mark.slow
def test_a_tolerance_that_is_advised_is_met():
    blood = medium(0.4, 60.0, 1.4, g=0.995)
    grid = {"dr_mm": 0.1, "radius_mm": 5.0}
    for refused in (1e-4, 3e-4):
        with pytest.raises(SimulationError) as caught:
            simulate_exact(blood, tolerance=refused, **grid)
        advised = float(re.search(r"`tolerance = (\S+)`", str(caught.value))[1])
        assert simulate_exact(blood, tolerance=advised, **grid).meta["relative_error"] <= advised


def test_tolerances_below_what_directions_reach_are_refused_at_once():
    skin = stack(layer(0.5, 20.0, 0.8, 1.45, 0.1), layer(0.1, 10.0, 0.8, 1.38))
    never = lambda: pytest.fail("it began to solve")  # noqa: E731
    with pytest.raises(SimulationError, match=r"1e-09 cannot be met.*= 1e-06` or more.*montecarlo"):
        simulate_exact(skin, tolerance=1e-9, threads=1, stop=never)


def test_it_can_be_stopped():
    calls = iter([False, False])
    skin = stack(layer(0.5, 20.0, 0.8, 1.45, 0.1), layer(0.1, 10.0, 0.8, 1.38))
    with pytest.raises(StoppedError):
        simulate_exact(skin, threads=1, stop=lambda: next(calls, True))


def test_a_medium_thinner_than_what_is_above_it():
    thin = stack(layer(0.1, 1.0, 0.5, 1.0), above=1.5)
    profile = simulate_exact(thin, tolerance=0.001, dr_mm=0.2, radius_mm=20.0)
    assert profile.meta["settings"]["solver"] == "layer"
    assert abs(profile.energy_balance[0]) < 1e-4


def test_a_half_space_is_no_different_under_a_name():
    # The smallest half space that each solver takes: nothing is chosen but by the material.
    assert simulate_exact(medium(0.3, 0.7, 1.3)).meta["settings"]["solver"] == "half-space"
    forward = simulate_exact(medium(0.3, 3.5, 1.3, g=0.8), tolerance=0.01)
    assert forward.meta["settings"]["solver"] == "layer"


def test_few_directions_and_their_change_are_all_directions():
    # Half of the wavenumbers get 12 directions; all of them would give the same F within a third of
    # the miss that is allowed between wavenumbers.
    family = Family((SlabStack(SKIN),))
    each = lambda sample, k: np.stack([sample(float(one)) for one in k])  # noqa: E731
    many, radii = ready(family, 12, FEWEST), np.array([0.01, 0.1, 1.0])
    changes = Changes(family, 8, many, 1e-4, each)
    waves = changes.whole(many)[0]
    direct = Wavenumbers(waves.k, each(many.at, waves.k), waves.bend)
    np.testing.assert_allclose(waves.cumulative(radii), direct.cumulative(radii), atol=3e-5)
    alone = changes.halved(ready(family, 8, FEWEST))
    assert alone.k.size < waves.k.size


def test_a_clear_layer_leaves_no_wavenumber_few_directions():
    family = Family((SlabStack(SLABS),))
    each = lambda sample, k: np.stack([sample(float(one)) for one in k])  # noqa: E731
    many = ready(family, 8, FEWEST)
    waves, half = Changes(family, 6, many, 1e-2, each).whole(many)
    np.testing.assert_allclose(waves.values, each(many.at, waves.k), rtol=0, atol=1e-14)
    assert half.k.size == waves.k.size // 2 + 1


def test_a_pair_of_modes_is_two_real_columns():
    rng = np.random.default_rng(5)
    matrix = rng.normal(size=(9, 9))
    factor, columns = np.linalg.eig(matrix)
    assert np.iscomplexobj(factor)
    real = np.where(factor.imag < 0.0, -columns.imag, columns.real)
    powers = np.linalg.matrix_power(matrix, 3)
    np.testing.assert_allclose(times(real, factor**3), powers @ real, atol=1e-12)


LOSSLESS = {
    "on an absorbing ground": ((1.4, 0.8, 0.0, 10.0, 1.0), (1.4, 0.0, 5.0, 0.5, math.inf)),
    "of another index": ((1.4, 0.0, 0.0, 2.0, 0.6), (1.2, 0.0, 3.0, 2.0, math.inf)),
    "inside": (
        (1.4, 0.8, 0.5, 2.0, 0.5),
        (1.4, 0.8, 0.0, 2.0, 1.0),
        (1.4, 0.8, 0.3, 2.0, math.inf),
    ),
    "alone": ((1.4, 0.8, 0.0, 10.0, 1.0),),
}


@pytest.mark.parametrize("name", LOSSLESS)
def test_a_layer_without_loss_passes_light_on(name):
    """At k = 0 its modes along and against are one, from which R(0) came out 2.8 times too high."""
    layers = tuple(Layer(eta, g, [a], [s], d) for eta, g, a, s, d in LOSSLESS[name])
    material = Material("lossless", ("grey",), layers)
    exact = simulate_exact(material, tolerance=2e-3)
    walk = simulate_montecarlo(material, photons=100_000, seed=3)
    apart = exact.diffuse_reflectance - walk.diffuse_reflectance
    error = np.hypot(exact.diffuse_reflectance_stderr, walk.diffuse_reflectance_stderr)
    assert np.abs(apart / error) < 4.0
    lossless = [not any(each.sigma_a_per_mm) for each in layers]
    assert np.abs(exact.absorbed[lossless]).max() < 1e-7


OTHERS = {
    "between two that absorb": (
        *((1.0, 0.0, 0.5, 2.0, 0.5), (1.4, 0.0, 0.0, 2.0, 1.0), (1.4, 0.0, 0.3, 2.0, math.inf)),
    ),
    "of 5 paths a mm": ((1.4, 0.95, 0.0, 100.0, 1.0), (1.4, 0.0, 5.0, 0.5, math.inf)),
    "of 40 paths": ((1.4, 0.8, 0.0, 10.0, 20.0), (1.4, 0.0, 5.0, 0.5, math.inf)),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", [*LOSSLESS, *OTHERS])
def test_stacks_with_layers_without_loss_are_those_of_two_million_photons(name):
    layers = tuple(Layer(eta, g, [a], [s], d) for eta, g, a, s, d in (LOSSLESS | OTHERS)[name])
    material = Material("lossless", ("grey",), layers)
    exact = simulate_exact(material)
    walk = simulate_montecarlo(material, photons=2_000_000, seed=5)
    assert (walk.unfinished < 1e-4).all()
    apart = exact.diffuse_reflectance - walk.diffuse_reflectance
    error = np.hypot(exact.diffuse_reflectance_stderr, walk.diffuse_reflectance_stderr)
    assert np.abs(apart / error) < 4.0


@pytest.mark.parametrize("sigma_a", [0.0, 1e-14, 1e-10, 1e-8, 1e-7, 1e-6])
def test_less_and_less_absorption_tends_to_none(sigma_a):
    """Those of 1e-6 are solved at k = 0 itself, the others beside it."""

    def total(absorption):
        slabs = Slab(absorption, 10.0, 0.8, 1.4, 1.0), Slab(5.0, 0.5, 0.0, 1.4)
        return Sampler(Family((SlabStack(slabs),)), 16).at_zero()[0].reflected

    assert total(sigma_a) == pytest.approx(total(2e-6), abs=4e-6)


def test_all_light_returns_where_nothing_absorbs():
    slabs = Slab(0.0, 2.0, 0.0, 1.4, 0.5), Slab(0.0, 4.0, 0.5, 1.4)
    found = Sampler(Family((SlabStack(slabs),)), 16).at_zero()[0].reflected
    assert found == pytest.approx(1.0 - (0.4 / 2.4) ** 2, abs=1e-5)


def test_a_layer_too_thick_for_its_modes_to_differ_is_refused():
    slabs = Slab(0.0, 1000.0, 0.0, 1.4, 20.0), Slab(5.0, 0.5, 0.0, 1.4)
    with pytest.raises(SimulationError, match="a layer of 20 mm absorbs too little beside"):
        Sampler(Family((SlabStack(slabs),)), 16).at_zero()


@pytest.mark.parametrize("sigma_a", [0.0, 5e-9, 3.2e-8, 1e-6])
def test_a_lossless_layer_on_a_ground_of_hardly_any_loss(sigma_a):
    """A half space of the same absorption throughout, by the other solver."""
    slabs = Slab(sigma_a, 10.0, 0.0, 1.4, 1.0), Slab(sigma_a, 10.0, 0.0, 1.4)
    found = Sampler(Family((SlabStack(slabs),)), 16).at_zero()[0].reflected
    albedo = np.array([10.0 / (10.0 + sigma_a)])
    assert found == pytest.approx(float(diffuse_reflectance(albedo, 1.4)[0]), abs=2e-5)


def test_a_lossless_slab_returns_what_it_does_not_pass():
    """T is (z + zb) / (d + 2 zb) by diffusion: z = 1 / sigma_s, zb by what the surface reflects."""
    # At 20 m, 2e5 paths, k coth(k d) is taken for sqrt(k^2 + 1 / d^2) at k d = 10.
    for thickness, miss in ((5.0, 1e-6), (100.0, 1e-6), (20_000.0, 2e-5)):
        slab = SlabStack((Slab(0.0, 10.0, 0.0, 1.4, thickness),))
        (found,) = Sampler(Family((slab,)), 16).at_zero()
        entering = 1.0 - (0.4 / 2.4) ** 2
        assert found.reflected + found.transmitted == pytest.approx(entering, abs=miss)
        beyond = 2.0 / 3.0 / 10.0 * (1.0 + 0.529) / (1.0 - 0.529)  # Groenhuis 1983, eta 1.4
        passed = entering * (0.1 + beyond) / (thickness + 2.0 * beyond)
        assert found.transmitted == pytest.approx(passed, rel=0.1, abs=miss)
