"""Charts: what is drawn is what the profile holds, nothing is cut off, same input same bytes."""

import ast
import io
import warnings
from pathlib import Path

import numpy as np
import pytest
from figures import assert_legible, drawn_texts, legends_of, words_of
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.patches import StepPatch
from turns import mostly_slow

from sssfit import chart
from sssfit.chart.data import picture
from sssfit.chart.files import FORMATS, chart_format, is_chart_file
from sssfit.chart.frequency import frequency_figure
from sssfit.chart.material import material_figure
from sssfit.chart.page import drawable, save_figure, short_number
from sssfit.chart.profile import profile_figure
from sssfit.chart.text import channel_name, channel_names, count, powered, shortened, with_error
from sssfit.errors import FileError
from sssfit.material import Layer, Material, load_material
from sssfit.profile import Profile
from sssfit.profile.bins import MIN_HITS, effective_hits, merged
from sssfit.profile.frequency import frequency_response
from sssfit.simulate import simulate_montecarlo

CHARTS = Path(chart.__file__).parent
SIGNATURES = {"png": b"\x89PNG\r\n\x1a\n", "svg": b"<?xml", "pdf": b"%PDF-"}


def hand_made(energy, r_edges_mm=None, **meta):
    """A profile without photons, errors or a material, as imports are."""
    energy = np.asarray(energy, dtype=float)
    n, channels = energy.shape
    return Profile(
        r_edges_mm=np.linspace(0.0, 20.0, n + 1) if r_edges_mm is None else r_edges_mm,
        annulus_energy=energy,
        annulus_energy_stderr=np.full((n, channels), np.nan),
        beyond_grid=np.zeros(channels),
        beyond_grid_stderr=np.full(channels, np.nan),
        specular_reflectance=0.017,
        absorbed=np.zeros((1, channels)),
        unfinished=np.zeros(channels),
        annulus_transmittance=None,
        meta={
            "format": "sssfit.profile/1",
            "channels": [f"c{k}" for k in range(channels)],
            "photons": None,
        }
        | meta,
    )


def exponential(channels, n=300):
    """F = (1 - exp(-r / L)) / 2 with lengths from 0.5 to 3 mm."""
    r = np.linspace(0.0, 20.0, n + 1)[:, None]
    return np.diff(0.5 - 0.5 * np.exp(-r / np.linspace(0.5, 3.0, channels)), axis=0)


def spectrum(names, name="spectrum"):
    """A material of as many channels as names."""
    sigma_a = np.geomspace(0.005, 0.5, len(names))
    return Material(name, tuple(names), (Layer(1.3, 0.0, sigma_a, np.full(len(names), 0.9)),))


@pytest.fixture(scope="module")
def skin1():
    return simulate_montecarlo(load_material("skin1"), photons=100_000)


@pytest.fixture(scope="module")
def skin1_figure(skin1):
    return profile_figure(skin1)


@pytest.fixture(scope="module")
def skin1_again(skin1):
    return profile_figure(skin1)


def steps(axes, *, filled):
    """The curves of a panel, or its bands."""
    return [each for each in axes.patches if isinstance(each, StepPatch) and each.fill == filled]


def test_axes_carry_units(skin1_figure):
    linear, logarithmic, unweighted, image = skin1_figure.axes
    labels = [(axes.get_xlabel(), axes.get_ylabel()) for axes in (linear, logarithmic, image)]
    weighted = r"$2\pi r\,R_d$ (1/mm)"
    assert labels == [("r (mm)", weighted), ("r (mm)", weighted), ("x (mm)", "y (mm)")]
    assert unweighted.get_xlabel() == "r (mean free paths: R 1.30, G 0.952, B 0.671 mm)"
    assert unweighted.get_ylabel() == "$R_d$ (1/mm²)"
    assert [axes.get_yscale() for axes in skin1_figure.axes] == ["linear", "log", "log", "linear"]


def test_without_a_material_the_third_plot_is_in_mm_and_says_so():
    axes = profile_figure(hand_made(exponential(3))).axes[2]
    assert axes.get_xlabel() == "r (mm; mean free paths unknown)"


