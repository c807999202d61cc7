"""Contact sheet and editing sheet: figures against direct calls, pictures, charts, the verb."""

import functools
import io
import json
import warnings

import numpy as np
import pytest
from edited_skin import EDITS, TABLE_1, compute_editing, editing_figure
from figures import assert_legible, drawn_texts
from reference_pixels import make_profile, one_over_r_profile
from turns import mostly_slow

from sssfit.chart.page import save_figure
from sssfit.chart.sheet import sheet_figure
from sssfit.cli import main
from sssfit.compare.evaluate import evaluate
from sssfit.compare.pictures import lightness, make_panel, picture_error
from sssfit.compare.references import border_of, evaluated_scene
from sssfit.compare.sheet import compute_sheet, production_look
from sssfit.errors import RenderError, SssfitWarning
from sssfit.fit import METHODS, fit_artist, fit_falloff, support_of
from sssfit.formats.colours import srgb_encode
from sssfit.formats.pictures import load_image, save_image
from sssfit.material import load_material
from sssfit.measure.score import measure
from sssfit.render.reference import render_reference
from sssfit.render.separable import render_separable
from sssfit.scene.made import make_scene
from sssfit.simulate import simulate_deon_skin, simulate_exact

PITCH, PIXELS = 0.6, 40


@pytest.fixture(scope="module", autouse=True)
def no_patience():
    """End the search by pictures early: how near it comes is for test_pictures.py to see."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sssfit.fit.artist._MAX_EVALUATIONS", 40)
        yield


@pytest.fixture(scope="module")
def skin1():
    return simulate_exact(load_material("skin1"))


@pytest.fixture(scope="module")
def sheet(skin1):
    return compute_sheet(skin1, mm_per_pixel=PITCH, pixels=PIXELS, most_terms=2)


@pytest.fixture(scope="module")
def editing():
    return compute_editing(height=42, width=33, mm_per_pixel=2.0)


def row_of(sheet, label):
    (row,) = [each for each in sheet.rows if each.label == label]
    return row


def test_rows_are_those_of_the_papers_figure(skin1):
    # Supplement, figure S.3: Input, Gaussians 1 to 6, SVD 1 to 6, artist twice, guided twice,
    # pre-integration, true kernel.
    labels = [row.label for row in compute_sheet(skin1, mm_per_pixel=2.0, pixels=12).rows]
    assert len(labels) == 20  # and ours to the line integral
    assert labels[1:7] == [f"Gaussians, N = {n}" for n in range(1, 7)]
    assert labels[7:13] == [f"SVD, rank {n}" for n in range(1, 7)]
    assert labels[13:] == [
        *("Artist-friendly, line fit", "Artist-friendly, close fit", "Artist-friendly, production"),
        *("Guided, k = 0", "Guided, k = 2", "Pre-integrated", "True kernel"),
    ]


@pytest.mark.parametrize(
    ("label", "method", "settings"),
    [
        ("Gaussians, N = 2", "gaussians", {"terms": 2}),
        ("SVD, rank 2", "svd", {"rank": 2}),
        ("Artist-friendly, line fit", "artist", {"target": "line"}),
        ("Artist-friendly, close fit", "artist", {"target": picture_error}),
        ("Guided, k = 2", "guided", {"k": 2.0}),
        ("Pre-integrated", "preintegrated", {}),
    ],
)
def test_figures_are_those_of_direct_calls(skin1, sheet, label, method, settings):
    fit = METHODS[method].fit
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SssfitWarning)
        kernel = fit(skin1, mm_per_pixel=PITCH, support_mm=support_of(skin1), **settings).kernel
    row = row_of(sheet, label)
    for name, panel in zip(sheet.scenes, row.panels, strict=True):
        scene = make_scene(name, height=PIXELS, width=PIXELS, mm_per_pixel=PITCH)
        shown = evaluated_scene(scene, skin1)
        found = evaluate(shown, kernel, skin1, border=border_of(shown))
        assert panel.score.delta_e_2000_mean == pytest.approx(found.score.delta_e_2000_mean)
        assert panel.score.exposure == pytest.approx(found.score.exposure)
        assert row.passes == found.cost.passes


def test_the_true_kernel_is_no_different_from_itself(sheet):
    for panel in sheet.rows[-1].panels:
        assert panel.score.maximum == 0.0
        assert not panel.difference.any()


def test_the_input_is_the_irradiance_times_the_albedo(skin1, sheet):
    scene = make_scene("edge", height=PIXELS, width=PIXELS, mm_per_pixel=PITCH)
    truth = render_reference(scene, skin1)
    mask = evaluated_scene(scene, skin1).mask
    expected = measure(scene.irradiance * skin1.diffuse_reflectance, truth, mask=mask)
    panel = sheet.rows[0].panels[sheet.scenes.index("edge")]
    assert panel.score.delta_e_2000_mean == pytest.approx(expected.delta_e_2000_mean)


def test_codes_are_those_of_a_file(skin1, sheet, tmp_path):
    scene = make_scene("disk", height=PIXELS, width=PIXELS, mm_per_pixel=PITCH)
    truth = render_reference(scene, skin1, border="zero")
    save_image(
        tmp_path / "truth.png",
        truth,
        channels=skin1.channels,
        mm_per_pixel=PITCH,
        exposure=sheet.exposures[0],
    )
    image = load_image(tmp_path / "truth.png")
    codes = srgb_encode(image.pixels)
    np.testing.assert_allclose(sheet.rows[-1].panels[0].codes, codes, atol=1.0 / 65535)


def test_lightness_is_that_of_colour_science():
    import colour

    y = np.array([0.0, 1e-4, 0.005, 0.008856, 0.01, 0.18, 0.5, 1.0])
    expected = colour.colorimetry.lightness_CIE1976(y * 100.0, 100.0)
    np.testing.assert_allclose(lightness(np.repeat(y[:, None], 3, axis=1)), expected, atol=1e-3)


def test_differences_have_the_sign_of_what_is_wrong_and_end_at_the_mask():
    truth = np.full((2, 2, 1), 0.5)
    picture = truth * np.array([[1.2, 0.8], [1.2, 0.8]])[:, :, None]
    mask = np.array([[1, 1], [0, 0]], dtype=np.int32)
    difference = make_panel(picture, truth, exposure=1.0, mask=mask).difference
    assert difference[0, 0] > 0.0 > difference[0, 1]
    assert not difference[1].any()


def test_production_is_crisper_and_wider_than_the_line_fit(skin1):
    line = fit_artist(skin1, mm_per_pixel=PITCH)
    found = production_look(line.kernel)
    near = min(each["near_mm2"] for each in line.kernel.parameters.values())
    assert found["near_mm2"] == (float(f"{near:.2g}"),) * 3
    for c, each in enumerate(line.kernel.parameters.values()):
        assert found["far_mm2"][c] == float(f"{2 * each['far_mm2']:.2g}")
        assert found["weight"][c] == float(f"{each['weight']:.2g}")


def test_more_terms_of_svd_are_nearer_the_truth(skin1):
    # The paper's figure says so; on every picture of skin1 (docs/how-to-choose.md).
    sheet = compute_sheet(skin1, mm_per_pixel=PITCH, pixels=PIXELS, most_terms=3)
    errors = [
        [panel.score.delta_e_2000_mean for panel in row_of(sheet, f"SVD, rank {n}").panels]
        for n in (1, 2, 3)
    ]
    assert (np.diff(errors, axis=0) < 0.0).all()


def test_edits_are_those_of_figure_6(editing):
    settings = [each.settings for each in editing.edits]
    assert settings[0] == {
        "width": 0.014,
        "strength": (0.78, 0.70, 0.75),
        "falloff": (0.57, 0.13, 0.08),
    }
    changed = [
        {key: each[key] for key in each if each[key] != settings[0][key]} for each in settings
    ]
    assert changed == [
        {},
        {"width": 0.025},
        {"strength": (1.0, 0.71, 0.51)},
        {"falloff": (0.5, 0.13, 0.08)},
    ]


def test_edits_are_held_against_the_original(editing):
    profile = simulate_deon_skin()
    scene = make_scene("head", height=42, width=33, mm_per_pixel=2.0)
    first, wide = (
        render_separable(
            scene,
            fit_falloff(profile, mm_per_pixel=2.0, support_mm=16.0, **settings).kernel,
        )
        for settings in (TABLE_1, TABLE_1 | {"width": 0.025})
    )
    truth = render_reference(scene, profile)
    own = measure(first, truth, mask=scene.mask)
    assert editing.original_score.delta_e_2000_mean == pytest.approx(own.delta_e_2000_mean)
    expected = measure(wide, first, exposure=own.exposure, mask=scene.mask)
    assert editing.edits[1].panel.score.relative_l2 == pytest.approx(expected.relative_l2)
    assert editing.edits[0].panel.score.maximum == 0.0


@pytest.mark.parametrize("format", mostly_slow(["png", "pdf"], "png"))
def test_charts_are_legible_and_give_the_same_bytes(sheet, editing, format):
    for record, draw in ((sheet, sheet_figure), (editing, editing_figure)):
        seen = assert_legible(lambda record=record, draw=draw: draw(record))
        streams = [io.BytesIO() for _ in range(2)]
        for each, figure in zip(streams, (seen, draw(record)), strict=True):
            save_figure(figure, each, format=format)
        assert streams[0].getvalue() == streams[1].getvalue()


def test_every_picture_is_drawn_with_its_delta_e(sheet):
    figure = sheet_figure(sheet)
    images = [each for axes in figure.axes for each in axes.images]
    assert len(images) == 2 * len(sheet.scenes) * len(sheet.rows)
    np.testing.assert_array_equal(images[1].get_array(), sheet.rows[0].panels[0].difference)
    texts = [text for text, _ in drawn_texts(figure)]
    for row in sheet.rows[:-1]:
        for panel in row.panels:
            assert f"ΔE {panel.score.delta_e_2000_mean:#.3g}".rstrip(".") in texts


def test_one_channel_is_grey_and_two_are_refused():
    grey = one_over_r_profile(40, 0.1, [0.4])
    found = compute_sheet(grey, mm_per_pixel=0.4, pixels=12, scenes=("disk",), most_terms=1)
    codes = found.rows[-1].panels[0].codes
    np.testing.assert_array_equal(codes[:, :, 0], codes[:, :, 2])
    assert_legible(lambda: sheet_figure(found))
    with pytest.raises(RenderError, match="2 channels; expected 1"):
        compute_sheet(one_over_r_profile(40, 0.1, [0.4, 0.2]))


def test_a_channel_without_light_does_not_stop_the_sheet():
    dark = make_profile(np.arange(21) * 0.1, np.outer(np.full(20, 0.02), [1.0, 0.5, 0.0]))
    found = compute_sheet(dark, mm_per_pixel=0.2, pixels=12, scenes=("disk",), most_terms=1)
    assert np.isfinite(found.rows[3].panels[0].score.delta_e_2000_mean)


SHEET = ("skin1", "--what", "sheet", "--chart")


@pytest.fixture
def run(tmp_path, monkeypatch, capfd):
    """Run ``sssfit compare``; give exit status, stdout and stderr."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments):
        with pytest.raises(SystemExit) as caught:
            main(["compare", *arguments])
        out, err = capfd.readouterr()
        return caught.value.code or 0, out, err

    return call


