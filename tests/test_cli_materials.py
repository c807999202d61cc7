import io
import json
import sys

import pytest

from sssfit.cli import main
from sssfit.material import load_material, material_names, parse_material

STACK = """\
name = "lacquer"
eta_above = 1.33
[[layers]]
eta = 1.5
g = 0.0
sigma_a_per_mm = [0, 0, 0]
sigma_s_per_mm = [0, 0, 0]
thickness_mm = 0.5
[[layers]]
eta = 1.3
g = 0.8
sigma_a_per_mm = [0.032, 0.17, 0.48]
sigma_s_per_mm = [0.74, 0.88, 1.01]
"""


@pytest.fixture
def run(capsys):
    def run(*args, status=0):
        with pytest.raises(SystemExit) as ended:
            main(["materials", *args])
        out, err = capsys.readouterr()
        assert ended.value.code == status, err
        return out if status == 0 else err

    return run


def test_list_names_every_material_within_100_columns(run):
    lines = run().splitlines()
    assert lines[0].split()[:2] == ["name", "eta"]
    assert lines[0].count("mm") == 3
    half_spaces, layered = lines[1 : lines.index("")], lines[lines.index("") + 2 : -2]
    assert [line.split()[0] for line in half_spaces] == list(material_names())
    assert [line.split()[0] for line in layered] == list(material_names(layered=True))
    fat = next(line for line in layered if line.startswith("skin-melanin-12-fat"))
    assert fat.split()[1:7] == ["1.4", "1.4", "1.44", "0.06", "1.5", "inf"]
    uses = "a profile without coefficients, for simulate, compare, choose, motion and report"
    assert lines[-2:] == ["", f"deon-skin: {uses}"]
    assert max(map(len, lines)) <= 100
    skin1 = next(line for line in lines if line.startswith("skin1"))
    expected = "skin1 1.3 0.95855 0.83810 0.67785 1.2953 0.9524 0.6711 0.03356 1236 41.48"
    assert " ".join(skin1.split()) == expected


def test_list_as_json(run):
    result = json.loads(run("--json"))
    assert result["command"] == "materials"
    assert result["output"] == []
    assert result["profiles"] == ["deon-skin"]
    rows = {row["name"]: row for row in result["rows"]}
    assert tuple(rows) == material_names()
    layered = {row["name"]: row for row in result["layered"]}
    assert tuple(layered) == material_names(layered=True)
    assert layered["wholemilk-on-glass"]["thickness_mm"] == [2.0, 3.0]
    assert layered["skin-melanin-12"]["thickness_mm"] == [0.06, None]
    assert rows["skin1"]["annuli"] == 1236
    assert rows["skin1"]["dr_mm"] == pytest.approx(0.0335570469798, rel=1e-9)
    assert rows["skin1"]["channels"] == ["R", "G", "B"]
    assert rows["marble"]["eta"] == 1.5
    assert set(rows["skin1"]) == {
        "name",
        "source",
        "channels",
        "eta",
        "albedo",
        "mean_free_path_mm",
        "dr_mm",
        "annuli",
        "radius_mm",
    }


def test_one_material_in_full(run):
    out = run("skin1")
    for piece in ("Jensen et al. 2001", "semi-infinite, eta 1.3", "0.01701", "1236 annuli"):
        assert piece in out
    assert "single-scattering albedo  transport mean free path, mm" in out
    row = "R                0.032           0.74  0                  0.958549"
    assert f"{row}                       1.29534" in out


def test_one_material_as_json(run):
    result = json.loads(run("skin1", "--json"))
    assert result["sigma_a_per_mm"] == [0.032, 0.17, 0.48]
    assert result["sigma_s_per_mm"] == [0.74, 0.88, 1.01]
    assert result["g"] == [0, 0, 0]
    assert result["thickness_mm"] is None
    assert result["sha256"] == load_material("skin1").sha256
    assert result["specular_reflectance"] == pytest.approx((0.3 / 2.3) ** 2)
    assert result["layers"][0]["albedo"] == result["albedo"]


def test_toml_is_a_template_that_loads(run, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(run("skin1", "--toml"))
    assert load_material(path) == load_material("skin1")
    assert run(str(path)) == run("skin1")


def test_toml_is_printed_even_when_quiet(run):
    assert run("skin1", "--toml", "-q") == run("skin1", "--toml")


def test_stack_from_standard_input(run, monkeypatch):
    def typed():
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(STACK.encode())))

    typed()
    out = run("-")
    for piece in ("above: eta 1.33", "layer 1: 0.5 mm thick, eta 1.5, clear", "layer 2: semi-inf"):
        assert piece in out
    assert "transport mean free path: 1 / (sigma_a + (1 - g) sigma_s)" in out
    typed()
    result = json.loads(run("-", "--json"))
    assert [layer["eta"] for layer in result["layers"]] == [1.5, 1.3]
    assert result["layers"][0]["mean_free_path_mm"] == [None] * 3
    assert result["eta"] is None
    assert result["sigma_a_per_mm"] is None
    typed()
    assert parse_material(run("-", "--toml"), "x.toml") == parse_material(STACK, "x.toml")


def test_control_characters_of_a_source_do_not_reach_the_terminal(run, tmp_path):
    path = tmp_path / "red.toml"
    path.write_text('source = "\\u001b[31m"\n' + load_material("skin1").to_toml().split("\n", 2)[2])
    assert r"\x1b[31m" in run(str(path))


def test_material_beyond_the_papers_grid_is_still_shown(run, tmp_path):
    path = tmp_path / "wide.toml"
    path.write_text(
        "eta = 1.3\ng = 0\nsigma_a_per_mm = [0, 0, 0]\nsigma_s_per_mm = [0.001, 5, 5]\n"
    )
    assert "none: too many annuli" in run(str(path))
    assert json.loads(run(str(path), "--json"))["annuli"] is None


def test_unknown_name_exits_1_with_a_suggestion(run):
    error = run("skni1", status=1)
    assert error.startswith("Error: there is no material 'skni1'; did you mean skin1?")
    assert error.count("\n") == 1


def test_bad_file_exits_1_with_one_line(run, tmp_path):
    path = tmp_path / "bad.toml"
    path.write_text("eta = 0.4\ng = 0\nsigma_a_per_mm = [1]\nsigma_s_per_mm = [1]\n")
    error = run(str(path), status=1)
    assert error.startswith(f"Error: {path}: eta = 0.4 is out of range")
    assert error.count("\n") == 1


def test_toml_without_a_material_is_wrong_usage(run):
    assert "--toml needs a MATERIAL" in run("--toml", status=2)
    assert "--json" in run("skin1", "--toml", "--json", status=2)