def test_channels_differ_in_dashes_and_colour(skin1_figure):
    for axes in skin1_figure.axes[:3]:
        curves = steps(axes, filled=False)
        assert len({str(each.get_linestyle()) for each in curves}) == 3
        colours = [to_hex(each.get_edgecolor()) for each in curves]
        assert colours == ["#d55e00", "#009e73", "#0072b2"]


@pytest.mark.parametrize("n_channels", [5, 64])
def test_neighbours_among_many_channels_differ_in_dashes(n_channels):
    (legend,) = legends_of(profile_figure(hand_made(exponential(n_channels, n=20))))
    styles = [(str(each.get_linestyle()), to_hex(each.get_color())) for each in legend.get_lines()]
    assert len(set(styles)) == len(styles) == min(n_channels, 8)


def test_title_and_caption_say_where_the_profile_comes_from(skin1_figure):
    texts = words_of(skin1_figure)
    for words in (
        "skin1: diffuse reflectance profile",
        "Monte Carlo · 10⁵ photons, seed 1",
        "Beyond the grid (r > ",
        "Specular reflectance (0.01701) is not included.",
        "Bands: ±1 standard error.",
        "tone curve x/(1 + x)",
    ):
        assert words in texts


def test_light_beyond_the_grid_is_in_the_caption():
    profile = simulate_montecarlo(load_material("wholemilk"), photons=20_000)
    share = 100 * profile.beyond_grid / profile.diffuse_reflectance
    texts = words_of(profile_figure(profile))
    assert f"R {share[0]:.2g} %, G {share[1]:.2g} %, B {share[2]:.2g} % of diffuse" in texts
    assert share[0] > 2


def test_legend_gives_totals_with_errors(skin1, skin1_figure):
    labels = [each.get_text() for each in legends_of(skin1_figure)[0].get_texts()]
    total, stderr = skin1.diffuse_reflectance[0], skin1.diffuse_reflectance_stderr[0]
    assert labels[0] == f"R  {total:.4f} ± {stderr:.4f}"


def test_bands_reach_one_standard_error_either_way(skin1, skin1_figure):
    for channel in range(3):
        bins = merged(skin1, channel)
        for axes, values in zip(
            skin1_figure.axes[:3], (bins.per_mm(), bins.per_mm(), bins.per_mm2()), strict=True
        ):
            mean, stderr = values
            drawn = np.isfinite(mean)
            curve = steps(axes, filled=False)[channel].get_data()
            band = steps(axes, filled=True)[channel].get_data()
            np.testing.assert_array_equal(curve.values, mean)
            np.testing.assert_array_equal(band.values[drawn], (mean + stderr)[drawn])
            np.testing.assert_array_equal(band.baseline[drawn], (mean - stderr)[drawn])


@pytest.mark.parametrize("channel", range(3))
def test_merged_annuli_conserve_energy_and_hold_enough_hits(skin1, channel):
    bins = merged(skin1, channel)
    np.testing.assert_allclose(bins.energy.sum(), skin1.total_on_grid[channel], rtol=1e-13)
    assert bins.edges_mm[0] == 0
    assert bins.edges_mm[-1] == skin1.r_edges_mm[-1]
    mean_square = (skin1.photons - 1) * bins.stderr**2 + bins.energy**2
    hits = effective_hits(bins.energy, mean_square, skin1.photons)
    assert (hits[bins.is_drawn] >= MIN_HITS).all()
    assert bins.is_drawn.sum() > 10
    assert (np.diff(bins.is_drawn.astype(int)) <= 0).all()  # drawn to the end, no holes


def test_bins_do_not_get_narrower_outwards(skin1):
    widths = np.diff(merged(skin1, 0).edges_mm)
    assert (np.diff(widths)[:-1] > -1e-9).all()  # the grid may cut the last one short


def test_errors_of_merged_annuli_are_those_of_the_sum(skin1):
    bins = merged(skin1, 1)
    cumulative = np.cumsum(bins.energy)
    mean_square = np.cumsum((skin1.photons - 1) * bins.stderr**2 + bins.energy**2)
    stderr = np.sqrt((mean_square - cumulative**2) / (skin1.photons - 1))
    at = np.searchsorted(skin1.r_edges_mm, bins.edges_mm[1:])
    np.testing.assert_allclose(stderr, skin1.cumulative_stderr[at, 1], rtol=1e-9)


