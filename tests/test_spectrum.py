"""Singular values of a profile's kernel: the figures, the chart, the verb."""

import io
import json
import warnings

import numpy as np
import pytest
from figures import assert_legible, words_of
from matplotlib.colors import to_hex
from reference_pixels import make_profile, one_over_r_profile

from sssfit.chart.page import save_figure
from sssfit.chart.spectrum import spectrum_figure
from sssfit.cli import main
from sssfit.compare import compute_spectrum
from sssfit.errors import SssfitWarning
from sssfit.fit import fit_svd
from sssfit.material import load_material
from sssfit.profile import full_kernel
from sssfit.simulate import simulate_exact


@pytest.fixture(scope="module")
def skin1():
    return simulate_exact(load_material("skin1"))


@pytest.fixture(scope="module")
def spectrum(skin1):
    return compute_spectrum(skin1, mm_per_pixel=0.1)


def noisy_profile(channels):
    energy = np.random.default_rng(2).exponential(size=(40, channels)) / 150.0
    return make_profile(np.arange(41) * 0.1, energy)


def test_shares_are_those_of_numpys_singular_values():
    profile = noisy_profile(2)
    found = compute_spectrum(profile, support_mm=4.0, mm_per_pixel="profile")
    for c in range(2):
        singular = np.linalg.svd(
            full_kernel(profile.quadrant_kernel(0.1, 40, channel=c)), compute_uv=False
        )[:41]
        np.testing.assert_allclose(
            found.squared_share[:, c], singular**2 / (singular**2).sum(), atol=1e-12
        )
        np.testing.assert_allclose(found.absolute_share[:, c], singular / singular.sum(), atol=1e-9)
    assert (found.values < 0.0).any()


def test_the_rank_for_an_error_is_the_least_that_reaches_it(skin1, spectrum):
    for c in range(3):
        rank = spectrum.rank_for(0.01, c)
        enough, less = (
            fit_svd(skin1, rank=each, energy="keep", mm_per_pixel=0.1) for each in (rank, rank - 1)
        )
        assert enough.relative_frobenius_error[c] <= 0.01 < less.relative_frobenius_error[c]


def test_energy_concentrates_as_pixels_grow(skin1):
    firsts = [
        compute_spectrum(skin1, mm_per_pixel=pitch).squared_share[0] for pitch in (0.1, 0.3, 1.0)
    ]
    assert (np.diff(firsts, axis=0) > 0.0).all()


def test_what_is_drawn_is_what_was_computed(spectrum):
    figure = spectrum_figure(spectrum)
    for axes, shares in zip(
        figure.axes, (spectrum.squared_share, spectrum.absolute_share), strict=True
    ):
        lines = axes.lines[::2]  # each with its hollow markers behind it
        for c, line in enumerate(lines):
            np.testing.assert_array_equal(line.get_xdata(), np.arange(1, 13))
            np.testing.assert_allclose(line.get_ydata(), 100 * shares[:12, c])
        assert len({to_hex(each.get_color()) for each in lines}) == 3
        assert len({each.get_marker() for each in lines}) == 3
    texts = words_of(figure)
    for words in (
        "skin1: energy of the kernel's singular values",
        "Exact solution",
        f"{spectrum.pixels} x {spectrum.pixels} pixels of 0.1 mm",
        f"{100 * spectrum.squared_share[0, 1]:.1f} %",
        f"{100 * spectrum.absolute_share[0, 2]:.1f} %",
    ):
        assert words in texts


def test_negative_eigenvalues_are_hollow():
    found = compute_spectrum(noisy_profile(1), support_mm=4.0, mm_per_pixel="profile")
    _, hollow = spectrum_figure(found).axes[1].lines
    drawn = np.isfinite(np.asarray(hollow.get_ydata(), dtype=float))
    np.testing.assert_array_equal(drawn, found.values[:12, 0] < 0.0)
    assert drawn.any()


