"""Profiles under a beam of finite width: closed forms, slow integrals, walks, and bad input."""

import contextlib
import dataclasses
import itertools
from unittest import mock

import numpy as np
import pytest
from scipy import integrate, stats

from sssfit.choose.truth import material_of
from sssfit.errors import ProfileError
from sssfit.material import Layer, Material, load_material
from sssfit.profile import FORMAT, Profile, full_kernel
from sssfit.profile.beam import Beam, parse_beam, under_beam
from sssfit.profile.bins import merged
from sssfit.profile.directions import angular_reflectance
from sssfit.profile.frequency import frequency_response
from sssfit.profile.smooth import smoothed
from sssfit.profile.spreads import SPREADS, lens_area, within_gaussian
from sssfit.simulate import simulate_exact, simulate_montecarlo
from sssfit.simulate.runner import simulate_to_files
from sssfit.stability.noise_floor import noise_ratio

VARIANCES = np.array([0.05, 0.3, 2.0])
WEIGHTS = np.array([0.2, 0.3, 0.1])


def within(r, variances):
    """The energy of Gaussians within a radius."""
    return (WEIGHTS * -np.expm1(-(r[:, None] ** 2) / (2.0 * variances))).sum(axis=1)


def gaussians(finer=15.0):
    """A profile of three Gaussians in annuli of a part of the narrowest one's deviation."""
    width = np.sqrt(VARIANCES[0]) / finer
    edges = width * np.arange(int(9.0 / width) + 1)
    energy = np.diff(within(edges, VARIANCES))[:, None]
    none = np.zeros(1)
    meta = {"format": FORMAT, "channels": ["grey"], "method": "gaussians"}
    return Profile(
        edges, energy, 0.0 * energy, WEIGHTS.sum() - energy.sum(axis=0), none, 0.0,
        np.zeros((0, 1)), none, None, meta,
    )  # fmt: skip


@pytest.mark.parametrize("radius", [0.5, 1.3])
def test_a_sum_of_gaussians_under_a_gaussian_has_its_closed_form(radius):
    """A beam of 1/e^2 radius w has the variance w^2 / 4, and variances add: to 1e-6."""
    found = under_beam(gaussians(finer=10.0), Beam("gaussian", radius))
    theory = within(found.r_edges_mm, VARIANCES + radius**2 / 4.0)
    assert np.abs(found.cumulative[:, 0] - theory).max() < 1e-6


def test_a_flat_beam_is_the_mean_over_its_disk():
    """F(r) against the mean of F over points of the disk: numbers of the golden spiral."""
    radius, profile = 1.0, gaussians()
    found = under_beam(profile, Beam("flat", radius))
    count = 5000
    far = radius * np.sqrt((np.arange(count) + 0.5) / count)
    r = np.array([0.3, 1.0, 2.0, 4.0])
    # Light of a Gaussian around a point at a distance: a distribution of chi-square, not central.
    from scipy.stats import ncx2

    theory = sum(
        w * ncx2.cdf(r[:, None] ** 2 / v, 2, far**2 / v).mean(axis=1)
        for w, v in zip(WEIGHTS, VARIANCES, strict=True)
    )
    seen = np.interp(r, found.r_edges_mm, found.cumulative[:, 0])
    np.testing.assert_allclose(seen, theory, atol=3e-5)


@pytest.mark.parametrize("kind", ["gaussian", "flat"])
def test_energy_stays(kind):
    profile = simulate_exact(load_material("skin1"), dr_mm=0.2)
    found = under_beam(profile, Beam(kind, 0.7))
    np.testing.assert_allclose(found.diffuse_reflectance, profile.diffuse_reflectance, rtol=1e-12)
    assert found.r_edges_mm[-1] > profile.r_edges_mm[-1] + 0.7
    np.testing.assert_array_equal(found.r_edges_mm[: len(profile.r_edges_mm)], profile.r_edges_mm)
    # Density in the middle is finite: of a Gaussian of deviation .35 it falls by a quarter from r =
    # .1 to .3, and of a pencil as 1/r.
    before, after = (
        each.annulus_energy[:2] / np.diff(each.r_edges_mm[:3, None] ** 2, axis=0)
        for each in (profile, found)
    )
    assert (before[0] > 2.5 * before[1]).all()
    assert (after[0] < 1.4 * after[1]).all()


