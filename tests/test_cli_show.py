"""``sssfit show`` and ``sssfit chart`` as a user meets them: files, pipes, --json, refusals."""

import contextlib
import dataclasses
import io
import itertools
import json
import re
import subprocess
import sys
from unittest import mock

import numpy as np
import pytest

from sssfit import __version__
from sssfit.chart import page
from sssfit.cli import main
from sssfit.fit import fit_gaussians, fit_svd
from sssfit.material import Layer, Material, load_material
from sssfit.methods import VIEWS
from sssfit.profile import Profile
from sssfit.simulate import Checkpoint, simulate_montecarlo, simulate_montecarlo_many


@pytest.fixture(autouse=True)
def no_layout(monkeypatch):
    """Leave panels where they are: half of a chart's time, and nothing here looks at them."""
    monkeypatch.setattr(page, "lay_out", lambda figure: figure.set_layout_engine(None))


@pytest.fixture(scope="module")
def profile():
    return simulate_montecarlo(load_material("skin1"), photons=20_000)


@pytest.fixture(scope="module")
def foreign():
    """A profile of somebody else's: no photons, no material, no errors."""
    return Profile(
        r_edges_mm=[0.0, 1.0, 3.0],
        annulus_energy=[[0.25], [0.25]],
        annulus_energy_stderr=[[np.nan], [np.nan]],
        beyond_grid=[0.0],
        beyond_grid_stderr=[np.nan],
        specular_reflectance=0.0,
        absorbed=[[0.5]],
        unfinished=[0.0],
        annulus_transmittance=None,
        meta={"format": "sssfit.profile/1", "channels": ["Y"]},
    )


@pytest.fixture
def folder(tmp_path, profile):
    profile.save(tmp_path / "skin1.profile.npz")
    return tmp_path


def sssfit(folder, *args, given=b""):
    """Run it in this process, in a folder and with bytes on stdin; what it printed are bytes."""
    stdin, stdout, stderr = (
        io.TextIOWrapper(io.BytesIO(each), encoding="utf-8", write_through=True)
        for each in (given, b"", b"")
    )
    with (
        contextlib.chdir(folder),
        mock.patch.multiple(sys, stdin=stdin, stdout=stdout, stderr=stderr),
        pytest.raises(SystemExit) as ended,
    ):
        main(args)
    out, err = (each.buffer.getvalue() for each in (stdout, stderr))
    return subprocess.CompletedProcess(args, ended.value.code, out, err)


def tables(text):
    """The tables of a page, by the second word of their head: a dict of cells a channel."""
    found = {}
    for block in text.split("\n\n"):
        head, *rows = [re.split(r"  +", line.strip()) for line in block.splitlines()]
        if head[0] == "channel":
            found[head[1]] = {row[0]: dict(zip(head[1:], row[1:], strict=True)) for row in rows}
    return found


def linear_radius_mm(profile, channel, share):
    """Radius within which a share of a channel's light on the grid leaves, F straight in annuli."""
    grown = np.cumsum(profile.annulus_energy[:, channel])
    return np.interp(share * grown[-1], np.append(0.0, grown), profile.r_edges_mm)