def odd_spectra():
    return {
        "noise": lambda: compute_spectrum(noisy_profile(3), mm_per_pixel="profile"),
        "one channel": lambda: compute_spectrum(
            one_over_r_profile(40, 0.1, [0.4]), mm_per_pixel="profile"
        ),
        "64 channels": lambda: compute_spectrum(noisy_profile(64), mm_per_pixel="profile"),
        "one pixel": lambda: compute_spectrum(one_over_r_profile(10, 0.1, [0.4]), mm_per_pixel=9),
        "a dark channel": lambda: compute_spectrum(
            make_profile(np.arange(11) * 0.1, np.outer(np.full(10, 0.05), [1.0, 0.0])),
            mm_per_pixel="profile",
        ),
        "long names": lambda: compute_spectrum(
            make_profile(
                np.arange(11) * 0.1,
                np.full((10, 3), 0.05),
                meta=dict(noisy_profile(1).meta) | {"channels": ["W" * 60, "m" * 60, "@" * 60]},
            ),
            mm_per_pixel="profile",
        ),
    }


@pytest.mark.parametrize("name", odd_spectra())
def test_no_text_is_cut_off_or_runs_into_another(name):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SssfitWarning)
        found = odd_spectra()[name]()
    assert_legible(lambda: spectrum_figure(found))


def test_skin1_is_legible_and_gives_the_same_bytes(spectrum):
    seen, again = assert_legible(lambda: spectrum_figure(spectrum)), spectrum_figure(spectrum)
    streams = [io.BytesIO() for _ in range(2)]
    for each, figure in zip(streams, (seen, again), strict=True):
        save_figure(figure, each, format="svg")
    assert streams[0].getvalue() == streams[1].getvalue()


@pytest.fixture
def run(tmp_path, monkeypatch, capfd, skin1):
    """Run ``sssfit chart`` beside skin1's profile; give exit status, stdout and stderr."""
    monkeypatch.chdir(tmp_path)
    skin1.save(tmp_path / "skin1.profile.npz")

    def call(*arguments):
        with pytest.raises(SystemExit) as caught:
            main(["chart", *arguments])
        out, err = capfd.readouterr()
        return caught.value.code or 0, out, err

    return call


def test_the_verb_draws_the_newest_profile_and_tabulates_it(run, tmp_path, spectrum):
    status, out, _ = run("--spectrum", "--mm-per-pixel", "100um")
    assert status == 0
    assert (tmp_path / "skin1.spectrum.png").read_bytes().startswith(b"\x89PNG")
    assert "Wrote skin1.spectrum.png" in out
    (line,) = [each for each in out.splitlines() if each.startswith("G ")]
    assert line.split() == [
        "G",
        *(f"{100 * spectrum.squared_share[0, 1]:.2f} %".split()),
        *(f"{100 * spectrum.absolute_share[0, 1]:.2f} %".split()),
        str(spectrum.rank_for(0.01, 1)),
    ]


def test_the_verb_gives_json(run, spectrum):
    status, out, err = run(
        *("--spectrum", "skin1.profile.npz", "--mm-per-pixel", "0.1", "-o", "a.svg", "--json")
    )
    assert (status, err) == (0, "")
    figures = json.loads(out)
    assert figures["output"] == ["a.svg"]
    assert (figures["pixels"], figures["mm_per_pixel"]) == (spectrum.pixels, 0.1)
    np.testing.assert_allclose(figures["squared_share"], spectrum.squared_share[:12])
    np.testing.assert_allclose(figures["eigenvalues"], spectrum.values[:12])
    assert figures["rank_for_1_percent"] == [spectrum.rank_for(0.01, c) for c in range(3)]


@pytest.mark.parametrize(
    ("arguments", "status", "fragment"),
    [
        (("--spectrum", "--models", "skin1"), 2, "--models and --spectrum are two charts"),
        (("--mm-per-pixel", "0.1"), 2, "--mm-per-pixel is for the kernel of --spectrum or --guide"),
        (("--spectrum", "--mm-per-pixel", "0"), 2, "not a length above 0"),
        (("--spectrum", "there.profile.npz"), 1, "there.profile.npz"),
        (("--spectrum", "-o", "a.jpg"), 1, ".png, .svg or .pdf"),
        (("--spectrum", "--mm-per-pixel", "1e-5", "-q"), 1, "use a larger --mm-per-pixel"),
    ],
)
def test_bad_input_is_one_clear_line(run, tmp_path, arguments, status, fragment):
    code, out, err = run(*arguments)
    assert code == status
    assert out == ""
    assert fragment in err.splitlines()[-1]
    assert "Traceback" not in err
    assert not list(tmp_path.glob("*.png"))
