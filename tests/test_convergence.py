"""A simulation's error against its price: direct calls, the slope, the chart, the script."""

import io
import itertools
import math

import numpy as np
import pytest
from figures import assert_legible, words_of
from printed import check
from printed_layouts import convergence
from walk_convergence import convergence_figure

from sssfit.chart.page import save_figure
from sssfit.compare.convergence import (
    compute_convergence,
    error_of,
    fit_line,
    photon_numbers,
)
from sssfit.errors import SimulationError
from sssfit.material import load_material
from sssfit.simulate import simulate_exact, simulate_montecarlo

PHOTONS = (3000, 10_000, 30_000, 100_000)
TOLERANCES = (1e-4, 5e-6)


@pytest.fixture(scope="module")
def skin1():
    return load_material("skin1")


def found_with(skin1, **settings):
    return compute_convergence(
        skin1, **({"photons": PHOTONS, "seeds": 4, "tolerances": TOLERANCES} | settings)
    )


@pytest.fixture(scope="module")
def found(skin1):
    return found_with(skin1)


def test_errors_are_those_of_direct_calls(skin1, found):
    exact = simulate_exact(skin1, tolerance=TOLERANCES[-1])
    for run in found.walks[:3] + found.walks[-1:]:
        walk = simulate_montecarlo(skin1, photons=run.photons, seed=run.seed)
        total = exact.annulus_energy.sum(axis=0) + exact.beyond_grid
        worst = 0.0
        for c in range(3):
            f = np.cumsum(walk.annulus_energy[:, c]) - np.cumsum(exact.annulus_energy[:, c])
            worst = max(worst, float(np.max(np.abs(f))) / total[c])
        assert run.error == pytest.approx(worst, rel=1e-9)
    coarse, fine = found.resolutions
    own = simulate_exact(skin1, tolerance=TOLERANCES[0])
    assert coarse.error == pytest.approx(error_of(own, exact), rel=1e-9)
    assert fine.error is None
    assert fine.estimate == exact.meta["relative_error"]


def test_the_exact_methods_estimate_is_no_less_than_its_error(found):
    coarse, _ = found.resolutions
    assert 0.0 < coarse.error <= coarse.estimate


@pytest.mark.parametrize("first_seed", [1, 101, 201, 301])
def test_the_slope_is_minus_one_half(skin1, first_seed):
    # Central limit theorem: error ~ photons^(-1/2), within three of the fit's standard errors.
    line = found_with(skin1, seeds=6, first_seed=first_seed, tolerances=(1e-4,)).line
    assert abs(line.slope + 0.5) < 3.0 * line.slope_stderr
    assert line.slope_stderr < 0.1  # so that a slope of -1 or 0 would be seen


def test_no_two_walks_share_a_seed(found):
    seeds = [each.seed for each in found.walks]
    assert len(set(seeds)) == len(seeds) == 4 * len(PHOTONS)


def test_lines_are_those_of_numpy():
    random = np.random.default_rng(3)
    photons = np.repeat([1e3, 1e4, 1e6], 5)
    errors = 3.0 * photons**-0.4 * np.exp(random.normal(0.0, 0.3, photons.size))
    line = fit_line(photons, errors)
    coefficients, covariance = np.polyfit(np.log10(photons), np.log10(errors), 1, cov=True)
    assert (line.slope, line.intercept) == pytest.approx(tuple(coefficients))
    assert line.slope_stderr == pytest.approx(math.sqrt(covariance[0, 0]))
    exact = fit_line([10, 1000], [1.0, 0.1])
    assert exact.slope == pytest.approx(-0.5)
    assert math.isnan(exact.slope_stderr)
    assert exact.at([100])[0] == pytest.approx(10**-0.5)


def test_seconds_are_the_clocks(skin1):
    ticks = itertools.count()
    settings = {"photons": (1000, 2000), "seeds": 1, "tolerances": (1e-4,)}
    run = found_with(skin1, clock=lambda: float(next(ticks)), **settings)
    assert {each.seconds for each in run.walks + run.resolutions} == {1.0}


