"""``sssfit simulate --method``: every method's files, figures, words, refusals, interruptions."""

import io
import json
import os
import signal
import sys
import time
from pathlib import Path

import fork_server
import numpy as np
import pytest

from sssfit import simulate
from sssfit.cli import cli, main
from sssfit.material import load_material, material_names
from sssfit.methods import SIMULATIONS
from sssfit.profile import Profile
from sssfit.simulate import burley, half_space

posix = pytest.mark.skipif(os.name != "posix", reason="signals are POSIX")
COMMAND = [sys.executable, "-m", "sssfit.cli", "simulate"]
(MAPPINGS,) = (each.among for each in SIMULATIONS["burley"].settings)
COMPUTED = [name for name, each in SIMULATIONS.items() if name != "montecarlo" and not each.makes]
GRID = ("--dr", "0.25", "--radius", "5")
SLAB = "eta = 1.3\ng = 0\nsigma_a_per_mm = [0.1, 0.1, 0.1]\nsigma_s_per_mm = [9, 9, 9]\n"


@pytest.fixture(scope="module", autouse=True)
def compiled():
    """The solver is compiled before its words on stderr are looked at."""
    half_space.diffuse_reflectance([0.5], 1.3)


def names(folder):
    return sorted(path.name for path in folder.iterdir())


