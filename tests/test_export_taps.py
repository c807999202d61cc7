"""Tables of taps as shader source and documents: every constant is read back."""

import dataclasses
import io
import itertools
import json
import re
from dataclasses import replace
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from test_disk import disk_of
from test_export import comment_of, numbers_of, said
from test_taps import taps_of

import sssfit
from sssfit.errors import KernelError
from sssfit.export import DIALECTS, Style, is_ours, kernel_text, source, taps_document
from sssfit.export.certificate import SERVES
from sssfit.export.passes import pass_list
from sssfit.kernel import Stage, Taps
from sssfit.messages import by_channel
from sssfit.methods import FITS
from sssfit.render.taps import render_taps
from sssfit.scene.record import Scene

SCHEMA = json.loads((Path(sssfit.__file__).parent / "taps.schema.json").read_text("utf-8"))
STRUCTURES = ["1", "1-2|3", "*|1-2|*", "2-1"]


def taps_hlsl(taps, **style):
    """The constants alone, with the table's own energy."""
    plain = {"with_passes": False, "normalized": False, **style}
    return source([taps], DIALECTS["hlsl"], Style(**plain))


def read_back(text, channels, chained):
    """Build the table again from the constants of shader source alone."""
    first = [int(each) for each in numbers_of(text, "SSS_FIRST")]
    offsets = offsets_of(text)
    weights = np.array(numbers_of(text, "SSS_WEIGHT")).reshape(-1, channels)
    blend = np.array(numbers_of(text, "SSS_BLEND")).reshape(-1, channels)
    levels, kinds = (numbers_of(text, f"SSS_{name}") for name in ("LEVEL", "KIND"))
    stages = []
    for k, (begin, end) in enumerate(itertools.pairwise(first)):
        assert offsets[begin] == 0.0
        own = weights[begin:end]
        copies = (2.0, 4.0, 1.0)[int(kinds[k])]
        own = own / (own[0] + copies * own[1:].sum(axis=0))  # they are rounded to single precision
        kind = ("pair", "star", "disk")[int(kinds[k])]
        stages.append(Stage(int(levels[k]), kind, offsets[begin + 1 : end], own))
    return taps_of(
        mm_per_pixel=numbers_of(text, "SSS_MM_PER_PIXEL")[0],
        chained=chained,
        channels=channels,
        stages=tuple(stages),
        blend=blend,
    )


def offsets_of(text):
    """The distances of the taps [mm]; a disk's lie at places, right and down."""
    if "SSS_OFFSET_MM" in text:
        return np.array(numbers_of(text, "SSS_OFFSET_MM"))
    return np.hypot(*np.array(numbers_of(text, "SSS_PLACE_MM")).reshape(-1, 2).T)


@pytest.mark.parametrize("structure", STRUCTURES)
@pytest.mark.parametrize("channels", [1, 2, 3, 4, 6])
def test_the_constants_make_the_same_picture(structure, channels):
    taps = taps_of(structure, channels=channels, seed=3)
    again = read_back(taps_hlsl(taps), channels, chained=True)
    assert again.structure == taps.structure
    light = Scene("light", np.random.default_rng(1).random((23, 18, 1)), 0.3)
    np.testing.assert_allclose(render_taps(light, again), render_taps(light, taps), rtol=2e-6)


def test_terms_that_read_the_irradiance_are_told_apart():
    taps = taps_of("2-1", chained=False)
    text = taps_hlsl(taps)
    assert "all stages read the irradiance" in comment_of(text)
    light = Scene("light", np.random.default_rng(1).random((23, 18, 1)), 0.3)
    again = read_back(text, 2, chained=False)
    np.testing.assert_allclose(render_taps(light, again), render_taps(light, taps), rtol=2e-6)


def test_a_disk_is_told_apart():
    taps = disk_of(9)
    text = taps_hlsl(taps)
    assert "Kind 2 is one pass of single bilinear fetches" in comment_of(text)
    assert "Kind 0" not in comment_of(text)
    light = Scene("light", np.random.default_rng(1).random((23, 18, 1)), 0.3)
    again = read_back(text, 2, chained=False)
    np.testing.assert_allclose(render_taps(light, again), render_taps(light, taps), rtol=2e-6)


