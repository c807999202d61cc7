"""The plans of docs/examples: they are read, estimated, and some of their points computed."""

import errno
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sssfit.errors import FileError
from sssfit.simulate.batches import code_version
from sssfit.sweep import load_plan, sweep_to_store, tasks
from sssfit.sweep.dry_run import estimate

EXAMPLES = Path(__file__).parents[1] / "docs" / "examples"


def computed(plan, indices):
    parts = tuple(tasks.Part(index, last=1) for index in indices)
    done = tasks.perform(plan, tasks.Task(parts, 0.0, code_version()))
    assert [each.failure for each in done] == [None] * len(indices)
    return [each.profile for each in done]


@pytest.fixture(scope="module")
def skin():
    plan = load_plan(EXAMPLES / "skin-spectral.toml")
    return replace(plan, settings={"photons": 4000})


@pytest.fixture(scope="module")
def table():
    return load_plan(EXAMPLES / "lut-albedo-eta.toml")


def test_skin_has_31_wavelengths_and_darkens_with_melanin(skin):
    assert (skin.count, [len(each.values) for each in skin.axes]) == (248, [4, 2, 31])
    assert (skin.axes[2].values[0], skin.axes[2].values[-1]) == (400.0, 700.0)
    index = {skin.position(k): k for k in range(skin.count)}
    pale, dark, blue = computed(skin, [index[0, 0, 30], index[3, 0, 30], index[0, 1, 0]])
    totals = [float(each.diffuse_reflectance[0]) for each in (pale, dark, blue)]
    assert totals[0] > totals[1] + 0.1
    assert totals[0] > totals[2] + 0.2


def test_the_table_has_2000_points_and_its_ends_are_solved(table):
    assert (table.count, table.shape) == (2000, (50, 40))
    low, high = computed(table, [0, table.count - 40])
    assert float(low.diffuse_reflectance[0]) < 0.01
    assert 0.8 < float(high.diffuse_reflectance[0]) < 1.0
    assert np.isfinite(high.annulus_energy).all()


def test_a_folder_that_cannot_be_written_is_one_line(table, tmp_path, monkeypatch):
    def refusing(*_, **__):
        raise OSError(errno.EROFS, "Read-only file system")

    monkeypatch.setattr("sssfit.sweep.made.temporary_folder", refusing)
    with pytest.raises(FileError, match="cannot be written: read-only file system") as caught:
        sweep_to_store(table, tmp_path / "x.zarr", threads=1)
    assert "\n" not in str(caught.value)
    assert [*tmp_path.iterdir()] == []


def test_both_are_estimated_without_being_run(skin, table):
    found = estimate(skin, threads=1).to_dict()
    assert found["photons"] == 248 * 4000
    assert estimate(table, threads=1).to_dict()["points"] == 2000


@pytest.mark.slow
def test_the_whole_table_interrupted_and_resumed(table, tmp_path):
    """2000 exact points on two workers, stopped after 300 and then done."""
    seen = []
    begun = time.monotonic()
    stopped = sweep_to_store(
        table,
        tmp_path / "x.zarr",
        threads=2,
        stop=lambda: len(seen) >= 300,
        progress=lambda *now: seen.append(now),
    )
    assert 300 <= stopped.done < 2000
    found = sweep_to_store(table, tmp_path / "x.zarr", threads=2, resume=True)
    assert found.is_complete
    assert (found.before, found.done) == (stopped.done, 2000 - stopped.done)
    print(f"2000 points in {time.monotonic() - begun:.0f} s")
