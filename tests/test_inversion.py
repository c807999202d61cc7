"""Albedo inversion: the reflectance that was asked for, by the exact solver and by theory."""

import io
import json
import sys

import checks
import numpy as np
import pytest
import reference
from hypothesis import given, settings
from hypothesis import strategies as st

from sssfit.cli import main
from sssfit.cli._options import Lengths
from sssfit.errors import MaterialError
from sssfit.material import load_material, parse_material
from sssfit.simulate import simulate_exact
from sssfit.simulate.half_space import LIGHTS, diffuse_reflectance, entering_light
from sssfit.simulate.inversion import (
    invert_reflectance,
    largest_reflectance,
    material_from_reflectance,
    published_inversions,
    reflectance_of,
    van_de_hulst_albedo,
)

ASKED = ("--from-reflectance", "0.44,0.23,0.13", "--mean-free-path", "1.3,0.95,0.67")


@pytest.fixture
def run(tmp_path, monkeypatch, capfd):
    """Run ``sssfit materials`` here; give exit status, stdout and stderr."""
    monkeypatch.chdir(tmp_path)
    diffuse_reflectance([0.5], 1.3)  # compiled, if not yet: no word of it on stderr

    def call(*arguments):
        with pytest.raises(SystemExit) as caught:
            main(["materials", *arguments])
        out, err = capfd.readouterr()
        return caught.value.code or 0, out, err

    return call


def names(folder):
    return sorted(path.name for path in folder.iterdir())


@pytest.mark.parametrize("reflectance", [0.01, 0.11523, 0.41495, 0.75272, 0.95])
def test_index_matched_albedos_are_those_of_chandrasekhar(reflectance):
    (albedo,) = invert_reflectance([reflectance], 1.0).albedo
    assert reference.chandrasekhar_total(albedo) == pytest.approx(reflectance, abs=1e-6)


@pytest.mark.parametrize("eta", [1.0, 1.3, 1.5, 2.0])
def test_what_was_asked_for_comes_out_from_black_to_white(eta):
    most = largest_reflectance(eta)
    asked = np.concatenate(([0.0, 1e-6], most * np.linspace(0.05, 0.95, 10), [most - 1e-5, most]))
    found = invert_reflectance(asked, eta)
    np.testing.assert_allclose(found.reflectance, asked, rtol=0, atol=1e-6)
    np.testing.assert_allclose(diffuse_reflectance(found.albedo, eta), asked, rtol=0, atol=1e-6)
    assert (np.diff(found.albedo) > 0).all()
    assert found.albedo[0] == pytest.approx(0.0, abs=1e-7)
    assert found.albedo[-1] == pytest.approx(1.0, abs=1e-12)


@settings(max_examples=5, deadline=None)
@given(st.lists(st.floats(0, 1), min_size=1, max_size=8), st.floats(1, 2))
def test_any_reachable_reflectances_come_out(shares, eta):
    asked = largest_reflectance(eta) * np.array(shares)
    albedo = invert_reflectance(asked, eta).albedo
    np.testing.assert_allclose(diffuse_reflectance(albedo, eta), asked, rtol=0, atol=1e-6)


def test_a_materials_albedo_is_found_again_from_its_reflectance():
    layer = load_material("skin1").layers[0]
    total = simulate_exact(load_material("skin1"), dr_mm=1.0, radius_mm=3.0).diffuse_reflectance
    np.testing.assert_allclose(invert_reflectance(total, 1.3).albedo, layer.albedo, atol=1e-5)


@pytest.mark.parametrize("wrong", [-0.1, 1.2, 0.983, np.nan, np.inf])
def test_what_no_albedo_gives_is_refused_with_the_largest_that_one_does(wrong):
    for call in (invert_reflectance, published_inversions):
        with pytest.raises(MaterialError, match=r"reflectance\[1\] = .*largest is 0\.982986") as e:
            call([0.4, wrong], 1.3)
        assert "\n" not in str(e.value)
    invert_reflectance([0.982986], 1.3)  # as good as its word


