"""``sssfit show`` and ``sssfit chart`` as a user meets them: files, pipes, --json, refusals."""

import json
import re
import subprocess
import sys

import numpy as np
import pytest

from sssfit import __version__
from sssfit._profile_radii import energy_radii_mm
from sssfit.material import load_material
from sssfit.profile import Profile
from sssfit.simulate import simulate_montecarlo


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
    return subprocess.run(
        [sys.executable, "-m", "sssfit.cli", *args],
        cwd=folder,
        input=given,
        capture_output=True,
        timeout=60,
    )


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
            "albedo": f"{sigma_s / (sigma_a + sigma_s):.5f}",
            "MFP, mm": f"{1.0 / (sigma_a + sigma_s):.4f}",
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
    radii_mm = energy_radii_mm(profile, shares)
    for channel in range(3):
        reached = profile.cumulative_at(radii_mm[:, channel])[:, channel]
        np.testing.assert_allclose(reached, shares * profile.total_on_grid[channel], rtol=1e-5)


def test_radii_of_a_channel_without_energy_are_unknown(foreign):
    radii_mm = energy_radii_mm(foreign, [0.5])
    np.testing.assert_allclose(radii_mm, [[1.0]], rtol=1e-6)
    dark = Profile(
        **{name: getattr(foreign, name) for name in foreign.__slots__}
        | {"annulus_energy": [[0.0], [0.0]]}
    )
    assert np.isnan(energy_radii_mm(dark, [0.5])).all()
