import io
import json
import os
import pickle
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sssfit.errors import MaterialError
from sssfit.material import (
    Layer,
    Material,
    load_material,
    material_names,
    parse_material,
    shipped_names,
)

SKIN = """\
eta = 1.3
g = 0.0
sigma_a_per_mm = [0.032, 0.17, 0.48]
sigma_s_per_mm = [0.74, 0.88, 1.01]
"""
GLASS = """\
[[layers]]
eta = 1.5
g = 0
sigma_a_per_mm = [0, 0, 0]
sigma_s_per_mm = [0, 0, 0]
thickness_mm = 1
"""
GROUND = "[[layers]]\n" + SKIN


def skin(old, new):
    """SKIN with one piece replaced."""
    assert old in SKIN
    return SKIN.replace(old, new)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("sample.mci", "is an input file of MCML: run `simulate` on it, and take the profile"),
        ("MCML2.MCO", "is output of MCML: import it, and take the profile that this writes"),
        ("table.csv", "is a table: import it, and take the profile that this writes"),
        ("skin1.svd3.kernel.json", "is a kernel or another JSON file; expected a material (.toml"),
    ],
)
def test_a_file_of_another_kind_is_told_by_its_ending(tmp_path, name, said):
    (tmp_path / name).write_text("no material\n")
    with pytest.raises(MaterialError, match=re.escape(f"{name} {said}")):
        load_material(tmp_path / name)
    (tmp_path / name).write_text(load_material("skin1").to_toml())
    assert load_material(tmp_path / name) == load_material("skin1")


def test_the_shipped_materials_are_listed_in_order():
    names = material_names()
    files = (Path(__file__).parents[1] / "materials").glob("*.toml")
    assert list(names) == sorted(each.stem for each in files)
    assert len(names) >= 22
    assert set(material_names(paper=True)) < set(names)
    layered = material_names(layered=True)
    assert len(layered) >= 20
    assert list(layered) == sorted(layered)
    assert shipped_names() == names + layered


def test_layered_materials_are_no_half_spaces_and_say_where_they_come_from():
    for name in material_names(layered=True):
        material = load_material(name)
        assert material.name == name
        assert material.source
        assert len(material.layers) > 1 or not material.is_semi_infinite


def test_derived_coefficients_follow_their_definitions():
    layer = Layer(1.5, [0.5, 0.0, 0.9], [0.2, 0.0, 0.1], [0.6, 0.0, 9.0])
    np.testing.assert_allclose(layer.sigma_t_per_mm, [0.8, 0.0, 9.1])
    np.testing.assert_allclose(layer.albedo, [0.75, 0.0, 9.0 / 9.1])
    np.testing.assert_allclose(layer.reduced_sigma_s_per_mm, [0.3, 0.0, 0.9])
    np.testing.assert_allclose(layer.mean_free_path_mm, [2.0, np.inf, 1.0])
    assert not layer.is_clear
    assert Layer(1.5, 0.0, [0.0], [0.0], 1.0).is_clear


def test_specular_reflectance_is_that_of_the_top_face():
    layer = Layer(1.5, 0.0, [0.1], [1.0])
    assert Material("m", ("Y",), (layer,)).specular_reflectance == pytest.approx(0.04)
    assert Material("m", ("Y",), (layer,), eta_above=1.5).specular_reflectance == 0


def test_one_g_serves_every_channel():
    assert Layer(1.3, 0.8, [0.1, 0.2], [1, 2]).g.tolist() == [0.8, 0.8]


def test_arrays_are_read_only_copies():
    sigma_a = np.array([0.1, 0.2])
    layer = Layer(1.3, np.array([0.0, 0.0]), sigma_a, np.array([1.0, 2.0]))
    sigma_a[0] = 99.0
    assert layer.sigma_a_per_mm[0] == 0.1
    for key in ("g", "sigma_a_per_mm", "sigma_s_per_mm"):
        assert getattr(layer, key).dtype == np.float64
        with pytest.raises(ValueError, match="read-only"):
            getattr(layer, key)[0] = 1.0
    with pytest.raises(AttributeError):
        layer.eta = 2.0