def test_more_photons_shrink_the_bins(skin1):
    few = simulate_montecarlo(load_material("skin1"), photons=2000)
    assert len(merged(few, 0).energy) < len(merged(skin1, 0).energy)


def test_without_photons_nothing_is_merged_and_nothing_banded():
    profile = hand_made(exponential(2))
    bins = merged(profile, 0)
    np.testing.assert_array_equal(bins.edges_mm, profile.r_edges_mm)
    assert not steps(profile_figure(profile).axes[0], filled=True)


def test_empty_annuli_are_gaps_on_log_plots():
    energy = exponential(1, n=40)
    energy[10:15] = 0.0
    axes = profile_figure(hand_made(energy)).axes[1]
    (curve,) = steps(axes, filled=False)
    assert np.isnan(curve.get_data().values[10:15]).all()
    assert axes.get_ylim()[0] > 0.1 * energy[energy > 0].min()


def test_linear_plot_holds_the_energy_it_names(skin1, skin1_figure):
    end_mm = skin1_figure.axes[0].get_xlim()[1]
    shares = skin1.cumulative_at(end_mm) / skin1.total_on_grid
    np.testing.assert_allclose(shares.min(), 0.995, atol=1e-6)
    assert skin1_figure.axes[1].get_xlim() == (0, skin1.r_edges_mm[-1])