def test_arrays_have_the_lengths_they_declare():
    text = taps_hlsl(taps_of("*|1-2|*", channels=3))
    declared = re.findall(r"SSS_(\w+)\[(\d+)\] = \{(.*?)\};", text, re.DOTALL)
    assert {name for name, *_ in declared} == {
        *("LEVEL", "KIND", "FIRST", "OFFSET_MM", "WEIGHT", "BLEND"),
    }
    for _, length, body in declared:
        rows = body.count("float3(") or len(body.split(","))
        assert rows == int(length)
    assert numbers_of(text, "SSS_STAGES") == [4]


def test_the_comment_has_origin_cost_energy_and_errors():
    meta = {
        "material": "wax",
        "profile_method": "exact",
        "profile_sha256": "0123456789abcdef0123",
        "version": "0.1.0",
        "settings": {"fetches": 9, "passes": None, "full_resolution": False, "fit_seed": 7},
    }
    taps = dataclasses.replace(
        taps_of("1-2|3"), meta=meta, errors={"spectral": [0.0125, np.nan], "energy": [0.0, 0.0]}
    )
    comment = comment_of(taps_hlsl(taps))
    for part in (
        "Subsurface scattering taps: wax, test (fetches 9, fit_seed 7). sssfit 0.1.0.",
        "Profile: exact, sha256 0123456789abcdef.",
        f"1-2|3: {taps.fetches:.6g} fetches a pixel in 6 passes, 8 with those",
        "each stage reads the one before",
        "Made for pixels of 0.3 mm; channels c0, c1; linear light.",
        "spectral error: 0.0125, unknown.",
        "Kind 0 is a pass along x",
        "Halve by one bilinear fetch",
    ):
        assert part in comment
    np.testing.assert_allclose(said(comment, "Energy"), taps.energy, rtol=1e-5)
    assert "Kind 1" not in comment
    assert "passes None" not in comment
    flat = comment_of(taps_hlsl(taps_of("*")))
    assert "Kind 1 is one pass of nine fetches" in flat
    assert "Kind 0" not in flat
    assert "Halve" not in flat


def test_a_name_with_a_newline_stays_in_its_comment():
    text = taps_hlsl(taps_of(meta={"material": '"; }\n#include <x>', "settings": {}}))
    lines = text.splitlines()
    assert all(line.startswith(("// ", "static const", "    ", "};")) for line in lines)
    assert "#include" not in text  # Babylon.js looks for it in comments too


def test_a_document_is_the_file_with_a_comment():
    taps = taps_of("1-2|*", channels=3)
    text = taps_document(taps)
    whole = json.loads(text)
    jsonschema.validate(whole, SCHEMA)
    comment = whole.pop("comment")
    assert whole == taps.to_dict()
    assert comment[0].startswith("Subsurface scattering taps: wax, test")
    assert taps_document(Taps.read(io.BytesIO(text.encode()))) == text


def test_forms_and_figures_are_those_of_the_kernel(tmp_path):
    taps = taps_of("1|1")
    text, figures = kernel_text(taps, "hlsl")
    assert text == taps_hlsl(taps, with_passes=True, normalized=True)
    assert figures == {
        "channels": ("c0", "c1"),
        "structure": "1|1",
        "fetches": taps.fetches,
        "passes": 4,
        "mm_per_pixel": 0.3,
    }
    path = tmp_path / "x.hlsl"
    path.write_text(text, "utf-8")
    assert is_ours(path, "hlsl")
    assert not is_ours(path, "glsl")
    assert kernel_text(taps, "json")[0] == taps_document(taps)


def named(material, mm_per_pixel=0.3, **changes):
    return taps_of(meta={"material": material}, mm_per_pixel=mm_per_pixel, **changes)


@pytest.mark.parametrize("form", ["hlsl", "glsl", "wgsl", "c"])
def test_profiles_of_one_source_have_names(form):
    text, _ = kernel_text([named("skin 1"), named("Größe λ"), named(None), named("wax")], form)
    numbers = dict(re.findall(r"SSS_PROFILE_(\w+)\b[^=]*= (\d)u;", text))
    assert numbers == {"SKIN_1": "0", "GR_SSE": "1", "WAX": "3"}


def test_profiles_of_one_material_are_told_apart_by_their_pixels():
    text, _ = kernel_text([named("skin1", 0.15), named("skin1"), named("wax")], "hlsl")
    assert re.findall(r"SSS_PROFILE_(\w+) = ", text) == ["SKIN1_0_15MM", "SKIN1_0_3MM", "WAX"]
    assert "SSS_PROFILE" not in kernel_text(named("skin1"), "hlsl")[0]