@pytest.mark.parametrize("kind", ["gaussian", "flat"])
def test_a_narrow_beam_changes_little_and_two_radii_are_apart(kind):
    profile = simulate_exact(load_material("skin1"), dr_mm=0.5)
    total = profile.diffuse_reflectance
    apart = [
        np.abs(
            under_beam(profile, Beam(kind, radius)).annulus_energy[: profile.n_annuli]
            - profile.annulus_energy
        ).sum(axis=0)
        / total
        for radius in (0.05, 0.5)
    ]
    assert (apart[0] < 0.06).all()
    assert (apart[1] > 5.0 * apart[0]).all()


@pytest.mark.parametrize(("kind", "annuli"), [("gaussian", 0.3), ("flat", 1.0)])
def test_errors_contain_how_light_lies_within_annuli(kind, annuli):
    """skin1's first edge is off by up to 3e-4 of the light, 300 times the solver's error."""
    marble, dr_mm = load_material("marble"), 0.1
    beam = Beam(kind, annuli * dr_mm)
    coarse, fine = (
        under_beam(simulate_exact(marble, dr_mm=each, radius_mm=4.0, tolerance=1e-6), beam)
        for each in (dr_mm, dr_mm / 16.0)
    )
    near = slice(1, 11)
    truth = np.stack(
        [np.interp(coarse.r_edges_mm, fine.r_edges_mm, own) for own in fine.cumulative.T], axis=1
    )
    off = np.abs(coarse.cumulative - truth)[near]
    assert (off <= coarse.cumulative_stderr[near]).all()
    assert (off[0] > 3e-6).all()


def walks_under_a_beam(count, dr_mm):
    """Walks of 4000 photons through skin1, of the seeds from 1 on; they share their annuli."""
    pencils = [
        simulate_montecarlo(
            load_material("skin1"), photons=4000, seed=seed, dr_mm=dr_mm, radius_mm=12.0
        )
        for seed in range(1, count + 1)
    ]
    known = {}

    def once(radii, edges, radius_mm):
        key = radii.tobytes(), edges.tobytes(), radius_mm
        if key not in known:
            known[key] = within_gaussian(radii, edges, radius_mm)
        return known[key]

    with mock.patch.dict(SPREADS, gaussian=once):
        return [under_beam(each, Beam("gaussian", 1.0)) for each in pencils]


def test_errors_of_walks_are_those_of_other_seeds():
    """The spread of 40 walks under a beam, against the standard error that each tells."""
    made = walks_under_a_beam(40, 0.4)
    energy = np.stack([each.annulus_energy[:20] for each in made])
    told = np.sqrt(np.mean([each.annulus_energy_stderr[:20] ** 2 for each in made], axis=0))
    ratio = energy.std(axis=0, ddof=1) / told
    # The standard deviation of 40 values is known to 11 %; 60 of them, correlated, to less.
    assert abs(ratio.mean() - 1.0) < 0.15