@pytest.mark.parametrize("eta", [0.9, 4.1, np.nan])
def test_an_index_out_of_range_is_refused(eta):
    with pytest.raises(MaterialError, match="eta"):
        invert_reflectance([0.4], eta)


@pytest.mark.parametrize("shape", [(), (0,), (2, 2)])
def test_a_material_has_one_reflectance_a_channel(shape):
    if shape == ():
        assert invert_reflectance(0.3, 1.3).albedo.shape == (1,)
        return
    with pytest.raises(MaterialError, match="shape"):
        invert_reflectance(np.full(shape, 0.3), 1.3)


def test_what_the_published_ones_really_reflect_is_a_literal_walks():
    photons = 200_000
    for seed, found in enumerate(published_inversions([0.44, 0.23, 0.13], 1.3).values()):
        bins, squares, *_, roulette = reference.scalar_walk(
            seed, photons, found.albedo, np.ones(3), 1.3, 1.0, 1
        )
        total = bins.sum(axis=0) / photons
        variance = squares.sum(axis=0) / photons - total**2 + roulette / photons
        sigmas = (found.reflectance - total) / np.sqrt(variance / photons)
        assert np.abs(sigmas).max() < checks.LIMIT


@pytest.mark.parametrize(
    ("light", "theory"),
    [
        ("normal", reference.chandrasekhar_total),
        ("diffuse", reference.chandrasekhar_diffuse_total),
    ],
)
def test_what_they_reflect_without_a_surface_is_chandrasekhars(light, theory):
    for found in published_inversions([0.44, 0.23, 0.13], 1.0, light=light).values():
        expected = [theory(each) for each in found.albedo]
        np.testing.assert_allclose(found.reflectance, expected, rtol=0, atol=1e-7)


def test_the_published_ones_are_right_for_diffuse_light_and_no_surface():
    asked = np.array([0.44, 0.23, 0.13])
    errors = {}
    for light, eta in (("diffuse", 1.0), ("normal", 1.0), ("normal", 1.3)):
        found = published_inversions(asked, eta, light=light)
        errors[light, eta] = np.array([each.reflectance / asked - 1.0 for each in found.values()])
    assert np.abs(errors["diffuse", 1.0]).max() < 0.02
    assert -0.21 < errors["normal", 1.0].min() < errors["normal", 1.0].max() < -0.13
    assert errors["normal", 1.3].max() < -0.40  # what is left is the surface's


def test_van_de_hulsts_albedos_under_diffuse_light():
    # Computed apart, with the H function.
    albedo = van_de_hulst_albedo(np.array([0.1, 0.3, 0.5]))
    np.testing.assert_allclose(
        reflectance_of(albedo, 1.0, "diffuse"), [0.10178, 0.30172, 0.50076], rtol=0, atol=5e-6
    )


def test_half_under_diffuse_light_without_a_surface():
    (albedo,) = invert_reflectance([0.5], 1.0, light="diffuse").albedo
    assert albedo == pytest.approx(0.911336, abs=5e-7)
    assert reference.chandrasekhar_diffuse_total(albedo) == pytest.approx(0.5, abs=1e-7)


def test_under_diffuse_light_a_base_colour_comes_back_from_what_enters():
    colours, eta, photons = [0.44, 0.23, 0.13], 1.3, 1_000_000
    for seed, (albedo, colour) in enumerate(
        zip(invert_reflectance(colours, eta, light="diffuse").albedo, colours, strict=True)
    ):
        specular, left = reference.diffuse_light_walk(seed, photons, albedo, eta)
        entered = photons - specular
        sigma = np.sqrt(colour * (1.0 - colour) / entered)
        assert abs(left / entered - colour) < checks.LIMIT * sigma


