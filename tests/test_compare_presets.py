"""What engines show of a material, and what is said where a preset cannot carry it."""

import dataclasses
import warnings

import numpy as np
import pytest
from figures import assert_legible

from sssfit.chart import figure_of
from sssfit.compare.presets import compare_presets
from sssfit.errors import ArgumentError, KernelError, RenderError, SssfitWarning
from sssfit.export.presets import engine_look, import_preset, preset_of
from sssfit.export.presets.reports import (
    imported_as,
    is_preset_file,
    kind_of,
    preset_of_any,
    presets_list,
    stored,
    text_name,
    warn_of,
    words_of,
)
from sssfit.fit import fit_burley
from sssfit.kernel import Taps
from sssfit.material import load_material, parse_material
from sssfit.measure.score import measure
from sssfit.methods import PRESETS
from sssfit.profile import Profile
from sssfit.render.reference import render_reference
from sssfit.scene.made import make_scene
from sssfit.simulate import simulate_burley, simulate_exact


@pytest.fixture(scope="module")
def skin():
    return load_material("skin1")


@pytest.fixture(scope="module")
def scenes():
    return [make_scene(each, height=48, width=48, mm_per_pixel=0.5) for each in ("edge", "disk")]


@pytest.fixture(scope="module")
def found(skin, scenes):
    return compare_presets(skin, scenes)


def rows_of(found):
    return {each.parameters.preset.name: each for each in found.rows}


def test_every_preset_is_there_and_the_best_is_first(found):
    assert {*rows_of(found), *found.left_out} == set(PRESETS)
    worst = [max(each.p95) for each in found.rows]
    assert worst == sorted(worst)
    assert found.pictures == ("edge", "disk")


def test_engines_that_take_the_medium_show_the_exact_profile(found):
    for name in ("openpbr", "pbrt", "mitsuba", "gltf"):
        assert max(rows_of(found)[name].p99) < 1e-6


def test_a_presets_error_is_that_of_its_own_profile(found, skin, scenes):
    """Rendered and measured by hand."""
    truth = render_reference(scenes[0], simulate_exact(skin))
    look = engine_look(preset_of("hdrp", skin))
    assert isinstance(look, Profile)
    score = measure(render_reference(scenes[0], look), truth, mask=scenes[0].mask)
    row = rows_of(found)["hdrp"]
    assert row.mean[0] == pytest.approx(score.delta_e_2000_mean, rel=1e-9)
    assert row.p95[0] == pytest.approx(score.delta_e_2000_p95, rel=1e-9)
    assert row.p99[0] == pytest.approx(score.delta_e_2000_p99, rel=1e-9)


def test_normalised_diffusion_itself_comes_back(scenes):
    """A profile that is Burley's own loses nothing in a preset of his model."""
    profile = simulate_burley(load_material("skin1"))
    found = rows_of(compare_presets(profile, scenes[:1]))
    assert max(found["hdrp"].p95) < 0.05
    assert max(found["iryoku"].p95) > 10.0 * max(found["hdrp"].p95)


def test_what_cannot_be_carried_is_left_out_with_its_reason(scenes):
    """A profile without coefficients has no medium."""
    profile = fit_burley(simulate_exact(load_material("skin1"))).kernel
    given = {"baseColor": "0.4,0.2,0.1", "scatteringDistance": "1,0.5,0.25"}
    bare = import_preset("hdrp", given)
    found = compare_presets(bare, scenes[:1])
    assert {"openpbr", "pbrt", "mitsuba"} <= set(found.left_out)
    assert "without coefficients" in found.left_out["pbrt"]
    assert "left out" in found.text()
    with pytest.raises(KernelError, match="cannot carry"):
        preset_of("hdrp", profile)


def test_no_picture_and_no_preset_are_refused(skin):
    with pytest.raises(RenderError, match="no picture"):
        compare_presets(skin, [])


def test_the_chart_has_a_row_a_preset(found):
    figure = figure_of(found)
    (axes,) = figure.axes
    assert [each.get_text() for each in axes.get_yticklabels()] == [
        each.parameters.preset.name for each in found.rows
    ]
    line = axes.lines[0]
    np.testing.assert_allclose(line.get_xdata()[-1], found.rows[-1].p95[0])


def drawn_pictures(found, count):
    """The marked lines of a chart of this many pictures, and its axes."""
    more = [
        dataclasses.replace(each, p95=tuple(each.p95[k % 2] for k in range(count)))
        for each in found.rows
    ]
    names = tuple(f"picture {k}" for k in range(count))
    record = dataclasses.replace(found, pictures=names, rows=tuple(more))
    (axes,) = assert_legible(lambda: figure_of(record)).axes
    return axes.lines[:count], axes


@pytest.mark.parametrize("count", [1, 4, 9])
def test_pictures_have_looks_and_places_of_their_own(found, count):
    lines, _ = drawn_pictures(found, count)
    looks = {(each.get_color(), str(each.get_marker())) for each in lines}
    assert len(looks) == len({each.get_marker() for each in lines}) == count
    assert len({each.get_color() for each in lines}) == min(count, 7)
    rows = np.array([each.get_ydata() for each in lines])
    assert len({*rows[:, 0].round(6)}) == count
    assert (np.abs(rows - np.arange(len(found.rows))) < 0.5).all()


