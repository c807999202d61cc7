"""Profile models against the exact solution: the comparison's figures, its chart, its verb."""

import dataclasses
import io
import itertools
import json
import math
import warnings

import numpy as np
import pytest
from figures import assert_legible, words_of
from matplotlib.colors import to_hex
from matplotlib.patches import StepPatch
from turns import mostly_slow

from sssfit.chart import looks
from sssfit.chart.models import models_figure
from sssfit.chart.page import save_figure
from sssfit.chart.profile import profile_figure
from sssfit.chart.text import kernel_subtitle
from sssfit.cli import main
from sssfit.compare import compare_models
from sssfit.errors import SimulationError, SssfitWarning
from sssfit.material import Layer, Material, load_material
from sssfit.simulate import simulate_exact, simulate_montecarlo

METHODS = ["exact", "montecarlo", "dipole", "dipole-grosjean", "burley"]


@pytest.fixture(scope="module")
def skin1():
    return compare_models(load_material("skin1"), photons=100_000)


@pytest.fixture(scope="module")
def figure(skin1):
    return models_figure(skin1)


def medium(sigma_a, sigma_s, eta=1.3, g=0.0, name="test", channels=None):
    count = len(sigma_a)
    names = channels or tuple(f"c{k}" for k in range(count))
    return Material(name, names, (Layer(eta, np.full(count, g), sigma_a, sigma_s),))


def test_every_method_stands_on_one_grid(skin1):
    assert [each.method for each in skin1.curves] == METHODS
    assert skin1.exact.method == "exact"
    assert skin1.walk.profile.photons == 100_000
    for each in skin1.curves:
        np.testing.assert_allclose(each.profile.r_edges_mm, skin1.walk.profile.r_edges_mm)


@pytest.mark.parametrize("method", METHODS)
def test_errors_are_those_of_a_loop_over_annuli(skin1, method):
    curve = skin1.curves[METHODS.index(method)]
    ours, exact = curve.profile, skin1.exact.profile
    for c in range(3):
        f, truth, below, above = 0.0, 0.0, 0.0, 0.0
        largest = 0.0
        for k in range(exact.n_annuli):
            inner, outer = exact.r_edges_mm[k : k + 2]
            area = math.pi * (outer**2 - inner**2)
            e, t = ours.annulus_energy[k, c], exact.annulus_energy[k, c]
            f, truth = f + e, truth + t
            largest = max(largest, abs(f - truth))
            above += (e / area - t / area) ** 2 * area / (2 * math.pi)  # r dr over the annulus
            below += (t / area) ** 2 * area / (2 * math.pi)
        total = truth + exact.beyond_grid[c]
        assert curve.l2_error[c] == pytest.approx(math.sqrt(above / below), rel=1e-9)
        assert curve.cumulative_error[c] == pytest.approx(largest / total, rel=1e-9, abs=1e-15)
        assert curve.total_error[c] == pytest.approx(
            (f + ours.beyond_grid[c]) / total - 1, rel=1e-9, abs=1e-12
        )


@pytest.mark.parametrize("method", METHODS)
def test_bins_hold_the_energy_between_their_edges(skin1, method):
    curve = skin1.curves[METHODS.index(method)]
    for c, edges_mm in enumerate(skin1.edges_mm):
        for k, (inner, outer) in enumerate(itertools.pairwise(edges_mm)):
            middles = 0.5 * (curve.profile.r_edges_mm[1:] + curve.profile.r_edges_mm[:-1])
            inside = (middles > inner) & (middles < outer)
            energy = curve.profile.annulus_energy[inside, c].sum()
            truth = skin1.exact.profile.annulus_energy[inside, c].sum()
            assert curve.energy[c][k] == pytest.approx(energy, rel=1e-6)
            assert curve.relative_error[c][k] == pytest.approx(energy / truth - 1, abs=1e-6)


def test_the_exact_solution_has_no_error_and_an_estimate(skin1):
    for errors in skin1.exact.relative_error:
        np.testing.assert_array_equal(errors, 0)
    for stderr, energy in zip(skin1.exact.energy_stderr, skin1.exact.energy, strict=True):
        assert (stderr > 0).all()
        assert (stderr < 0.02 * energy).all()


