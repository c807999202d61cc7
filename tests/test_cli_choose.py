"""``sssfit choose``: what is printed and written, one line for what is wrong."""

import json
import re

import numpy as np
import pytest
from click.testing import CliRunner

from sssfit.cli import cli, main
from sssfit.errors import RenderError
from sssfit.formats.csv import parse_csv
from sssfit.formats.pictures import save_image
from sssfit.kernel import Taps
from sssfit.material import load_material
from sssfit.profile import Profile
from sssfit.scene.made import make_scene
from sssfit.simulate import simulate_exact

# A tolerance that short searches end within.
SMALL = ("--resolution", "128x128", "--distance", "0.14m", "--tolerance", "3")
EDGE = ("--resolution", "64x64", "--distance", "0.14m", "--tolerance", "3", "--irradiance", "edge")

pytestmark = pytest.mark.filterwarnings("ignore:Light may crawl")  # of tables with few fetches


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def ended(*arguments):
    result = CliRunner().invoke(cli, ["choose", *arguments])
    assert result.exit_code == 0, result.output
    return result


@pytest.fixture
def run_render():
    def call(*arguments):
        result = CliRunner().invoke(cli, ["render", *arguments])
        assert result.exit_code == 0, result.output
        return json.loads(result.stdout)

    return call


def failed(capsys, *arguments):
    """Exit status and the last line of stderr of the whole program."""
    with pytest.raises(SystemExit) as ending:
        main(["choose", *arguments])
    return ending.value.code, capsys.readouterr().err.splitlines()


def test_the_kernel_is_written_and_the_choice_explained():
    text = ended("skin1", *SMALL).stdout
    kernel = Taps.load("skin1.chosen.taps.json")
    lines = text.splitlines()
    assert lines[0] == (
        "skin1 at 0.14 m, 0.5861 mm per pixel, 95th percentile of Delta E within 3:"
    )
    cost = f"{kernel.fetches:.4g} fetches a pixel in {kernel.passes} passes"
    assert lines[1].startswith(f"cascade {kernel.structure}: {cost}, Delta E ")
    assert re.search(
        r"Delta E [\d.]+ \(95 % of pixels within [\d.]+, 99 % within [\d.]+; [\d.]+ % above 1\)",
        lines[1],
    )
    for word in (
        "cheaper is not enough: ",
        "dearer is not needed: ",
        "photons: ",
        "judged on head",
    ):
        assert any(line.startswith(word) for line in lines), word
    assert lines[-1] == "Wrote skin1.chosen.taps.json, skin1.chosen.profile.npz"


def test_the_profile_beside_the_kernel_is_the_truth(run_render):
    figures = json.loads(ended("skin1", *EDGE, "--json").stdout)
    profile = Profile.load("skin1.chosen.profile.npz")
    assert (profile.material_name, profile.meta["method"]) == ("skin1", "exact")
    # `render` finds it, and measures what the choice was made by.
    given = ("--irradiance", "edge", "--angle", "30", "--size", "64x64")
    rendered = run_render("skin1.chosen.taps.json", *given, "-o", "out.exr", "--json")
    assert rendered["profile"] == "skin1.chosen.profile.npz"
    again = ended("skin1.chosen.profile.npz", *EDGE, "--json").stdout
    rows = [json.loads(again)["rows"], figures["rows"]]
    assert rows[0] == rows[1]
    assert json.loads(again)["output"] == ["skin1.chosen.chosen.taps.json"]


def test_profiles_with_and_without_a_material_are_chosen_for():
    simulate_exact(load_material("skin1")).save("s.profile.npz")
    text = "r_mm,grey\n1,.1\n2,.1\n4,.1\n9,.05\n"
    parse_csv(text, "t.csv", quantity="energy").save("bare.profile.npz")
    for name in ("s.profile.npz", "bare.profile.npz"):
        found = json.loads(ended(name, *EDGE, "--json").stdout)
        assert found["output"] == [name.replace(".profile.npz", ".chosen.taps.json")]
        assert (found["photons"] is None) == name.startswith("bare")
    skin = json.loads(ended("deon-skin", *EDGE, "--json").stdout)
    assert (skin["profile_method"], skin["photons"]) == ("gaussians", None)
    assert skin["output"] == ["deon-skin.chosen.taps.json", "deon-skin.chosen.profile.npz"]


