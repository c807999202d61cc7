"""``sssfit render``: pictures out, figures of what was lost, one line for what is wrong."""

import dataclasses
import json
import os
import shutil
from pathlib import Path

import numpy as np
import OpenImageIO
import pytest
from reference_pixels import make_profile

from sssfit.cli import main
from sssfit.compare.evaluate import evaluate
from sssfit.fit import fit_svd
from sssfit.formats.pictures import load_image, save_image
from sssfit.kernel import SeparableKernel
from sssfit.material import load_material
from sssfit.measure.score import auto_exposure
from sssfit.profile import Profile
from sssfit.render.reference import render_reference
from sssfit.render.screen import render_screen
from sssfit.render.separable import render_separable
from sssfit.render.transmittance import with_transmitted
from sssfit.scene.head import head_scene
from sssfit.scene.made import make_scene
from sssfit.scene.record import Scene

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
    assert figures["fetches"] == 4 * SeparableKernel.load(KERNEL).pixels
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


LARD = dataclasses.replace(load_material("skin1"), name="wax", channels=("c0", "c1", "c2"))
OTHERS = {
    "material": {"material": {"name": "lard"}},
    "material_sha256": {"material": LARD.to_dict(), "material_sha256": LARD.sha256},
    "method": {"method": "montecarlo"},
    "photons": {"photons": 10_000},
    "seed": {"seed": 7},
}


@pytest.mark.parametrize("key", list(OTHERS))
def test_a_profile_that_differs_in_one_thing_is_not_the_kernels(run, key):
    """It is newer than the kernel's own, and all light lies elsewhere: another error."""
    profile = Profile.load("wax.profile.npz")
    wanted = json.loads(run("render", "--irradiance", "edge", *SIZE, "--json")[1])
    energy = profile.annulus_energy[::-1].copy()
    meta = {**profile.meta, **OTHERS[key]}
    make_profile(profile.r_edges_mm, energy, meta=meta).save("other.profile.npz")
    newest = Path("wax.profile.npz").stat().st_mtime + 60.0
    os.utime("other.profile.npz", (newest, newest))
    found = json.loads(run("render", "--irradiance", "edge", *SIZE, "--json")[1])
    assert found["profile"] == "wax.profile.npz"
    assert found["rmse"] == wanted["rmse"]


def test_without_another_the_same_profile_is_found_under_any_name(run):
    Path("wax.profile.npz").rename("first.profile.npz")
    run("simulate", "skin1", "--method", "dipole", "-o", "last.profile.npz")
    status, out, _ = run("render", "--irradiance", "edge", *SIZE, "--json")
    figures = json.loads(out)
    assert status == 0
    assert figures["profile"] == "first.profile.npz"
    scene = make_scene("edge", height=24, width=40, mm_per_pixel=0.2)
    truth = render_reference(scene, Profile.load("first.profile.npz"))
    lost = render_separable(scene, SeparableKernel.load(KERNEL)) - truth
    assert figures["rmse"] == pytest.approx(np.sqrt(np.mean(lost**2)), rel=1e-9)


TABLE = "r_mm,red,green\n0.2,0.2,0.1\n0.4,0.1,0.04\n0.8,0.05,0.01\n1.2,0.02,0.004\ninf,0.01,0\n"


def profile_found(run, kernel):
    """What `render` measures a kernel against, and what it says on stderr."""
    arguments = ("render", kernel, "--irradiance", "edge", *SIZE, "-o", "out.exr", "--json")
    status, out, words = run(*arguments)
    assert status == 0, words
    return json.loads(out)["profile"], words


def test_a_kernel_of_any_profile_finds_it_again(run, folder):
    Path("table.csv").write_text(TABLE)
    Path("other.csv").write_text(TABLE.replace("0.2,0.2", "0.2,0.3"))
    walk = ("--photons", "2000", "-q")
    for arguments in (
        ("import", "table.csv", "--quantity", "energy"),
        ("import", "other.csv", "--quantity", "energy"),
        ("simulate", "deon-skin", "--radius", "4", "-o", "deon-skin.profile.npz"),
        ("simulate", "skin1", "--method", "dipole", "-o", "dipole.npz"),
        ("simulate", "skin1", *walk),
        ("simulate", "skin1", *walk, "--seed", "2", "-o", "two.profile.npz"),
    ):
        assert run(*arguments)[0] == 0
    for name in ("table.profile", "other.profile", "deon-skin.profile", "dipole", "skin1.profile"):
        fit = ("fit", f"{name}.npz", "--method", "preintegrated", "--mm-per-pixel", ".4")
        status, _, words = run(*fit, "-o", "k.json")
        assert status == 0, words
        assert SeparableKernel.load("k.json").meta["profile_sha256"] == (
            Profile.load(f"{name}.npz").sha256
        )
        assert profile_found(run, "k.json") == (f"{name}.npz", "")