def test_errors_of_0_stand_at_a_tick_of_their_own(found):
    """Not at 0.01, which a medium's error is not."""
    lines, axes = drawn_pictures(found, 2)
    labels = dict(
        zip(axes.get_xticks(), (each.get_text() for each in axes.get_xticklabels()), strict=True)
    )
    zeros = [k for k, each in enumerate(found.rows) if max(each.p95) < 1e-2]
    assert len(zeros) >= 4
    assert {labels[lines[0].get_xdata()[k]] for k in zeros} == {"<0.01"}
    others = {label: place for place, label in labels.items() if label != "<0.01"}
    assert "1" in others
    assert all(place == pytest.approx(float(label)) for label, place in others.items())


def test_without_errors_of_0_the_axis_is_whole(found):
    rows = tuple(each for each in found.rows if min(each.p95) > 1e-2)
    figure = assert_legible(lambda: figure_of(dataclasses.replace(found, rows=rows)))
    (axes,) = figure.axes
    assert len(axes.lines) == len(found.pictures) + 1  # and the difference that is seen
    assert "<0.01" not in [each.get_text() for each in axes.get_xticklabels()]


def test_errors_that_are_all_0_are_drawn(found):
    rows = tuple(each for each in found.rows if max(each.p95) < 1e-2)
    assert_legible(lambda: figure_of(dataclasses.replace(found, rows=rows)))


def test_words_are_files_and_parameters():
    assert words_of(["skin1", "a=1", "b=x=y"], most=1) == (["skin1"], {"a": "1", "b": "x=y"})
    with pytest.raises(Exception, match="given twice"):
        words_of(["a=1", "a=2"], most=1)
    with pytest.raises(Exception, match="NAME=VALUE"):
        words_of(["x.csv"], most=0)


def test_warnings_are_errors_if_strict():
    marble = preset_of("hdrp", load_material("marble"))
    with pytest.warns(SssfitWarning, match=r"0\.7"):
        warn_of(marble)
    with pytest.raises(KernelError, match=r"0\.7"):
        warn_of(marble, strict=True)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warn_of(preset_of("hdrp", load_material("skin1")), strict=True)


def test_imported_records_are_files_of_ours(skin, tmp_path):
    path = tmp_path / "skin.toml"
    path.write_bytes(stored(skin))
    assert parse_material(path.read_text(), "skin.toml").sha256 == skin.sha256
    assert is_preset_file(path)
    assert kind_of(skin) == (".toml", is_preset_file)
    assert kind_of(simulate_burley(skin))[0] == ".profile.npz"
    (tmp_path / "mine.toml").write_text("name = 'mine'\n")
    assert not is_preset_file(tmp_path / "mine.toml")
    assert not is_preset_file(tmp_path / "missing.toml")


def test_a_checkpoint_is_no_source():
    with pytest.raises(KernelError, match="unfinished walk"):
        preset_of_any("hdrp", object(), {})


def test_the_list_has_every_preset_once():
    assert [each["preset"] for each in presets_list()] == list(PRESETS)


@pytest.mark.parametrize("name", ["hdrp", "blender"])
def test_an_imported_profile_keeps_the_index(name):
    """Without it the colour above a specular layer changes by 3 %."""
    first = preset_of(name, load_material("skin1"))
    back = preset_of(name, import_preset(name, first.values))
    for key, value in first.values.items():
        if not isinstance(value, str | bool):
            np.testing.assert_allclose(back.values[key], value, rtol=1e-6)


@pytest.mark.parametrize("name", ["iryoku", "stride"])
def test_taps_of_an_engine_lead_back_to_its_parameters(name, tmp_path):
    """An imported table of taps is a file, and holds what the radial profile does not."""
    first = preset_of(name, load_material("skin1"))
    words = {
        key: ",".join(map(repr, each)) if isinstance(each, tuple) else str(each)
        for key, each in first.values.items()
    }
    taps = imported_as(name, words, "skin1", "look.taps.json")
    path = tmp_path / "look.taps.json"
    path.write_bytes(stored(taps))
    assert kind_of(taps)[1](path)
    chosen = {each.name: words[each.name] for each in first.preset.fields if each.is_chosen}
    back = preset_of_any(name, Taps.load(path), chosen)
    for key, value in first.values.items():
        if not isinstance(value, str | bool):
            np.testing.assert_allclose(back.values[key], value, rtol=1e-6, err_msg=key)


def test_taps_of_an_engine_without_any_are_refused():
    with pytest.raises(ArgumentError, match="no taps"):
        imported_as(
            "hdrp", {"baseColor": ".4,.2,.1", "scatteringDistance": "1,.5,.2"}, "x", "x.taps.json"
        )


def test_a_medium_that_takes_no_light_is_refused():
    given = {"multiscatterColor": ".6,.4,.2", "attenuationColor": "1,.2,.1"}
    with pytest.raises(ArgumentError, match="below 1"):
        import_preset("gltf", given | {"attenuationDistance": ".001"})


def test_a_files_name_has_the_engine_once():
    skin = load_material("skin1")
    assert text_name(preset_of("gltf", skin)) == "skin1.gltf"
    assert text_name(preset_of("openpbr", skin)) == "skin1.openpbr.mtlx"