@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("eta", [1.0, 1.3, 2.0])
def test_black_and_white_under_either_light(light, eta):
    most = largest_reflectance(eta, light)
    assert most == pytest.approx(entering_light(eta) if light == "normal" else 1.0, abs=1e-15)
    found = invert_reflectance([0.0, most], eta, light=light)
    np.testing.assert_allclose(found.albedo, [0.0, 1.0], rtol=0, atol=1e-7)


@pytest.mark.parametrize("wrong", ["#fff", [[0.1], [0.2, 0.3]], {}])
def test_what_is_no_number_a_channel_is_refused_in_one_line(wrong):
    with pytest.raises(MaterialError, match=r"^reflectance = .*; expected one number a channel\."):
        invert_reflectance(wrong, 1.3)


def test_white_is_the_largest_base_colour_and_lights_have_names():
    with pytest.raises(
        MaterialError, match=r"1\.01 cannot be reached; under diffuse light the lar"
    ):
        invert_reflectance([1.01], 1.3, light="diffuse")
    for call in (invert_reflectance, published_inversions):
        with pytest.raises(MaterialError, match=r"light = 'moon'; expected normal or diffuse\."):
            call([0.4], 1.3, light="moon")


def test_a_material_says_what_was_asked_for_and_reflects_it():
    asked = [0.44, 0.23, 0.13]
    material = material_from_reflectance(
        asked, [1.3, 0.95, 0.67], 1.3, name="mine", channels=("R", "G", "B")
    )
    (layer,) = material.layers
    np.testing.assert_allclose(layer.mean_free_path_mm, [1.3, 0.95, 0.67], rtol=1e-14)
    assert "0.44, 0.23, 0.13 by exact albedo inversion" in material.source
    np.testing.assert_allclose(simulate_exact(material).diffuse_reflectance, asked, atol=1e-5)


@pytest.mark.parametrize("paths", [[1.0, 2.0], [], [0.0], [np.nan], [-1.0], [[1.0]]])
def test_mean_free_paths_are_lengths_one_or_as_many_as_reflectances(paths):
    with pytest.raises(MaterialError, match="mean free path"):
        material_from_reflectance([0.4] * 3, paths, 1.3, name="a", channels=("R", "G", "B"))


def test_the_file_that_is_written_gives_the_reflectance(run, tmp_path):
    status, out, err = run(*ASKED, "--eta", "1.3", "-o", "mine.toml")
    assert (status, err) == (0, "")
    assert names(tmp_path) == ["mine.toml"]
    material = load_material(tmp_path / "mine.toml")
    assert (material.name, material.channels) == ("mine", ("R", "G", "B"))
    total = simulate_exact(material).diffuse_reflectance
    np.testing.assert_allclose(total, [0.44, 0.23, 0.13], atol=1e-5)
    for words in ("could reflect up to 0.982986", "Chiang et al. 2016, gives", "Wrote mine.toml"):
        assert words in out
    published = published_inversions([0.44, 0.23, 0.13], 1.3)
    for each in published.values():
        assert f"{each.albedo[0]:.6f}, {each.reflectance[0]:.6f} (-4" in out
    assert max(map(len, out.splitlines())) <= 100


def test_json_has_the_figures(run):
    status, out, _ = run(*ASKED, "--eta", "1.3", "--json")
    assert status == 0
    figures = json.loads(out)
    assert figures["output"] == ["from-reflectance.toml"]
    assert figures["reflectance_asked"] == [0.44, 0.23, 0.13]
    np.testing.assert_allclose(figures["reflectance"], [0.44, 0.23, 0.13], atol=1e-6)
    assert figures["albedo"] == pytest.approx(invert_reflectance([0.44, 0.23, 0.13], 1.3).albedo)
    assert set(figures["approximations"]) == {"chiang2016", "van_de_hulst"}