def test_profile_names_that_clash_are_refused_in_one_line():
    for tables in (
        [named("skin1"), named("skin1")],
        [named("skin 1"), named("wax"), named("skin-1")],
    ):
        with pytest.raises(KernelError) as caught:
            kernel_text(tables, "hlsl")
        assert "SKIN" in str(caught.value)
        assert "\n" not in str(caught.value)


def test_tables_that_cannot_share_a_source_are_named():
    with pytest.raises(KernelError, match=r"A_B_0_3MM: a-b and a\.b for pixels of 0\.3 mm; leave"):
        kernel_text([named("a-b"), named("a.b")], "hlsl")
    with pytest.raises(KernelError, match=r"called WAX_0_3MM: two tables of wax for pixels"):
        kernel_text([named("wax"), named("wax")], "hlsl")
    other = replace(named("clay"), channels=("c1", "c0"))
    with pytest.raises(KernelError, match="their channels, and c1, c0 of clay are not c0, c1 of w"):
        kernel_text([named("wax"), other], "hlsl")
    with pytest.raises(KernelError, match=r"those of 2 are not those of 1; fit them with the same"):
        kernel_text([taps_of("1"), taps_of("2")], "hlsl")


def test_tables_that_are_to_be_mixed_have_the_same_stages():
    text, _ = kernel_text(taps_of("1|1"), "hlsl")
    assert "mix the numbers of two tables with these stages, an octave apart" in text
    page = (Path(__file__).parents[1] / "docs" / "cascades.md").read_text("utf-8")
    found = re.search(
        r"`sssfit fit --stages '(\S+)'\s+--pitches \.1,\S+` makes one\s+table for each octave of "
        r"pixel sizes, `skin1\.exact\.cascade(\S+)\.0\.1mm\.taps\.json`",
        page,
    )
    stages, count = found.groups()
    assert count == FITS["cascade"].count_of({"stages": stages})


def test_the_comment_says_on_which_pixels_a_table_serves():
    words = {
        "1-1|1": "Serves pixels of 0.234 to 0.402 mm, judging by skin1, whose table for 0.3 mm",
        "1-1": "Serves pixels of 0.3 mm and more; nearer by",
    }
    for structure, said_of in words.items():
        assert said_of in kernel_text(taps_of(structure), "hlsl")[0]
    for terms in (taps_of("1-1", chained=False), disk_of(9)):
        assert words["1-1"] in kernel_text(terms, "hlsl")[0]


def test_that_range_is_the_one_that_was_measured():
    page = (Path(__file__).parents[1] / "docs" / "cascades.md").read_text("utf-8")
    words = r"single table serves pixels of ([\d.]+) to ([\d.]+) times its own"
    assert tuple(map(float, re.search(words, page).groups())) == SERVES


def columns_of(text):
    """The columns of the table of passes, split where there are two spaces or more."""
    lines = text.splitlines()
    begin = next(k for k, line in enumerate(lines) if line.startswith("// call "))
    prefix = "// SKIN_OF_A_HEAD_"
    rows = itertools.takewhile(lambda line: line.startswith(prefix), lines[begin + 1 :])
    return [re.split(" {2,}", row.removeprefix(prefix)) for row in rows]


@pytest.mark.parametrize(
    ("taps", "more"),
    [
        (taps_of("1-1-1-1-1|2-2", channels=3), {}),
        (taps_of("1-1|2-2", channels=3), {"depth": True}),
        (taps_of("2-2-2", channels=3, chained=False), {}),
        (taps_of("1-1|2-2", channels=3), {"compute": True}),
    ],
)
def test_columns_of_the_table_of_passes_stay_apart(taps, more):
    """Scripts of docs/integrate.md read them."""
    if not taps.chained:
        stages = [replace(each, offsets_mm=taps.stages[0].offsets_mm) for each in taps.stages]
        taps = replace(taps, stages=tuple(stages))
    text, _ = kernel_text(taps, "hlsl", prefix="SKIN_OF_A_HEAD", **more)
    found = columns_of(text)
    if more.get("compute"):
        assert found[0][1:4] == ["E", "P0 H1", "1"]
        assert found[-1] == ["Add", "M1 P0", "M0", "1"]
        return
    wanted = [
        [
            each.call,
            " ".join(each.pictures),
            " ".join(each.writes) + ("+" if each.is_added else ""),
            f"1/{2**each.level}" if each.level else "1",
            str(each.fetches),
        ]
        for each in pass_list(taps, normalized=True, depth="depth" in more)
    ]
    assert found == wanted


