"""``sssfit render``: pictures out, figures of what was lost, one line for what is wrong."""

import dataclasses
import json
import shutil
from pathlib import Path

import numpy as np
import OpenImageIO
import pytest
from reference_pixels import make_profile

from sssfit.cli import main
from sssfit.compare.judge import judge
from sssfit.fit import fit_svd
from sssfit.image import load_image, save_image
from sssfit.kernel import SeparableKernel
from sssfit.profile import Profile
from sssfit.render.reference import render_reference
from sssfit.render.scene import Scene
from sssfit.render.separable import render_separable

KERNEL = "wax.svd2.kernel.json"
SIZE = ("--size", "40x24")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A profile of three channels and a kernel of it."""
    folder = tmp_path_factory.mktemp("made")
    r = np.linspace(0.0, 4.0, 41)
    energy = np.diff(0.5 - 0.5 * np.exp(-r / 0.4))[:, None] * [1.0, 0.5, 0.2]
    make_profile(r, energy).save(folder / "wax.profile.npz")
    profile = Profile.load(folder / "wax.profile.npz")
    fit_svd(profile, rank=2, mm_per_pixel=0.2).kernel.save(folder / KERNEL)
    return folder


@pytest.fixture
def folder(made, tmp_path, monkeypatch):
    """A copy of these files as the current folder."""
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def run(folder, capfd):
    """Run the command line here; give exit status, stdout and stderr."""

    def call(*arguments):
        with pytest.raises(SystemExit) as ending:
            main([str(each) for each in arguments])
        return ending.value.code, *capfd.readouterr()

    return call


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_figures_are_those_of_the_pictures(run):
    files = ("-o", "out.exr", "--truth", "true.tif", "--difference", "lost.exr")
    status, out, _ = run("render", "--irradiance", "disk", *SIZE, *files, "--json")
    figures = json.loads(out)
    assert status == 0
    assert figures["output"] == ["out.exr", "true.tif", "lost.exr"]
    picture, truth, lost = (load_image(each).pixels for each in figures["output"])
    assert picture.shape == (24, 40, 3)
    assert lost == pytest.approx(np.abs(picture - truth), abs=1e-7)
    assert figures["rmse"] == pytest.approx(np.sqrt(np.mean((picture - truth) ** 2)), rel=1e-4)
    assert figures["maximum"] == pytest.approx(np.abs(picture - truth).max(), rel=1e-4)
    assert figures["passes"] == 4
    assert figures["taps_per_pixel"] == 4 * SeparableKernel.load(KERNEL).pixels
    assert figures["seconds_per_megapixel"] > 0.0
    assert 0.0 < figures["delta_e_2000_mean"] < figures["delta_e_2000_p99"]


def test_a_picture_of_ones_own(run):
    light = np.random.default_rng(3).random((12, 9, 3))
    save_image("mine.exr", light)
    status, out, _ = run(
        *("render", "--irradiance", "mine.exr", "--mm-per-pixel", ".2", "-o", "out.exr", "--json")
    )
    assert status == 0
    kernel, profile = SeparableKernel.load(KERNEL), Profile.load("wax.profile.npz")
    scene = Scene("mine", light.astype(np.float32), 0.2)
    wanted = render_separable(scene, kernel)
    assert load_image("out.exr").pixels == pytest.approx(wanted, abs=1e-7)
    truth = render_reference(scene, profile)
    rmse = np.sqrt(np.mean((wanted - truth) ** 2))
    assert json.loads(out)["rmse"] == pytest.approx(rmse, rel=1e-9)


def test_a_picture_that_was_rendered_knows_its_pixels(run):
    assert run("render", "--irradiance", "disk", *SIZE, "-o", "first.exr")[0] == 0
    assert run("render", KERNEL, "--irradiance", "first.exr", "-o", "twice.exr")[0] == 0


def test_8_bit_pictures_are_said_to_be_decoded(run, folder):
    save_image("mine.png", np.full((8, 8, 3), 0.5))
    status, _, words = run("render", "--irradiance", "mine.png", "--mm-per-pixel", ".2")
    assert status == 0
    assert "sRGB" in words
    assert "wax.svd2.mine.exr" in names(folder)


def test_without_its_profile_the_cost_is_all_that_is_measured(run):
    Path("wax.profile.npz").unlink()
    status, out, words = run("render", "--irradiance", "edge", *SIZE, "--json")
    assert status == 0
    assert json.loads(out)["rmse"] is None
    assert "--profile" in words
    status, _, words = run("render", "--irradiance", "edge", *SIZE, "--truth", "true.exr")
    assert status == 2
    assert "profile" in words


def test_a_profile_of_another_run_is_not_taken_for_the_kernels(run):
    profile = Profile.load("wax.profile.npz")
    profile.save("first.profile.npz")
    Path("wax.profile.npz").unlink()
    run("simulate", "skin1", "--method", "dipole", "-o", "last.profile.npz")
    _, out, _ = run("render", "--irradiance", "edge", *SIZE, "--json")
    assert json.loads(out)["profile"] == "first.profile.npz"


def test_screen_space_needs_depth_and_measures_nothing(run):
    status, out, _ = run("render", "--screen", "--size", "48x48", "--json")
    figures = json.loads(out)
    assert status == 0
    assert figures["rmse"] is None
    assert figures["follow"] == "gaussian"
    status, _, words = run("render", "--screen", "--irradiance", "disk", *SIZE)
    assert status == 1
    assert "depth" in words


def test_the_picture_goes_to_stdout(folder, capfdbinary):
    with pytest.raises(SystemExit) as ending:
        main(["render", "--irradiance", "edge", *SIZE, "-o", "-"])
    assert ending.value.code == 0
    out, words = capfdbinary.readouterr()
    (folder / "piped.exr").write_bytes(out)
    assert load_image("piped.exr").pixels.shape == (24, 40, 3)
    assert b"Delta E" in words


def test_two_channels_have_no_colour(run, made):
    profile = Profile.load(made / "wax.profile.npz")
    make_profile(profile.r_edges_mm, profile.annulus_energy[:, :2]).save("duo.profile.npz")
    run("fit", "duo.profile.npz", "--method", "svd", "--mm-per-pixel", ".2")
    status, out, _ = run("render", "duo.svd3.kernel.json", "--irradiance", "edge", *SIZE)
    assert status == 0
    assert "2 channels are no colour" in out
    arguments = ("render", "duo.svd3.kernel.json", "--profile", "wax.profile.npz")
    status, _, words = run(*arguments, "--irradiance", "edge", *SIZE)
    assert status == 1
    assert "fitted to" in words


@pytest.mark.parametrize(
    ("options", "status", "word"),
    [
        (("--irradiance", "none.exr"), 2, "highlights"),
        (("--irradiance", "disk", "--size", "0x5"), 2, "1920x1080"),
        (("--irradiance", "disk", "--size", "big"), 2, "1920x1080"),
        (("--irradiance", "disk", "--mm-per-pixel", ".2"), 2, "--mm-per-pixel"),
        (("--irradiance", "disk", "--angle", "3"), 2, "--angle"),
        (("--irradiance", "stripes", "--period", ".3"), 1, "period"),
        (("--irradiance", "disk", "-o", "out.jpg"), 1, ".exr"),
        (("--irradiance", "disk", "--truth", "a.exr", "-o", "a.exr"), 2, "same file"),
        (("--irradiance", "disk", "--follow", "lerp"), 2, "--screen"),
        (("--irradiance", "disk", "--screen", "--truth", "a.exr"), 2, "--screen"),
        (("--irradiance", "disk", "--exposure", "0"), 2, "--exposure"),
        (("--irradiance", "disk", "--size", "90000x90000"), 1, "GB"),
        (("--irradiance", "wax.profile.npz"), 1, "wax.profile.npz"),
        (("wax.profile.npz",), 1, "wax.profile.npz"),
        (("--irradiance", "disk", "-o", "wax.profile.npz"), 1, ".exr"),
    ],
)
def test_what_is_wrong_is_one_line_and_nothing_is_written(run, folder, options, status, word):
    before = names(folder)
    size = () if "--size" in options or "none.exr" in options else SIZE
    size = () if options[-1].endswith(".npz") and "-o" not in options else size
    ended, out, words = run("render", *options, *size)
    lines = [line for line in words.splitlines() if line.startswith("Error")]
    assert ended == status, words
    assert out == ""
    assert len(lines) == 1
    assert word in lines[0]
    assert names(folder) == before


@pytest.mark.parametrize(
    ("pixels", "word"),
    [(np.full((4, 4, 3), np.nan), "NaN"), (np.full((4, 4, 3), -1.0), "negative")],
)
def test_pictures_that_are_no_light_are_refused(run, pixels, word):
    spec = OpenImageIO.ImageSpec(4, 4, 3, "float")
    writer = OpenImageIO.ImageOutput.create("bad.exr")
    writer.open("bad.exr", spec)
    writer.write_image(pixels.astype(np.float32))
    writer.close()
    status, _, words = run("render", "--irradiance", "bad.exr", "--mm-per-pixel", ".2")
    assert status == 1
    assert word in words


def test_a_file_must_say_its_pixels(run):
    save_image("mine.png", np.full((8, 8, 3), 0.5))
    status, _, words = run("render", "--irradiance", "mine.png")
    assert status == 1
    assert "--mm-per-pixel" in words
    status, _, words = run("render", "--irradiance", "mine.png", "--mm-per-pixel", ".3")
    assert status == 1
    assert "fit the kernel at" in words


COVERED = np.repeat([[0.0, 0.25, 0.75, 1.0]], 10, axis=1).repeat(24, axis=0)


def lit(channels=3):
    """A picture of light with alpha; no two pixels alike."""
    return np.random.default_rng(1).random((24, 40, channels))


@pytest.mark.parametrize("ending", ["exr", "tif", "png"])
def test_alpha_of_a_file_goes_into_the_result_and_the_truth(run, folder, ending):
    save_image("mine.png", lit(), alpha=COVERED)
    kernel = SeparableKernel.load(KERNEL)
    light = load_image("mine.png").pixels
    plain = render_separable(Scene("mine", light, 0.2), kernel)
    files = ("-o", f"out.{ending}", "--truth", f"true.{ending}", "--difference", "lost.exr")
    given = ("--irradiance", "mine.png", "--mm-per-pixel", 0.2, "--exposure", 1)
    status, _, words = run("render", *given, *files)
    assert status == 0, words
    found, truth = load_image(f"out.{ending}"), load_image(f"true.{ending}")
    for each in (found, truth):
        np.testing.assert_allclose(each.alpha, COVERED, atol=1e-5)
    wanted = plain * COVERED[..., None] if ending == "exr" else plain
    np.testing.assert_allclose(found.pixels, np.clip(wanted, 0.0, None), atol=2e-5)
    assert load_image("lost.exr").alpha is None
    assert ("multiplied by alpha" in words) is (ending == "exr")


def test_alpha_serves_as_the_mask(run, folder):
    save_image("mine.exr", lit(), alpha=COVERED, mm_per_pixel=0.2)
    inside = COVERED >= 0.5
    scene = Scene("mine", np.where(inside[..., None], lit(), 0.0), 0.2, mask=inside)
    kernel, profile = SeparableKernel.load(KERNEL), Profile.load("wax.profile.npz")
    result = judge(scene, kernel, profile)
    status, out, _ = run(
        "render", "--irradiance", "mine.exr", "--mask", "alpha", "-o", "out.tif", "--json"
    )
    assert status == 0
    figures = json.loads(out)
    assert figures["delta_e_2000_mean"] == pytest.approx(result.score.delta_e_2000_mean, rel=1e-3)
    found = load_image("out.tif")
    np.testing.assert_allclose(found.pixels, result.picture, atol=1e-6)
    assert (found.pixels[~inside] == 0.0).all()
    np.testing.assert_allclose(found.alpha, COVERED)
    status, out, _ = run("render", "--irradiance", "mine.exr", "-o", "all.tif", "--json")
    whole = json.loads(out)["delta_e_2000_mean"]
    assert abs(whole - figures["delta_e_2000_mean"]) > 0.01


def test_a_layer_of_a_file_is_chosen(run, folder):
    two = np.concatenate((lit(), 0.5 * lit()[:, ::-1]), axis=2)
    names_of_two = [f"{layer}.{channel}" for layer in ("a", "b") for channel in "RGB"]
    save_image("mine.exr", two, channels=names_of_two, mm_per_pixel=0.2)
    status, _, words = run("render", "--irradiance", "mine.exr")
    assert status == 1
    assert "has the layers a, b; name the one" in words
    assert run("render", "--irradiance", "mine.exr", "--layer", "b", "-o", "out.exr")[0] == 0
    light = np.float32(two[..., 3:]).astype(float)
    wanted = render_separable(Scene("mine", light, 0.2), SeparableKernel.load(KERNEL))
    np.testing.assert_allclose(load_image("out.exr").pixels, wanted, atol=1e-6)


def test_options_of_files_are_refused_where_they_would_do_nothing(run, folder):
    for option in (("--layer", "a"), ("--mask", "alpha")):
        status, _, words = run("render", "--irradiance", "disk", *SIZE, *option)
        assert status == 2
        assert f"{option[0]} is for pictures from files" in words
    save_image("mine.exr", lit(), mm_per_pixel=0.2)
    status, _, words = run("render", "--irradiance", "mine.exr", "--mask", "alpha")
    assert status == 1
    assert "mine.exr has no alpha that could be the mask" in words


def test_alpha_that_no_file_can_hold_is_left_out(run, folder):
    profile = Profile.load("wax.profile.npz")
    two = dataclasses.replace(
        fit_svd(profile, rank=1, mm_per_pixel=0.2).kernel, channels=("A", "R", "G")
    )
    two.save("odd.kernel.json")
    (folder / "wax.profile.npz").unlink()  # its channels are others
    save_image("mine.exr", lit(1), alpha=COVERED, mm_per_pixel=0.2)
    status, _, words = run("render", "odd.kernel.json", "--irradiance", "mine.exr", "-o", "out.exr")
    assert status == 0, words
    assert "alpha left out beside the channels A, R, G" in words


def test_foreign_files_stay(run, folder):
    (folder / "notes.exr").write_text("mine")
    status, _, words = run("render", "--irradiance", "disk", *SIZE, "-o", "notes.exr")
    assert status == 1
    assert "--force" in words
    assert (folder / "notes.exr").read_text() == "mine"