def test_light_is_chosen(run, tmp_path):
    status, out, _ = run(*ASKED, "--eta", "1.3", "--light", "diffuse", "-o", "mine.toml", "--json")
    assert status == 0
    figures = json.loads(out)
    assert (figures["light"], figures["largest_reflectance"]) == ("diffuse", 1.0)
    colours = [0.44, 0.23, 0.13]
    expected = invert_reflectance(colours, 1.3, light="diffuse").albedo
    np.testing.assert_allclose(figures["albedo"], expected, rtol=1e-12)
    np.testing.assert_allclose(figures["reflectance"], colours, atol=1e-6)
    totals = simulate_exact(load_material(tmp_path / "mine.toml")).diffuse_reflectance
    np.testing.assert_allclose(figures["reflectance_normal"], totals, atol=1e-5)
    published = published_inversions(colours, 1.3, light="diffuse")
    for key, each in published.items():
        assert figures["approximations"][key]["reflectance"] == pytest.approx(each.reflectance)
    assert "base colour under diffuse light 0.44, 0.23, 0.13" in source_of_file(tmp_path)
    _, out, _ = run(*ASKED, "--eta", "1.3", "--light", "diffuse", "-o", "mine.toml")
    assert "could reflect up to 1 under diffuse light" in out
    row = out.splitlines()[2].split()
    assert row[:4] == ["R", "0.440000", f"{totals[0]:.6f}", f"{expected[0]:.6f}"]
    _, out, _ = run(*ASKED, "--eta", "1.3", "-o", "mine.toml", "--json")
    assert json.loads(out)["light"] == "normal"
    run(*ASKED, "--eta", "1.3", "--light", "normal", "-o", "mine.toml", "--json")
    assert "diffuse reflectance 0.44, 0.23, 0.13" in source_of_file(tmp_path)


def source_of_file(folder):
    return load_material(folder / "mine.toml").source


def test_percents_units_and_one_mean_free_path_for_all(run, tmp_path):
    asked = ("--from-reflectance", "44%, 23%,0.13", "--mean-free-path", "0.1cm", "--eta", "1.3")
    assert run(*asked, "--name", "wax")[0] == 0
    material = load_material(tmp_path / "wax.toml")
    assert material.name == "wax"
    np.testing.assert_allclose(material.layers[0].mean_free_path_mm, 1.0)
    np.testing.assert_allclose(
        diffuse_reflectance(material.layers[0].albedo, 1.3), [0.44, 0.23, 0.13], atol=1e-6
    )


def literal_decode(code):
    """IEC 61966-2-1, one value at a time."""
    value = code / 255.0
    return value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4


@pytest.mark.parametrize(
    "asked",
    [("#c58c6b",), ("#C58C6B", "--light", "diffuse"), ("197,140,107", "--srgb")],
)
def test_a_base_colour_in_srgb(run, tmp_path, asked):
    arguments = ("--from-reflectance", *asked, "--mean-free-path", ".37,.14,.07cm")
    status, out, _ = run(*arguments, "-o", "mine.toml", "--json")
    assert status == 0
    colour = [literal_decode(code) for code in (197, 140, 107)]
    figures = json.loads(out)
    np.testing.assert_allclose(figures["reflectance_asked"], colour, rtol=1e-12)
    assert (figures["light"], figures["eta"]) == ("diffuse", 1.4)
    material = load_material(tmp_path / "mine.toml")
    layer = material.layers[0]
    np.testing.assert_allclose(layer.mean_free_path_mm, [3.7, 1.4, 0.7], rtol=1e-9)
    assert layer.eta == 1.4
    # what a renderer shows of it in a white furnace, by the walk's own figure: tested above
    back = diffuse_reflectance(layer.albedo, 1.4, light="diffuse") / entering_light(1.4, "diffuse")
    np.testing.assert_allclose(back, colour, atol=2e-6)
    assert material.source.lower().startswith("srgb #c58c6b, base colour under diffuse light 0.558")