def test_one_pass_is_one_pass():
    assert "24 fetches a pixel in 1 pass; all stages" in kernel_text(disk_of(24), "hlsl")[0]


@pytest.mark.parametrize("asked", ["with_shader", "dense"])
def test_what_is_for_dense_kernels_is_refused_of_a_table(asked):
    with pytest.raises(KernelError, match="are for dense kernels, and a table of taps has its"):
        kernel_text(taps_of("1|1"), "glsl", **{asked: True})


@pytest.mark.parametrize("form", ["hlsl", "c"])
def test_what_half_floats_cannot_hold_is_refused(form):
    taps = taps_of("1", channels=3, mm_per_pixel=1e5)
    stage = replace(taps.stages[0], offsets_mm=1e6 * taps.stages[0].offsets_mm)
    taps = replace(taps, stages=(stage,))
    with pytest.raises(KernelError, match=r"does not fit in a half float, of which 65504 is the"):
        kernel_text(taps, form, half=True)
    assert "inf" not in kernel_text(taps, form)[0].split("static")[1]


def energy_of(text, taps):
    """The energy (C,) of exported constants: the blend times what the fetches add up to."""
    channels = len(taps.channels)
    albedo = np.array(numbers_of(text, "SSS_ALBEDO")) if "SSS_ALBEDO" in text else 1.0
    first = [int(each) for each in numbers_of(text, "SSS_FIRST")]
    weights = np.array(numbers_of(text, "SSS_WEIGHT")).reshape(-1, channels)
    total, passed = np.zeros(channels), np.ones(channels)
    blend = np.vstack((np.zeros(channels), np.ones(channels)))
    if "SSS_BLEND" in text:
        blend = np.array(numbers_of(text, "SSS_BLEND")).reshape(-1, channels)
    total += blend[0]
    for stage, begin, end, share in zip(taps.stages, first, first[1:], blend[1:], strict=False):
        copies = {"pair": 2.0, "star": 4.0, "disk": 1.0}[stage.kind]
        whole = weights[begin] + copies * weights[begin + 1 : end].sum(axis=0)
        whole = whole**2 if stage.kind == "pair" else whole
        passed = passed * whole if taps.chained else whole
        total += share * passed
    return albedo * total


def change_of(before, after, taps):
    """The line that says by how much half floats change the energy."""
    change = by_channel(taps.channels, (after / before - 1.0).tolist(), "+.2g%")
    return f"Half floats change the energy of unknown material: {change}."


@pytest.mark.parametrize("keep_energy", [False, True])
@pytest.mark.parametrize("form", ["c", "hlsl"])
@pytest.mark.parametrize(
    "taps",
    [
        taps_of("1-2|*|2", channels=3, meta={}),
        taps_of("2-1", channels=3, chained=False, meta={}),
        replace(disk_of(9), meta={}),
        replace(taps_of("2", channels=3, meta={}), blend=[[0.0] * 3, [0.4321, 0.2099, 0.1137]]),
    ],
)
def test_what_half_floats_cost_is_the_energy_of_what_is_written(taps, form, keep_energy, caplog):
    caplog.set_level("INFO", "sssfit")
    text, _ = kernel_text(taps, form, half=True, keep_energy=keep_energy)
    text = re.sub(r"(?<=\d)f\b", "", text)
    assert caplog.messages == [change_of(taps.energy, energy_of(text, taps), taps)]


def test_passes_within_a_mask_divide_by_their_rounded_weights(caplog):
    caplog.set_level("INFO", "sssfit")
    taps = taps_of("1-2|2", channels=3, meta={})
    text, _ = kernel_text(taps, "hlsl", half=True, coverage=True)
    blend = np.array(numbers_of(text, "SSS_BLEND")).reshape(-1, 3)
    energy = np.array(numbers_of(text, "SSS_ALBEDO")) * blend.sum(axis=0)
    assert caplog.messages == [change_of(taps.energy, energy, taps)]