def test_name_and_channels_have_defaults():
    material = parse_material(SKIN, "some/where/my_skin.toml")
    assert material.name == "my_skin"
    assert material.channels == ("R", "G", "B")
    assert material.source == ""


def test_stack_reads_from_the_top_down():
    material = parse_material("eta_above = 1.33\n" + GLASS + GROUND, "stack.toml")
    assert [layer.eta for layer in material.layers] == [1.5, 1.3]
    assert [layer.thickness_mm for layer in material.layers] == [1.0, np.inf]
    assert material.layers[0].is_clear
    assert not material.is_semi_infinite
    # both faces of the glass, multiple reflections between them included
    top, bottom = (0.17 / 2.83) ** 2, (0.2 / 2.8) ** 2
    both = top + (1.0 - top) ** 2 * bottom / (1.0 - top * bottom)
    assert material.specular_reflectance == pytest.approx(both)


def test_slab_keeps_what_lies_below():
    material = parse_material(SKIN + "thickness_mm = 5\neta_below = 1.5\n", "slab.toml")
    assert material.eta_below == 1.5
    assert not material.is_semi_infinite


def test_infinite_thickness_may_be_written_out():
    assert parse_material(SKIN + "thickness_mm = inf\n", "a.toml").is_semi_infinite


def test_dense_accepts_high_extinction_and_survives_the_round_trip():
    text = "dense = true\n" + skin("[0.74, 0.88, 1.01]", "[74.0, 88.0, 101.0]")
    material = parse_material(text, "stone.toml")
    assert "dense = true" in material.to_toml()
    assert parse_material(material.to_toml(), "x.toml") == material
    assert (
        parse_material("dense = true\n" + SKIN, "x.toml").sha256
        == parse_material(SKIN, "x.toml").sha256
    )


def test_forward_scattering_is_judged_by_its_reduced_extinction():
    text = skin("g = 0.0", "g = 0.95").replace("[0.74, 0.88, 1.01]", "[74.0, 88.0, 101.0]")
    assert parse_material(text, "tissue.toml").layers[0].g.tolist() == [0.95] * 3


def test_g_of_one_is_no_scattering():
    """A channel that goes straight on scatters nothing: clear, or absorbing only."""
    material = parse_material(skin("g = 0.0", "g = [0.5, 1, 0]"), "a.toml")
    (layer,) = material.layers
    assert layer.g.tolist() == [0.5, 0.0, 0.0]
    assert layer.sigma_s_per_mm.tolist() == [0.74, 0.0, 1.01]
    assert layer.sigma_a_per_mm.tolist() == [0.032, 0.17, 0.48]
    assert parse_material(material.to_toml(), "a.toml") == material
    clear = skin("g = 0.0", "g = 1").replace("[0.032, 0.17, 0.48]", "[0, 0, 0]")
    with pytest.raises(MaterialError, match="needs something that absorbs or scatters"):
        parse_material(clear, "a.toml")


def test_only_ratios_of_indices_count():
    water = parse_material("eta_above = 1.3\n" + SKIN.replace("1.3", "0.98"), "a.toml")
    assert (water.layers[0].eta, water.eta_above) == (0.98, 1.3)
    assert water.specular_reflectance == pytest.approx((0.32 / 2.28) ** 2)


@pytest.mark.parametrize(("unit", "mm"), [("um", 1e-3), ("mm", 1.0), ("cm", 10.0), ("m", 1e3)])
@pytest.mark.parametrize("name", ["mu_a", "mu_s", "mu_s_prime", "sigma_s_p"])
def test_remedies_that_name_a_factor_turn_coefficients_into_per_mm(name, unit, mm):
    """What a message says is done to 1 per unit, which is 1/mm of it per mm."""
    text = SKIN + f"{name}_per_{unit} = [1, 1, 1]\n"
    with pytest.raises(MaterialError) as caught:
        parse_material(text, "a.toml")
    assert f"sigma_{'a' if '_a' in name else 's'}_per_mm" in str(caught.value)
    assert factor_in(str(caught.value)) == pytest.approx(1.0 / mm)


