"""Another seed: ranges hold the statistic of other seeds, and boundaries stay within their own."""

import dataclasses
import functools

import numpy as np
import pytest

from sssfit.material import load_material
from sssfit.methods import STRESSES
from sssfit.stability import gaussians, noise, stability
from sssfit.stability.seeds import bias_range, median_range, spread_range
from sssfit.stability.ways import Way

PAIRS = 4000
MISSED = 0.0027  # of three standard deviations


@pytest.mark.parametrize("seeds", [4, 6, 16])
@pytest.mark.parametrize("statistic", [median_range, spread_range, bias_range])
def test_a_range_holds_the_statistic_of_other_seeds(statistic, seeds):
    """Of lognormal errors or normal widths, as often as three deviations say."""
    rng = np.random.default_rng(seeds)
    # Samples share a median's deviation, and a chart has three to five of them; others have theirs.
    together = 4 if statistic is median_range else PAIRS
    missed = 0
    for _ in range(PAIRS // together):
        first, second = 0.4 * rng.standard_normal((2, together, seeds))
        if statistic is median_range:
            first, second = np.exp(first), np.exp(second)
        if statistic is bias_range:  # a mean far from 0, so that its sign is none
            first, second = first + 5.0, second + 5.0
        found, other = statistic(list(first)), statistic(list(second))
        missed += int(np.sum((other.at < found.low) | (other.at > found.high)))
    assert missed <= MISSED * PAIRS + 5.0 * np.sqrt(MISSED * PAIRS)
    if statistic is not median_range:  # whose factor is that of many seeds, and wide for four
        assert missed >= MISSED * PAIRS - 3.0 * np.sqrt(MISSED * PAIRS)


def test_a_refused_fit_has_no_upper_end():
    found = median_range([np.array([1.0, 2.0, np.inf]), np.array([1.0, 1.1, 1.2])])
    assert found.at[0] == 2.0
    assert found.high[0] == np.inf
    assert np.isfinite(found.high[1])
    assert spread_range([np.array([1.0, np.inf])]).at[0] == np.inf
    assert bias_range([np.array([1.0, np.inf])]).low[0] == np.inf


def edge_of(edge, end):
    """Return a boundary and its range; the axis' end where there is none."""
    return (end, end, end) if edge is None else (edge.at, edge.low, edge.high)


def moved_beyond(first, second):
    """Name the boundaries in a second run's panels outside the ranges of a first one."""
    found = []
    for one, two in zip(first, second, strict=True):
        for a, b in zip(one.curves, two.curves, strict=True):
            ends = a.x[0], a.x[-1]
            for end, edge, other in zip(ends, one.edges(a), two.edges(b), strict=True):
                at, low, high = edge_of(edge, end)
                there = edge_of(other, end)[0]
                if not low <= there <= high:
                    found.append(f"{one.title}, {a.label}: {at:g} ({low:g} to {high:g}), {there:g}")
    return found


@pytest.fixture
def small(monkeypatch):
    """Stresses of few photons, seeds and Gaussians."""
    monkeypatch.setattr(noise, "_LAST", 5)
    monkeypatch.setattr(noise, "_SEEDS", 8)
    ways = [Way("svd 3", "svd", {"rank": 3}), Way("pre-integrated", "preintegrated", {})]
    monkeypatch.setattr(noise, "WAYS", ways)
    monkeypatch.setattr(noise, "KERNELS", ways)
    monkeypatch.setattr(noise, "_SMOOTHED", ())  # a third of the time; test_stability smooths
    monkeypatch.setattr(gaussians, "_COUNTS", (1, 2, 3))
    monkeypatch.setattr(gaussians, "_STARTED", (1, 2, 3))


def run(seed, stress):
    return stability(load_material("skin1"), only=[stress], seed=seed, threads=1).panels


first_run = functools.cache(functools.partial(run, 1))  # of the stresses made small


def test_another_seed_moves_no_boundary_by_more_than_its_range(small):
    first, second = (
        [panel for stress in ("noise", "gaussians") for panel in panels_of(stress)]
        for panels_of in (first_run, functools.partial(run, 2))
    )
    errors = [[each.y for each in panels[0].curves] for panels in (first, second)]
    assert not np.array_equal(*errors)
    assert moved_beyond(first, second) == []


def test_a_boundary_that_moved_is_found(small, monkeypatch):
    """Pictures a quarter as wrong need a sixteenth of the photons."""
    first = [dataclasses.replace(each, curves=each.curves[:1]) for each in first_run("noise")]
    monkeypatch.setattr(noise, "WAYS", noise.WAYS[:1])
    real = noise._seen
    monkeypatch.setattr(
        noise,
        "_seen",
        lambda *given: (seen := real(*given))._replace(error=0.25 * seen.error),
    )
    found = moved_beyond(first, run(2, "noise"))
    assert any("svd 3:" in each for each in found)


@pytest.mark.slow
def test_another_seed_moves_no_boundary_of_any_stress():
    first, second = (
        stability(load_material("skin1"), only=list(STRESSES), seed=seed).panels for seed in (1, 2)
    )
    assert moved_beyond(first, second) == []