def test_the_verb_draws_a_sheet_and_tabulates_it(run, tmp_path, monkeypatch, skin1):
    small = functools.partial(compute_sheet, pixels=12, most_terms=1)
    monkeypatch.setattr("sssfit.compare.runner.compute_sheet", small)
    status, out, _ = run(*SHEET, "a.png", "--mm-per-pixel", "3", "--json")
    assert status == 0
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    figures = json.loads(out)
    assert (figures["output"], figures["mm_per_pixel"]) == (["a.png"], 3.0)
    expected = small(skin1, mm_per_pixel=3.0)
    assert [row["label"] for row in figures["rows"]] == [row.label for row in expected.rows]
    for row, own in zip(figures["rows"], expected.rows, strict=True):
        assert row["delta_e_2000_mean"] == [x.score.delta_e_2000_mean for x in own.panels]


def test_the_script_draws_edits_and_tabulates_them(tmp_path, monkeypatch, editing):
    import make_sheets
    import sections

    page = tmp_path / "how-to-choose.md"
    page.write_text("# Page\n")
    for module in (make_sheets, sections):
        monkeypatch.setattr(module, "DOCS", tmp_path)
    monkeypatch.setattr(make_sheets, "compute_editing", lambda: editing)
    make_sheets.editing()
    assert (tmp_path / "editing.png").read_bytes().startswith(b"\x89PNG")
    rows = [line.strip("| ").split(" | ") for line in page.read_text().splitlines() if "|" in line]
    told = editing.to_dict()
    keys = ("delta_e_2000_mean", "delta_e_2000_p95", "delta_e_2000_p99")
    wanted = [[row["label"], *(f"{row[key]:.2f}" for key in keys)] for row in told["rows"][1:]]
    assert rows[2:] == wanted
    assert [row[0] for row in wanted] == [label for label in EDITS if label != "original"]
    own = ", ".join(f"{told[f'original_{key}']:.2f}" for key in keys[:2])
    assert f"mean and 95th percentile: {own}." in page.read_text()


@pytest.mark.parametrize(
    ("arguments", "status", "fragment"),
    [
        ((*SHEET, "a.jpg"), 1, ".png, .svg or .pdf"),
        ((*SHEET, "a.png", "--mm-per-pixel", "0"), 2, "not a length above 0"),
        (("nothing", *SHEET[1:], "a.png"), 1, "nothing"),
    ],
)
def test_bad_input_is_one_clear_line(run, tmp_path, arguments, status, fragment):
    code, out, err = run(*arguments)
    assert code == status
    assert out == ""
    assert fragment in err.splitlines()[-1]
    assert not list(tmp_path.iterdir())


def test_rank_by_rank_svd_is_nearer_than_gaussians(sheet):
    # Supplement B: rescaled SVD is "perceptionally better" than as many Gaussians.
    for n in (1, 2):
        ours, gaussians = (row_of(sheet, f"{name} {n}") for name in ("SVD, rank", "Gaussians, N ="))
        for mine, theirs in zip(ours.panels, gaussians.panels, strict=True):
            assert mine.score.delta_e_2000_mean < theirs.score.delta_e_2000_mean