def test_a_foreign_file_in_the_profiles_place_is_not_replaced(folder, capsys):
    (folder / "skin1.chosen.profile.npz").write_text("notes")
    code, lines = failed(capsys, "skin1", *SMALL)
    assert (code, len(lines)) == (1, 1)
    assert sorted(each.name for each in folder.iterdir()) == ["skin1.chosen.profile.npz"]


@pytest.mark.filterwarnings("ignore:5 taps a pass")
def test_which_figure_the_tolerance_is_of():
    loose, tight = (
        json.loads(ended("skin1", *EDGE, "--tolerance-of", of, "--json").stdout)
        for of in ("mean", "p99")
    )
    assert (loose["tolerance_of"], tight["tolerance_of"]) == ("mean", "p99")
    assert loose["chosen"]["error"] == loose["chosen"]["delta_e_2000_mean"] <= 3.0
    assert tight["chosen"]["error"] == tight["chosen"]["delta_e_2000_p99"] <= 3.0
    assert loose["chosen"]["delta_e_2000_p99"] > 3.0
    assert loose["chosen"]["fetches"] < tight["chosen"]["fetches"]


@pytest.fixture
def asked(monkeypatch):
    """Run the verb up to the choice; give what the choice was asked for."""
    seen = {}

    def choose_kernel(source, **settings):
        seen.update(settings)
        raise RenderError("enough")

    def call(*arguments):
        assert CliRunner().invoke(cli, ["choose", *arguments]).exit_code == 1
        return seen

    monkeypatch.setattr("sssfit.choose.choice.choose", choose_kernel)
    return call


@pytest.mark.parametrize(
    ("frame", "rows", "columns"),
    [("96x64", 64, 96), ("700x300", 300, 512), ("300x700", 512, 300), ("900x800", 512, 512)],
)
def test_a_made_picture_is_the_middle_of_the_frame(asked, frame, rows, columns):
    seen = asked("skin1", "--resolution", frame, "--irradiance", "edge")
    assert (seen["scene"].height, seen["scene"].width) == (rows, columns)
    wanted = make_scene(
        "edge", height=rows, width=columns, mm_per_pixel=seen["mm_per_pixel"], angle_degrees=30.0
    )
    np.testing.assert_array_equal(seen["scene"].irradiance, wanted.irradiance)


@pytest.mark.parametrize("seed", [1, 4])
def test_the_seed_is_that_of_noise_and_of_walks(asked, seed):
    seen = asked("skin1", *SMALL, "--irradiance", "noise", "--seed", str(seed))
    wanted = make_scene(
        "noise", height=128, width=128, mm_per_pixel=seen["mm_per_pixel"], seed=seed
    )
    np.testing.assert_array_equal(seen["scene"].irradiance, wanted.irradiance)
    assert seen["seed"] == seed


def test_json_has_everything():
    figures = json.loads(ended("skin1", *SMALL, "--json", "-o", "mine.taps.json").stdout)
    assert figures["output"] == ["mine.taps.json", "mine.profile.npz"]
    kernel = Taps.load("mine.taps.json")
    chosen = figures["chosen"]
    assert (chosen["fetches"], chosen["passes"]) == (kernel.fetches, kernel.passes)
    assert figures["kernel"]["structure"] == kernel.structure
    assert (figures["most_fetches"], figures["most_passes"]) == (None, None)
    assert chosen["error"] == chosen["delta_e_2000_p95"] <= figures["tolerance"] == 3.0
    assert figures["tolerance_of"] == "p95"
    assert figures["cheaper"]["error"] > 3.0
    assert figures["kernel"]["method"] == kernel.method
    assert figures["photons"]["photons"] >= 10_000
    assert figures["rows"][0]["method"] is None
    assert figures["pictures"][0]["width"] == 128


