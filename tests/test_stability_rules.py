"""Rules: each fires within its region and is silent outside, at the limit that its stress found."""

import dataclasses

import numpy as np
import pytest
from scipy import sparse
from test_profile import make_profile
from test_taps import taps_of

from sssfit.fit import fit_gaussians, fit_guided, fit_result, fit_svd
from sssfit.fit._target import Target
from sssfit.fit.on_taps import on_taps
from sssfit.fit.svd import all_eigenvalues
from sssfit.material import load_material
from sssfit.methods import STRESSES
from sssfit.shapes import gaussian_cdf
from sssfit.simulate import simulate_exact, simulate_montecarlo
from sssfit.stability import rules
from sssfit.stability.facts import Facts
from sssfit.stability.kernel_rules import crawling
from sssfit.stability.noise_floor import noise_ratio, rank_of_noise

PITCH = 0.3
# What the fits themselves warn of is not asked here.
pytestmark = pytest.mark.filterwarnings("ignore::sssfit.errors.SssfitWarning")


@pytest.fixture(scope="module")
def exact():
    return simulate_exact(load_material("skin1"))


@pytest.fixture(scope="module")
def walks():
    """Walks of few and of many photons, on the same grid."""
    return {n: simulate_montecarlo(load_material("skin1"), photons=n) for n in (2000, 1_000_000)}


def fired(kernel, profile=None):
    facts = Facts(kernel, profile)
    return {each.name for each in rules.RULES if each.look(facts, each.limit)}


def gaussian_profile(beyond=0.0, annuli=400, **changes):
    edges_mm = np.linspace(0.0, 8.0, annuli + 1)
    energy = np.diff(0.5 * gaussian_cdf(edges_mm[:, None], np.array([1.0])), axis=0)
    return make_profile(edges_mm, energy, beyond_grid=np.array([beyond]), **changes)


def test_every_rule_names_its_stress_and_says_one_sentence(walks):
    assert {each.stress for each in rules.RULES} <= set(STRESSES)
    found = rules.doubts(fit_svd(walks[2000], rank=5, mm_per_pixel=PITCH).kernel, walks[2000])
    assert any("rank 5 lies under this profile's noise floor: rank" in each for each in found)
    for each in found:
        assert "\n" not in each
        assert each.endswith(").")


def test_a_rank_in_the_noise_is_named_and_one_above_it_is_not(walks, exact):
    low = fit_svd(walks[2000], rank=5, mm_per_pixel=PITCH).kernel
    assert "rank-in-noise" in fired(low, walks[2000])
    enough = rank_of_noise(walks[2000], PITCH, low.half_pixels)
    good = fit_svd(walks[2000], rank=enough, mm_per_pixel=PITCH).kernel
    assert "rank-in-noise" not in fired(good, walks[2000])
    many = fit_svd(walks[1_000_000], rank=3, mm_per_pixel=PITCH).kernel
    assert "rank-in-noise" not in fired(many, walks[1_000_000])
    assert "rank-in-noise" not in fired(fit_svd(exact, rank=9, mm_per_pixel=PITCH).kernel, exact)


def test_the_noise_ratio_is_that_of_walks_around_the_exact_kernel(exact):
    """Frobenius norms of the differences of 12 walks' kernels, ring-correlated as walks are."""
    half, photons = 40, 20_000
    wanted = Target(exact, PITCH, half)
    norm = np.linalg.norm(_full(wanted, 0))
    errors, predicted = [], []
    for seed in range(12):
        walk = simulate_montecarlo(
            load_material("skin1"),
            photons=photons,
            seed=seed,
            radius_mm=float(exact.r_edges_mm[-1]),
        )
        apart = _full(Target(walk, PITCH, half), 0) - _full(wanted, 0)
        errors.append(np.linalg.norm(apart) / norm)
        predicted.append(noise_ratio(walk, PITCH)[0])
    # The prediction takes a ring's pixels as alike, which the middle ones are not: 20 %. The mean
    # of squares of 12 walks is known to about 2 sqrt(2 / 12) / 2 of itself over few rings.
    assert np.mean(np.square(errors)) == pytest.approx(np.mean(np.square(predicted)), rel=0.5)