@pytest.mark.parametrize(("unit", "mm"), [("um", 1e-3), ("cm", 10.0), ("m", 1e3)])
@pytest.mark.parametrize("name", ["thickness", "depth"])
def test_remedies_that_name_a_factor_turn_lengths_into_mm(name, unit, mm):
    with pytest.raises(MaterialError) as caught:
        parse_material(SKIN + f"{name}_{unit} = 1\n", "a.toml")
    assert "rename it thickness_mm" in str(caught.value)
    assert factor_in(str(caught.value)) == pytest.approx(mm)


def factor_in(message):
    """By what a message asks to multiply; 1 where it names no factor."""
    found = re.search(r"(multiply|divide) it(?:s values)? by (\d+)", message)
    if found is None:
        return 1.0
    return float(found[2]) if found[1] == "multiply" else 1.0 / float(found[2])


MANY = ", ".join(f'"c{k}"' for k in range(65))
BAD = {
    # values: text, start of the message after the origin, remedy
    "negative": (skin("0.48", "-0.48"), "sigma_a_per_mm[2] = -0.48 ", "from 0"),
    "nan": (skin("0.88", "nan"), "sigma_s_per_mm[1] = nan ", "from 0"),
    "infinite": (skin("0.74", "inf"), "sigma_s_per_mm[0] = inf ", "from 0"),
    "huge": (skin("0.74", "1e308"), "sigma_s_per_mm[0] = 1e+308 ", "1e+09"),
    "huge integer": (skin("0.74", "9" * 400), "sigma_s_per_mm[0] = 9999", "... is out of range"),
    "huge hex": (skin("0.74", "0x" + "f" * 9000), "sigma_s_per_mm[0] = a huge number", "from 0"),
    "subnormal": (
        skin("[0.032, 0.17, 0.48]", "[5e-324, 1, 1]").replace("0.74", "0"),
        "sigma_a_per_mm[0] + sigma_s_per_mm[0] = 4.94066e-324 ",
        "0 for a clear",
    ),
    "text": (skin("0.17", '"0.17"'), "sigma_a_per_mm[1] = '0.17' ", "not a number"),
    "bool": (skin("0.17", "true"), "sigma_a_per_mm[1] = True ", "not a number"),
    "date": (skin("0.17", "1979-05-27"), "sigma_a_per_mm[1] = datetime.date", "not a number"),
    "nested list": (skin("0.17", "[0.17]"), "sigma_a_per_mm[1] = [0.17] ", "not a number"),
    "number for a list": (skin("[0.032, 0.17, 0.48]", "0.1"), "sigma_a_per_mm = 0.1;", "a list"),
    "text for a list": (skin("[0.032, 0.17, 0.48]", '"abc"'), "sigma_a_per_mm = 'abc';", "a list"),
    "empty list": (skin("[0.032, 0.17, 0.48]", "[]"), "sigma_a_per_mm = [];", "one number per"),
    "long text": (skin("0.17", f'"{"x" * 500}"'), "sigma_a_per_mm[1] = 'xxx", "xxx... is not"),
    "g above one": (skin("g = 0.0", "g = 1.1"), "g = 1.1 ", "above -1 and up to 1"),
    "g in a list": (skin("g = 0.0", "g = [0, -1, 0]"), "g[1] = -1 ", "above -1 and up to 1"),
    "g text": (skin("g = 0.0", 'g = "0"'), "g = '0' ", "not a number"),
    "g list too short": (skin("g = 0.0", "g = [0, 0]"), "g has 2 values", "one per channel"),
    "eta low": (skin("1.3", "0.49"), "eta = 0.49 ", "from 0.5 to 4"),
    "eta high": (skin("1.3", "4.1"), "eta = 4.1 ", "from 0.5 to 4"),
    "eta bool": (skin("1.3", "true"), "eta = True ", "not a number"),
    "eta list": (skin("1.3", "[1.3, 1.3, 1.3]"), "eta = [1.3, 1.3, 1.3] ", "one refractive index"),
    "eta table": ("eta.x = 1\n" + skin("eta = 1.3\n", ""), "eta = {'x': 1} ", "not a number"),
    "eta_above": ("eta_above = 0.4\n" + SKIN, "eta_above = 0.4 ", "from 0.5 to 4"),
    "thickness zero": (SKIN + "thickness_mm = 0", "thickness_mm = 0 ", "leave it out"),
    "thickness negative": (SKIN + "thickness_mm = -inf", "thickness_mm = -inf ", "leave it out"),
    "thickness nan": (SKIN + "thickness_mm = nan", "thickness_mm = nan ", "leave it out"),
    "per cm by its size": (
        skin("0.74, 0.88, 1.01", "7.4, 8.8, 10.1"),
        "sigma_a_per_mm[2] + (1 - g) sigma_s_per_mm[2] = 10.58 per mm",
        "divide by 10 if these are 1/cm; if the material really is that dense, say dense = true",
    ),
    "dense said false": (
        "dense = false\n" + skin("0.74", "74.0"),
        "sigma_a_per_mm[0] + (1 - g) sigma_s_per_mm[0] = 74.032 per mm",
        "dense = true",
    ),
    "dense not bool": ("dense = 1\n" + SKIN, "dense = 1;", "true or false"),
    "clear channel": (
        skin("0.17", "0").replace("0.88", "0"),
        "sigma_a_per_mm[1] + sigma_s_per_mm[1] = 0;",
        "channel 'G' needs",
    ),
    # lists and names
    "lengths": (skin("[0.74, 0.88, 1.01]", "[0.74, 0.88]"), "sigma_s_per_mm has 2", "one per"),
    "channels too few": (
        'channels = ["R", "G"]\n' + SKIN,
        "sigma_a_per_mm has 3 values for 2 channels ('R, G')",
        "one per channel",
    ),
    "channels missing": (
        skin("[0.032, 0.17, 0.48]", "[0.1]").replace("[0.74, 0.88, 1.01]", "[1]"),
        "channels is missing",
        "and there are 1; name them",
    ),
    "channels text": ('channels = "RGB"\n' + SKIN, "channels = 'RGB';", "a list of 1 to 64"),
    "channels none": ("channels = []\n" + SKIN, "channels = [] has 0 names", "1 to 64"),
    "channels 65": (f"channels = [{MANY}]\n" + SKIN, "channels = ['c0', ", "has 65 names"),
    "channel empty": ('channels = ["R", "", "B"]\n' + SKIN, "channels[1] = '';", "a name"),
    "channel number": ('channels = ["R", 2, "B"]\n' + SKIN, "channels[1] = 2;", "in quotes"),
    "channel control": (
        'channels = ["R", "a\\n", "B"]\n' + SKIN,
        "channels[1] = 'a\\n';",
        "a name",
    ),
    "channel twice": ('channels = ["R", "G", "R"]\n' + SKIN, "channels[2] = 'R' ", "twice"),
    "name path": ('name = "../x"\n' + SKIN, "name = '../x' ", "letters, digits"),
    "name unicode": ('name = "h\u00e9\u202e"\n' + SKIN, "name = 'h\u00e9\\u202e' ", "letters"),
    "name empty": ('name = ""\n' + SKIN, "name = '' ", "letters, digits"),
    "name newline": ('name = "a\\n"\n' + SKIN, "name = 'a\\n' ", "letters, digits"),
    "name number": ("name = 3\n" + SKIN, "name = 3 ", "letters, digits"),
    "source number": ("source = 3\n" + SKIN, "source = 3 ", "in quotes"),
    # keys
    "missing eta": (skin("eta = 1.3\n", ""), "eta is missing", "to_toml()` gives an example"),
    "missing g": (skin("g = 0.0\n", ""), "g is missing", "add g = 0.0"),
    "unknown": ("etta = 1\n" + SKIN, "etta = 1: etta is not a key of a", "did you mean eta?"),
    "unknown far": ("zzz = 1\n" + SKIN, "zzz = 1: zzz is not a key", "known keys: name, source"),
    "unknown odd": ('"a\\u0000 b" = 1\n' + SKIN, "'a\\x00 b' = 1: ", "known keys"),
    "per cm": (
        skin("sigma_a_per_mm", "sigma_a_per_cm"),
        "sigma_a_per_cm = [0.032, 0.17, 0.48]: sigma_a_per_cm is not a key",
        "rename it sigma_a_per_mm and divide its values by 10.",
    ),
    "no unit": (
        skin("sigma_s_per_mm", "sigma_s"),
        "sigma_s = ",
        "rename it sigma_s_per_mm and, if they are 1/cm, divide its values by 10.",
    ),
    "mu_a": (skin("sigma_a_per_mm", "mu_a"), "mu_a = ", "rename it sigma_a_per_mm and, if"),
    "mu_s": (skin("sigma_s_per_mm", "mu_s"), "mu_s = ", "rename it sigma_s_per_mm and, if"),
    "per m": (skin("sigma_a_per_mm", "sigma_a_per_m"), "sigma_a_per_m = ", "by 1000"),
    "reduced": (
        skin("sigma_s_per_mm", "sigma_s_prime_per_mm"),
        "sigma_s_prime_per_mm = ",
        "give it as sigma_s_per_mm with g = 0.",
    ),
    "reduced per cm": (
        skin("sigma_s_per_mm", "mu_s_prime_per_cm"),
        "mu_s_prime_per_cm = ",
        "give it as sigma_s_per_mm with g = 0 and divide its values by 10.",
    ),
    "thickness_cm": (SKIN + "thickness_cm = 1", "thickness_cm = 1: ", "multiply it by 10"),
    "ior": (skin("eta", "ior"), "ior = 1.3: ", "call it eta"),
    "albedo": (SKIN + "albedo = 0.9", "albedo = 0.9: ", "(1 - albedo) sigma_t"),
    # layers
    "both": (SKIN + GROUND, "eta and [[layers]] are both given", "leave [[layers]] out"),
    "dotted deep": ("a" + ".a" * 3000 + " = 1\n" + SKIN, "a = tables nested", "known keys"),
    "layers table": ("[layers]\n" + SKIN, "layers = {'eta': 1.3, ", "two brackets"),
    "layers none": ("layers = []", "layers = [];", "one [[layers]] table"),
    "layers of numbers": ("layers = [1]", "layers[0] = 1 is not a table", "under [[layers]]"),
    "layer missing": ("[[layers]]\neta = 1.3", "layers[0].g is missing", "add g = 0.0"),
    "layer value": (GLASS + GROUND.replace("0.48", "-1"), "layers[1].sigma_a_per_mm[2] = -1 ", "0"),
    "layer unknown": (GLASS + "colour = 3\n" + GROUND, "layers[0].colour = 3: ", "known keys: eta"),
    "layer of another length": (
        GLASS.replace("[0, 0, 0]", "[0, 0]") + GROUND,
        "channels is missing",
        "there are 2",
    ),
    "lower layer of another length": (
        GROUND + "thickness_mm = 1\n" + GLASS.replace("[0, 0, 0]", "[0, 0]"),
        "layers[1].sigma_a_per_mm has 2 values for 3 channels",
        "one per channel",
    ),
    "head key in a layer": (
        GLASS + GROUND + "eta_below = 1.5",
        "layers[1].eta_below = 1.5: eta_below is not a key of a material layer",
        "above the first [[layers]]",
    ),
    "name of a layer": (
        GLASS + 'name = "coat"\n' + GROUND,
        "layers[0].name = 'coat': name is not a key of a material layer",
        "leave it out, since layers have no names",
    ),
    "infinite on top": (GROUND + GROUND, "layers[0].thickness_mm is missing", "only the last"),
    "only clear": (GLASS + GLASS, "sigma_a_per_mm[0] + sigma_s_per_mm[0] = 0 in every", "needs"),
    "one clear": (GLASS, "sigma_a_per_mm[0] + sigma_s_per_mm[0] = 0;", "needs something"),
    "clear ground": (
        GROUND + "thickness_mm = 1\n" + GLASS.replace("thickness_mm = 1\n", ""),
        "layers[1].sigma_a_per_mm[0] + sigma_s_per_mm[0] = 0 in a semi-infinite",
        "say eta_below = 1.5",
    ),
    "below nothing": ("eta_below = 1.4\n" + SKIN, "eta_below = 1.4, but", "a thickness_mm or"),
    # not a material at all
    "empty": ("", "the file is empty", "to_toml()` gives an example"),
    "blank": (" \n\t\n", "the file is empty", "to_toml()` gives an example"),
    "comments only": ("# nothing\n", "eta is missing", "to_toml()` gives an example"),
    "not TOML": ("eta = \n", "not valid TOML: Invalid value (at line 1, column 7)", "."),
    "key twice": ("eta = 1\neta = 2\n", "not valid TOML: Cannot overwrite", "line 2"),
    "control character": ("eta = 1\x01\n", "not valid TOML: ", "line 1, column 8"),
    "too many digits": ("eta = " + "9" * 5000, "not valid TOML: ", "4300"),
    "too deep": ("eta = " + "[" * 50000, "tables or lists nest too deep", "two levels"),
}


