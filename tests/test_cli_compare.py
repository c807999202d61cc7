"""``sssfit compare``: its table, files and refusals."""

import csv
import io
import json
import math
import os
from importlib import import_module

import numpy as np
import pytest

# Loaded here, they keep the real material_names, which tests below replace in its package.
import sssfit.export.summary
import sssfit.simulate.runner  # noqa: F401
from sssfit.cli import main
from sssfit.compare import pareto
from sssfit.compare.candidates import candidates, every_candidate
from sssfit.compare.table import is_table_file
from sssfit.errors import RenderError
from sssfit.formats.pictures import save_image
from sssfit.material import load_material
from sssfit.scene.load import load_scenes
from sssfit.scene.made import COMPARED, make_scene
from sssfit.simulate import half_space, simulate_dipole, simulate_exact

SMALL = ("--picture", "disk", "--size", "32x32", "--mm-per-pixel", "2.5")
SLAB = (
    "eta = 1.3\ng = 0\nsigma_a_per_mm = [0.3, 0.3, 0.3]\nsigma_s_per_mm = [0.3, 0.3, 0.3]\n"
    "thickness_mm = 2\n"
)


@pytest.fixture(scope="module", autouse=True)
def compiled():
    """The solver is compiled before its words on stderr are looked at."""
    half_space.diffuse_reflectance([0.5], 1.3)


@pytest.fixture(autouse=True)
def few(monkeypatch):
    """Few kernels, quickly fitted; the verb hands what to try to the library."""
    labels = ("pre-integrated", "svd 1", "svd 2", "svd 2, kept", "gaussians 1")
    some = [each for each in candidates(17) if each.label in labels]
    monkeypatch.setattr(pareto, "every_candidate", lambda pixels, only: some)  # noqa: ARG005
    return [each.label for each in some]