def test_show_prints_what_the_profile_holds(folder, profile):
    """Every cell against the profile's arrays and Jensen et al.'s coefficients."""
    run = sssfit(folder, "show")
    assert run.returncode == 0, run.stderr
    assert b"Using skin1.profile.npz" in run.stderr
    text = run.stdout.decode()
    assert text.splitlines()[:4] == [
        "skin1.profile.npz: diffuse reflectance profile (sssfit.profile/1)",
        "material  skin1 (Jensen et al. 2001)",
        f"method    montecarlo, 20,000 photons, seed 1, sssfit {__version__}",
        "grid      1236 annuli of 0.03356 mm, to 41.48 mm",
    ]
    assert max(map(len, text.splitlines())) <= 110
    page = tables(text)
    coefficients = {"R": (0.032, 0.74), "G": (0.17, 0.88), "B": (0.48, 1.01)}
    for c, name in enumerate("RGB"):
        sigma_a, sigma_s = coefficients[name]
        assert page["eta"][name] == {
            "eta": "1.3",
            "g": "0",
            "sigma_a, 1/mm": f"{sigma_a:.5g}",
            "sigma_s, 1/mm": f"{sigma_s:.5g}",
            "single-scattering albedo": f"{sigma_s / (sigma_a + sigma_s):.5f}",
            "transport MFP, mm": f"{1.0 / (sigma_a + sigma_s):.4f}",
            "thickness, mm": "infinite",
        }
        beyond, absorbed = profile.beyond_grid[c], profile.absorbed[0, c]
        diffuse = profile.annulus_energy[:, c].sum() + beyond
        energies = page["diffuse R"][name]
        balance = energies.pop("sum - 1")
        stderr = float(energies.pop("+- stderr"))
        assert energies == {
            "diffuse R": f"{diffuse:.6f}",
            "beyond grid": f"{beyond:.2e}",
            "of diffuse": f"{100.0 * beyond / diffuse:.3f} %",
            "absorbed": f"{absorbed:.6f}",
            "unfinished": "0.0e+00",
        }
        # A photon brings at most what entered: its variance is at most that of all or nothing.
        entered = 1.0 - profile.specular_reflectance
        assert 0.2 < stderr / np.sqrt(diffuse * (entered - diffuse) / 20_000) <= 1.0
        off = 0.3**2 / 2.3**2 + diffuse + absorbed - 1.0
        # One digit of a sum of ones: its last bit is 2e-16, and these are sums of thousands.
        assert float(balance.split(" +- ")[0]) == pytest.approx(off, rel=0.5, abs=1e-13)
        radii = page["50 % within, mm"][name]
        assert radii.pop("empty") == str(np.sum(profile.annulus_energy[:, c] == 0.0))
        for share in (50, 90, 99):
            printed = float(radii.pop(f"{share} % within, mm"))
            assert printed == pytest.approx(linear_radius_mm(profile, c, share / 100), abs=0.02)
        assert radii == {}
    assert f"specular reflectance {(0.3 / 2.3) ** 2:.6f}, not part of diffuse R" in text
    assert "empty: annuli in which nothing was seen" in text


def test_show_json_has_the_same_figures(folder, profile):
    run = sssfit(folder, "show", "skin1.profile.npz", "--json")
    figures = json.loads(run.stdout)
    assert figures["command"] == "show"
    assert figures["output"] == []
    assert figures["channels"] == ["R", "G", "B"]
    assert (figures["photons"], figures["seed"]) == (20_000, 1)
    assert figures["diffuse_reflectance"] == profile.diffuse_reflectance.tolist()
    assert figures["beyond_grid"] == profile.beyond_grid.tolist()
    assert figures["material"]["layers"][0]["sigma_s_per_mm"] == [0.74, 0.88, 1.01]
    empty = (profile.annulus_energy == 0).sum(axis=0)
    assert figures["empty_annuli"] == empty.tolist()
    assert figures["radius_of_50_percent_mm"][0] == pytest.approx(1.91, abs=0.1)


def test_show_reads_a_pipe(folder):
    content = (folder / "skin1.profile.npz").read_bytes()
    piped = json.loads(sssfit(folder, "show", "-", "--json", given=content).stdout)
    named = json.loads(sssfit(folder, "show", "skin1.profile.npz", "--json").stdout)
    assert piped.pop("file") == "-"
    assert named.pop("file") == "skin1.profile.npz"
    assert piped == named


def test_show_and_chart_take_a_profile_without_photons_or_material(tmp_path, foreign):
    foreign.save(tmp_path / "foreign.profile.npz")
    shown = sssfit(tmp_path, "show", "foreign.profile.npz")
    assert shown.returncode == 0, shown.stderr
    for words in (b"unknown material", b"no photons", b"varying width", b"0.500000          -"):
        assert words in shown.stdout
    assert b"empty" not in shown.stdout
    figures = json.loads(sssfit(tmp_path, "show", "--json").stdout)
    assert figures["material"] is None
    assert figures["diffuse_reflectance_stderr"] == [None]
    drawn = sssfit(tmp_path, "chart", "--json")
    assert json.loads(drawn.stdout)["material"] is None


@pytest.mark.parametrize("verb", ["show", "chart"])
def test_a_damaged_or_missing_file_is_one_line(folder, verb):
    (folder / "bad.profile.npz").write_bytes(b"PK\x03\x04 and no more")
    for name in ("bad.profile.npz", "none.profile.npz"):
        run = sssfit(folder, verb, name)
        assert run.returncode == 1
        assert run.stdout == b""
        assert run.stderr.count(b"\n") == 1
        assert name.encode() in run.stderr