def test_the_walk_lies_within_its_error_of_the_exact_solution(skin1):
    for error, stderr in zip(
        skin1.walk.relative_error, skin1.walk.relative_error_stderr, strict=True
    ):
        assert np.abs(error / stderr).max() < 4.5
        assert (stderr < 0.2).all()


def test_models_have_no_standard_errors(skin1):
    for curve in skin1.curves[2:]:
        assert all(np.isnan(each).all() for each in curve.energy_stderr)


def test_normalised_diffusion_is_given_the_exact_total(skin1):
    np.testing.assert_allclose(skin1.curves[4].total_error, 0.0, atol=1e-12)


def test_a_walk_that_is_there_is_not_walked_again():
    material = load_material("skin1")
    walk = simulate_montecarlo(material, photons=50_000, seed=5, dr_mm=0.1, radius_mm=10.0)
    found = compare_models(material, walk=walk)
    assert found.walk.profile is walk
    assert found.exact.profile.n_annuli == 100


@pytest.mark.parametrize(("thickness_mm", "methods"), [(3.0, ["multipole"]), (0.5, [])])
def test_a_slab_is_compared_with_its_multipole_if_it_has_one(thickness_mm, methods):
    slab = Material("slab", ("c",), (Layer(1.3, np.zeros(1), [0.1], [1.0], thickness_mm),))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SssfitWarning)  # of diffusion in a slab this thin
        found = compare_models(slab, photons=20_000, dr_mm=0.2, radius_mm=8.0)
    assert [each.method for each in found.curves] == ["exact", "montecarlo", *methods]
    assert "dipole, dipole-grosjean, burley, which are of such" in found.left_out[0]
    assert len(found.left_out) == 2 - len(methods)
    assert_legible(lambda: models_figure(found))


def test_what_cannot_be_compared_is_refused():
    material = load_material("skin1")
    exact = simulate_exact(material, dr_mm=1.0, radius_mm=3.0)
    with pytest.raises(SimulationError, match="photon walk's grid"):
        compare_models(material, walk=exact)


def test_axes_carry_units(figure):
    above, below = figure.axes[:3], figure.axes[3:]
    assert above[0].get_ylabel() == r"$2\pi r\,R_d$ (1/mm)"
    assert below[0].get_ylabel() == "relative error of $R_d$ (%)"
    assert [each.get_xlabel() for each in below] == ["r (mm)"] * 3
    assert above[0].get_title(loc="left") == "R · albedo 0.9585 · MFP 1.30 mm"


def test_what_is_drawn_is_what_was_compared(skin1, figure):
    for c in range(3):
        edges_mm = skin1.edges_mm[c]
        for axes, values, scale in (
            (figure.axes[c], [each.energy[c] / np.diff(edges_mm) for each in skin1.curves], 1),
            (figure.axes[3 + c], [each.relative_error[c] for each in skin1.curves], 100),
        ):
            lines = [each for each in axes.lines if len(each.get_xdata()) == len(edges_mm) - 1]
            drawn = [values[k] for k in (2, 3, 4, 0)]
            for line, value in zip(lines, drawn, strict=True):
                np.testing.assert_allclose(line.get_ydata(), scale * value, rtol=1e-12)
                np.testing.assert_allclose(line.get_xdata(), (edges_mm[1:] + edges_mm[:-1]) / 2)
            (curve,) = [each for each in axes.patches if is_step(each, filled=False)]
            np.testing.assert_allclose(curve.get_data().values, scale * values[1], rtol=1e-12)


def is_step(patch, *, filled):
    return isinstance(patch, StepPatch) and patch.get_fill() == filled


def test_the_band_is_one_standard_error_of_the_walk(skin1, figure):
    for c in range(3):
        (band,) = [each for each in figure.axes[3 + c].patches if is_step(each, filled=True)]
        walk = skin1.walk
        high = 100 * (walk.relative_error[c] + walk.relative_error_stderr[c])
        low = 100 * (walk.relative_error[c] - walk.relative_error_stderr[c])
        np.testing.assert_allclose(band.get_data().values, high)
        np.testing.assert_allclose(band.get_data().baseline, low)


