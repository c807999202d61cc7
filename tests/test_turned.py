"""Turned stages and single passes in one direction: the record, its file, pictures and shaders."""

import dataclasses
import io
import json
import math
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from reference_taps import rendered
from test_export import comment_of, numbers_of
from test_export_taps import taps_hlsl
from test_screen_taps import scene_of
from test_taps import PITCH, bytes_of, taps_of

import sssfit
from sssfit.errors import KernelError, RenderError
from sssfit.kernel import Stage, Taps, taps_between
from sssfit.kernel.structure import parse, text_of
from sssfit.render.full_resolution import render_full_resolution
from sssfit.render.screen_taps import render_screen_taps
from sssfit.render.taps import render_taps, response, texels_of
from sssfit.scene.record import Scene

SCHEMA = json.loads((Path(sssfit.__file__).parent / "taps.schema.json").read_text("utf-8"))


def turned(structure, kinds, **own):
    """A table whose stages are pairs ("x45") or lines ("@60") at these angles; "" leaves one."""
    taps = taps_of(structure, **own)
    stages = [
        each
        if not word
        else dataclasses.replace(
            each, kind="line" if word[0] == "@" else "pair", angle_degrees=float(word[1:])
        )
        for each, word in zip(taps.stages, kinds, strict=True)
    ]
    return dataclasses.replace(taps, stages=tuple(stages))


CASES = [
    turned("1-2|2", ["", "x45", "x45"]),
    turned("2-2-2", ["@0", "@60", "@120"]),
    turned("1-1|1-2", ["@45", "@135", "x30", ""]),
]


@pytest.mark.parametrize("taps", CASES)
def test_the_file_comes_back_bit_for_bit(taps):
    whole = json.loads(bytes_of(taps))
    jsonschema.validate(whole, SCHEMA)
    back = Taps.read(io.BytesIO(bytes_of(taps)))
    assert bytes_of(back) == bytes_of(taps)
    assert [each.angle_degrees for each in back.stages] == [
        each.angle_degrees for each in taps.stages
    ]
    said = [each.get("angle_degrees") for each in whole["stages"]]
    assert said == [each.angle_degrees or None for each in taps.stages]


def test_structures_are_written_with_their_angles():
    assert [each.structure for each in CASES] == ["1-2x|2x", "2@0-2@60-2@120", "1@45-1@135|1x30-2"]
    assert text_of(parse("1-2x|*|12x")) == "1-2x|*|12x"
    assert parse("1x")[0].angle_degrees == 45.0


@pytest.mark.parametrize("text", ["x", "0x", "1xx", "*x", "2@60", "65x"])
def test_other_words_are_no_stages(text):
    with pytest.raises(KernelError, match="expected numbers of tap pairs from 1 to 64, with an x"):
        parse(text)


def test_a_line_is_one_pass_of_its_taps():
    """Three lines of 5 taps, the irradiance and two pictures that are added up."""
    cost = CASES[1].cost
    assert (cost.fetches, cost.passes, cost.all_passes) == (3 * 5 + 3, 3, 3)
    assert cost.pictures == 3 * 2 + 3
    hidden = CASES[1].blend * [[1], [0], [0], [1]]
    assert dataclasses.replace(CASES[1], blend=hidden).cost.fetches == 3 * 5 + 1
    assert CASES[0].cost.fetches == taps_of("1-2|2").cost.fetches


@pytest.mark.parametrize("border", ["mirror", "clamp", "zero"])
@pytest.mark.parametrize("taps", CASES)
def test_pictures_are_those_of_single_fetches(taps, border):
    rng = np.random.default_rng(4)
    light = rng.random((13, 16, 1))
    cover = (rng.random((13, 16)) > 0.3).astype(float)
    for coverage in (None, cover):
        ours = render_taps(Scene("light", light, PITCH), taps, border=border, coverage=coverage)
        for c in range(2):
            slow = rendered(light[..., 0], taps, c, PITCH, border, coverage)
            np.testing.assert_allclose(ours[..., c], slow, rtol=0, atol=1e-12)


def test_pictures_between_passes_are_rounded():
    light = np.random.default_rng(5).random((13, 16, 1))
    ours = render_taps(Scene("light", light, PITCH), CASES[0], intermediate="half")
    slow = rendered(light[..., 0], CASES[0], 1, PITCH, intermediate="half")
    np.testing.assert_allclose(ours[..., 1], slow, rtol=0, atol=1e-12)