def test_a_beam_leaves_the_errors_of_all_light(tmp_path):
    """On either side, in files too; of sums over some annuli nothing is said."""
    slab = Material("slab", ("R", "G"), (Layer(1.3, 0.0, [0.1, 0.2], [3.0, 1.0], 2.0),))
    pencil = simulate_montecarlo(slab, photons=3000, dr_mm=0.2, radius_mm=6.0, angles=5)
    found = under_beam(pencil, Beam("gaussian", 0.8))
    found.save(tmp_path / "wide.profile.npz")
    for each in (found, Profile.load(tmp_path / "wide.profile.npz")):
        for name in ("diffuse_reflectance_stderr", "transmittance_stderr"):
            assert (getattr(pencil, name) > 0.0).all()
            np.testing.assert_array_equal(getattr(each, name), getattr(pencil, name))
        assert np.isnan(each.cumulative_stderr[1:]).all()
        response = frequency_response(each)
        assert (
            response.stderr[response.k_per_mm == 0.0] == pencil.diffuse_reflectance_stderr
        ).all()
        assert np.isnan(response.stderr[response.k_per_mm > 0.0]).all()
    before, after = (angular_reflectance(each).per_sr_stderr for each in (pencil, found))
    np.testing.assert_allclose(after, before, rtol=0.02)
    with pytest.raises(ProfileError, match=r"meta.diffuse_reflectance_stderr = .*; expected a n"):
        dataclasses.replace(found, meta={**found.meta, "diffuse_reflectance_stderr": [1.0]})


def test_bins_under_a_beam_are_no_better_than_they_say():
    """Merged annuli of 40 walks, against the largest standard error that is told."""
    made = walks_under_a_beam(40, 0.1)
    bins = merged(made[0], 0)
    ends = np.searchsorted(made[0].r_edges_mm, bins.edges_mm)
    energy = np.stack([np.diff(each.cumulative[ends, 0]) for each in made])
    ratio = (energy.std(axis=0, ddof=1) / bins.stderr)[bins.is_drawn]
    assert ratio.size > 20
    assert 0.5 < ratio.mean() < 1.15


def test_what_takes_annuli_for_apart_does_not_take_a_beams():
    """The noise of kernels of 12 walks against what one of them tells; smoothing, and choices."""
    made = walks_under_a_beam(12, 0.1)
    kernels = np.stack([full_kernel(each.quadrant_kernel(0.6, 19, channel=0)) for each in made])
    noise = np.linalg.norm(kernels.std(axis=0, ddof=1)) / np.linalg.norm(kernels.mean(axis=0))
    assert 0.8 * noise < noise_ratio(made[0], 0.6)[0] < 1.5 * noise
    with pytest.raises(ProfileError, match="is under a beam, where each photon counts in many"):
        smoothed(made[0])
    assert material_of(made[0]) is None
    material = load_material("skin1")
    assert material_of(simulate_montecarlo(material, photons=1000, dr_mm=1.0)) == material


def test_transmitted_light_is_spread_too():
    slab = dataclasses.replace(
        load_material("skin1"), layers=tuple(
            dataclasses.replace(each, thickness_mm=1.0) for each in load_material("skin1").layers
        )
    )  # fmt: skip
    profile = simulate_montecarlo(slab, photons=5000, dr_mm=0.3, radius_mm=9.0)
    found = under_beam(profile, Beam("flat", 2.0))
    np.testing.assert_allclose(found.transmittance, profile.transmittance, rtol=1e-12)
    assert found.annulus_transmittance[0, 0] < profile.annulus_transmittance[0, 0]


def test_disks_share_their_lens():
    """Counted points against the formula; one inside the other, and apart."""
    x, y = (np.random.default_rng(1).random((2, 400_000)) - 0.5) * 4.0
    for other, apart in ((0.8, 0.9), (0.5, 0.2), (0.8, 3.0), (1.9, 1.5)):
        both = (x**2 + y**2 < 1.0) & ((x - apart) ** 2 + y**2 < other**2)
        area = float(lens_area(np.array([1.0]), other, np.array([apart]))[0])
        assert 16.0 * both.mean() == pytest.approx(area, abs=0.02)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("gausian:1", "did you mean gaussian"),
        ("flat", "a length from 1e-09 to"),
        ("flat:0", "a length from 1e-09 to"),
        ("flat:-1", "a length from 1e-09 to"),
        ("gaussian:nan", "a length from 1e-09 to"),
        ("gaussian:inf", "a length from 1e-09 to"),
        ("gaussian:1kg", "a length from 1e-09 to"),
        ("", "expected gaussian:RADIUS or flat:RADIUS"),
    ],
)
def test_bad_beams_are_refused(text, words):
    with pytest.raises(ProfileError, match=words):
        parse_beam(text)


