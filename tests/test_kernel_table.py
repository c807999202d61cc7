"""Kernels as tables: every number comes back bit for bit."""

import csv
import dataclasses

import numpy as np
import pytest
from test_disk import disk_of
from test_export import small_kernel
from test_profile import full_profile
from test_taps import taps_of
from test_turned import turned

from sssfit.errors import KernelError
from sssfit.export.table import is_our_table, table_text
from sssfit.formats.csv import csv_text
from sssfit.render.disk import spiral


def rows_of(record):
    lines = [line for line in table_text([record]).splitlines() if not line.startswith("#")]
    return list(csv.DictReader(lines))


def numbers(rows, channels):
    return np.array([[float(row[name]) for name in channels] for row in rows])


def test_a_dense_kernel_comes_back_from_its_rows():
    kernel = small_kernel(terms=2, pixels=5)
    rows = rows_of(kernel)
    of = {
        part: [row for row in rows if row["part"] == part] for part in ("scale", "sign", "weight")
    }
    np.testing.assert_array_equal(numbers(of["scale"], kernel.channels)[0], kernel.scale)
    np.testing.assert_array_equal(numbers(of["sign"], kernel.channels), kernel.signs)
    weights = numbers(of["weight"], kernel.channels).reshape(kernel.weights.shape)
    np.testing.assert_array_equal(weights, kernel.weights)
    places = [float(row["x_mm"]) for row in of["weight"]]
    np.testing.assert_array_equal(places, [*np.arange(-2, 3) * kernel.mm_per_pixel] * 2)
    assert [row["term"] for row in of["weight"]] == ["1"] * 5 + ["2"] * 5


@pytest.mark.parametrize("structure", ["1-2|3", "*|1-2|*"])
def test_taps_come_back_from_their_rows(structure):
    taps = taps_of(structure, channels=3)
    rows = rows_of(taps)
    blend = [row for row in rows if row["part"] == "blend"]
    np.testing.assert_array_equal(numbers(blend, taps.channels), taps.blend)
    for k, stage in enumerate(taps.stages, start=1):
        own = [row for row in rows if row["part"] == "weight" and row["stage"] == str(k)]
        np.testing.assert_array_equal(numbers(own, taps.channels), stage.weights)
        offsets_mm = [float(row["offset_mm"]) for row in own]
        np.testing.assert_array_equal(offsets_mm, [0.0, *stage.offsets_mm])
        assert {(int(row["level"]), row["kind"]) for row in own} == {(stage.level, stage.kind)}


def test_the_fetches_of_a_disk_lie_where_its_rows_say():
    taps = disk_of(9)
    weights = [row for row in rows_of(taps) if row["part"] == "weight"]
    middle, *fetches = [
        (float(row["offset_mm"]), np.radians(float(row["angle_degrees"]))) for row in weights
    ]
    assert middle == (0.0, 0.0)
    found = [(away * np.sin(turn), away * np.cos(turn)) for away, turn in fetches]
    np.testing.assert_allclose(found, spiral(taps.stages[0]), atol=1e-14)
    text = table_text([taps])
    assert "# A disk is one pass of single bilinear fetches at offset_mm in the direction" in text
    assert "either side" not in text


def test_the_comment_explains_the_kinds_and_levels_that_there_are():
    flat, halved = table_text([taps_of("1-2")]), table_text([taps_of("*|1")])
    assert "# A pair is a pass along x" in flat
    assert "A star" not in flat
    assert "level v" not in flat
    assert "# A star is one pass of nine fetches" in halved
    assert "# A stage of level v works on the picture halved v times" in halved
    angles = table_text([turned("1-1", ["x30", ""], channels=2)])
    assert "# A pair with angle_degrees runs along it, from x to the right" in angles
    assert "A pair with angle" not in flat


def test_a_profile_keeps_its_own_table_and_both_are_ours(tmp_path):
    profile = full_profile(annulus_transmittance=None)
    assert table_text([profile]) == csv_text(profile)
    for k, record in enumerate((profile, small_kernel())):
        path = tmp_path / f"{k}.csv"
        path.write_text(table_text([record]), encoding="utf-8")
        assert is_our_table(path)
    path.write_text("part,term\n", encoding="utf-8")
    assert not is_our_table(path)


def test_a_channel_that_holds_a_comma_stays_in_its_cell():
    kernel = small_kernel(channels=1)
    named = dataclasses.replace(kernel, channels=("a,b",))
    assert float(rows_of(named)[0]["a,b"]) == kernel.scale[0]


def test_several_records_are_refused():
    with pytest.raises(KernelError, match="a table holds one profile or kernel"):
        table_text([small_kernel(), small_kernel()])