@pytest.mark.parametrize("taps", CASES)
def test_a_plane_facing_the_eye_is_the_flat_renderer(taps):
    light = np.random.default_rng(6).random((20, 24, 1))
    ours = render_screen_taps(scene_of(light), taps)
    flat = render_taps(Scene("flat", light, PITCH), taps)
    np.testing.assert_allclose(ours, flat, rtol=0, atol=1e-13)


def test_diagonal_texels_are_fetched_exactly():
    """At k sqrt 2 texels a fetch along a diagonal sees one texel, as one along an axis does."""
    stage = Stage(
        0, "line", math.sqrt(2) * np.array([1.0, 3.0]), np.array([[0.4], [0.2], [0.1]]), 45.0
    )
    texels = texels_of(stage, stage.directions[0], 1.0)
    seen = {at: float(each[0]) for at, each in texels.items() if abs(each[0]) > 1e-12}
    expected = {(0, 0): 0.4, (1, 1): 0.2, (-1, -1): 0.2, (3, 3): 0.1, (-3, -3): 0.1}
    assert seen == pytest.approx(expected, abs=1e-12)


def test_a_quarter_turn_of_a_line_turns_its_picture():
    line = taps_of("2", blend=[[0.0, 0.0], [1.0, 1.0]])
    along, across = (
        dataclasses.replace(
            line, stages=(dataclasses.replace(line.stages[0], kind="line", angle_degrees=angle),)
        )
        for angle in (30.0, 120.0)
    )
    np.testing.assert_allclose(response(across), np.rot90(response(along), -1), atol=1e-15)
    assert response(along).sum() == pytest.approx(2.0)


def test_the_variance_of_a_line_is_that_along_it():
    stage = CASES[1].stages[1]
    expected = 2.0 * stage.offsets_mm**2 @ stage.weights[1:]
    np.testing.assert_allclose(stage.variance_mm2, expected)


def test_shaders_have_the_angles():
    text = taps_hlsl(CASES[2])
    assert [float(each) for each in numbers_of(text, "SSS_ANGLE_DEGREES")] == [45, 135, 30, 0]
    assert [int(each) for each in numbers_of(text, "SSS_KIND")] == [3, 3, 0, 0]
    assert "Kind 3 is one pass like one of kind 0" in comment_of(text)
    assert "Kind 0 with an angle runs along it" in comment_of(text)
    assert "ANGLE" not in taps_hlsl(taps_of("1-2"))


EDITS = {
    "a pair turned too far": ("x45", {"angle_degrees": 90}, "expected a number from 0 to below 90"),
    "a line turned too far": ("@45", {"angle_degrees": 180}, "a number from 0 to below 180"),
    "no number": ("@45", {"angle_degrees": "45"}, "angle_degrees"),
    "a turned star": ("x45", {"kind": "star", "offsets_mm": [0.3, 0.5]}, "weights has shape"),
}


@pytest.mark.parametrize("name", EDITS)
def test_an_edited_angle_is_one_line(name):
    word, changes, expected = EDITS[name]
    whole = json.loads(bytes_of(turned("1", [word])))
    whole["stages"][0] |= changes
    with pytest.raises(KernelError) as caught:
        Taps.read(io.BytesIO(json.dumps(whole).encode()), "x.taps.json")
    assert expected in str(caught.value)
    assert "\n" not in str(caught.value)


def test_only_pairs_and_lines_are_turned_and_no_terms():
    star = taps_of("*").stages[0]
    with pytest.raises(KernelError, match=r"angle_degrees = 45\.0; expected 0 for a star"):
        taps_of("*", stages=(dataclasses.replace(star, angle_degrees=45.0),))
    pair = turned("1", ["x45"])
    with pytest.raises(KernelError, match="turned stages or halved pictures"):
        pair.separable_kernel()
    with pytest.raises(KernelError, match="are pairs of passes along the axes"):
        dataclasses.replace(pair, chained=False)


def test_tables_of_two_pixel_sizes_keep_their_angles():
    first = CASES[0]
    other = dataclasses.replace(first, mm_per_pixel=2.0 * first.mm_per_pixel)
    between = taps_between(first, other, 1.4 * first.mm_per_pixel)
    assert between.structure == first.structure


def test_turned_stages_are_not_rendered_by_cosines():
    with pytest.raises(RenderError, match="has stages in other directions than the axes"):
        render_full_resolution(Scene("light", np.ones((8, 8, 1)), PITCH), CASES[0])