@pytest.mark.parametrize("pitch_mm", [0.15, 0.3, 0.6])
def test_the_noise_ratio_is_that_of_parts_of_pixels(walks, pitch_mm):
    """Independent errors of annuli, each shared by the pixels that a fine grid of points finds."""
    walk, half, parts = walks[2000], 12, 40
    noise, whole = _squares(_shares(walk, pitch_mm, half, parts), walk)
    assert noise_ratio(walk, pitch_mm) == pytest.approx(np.sqrt(noise / whole), rel=0.04)


def test_the_noise_floor_is_that_of_simulated_noise_of_rings(walks):
    """Eigenvalues of matrices whose pixels share the noise of the annuli that they cover."""
    walk, half, draws = walks[2000], 24, 64
    shares, side = _shares(walk, PITCH, half, 20), 2 * half + 1
    noise, _ = _squares(shares, walk)
    rng = np.random.default_rng(1)
    for c in range(3):
        errors = walk.annulus_energy_stderr[:, c] * rng.standard_normal((draws, walk.n_annuli))
        eigenvalues = np.abs(np.linalg.eigvalsh((errors @ shares).reshape(draws, side, side)))
        squares = (eigenvalues**2).sum(axis=1)
        assert abs(squares.mean() - noise[c]) < 3.0 * squares.std(ddof=1) / np.sqrt(draws)
        # Rings make noise of few terms; were pixels independent, the largest of 49 eigenvalues
        # would be 2 / sqrt(49) of the norm.
        largest = eigenvalues.max(axis=1) / np.sqrt(squares)
        assert np.median(largest) > 1.5 * 2.0 / np.sqrt(side)


def _shares(profile, pitch_mm, half, parts):
    """The shares (annuli, pixels) of each annulus that fall on pixels, from points on a grid."""
    side = 2 * half + 1
    at_mm = pitch_mm * ((np.arange(side * parts) + 0.5) / parts - half - 0.5)
    radius_mm = np.hypot(at_mm[:, None], at_mm).ravel()
    annulus = np.searchsorted(profile.r_edges_mm, radius_mm, side="right") - 1
    line = np.arange(side * parts) // parts
    pixel = (line[:, None] * side + line).ravel()
    inside = annulus < profile.n_annuli
    found = sparse.coo_array(
        (np.ones(inside.sum()), (annulus[inside], pixel[inside])), (profile.n_annuli, side**2)
    ).tocsr()
    # Whole annuli have as many points as their area says, but for those of few points.
    points = np.pi * np.diff(profile.r_edges_mm**2) * (parts / pitch_mm) ** 2
    is_whole = profile.r_edges_mm[1:] <= pitch_mm * (half + 0.5)
    count = np.where(is_whole, np.maximum(found.sum(axis=1), 1.0), points)
    return sparse.diags_array(1.0 / count) @ found


def _squares(shares, profile):
    """The expected squares of the norms of noise and kernel (C,), by shares of pixels."""
    own = (shares * shares).sum(axis=1)
    noise = (profile.annulus_energy_stderr**2 * own[:, None]).sum(axis=0)
    return noise, ((shares.T @ profile.annulus_energy) ** 2).sum(axis=0)


def _full(target, channel):
    quadrant = target.quadrant(channel)
    line = np.concatenate((quadrant[:0:-1], quadrant))
    return np.concatenate((line[:, :0:-1], line), axis=1)


def test_the_rank_of_noise_is_where_the_residual_meets_it(walks):
    walk, half = walks[2000], 40
    noise = noise_ratio(walk, PITCH)
    rank = rank_of_noise(walk, PITCH, half)
    left = []
    for c in range(3):
        squares = np.sort(all_eigenvalues(Target(walk, PITCH, half).quadrant(c)) ** 2)[::-1]
        left.append(np.sqrt(np.append(squares, 0.0)[rank:].sum() / squares.sum()))
    assert (np.array(left) <= noise).all()


