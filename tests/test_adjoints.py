"""Every hand-written derivative of the fits as an adjoint: <A x, y> = <x, A^H y>.

A is the derivative of a function, taken along x by central differences; A^H is what the code has
in place of it: a gradient (y is then 1), or slopes that are multiplied with a gradient further on.
The habit is prysm's (its ``test_adjoint``): one identity for gradients, Jacobians and their chains.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import scipy.optimize
from reference_pixels import one_over_r_profile

from sssfit.fit import _by_hand, _fitted_taps, artist, burley, falloff, guided, weighted
from sssfit.fit._chain_pairs import PairChain
from sssfit.fit._chain_stars import StarChain
from sssfit.fit._gaussians_basis import basis_of
from sssfit.fit._gaussians_objective import make_annuli
from sssfit.fit._spectrum import spectral_target
from sssfit.fit._target import Target
from sssfit.fit._tied_chain import one_shape
from sssfit.kernel.structure import parse
from sssfit.shapes import diffusion_cdf

SEEDS = range(4)
EDGES_MM = 0.2 * (np.arange(23) - 0.5)  # of 22 pixels of a half line
PIXELS = EDGES_MM.size - 1
COPIES = np.where(np.arange(PIXELS) == 0, 1.0, 2.0)


class _Caught(Exception):  # noqa: N818 (not an error: it carries what was handed over)
    """What a fit hands to its optimiser."""


@dataclass(frozen=True)
class Pair:
    """A function from x (n,) to f (m,) or a number, with A^H y (n,) at x, and a place x."""

    file: str
    function: Callable
    adjoint: Callable
    at: np.ndarray


def numbers(seed: int = 11) -> np.random.Generator:
    return np.random.default_rng(seed)


def a_line() -> np.ndarray:
    return numbers().random(PIXELS)


def a_quadrant() -> np.ndarray:
    square = numbers().random((PIXELS, PIXELS))
    return square + square.T


def caught(monkeypatch, module, name: str, run: Callable) -> tuple:
    """Return what a fit hands to the optimiser of that name, which does not run."""

    def instead(*given, **named):
        raise _Caught(given, named)

    with monkeypatch.context() as patch:
        patch.setattr(module, name, instead)
        with pytest.raises(_Caught) as handed:
            run()
    return handed.value.args


def of_value(file: str, function: Callable, at: np.ndarray) -> Pair:
    """A function that returns its value and its gradient."""
    return Pair(file, lambda x: function(x)[0], lambda x, y: y * function(x)[1], at)


def of_slopes(file: str, function: Callable, at: np.ndarray) -> Pair:
    """A function that returns values (m,) and their derivatives (n, m)."""
    return Pair(file, lambda x: function(x)[0], lambda x, y: function(x)[1] @ y, at)


# Parts of the fits, each by itself.


def gaussians_over_pixels(_) -> Pair:
    """Each line has its own width: the derivative of line i by log sigma_i, by no other."""

    def lines(x):
        return _by_hand.gaussian_pixels(EDGES_MM, np.exp(x))[0].ravel()

    def adjoint(x, y):
        slopes = _by_hand.gaussian_pixels(EDGES_MM, np.exp(x))[1]
        return np.sum(slopes * y.reshape(slopes.shape), axis=1)

    return Pair("_by_hand.py", lines, adjoint, np.log([0.1, 0.7, 3.0]))


def a_pass_of_unit_sum(_) -> Pair:
    slopes = numbers().normal(size=(4, PIXELS))
    return of_slopes(
        "_by_hand.py",
        lambda x: _by_hand.normalised(a_line() + x @ slopes, slopes),
        np.array([0.02, -0.01, 0.03, 0.0]),
    )


def misfit_of_a_line(_) -> Pair:
    wanted, weights = numbers(1).random(PIXELS), COPIES
    return of_value("_by_hand.py", lambda x: _by_hand.line_misfit(x, wanted, weights), a_line())


def misfit_of_a_kernel(_) -> Pair:
    wanted = a_quadrant()
    return of_value("_by_hand.py", lambda x: _by_hand.kernel_misfit(x, wanted, COPIES), a_line())


def two_gaussians(_) -> Pair:
    at = np.array([0.3, -2.0, 0.4])
    return of_slopes("artist.py", lambda x: artist.two_gaussians(EDGES_MM, x), at)


def stretched_skin(_) -> Pair:
    at = np.array([0.6, 0.2])
    return of_slopes("falloff.py", lambda x: falloff.stretched_skin(x, EDGES_MM), at)


def sampled_misfit(_) -> Pair:
    quadrant = a_quadrant()
    return of_value("falloff.py", lambda x: falloff.sampled_misfit(x, quadrant), a_line())


# Whole objectives, as the optimisers get them.


def artist_by_line(monkeypatch) -> Pair:
    def misfit(half):
        return _by_hand.line_misfit(half, a_line(), COPIES)

    return artist_objective(monkeypatch, misfit)


def artist_by_kernel(monkeypatch) -> Pair:
    def misfit(half):
        return _by_hand.kernel_misfit(half, a_quadrant(), COPIES)

    return artist_objective(monkeypatch, misfit)


def artist_objective(monkeypatch, misfit: Callable) -> Pair:
    (given, _) = caught(
        monkeypatch, artist, "minimise", lambda: artist.fit_two_gaussians(EDGES_MM, misfit)
    )
    return of_value("artist.py", given[0], np.array([0.4, -1.0, 1.5]))


def falloff_objective(monkeypatch) -> Pair:
    quadrant = a_quadrant()
    given, _ = caught(
        monkeypatch, falloff, "minimise", lambda: falloff.fit_scale(quadrant, EDGES_MM)
    )
    return of_value("falloff.py", given[0], np.array([0.7, -0.3]))


def guided_handed(monkeypatch) -> tuple:
    weights = guided.gamma(PIXELS - 1, 1.55)
    return caught(
        monkeypatch,
        guided,
        "minimise",
        lambda: guided.rank_one(a_quadrant(), weights, 1.0 + a_line(), total=2.0),
    )


def guided_objective(monkeypatch) -> Pair:
    (objective, start), _ = guided_handed(monkeypatch)
    return of_value("guided.py", objective, start)


def guided_sum(monkeypatch) -> Pair:
    (_, start), named = guided_handed(monkeypatch)
    return of_value("guided.py", named["equality"], start)


def sum_of_gaussians(total: float | None, *, signed: bool) -> Callable:
    """The cost by variable projection: 2 J^T r is its gradient, though J leaves a term out."""

    def made(_) -> Pair:
        edges_mm = np.concatenate(([0.0], np.geomspace(0.05, 20.0, 60)))
        r_mm = 0.5 * (edges_mm[1:] + edges_mm[:-1])
        energy = np.exp(-0.8 * r_mm) * np.diff(edges_mm) * (1.0 + 0.1 * np.sin(3.0 * r_mm))
        annuli = make_annuli(edges_mm, energy, total, signed=signed)

        def adjoint(x, y):
            point = annuli.at(x)
            return 2.0 * y * (point.jacobian.T @ point.residual)

        return Pair(
            "_gaussians_objective.py",
            lambda x: annuli.at(x).cost,
            adjoint,
            np.log([0.05, 0.6, 4.0]),
        )

    return made


def coordinates_of_gaussians(_) -> Pair:
    """Gaussians in few coordinates: each depends on its own variance only."""
    annuli = make_annuli(np.linspace(0.0, 9.0, 40), np.ones(39), None, signed=False)
    basis = basis_of(annuli.inner, annuli.width, (-4.0, 5.0))

    def adjoint(x, y):
        slopes = basis.columns(x)[1]
        return np.sum(slopes * y.reshape(slopes.shape), axis=0)

    return Pair(
        "_gaussians_basis.py",
        lambda x: basis.columns(x)[0].ravel(),
        adjoint,
        np.log([0.05, 0.6, 4.0]),
    )


def columns_of_gaussians(_) -> Pair:
    """Energies in annuli: column i depends on its own variance only."""
    annuli = make_annuli(np.linspace(0.0, 9.0, 40), np.ones(39), None, signed=False)

    def adjoint(x, y):
        slopes = annuli._columns(x)[1]
        return np.sum(slopes * y.reshape(slopes.shape), axis=0)

    return Pair(
        "_gaussians_objective.py",
        lambda x: annuli._columns(x)[0].ravel(),
        adjoint,
        np.log([0.05, 0.6, 4.0]),
    )


def shape_of_burley(monkeypatch) -> Pair:
    """Half the sum of squares; the slope whose root is looked for is its derivative in log s."""
    r_mm = np.linspace(0.0, 12.0, 50)
    shares = diffusion_cdf(r_mm, 0.8) + 0.01 * np.sin(r_mm)
    weights = 0.5 * (np.diff(r_mm, append=r_mm[-1]) + np.diff(r_mm, prepend=r_mm[0]))
    given, _ = caught(monkeypatch, burley, "root", lambda: burley._fit_shape(r_mm, shares, "R"))

    def half_of_squares(x):
        left = diffusion_cdf(r_mm, float(np.exp(x[0]))) - shares
        return 0.5 * float(weights @ left**2)

    return Pair(
        "burley.py", half_of_squares, lambda x, y: y * np.array([given[0](x[0])]), np.log([1.3])
    )


def misfit_of_a_chain(file: str, kind: type, structure: str) -> Callable:
    def make(_) -> Pair:
        profile = one_over_r_profile(60, 0.1, [0.3, 0.6])
        target = spectral_target(Target(profile, 0.3, 20), [0, 1], "natural")
        chain = kind(target, parse(structure))
        return of_value(file, chain.value_and_gradient, chain.start(numbers()))

    return make


def misfit_of_a_tied_chain(_) -> Pair:
    profile = one_over_r_profile(60, 0.1, [0.3, 0.6])
    target = spectral_target(Target(profile, 0.3, 20), [0, 1], "natural")
    tied = one_shape(PairChain(target, parse("2-2|2")), is_fitted=True)
    at = tied.start(numbers())
    at += 0.1 * numbers().random(at.size)
    return of_value("_tied_chain.py", tied.value_and_gradient, at)


def misfit_of_weighted_terms(monkeypatch) -> Pair:
    profile = one_over_r_profile(60, 0.1, [0.3])
    (given, *_), _ = caught(
        monkeypatch,
        scipy.optimize,
        "minimize",
        lambda: weighted.fit_weighted(profile, rank=2, mm_per_pixel=0.3, support_mm=3.0),
    )
    return of_value("weighted.py", given, numbers().random(2 * 11))


def misfit_of_fitted_taps(_) -> Pair:
    """Two terms of different signs on two offsets between texels, for two channels."""
    profile = one_over_r_profile(60, 0.1, [0.3, 0.6])
    target = spectral_target(Target(profile, 0.3, 20), [0, 1], "natural")
    signs = np.array([[1.0, 1.0], [-1.0, 1.0]])
    terms = _fitted_taps._Terms(target, signs, target.energy)
    amplitudes = 0.2 + 0.1 * numbers().random(2 * 2 * 3)
    amplitudes[:6] += 0.3  # the first term has more energy than the second takes away
    at = np.concatenate((np.log([1.4, 2.2]), amplitudes))
    return of_value("_fitted_taps.py", lambda x: terms.misfit(x, 2), at)


PAIRS = {
    "misfit of fitted taps": misfit_of_fitted_taps,
    "misfit of weighted terms": misfit_of_weighted_terms,
    "misfit of a tied chain": misfit_of_a_tied_chain,
    "misfit of pairs": misfit_of_a_chain("_chain_pairs.py", PairChain, "1-2|1"),
    "misfit of stars": misfit_of_a_chain("_chain_stars.py", StarChain, "*|1-*"),
    "Gaussians over pixels": gaussians_over_pixels,
    "a pass of unit sum": a_pass_of_unit_sum,
    "misfit of a line": misfit_of_a_line,
    "misfit of a kernel": misfit_of_a_kernel,
    "two Gaussians": two_gaussians,
    "stretched skin": stretched_skin,
    "sampled misfit": sampled_misfit,
    "artist, line": artist_by_line,
    "artist, kernel": artist_by_kernel,
    "falloff": falloff_objective,
    "guided": guided_objective,
    "guided, sum": guided_sum,
    "columns of Gaussians": columns_of_gaussians,
    "coordinates of Gaussians": coordinates_of_gaussians,
    "sum of Gaussians": sum_of_gaussians(None, signed=False),
    "sum of Gaussians, signed": sum_of_gaussians(None, signed=True),
    "sum of Gaussians, total": sum_of_gaussians(1.02, signed=False),
    "sum of Gaussians, signed, total": sum_of_gaussians(1.02, signed=True),
    "shape of normalised diffusion": shape_of_burley,
}


def along(function: Callable, at: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Return A x: central differences of sixth order, of which 1e-11 is left at this step."""
    step = 3e-3 * max(1.0, float(np.abs(at).max())) / float(np.abs(x).max())
    differences = [
        (np.atleast_1d(function(at + k * step * x)) - np.atleast_1d(function(at - k * step * x)))
        for k in (1, 2, 3)
    ]
    return (45.0 * differences[0] - 9.0 * differences[1] + differences[2]) / (60.0 * step)