def test_a_radius_may_have_a_unit():
    assert parse_beam("gaussian:500um") == parse_beam("gaussian:0.05cm") == Beam("gaussian", 0.5)
    assert Beam("flat", np.float32(0.5)) == Beam("flat", 0.5)


@pytest.mark.parametrize(
    ("kind", "radius", "words"),
    [("gausian", 1.0, "kind"), ("flat", 0.0, "radius_mm"), ("flat", "1", "radius_mm")],
)
def test_invalid_fields_are_refused(kind, radius, words):
    with pytest.raises(ProfileError, match=words):
        Beam(kind, radius)


@pytest.mark.parametrize("radius", [5.0, 1.0, 0.2, 0.02, 1e-3])
def test_a_gaussian_beam_spreads_light_like_rices_distribution(radius):
    """Annuli wider and narrower than the beam, against adaptive quadrature of its definition."""
    edges = np.array([0.0, 0.1, 0.13, 0.5, 0.52, 2.0])
    radii = np.append(edges, [2.5, 4.0])
    found = within_gaussian(radii, edges, radius)
    deviation = 0.5 * radius
    for annulus, (low, high) in enumerate(itertools.pairwise(edges)):
        for k, r in enumerate(radii):

            def within(s, r=r):
                return 2.0 * s * stats.ncx2.cdf((r / deviation) ** 2, 2, (s / deviation) ** 2)

            near = np.clip([r - 9.0 * deviation, r, r + 9.0 * deviation], low, high)
            ends = itertools.pairwise([low, *near, high])
            parts = [integrate.quad(within, *each, epsabs=1e-13)[0] for each in ends]
            expected = sum(parts) / (high**2 - low**2)
            assert found[k, annulus] == pytest.approx(expected, abs=2e-10)


def test_a_beam_far_narrower_than_annuli_changes_nothing():
    profile = gaussians(finer=1.0)
    found = under_beam(profile, Beam("gaussian", 1e-6))
    annuli = len(profile.annulus_energy)
    np.testing.assert_allclose(found.annulus_energy[:annuli], profile.annulus_energy, atol=1e-6)
    np.testing.assert_allclose(found.beyond_grid, profile.beyond_grid, atol=1e-6)


@pytest.mark.parametrize("kind", ["gaussian", "flat"])
def test_a_beam_over_too_many_annuli_is_refused_before_the_walk(kind, tmp_path):
    begun = []
    with pytest.raises(ProfileError, match=r"more annuli .* mm wide, and 20,000 is the limit"):
        simulate_to_files(
            [load_material("skin1")],
            [tmp_path / "a.npz"],
            beam=Beam(kind, 1e4),
            watch=lambda label: begun.append(label) or contextlib.nullcontext(),
        )
    assert not begun


def test_a_beam_is_not_put_on_a_beam():
    profile = under_beam(gaussians(finer=4.0), parse_beam("flat:1"))
    assert profile.meta["beam"] == "flat:1"
    with pytest.raises(ProfileError, match="under a beam already: flat:1"):
        under_beam(profile, parse_beam("flat:1"))


def test_files_are_under_the_beam_and_a_finished_one_of_another_is_not_taken(tmp_path, caplog):
    caplog.set_level("INFO", logger="sssfit")
    material, path = load_material("skin1"), tmp_path / "x.npz"
    given = {"photons": 2000, "dr_mm": 0.5, "radius_mm": 10.0}
    beam = parse_beam("gaussian:1")
    run = lambda **more: simulate_to_files([material], [path], settings=given, **more).outcomes[0]  # noqa: E731
    pencil = run()
    wide = run(beam=beam)
    np.testing.assert_array_equal(
        wide.profile.annulus_energy, under_beam(pencil.profile, beam).annulus_energy
    )
    assert run(beam=beam, resume=True).seconds is None
    assert run(resume=True).seconds is not None
    assert "beam" not in Profile.load(path).meta