def test_a_tolerance_that_cannot_be_met_ends_the_ladder(skin1):
    run = found_with(skin1, photons=(1000, 2000), seeds=1, tolerances=(1e-4, 1e-13))
    assert len(run.resolutions) == 1
    assert run.exact.meta["settings"]["tolerance"] == 1e-4


def test_runs_of_one_resolution_count_once(skin1):
    run = found_with(skin1, photons=(1000, 2000), seeds=1, tolerances=(1e-3, 1e-4))
    assert [each.tolerance for each in run.resolutions] == [1e-3]


def test_bad_settings_are_refused(skin1):
    for settings in ({"photons": (1000,)}, {"photons": (1000, 1000)}, {"seeds": 0}):
        with pytest.raises(SimulationError, match="for a slope"):
            found_with(skin1, **settings)


def test_what_is_drawn_is_what_was_computed(found):
    figure = convergence_figure(found)
    left, right = figure.axes
    _, fitted, walks = left.lines
    np.testing.assert_array_equal(walks.get_xdata(), [each.photons for each in found.walks])
    np.testing.assert_array_equal(walks.get_ydata(), [each.error for each in found.walks])
    np.testing.assert_allclose(fitted.get_ydata(), found.line.at(fitted.get_xdata()))
    half = left.lines[0]
    drop = np.diff(np.log10(half.get_ydata())) / np.diff(np.log10(half.get_xdata()))
    assert drop == pytest.approx(-0.5)
    np.testing.assert_array_equal(
        right.lines[2].get_ydata(), [each.estimate for each in found.resolutions]
    )
    words = f"fitted slope {found.line.slope:.3f} ± {found.line.slope_stderr:.3f}"
    assert words in words_of(figure)


def test_the_chart_is_legible_and_gives_the_same_bytes(found):
    seen, again = assert_legible(lambda: convergence_figure(found)), convergence_figure(found)
    streams = [io.BytesIO() for _ in range(2)]
    for each, figure in zip(streams, (seen, again), strict=True):
        save_figure(figure, each, format="svg")
    assert streams[0].getvalue() == streams[1].getvalue()


@pytest.fixture
def script(tmp_path, monkeypatch, capsys):
    """Run docs/make_convergence.py in an empty folder; give what it printed, or its last word."""
    import make_convergence

    monkeypatch.chdir(tmp_path)

    def call(*arguments):
        monkeypatch.setattr("sys.argv", ["make_convergence.py", *arguments])
        make_convergence.main()
        return capsys.readouterr().out

    return call


def test_the_script_prints_slope_and_runs(script, tmp_path, monkeypatch, skin1):
    made = []

    def quick(*given, **settings):
        made.append(compute_convergence(*given, tolerances=(1e-4,), **settings))
        return made[-1]

    monkeypatch.setattr("make_convergence.compute_convergence", quick)
    out = script("skin1", "1e5", "c.svg")
    assert b"<svg" in (tmp_path / "c.svg").read_bytes()
    (found,) = made
    check(out, convergence(found.to_dict()))
    expected = quick(skin1, photons=(10_000, 31_623, 100_000))
    assert found.line == expected.line
    assert [each.error for each in found.walks] == [each.error for each in expected.walks]
    assert found.to_dict()["exact"][-1]["error"] is None


@pytest.mark.parametrize(
    ("arguments", "fragment"),
    [
        (("skin1", "1e5", "c.jpg"), ".png, .svg or .pdf"),
        (("skin1", "1000", "c.png"), "too few for a slope"),
        (("none", "1e5", "c.png"), "none"),
    ],
)
def test_bad_input_is_one_clear_line(script, tmp_path, arguments, fragment):
    with pytest.raises(SystemExit) as ended:
        script(*arguments)
    assert str(ended.value).count("\n") == 0
    assert fragment in str(ended.value)
    assert list(tmp_path.iterdir()) == []


def test_two_numbers_of_photons_a_decade():
    assert photon_numbers(10**6) == (10_000, 31_623, 100_000, 316_228, 1_000_000)
    with pytest.raises(SimulationError, match="too few for a slope"):
        photon_numbers(99_999)