def test_a_grey_in_srgb_codes(run, tmp_path):
    asked = ("--from-reflectance", "128", "--srgb", "--channels", "grey", "--mean-free-path", "1")
    assert run(*asked, "--light", "normal", "-o", "mine.toml")[0] == 0
    albedo = load_material(tmp_path / "mine.toml").layers[0].albedo
    assert diffuse_reflectance(albedo, 1.4)[0] == pytest.approx(literal_decode(128), abs=1e-6)


def test_a_base_colour_in_python():
    material = material_from_reflectance("#fff", 300.0, name="white")
    assert material.layers[0].albedo.tolist() == [1.0, 1.0, 1.0]
    assert material.channels == ("R", "G", "B")
    for wrong in ("c58c6b", "#c58c6bff", "#12", "#ggg", ""):
        with pytest.raises(MaterialError, match="is not an sRGB colour in hex, such as #c58c6b"):
            material_from_reflectance(wrong, 1.0, name="wrong")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1.3", [1.3]),
        ("1.3,.95", [1.3, 0.95]),
        ("130um, 95um", [0.13, 0.095]),
        ("0.13,0.095,0.067cm", [1.3, 0.95, 0.67]),
        ("1e3,2e3 um", [1.0, 2.0]),
        ("1mm,2cm,3m", [1.0, 20.0, 3000.0]),
    ],
)
def test_lengths_share_the_unit_of_the_last(text, expected):
    np.testing.assert_allclose(Lengths().convert(text, None, None), expected, rtol=1e-12)


def test_up_to_64_channels(run, tmp_path):
    shares = ",".join(f"{0.01 * k}" for k in range(64))
    channels = ",".join(f"{400 + 5 * k}nm" for k in range(64))
    asked = ("--from-reflectance", shares, "--mean-free-path", "1", "--eta", "1.4")
    assert run(*asked, "--channels", channels, "-o", "s.toml")[0] == 0
    assert load_material(tmp_path / "s.toml").channels[-1] == "715nm"
    status, _, err = run(*asked, "-o", "t.toml")
    assert status == 2
    assert "64 values; name their channels with --channels" in err
    _, _, err = run("--from-reflectance", ".4", *ASKED[2:], "--eta", "1.3")
    assert "--from-reflectance has 1 value; name its channel with --channels" in err
    more = (*asked[:1], shares + ",0.1", *asked[2:], "--channels", channels + ",x", "-o", "t.toml")
    status, _, err = run(*more)
    assert status == 1
    assert "expected 1 to 64" in err


def test_toml_to_stdout(run, tmp_path, monkeypatch):
    stdout = io.TextIOWrapper(io.BytesIO())
    monkeypatch.setattr(sys, "stdout", stdout)
    _, _, err = run(*ASKED, "--eta", "1.3", "-o", "-")
    material = parse_material(stdout.buffer.getvalue().decode(), "stdout")
    assert material.name == "from-reflectance"
    assert "Wrote the material to stdout" in err
    assert names(tmp_path) == []


def test_only_files_of_its_own_are_replaced(run, tmp_path):
    path = tmp_path / "mine.toml"
    asked = (*ASKED, "--eta", "1.3", "-o", "mine.toml")
    assert run(*asked)[0] == run(*asked)[0] == 0
    kept = path.read_text().split("\n", 1)[1]  # without the line that says who made it
    path.write_text(kept)
    status, _, err = run(*asked)
    assert status == 1
    assert "--force" in err
    assert path.read_text() == kept
    assert run(*asked, "--force")[0] == 0


