"""Comparisons of the photon walk with theory and with independent programs, at any size.

The tests run them small (and full under the marker ``slow``) and assert on ``sigmas``;
docs/make_verification.py runs them full and tabulates the figures.

A check compares totals as a z score, profiles as chi-square over annuli merged until each holds
100 hits; the chi-square's p value is given as the z score of the same two-sided probability, so
one limit, ``LIMIT`` standard errors, serves all.
"""

import functools
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import reference
from scipy import stats

from sssfit.material import Layer, Material, load_material
from sssfit.profile import Profile
from sssfit.simulate import simulate_montecarlo

LIMIT = 4.5
MIN_HITS = 100
MCML = Path(__file__).parent / "data" / "mcml_skin1_chicken1_ketchup.npz"


@dataclass(frozen=True)
class Figure:
    """One line of evidence: ours against theirs; ``sigmas`` is how far they are apart."""

    what: str
    ours: str
    theirs: str
    sigmas: float


def medium(sigma_a, sigma_s, eta, g=0.0, name="test"):
    """A homogeneous half space; one channel for numbers, one each for lists."""
    sigma_a, sigma_s = np.atleast_1d(sigma_a), np.atleast_1d(sigma_s)
    channels = tuple(f"c{k}" for k in range(sigma_a.size))
    layer = Layer(eta, np.full(sigma_a.size, g), sigma_a, sigma_s)
    return Material(name, channels, (layer,))


def moments(profile: Profile):
    """Sums of w and w^2 over photons per bin, (n + 1, C), the last bin beyond the grid."""
    n = profile.photons
    energy = np.vstack([profile.annulus_energy, profile.beyond_grid])
    stderr = np.vstack([profile.annulus_energy_stderr, profile.beyond_grid_stderr])
    return n * energy, n * ((n - 1) * stderr**2 + energy**2)


def merge(values, groups):
    """Sum runs of bins: groups holds the first bin of each run."""
    return np.add.reduceat(values, groups)


def groups_of_hits(*hits):
    """First bins of the shortest runs in which every one of ``hits`` reaches MIN_HITS."""
    starts, sums = [0], np.zeros(len(hits))
    for k in range(len(hits[0])):
        sums += [each[k] for each in hits]
        if np.all(sums >= MIN_HITS):
            starts.append(k + 1)
            sums[:] = 0.0
    # What is left at the end joins the last run that has its hits.
    return np.array(starts[:-1] if len(starts) > 1 else starts)


def effective_hits(sums, squares):
    """Hits a bin is worth: (sum w)^2 / sum w^2, at most the true number."""
    return np.divide(sums**2, squares, out=np.zeros_like(sums), where=squares > 0.0)


def chi_square_sigmas(difference, variance):
    """Z score with the two-sided probability of sum(d^2/var) under independent normal bins."""
    chi2 = float(np.sum(difference**2 / variance))
    return float(stats.norm.isf(stats.chi2.sf(chi2, len(difference)) / 2.0)), chi2


def standard_error(sums, squares, photons):
    """Standard error of a mean over photons."""
    mean = sums / photons
    return np.sqrt(np.maximum(squares / photons - mean**2, 0.0) / (photons - 1))


def totals(photons):
    """Index-matched totals against Chandrasekhar, index 1.5 against Giovanelli."""
    return [*(chandrasekhar(each, photons) for each in (0.5, 0.9, 0.99)), giovanelli(photons)]


def chandrasekhar(albedo, photons):
    """The total of an index-matched half space against Chandrasekhar's H function."""
    profile = simulate_montecarlo(medium(1.0 - albedo, albedo, 1.0), photons=photons)
    total, stderr = profile.diffuse_reflectance[0], profile.diffuse_reflectance_stderr[0]
    theory = reference.chandrasekhar_total(albedo)
    return Figure(
        f"index-matched total, albedo {albedo}, against Chandrasekhar's H",
        f"{total:.6f} ± {stderr:.6f}",
        f"{theory:.6f}",
        (total - theory) / stderr,
    )


def giovanelli(photons):
    """Specular and diffuse reflectance at index 1.5, albedo 0.9."""
    profile = simulate_montecarlo(medium(1.0, 9.0, 1.5), photons=photons)
    total = profile.specular_reflectance + profile.diffuse_reflectance[0]
    # Published to four digits: half a unit of the last belongs to the reference.
    stderr = np.hypot(profile.diffuse_reflectance_stderr[0], 0.00005 / np.sqrt(3.0))
    return Figure(
        "specular + diffuse, eta 1.5, albedo 0.9, against Giovanelli 1955",
        f"{total:.6f} ± {profile.diffuse_reflectance_stderr[0]:.6f}",
        "0.2600",
        (total - 0.26) / stderr,
    )