def test_methods_differ_in_colour_and_dashes(figure):
    lines = [each for each in figure.axes[0].lines if len(each.get_xdata()) > 2]
    assert len({to_hex(each.get_color()) for each in lines}) == 4
    assert len({str(each._dash_pattern) for each in lines}) == 4


def test_models_without_a_look_of_their_own_are_drawn_and_told_apart(skin1, figure, monkeypatch):
    monkeypatch.delitem(looks.MODELS, "burley")
    monkeypatch.delitem(looks.MODELS, "dipole")
    drawn = models_figure(skin1)
    ours, spares = (
        {to_hex(line.get_color()) for line in each.axes[0].lines} for each in (figure, drawn)
    )
    assert len(spares) == len(ours)
    assert len(spares - ours) == 2


def test_the_legend_gives_totals_and_errors(skin1, figure):
    texts = words_of(figure)
    total = skin1.exact.profile.diffuse_reflectance
    dipole = skin1.curves[2]
    error = f"{100 * dipole.total_error[1]:+.1f}"
    for words in (
        "skin1: models against the exact solution",
        "10⁵ photons, seed 1",
        "1236 annuli of 0.03356 mm",
        f"{total[0]:.4f}",
        f"{dipole.profile.diffuse_reflectance[1]:.4f} ({error} %)",
        "(given)",
        "Band: ±1 standard error",
    ):
        assert words in texts


def odd_comparisons():
    wavelengths = tuple(f"{400 + 5 * k} nm" for k in range(12))
    return {
        "few photons": lambda: compare_models(load_material("ketchup"), photons=1000),
        "2 photons": lambda: compare_models(load_material("ketchup"), photons=2),
        "12 channels": lambda: compare_models(
            medium(np.geomspace(0.005, 0.5, 12), np.full(12, 0.9), channels=wavelengths),
            photons=20_000,
        ),
        "1 channel, long names": lambda: compare_models(
            medium([0.1], [0.9], eta=1.0, name="m" * 100, channels=("W" * 60,)), photons=5000
        ),
        "long names": lambda: compare_models(
            medium([0.1] * 3, [0.9, 0.8, 0.7], channels=tuple(k * 60 for k in "Wm@")), photons=5000
        ),
        "nothing scatters": lambda: compare_models(medium([0.1, 1.0], [0.9, 0.0]), photons=20_000),
        "nothing absorbs": lambda: compare_models(medium([0.0], [1.0]), photons=2000),
        "g": lambda: compare_models(medium([0.1], [5.0], g=0.8), photons=20_000),
        "1 annulus": lambda: compare_models(
            load_material("skin1"), photons=20_000, dr_mm=5.0, radius_mm=5.0
        ),
    }


@pytest.mark.parametrize(
    "name",
    mostly_slow(
        odd_comparisons(),
        "2 photons",
        "12 channels",
        "1 channel, long names",
        "nothing scatters",
        "g",
    ),
)
def test_no_text_is_cut_off_or_runs_into_another(name):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SssfitWarning)  # few photons, unfinished walks, similarity
        comparison = odd_comparisons()[name]()
    assert_legible(lambda: models_figure(comparison))


def test_a_channel_that_returns_no_light_says_so():
    dark = compare_models(medium([1.0], [0.0]), photons=1000, dr_mm=5.0, radius_mm=5.0)
    assert models_figure(dark).axes[0].get_title("left") == "c0 · returns no light"


def test_skin1_is_legible(figure):
    assert_legible(lambda: figure)


def test_same_comparison_gives_same_bytes(skin1, figure):
    written = []
    for each in (figure, models_figure(skin1)):
        stream = io.BytesIO()
        save_figure(each, stream, format="svg")
        written.append(stream.getvalue())
    assert written[0] == written[1]