@pytest.mark.parametrize(
    ("arguments", "status", "fragment"),
    [
        (ASKED[:2], 2, "needs --mean-free-path"),
        (("--srgb",), 2, "--srgb is for --from-reflectance"),
        ((*ASKED, "--srgb"), 2, "whole numbers from 0 to 255, and not 0.44"),
        (("--from-reflectance", "197,140,256", "--srgb", *ASKED[2:]), 2, "and not 256"),
        (("--from-reflectance", "#c58c6", *ASKED[2:]), 2, "'#c58c6' is not an sRGB colour in hex"),
        ((*ASKED[:2], "--mean-free-path", "1cm,2,3cm"), 2, "has a unit for some lengths only"),
        (("--eta", "1.3"), 2, "--eta is for --from-reflectance"),
        (("--light", "diffuse"), 2, "--light is for --from-reflectance"),
        ((*ASKED, "--eta", "1.3", "--light", "moon"), 2, "'moon' is not one of"),
        (("skin1", "-o", "a.toml"), 2, "--output is for --from-reflectance"),
        (("skin1", *ASKED, "--eta", "1.3"), 2, "makes a material; name none"),
        ((*ASKED, "--eta", "1.3", "--toml"), 2, "makes a material; name none"),
        ((*ASKED, "--eta", "1.3", "--channels", "a,b"), 2, "2 names for 3 reflectances"),
        ((*ASKED, "--eta", "thick"), 2, "'thick' is not a valid number"),
        ((*ASKED, "--eta", "0.4"), 1, "eta = 0.4 is out of range"),
        ((*ASKED, "--eta", "0.5"), 1, "eta = 0.5; expected a relative refractive index from 1 to"),
        (("--from-reflectance", "a,b,c", *ASKED[2:], "--eta", "1.3"), 2, "'a' is not a refl"),
        (("--from-reflectance", "0.4,,1", *ASKED[2:], "--eta", "1.3"), 2, "'' is not a refl"),
        ((*ASKED[:2], "--mean-free-path", "1,0,1", "--eta", "1.3"), 2, "'0' is not a length"),
        ((*ASKED[:2], "--mean-free-path", "1,1", "--eta", "1.3"), 1, "2 mean free paths for 3"),
        (("--from-reflectance", "0.4,1.2,1", *ASKED[2:], "--eta", "1.3"), 1, "largest is 0.982986"),
        (("--from-reflectance", "0.4,nan,1", *ASKED[2:], "--eta", "1.3"), 1, "cannot be reached"),
        (
            (*ASKED, "--eta", "1.3", "--name", "a/b", "-o", "c.toml"),
            1,
            "cannot be part of a file name",
        ),
        ((*ASKED, "--eta", "1.3", "-o", "no/a.toml"), 1, "there is no folder"),
    ],
)
def test_bad_input_is_one_clear_line(run, tmp_path, arguments, status, fragment):
    code, out, err = run(*arguments)
    assert code == status
    assert out == ""
    assert fragment in err.splitlines()[-1]
    assert "Traceback" not in err
    if status == 1:
        assert err.count("\n") == 1
    assert names(tmp_path) == []


@pytest.mark.parametrize("eta", [np.float64(1.0), np.float64(1.4), np.float32(1.5)])
@pytest.mark.parametrize("light", LIGHTS)
def test_an_index_of_numpy_is_a_number(eta, light):
    found = invert_reflectance(0.4, eta, light=light)
    assert found.albedo == invert_reflectance(0.4, float(eta), light=light).albedo


@pytest.mark.parametrize("asked", [1e-8, 1e-6, 1e-4])
def test_dim_reflectances_are_found_to_a_share_of_themselves(asked):
    found = invert_reflectance([asked, 0.5], 1.3)
    assert found.reflectance[0] == pytest.approx(asked, rel=1e-4)
    assert reflectance_of(found.albedo, 1.3) == pytest.approx([asked, 0.5], rel=1e-4)


@pytest.mark.parametrize("eta", ["abc", None, [1.4]])
def test_an_index_that_is_no_number_is_refused_in_one_line(eta):
    with pytest.raises(MaterialError, match="is not a number; expected one refractive index"):
        invert_reflectance([0.4], eta)