@pytest.fixture
def run(tmp_path, monkeypatch, capfd):
    """Run ``sssfit simulate`` here; give exit status, stdout and stderr."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments):
        with pytest.raises(SystemExit) as caught:
            main(["simulate", *arguments])
        out, err = capfd.readouterr()
        return caught.value.code, out, err

    return call


def test_the_table_of_methods_is_true():
    options = {each.name for each in cli.commands["simulate"].params}
    lines = cli.commands["simulate"].epilog.splitlines()
    for name, method in SIMULATIONS.items():
        assert callable(method.load())
        assert {each.name for each in method.settings} <= options
        assert any(line.split()[0] == name and method.summary in line for line in lines[2:])
    assert tuple(burley.MAPPINGS) == MAPPINGS


@pytest.mark.parametrize("method", COMPUTED)
def test_writes_what_the_library_computes_under_its_own_name(run, tmp_path, method):
    status, out, err = run("skin1", "--method", method, *GRID)
    assert (status, err) == (0, "")
    path = f"skin1.{method}.profile.npz"
    assert names(tmp_path) == [path]
    profile = Profile.load(tmp_path / path)
    assert profile.meta["method"] == method
    assert profile.photons is None
    name = f"simulate_{method.replace('-', '_')}"
    expected = getattr(simulate, name)(load_material("skin1"), dr_mm=0.25, radius_mm=5.0)
    np.testing.assert_allclose(profile.annulus_energy, expected.annulus_energy, rtol=1e-12)
    assert f"skin1: {method}" in out
    assert f"Wrote {path}" in out
    for c, channel in enumerate("RGB"):
        (line,) = [each for each in out.splitlines() if each.startswith(f"{channel} ")]
        assert line.split()[1] == f"{profile.diffuse_reflectance[c]:.6f}"


def test_exact_says_its_tolerance_its_error_and_that_energies_balance(run, tmp_path):
    _, out, _ = run("skin1", "--method", "exact", "--tolerance", "1%", *GRID)
    profile = Profile.load(tmp_path / "skin1.exact.profile.npz")
    assert profile.meta["settings"]["tolerance"] == 0.01
    assert f"to {100.0 * profile.meta['relative_error']:.1g} % of the total" in out
    assert "exact (half-space solver) " in out
    assert "est. error" in out
    assert f"{profile.diffuse_reflectance_stderr[0]:.1e}" in out
    assert f"{profile.absorbed.sum(axis=0)[0]:.6f}" in out
    balance = abs(profile.energy_balance).max()
    assert f"specular + diffuse + absorbed = 1 to {balance:.0e}" in out


def test_models_have_no_error_and_do_not_know_what_is_absorbed(run):
    _, out, _ = run("skin1", "--method", "dipole", *GRID)
    (line,) = [each for each in out.splitlines() if each.startswith("R ")]
    assert line.split()[2:4] == ["-", "-"]
    assert "energy:" not in out
    figures = json.loads(run("skin1", "--method", "dipole", *GRID, "--json")[1])
    for key in ("photons", "photons_per_second", "seed", "absorbed"):
        assert figures[key] is None
    assert figures["diffuse_reflectance_stderr"] == [None] * 3


@pytest.mark.parametrize("mapping", MAPPINGS)
def test_mappings_of_normalised_diffusion(run, tmp_path, mapping):
    _, out, _ = run("skin1", "--method", "burley", "--mapping", mapping, *GRID)
    assert f"burley ({mapping})" in out
    expected = burley.simulate_burley(
        load_material("skin1"), mapping=mapping, dr_mm=0.25, radius_mm=5.0
    )
    found = Profile.load(tmp_path / "skin1.burley.profile.npz")
    np.testing.assert_array_equal(found.annulus_energy, expected.annulus_energy)


def test_multipole_reports_what_a_slab_transmits(run, tmp_path):
    (tmp_path / "slab.toml").write_text(SLAB + "thickness_mm = 3\n")
    status, out, _ = run("slab.toml", "--method", "multipole", "--radius", "30")
    assert status == 0
    profile = Profile.load(tmp_path / "slab.multipole.profile.npz")
    (line,) = [each for each in out.splitlines() if each.startswith("R ")]
    assert line.split()[3:5] == [f"{profile.transmittance[0]:.6f}", "-"]


def test_profile_to_stdout(tmp_path):
    command = [*COMMAND, "skin1", "--method", "dipole", "-o", "-"]
    ended = fork_server.run(command, cwd=tmp_path, text=False)
    assert ended.returncode == 0
    profile = Profile.read(io.BytesIO(ended.stdout), "stdout")
    assert profile.meta["method"] == "dipole"
    assert b"Wrote the profile to stdout" in ended.stderr
    assert names(tmp_path) == []


@pytest.mark.parametrize("option", ["--all", "--paper"])
def test_all_materials_into_a_folder(run, tmp_path, option):
    (tmp_path / "out").mkdir()
    status, out, _ = run(option, "--method", "burley", *GRID, "-o", "out", "--json")
    assert status == 0
    figures = json.loads(out)
    made = [row["material"] for row in figures["rows"]]
    assert made == list(material_names(paper=option == "--paper"))
    assert names(tmp_path / "out") == sorted(Path(each).name for each in figures["output"])
    assert "skin1.burley.profile.npz" in names(tmp_path / "out")


# Of the paper's eleven ten have one index; three of them ask the same in a quarter of the time.
THREE = ("marble", "skin1", "skin2")


@pytest.mark.parametrize(
    "materials",
    [THREE, pytest.param(material_names(paper=True), marks=pytest.mark.slow)],
    ids=["three", "eleven"],
)
def test_exact_solves_materials_of_one_index_together(run, tmp_path, monkeypatch, materials):
    calls = []
    real = simulate.simulate_exact_many

    def counting(materials, **settings):
        calls.append([each.name for each in materials])
        return real(materials, **settings)

    monkeypatch.setattr("sssfit.simulate.runner.material_names", lambda **_: materials)
    monkeypatch.setattr(simulate, "simulate_exact_many", counting)
    assert run("--paper", "--method", "exact", "--tolerance", "1%", *GRID)[0] == 0
    assert ["marble"] in calls
    assert sorted(map(len, calls)) == [1, len(materials) - 1]
    assert len(names(tmp_path)) == len(materials)


def test_an_mcml_input_file_gives_material_and_grid(run, tmp_path):
    (tmp_path / "skin.mci").write_text(
        "1.0\n1\nskin.mco A\n1000\n0.1 0.02\n10 50 1\n1\n1.0\n1.3 0.32 7.4 0 1E8\n1.0\n"
    )
    status, out, err = run("skin.mci", "--method", "exact")
    assert (status, err) == (0, "")
    (written,) = tmp_path.glob("*.exact.profile.npz")
    profile = Profile.load(written)
    assert (profile.n_annuli, profile.photons) == (50, None)
    assert profile.r_edges_mm[1] == pytest.approx(0.2)  # 0.02 cm
    assert "exact" in out


@pytest.mark.parametrize(
    ("arguments", "status", "fragment"),
    [
        (("--method", "exact", "--photons", "1e5"), 2, "--photons is for --method montecarlo"),
        (("--method", "dipole", "--target-error", "1%"), 2, "--target-error is for --method mo"),
        (("--method", "exact", "--resume"), 2, "--resume is for --method montecarlo"),
        (("--method", "exact", "--checkpoint-every", "5"), 2, "--checkpoint-every is for --me"),
        (("--tolerance", "1%"), 2, "--tolerance is for --method exact, and this is montecarlo"),
        (("--method", "dipole", "--tolerance", "1%"), 2, "and this is dipole; leave it out"),
        (("--mapping", "diffuse"), 2, "--mapping is for --method burley"),
        (("--method", "exact", "--radius", "auto"), 2, "--radius auto is for --method montecarlo"),
        (("--method", "magic"), 2, "'magic' is not one of 'montecarlo', 'exact', 'dipole'"),
        (("--method", "exact", "--tolerance", "0"), 2, "'0' is not a share"),
        (("--method", "exact", "--tolerance", "200%"), 2, "'200%' is not a share"),
        (("--method", "burley", "--mapping", "x"), 2, "'x' is not one of 'perpendicular'"),
        (("--method", "exact", "--radius", "0"), 2, "'0' is not a length"),
        (("--method", "dipole", "--dr", "1e-6"), 1, "annuli"),
        (("--method", "dipole", "-o", "no/where.npz"), 1, "there is no folder"),
    ],
)
def test_bad_input_is_one_clear_line(run, tmp_path, arguments, status, fragment):
    code, out, err = run("skin1", *arguments)
    assert code == status
    assert out == ""
    assert fragment in err.splitlines()[-1]
    assert "Traceback" not in err
    if status == 1:
        assert err.count("\n") == 1
    assert names(tmp_path) == []


@pytest.mark.parametrize("method", ["dipole", "dipole-grosjean", "burley"])
def test_slabs_are_refused_with_the_methods_that_would_do(run, tmp_path, method):
    (tmp_path / "slab.toml").write_text(SLAB + "thickness_mm = 3\n")
    status, _, err = run("slab.toml", "--method", method)
    assert status == 1
    assert "multipole or montecarlo" in err
    assert err.count("\n") == 1
    assert names(tmp_path) == ["slab.toml"]


def test_similarity_is_used_where_it_is_asked_for_and_said(run, tmp_path):
    (tmp_path / "skin.toml").write_text(SLAB.replace("g = 0", "g = 0.8"))
    asked = ("skin.toml", "--method", "exact", "--tolerance", "1%", *GRID)
    status, out, err = run(*asked)
    assert (status, err) == (0, "")
    assert "exact (layer solver, " in out
    assert "isotropic" not in out
    status, out, err = run(*asked, "--similarity")
    assert (status, err) == (0, "")
    assert "exact (half-space solver)" in out
    assert "for isotropic scattering of (1 - g) sigma_s" in out


def test_slabs_are_solved(run, tmp_path):
    (tmp_path / "slab.toml").write_text(SLAB + "thickness_mm = 3\n")
    status, out, err = run("slab.toml", "--method", "exact", "--tolerance", "1%", *GRID)
    assert (status, err) == (0, "")
    assert "transmittance" in out
    (written,) = tmp_path.glob("*.npz")
    profile = Profile.load(written)
    assert profile.meta["settings"]["solver"] == "layer"
    assert (profile.transmittance_stderr > 0.0).all()


def test_a_foreign_file_is_not_replaced_without_force(run, tmp_path):
    path = tmp_path / "skin1.dipole.profile.npz"
    path.write_text("mine")
    assert run("skin1", "--method", "dipole", *GRID)[0] == 1
    assert path.read_text() == "mine"
    assert run("skin1", "--method", "dipole", *GRID, "--force")[0] == 0
    assert Profile.load(path).meta["method"] == "dipole"


def test_what_compiles_says_so_unless_quiet(run, monkeypatch):
    monkeypatch.setattr(simulate.half_space, "is_solver_compiled", lambda: False)
    asked = ("skin1", "--method", "exact", "--tolerance", "1%", *GRID)
    assert run(*asked)[2].startswith("Compiling the solver")
    assert run(*asked, "-q") == (0, "", "")
    assert "Compiling" not in run("skin1", "--method", "dipole", *GRID)[2]


def test_other_verbs_take_the_newest_profile_of_any_method(run, tmp_path, capfd):
    run("skin1", "--photons", "2000")
    old = time.time() - 60
    os.utime(tmp_path / "skin1.profile.npz", (old, old))
    run("skin1", "--method", "dipole", *GRID)
    for verb, made in (
        (["show"], None),
        (["export", "--format", "csv"], "skin1.dipole.csv"),
        (["chart"], "skin1.dipole.profile.png"),
    ):
        with pytest.raises(SystemExit) as ended:
            main(verb)
        assert ended.value.code == 0
        assert "Using skin1.dipole.profile.npz" in capfd.readouterr().err
        assert made is None or (tmp_path / made).exists()


@posix
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_what_was_done_before_a_signal_stays(run, tmp_path, monkeypatch, number):
    real, done = simulate.simulate_dipole, []

    def interrupted(material, **settings):
        done.append(material.name)
        if len(done) == 3:
            os.kill(os.getpid(), number)
        return real(material, **settings)

    monkeypatch.setattr(simulate, "simulate_dipole", interrupted)
    before = signal.getsignal(signal.SIGTERM)
    try:
        status, out, err = run("--paper", "--method", "dipole", *GRID, "--json")
    finally:
        signal.signal(signal.SIGTERM, before)
    assert status == 130
    assert "Interrupted. Not done: cream, ketchup" in err
    figures = json.loads(out)
    assert figures["interrupted"] is True
    assert [row["material"] for row in figures["rows"]] == done
    assert names(tmp_path) == [f"{name}.dipole.profile.npz" for name in done]


@posix
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_solver_leaves_nothing_behind(tmp_path, number):
    process = fork_server.start([*COMMAND, "--paper", "--method", "exact"], cwd=tmp_path)
    end = time.monotonic() + 60.0
    while not (tmp_path / ".wholemilk.exact.profile.npz.lock").exists():  # the last of them
        assert process.poll() is None
        assert time.monotonic() < end, "gave up waiting"
        time.sleep(0.02)
    process.send_signal(number)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert out == ""
    assert err.splitlines()[-1] == "Interrupted."
    assert names(tmp_path) == []