@pytest.mark.parametrize(("text", "start", "remedy"), BAD.values(), ids=BAD)
def test_bad_files_are_refused_in_one_line_with_file_key_value_and_remedy(text, start, remedy):
    with pytest.raises(MaterialError) as caught:
        parse_material(text, "skin.toml")
    message = str(caught.value)
    assert message.startswith(f"skin.toml: {start}")
    assert remedy in message[len("skin.toml: ") :]
    assert message.isprintable()
    assert len(message) < 400


def test_sixty_four_channels_are_fine():
    channels = [f"{400 + 5 * k}nm" for k in range(64)]
    text = f"channels = {json.dumps(channels)}\n" + skin("[0.032, 0.17, 0.48]", str([0.1] * 64))
    material = parse_material(text.replace("[0.74, 0.88, 1.01]", str([1] * 64)), "spectrum.toml")
    assert material.n_channels == 64


def test_odd_file_names_need_a_name():
    with pytest.raises(MaterialError, match=r"^my skin.toml: name = 'my skin' cannot be part"):
        parse_material(SKIN, "my skin.toml")
    assert parse_material('name = "x"\n' + SKIN, "my skin.toml").name == "x"
    with pytest.raises(MaterialError, match=r"^a\\nb.toml: name = 'a\\nb' "):
        parse_material(SKIN, "a\nb.toml")


