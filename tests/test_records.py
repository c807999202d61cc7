"""What a verb prints with --json is what the record of the Python call says of itself."""

import json

import cli_world as world
import pytest

from sssfit.kernel import SeparableKernel
from sssfit.material import parse_material
from sssfit.measure.score import measure
from sssfit.profile import Profile
from sssfit.simulate import run_figures, simulate_burley, simulate_dipole


@pytest.fixture(scope="module", autouse=True)
def recorded():
    with world.recording():
        yield


def fitted():
    """The result of the fit that the command below asks for."""
    from sssfit.fit import fit_svd

    return fit_svd(world.profile(), rank=2, mm_per_pixel=0.4)


def guide():
    from sssfit.compare import compute_guide

    return compute_guide(world.profile())


def spectrum():
    from sssfit.compare import compute_spectrum

    return compute_spectrum(world.profile())


def view():
    from sssfit.compare import view_kernel

    return view_kernel(world.kernel(), world.profile())


def judged(**settings):
    """What the command below renders, against the truth."""
    from sssfit.compare.evaluate import evaluate
    from sssfit.scene.made import make_scene

    kernel = world.kernel()
    scene = make_scene("disk", height=16, width=24, mm_per_pixel=kernel.mm_per_pixel)
    return evaluate(scene, kernel, world.profile(), **settings)


def burley():
    return run_figures(simulate_burley(world.wax(), dr_mm=0.3, radius_mm=8.0), 0.25)


def moved():
    from sssfit.motion import runner

    return runner.run_sequence(world.wax(), "head")[0].to_dict()


def tabled():
    from sssfit.motion import table

    return table.measure_table().to_dict()


SMALL = "compare wax.profile.npz --what kernels --size 24x16"
# Commands, the dict of the record, and what the verb adds: facts of the run, not of the record.
RECORDS = {
    "show wax.profile.npz": (lambda: world.profile().to_dict(), {"file"}),
    "show plate.profile.npz": (lambda: world.plate_profile().to_dict(), {"file"}),
    "show wax.svd2.kernel.json": (lambda: world.kernel().figures(), {"file"}),
    "fit wax.profile.npz --method svd --rank 2 --mm-per-pixel .4": (
        lambda: fitted().to_dict(),
        {"profile"},
    ),
    "simulate wax.toml --method burley --dr .3 --radius 8": (burley, set()),
    "choose wax.toml": (
        lambda: world.choice().to_dict(),
        {"distance_mm", "fov_degrees", "resolution"},
    ),
    "stability wax.toml": (lambda: world.stresses("wax").to_dict(), set()),
    "motion wax.toml": (moved, set()),
    "motion --table": (tabled, set()),
    SMALL: (lambda: world.comparison().to_dict(), {"error", "cost", "verdict", "budget"}),
    "chart wax.profile.npz --spectrum": (lambda: spectrum().to_dict(), {"profile"}),
    "chart wax.profile.npz --guide": (lambda: guide().to_dict(), {"profile"}),
    "chart wax.toml --models": (lambda: world.models().to_dict(), set()),
    "chart wax.svd2.kernel.json": (lambda: view().to_dict(), {"kind", "file", "profile"}),
    "render --irradiance disk --size 24x16": (
        lambda: judged().to_dict(),
        {"kernel", "profile", "border", "follow", "intermediate"},
    ),
}
CLOCKS = ("seconds", "photons_per_second", "seconds_per_megapixel")


def without_clocks(figures):
    """What does not depend on how fast the machine was."""
    return {key: each for key, each in figures.items() if key not in CLOCKS}


@pytest.mark.parametrize("command", list(RECORDS))
def test_json_is_the_record_and_facts_of_the_run(command):
    record, run_facts = RECORDS[command]
    told = json.loads(json.dumps(record(), allow_nan=False))
    printed = world.run(f"{command} --json").figures
    own = {key: printed[key] for key in printed if key in told}
    assert without_clocks(own) == without_clocks(told)
    assert printed.keys() - told.keys() == {"command", "output"} | run_facts
    assert [key for key in printed if key in told] == list(told)  # in the same order


def test_a_budget_of_several_pictures_has_the_rows_of_each():
    printed = world.run("compare wax.toml --what budget --rank 2 --size 24x16 --json").figures
    each = [budget.to_dict() for budget in world.budgets(2)]
    assert printed["budget"] == {**each[0], "rows": [row for one in each for row in one["rows"]]}


def test_a_checkpoint_has_the_figures_of_its_profiles(tmp_path):
    from sssfit.simulate import Checkpoint, SoFar, read_checkpoint, simulate_montecarlo

    path = tmp_path / "wax.checkpoint"
    stop = iter([False] * 3 + [True] * 100)
    simulate_montecarlo(
        parse_material(world.WAX, "wax.toml"),
        photons=400_000,
        dr_mm=0.4,
        radius_mm=8.0,
        checkpoint=Checkpoint(path, 0.0),
        stop=lambda: next(stop),
    )
    found = read_checkpoint(path)
    assert isinstance(found, SoFar)
    told = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert told["kind"] == "checkpoint"
    assert told["photons"] == found.profiles[0].photons > 0
    assert told["profiles"] == [found.profiles[0].to_dict()]


@pytest.mark.parametrize(
    "record", [world.small_sheet, world.small_editing, world.small_convergence]
)
def test_records_of_the_documentation_can_be_written_as_json(record):
    told = record().to_dict()
    assert json.loads(json.dumps(told, allow_nan=False)) == told
    assert told["rows"]


def test_what_was_not_measured_is_none():
    without = judged(exposure=None).to_dict()
    assert without["ssim"] is None
    picture = judged().truth
    same = measure(picture, picture).to_dict()
    assert same["psnr_db"] is None  # infinite
    assert same["relative_l2"] == 0.0
    assert list(same) == [key for key in without if key in same]


def test_figures_of_a_run_without_photons_have_none():
    told = run_figures(simulate_dipole(world.wax(), dr_mm=0.3, radius_mm=8.0), None)
    assert told["photons"] is told["photons_per_second"] is told["seconds"] is None
    assert told["finished_before"] is True


def test_files_have_their_own_figures(tmp_path):
    world.profile().save(tmp_path / "wax.profile.npz")
    world.kernel().save(tmp_path / "wax.kernel.json")
    assert Profile.load(tmp_path / "wax.profile.npz").to_dict() == world.profile().to_dict()
    assert SeparableKernel.load(tmp_path / "wax.kernel.json").figures() == world.kernel().figures()