def test_few_photons_are_named_with_how_many_would_do(walks):
    gaussians = fit_gaussians(walks[2000], terms=4, mm_per_pixel=PITCH).kernel
    (words,) = [each for each in rules.doubts(gaussians, walks[2000]) if "photons leave" in each]
    assert "2,000 photons leave noise of" in words
    assert "about 2e+05 photons" in words or "about 1e+05 photons" in words
    many = fit_gaussians(walks[1_000_000], terms=4, mm_per_pixel=PITCH).kernel
    assert "few-photons" not in fired(many, walks[1_000_000])


def test_a_smoothed_walk_may_have_fewer_photons():
    """Of svd by a factor of 4, as the stress of noise has it; not so few that nothing helps."""
    told = {}
    for photons in (1000, 20_000):
        profile = simulate_montecarlo(load_material("skin1"), photons=photons)
        for smooth in (False, True):
            kernel = fit_result(profile, "svd", rank=1, mm_per_pixel=0.3, smooth=smooth).kernel
            words = [each for each in rules.doubts(kernel, profile) if "photons leave" in each]
            told[photons, smooth] = words
    assert "a smoothed profile, about" in told[20_000, False][0]
    assert told[20_000, True] == []
    assert "smoothed" not in told[1000, False][0]
    assert told[1000, True]


def test_light_beyond_the_grid_is_named():
    for beyond, is_named in ((0.0, False), (4e-4, False), (6e-4, True)):
        profile = gaussian_profile(beyond=beyond)
        kernel = fit_svd(profile, rank=1, mm_per_pixel=PITCH).kernel
        assert ("light-beyond" in fired(kernel, profile)) is is_named


def test_gaps_in_the_data_are_named():
    whole = gaussian_profile()
    kernel = fit_svd(whole, rank=1, mm_per_pixel=PITCH).kernel
    assert "gaps" not in fired(kernel, whole)
    energy = whole.annulus_energy.copy()
    energy[20:40] = 0.0
    holed = dataclasses.replace(whole, annulus_energy=energy)
    assert "gaps" in fired(kernel, holed)


def test_coarse_annuli_are_named_for_gaussians():
    for annuli, is_named in ((400, False), (40, True)):
        profile = gaussian_profile(annuli=annuli)
        kernel = fit_gaussians(profile, terms=1, mm_per_pixel=PITCH).kernel
        assert ("coarse-annuli" in fired(kernel, profile)) is is_named
    svd = fit_svd(profile, rank=1, mm_per_pixel=PITCH).kernel
    assert "coarse-annuli" not in fired(svd, profile)


def test_few_terms_are_not_round(exact):
    for rank, is_named in ((1, True), (2, True), (3, False), (5, False)):
        kernel = fit_svd(exact, rank=rank, mm_per_pixel=PITCH).kernel
        assert ("not-round" in fired(kernel)) is is_named
    coarse = fit_svd(exact, rank=1, mm_per_pixel=PITCH, support_mm=3.0 * PITCH).kernel
    assert "not-round" not in fired(coarse)


def test_a_guide_far_from_50_is_named(exact):
    for b, is_named in ((10.0, True), (40.0, False), (50.0, False), (70.0, False), (100.0, True)):
        kernel = fit_guided(exact, b=b, mm_per_pixel=1.0).kernel
        assert ("guide-b" in fired(kernel)) is is_named


def test_a_halving_behind_one_stage_is_named():
    for structure, is_named in (("1|1", True), ("1-1|1", False), ("1-1", False), ("1", False)):
        assert ("crawling" in fired(taps_of(structure))) is is_named
    still = taps_of("1|1", meta={"settings": {"still": True}})
    assert "crawling" not in fired(still)
    for method, is_said in (("cascade", True), ("pyramid", False)):
        said = crawling(Facts(taps_of("1|1", method=method), None), 2.0)
        assert ("`still`" in said) is is_said


def test_few_taps_are_named(exact):
    kernel = fit_svd(exact, rank=3, mm_per_pixel=PITCH).kernel
    for taps, is_named in ((9, True), (25, False)):
        assert ("few-taps" in fired(on_taps(kernel, taps))) is is_named
    assert "few-taps" not in fired(taps_of("1-1|1-1"))