def test_path_loads_a_file_of_the_users(tmp_path, monkeypatch):
    (tmp_path / "mine.toml").write_text(SKIN)
    (tmp_path / "plain").write_text(SKIN)
    monkeypatch.chdir(tmp_path)
    expected = parse_material(SKIN, "mine.toml")
    assert load_material("mine.toml") == expected
    assert load_material(str(tmp_path / "mine.toml")) == expected
    assert load_material(Path("mine.toml")) == expected
    assert load_material("plain").name == "plain"


def test_byte_order_mark_and_windows_lines_are_read(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_bytes(b"\xef\xbb\xbf" + SKIN.replace("\n", "\r\n").encode())
    assert load_material(path) == parse_material(SKIN, "mine.toml")


def test_letters_of_windows_never_stop_a_material(tmp_path):
    path = tmp_path / "mine.toml"
    text = '# µa… à 633 nm\r\nsource = "Müllers “Haut”, 5 €"\r\n' + SKIN.replace("\n", "\r\n")
    for encoding in ("utf-8", "utf-8-sig", "cp1252", "utf-16", "utf-16-le", "utf-16-be"):
        path.write_bytes(text.encode(encoding))
        material = load_material(path)
        assert material.source == "Müllers “Haut”, 5 €", encoding
        assert material.layers == parse_material(SKIN, "mine.toml").layers
    path.write_bytes(text.replace("1.3", "1.3°").encode("cp1252"))
    with pytest.raises(MaterialError, match=r"not valid TOML.*save it as UTF-8\.$"):
        load_material(path)


def test_dash_reads_standard_input(monkeypatch):
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(b'name = "x"\n' + SKIN.encode())))
    assert load_material("-").name == "x"
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(b"\0")))
    with pytest.raises(MaterialError, match=r"^stdin: the file is not text; expected a material"):
        load_material("-")