def test_no_blur_writes_no_kernel(folder):
    figures = json.loads(ended("skin1", "--distance", "60m", "--json").stdout)
    assert (figures["kernel"], figures["output"], figures["rows"]) == (None, [], [])
    assert "under a pixel" in ended("skin1", "--distance", "60m").stdout
    far = ended("skin1", "--resolution", "64x64", "--distance", "2m").stdout
    assert "no blur is needed: irradiance times diffuse reflectance" in far
    assert not list(folder.iterdir())


def test_a_kernel_of_an_earlier_run_is_said_to_be_one():
    far = ("skin1", "--distance", "60m")
    assert ended(*far).stderr == ""
    ended("skin1", *EDGE)
    found = Taps.load("skin1.chosen.taps.json").to_dict()
    words = "skin1.chosen.taps.json is from an earlier run; this view needs no kernel."
    assert ended(*far).stderr.splitlines() == [words]
    assert ended(*far, "-q").stderr == ""
    assert Taps.load("skin1.chosen.taps.json").to_dict() == found
    assert words not in ended("skin1", *EDGE).stderr


def test_a_picture_of_ones_own_takes_the_pitch():
    pixels = np.zeros((40, 40, 3))
    pixels[:, 20:] = 0.8
    save_image("mine.exr", pixels)
    figures = json.loads(ended("skin1", *SMALL, "--irradiance", "mine.exr", "--json").stdout)
    assert figures["pictures"][0]["irradiance"] == "mine.exr"
    assert figures["pictures"][0]["mm_per_pixel"] == figures["mm_per_pixel"]


def test_layer_and_mask_of_a_file_change_what_is_judged(monkeypatch):
    from sssfit.choose import choice as module

    seen = []

    def stop(material, *, scene, **settings):
        seen.append(scene)
        raise RenderError("seen")

    monkeypatch.setattr(module, "choose", stop)
    pixels = np.random.default_rng(1).random((16, 16, 7))
    names = ["a.R", "a.G", "a.B", "b.R", "b.G", "b.B", "b.A"]
    pixels[:, :8, 6], pixels[:, 8:, 6] = 0.25, 1.0
    save_image("mine.exr", pixels, channels=names, mm_per_pixel=0.5)
    given = ("skin1", *SMALL, "--irradiance", "mine.exr", "--layer", "b")
    for options in ((), ("--mask", "alpha")):
        assert CliRunner().invoke(cli, ["choose", *given, *options]).exit_code == 1
    plain, masked = seen
    np.testing.assert_allclose(plain.irradiance, pixels[..., 3:6], rtol=1e-6)
    assert plain.mask is None
    assert masked.mask.tolist() == [[0] * 8 + [1] * 8] * 16
    np.testing.assert_allclose(masked.irradiance[:, 8:], pixels[:, 8:, 3:6], rtol=1e-6)


@pytest.mark.parametrize("option", [("--layer", "a"), ("--mask", "alpha")])
@pytest.mark.parametrize("picture", ["head", "disk"])
def test_options_of_files_are_not_for_made_pictures(capsys, option, picture):
    status, lines = failed(capsys, "skin1", *SMALL, "--irradiance", picture, *option)
    assert status == 2
    assert f"{option[0]} is for pictures from files" in lines[-1]


def test_the_kernel_goes_to_stdout_and_words_to_stderr():
    result = ended("skin1", *EDGE, "-o", "-", "-v")
    assert json.loads(result.stdout)["format"] == "sssfit.taps/1"
    assert "cheaper is not enough" in result.stderr
    assert "no blur: 0 fetches" in result.stderr