@pytest.mark.parametrize("name", PAIRS)
def test_a_derivative_and_its_adjoint_are_one_operator(name, monkeypatch):
    pair = PAIRS[name](monkeypatch)
    for seed in SEEDS:
        rng = numbers(seed)
        x = rng.normal(size=pair.at.size)
        forward = along(pair.function, pair.at, x)
        y = rng.normal(size=forward.size)
        adjoint = pair.adjoint(pair.at, y if y.size > 1 else float(y[0]))
        # Relative to the norms: the inner products themselves may be near 0.
        size = np.linalg.norm(adjoint) * np.linalg.norm(x)
        assert size > 0.0
        assert abs(forward @ y - x @ adjoint) <= 1e-8 * size, (name, seed)


def test_a_wrong_adjoint_is_seen(monkeypatch):
    pair = PAIRS["guided"](monkeypatch)
    x = numbers(0).normal(size=pair.at.size)
    right = pair.adjoint(pair.at, 1.0)
    for wrong in (2.0 * right, right[::-1], right + 1e-6 * np.linalg.norm(right)):
        off = abs(float(along(pair.function, pair.at, x)[0]) - x @ wrong)
        assert off > 1e-8 * np.linalg.norm(wrong) * np.linalg.norm(x)


def test_every_file_that_writes_derivatives_has_a_pair(monkeypatch):
    """``_nlopt``, ``cascade`` and ``_gaussians_search`` hand on what they are given.

    ``_chain`` hands it on from its two kinds.
    """
    folder = Path(artist.__file__).parent
    words = ("gradient", "derivative", "jacobian", "slope")
    written = {
        path.name
        for path in folder.glob("*.py")
        if any(word in path.read_text(encoding="utf-8") for word in words)
    }
    tested = {make(monkeypatch).file for make in PAIRS.values()}
    handed_on = {"_nlopt.py", "cascade.py", "_chain.py", "_gaussians_search.py"}
    assert written - handed_on == tested