@pytest.mark.parametrize(
    ("name", "remedy"),
    [
        ("skni1", "did you mean skin1?"),
        ("SKIN1", "did you mean skin1?"),
        ("unobtainium", "`material_names()` lists"),
        ("", "`material_names()` lists"),
        ("x" * 5000, "xxx...; "),
        ("a\nb\x00", "'a\\nb\\x00'; "),
    ],
)
def test_unknown_names_are_refused_with_a_suggestion(name, remedy):
    with pytest.raises(MaterialError, match="there is no material") as caught:
        load_material(name)
    assert remedy in str(caught.value)
    assert str(caught.value).isprintable()


def unreadable(folder, content, mode=0o644):
    path = folder / "bad.toml"
    path.write_bytes(content)
    path.chmod(mode)
    return path


@pytest.mark.parametrize(
    ("make", "expected"),
    [
        (lambda folder: folder / "none.toml", "cannot be read: no such file or directory"),
        (lambda folder: folder, "this is a folder; name"),
        (lambda folder: unreadable(folder, b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR"), "is not text; expe"),
        (lambda folder: unreadable(folder, b"\x00" * 100), "the file is not text; expected a mat"),
        (lambda folder: unreadable(folder, b"#" * 1_000_001), "larger than 1 MB"),
        (lambda folder: unreadable(folder, b""), "the file is empty"),
        (lambda _: Path(os.devnull), "the file is empty"),
        (lambda folder: folder / ("x" * 400 + ".toml"), "cannot be read: file name too long"),
    ],
)
def test_files_that_cannot_be_read_are_refused_by_name(tmp_path, make, expected):
    path = make(tmp_path)
    with pytest.raises(MaterialError) as caught:
        load_material(str(path))
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert expected in message
    assert message.count("the file") <= 1
    assert message.isprintable()


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="root reads everything")
def test_unreadable_file_is_refused(tmp_path):
    with pytest.raises(MaterialError, match="permission denied"):
        load_material(unreadable(tmp_path, SKIN.encode(), 0))


def test_null_characters_in_a_path_are_refused():
    with pytest.raises(MaterialError, match="null"):
        load_material("a\x00b.toml")


def test_fingerprint_ignores_how_the_file_is_written():
    spaced = "# a comment\n" + SKIN.replace(" ", "   ").replace("g   =   0.0", "g = [-0.0, 0, 0e5]")
    plain = parse_material(SKIN, "a.toml")
    assert parse_material('source = "me"\n' + spaced, "a.toml").sha256 == plain.sha256
    assert len(plain.sha256) == 64
    assert plain != parse_material('source = "me"\n' + spaced, "a.toml")


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("0.032", "0.03200000000000001"),
        ("1.01", "1.02"),
        ("g = 0.0", "g = [0.0, 0.0, 0.1]"),
        ("eta = 1.3", "eta = 1.31"),
        ("eta = 1.3", "eta_above = 1.1\neta = 1.3"),
        ("eta = 1.3", "thickness_mm = 5\neta = 1.3"),
        ("eta = 1.3", 'channels = ["X", "Y", "Z"]\neta = 1.3'),
        ("eta = 1.3", 'name = "other"\neta = 1.3'),
    ],
)
def test_fingerprint_changes_with_any_coefficient(old, new):
    changed = parse_material(skin(old, new), "a.toml")
    assert changed.sha256 != parse_material(SKIN, "a.toml").sha256
    assert changed != parse_material(SKIN, "a.toml")