def test_budgets_are_printed_and_kept():
    text = ended("skin1", *EDGE[:4], "--irradiance", "edge", "--fetches", "14").stdout
    head = (
        "skin1 at 0.14 m, 1.172 mm per pixel, least 95th percentile of Delta E, at most 14 fetches:"
    )
    assert text.splitlines()[0] == head
    kernel = Taps.load("skin1.chosen.taps.json")
    assert 7 <= kernel.fetches <= 14
    assert not any(line.startswith(("photons", "cheaper is")) for line in text.splitlines())
    figures = json.loads(ended("skin1", *EDGE, "--passes", "4", "--fetches", "30", "--json").stdout)
    assert (figures["most_fetches"], figures["most_passes"]) == (30.0, 4)
    assert figures["chosen"]["passes"] <= 4
    assert figures["chosen"]["error"] <= 3.0


@pytest.mark.parametrize(
    ("arguments", "status", "word"),
    [
        (("skin1", "--distance", "0"), 2, "not a length above 0"),
        (("skin1", "--distance", "-1m"), 2, "not a length above 0"),
        (("skin1", "--distance", "1cm"), 2, "10 mm is nearer than 100 mm; move away."),
        (("skin1", "--distance", "1e-320"), 2, "9.99989e-321 mm is nearer than 100 mm; move away."),
        (("skin1", "--distance", "1"), 2, "a plain number is mm: did you mean 1m?"),
        (("skin1", "--distance", "0.6"), 2, "a plain number is mm: did you mean 0.6m?"),
        (("skin1", "--distance", "1e305m"), 1, "pixels of inf mm; expected a finite length"),
        (("skin1", "--fov", "1e-300"), 1, "make pixels of 9.7e-303 mm; expected 0.0005 mm"),
        (("skin1", "--resolution", "1x999999999"), 1, "make pixels of 3.22e-07 mm"),
        (("skin1", "--resolution", "1" * 5000 + "x9"), 2, "is not a size"),
        (("skin1", "--tolerance-of", "p50"), 2, "'p50' is not one of"),
        (("skin1", "--fov", "180"), 2, "180"),
        (("skin1", "--fov", "0"), 2, "0.0"),
        (("skin1", "--fov", "nan"), 2, "nan"),
        (("skin1", "--fetches", "5.9"), 1, "fetches = 5.9; expected a number from 6 up"),
        (("skin1", "--fetches", "nan"), 2, "nan"),
        (("skin1", "--passes", "0"), 2, "0"),
        (("skin1", "--fetches", "7", "--passes", "1"), 1, "allow more of either"),
        (("skin1", "--tolerance", "0"), 1, "tolerance = 0"),
        (("skin1", "--tolerance", "-1"), 1, "tolerance = -1"),
        (("skin1", "--tolerance", "nan"), 2, "nan"),
        (("skin1", "--resolution", "0x0"), 2, "not a size"),
        (("skin1", "--irradiance", "grey.exr"), 1, "of one colour"),
        (("skin1", "--irradiance", "other.exr"), 1, "5 mm per pixel"),
        (("no-such",), 1, "no-such"),
    ],
)
def test_bad_input_gets_one_line(capsys, arguments, status, word):
    save_image("grey.exr", np.full((8, 8, 3), 0.5))
    pixels = np.zeros((8, 8, 3))
    pixels[4:] = 1.0
    save_image("other.exr", pixels, mm_per_pixel=5.0)
    code, lines = failed(capsys, *arguments)
    assert code == status
    assert word in lines[-1]
    assert sum(line.startswith("Error") for line in lines) == 1


def test_a_foreign_file_is_not_replaced(folder, capsys):
    (folder / "skin1.chosen.taps.json").write_text("notes")
    code, lines = failed(capsys, "skin1", *SMALL)
    assert (code, len(lines)) == (1, 1)
    assert (folder / "skin1.chosen.taps.json").read_text() == "notes"
