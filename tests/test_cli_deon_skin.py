"""``deon-skin`` on the command line: made without a method, and a profile like any other."""

import io
import json

import pytest

from sssfit.cli import main
from sssfit.methods import SIMULATIONS
from sssfit.profile import Profile
from sssfit.simulate import DEON_SKIN, simulate_deon_skin

FILE = "deon-skin.gaussians.profile.npz"


@pytest.fixture
def run(tmp_path, monkeypatch, capfd):
    """Run sssfit here; give exit status, stdout and stderr."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments):
        with pytest.raises(SystemExit) as caught:
            main(list(arguments))
        out, err = capfd.readouterr()
        return caught.value.code, out, err

    return call


def test_the_table_of_methods_has_the_name():
    assert SIMULATIONS["gaussians"].makes == DEON_SKIN.name


@pytest.mark.parametrize("method", [(), ("--method", "gaussians")])
def test_writes_what_the_library_makes(run, tmp_path, method):
    status, out, err = run("simulate", "deon-skin", *method)
    assert (status, err) == (0, "")
    assert out.startswith("deon-skin: gaussians, ")
    assert f"Wrote {FILE}" in out
    expected = io.BytesIO()
    simulate_deon_skin().write(expected)
    assert (tmp_path / FILE).read_bytes() == expected.getvalue()


def test_json_grid_and_output(run, tmp_path):
    asked = ("simulate", "deon-skin", "--dr", "0.05", "--radius", "5", "-o", "a.npz", "--json")
    figures = json.loads(run(*asked)[1])
    assert figures["output"] == ["a.npz"]
    assert (figures["material"], figures["method"]) == ("deon-skin", "gaussians")
    assert (figures["annuli"], figures["dr_mm"]) == (100, 0.05)
    for key in ("photons", "seed", "absorbed", "relative_error"):
        assert figures[key] is None
    assert Profile.load(tmp_path / "a.npz").n_annuli == 100


@pytest.mark.parametrize(
    ("arguments", "status", "fragment"),
    [
        (("deon-skin", "--method", "exact"), 2, "--method exact needs them; use --method gaussian"),
        (("deon-skin", "--method", "montecarlo"), 2, "deon-skin has no coefficients"),
        (("skin1", "--method", "gaussians"), 2, "makes deon-skin only, and this is skin1"),
        (("--all", "--method", "gaussians"), 2, "makes deon-skin only, and this is --all"),
        (("deon-skin", "--photons", "1e5"), 2, "--photons is for --method montecarlo"),
        (("deon-skin", "--resume"), 2, "--resume is for --method montecarlo"),
        (("deon-skin", "--tolerance", "1%"), 2, "--tolerance is for --method exact"),
        (("deon-skin", "--mapping", "diffuse"), 2, "--mapping is for --method burley"),
        (("deon-skin", "--radius", "auto"), 2, "--radius auto is for --method montecarlo"),
        (("deon-skin", "--run", "1"), 2, "--run chooses a run"),
        (("deon-skin", "--dr", "1e-6"), 1, "over the limit of 100000"),
    ],
)
def test_bad_input_is_one_clear_line(run, tmp_path, arguments, status, fragment):
    code, out, err = run("simulate", *arguments)
    assert (code, out) == (status, "")
    assert fragment in err.splitlines()[-1]
    assert list(tmp_path.iterdir()) == []


def test_materials_shows_the_six_gaussians(run):
    out = run("materials", "deon-skin")[1]
    assert "d'Eon, Luebke, Enderton 2007" in out
    assert "1.99            0.358  0.004  0.000" in out
    figures = json.loads(run("materials", "deon-skin", "--json")[1])
    assert figures["weights"][0] == [0.233, 0.455, 0.649]
    status, _, err = run("materials", "deon-skin", "--toml")
    assert status == 2
    assert "deon-skin has no coefficients to write as TOML" in err.splitlines()[-1]


def test_other_verbs_take_the_profile(run, tmp_path):
    run("simulate", "deon-skin", "--dr", "0.02")
    assert "material  deon-skin (d'Eon, Luebke, Enderton 2007)" in run("show")[1]
    shown = json.loads(run("show", "--json")[1])["material"]
    assert shown == {"name": "deon-skin", "source": DEON_SKIN.source, "layers": []}
    assert json.loads(run("chart", "--json")[1])["material"] == "deon-skin"
    assert run("chart", "--spectrum", "--mm-per-pixel", "0.2")[0] == 0
    assert run("export", "--format", "csv")[0] == 0
    assert (tmp_path / "deon-skin.gaussians.csv").read_text().count("deon-skin, gaussians") == 1
    asked = ("fit", "--method", "svd", "--rank", "1", "--mm-per-pixel", "0.2")
    assert "Wrote deon-skin.gaussians.svd1.kernel.json" in run(*asked)[1]
    assert run("export", "--format", "hlsl", "-o", "a.hlsl")[0] == 0
    assert "kernel: deon-skin." in (tmp_path / "a.hlsl").read_text()


@pytest.mark.parametrize("name", ["deon-skin", FILE])
def test_there_is_nothing_for_other_methods_to_be_held_against(run, name):
    run("simulate", "deon-skin", "--dr", "0.02")
    status, _, err = run("chart", "--models", name)
    assert (status, err.count("\n")) == (1, 1)
    assert "no coefficients" in err or "not a photon walk of a known material" in err