def test_fingerprint_is_the_same_in_another_process():
    code = "from sssfit.material import load_material; print(load_material('skin1').sha256)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == load_material("skin1").sha256


def test_damaged_record_is_refused():
    content = load_material("skin1").to_dict()
    for damaged in (
        {},
        {"layers": 3},
        {**content, "extra": 1},
        {**content, "layers": [{}]},
        {k: content[k] for k in content if k != "name"},
        [],
    ):
        with pytest.raises(MaterialError, match="record is damaged"):
            Material.from_dict(damaged)


def test_material_without_layers_is_refused():
    with pytest.raises(MaterialError, match="at least one"):
        Material("m", ("R",), ())


@pytest.mark.parametrize("values", [0.1, np.float64(0.1), np.array(0.1), np.zeros((2, 2)), None])
def test_layer_made_in_python_meets_the_same_checks(values):
    with pytest.raises(MaterialError, match=r"sigma_a_per_mm(\[0\])? = ") as caught:
        Layer(1.3, 0.0, values, [1.0])
    assert str(caught.value).isprintable()


finite = st.floats(1e-6, 1e3)
indices = st.floats(0.5, 4.0)
labels = st.text(min_size=1).filter(lambda s: s.isprintable() and s.strip() == s)


@st.composite
def materials(draw):
    channels = draw(st.lists(labels, min_size=1, max_size=5, unique=True))
    each = {"min_size": len(channels), "max_size": len(channels)}
    layer = st.builds(
        Layer,
        eta=indices,
        g=st.lists(st.floats(-0.99, 0.99), **each),
        sigma_a_per_mm=st.lists(finite, **each),
        sigma_s_per_mm=st.lists(st.just(0.0) | finite, **each),
        thickness_mm=finite,
    )
    layers = draw(st.lists(layer, min_size=1, max_size=3))
    eta_below = draw(indices)
    if draw(st.booleans()):
        last = layers.pop()
        layers.append(Layer(last.eta, last.g, last.sigma_a_per_mm, last.sigma_s_per_mm))
        eta_below = 1.0
    name = draw(st.from_regex(r"[A-Za-z0-9][A-Za-z0-9._+-]{0,20}", fullmatch=True))
    source = draw(st.text())
    return Material(name, tuple(channels), tuple(layers), source, draw(indices), eta_below)