def test_a_profile_under_another_name_or_in_the_kernels_folder_is_found(run, folder):
    (folder / "deep").mkdir()
    Path(KERNEL).rename(folder / "deep" / KERNEL)
    Path("wax.profile.npz").rename(folder / "deep" / "moved.npz")
    found, _ = profile_found(run, f"deep/{KERNEL}")
    assert found == str(Path("deep") / "moved.npz")


def test_a_profile_that_has_changed_since_is_not_measured_against(run):
    profile = Profile.load("wax.profile.npz")
    make_profile(profile.r_edges_mm, 0.9 * profile.annulus_energy).save("wax.profile.npz")
    found, words = profile_found(run, KERNEL)
    assert found is None
    assert words == (
        "wax.profile.npz is a profile of test by the same method, but not the one that "
        f"{KERNEL} was fitted to, or it has changed since, so nothing is measured: fit the kernel "
        "again, or name its profile with --profile.\n"
    )
    given = ("--profile", "wax.profile.npz", "-o", "out.exr", "--json")
    status, out, words = run("render", KERNEL, "--irradiance", "edge", *SIZE, *given)
    assert status == 0
    assert json.loads(out)["rmse"] > 0.0
    assert words == f"wax.profile.npz is not the profile that {KERNEL} was fitted to.\n"


def test_a_kernel_without_a_record_of_its_profile_says_so(run):
    whole = json.loads(Path(KERNEL).read_text())
    del whole["meta"]["profile_sha256"]
    Path("old.kernel.json").write_text(json.dumps(whole))
    found, words = profile_found(run, "old.kernel.json")
    assert found is None
    assert "old.kernel.json does not record which profile it was fitted to" in words


@pytest.mark.parametrize("how", ["measured", "without a profile", "in screen space"])
@pytest.mark.parametrize("exposure", [None, 0.3])
def test_a_png_has_the_exposure_that_was_given_or_that_of_its_own(run, how, exposure):
    options = ("--size", "48x48", *(("--screen",) if how == "in screen space" else ()))
    if how != "measured":
        Path("wax.profile.npz").unlink()
    given = () if exposure is None else ("--exposure", exposure)
    truth = ("--truth", "true.exr") if how == "measured" else ()
    assert run("render", *options, "-o", "light.exr", *truth)[0] == 0
    assert run("render", *options, *given, "-o", "shown.png")[0] == 0
    light = load_image("light.exr").pixels
    # The true picture sets it, so that all are seen alike; the picture itself where there is none.
    factor = exposure or auto_exposure(load_image("true.exr").pixels if truth else light, outline())
    expected = np.clip(factor * light, 0.0, 1.0)
    np.testing.assert_allclose(load_image("shown.png").pixels, expected, atol=5e-5)


def outline():
    """The mask of the head of 48 x 48 pixels."""
    return make_scene("head", height=48, width=48, mm_per_pixel=0.2).mask


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
        (("--irradiance", "disk", "--gain", "4"), 2, "are for --difference"),
        (("--irradiance", "disk", "--difference-map", "signed"), 2, "are for --difference"),
        (("--irradiance", "disk", "--difference", "a.png", "--gain", "0"), 2, "--gain"),
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
    assert "decoded to linear" not in words  # how it was read, where nothing comes of it
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
    result = evaluate(scene, kernel, profile)
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


@pytest.fixture
def coarse(folder):
    """A kernel on pixels so wide that a small picture shows the ears; red reaches the furthest."""
    r = np.linspace(0.0, 16.0, 161)
    energy = np.diff(0.5 - 0.5 * np.exp(-r[:, None] / (2.4, 1.2, 0.6)), axis=0)
    make_profile(r, energy).save("wide.profile.npz")
    profile = Profile.load("wide.profile.npz")
    fit_svd(profile, rank=2, mm_per_pixel=2.0).kernel.save("coarse.kernel.json")
    (folder / "wax.profile.npz").unlink()
    return "coarse.kernel.json"