def test_image_agrees_with_exact_pixels(skin1):
    bins = [merged(skin1, channel) for channel in range(3)]
    shown = picture(skin1, bins)
    rows = shown.per_mm2.shape[0]
    pitch_mm = 2 * shown.half_height_mm / rows
    exact = skin1.quadrant_kernel(pitch_mm, rows // 2) / pitch_mm**2
    middle = shown.per_mm2[rows // 2 :, shown.per_mm2.shape[1] // 2]
    along = slice(10, 90)  # the noise of single annuli, which the image smooths, averages out
    np.testing.assert_allclose(middle[along].sum(axis=0), exact[along, 0].sum(axis=0), rtol=0.05)
    colours = shown.screen_colours()
    assert colours.min() >= 0
    assert colours.max() <= 1


def odd_profiles():
    wavelengths = [f"{400 + 5 * k} nm" for k in range(64)]
    long_names = [letter * 60 for letter in "Wm@$漢"]
    dense = Material("dense", ("R", "G", "B"), (Layer(1.3, 0.0, [1e4] * 3, [1e6, 9e5, 8e5]),))
    thin = Material("thin", ("a", "b"), (Layer(1.3, 0.0, [1e-4, 2e-4], [1e-3, 1e-3]),))
    return {
        "skin1": lambda: simulate_montecarlo(load_material("skin1"), photons=100_000),
        "few photons": lambda: simulate_montecarlo(load_material("ketchup"), photons=1000),
        "1 channel": lambda: simulate_montecarlo(spectrum(["650 nm"]), photons=5000),
        "5 long names": lambda: simulate_montecarlo(spectrum(long_names, "m" * 100), photons=5000),
        "3 long names": lambda: simulate_montecarlo(spectrum(long_names[:3]), photons=5000),
        "64 channels": lambda: simulate_montecarlo(spectrum(wavelengths), photons=20_000),
        "dense": lambda: simulate_montecarlo(dense, photons=5000),
        "thin": lambda: simulate_montecarlo(thin, photons=5000),
        "import": lambda: hand_made(exponential(3)),
        "nothing": lambda: hand_made(np.zeros((20, 3))),
        "nothing in 1": lambda: hand_made(np.zeros((20, 1))),
        "1 annulus": lambda: hand_made(exponential(2, n=1)),
        "below zero": lambda: hand_made(exponential(2) - 1e-6),
        "uneven annuli": lambda: hand_made(exponential(3, n=50), np.geomspace(1, 21, 51) - 1),
        "unknown meta": lambda: hand_made(
            exponential(3), method="$?", material={"name": "$x"}, version="$"
        ),
    }


@pytest.mark.parametrize(
    "name",
    mostly_slow(
        odd_profiles(),
        *("few photons", "5 long names", "64 channels", "nothing", "1 annulus", "below zero"),
        "unknown meta",
    ),
)
def test_no_text_is_cut_off_or_runs_into_another(name):
    assert_legible(lambda: profile_figure(odd_profiles()[name]()))


@pytest.mark.parametrize("format", FORMATS)
def test_same_profile_gives_same_bytes_in_every_format(skin1_figure, skin1_again, tmp_path, format):
    written = []
    for k, figure in enumerate((skin1_figure, skin1_again)):
        path = tmp_path / f"{k}.{format}"
        save_figure(figure, path)
        written.append(path.read_bytes())
        assert is_chart_file(path)
    assert written[0] == written[1]
    assert written[0].startswith(SIGNATURES[format])


def test_png_has_the_size_of_a_page(skin1_figure):
    stream = io.BytesIO()
    save_figure(skin1_figure, stream, format="png")
    head = stream.getvalue()[16:24]
    assert (int.from_bytes(head[:4]), int.from_bytes(head[4:])) == (1600, 1200)


def test_matplotlibrc_of_the_user_changes_nothing(skin1, skin1_figure):
    import matplotlib as mpl

    plain, styled = io.BytesIO(), io.BytesIO()
    save_figure(skin1_figure, plain, format="svg")
    with mpl.rc_context({"font.size": 20, "axes.facecolor": "red", "savefig.dpi": 30}):
        save_figure(profile_figure(skin1), styled, format="svg")
        assert mpl.rcParams["font.size"] == 20
    assert plain.getvalue() == styled.getvalue()


@pytest.mark.parametrize("name", ["a.jpg", "a", "png", ".png", "a.png.gz"])
def test_other_endings_are_refused_in_one_line(tmp_path, name):
    with pytest.raises(FileError, match=r"\.png, \.svg or \.pdf") as caught:
        save_figure(Figure(), tmp_path / name)
    assert "\n" not in str(caught.value)
    assert not list(tmp_path.iterdir())


def test_a_stream_needs_a_format():
    with pytest.raises(FileError, match="one of png, svg, pdf"):
        chart_format(io.BytesIO())
    assert chart_format("A.PNG") == "png"


@pytest.mark.parametrize("content", [b"", b"\x89PNG", b"notes", b"<html>", b"<?xml?><note/>"])
def test_other_files_are_not_charts(tmp_path, content):
    path = tmp_path / "a.png"
    path.write_bytes(content)
    assert not is_chart_file(path)
    assert not is_chart_file(tmp_path / "missing.png")


def test_numbers_read_as_people_write_them():
    numbers = (10**7, 200_000, 1_250_000, 12_345_678, 1000, 2)
    words = ["10⁷", "2×10⁵", "1.25×10⁶", "12,345,678", "1,000", "2"]  # noqa: RUF001
    assert [count(each) for each in numbers] == words
    assert with_error(0.432012, 0.000113) == "0.43201 ± 0.00011"
    assert with_error(0.5, np.nan) == "0.5"
    assert with_error(7.44e-7, 1.65e-16) == "(7.4400000000 ± 0.0000000017)×10⁻⁷"  # noqa: RUF001
    assert with_error(0.0, 1.65e-16) == "(0.0 ± 1.6)×10⁻¹⁶"  # noqa: RUF001
    assert shortened("a" * 12) == "a" * 12
    assert shortened("near-infrared-850nm") == "near-…-850nm"
    assert shortened("near-infrared-940nm") == "near-…-940nm"


def test_names_that_are_shortened_alike_have_their_numbers():
    names = ["left cheek 850 nm day", "R", "left cheek 940 nm day"]
    assert [channel_name(names, k) for k in range(3)] == [
        "left …nm day (1)",
        "R",
        "left …nm day (3)",
    ]


def test_right_to_left_names_stand_before_their_figures():
    assert drawable("R  0.4 ± 0.1, $x") == r"R  0.4 ± 0.1, \$x"
    names = ["\u05d0\u05d3 \u05d5", "\u0623\u062e", "\u05d1"]
    for name in names:
        assert drawable(f"{name}  0.4 ± 0.1") == f"\u200e{name}\u200e  0.4 ± 0.1"
    figure = profile_figure(hand_made(exponential(3), channels=names))
    (legend,) = legends_of(figure)
    labels = [each.get_text() for each in legend.get_texts()]
    assert [each.split("  0.")[0] for each in labels] == [f"\u200e{name}\u200e" for name in names]
    assert f": \u200e{names[0]}\u200e 0 %, \u200e{names[1]}\u200e 0 %" in words_of(figure)


def test_names_without_letters_of_the_font_become_numbers_and_it_is_said_once(caplog):
    caplog.set_level("INFO", "sssfit")
    names = ["赤\u7dd1", "R赤", "青"]
    for _ in range(2):
        assert channel_names(names) == ["channel 1", "R赤", "channel 3"]
    (line,) = caplog.messages
    assert line == (
        "The font of charts has no letters of '赤緑', '青'; in their place stand the channels' "
        "numbers."
    )
    assert channel_name(names, 1) == "R赤"


def test_a_profile_without_light_says_so():
    dark = hand_made(np.zeros((20, 2)))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        figures = profile_figure(dark), frequency_figure(frequency_response(dark))
    for figure, empty in zip(figures, (3, 2), strict=True):
        labels = [each.get_text() for each in legends_of(figure)[0].get_texts()]
        assert labels == [f"c{k}  0 (returns no light)" for k in range(2)]
        told = [each for axes in figure.axes for each in axes.texts]
        assert [each.get_text() for each in told] == ["returns no light"] * empty


def test_a_profile_so_far_says_so():
    for meta, title in (({}, ""), ({"checkpoint": "sssfit.checkpoint/1"}, " so far")):
        figure = profile_figure(hand_made(exponential(1), **meta))
        assert drawn_texts(figure)[0][0] == f"Diffuse reflectance profile{title}"


@pytest.mark.parametrize("path", sorted(CHARTS.glob("*.py")), ids=lambda path: path.stem)
def test_matplotlib_finds_the_places(path):
    tree = ast.parse(path.read_text())
    called = {node.attr for node in ast.walk(tree) if isinstance(node, ast.Attribute)}
    assert not called & {"add_axes", "figtext", "subplots_adjust", "tight_layout"}


def test_title_and_notes_stand_between_the_margins_and_wrap():
    wide = spectrum([letter * 60 for letter in "Wm@"])
    texts = drawn_texts(profile_figure(simulate_montecarlo(wide, photons=2000)))
    width, margin = 1600, 20
    (title,) = [box for text, box in texts if text.startswith("spectrum: diffuse")]
    (notes,) = [box for text, box in texts if text.startswith("Beyond the grid")]
    for box in (title, notes):
        assert margin - 1 <= box.x0 < margin + 5
        assert box.x1 <= width - margin + 1
    assert notes.width > 0.9 * (width - 2 * margin)
    assert notes.height > 4 * 7.5 / 72 * 200  # the first of three notes takes two lines


# Materials


def points(axes):
    """The values of each line of points."""
    return [np.asarray(each.get_ydata()) for each in axes.lines]


def test_a_material_is_drawn_by_its_coefficients():
    layers = (
        Layer(1.4, 0.9, [0.2, 0.1], [20.0, 10.0], 0.5),
        Layer(1.33, 0.0, [0.0, 0.0], [0.0, 0.0], 1.0),  # clear
        Layer(1.4, 0.5, [0.0, 0.3], [4.0, 2.0]),
    )
    figure = material_figure(Material("stack", ("red", "blue"), layers, source="made up"))
    coefficients, path, absorption = figure.axes
    found = points(coefficients)
    np.testing.assert_allclose(found, [[2, 1], [0.2, 0.1], [2, 1], [np.nan, 0.3]])
    np.testing.assert_allclose(points(path), [[1 / 2.2, 1 / 1.1], [1 / 2, 1 / 1.3]])
    shares = [[0.2 / 20.2, 0.1 / 10.1], [np.nan, 0.3 / 2.3]]
    np.testing.assert_allclose(points(absorption), shares, rtol=1e-12)
    assert [each.get_ylabel() for each in figure.axes] == ["1/mm", "mm", "1 - albedo"]
    for axes in figure.axes:
        assert axes.get_yscale() == "log"
        assert [each.get_text() for each in axes.get_xticklabels()] == ["red", "blue"]
    labels = [each.get_text() for each in legends_of(figure)[0].get_texts()]
    assert labels == ["layer 1: 0.5 mm, eta 1.4", "layer 3: semi-infinite, eta 1.4"]
    words = words_of(figure)
    assert words.startswith(
        "stack: material 3 layers, half space below · made up · specular reflectance 0.02778 "
    )
    assert words.endswith("1 clear layer without absorption or scattering.")


def test_equal_absorption_is_a_ring_around_the_scattering():
    layer = Layer(1.3, 0.0, [1.0, 0.5], [0.0, 0.5])
    axes = material_figure(Material("equal", ("a", "b"), (layer,))).axes[0]
    scattering, absorption = axes.lines
    np.testing.assert_array_equal(points(axes), [[np.nan, 0.5], [1.0, 0.5]])
    assert absorption.get_markerfacecolor() == "none"
    assert absorption.get_markersize() > scattering.get_markersize() + 2.0


def test_equal_layers_lie_side_by_side_and_are_points_in_the_legend_too():
    same = tuple(Layer(1.4, 0.0, [0.1], [1.0], 0.1) for _ in range(7))
    figure = material_figure(Material("same", ("a",), same))
    for axes in figure.axes:
        left, right = axes.get_xlim()
        places = sorted({round(float(each.get_xdata()[0]), 6) for each in axes.lines})
        assert len(places) == 7
        assert left < places[0] < places[-1] < right
    (legend,) = legends_of(figure)
    assert [each.get_linestyle() for each in legend.get_lines()] == ["None"] * 7
    assert len({each.get_marker() for each in legend.get_lines()}) == 7
    assert "Not drawn" not in words_of(figure)


@pytest.mark.parametrize(("count", "told"), [(8, "1 layer (4)"), (12, "5 layers (2, 4, 6, 9, 11)")])
def test_layers_that_are_not_drawn_are_named(count, told):
    layers = tuple(Layer(1.4, 0.0, [0.1 + k], [1.0], 0.1) for k in range(count))
    words = words_of(material_figure(Material("many", ("a",), layers)))
    assert f"Not drawn: {told}" in words


def test_a_labelled_minor_tick_has_a_mark():
    figure = material_figure(load_material("skin1"))
    axes = figure.axes[1]  # less than a decade of mean free paths
    ticks = [each for each in axes.yaxis.get_minor_ticks() if each.label1.get_text()]
    assert ticks
    assert all(each.tick1line.get_markersize() > 0.0 for each in ticks)


def odd_materials():
    wavelengths = [f"{400 + 5 * k} nm" for k in range(64)]
    channels = ("near-infrared-850nm", "Wm@$漢" * 10)
    layers = tuple(Layer(1.3, 0.08 * k, [0.1 + k, 2.0], [1.0, 3.0], 0.1 + k) for k in range(12))
    return {
        "skin1": lambda: load_material("skin1"),
        "64 channels": lambda: spectrum(wavelengths, "m" * 100),
        "12 layers": lambda: Material("many", channels, layers, source="$x" * 90),
        "no absorption": lambda: Material("white", ("a",), (Layer(1.0, 0.0, [0.0], [1.0]),)),
        "no scattering": lambda: Material("black", ("a",), (Layer(1.0, 0.0, [1.0], [0.0]),)),
    }


@pytest.mark.parametrize(
    "name", mostly_slow(odd_materials(), "64 channels", "12 layers", "no scattering")
)
def test_charts_of_materials_are_legible_and_the_same_each_time(name):
    material = odd_materials()[name]()
    written = []
    for figure in (assert_legible(lambda: material_figure(material)), material_figure(material)):
        stream = io.BytesIO()
        save_figure(figure, stream, format="svg")
        written.append(stream.getvalue())
    assert written[0] == written[1]


def test_small_and_large_numbers_are_written_with_powers_of_ten():
    """On axes of media whose pixels have nanometres, 5e-05 is no way to write a number."""
    labels = {
        0.0005: "0.0005",
        5e-05: r"$5\cdot 10^{-5}$",
        1e6: "$10^{6}$",
        -0.5: "\N{MINUS SIGN}0.5",
    }
    assert {value: short_number(value) for value in labels} == labels
    assert powered("3.679e-06 mm to 5e+03 mm") == "3.679×10⁻⁶ mm to 5×10³ mm"  # noqa: RUF001
