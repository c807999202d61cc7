"""Other people's files as a user meets them: .mci walked, .mco and CSV imported and exported."""

import io
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from test_mci import file_text, run_text
from test_mco import mco_text

from sssfit.cli import main
from sssfit.formats.mci import parse_mci
from sssfit.profile import Profile
from sssfit.simulate import simulate_montecarlo

TABLE = "r_mm,R,R_stderr\n0.5,0.1,0.001\n1,0.05,0.002\ninf,0.01,nan\n"
DATA = Path(__file__).parent / "data"
COMMAND = [sys.executable, "-m", "sssfit.cli"]
GREEN = mco_text(layers=("1.4 3 100 0.8 0.1", "1.4 2.5 10 0 0.2"), name="g.mco")


@pytest.fixture
def run(tmp_path, monkeypatch, capfd):
    """Run the command line here; give exit status, stdout and stderr."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments):
        with pytest.raises(SystemExit) as caught:
            main(arguments)
        out, err = capfd.readouterr()
        return caught.value.code or 0, out, err

    return call


def names(folder):
    return sorted(path.name for path in folder.iterdir())


# simulate tissue.mci


def test_a_run_is_walked_on_its_own_grid(run, tmp_path):
    text = file_text(run_text("skin.mco"))
    Path("tissue.mci").write_text(text)
    status, out, _ = run("simulate", "tissue.mci", "--json")
    assert status == 0
    figures = json.loads(out)
    assert figures["output"] == ["skin.profile.npz"]
    assert (figures["photons"], figures["annuli"], figures["dr_mm"]) == (1000, 50, 0.2)
    profile = Profile.load("skin.profile.npz")
    assert profile.channels == ("mono",)
    (mci,) = parse_mci(text, "tissue.mci")
    assert profile.meta["material"] == mci.material.to_dict()
    same = simulate_montecarlo(mci.material, photons=1000, dr_mm=0.2, radius_mm=10.0)
    assert profile.annulus_energy.tobytes() == same.annulus_energy.tobytes()


def test_a_comment_in_latin_1_does_not_stop_a_run(run):
    status, out, _ = run("simulate", str(DATA / "latin1-comment.mci"), "--json")
    assert status == 0
    (found,) = json.loads(out)["diffuse_reflectance"]
    assert found == pytest.approx(0.261710, abs=5e-4)  # the same walk; rounding may part photons


def test_all_runs_or_one(run, tmp_path):
    second = run_text("b.mco", layer="1.4 1 5 0 1E8").replace("1000 ", "2000 ")
    Path("tissue.mci").write_text(file_text(run_text("a.mco"), second))
    status, out, _ = run("simulate", "tissue.mci")
    assert status == 0
    assert "2 materials: 1,000 to 2,000 photons, seed 1" in out
    assert names(tmp_path) == ["a.profile.npz", "b.profile.npz", "tissue.mci"]
    both = Profile.load("b.profile.npz")
    Path("out").mkdir()
    assert run("simulate", "tissue.mci", "-o", "out", "-q") == (0, "", "")
    assert names(Path("out")) == ["a.profile.npz", "b.profile.npz"]
    status, out, _ = run("simulate", "tissue.mci", "--run", "2", "-o", "two.npz", "--json")
    assert status == 0
    assert json.loads(out)["material"] == "b"
    assert Profile.load("two.npz").annulus_energy.tobytes() == both.annulus_energy.tobytes()


def test_options_go_before_the_file(run):
    Path("tissue.mci").write_text(file_text(run_text("skin.mco")))
    arguments = ("--photons", "1e7", "--dr", "0.5", "--radius", "3", "--photons", "3000")
    assert run("simulate", "tissue.mci", *arguments)[0] == 0
    profile = Profile.load("skin.profile.npz")
    assert (profile.photons, profile.n_annuli) == (3000, 6)
    assert run("simulate", "tissue.mci", "--photons", "2000", "--radius", "auto")[0] == 0
    profile = Profile.load("skin.profile.npz")
    assert profile.photons == 2000
    assert profile.r_edges_mm[1] == 0.2


@pytest.mark.parametrize(
    ("arguments", "status", "said"),
    [
        (("skin1", "--run", "1"), 2, "--run chooses a run of an MCML input file"),
        (("tissue.mci", "--run", "0"), 2, "--run"),
        (("tissue.mci", "--all"), 2, "name one MATERIAL"),
        (("tissue.mci", "--run", "3"), 1, "tissue.mci has no run 3; give --run 1 to 2"),
        (("tissue.mci", "-o", "-"), 2, "-o names a folder"),
        (("tissue.mci", "-o", "none"), 1, "there is no folder none"),
        (("none.mci",), 1, "none.mci cannot be read: no such file"),
        (("bad.mci",), 1, "bad.mci: line 9: g = '2' is out of range"),
    ],
)
def test_wrong_runs(run, tmp_path, arguments, status, said):
    Path("tissue.mci").write_text(file_text(run_text("a.mco"), run_text("b.mco")))
    Path("bad.mci").write_text(file_text(run_text(layer="1.3 1 2 2 1")))
    code, out, err = run("simulate", *arguments)
    assert (code, out) == (status, "")
    assert said in err.splitlines()[-1]
    assert status == 2 or err.count("\n") == 1
    assert names(tmp_path) == ["bad.mci", "tissue.mci"]


# import


def test_import_of_a_table(run, tmp_path):
    Path("mine.csv").write_text(TABLE)
    status, out, err = run("import", "mine.csv", "--quantity", "energy")
    assert (status, err) == (0, "")
    assert "mine.csv: 2 annuli, to 1 mm" in out
    assert out.endswith("Wrote mine.profile.npz\n")
    profile = Profile.load("mine.profile.npz")
    assert profile.annulus_energy.tolist() == [[0.1], [0.05]]
    assert profile.annulus_energy_stderr.tolist() == [[0.001], [0.002]]
    assert names(tmp_path) == ["mine.csv", "mine.profile.npz"]


def test_import_of_mcml_output(run):
    Path("skin.mco").write_text(mco_text())
    status, out, _ = run("import", "skin.mco", "-o", "x.npz", "--json")
    assert status == 0
    figures = json.loads(out)
    assert figures["command"] == "import"
    assert figures["output"] == ["x.npz"]
    assert (figures["source"], figures["material"]) == ("skin.mco", "skin")
    assert figures["diffuse_reflectance"] == [pytest.approx(0.3, rel=1e-4)]
    assert figures["diffuse_reflectance_stderr"] == [None]
    assert figures["transmittance"] == [pytest.approx(0.1, rel=1e-4)]
    assert figures["photons"] is None
    assert Profile.load("x.npz").meta["source"] == "skin.mco"


def test_import_of_channels(run):
    for name, text in {"r.mco": mco_text(), "g.mco": GREEN, "b.mco": GREEN}.items():
        Path(name).write_text(text)
    assert run("import", "r.mco", "g.mco", "b.mco", "-o", "x.npz")[0] == 0
    assert Profile.load("x.npz").channels == ("R", "G", "B")
    assert run("import", "r.mco", "g.mco", "--channels", "near, far", "-o", "x.npz")[0] == 0
    assert Profile.load("x.npz").channels == ("near", "far")
    assert run("import", "r.mco", "--channels", "630nm", "-o", "x.npz")[0] == 0
    assert Profile.load("x.npz").channels == ("630nm",)


@pytest.mark.parametrize("content", [TABLE, mco_text()], ids=["csv", "mco"])
def test_import_through_pipes(tmp_path, content):
    quantity = ["--quantity", "energy"] if content is TABLE else []
    ended = subprocess.run(
        [*COMMAND, "import", "-", *quantity, "-o", "-"],
        cwd=tmp_path,
        input=content.encode(),
        capture_output=True,
    )
    assert ended.returncode == 0, ended.stderr
    assert Profile.read(io.BytesIO(ended.stdout)).meta["source"] == "stdin"
    assert b"Wrote the profile to stdout" in ended.stderr
    assert names(tmp_path) == []


@pytest.mark.parametrize(
    ("arguments", "status", "said"),
    [
        ((), 2, "Missing argument"),
        (("mine.csv",), 1, "mine.csv does not say what its numbers are; give --quantity density"),
        (("mine.csv", "--quantity", "flux"), 2, "flux"),
        (("mine.csv", "--quantity", "density"), 1, "line 4, column 'r_mm': inf"),
        (("mine.csv", "--channels", "R"), 2, "--channels is for .mco files"),
        (("a.mco", "--quantity", "energy"), 2, "--quantity is for a CSV"),
        (("a.mco", "--unit", "cm"), 2, "--unit is for a CSV"),
        (("a.mco", "--density-unit", "cm"), 2, "--density-unit is for a CSV"),
        (("mine.csv", "--quantity", "energy", "--unit", "cm"), 1, "r_mm says mm, and the unit giv"),
        (("mine.csv", "--quantity", "energy", "--density-unit", "cm"), 1, "energies have no unit"),
        (
            ("mcml2.mco",),
            1,
            "line 1: this is a file of MCML 2.0; only the output of MCML 1 (version",
        ),
        (("run.mci",), 1, "run.mci is an MCML input file; `sssfit simulate` walks"),
        (("picture.png",), 1, "picture.png is not text; expected a CSV or MCML's output in ASCII"),
        (("a.mco", "g.mco"), 2, "name the profile of several files with -o"),
        (("a.mco", "g.mco", "-o", "x.npz"), 2, "give --channels with 2 names"),
        (("a.mco", "g.mco", "-o", "x.npz", "--channels", "R"), 1, "1 channel name"),
        (("a.mco", "mine.csv", "-o", "x.npz"), 1, "mine.csv is not an .mco file"),
        (("a.mco", "-o", "no/x.npz"), 1, "there is no folder no"),
        (("none.mco",), 1, "none.mco cannot be read: no such file"),
        (("cut.mco",), 1, "cut.mco: ends after line"),
        (("a.mco", "-o", "notes"), 1, "exists and was not written by sssfit"),
        (("a.mco", "-o", "mine.csv"), 1, "mine.csv ends in .csv, and a profile is written"),
    ],
)
def test_wrong_imports(run, tmp_path, arguments, status, said):
    Path("mine.csv").write_text(TABLE)
    Path("a.mco").write_text(mco_text())
    Path("g.mco").write_text(GREEN)
    Path("cut.mco").write_text(mco_text()[:700])
    Path("mcml2.mco").write_bytes((DATA / "mcml2.mco").read_bytes())
    Path("run.mci").write_text(file_text(run_text()))
    Path("notes").write_text("mine")
    Path("picture.png").write_bytes(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR")
    before = names(tmp_path)
    code, out, err = run("import", *arguments)
    assert (code, out) == (status, "")
    assert said in err.splitlines()[-1]
    assert status == 2 or err.count("\n") == 1
    assert names(tmp_path) == before


def test_units_that_cannot_be_are_refused_with_those_that_can(run, tmp_path):
    Path("mine.csv").write_text("r_mm,R\n50,0.3\n150,0.2\n")
    status, out, err = run("import", "mine.csv", "--quantity", "density")
    assert (status, out) == (1, "")
    assert "'R' adds up to 28274.3 of 1 that arrives; it would be 0.02827 with radii in um" in err
    assert err.count("\n") == 1
    assert names(tmp_path) == ["mine.csv"]
    Path("mine.csv").write_text("r_um,R\n50,0.3\n150,0.2\n")
    arguments = ("mine.csv", "--quantity", "density", "--density-unit", "mm", "--json")
    status, out, _ = run("import", *arguments)
    assert json.loads(out)["diffuse_reflectance"] == [pytest.approx(0.0282743, rel=1e-5)]


def test_a_table_in_cm_is_converted(run):
    status, out, err = run(
        "import", str(DATA / "low-albedo-cm.csv"), "--quantity", "density", "--json"
    )
    assert (status, err) == (0, "")
    figures = json.loads(out)
    assert figures["diffuse_reflectance"] == [pytest.approx(0.008006, abs=5e-7)]
    assert figures["radius_mm"] == pytest.approx(8.0)
    Path("r.csv").write_text((DATA / "low-albedo-cm.csv").read_text().replace("r_cm", "r"))
    _, out, _ = run("import", "r.csv", "--quantity", "density", "--unit", "cm", "--json")
    assert json.loads(out)["diffuse_reflectance"] == figures["diffuse_reflectance"]


def test_the_question_what_numbers_are_names_the_units_of_the_table(run):
    table = str(DATA / "low-albedo-cm.csv")
    asked = "give --quantity density (R_d in 1/{}^2 at the radius {}) or --quantity energy (of the "
    for name, options, unit in (
        ("r_cm", (), "cm"),
        ("r_cm", ("--density-unit", "mm"), "mm"),
        ("r", ("--unit", "m"), "m"),
    ):
        Path("asked.csv").write_text(Path(table).read_text().replace("r_cm", name))
        status, _, err = run("import", "asked.csv", *options)
        assert status == 1
        assert asked.format(unit, name) in err


def test_lost_energy_and_gaps_are_said_on_import(run):
    Path("a.mco").write_text(mco_text(RAT="RAT\n0.01\n0.3\n0.2\n0.1\n", A_l="A_l\n0.1\n0.1\n"))
    status, _, err = run("import", "a.mco", "-q")
    assert status == 0
    assert err.startswith("Warning: a.mco: the energies of RAT add up to 0.61 of 1")
    assert err.count("\n") == 1
    Path("far.csv").write_text("r_mm,R\n1,0.1\n1.1,0.09\n")
    status, _, err = run("import", "far.csv", "--quantity", "density")
    assert status == 0
    assert err.startswith("Warning: far.csv begins at r = 1 mm")
    assert err.count("\n") == 1


def test_imports_can_be_shown_and_drawn(run):
    Path("mine.csv").write_text(TABLE)
    Path("skin.mco").write_text(mco_text())
    run("import", "mine.csv", "--quantity", "energy")
    run("import", "skin.mco")
    for name in ("mine", "skin"):
        assert run("show", f"{name}.profile.npz", "--json")[0] == 0
        assert run("chart", f"{name}.profile.npz")[0] == 0


# export


def test_what_a_table_does_not_know_is_shown_as_unknown(run):
    Path("table.csv").write_text("r_mm,R\n0.1,1\n0.2,0.5\n")
    assert run("import", "table.csv", "--quantity", "density")[0] == 0
    _, out, _ = run("show", "table.profile.npz")
    assert "nan" not in out
    _, out, _ = run("show", "table.profile.npz", "--json")
    assert json.loads(out)["absorbed"] is None


def test_export_and_import_give_the_same_bits(run, tmp_path):
    run("simulate", "skin1", "--photons", "2e4")
    status, out, err = run("export", "--format", "csv")
    assert (status, out) == (0, "Wrote skin1.csv\n")
    assert err == "Using skin1.profile.npz, the newest *.profile.npz here.\n"
    assert run("export", "skin1.profile.npz", "--format", "csv", "-q") == (0, "", "")  # our own
    assert run("import", "skin1.csv", "-o", "again.profile.npz")[0] == 0
    ours, again = Profile.load("skin1.profile.npz"), Profile.load("again.profile.npz")
    for name in ("r_edges_mm", "annulus_energy", "annulus_energy_stderr", "beyond_grid"):
        assert getattr(ours, name).tobytes() == getattr(again, name).tobytes()
    np.testing.assert_array_equal(ours.beyond_grid_stderr, again.beyond_grid_stderr)
    assert names(tmp_path) == ["again.profile.npz", "skin1.csv", "skin1.profile.npz"]


def test_export_says_what_it_did(run):
    Path("mine.csv").write_text(TABLE)
    run("import", "mine.csv", "--quantity", "energy")
    status, out, err = run("export", "mine.profile.npz", "--format", "csv", "-o", "x.csv", "--json")
    assert (status, err) == (0, "")
    assert json.loads(out) == {
        "command": "export",
        "output": ["x.csv"],
        "format": "csv",
        "profile": "mine.profile.npz",
        "channels": ["R"],
        "annuli": 2,
    }
    status, out, err = run("export", "mine.profile.npz", "--format", "csv", "-o", "-")
    assert status == 0
    assert out == Path("x.csv").read_text()
    assert err == "Wrote the table to stdout\n"


def test_a_table_of_somebody_else_is_not_replaced_without_force(run):
    Path("mine.csv").write_text(TABLE)
    run("import", "mine.csv", "--quantity", "energy")
    status, _, err = run("export", "mine.profile.npz", "--format", "csv")
    assert status == 1
    assert "--force" in err
    assert Path("mine.csv").read_text() == TABLE
    assert run("export", "mine.profile.npz", "--format", "csv", "--force")[0] == 0


@pytest.mark.parametrize(
    ("arguments", "status", "said"),
    [
        (("--format", "csv"), 1, "there is no *.profile.npz in this folder"),
        (("x.npz",), 2, "give --format or --preset"),
        (("x.npz", "--format", "pdf"), 2, "pdf"),
        (("x.npz", "--format", "csv"), 1, "x.npz cannot be read: no such file"),
    ],
)
def test_wrong_exports(run, tmp_path, arguments, status, said):
    code, out, err = run("export", *arguments)
    assert (code, out) == (status, "")
    assert said in err
    assert status == 2 or err.count("\n") == 1
    assert names(tmp_path) == []