HEAD = ("--irradiance", "head", "--size", "90x90")


def test_transmitted_light_is_what_the_library_adds(run, coarse):
    kernel = SeparableKernel.load(coarse)
    arguments = ("render", coarse, *HEAD, "--transmit", "--light", "160", "--json", "-o", "a.exr")
    status, out, _ = run(*arguments)
    assert status == 0
    scene = head_scene(height=90, width=90, mm_per_pixel=2.0, light_degrees=160.0, transmit=True)
    lit = with_transmitted(scene, kernel)
    shown = render_separable(lit, kernel) * (scene.mask > 0)[..., None]
    np.testing.assert_allclose(load_image("a.exr").pixels, shown, rtol=1e-6, atol=1e-9)
    figures = json.loads(out)
    through = lit.irradiance - scene.irradiance
    np.testing.assert_allclose(figures["transmitted_maximum"], through.max(axis=(0, 1)))
    # The truth has the same light to blur: what is left is the kernel's.
    profile = Profile.load("wide.profile.npz")
    error = (shown - render_reference(lit, profile))[scene.mask > 0]
    assert figures["rmse"] == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-6)


def test_ears_glow_red_under_a_light_from_behind(run, coarse):
    assert run("render", coarse, *HEAD, "--light", "170", "-o", "dark.exr")[0] == 0
    status, out, _ = run("render", coarse, *HEAD, "--transmit", "-o", "glow.exr")
    assert status == 0
    assert "through the object at most: R 0." in " ".join(out.split()).replace("c0", "R")
    dark, glow = (load_image(f"{name}.exr").pixels for name in ("dark", "glow"))
    added = glow - dark
    # Depth 82 mm behind the face: 78 mm to either side are 34 pixels.
    for column in (45 - 34, 45 + 34):
        ear = added[39:44, column]
        assert (ear[:, 0] > 0.01).all()
        share = ear / dark[39:44, column]
        assert (share[:, 0] > share[:, 2]).all(), "red comes further than blue"
    assert np.abs(added[30:60, 30:60]).max() < 1e-3, "nothing through the middle of the face"
    # The eye of a reader: the ears are the brightest that was added, and they are red.
    at = np.unravel_index(added[..., 0].argmax(), added.shape[:2])
    assert 25 < abs(at[1] - 45) < 42


def test_a_picture_without_thin_parts_says_so(run, coarse):
    small = ("--irradiance", "head", "--size", "20x20", "--transmit")
    status, _, err = run("render", coarse, *small, "-o", "a.exr")
    assert status == 0
    assert "head: nothing goes through, since no part in the picture is both lit from" in err
    assert "With a larger --size the made head shows its ears." in err
    assert "goes through" not in run("render", coarse, *HEAD, "--transmit", "-o", "b.exr")[2]


def test_transmitted_light_in_screen_space(run, coarse):
    kernel = SeparableKernel.load(coarse)
    options = ("--screen", "--mm-per-pixel", "2", "--transmit", "-o", "a.exr")
    assert run("render", coarse, *HEAD, *options)[0] == 0
    scene = head_scene(height=90, width=90, mm_per_pixel=2.0, light_degrees=170.0, transmit=True)
    np.testing.assert_allclose(
        load_image("a.exr").pixels, render_screen(scene, kernel), rtol=1e-6, atol=1e-9
    )


@pytest.mark.parametrize(
    ("options", "word"),
    [
        (("--irradiance", "disk", "--transmit"), "--transmit is for --irradiance head"),
        (("--irradiance", "disk", "--light", "20"), "--light is for --irradiance head"),
        (("--irradiance", "mine.png", "--transmit"), "--transmit is for --irradiance head"),
        ((*HEAD, "--light", "190"), "light_degrees = 190; expected -180 to 180"),
    ],
)
def test_light_that_a_picture_does_not_have_is_refused(run, folder, options, word):
    before = names(folder)
    save_image("mine.png", np.ones((4, 4, 3)), exposure=0.5)
    status, _, err = run("render", KERNEL, *options, "-o", "a.exr")
    assert status in (1, 2)
    assert word in " ".join(err.split())
    assert "Traceback" not in err
    assert names(folder) == sorted([*before, "mine.png"])