def test_chart_draws_the_newest_profile_to_stdout(folder):
    run = sssfit(folder, "chart", "-o", "-", "--json")
    assert run.stdout.startswith(b"\x89PNG")
    said, figures = run.stderr.splitlines()
    assert said == b"Using skin1.profile.npz, the newest *.profile.npz here."
    assert json.loads(figures) == {
        "command": "chart",
        "output": ["-"],
        "kind": "profile",
        "file": "skin1.profile.npz",
        "profile": "skin1.profile.npz",
        "material": "skin1",
        "channels": ["R", "G", "B"],
    }


def test_chart_reads_a_pipe_and_replaces_a_chart_of_the_same_name(folder):
    (folder / "skin1.profile.png").write_bytes(b"\x89PNG\r\n\x1a\n and an old picture")
    content = (folder / "skin1.profile.npz").read_bytes()
    assert sssfit(folder, "chart", "-", given=content).returncode == 1  # not a chart of ours
    ours = sssfit(
        folder, "chart", "--spectrum", "skin1.profile.npz", "-o", "skin1.profile.png", "--force"
    )
    assert ours.returncode == 0
    run = sssfit(folder, "chart", "-", given=content)
    assert run.stdout == b"Wrote skin1.profile.png\n", run.stderr
    assert (folder / "skin1.profile.png").stat().st_size > 50_000
    assert len(list(folder.iterdir())) == 2  # no lock, no temporary file stays


def test_chart_refuses_foreign_files_and_endings(folder):
    (folder / "notes.svg").write_text("mine")
    run = sssfit(folder, "chart", "skin1.profile.npz", "-o", "notes.svg")
    assert run.returncode == 1
    assert (folder / "notes.svg").read_text() == "mine"
    assert sssfit(folder, "chart", "-o", "notes.svg", "--force").returncode == 0
    assert (folder / "notes.svg").read_bytes().startswith(b"<?xml")
    run = sssfit(folder, "chart", "skin1.profile.npz", "-o", "skin1.jpg")
    assert run.returncode == 1
    assert run.stderr.count(b"\n") == 1
    assert b"skin1.jpg: charts are PNG, SVG or PDF" in run.stderr


def test_radii_invert_the_cumulative_reflectance(profile):
    shares = np.array([0.1, 0.5, 0.9, 1.0])
    radii_mm = profile.energy_radii_mm(shares)
    for channel in range(3):
        reached = profile.cumulative_at(radii_mm[:, channel])[:, channel]
        np.testing.assert_allclose(reached, shares * profile.total_on_grid[channel], rtol=1e-5)


def test_radii_of_a_channel_without_energy_are_unknown(foreign):
    radii_mm = foreign.energy_radii_mm([0.5])
    np.testing.assert_allclose(radii_mm, [[1.0]], rtol=1e-6)
    dark = Profile(
        **{name: getattr(foreign, name) for name in foreign.__slots__}
        | {"annulus_energy": [[0.0], [0.0]]}
    )
    assert np.isnan(dark.energy_radii_mm([0.5])).all()


# Files of every kind


@pytest.fixture(scope="module")
def kernel(profile):
    """Of unit energy but for the signs, of which every channel has another one negative."""
    fitted = fit_svd(profile, rank=3, mm_per_pixel=0.5, normalize=True).kernel
    return dataclasses.replace(fitted, signs=1.0 - 2.0 * np.eye(3)[::-1])