@given(materials())
def test_round_trips_give_an_equal_material(material):
    copies = (
        parse_material(material.to_toml(), "elsewhere.toml"),
        Material.from_dict(json.loads(json.dumps(material.to_dict()))),
        pickle.loads(pickle.dumps(material)),
    )
    for copy in copies:
        assert copy == material
        assert hash(copy) == hash(material)
        assert copy.sha256 == material.sha256


def test_a_shipped_file_has_the_name_of_its_material(tmp_path, monkeypatch):
    """Otherwise two rows of a list have one name, and only one of them is found by it."""
    (tmp_path / "skin9.toml").write_text(load_material("skin1").to_toml())
    record = sys.modules[Material.__module__]
    monkeypatch.setattr(record.resources, "files", lambda _: tmp_path)
    monkeypatch.setattr(record, "material_names", lambda **_: ())
    monkeypatch.setattr(record, "shipped_names", lambda: ("skin9",))
    said = r"^skin9.toml: name = 'skin1'; expected that of its file, 'skin9'"
    with pytest.raises(MaterialError, match=said):
        load_material("skin9")


def test_shipped_files_equal_their_own_toml():
    for name in shipped_names():
        assert parse_material(load_material(name).to_toml(), "x.toml") == load_material(name)


LAYER = Layer(1.3, 0.0, [0.1], [0.9])


@pytest.mark.parametrize(
    ("layers", "words"),
    [
        (None, "layers = None; expected a list of layers"),
        ("L", "layers = 'L'; expected a list of layers"),
        (LAYER, "expected a list of layers"),
        ((5,), r"layers\[0\] = 5; expected a Layer"),
        ((LAYER, "L"), r"layers\[1\] = 'L'; expected a Layer"),
        (({"eta": 1.3},), r"layers\[0\] = \{'eta': 1\.3\}; expected a Layer"),
    ],
)
def test_a_stack_is_of_layers(layers, words):
    with pytest.raises(MaterialError, match=words) as caught:
        Material("x", ("c",), layers)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", [None, 5, b"x = 1", ["x"]])
def test_what_is_no_text_is_no_material(text):
    with pytest.raises(MaterialError, match=r"here: .* is not a text; expected the TOML"):
        parse_material(text, "here")


def test_a_source_can_be_written():
    with pytest.raises(
        MaterialError, match=r"source = '\\udc80' has characters that UTF-8 does not"
    ):
        Material("x", ("c",), (LAYER,), source="\udc80")