@pytest.fixture
def run(tmp_path, monkeypatch, capfd):
    """Run ``sssfit compare`` in an empty folder; give its stdout, or stderr for a status."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments, status=0):
        with pytest.raises(SystemExit) as caught:
            main(["compare", *arguments])
        out, err = capfd.readouterr()
        assert caught.value.code == status, err
        return err if status else out

    return call


def one_line(text):
    assert text.count("\n") == 1
    assert text.startswith("Error: ")
    return text


def test_rows_for_programs(run, tmp_path, few):
    found = json.loads(run("skin1", *SMALL, "--json"))
    assert found["command"] == "compare"
    assert found["output"] == []
    assert (found["material"], found["profile_method"]) == ("skin1", "exact")
    assert (found["mm_per_pixel"], found["channels"]) == (2.5, ["R", "G", "B"])
    assert found["pictures"][0] == {"name": "disk", "width": 32, "height": 32} | {
        "exposure": pytest.approx(found["pictures"][0]["exposure"])
    }
    assert [row["label"] for row in found["rows"]] == few
    row = found["rows"][0]
    assert row["taps"] is None
    assert len(row["energy_drift"]) == len(row["stop_reasons"]) == 3
    assert set(row["on_front"]) == {"delta-e", "p99", "l2"}
    assert set(row["on_front"]["l2"]) == {"fetches", "passes", "bytes", "seconds"}
    assert list(tmp_path.iterdir()) == []


def test_the_table_for_people_is_sorted_and_marks_the_front(run, few):
    text = run("skin1", *SMALL, "--error", "l2", "--cost", "passes")
    lines = text.splitlines()
    start = next(k for k, line in enumerate(lines) if line.startswith("  kernel"))
    rows = lines[start + 1 : lines.index("", start)]
    assert len(rows) == len(few)
    parts = [line[2:].split("  ") for line in rows]
    cells = [[each.strip() for each in line if each.strip()] for line in parts]
    key = [(int(each[2]), float(each[10].removesuffix(" %"))) for each in cells]
    assert key == sorted(key)
    starred = [k for (k, line) in zip(key, rows, strict=True) if line.startswith("* ")]
    assert starred
    assert starred == sorted(starred, key=lambda each: (each[0], -each[1]))
    assert starred[0] == key[0]


def test_chart_and_tables_are_written(run, tmp_path):
    for ending in (".md", ".csv", ".json"):
        drawn = ("c.png",) if ending == ".md" else ()  # a chart beside one of them will do
        charted = ("--chart", *drawn) if drawn else ()
        out = run("skin1", *SMALL, *charted, "--table", f"t{ending}")
        assert out.splitlines()[-1] == f"Wrote {', '.join((*drawn, f't{ending}'))}"
        assert is_table_file(tmp_path / f"t{ending}")
    assert (tmp_path / "c.png").read_bytes().startswith(b"\x89PNG")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["c.png", "t.csv", "t.json", "t.md"]
    rows = json.loads((tmp_path / "t.json").read_text())["rows"]
    mark, _, table = (tmp_path / "t.csv").read_text().partition("\n")
    assert mark == "# sssfit.table/1"
    lines = list(csv.DictReader(io.StringIO(table)))
    assert [line["label"] for line in lines] == [row["label"] for row in rows]
    for line, row in zip(lines, rows, strict=True):
        assert float(line["relative_l2"]) == row["relative_l2"]
        assert float(line["energy_drift_G"]) == row["energy_drift"][1]
        assert json.loads(line["settings"]) == row["settings"]
        assert bool(int(line["on_front_delta-e_passes"])) == row["on_front"]["delta-e"]["passes"]
    markdown = (tmp_path / "t.md").read_text()
    table = [line for line in markdown.splitlines() if line.startswith("|")]
    assert len(table) == 2 + len(rows)
    assert len({line.count("|") for line in table}) == 1
    assert sum(line.startswith("| **") for line in table) == sum(
        row["on_front"]["delta-e"]["fetches"] for row in rows
    )


def test_tables_of_taps_are_rows_of_a_csv_too(run, tmp_path, monkeypatch):
    """They have no reasons for stopping; their columns are empty."""
    some = every_candidate(17, ["preintegrated"])
    monkeypatch.setattr(pareto, "every_candidate", lambda pixels, only: some)  # noqa: ARG005
    run("skin1", *SMALL, "--table", "t.csv")
    table = (tmp_path / "t.csv").read_text().partition("\n")[2]
    lines = list(csv.DictReader(io.StringIO(table)))
    assert len({len(line) for line in lines}) == 1
    assert [line["taps"] for line in lines] == ["", "5", "11"]
    assert [line["stop_reasons_R"] == "" for line in lines] == [False, True, True]


def test_a_profile_stands_for_its_material(run, tmp_path):
    simulate_exact(load_material("skin1")).save(tmp_path / "p.profile.npz")
    ours, theirs = (
        json.loads(run(name, *SMALL, "--json"))["rows"] for name in ("p.profile.npz", "skin1")
    )
    assert [row["relative_l2"] for row in ours] == [row["relative_l2"] for row in theirs]


def test_the_skin_of_six_gaussians_can_be_compared(run):
    assert json.loads(run("deon-skin", *SMALL, "--json"))["profile_method"] == "gaussians"


def test_a_picture_brings_its_pixel_size(run, tmp_path):
    light = np.zeros((24, 24, 3))
    light[8:16, 8:16] = 1.0
    save_image(tmp_path / "mine.exr", light, mm_per_pixel=2.0)
    found = json.loads(run("skin1", "--picture", "mine.exr,disk", "--size", "32x32", "--json"))
    assert found["mm_per_pixel"] == 2.0
    assert [(each["name"], each["width"]) for each in found["pictures"]] == [
        ("mine.exr", 24),
        ("disk", 32),
    ]
    again = json.loads(run("skin1", "--picture", "mine.exr", "--mm-per-pixel", "3", "--json"))
    assert again["mm_per_pixel"] == 3.0


def test_layer_and_mask_of_a_file(run, tmp_path, monkeypatch):
    seen = []

    def stop(profile, scenes, **_):
        seen.append(scenes)
        raise RenderError("seen")

    monkeypatch.setattr("sssfit.compare.runner.compare_kernels", stop)
    pixels = np.random.default_rng(1).random((16, 16, 7))
    names = ["a.R", "a.G", "a.B", "b.R", "b.G", "b.B", "b.A"]
    pixels[:, :8, 6], pixels[:, 8:, 6] = 0.25, 1.0
    save_image(tmp_path / "mine.exr", pixels, channels=names, mm_per_pixel=2.0)
    given = ("skin1", "--what", "kernels", "--picture", "mine.exr,disk", "--size", "16x16")
    for options in (("--layer", "b"), ("--layer", "b", "--mask", "alpha")):
        run(*given, *options, status=1)
    (plain, disk), (masked, masked_disk) = seen
    np.testing.assert_allclose(plain.irradiance, pixels[..., 3:6], rtol=1e-6)
    assert plain.mask is None
    assert masked.mask.tolist() == [[0] * 8 + [1] * 8] * 16
    assert disk.mask is masked_disk.mask is None
    for option in (("--layer", "b"), ("--mask", "alpha")):
        words = run("skin1", "--picture", "disk", *option, status=2)
        assert f"{option[0]} is for pictures from files" in words


def test_a_picture_without_pixel_size_or_of_one_colour_is_refused(run, tmp_path):
    save_image(tmp_path / "flat.png", np.full((16, 16, 3), 0.5))
    line = one_line(run("skin1", "-q", "--picture", "flat.png", status=1))
    assert "does not say how large its pixels are; give --mm-per-pixel" in line
    line = one_line(run("skin1", "-q", "--picture", "flat.png", "--mm-per-pixel", "2", status=1))
    assert "flat.png is of one colour" in line


def test_pictures_that_do_not_agree_are_refused(run, tmp_path):
    light = np.zeros((24, 24, 1))
    light[8:16, 8:16] = 1.0
    for name, pitch in (("a.exr", 2.0), ("b.exr", 3.0)):
        save_image(tmp_path / name, light, mm_per_pixel=pitch)
    line = one_line(run("skin1", "--picture", "a.exr", "--picture", "b.exr", status=1))
    assert "b.exr has 3 mm per pixel and a.exr 2" in line
    assert "each once" in one_line(run("skin1", "--picture", "disk,disk", status=1))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((), "name one MATERIAL"),
        (("skin1", "--all"), "name one MATERIAL"),
        (("--paper", "--all"), "name one MATERIAL"),
        (("--all", "--chart", "c.png"), "leave --chart and --table out"),
        (("skin1", "-o", "folder"), "-o is the folder of --all"),
        (("--all", "--what", "sheet"), "--all is for --what front"),
        (("skin1", "--what", "sheet"), "name its file with --chart"),
        (("skin1", "--what", "sheet", "--chart", "c.png", "--picture", "disk"), "--picture is for"),
        (("skin1", "--what", "sheet", "--chart", "c.png", "--photons", "9"), "--photons is for"),
        (("skin1", "--what", "front", "--budget-chart", "c.png"), "is for --what budget; leave"),
        (("skin1", "--what", "kernels", "--model", "burley"), "--model is for --what budget"),
        (("skin1", "--what", "budget", "--table", "t.md"), "is for --what front or kernels; leave"),
        (("skin1", "--what", "budget", "--chart", "c.png"), "name its file with --budget-chart"),
        (("skin1", "--what", "pareto"), "'kernels', 'sheet', 'presets'.\n"),
        (("skin1", "--what", "front", "--method", "artist"), "--method is for"),
        (("skin1", "--what", "kernels", "--method", "svd"), "--method is for"),
        (("--all", "--method", "svd"), "--method is for"),
        (("skin1", "--what", "budget", "--cost", "bytes"), "--cost is for"),
        (("skin1", "--what", "budget", "--error", "delta-e"), "--error is for"),
        (("skin1", "--what", "presets", "--cost", "bytes"), "--cost is for"),
        (("skin1", "--what", "presets", "--error", "l2"), "--error is for"),
        (("skin1", "--what", "sheet", "--chart", "c.png", "--cost", "passes"), "--cost is for"),
        (("skin1", "--what", "editing"), "'editing' is not one of"),
        (("skin1", "--picture", "dsk"), "there is no picture 'dsk'"),
        (("skin1", "--cost", "money"), "'money' is not one of"),
        (("skin1", "--mm-per-pixel", "0"), "is not a length above 0"),
    ],
)
def test_wrong_usage(run, arguments, words):
    assert words in run(*arguments, status=2)


def test_size_without_made_pictures_is_wrong_usage(run, tmp_path):
    save_image(tmp_path / "mine.exr", np.eye(16)[:, :, None], mm_per_pixel=2.0)
    assert "--size is for made" in run("skin1", "--picture", "mine.exr", "--size", "9x9", status=2)


def test_a_slab_is_compared_with_its_exact_profile(run, tmp_path):
    (tmp_path / "slab.toml").write_text(SLAB)
    told = run("slab.toml", *SMALL)
    assert "slab, exact: " in told
    assert "Take " in told


def test_it_ends_with_a_verdict_of_two_lines(run, few):
    given = (*SMALL, "--picture", "edge,points")
    figures = json.loads(run("skin1", *given, "--json"))
    first, second = run("skin1", *given).splitlines()[-2:]
    by_label = {}
    for row in figures["rows"]:
        by_label.setdefault(row["label"], []).append(row)
    typical = {
        label: math.prod(row["delta_e_2000_mean"] for row in rows) ** (1 / 3)
        for label, rows in by_label.items()
    }
    weights = {label: rows[0]["fetches"] for label, rows in by_label.items()}
    front = [
        label
        for label in by_label
        if not any(
            weights[other] <= weights[label] and typical[other] < typical[label]
            for other in by_label
        )
    ]
    front.sort(key=weights.get)
    assert [each["label"] for each in figures["verdict"]] == front
    assert len(front) >= 2
    assert first.startswith(
        f"Take {front[0]} for {weights[front[0]]:g} fetches a pixel, {front[1]}"
    )
    for place, label in (("the cheapest", front[0]), ("the closest", front[-1])):
        worst = max(by_label[label], key=lambda row: row["delta_e_2000_mean"])
        error = f"{worst['delta_e_2000_mean']:.3g} ({worst['picture']})"
        assert f"{place}, {label} {error}" in second


def test_the_verdict_says_from_where_on_nothing_shows(run):
    given = ("--what", "kernels", "--size", "32x32")
    far, near = (
        run("skin1", *given, "--picture", picture, "--mm-per-pixel", pitch).splitlines()[-1]
        for picture, pitch in (("head", "12"), ("points", "1"))
    )
    assert far.endswith("on, 95 % of every picture are within a Delta E of 1.")
    assert near.endswith("none has 95 % of every picture within a Delta E of 1.")


def test_default_pictures_have_no_method_at_home_on_all():
    scenes = load_scenes(COMPARED, otherwise=0.3, size=(64, 64))
    assert [each.name for each in scenes] == ["disk", "edge", "points", "head"]
    tilted = make_scene("edge", height=64, width=64, mm_per_pixel=0.3, angle_degrees=30.0)
    np.testing.assert_array_equal(scenes[1].irradiance, tilted.irradiance)


@pytest.mark.parametrize("seed", [1, 5])
def test_noise_has_the_seed_that_was_asked_for(seed):
    (scene,) = load_scenes(["noise"], 0.3, size=(16, 16), seed=seed)
    wanted = make_scene("noise", height=16, width=16, mm_per_pixel=0.3, seed=seed)
    np.testing.assert_array_equal(scene.irradiance, wanted.irradiance)


def test_profiles_without_a_colour_need_the_other_error(run, tmp_path):
    from reference_pixels import make_profile

    make_profile([0.0, 3.0, 9.0], [[0.3, 0.2], [0.1, 0.1]]).save(tmp_path / "two.profile.npz")
    line = one_line(run("two.profile.npz", *SMALL, status=1))
    assert "Delta E of 2 channels" in line
    rows = json.loads(run("two.profile.npz", *SMALL, "--error", "l2", "--json"))["rows"]
    assert {row["delta_e_2000_mean"] for row in rows} == {None}


def test_a_material_that_cannot_be_fitted_is_one_line(run, tmp_path):
    from reference_pixels import make_profile

    make_profile([0.0, 3.0, 9.0], np.zeros((2, 3))).save(tmp_path / "black.profile.npz")
    assert "nothing to fit" in one_line(run("black.profile.npz", *SMALL, status=1))


def test_foreign_files_stay(run, tmp_path):
    for name in ("c.png", "t.md", "t.csv", "t.json"):
        (tmp_path / name).write_text("# mine\n")
        option = "--chart" if name == "c.png" else "--table"
        line = one_line(run("skin1", *SMALL, option, name, status=1))
        assert "exists and was not written by sssfit" in line
        assert (tmp_path / name).read_text() == "# mine\n"
    run("skin1", *SMALL, "--table", "t.md", "--force")
    run("skin1", *SMALL, "--table", "t.md")
    assert "end it in .md" in one_line(run("skin1", *SMALL, "--table", "t.txt", status=1))
    assert "end it in .png" in one_line(run("skin1", *SMALL, "--chart", "t.gif", status=1))


@pytest.mark.skipif(os.name != "posix", reason="bytes of a pipe")
def test_a_chart_may_go_to_stdout(tmp_path, monkeypatch, capfdbinary):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit):
        main(["compare", "skin1", *SMALL, "--chart", "-"])
    out, err = capfdbinary.readouterr()
    assert out.startswith(b"\x89PNG")
    assert b"pre-integrated" in err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("which", ["--all", "--paper"])
def test_all_goes_on_after_a_material_that_fails(run, tmp_path, monkeypatch, which):
    from sssfit import material

    verb = import_module("sssfit.cli.compare")
    real = verb.load_source
    film = 'channels = ["R"]\neta = 1.4\ng = 0.99\nsigma_a_per_mm = [0.1]\n'
    film += "sigma_s_per_mm = [30]\nthickness_mm = 0.003\n"
    (tmp_path / "marble.toml").write_text(film)
    # In place of the shipped marble, a film that has too few directions.
    paths = {"marble": "marble.toml"}
    monkeypatch.setattr(verb, "load_source", lambda name: real(paths.get(name, name)))
    monkeypatch.setattr(material, "material_names", lambda **_: ("marble", "skin1"))
    (tmp_path / "out").mkdir()
    err = run(which, "-o", "out", *SMALL, status=1)
    assert "1 of 2 materials failed; marble: marble R (a thin slab of g = 0.99" in err
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "skin1-pareto.md",
        "skin1-pareto.png",
    ]


def test_all_prints_the_fronts(run, tmp_path, monkeypatch):
    from sssfit import material

    monkeypatch.setattr(material, "material_names", lambda **_: ("skin1", "marble"))
    lines = run("--all", *SMALL).splitlines()
    assert [line.split()[0] for line in lines[1:3]] == ["skin1", "marble"]
    names = [f"{name}-pareto.{end}" for name in ("skin1", "marble") for end in ("png", "md")]
    assert lines[-1] == f"Wrote {', '.join(names)}"
    found = json.loads(run("--all", *SMALL, "--json"))
    assert {row["material"] for row in found["rows"]} == {"skin1", "marble"}
    assert found["output"] == names


def test_the_front_of_one_material_is_its_line_of_all(run, tmp_path, monkeypatch):
    from sssfit import material

    monkeypatch.setattr(material, "material_names", lambda **_: ("skin1",))
    one = run(
        "skin1", "--what", "front", *SMALL, "--chart", "c.png", "--table", "t.md"
    ).splitlines()
    every = run("--all", *SMALL).splitlines()
    assert one[:-1] == every[:-1]
    assert one[-1] == "Wrote c.png, t.md"
    assert (tmp_path / "c.png").read_bytes() == (tmp_path / "skin1-pareto.png").read_bytes()
    assert "Wrote" not in run("skin1", "--what", "front", *SMALL)


@pytest.mark.parametrize("what", ["kernels", "front"])
def test_pictures_on_the_pixels_of_the_profile(run, tmp_path, what):
    coarse = simulate_dipole(load_material("skin1"), dr_mm=2.5, radius_mm=40.0)
    coarse.save(tmp_path / "p.profile.npz")
    given = ("--what", what, "--picture", "disk", "--size", "32x32", "--json")
    own, asked = (
        json.loads(run("p.profile.npz", *given, "--mm-per-pixel", pitch))
        for pitch in ("profile", "2.5")
    )
    for key in ("rows", "materials") if what == "front" else ("mm_per_pixel", "pixels", "pictures"):
        if key == "rows":
            pairs = zip(own[key], asked[key], strict=True)
            assert all(a["relative_l2"] == b["relative_l2"] for a, b in pairs)
        else:
            assert own[key] == asked[key]
    words = run("--all", *given[2:], "--mm-per-pixel", "profile", status=2)
    assert "share their pixels" in words