@pytest.fixture
def run(tmp_path, monkeypatch, capfd):
    """Run the command line here, in process; give exit status, stdout and stderr."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments, given=None):
        if given is not None:
            stdin = io.TextIOWrapper(io.BytesIO(given))
            monkeypatch.setattr("sys.stdin", stdin)
        with pytest.raises(SystemExit) as caught:
            main(list(arguments))
        out, err = capfd.readouterr()
        return caught.value.code or 0, out, err

    return call


def leave_checkpoint(path, *materials):
    """Stop a walk after two batches; return the profiles that it ended with."""
    asked = itertools.count()
    return simulate_montecarlo_many(
        materials,
        photons=10**9,
        threads=1,
        stop=lambda: next(asked) >= 2,
        checkpoint=Checkpoint(path),
    )


def percent(share, digits):
    """A share as people read it; what is but rounding is 0."""
    return "0 %" if abs(share) < 1e-9 else f"{100.0 * share:{digits}} %"


def test_show_prints_what_a_kernel_holds(run, tmp_path, profile, kernel):
    """Every cell against the kernel's arrays."""
    kernel.save(tmp_path / "k.json")
    status, out, err = run("show", "k.json")
    assert (status, err) == (0, "")
    assert out.splitlines()[:5] == [
        "k.json: separable kernel (sssfit.kernel/1)",
        "material  skin1",
        f"profile   montecarlo, 20,000 photons, seed 1, sha256 {profile.sha256[:16]}",
        f"fit       svd, 3 terms, rank 3, energy rescale, normalize true, sssfit {__version__}",
        f"pixels    {kernel.pixels} x {kernel.pixels} of 0.5 mm, the outermost "
        f"{kernel.pixels // 2 * 0.5:.6g} mm from the axis",
    ]
    blocks = [block.splitlines() for block in out.split("\n\n")]
    channels, terms, found = blocks[1:]
    middle = kernel.pixels // 2
    for c, name in enumerate("RGB"):
        full = kernel.full(c)
        assert re.split(r"  +", channels[1 + c]) == [
            name,
            f"{full.sum():.6f}",
            f"{kernel.scale[c]:.6g}",
            percent(kernel.relative_frobenius_error[c], ".3g"),
            percent(kernel.energy_error[c], "+.2g"),
        ]
        for t in range(3):
            weights, sign = kernel.weights[t, :, c], kernel.signs[t, c]
            assert terms[1 + 3 * c + t].split() == [
                name,
                str(t + 1),
                "+" if sign > 0 else "-",
                f"{sign * weights.sum() ** 2:.6f}",
                f"{weights[middle]:.6f}",
            ]
        eigenvalues = kernel.parameters[name]["eigenvalues"]
        written = ", ".join(f"{each:.6g}" for each in eigenvalues)
        assert f"{name}:  eigenvalues [{written}]" in found[1 + c]