def single_scattering(photons, eta):
    """F1(r): at albedo 1e-6 all but a millionth of what returns has collided once.

    Annuli are merged by the hits that theory expects: in the tail, photons that collided twice
    are many and weigh a millionth, so the run's own hits would not tell that one is missing.
    """
    albedo = 1e-6
    profile = simulate_montecarlo(
        medium(1.0 - albedo, albedo, eta), photons=photons, dr_mm=0.05, radius_mm=5.0
    )
    sums, squares = (each[:, 0] for each in moments(profile))
    theory = [reference.single_scattering_cumulative(r, albedo, eta) for r in profile.r_edges_mm]
    theory.append(reference.single_scattering_cumulative(1e9, albedo, eta))
    groups = groups_of_hits(photons * np.diff(theory) / albedo)
    ours = merge(sums, groups) / photons
    error = standard_error(merge(sums, groups), merge(squares, groups), photons)
    expected = merge(np.diff(theory), groups)
    sigmas, _ = chi_square_sigmas(ours - expected, error**2)
    return Figure(
        f"single scattering F1(r), eta {eta}, {len(groups)} annuli",
        f"total {ours.sum() / albedo:.6f} a",
        f"{theory[-1] / albedo:.6f} a",
        sigmas,
    )


@functools.cache
def lane_profile(name, photons, seed=1):
    """A shipped material by the library's walk."""
    return simulate_montecarlo(load_material(name), photons=photons, seed=seed)


def against_scalar_loop(name, photons):
    """The lane walk against the literal one-photon-at-a-time loop, per channel."""
    material, profile = load_material(name), lane_profile(name, photons)
    layer = material.layers[0]
    bins, squares, hits, *_ = reference.scalar_walk(
        7,
        photons,
        layer.albedo,
        layer.mean_free_path_mm,
        layer.eta,
        profile.r_edges_mm[1],
        profile.n_annuli,
    )
    ours, our_squares = moments(profile)
    figures = []
    for c, channel in enumerate(material.channels):
        groups = groups_of_hits(hits[:, c], effective_hits(ours[:, c], our_squares[:, c]))
        a, b = merge(ours[:, c], groups) / photons, merge(bins[:, c], groups) / photons
        variance = (
            standard_error(merge(ours[:, c], groups), merge(our_squares[:, c], groups), photons)
            ** 2
            + standard_error(merge(bins[:, c], groups), merge(squares[:, c], groups), photons) ** 2
        )
        sigmas, chi2 = chi_square_sigmas(a - b, variance)
        figures.append(
            Figure(
                f"{name} {channel}: lanes against scalar loop, {len(groups)} annuli",
                f"{a.sum():.6f}, chi² {chi2:.0f}",
                f"{b.sum():.6f}",
                sigmas,
            )
        )
    return figures


def against_mcml(name, photons, profile=None, what="lanes"):
    """The lane walk, or ``what`` made a profile, against the original MCML program's, per channel.

    MCML's own errors come from 10 batches: of a single annulus they scatter by a quarter, which a
    chi-square does not forgive. Near the axis its photons carry the same weights as ours, so our
    variance per photon is the better one; in the tail its roulette, one a channel, leaves fewer
    and heavier photons, and there its errors, merged over many annuli, say so. The larger counts.
    """
    profile = profile or lane_profile(name, photons)
    ours, our_squares = moments(profile)
    figures = []
    with np.load(MCML) as data:
        for c, channel in enumerate(profile.channels):
            key = f"{name}_{channel}_"
            r, rd, dr = data[key + "r"][:-1], data[key + "rd"][:-1], float(data[key + "dr_mm"])
            np.testing.assert_allclose(profile.r_edges_mm[1], dr, rtol=1e-6)
            n = min(len(r), profile.n_annuli)
            area = 2.0 * np.pi * r[:n] * dr
            theirs, their_error = rd[:n] * area, data[key + "se"][:n] * area
            sums, squares = ours[:n, c], our_squares[:n, c]
            their_hits = np.divide(
                theirs**2, their_error**2, out=np.zeros(n), where=their_error > 0.0
            )
            groups = groups_of_hits(effective_hits(sums, squares), their_hits)
            a, b = merge(sums, groups) / photons, merge(theirs, groups)
            error = standard_error(merge(sums, groups), merge(squares, groups), photons)
            expected = error**2 * photons / float(data[key + "photons"])
            variance = error**2 + np.maximum(expected, merge(their_error**2, groups))
            sigmas, chi2 = chi_square_sigmas(a - b, variance)
            figures.append(
                Figure(
                    f"{name} {channel}: {what} against MCML 1.2.2, {len(groups)} annuli",
                    f"{a.sum():.6f}, chi² {chi2:.0f}",
                    f"{b.sum():.6f}",
                    sigmas,
                )
            )
            total, stderr = profile.diffuse_reflectance[c], profile.diffuse_reflectance_stderr[c]
            theirs_total, theirs_stderr = float(data[key + "total"]), float(data[key + "total_se"])
            figures.append(
                Figure(
                    f"{name} {channel}: total, {what} against MCML 1.2.2",
                    f"{total:.6f} ± {stderr:.6f}",
                    f"{theirs_total:.6f} ± {theirs_stderr:.6f}",
                    (total - theirs_total) / np.hypot(stderr, theirs_stderr),
                )
            )
    return figures
