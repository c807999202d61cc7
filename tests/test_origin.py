"""The profile that a kernel was fitted to, found among files by its fingerprint."""

import dataclasses
import os
from pathlib import Path

import pytest
from reference_pixels import make_profile

from sssfit.fit import fit_svd
from sssfit.kernel.origin import find_profile
from sssfit.profile import Profile

EDGES = [0.0, 1.0, 4.0, 9.0]
MADE_OF = {"material": {"name": "wax"}, "method": "exact"}


@pytest.fixture
def profile():
    made = make_profile(EDGES, [[0.2, 0.1], [0.1, 0.1], [0.1, 0.05]])
    return dataclasses.replace(made, meta={**made.meta, **MADE_OF})


@pytest.fixture
def kernel(profile):
    return fit_svd(profile, rank=1, mm_per_pixel=1.0).kernel


def look(kernel, folder):
    return find_profile(kernel, "k.kernel.json", [folder])


def test_it_is_known_by_its_light_under_any_name(tmp_path, profile, kernel, caplog):
    caplog.set_level("INFO", "sssfit")
    (tmp_path / "torn.npz").write_bytes(b"torn")
    make_profile(EDGES, [[0.3, 0.1], [0.1, 0.1], [0.1, 0.05]]).save(tmp_path / "other.npz")
    profile.save(tmp_path / "any name.npz")
    found, file = look(kernel, tmp_path)
    assert found is not None
    assert found.sha256 == profile.sha256
    assert Path(file) == tmp_path / "any name.npz"
    assert caplog.messages == []


def test_of_several_the_newest_is_taken(tmp_path, profile, kernel):
    for age, name in enumerate(("new.npz", "old.npz")):
        profile.save(tmp_path / name)
        os.utime(tmp_path / name, (1e9 - age, 1e9 - age))
    assert Path(look(kernel, tmp_path)[1]).name == "new.npz"


def test_older_profiles_than_the_one_that_is_found_are_not_read(
    tmp_path, profile, kernel, monkeypatch
):
    read, load = [], Profile.load
    monkeypatch.setattr(Profile, "load", lambda path: read.append(path.name) or load(path))
    other = make_profile(EDGES, [[0.3, 0.1], [0.1, 0.1], [0.1, 0.05]])
    for age, name in enumerate(("newer.npz", "fitted.npz", "older.npz")):
        (profile if name == "fitted.npz" else other).save(tmp_path / name)
        os.utime(tmp_path / name, (1e9 - age, 1e9 - age))
    assert Path(look(kernel, tmp_path)[1]).name == "fitted.npz"
    assert read == ["newer.npz", "fitted.npz"]


def test_why_there_is_none_is_noted(tmp_path, profile, kernel, caplog):
    caplog.set_level("INFO", "sssfit")
    found, file = look(kernel, tmp_path)
    assert found is file is None
    assert caplog.messages[-1].startswith(
        "No profile here is the one that k.kernel.json was fitted to"
    )
    changed = make_profile(EDGES, [[0.3, 0.1], [0.1, 0.1], [0.1, 0.05]])
    dataclasses.replace(changed, meta={**changed.meta, **MADE_OF}).save(tmp_path / "wax.npz")
    look(kernel, tmp_path)
    assert "wax.npz is a profile of wax by the same method, but not" in caplog.messages[-1]
    without = {key: each for key, each in kernel.meta.items() if key != "profile_sha256"}
    old = dataclasses.replace(kernel, meta=without)
    look(old, tmp_path)
    assert "does not record which profile it was fitted to" in caplog.messages[-1]