def test_every_figure_of_a_kernel_is_in_json(run, tmp_path, profile, kernel):
    kernel.save(tmp_path / "k.json")
    figures = json.loads(run("show", "k.json", "--json")[1])
    assert (figures["command"], figures["kind"], figures["file"]) == ("show", "kernel", "k.json")
    assert (figures["format"], figures["method"], figures["rank"]) == ("sssfit.kernel/1", "svd", 3)
    assert (figures["pixels"], figures["mm_per_pixel"]) == (kernel.pixels, 0.5)
    assert figures["support_mm"] == kernel.pixels // 2 * 0.5
    assert (figures["material"], figures["profile_method"]) == ("skin1", "montecarlo")
    assert (figures["photons"], figures["seed"]) == (20_000, 1)
    assert (figures["version"], figures["profile_sha256"]) == (__version__, profile.sha256)
    assert figures["settings"] == dict(kernel.meta["settings"])
    for name in ("energy", "scale", "relative_frobenius_error", "energy_error"):
        assert figures[name] == getattr(kernel, name).tolist()
    assert figures["sign"] == kernel.signs.tolist()
    sums = kernel.weights.sum(axis=1)
    np.testing.assert_allclose(figures["term_energy"], kernel.signs * sums**2, rtol=1e-14)
    assert (np.array(figures["term_energy"]) < 0).sum() == 3
    np.testing.assert_allclose(np.sum(figures["term_energy"], axis=0), figures["energy"])
    assert figures["middle_weight"] == kernel.weights[:, kernel.pixels // 2].tolist()
    assert figures["parameters"] == json.loads(json.dumps(dict(kernel.parameters)))


@pytest.mark.filterwarnings("ignore::sssfit.errors.SssfitWarning")
def test_show_prints_the_gaussians_that_a_fit_found(run, tmp_path, profile):
    kernel = fit_gaussians(profile, terms=2, mm_per_pixel=0.5).kernel
    kernel.save(tmp_path / "k.json")
    out = run("show", "k.json")[1]
    variances, weights = (kernel.parameters["G"][each] for each in ("variances_mm2", "weights"))
    assert (
        f"G:  variances_mm2 [{variances[0]:.6g}, {variances[1]:.6g}]"
        f"  weights [{weights[0]:.6g}, {weights[1]:.6g}]" in out
    )


def test_a_kernel_of_somebody_else_is_shown_without_what_it_lacks(run, tmp_path, kernel):
    content = kernel.to_dict() | {"meta": {}, "parameters": {}}
    content["errors"] = {"relative_frobenius": [None] * 3, "energy": [None] * 3}
    (tmp_path / "k.json").write_text(json.dumps(content))
    status, out, _ = run("show", "k.json")
    assert status == 0
    for words in ("unknown material", "profile   unknown, no photons", "sssfit version unknown"):
        assert words in out
    assert out.count("unknown") == 3 + 6
    assert "the fit found" not in out
    figures = json.loads(run("show", "k.json", "--json")[1])
    assert figures["material"] is figures["photons"] is None
    assert figures["energy_error"] == [None] * 3


def test_show_of_a_material_is_that_of_materials(run, tmp_path):
    (tmp_path / "mine.toml").write_text(load_material("skin1").to_toml())
    shown = run("show", "mine.toml")
    assert shown == run("materials", "mine.toml")
    assert shown[1] == run("show", "skin1")[1]
    figures = json.loads(run("show", "mine.toml", "--json")[1])
    listed = json.loads(run("materials", "mine.toml", "--json")[1])
    assert (figures.pop("command"), figures.pop("kind")) == ("show", "material")
    assert (figures.pop("file"), listed.pop("command")) == ("mine.toml", "materials")
    assert figures == listed


def test_show_of_a_checkpoint_has_the_profiles_so_far(run, tmp_path):
    materials = [load_material("skin1"), load_material("ketchup")]
    profiles = leave_checkpoint(tmp_path / "c", *materials)
    status, out, err = run("show", "c")
    assert (status, err) == (0, "")
    figures = json.loads(run("show", "c", "--json")[1])
    assert (figures["kind"], figures["photons"]) == ("checkpoint", profiles[0].photons)
    lines = out.splitlines()
    assert lines[0] == "c: checkpoint of a photon walk"
    assert lines[1] == (
        f"so far    {profiles[0].photons:,} photons, {figures['flights']:,} flights, "
        f"{figures['seconds']:.1f} s; `sssfit simulate --resume` continues from there"
    )
    error = profiles[0].meta["relative_error"]
    assert lines[2] == f"error     {100 * error:.3g} % of F(r), in the worst channel"
    assert figures["relative_error"] == error
    for k, profile in enumerate(profiles):
        profile.save(tmp_path / "p.npz")
        whole = run("show", "p.npz")[1]
        assert whole.partition("\n")[2] in out  # all below the line with the file's name
        ended = json.loads(run("show", "p.npz", "--json")[1])
        so_far = figures["profiles"][k]
        assert so_far.keys() == ended.keys() - {"command", "output", "file"}
        # Of its settings one thing differs: the photons that were asked for, or traced.
        assert so_far["settings"] | {"photons": 0} == ended["settings"] | {"photons": 0}
        assert all(so_far[key] == ended[key] for key in so_far.keys() - {"settings"})


def test_files_are_known_by_content_and_not_by_name(run, tmp_path, profile, kernel):
    kernel.save(tmp_path / "a.profile.npz")
    profile.save(tmp_path / "a.toml")
    leave_checkpoint(tmp_path / "a.kernel.json", load_material("skin1"))
    text = load_material("skin1").to_toml()
    (tmp_path / "a.checkpoint").write_bytes(text.encode("utf-16"))
    kinds = {"a.profile.npz": "kernel", "a.toml": "profile", "a.kernel.json": "checkpoint"}
    for name, kind in (kinds | {"a.checkpoint": "material"}).items():
        named = json.loads(run("show", name, "--json")[1])
        assert named["kind"] == kind
        content = (tmp_path / name).read_bytes()
        piped = json.loads(run("show", "-", "--json", given=content)[1])
        assert (named.pop("file"), piped.pop("file")) == (name, "-")
        assert named == piped


def foreign_files():
    """What is somebody else's, by name."""
    archive = io.BytesIO()
    np.savez(archive, a=np.zeros(3))
    return {
        "picture.png": b"\x89PNG\r\n\x1a\n" + bytes(99),
        "picture.profile.npz": b"\x89PNG\r\n\x1a\n" + bytes(99),
        "notes.txt": b"some notes on skin\n",
        "scene.json": b'{"asset": {"version": "2.0"}}',
        "list.kernel.json": b"[1, 2]",
        "other.npz": archive.getvalue(),
        "pyproject.toml": b'[project]\nname = "other"\n',
        "empty.toml": b"",
        "cut.profile.npz": b"PK\x03\x04 and no more",
        "some.checkpoint": bytes(range(256)),
    }


@pytest.mark.parametrize("name", foreign_files())
@pytest.mark.parametrize("verb", ["show", "chart"])
def test_foreign_files_are_called_foreign(run, tmp_path, verb, name):
    content = foreign_files()[name]
    (tmp_path / name).write_bytes(content)
    for said, given in ((name, None), ("stdin", content)):
        status, out, err = run(verb, name if given is None else "-", given=given)
        assert (status, out) == (1, "")
        assert err == (
            f"Error: {said} is not a sssfit file; expected a profile (.profile.npz), a kernel "
            "(.kernel.json), a table of taps (.taps.json), a material (.toml) or a walk's "
            "checkpoint (.checkpoint).\n"
        )


@pytest.mark.parametrize("verb", ["show", "chart"])
def test_files_of_ours_are_called_damaged_by_their_kind(run, tmp_path, profile, kernel, verb):
    leave_checkpoint(tmp_path / "c", load_material("skin1"))
    for name, whole in (("p", profile), ("k", kernel)):
        whole.save(tmp_path / name)
    (tmp_path / "m").write_text("eta = 1.3\ng = 0\nsigma_a_per_mm = [1, 2\n")
    for name, said in (
        ("p", "p is damaged; write it again"),
        ("k", "k: the kernel is damaged"),
        ("c", "c is a damaged checkpoint"),
        ("m", "m: not valid TOML"),
    ):
        content = (tmp_path / name).read_bytes()
        if name != "m":
            (tmp_path / name).write_bytes(content[: len(content) // 2])
        status, out, err = run(verb, name)
        assert (status, out) == (1, "")
        assert said in err
        assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("there.npz", "there.npz cannot be read: no such file or directory."),
        ("skn1", "skn1 cannot be read: no such file or directory. did you mean skin1?"),
        (".", ". is a folder; name a file in it."),
        ("/dev/null", "/dev/null is not an ordinary file; use - to read a pipe."),
    ],
)
def test_what_is_not_a_file_is_one_line(run, name, said):
    assert run("show", name) == (1, "", f"Error: {said}\n")
    drawn = said.replace("in it.", "in it, or the store of a sweep.")  # which is a folder
    assert run("chart", name) == (1, "", f"Error: {drawn}\n")


def test_a_chart_whose_page_fails_is_not_written(run, tmp_path, profile, monkeypatch):
    profile.save(tmp_path / "p.profile.npz")
    broken = dataclasses.replace(VIEWS["frequency"], page="sssfit.export.reports:no_page")
    monkeypatch.setitem(VIEWS, "frequency", broken)
    assert run("chart", "--frequency", "p.profile.npz")[0] != 0
    assert [each.name for each in tmp_path.iterdir()] == ["p.profile.npz"]


def test_chart_draws_materials_and_checkpoints(run, tmp_path):
    leave_checkpoint(
        tmp_path / "w.profile.npz.checkpoint", load_material("skin1"), load_material("ketchup")
    )
    slab = Material("slab", ("a",), (Layer(1.4, 0.0, [0.1], [1.0], 2.0),))
    (tmp_path / "slab.toml").write_text(slab.to_toml())
    for name, figures in {
        "slab.toml": {"kind": "material", "output": ["slab.material.png"], "channels": ["a"]},
        "skin1": {"kind": "material", "output": ["skin1.material.png"], "material": "skin1"},
        "w.profile.npz.checkpoint": {"kind": "checkpoint", "output": ["w.checkpoint.png"]},
    }.items():
        status, out, err = run("chart", name, "--json")
        assert status == 0, err
        found = json.loads(out)
        assert {key: found[key] for key in figures} == figures
        assert (found["file"], found["profile"]) == (name, None)
        assert (tmp_path / found["output"][0]).read_bytes().startswith(b"\x89PNG")
    assert err == "Drawing skin1, the first of the walk's 2 materials.\n"


def test_charts_of_stdin_are_named_by_what_came(run, tmp_path, kernel):
    stream = io.BytesIO()
    kernel.write(stream)
    status, out, _ = run("chart", "-", given=stream.getvalue())
    assert status == 0
    assert out.splitlines()[-1] == "Wrote skin1.svd.kernel.png"