@pytest.fixture
def run(tmp_path, monkeypatch, capfd):
    """Run ``sssfit chart --models`` here; give exit status, stdout and stderr."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments):
        with pytest.raises(SystemExit) as caught:
            main(["chart", *arguments])
        out, err = capfd.readouterr()
        return caught.value.code or 0, out, err

    return call


def test_the_verb_draws_a_material_and_tabulates_errors(run, tmp_path, skin1):
    status, out, _ = run("--models", "skin1", "--photons", "1e5")
    assert status == 0
    assert (tmp_path / "skin1.models.png").read_bytes().startswith(b"\x89PNG")
    assert "Wrote skin1.models.png" in out
    dipole = skin1.curves[2]
    (line,) = [each for each in out.splitlines() if each.startswith("dipole G")]
    errors = (dipole.total_error[1], dipole.cumulative_error[1], dipole.l2_error[1])
    assert line.split()[2:] == [
        f"{dipole.profile.diffuse_reflectance[1]:.6f}",
        *(word for error in errors for word in (f"{100 * error:.3f}", "%")),
    ]


def test_the_verb_takes_a_profile_of_a_walk_and_its_grid(run, tmp_path):
    material = load_material("skin1")
    walk = simulate_montecarlo(material, photons=50_000, seed=5, dr_mm=0.1, radius_mm=10.0)
    walk.save(tmp_path / "mine.profile.npz")
    status, out, err = run("--models", "mine.profile.npz", "-o", "a.svg", "--json")
    assert (status, err) == (0, "")
    figures = json.loads(out)
    assert figures["output"] == ["a.svg"]
    assert (figures["annuli"], figures["photons"], figures["seed"]) == (100, 50_000, 5)
    assert [row["method"] for row in figures["rows"]] == METHODS
    assert figures["rows"][0]["l2_error"] == [0.0, 0.0, 0.0]
    assert (tmp_path / "a.svg").exists()


@pytest.mark.parametrize(
    ("arguments", "status", "fragment"),
    [
        (("--models",), 2, "--models needs a material"),
        (("skin1.profile.npz", "--photons", "5"), 2, "--photons is for the walk of --models"),
        (("--models", "skni1"), 1, "did you mean skin1"),
        (("--models", "skin1", "-o", "a.jpg"), 1, ".png, .svg or .pdf"),
        (("--models", "skin1", "-o", "no/a.png"), 1, "there is no folder"),
        (("--models", "there.profile.npz"), 1, "there.profile.npz"),
        (("--models", "exact.profile.npz"), 1, "is not a photon walk of a known material"),
        (("--models", "walk.profile.npz", "--photons", "5"), 2, "is for a new walk"),
        (("--models", "film.toml"), 1, "thin slab of g = 0.97"),
    ],
)
def test_bad_input_is_one_clear_line(run, tmp_path, skin1, arguments, status, fragment):
    skin1.exact.profile.save(tmp_path / "exact.profile.npz")
    skin1.walk.profile.save(tmp_path / "walk.profile.npz")
    (tmp_path / "film.toml").write_text(
        'channels = ["a"]\neta = 1.4\ng = 0.97\nsigma_a_per_mm = [0.1]\nsigma_s_per_mm = [30]\n'
        "thickness_mm = 0.01\n"
    )
    code, out, err = run(*arguments)
    assert code == status
    assert out == ""
    assert fragment in err.splitlines()[-1]
    assert "Traceback" not in err
    if status == 1:
        assert err.count("\n") == 1
    assert not list(tmp_path.glob("*.png"))


def test_a_walk_edited_to_have_no_photons_is_no_walk(run, tmp_path, skin1):
    walk = skin1.walk.profile
    dataclasses.replace(walk, meta={**walk.meta, "photons": None}).save(tmp_path / "w.profile.npz")
    status, _, err = run("--models", "w.profile.npz")
    assert (status, err.count("\n")) == (1, 1)
    assert "is not a photon walk of a known material" in err


def test_charts_do_without_a_version_or_method(skin1):
    walk = skin1.walk.profile
    meta = {key: walk.meta[key] for key in ("format", "channels", "photons")}
    bare = dataclasses.replace(walk, meta=meta)
    assert kernel_subtitle(bare, 5, 0.1) == "5 x 5 pixels of 0.1 mm"


def test_the_profile_chart_of_a_computed_profile_names_its_errors(skin1):
    for curve, words in (
        (skin1.exact, ("Exact solution ·", "± estimated error")),
        (skin1.curves[4], ("Normalised diffusion ·",)),
    ):
        texts = words_of(profile_figure(curve.profile))
        assert all(each in texts for each in words)
