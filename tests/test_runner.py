"""Runs to files from Python: what the command line does, without one."""

from dataclasses import replace

import cli_world as world
import pytest

from sssfit.errors import SssfitError
from sssfit.methods import SIMULATIONS, Setting
from sssfit.profile import Profile
from sssfit.simulate import run_figures, simulate_montecarlo_many, simulate_to_files
from sssfit.simulate._walks import BATCH_PHOTONS
from sssfit.simulate.summary import summary

GRID = {"dr_mm": 0.4, "radius_mm": 8.0}
FAR = 40 * BATCH_PHOTONS


def stop_after(calls):
    """A function that asks for an end after so many questions."""
    asked = iter([False] * calls)
    return lambda: next(asked, True)


def test_profiles_are_written_and_told(tmp_path):
    path = tmp_path / "wax.npz"
    found = simulate_to_files([world.wax()], [path], "dipole", GRID)
    (one,) = found.outcomes
    assert Profile.load(path).to_dict() == one.profile.to_dict()
    assert one.to_dict() == run_figures(one.profile, one.seconds)
    assert found.to_dict(several=False) == {"output": [str(path)], **one.to_dict()}
    assert found.summary(several=False) == (
        f"{summary([one.to_dict()], several=False)}\nWrote {path}"
    )
    assert (found.is_interrupted, found.note) == (False, "")


def test_a_stopped_walk_goes_on_to_the_same_bits(tmp_path, caplog):
    caplog.set_level("INFO", "sssfit")
    path = tmp_path / "wax.npz"
    settings = {"photons": FAR, "threads": 2, **GRID}
    first = simulate_to_files(
        [world.wax(), world.plate()], [path, tmp_path / "plate.npz"],
        settings=settings, stop=stop_after(6),
    )  # fmt: skip
    assert first.not_begun == ("plate",)
    assert first.note.endswith("`resume = True` continues from there. Not begun: plate.")
    assert Profile.load(path).photons < FAR
    again = simulate_to_files([world.wax()], [path], settings=settings, resume=True)
    assert "Continuing from" in caplog.messages[-1]
    assert not again.is_interrupted
    (whole,) = simulate_montecarlo_many([world.wax()], **settings)
    assert Profile.load(path).annulus_energy.tobytes() == whole.annulus_energy.tobytes()
    assert [each.name for each in tmp_path.iterdir()] == ["wax.npz"]
    third = simulate_to_files([world.wax()], [path], settings=settings, resume=True)
    assert third.outcomes[0].seconds is None
    assert "Finished before, nothing to do" in third.summary(several=False)


def test_outputs_are_refused_before_the_work(tmp_path):
    (tmp_path / "mine").write_text("mine\n")
    for paths in ([tmp_path / "mine"], [tmp_path / "a.npz", tmp_path / "a.npz"]):
        with pytest.raises(SssfitError):
            simulate_to_files([world.wax()] * len(paths), paths, settings={"photons": 10**12})
    assert [each.name for each in tmp_path.iterdir()] == ["mine"]


def test_each_material_may_have_its_own_settings_and_no_file():
    settings = [GRID, GRID | {"dr_mm": 0.2}]
    found = simulate_to_files([world.wax()] * 2, [None, None], "burley", settings)
    assert [each.profile.n_annuli for each in found.outcomes] == [20, 40]
    assert [each.path for each in found.outcomes] == [None, None]


def test_the_settings_of_an_entry_are_told(monkeypatch):
    """Those of a method, however new, and what is told elsewhere once."""
    settings = (
        Setting("sharpness", "number", "how sharp."),
        Setting("w", "number", "how wide.", keyword="w_mm"),
    )
    entry = replace(SIMULATIONS["dipole"], settings=settings)
    monkeypatch.setitem(SIMULATIONS, "dipole", entry)
    made = world.profile()
    told = {"sharpness": 3.0, "w_mm": 0.5, "solver": "layer", "angles": 4}
    meta = {**made.meta, "settings": {**made.meta["settings"], **told, "reflectance": [0.5]}}
    figures = run_figures(replace(made, meta=meta), 0.25)
    assert {key: figures[key] for key in told} == told
    assert "reflectance" not in figures
    assert figures["photons"] == made.photons
