"""MCML input files: the sample, the units, and one line for whatever is wrong."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sssfit.errors import MaterialError
from sssfit.formats.mci import load_mci, parse_mci
from sssfit.material import load_material

SAMPLE = Path(__file__).parent / "data" / "sample.mci"
RUN = """\
{name} A
1000 # photons
0.1 0.02
10 50 1
1
1.0
{layer}
{below}
"""


def run_text(name="a.mco", layer="1.3 0.32 7.4 0 1E8", below="1.0"):
    return RUN.format(name=name, layer=layer, below=below)


def file_text(*runs):
    return "\n".join(["1.0", str(len(runs)), *runs])


def refusal(text):
    with pytest.raises(MaterialError) as error:
        parse_mci(text, "a.mci")
    line = str(error.value)
    assert line.startswith("a.mci")
    assert "\n" not in line
    return line


def refusal_or_nothing(text):
    try:
        parse_mci(text, "a.mci")
    except MaterialError as error:
        return str(error)
    return ""


def test_sample_of_the_manual():
    (run,) = load_mci(SAMPLE)
    assert (run.photons, run.output) == (1_000_000, "sample.mco")
    assert (run.grid.dr_mm, run.grid.annuli) == (0.1, 50)
    assert (run.depth_bins, run.angle_bins) == (40, 1)
    material = run.material
    assert (material.name, material.channels) == ("sample", ("mono",))
    assert (material.eta_above, material.eta_below) == (1.0, 1.0)
    assert [layer.eta for layer in material.layers] == [1.37] * 3
    assert [layer.thickness_mm for layer in material.layers] == [1.0, 1.0, 2.0]
    for name, expected in {
        "sigma_a_per_mm": [0.1, 0.1, 0.2],
        "sigma_s_per_mm": [10.0, 1.0, 1.0],
        "g": [0.9, 0.0, 0.7],
    }.items():
        assert [getattr(layer, name).tolist() for layer in material.layers] == [
            [value] for value in expected
        ]
    assert material.source == "sample.mci, run 1 of 1 (MCML)"


def test_units_are_shifted_in_decimal():
    """7.4/cm is 0.74/mm to the last bit, whatever 7.4 / 10 would round to."""
    skin1 = load_material("skin1").layers[0]
    for c, (a, s) in enumerate([("0.32", "7.4"), ("1.7", "8.8"), ("4.8", "10.1")]):
        (run,) = parse_mci(file_text(run_text(layer=f"1.3 {a} {s} 0 1e8")), "skin1.mci")
        (layer,) = run.material.layers
        assert layer.sigma_a_per_mm[0] == skin1.sigma_a_per_mm[c]
        assert layer.sigma_s_per_mm[0] == skin1.sigma_s_per_mm[c]
    assert parse_mci(file_text(run_text()), "a.mci")[0].grid.dr_mm == 0.2


@pytest.mark.parametrize(
    ("d_cm", "thickness_mm"),
    [("1E8", math.inf), ("1e7", math.inf), ("1000000", math.inf), ("999999", 9999990.0)],
)
def test_very_thick_ground_is_semi_infinite(d_cm, thickness_mm):
    (run,) = parse_mci(file_text(run_text(layer=f"1.3 1 2 0 {d_cm}", below="1.2")), "a.mci")
    assert run.material.layers[-1].thickness_mm == thickness_mm
    # Nothing lies below a semi-infinite layer.
    assert run.material.eta_below == (1.0 if math.isinf(thickness_mm) else 1.2)


def test_clear_layers_in_a_stack():
    text = file_text(run_text()).replace("1\n1.0\n1.3", "2\n1.0\n1.5 0 0 0 0.1\n1.3")
    (run,) = parse_mci(text, "a.mci")
    assert run.material.layers[0].is_clear
    assert run.material.layers[0].thickness_mm == 1.0


def test_several_runs_keep_their_order_and_names():
    runs = parse_mci(file_text(run_text("b.mco"), run_text("out\\a.run.mco")), "t.mci")
    assert [run.material.name for run in runs] == ["b", "a.run"]
    assert [run.material.source for run in runs] == [
        "t.mci, run 1 of 2 (MCML)",
        "t.mci, run 2 of 2 (MCML)",
    ]


@pytest.mark.parametrize(
    ("output", "name"),
    [
        ("skin.mco", "skin"),
        ("C:\\mc\\skin.mco", "skin"),
        ("../x/y_1.txt", "y_1"),
        ("haut(a).mco", "haut_a_"),
        (".mco", "mco"),
        ("äö.mco", "mcml"),
        ("x" * 300, "x" * 100),
    ],
)
def test_names_can_be_file_names(output, name):
    assert parse_mci(file_text(run_text(output)), "a.mci")[0].material.name == name


def test_comments_blank_lines_tabs_and_windows_ends(tmp_path):
    text = "# head\n\n" + file_text(run_text()).replace(" ", "\t").replace("\n", "#x\n\n # y\n")
    path = tmp_path / "a.mci"
    path.write_bytes(b"\xef\xbb\xbf" + text.replace("\n", "\r\n").encode())
    assert load_mci(path)[0].material == parse_mci(file_text(run_text()), "a.mci")[0].material


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "ends after line 0, before the file version"),
        ("# only\n", "ends after line 1, before the file version"),
        ("2.0\n1\n", "line 1: not an MCML input file: it begins with '2.0'; expected the file"),
        ("name = 'skin1'\n", "line 1: not an MCML input file: it begins with \"name = 'skin1'\""),
        ("mcmli2.0 # version\n", "line 1: this is a file of MCML 2.0; only the input of MCML 1"),
        ("# mine\nmcmli_3.0\n", "line 2: this is a file of MCML 3.0; only the input of MCML 1"),
        ("1.0\nmany\n", "line 2: the number of runs = 'many'; expected a whole number from 1"),
        ("1.0\n0\n", "line 2: the number of runs = '0'"),
        ("1.0\n-1\n", "line 2: the number of runs = '-1'"),
        ("1.0\n1.5\n", "line 2: the number of runs = '1.5'"),
        ("1.0\n1\n", "ends after line 2, before the output file of run 1 of 1"),
        ("1.0\n2\n" + run_text(), "ends after line 10, before the output file of run 2 of 2"),
        ("1.0\n1\n" + run_text() + run_text("b.mco"), "line 11: 'b.mco A' follows the last run"),
        (file_text(run_text()) + "garbage\n", "line 11: 'garbage' follows the last run; line 2"),
        (file_text(run_text("a.mco"), run_text("x/A.mco")), "line 12: run 2 writes 'x/A.mco'"),
        (
            file_text(run_text("a b.mco")),
            "line 3: 'a b.mco A' has 3 values; expected 2 (the output file of run 1 of 1, its",
        ),
        (file_text(run_text().replace(" A", " C")), "line 3: the format is 'C'; expected A or B"),
        (file_text(run_text().replace("1000 ", "1e6 ")), "line 4: the number of photons = '1e6'"),
        (file_text(run_text().replace("1000 ", "0 ")), "line 4: the number of photons = '0'"),
        (
            file_text(run_text().replace("0.1 0.02", "0.1")),
            "line 5: '0.1' has 1 value; expected 2 (dz, dr)",
        ),
        (file_text(run_text().replace("0.02", "0")), "line 5: dr = '0' is out of range"),
        (file_text(run_text().replace("0.1 ", "-1 ")), "line 5: dz = '-1' is out of range"),
        (file_text(run_text().replace("0.02", "nan")), "line 5: dr = 'nan' is not a number"),
        (file_text(run_text().replace("0.02", "1e999")), "line 5: dr = '1e999' is not a number"),
        (file_text(run_text().replace("10 50 1", "10 50")), "line 6: '10 50' has 2 values"),
        (file_text(run_text().replace("10 50 1", "10 50.0 1")), "line 6: number of dr = '50.0'"),
        (file_text(run_text().replace("10 50 1", "10 200000 1")), "line 6: number of dr"),
        (file_text(run_text().replace("50 1\n1\n", "50 1\n0\n")), "line 7: the number of layers"),
        (
            file_text(run_text().replace("50 1\n1\n", "50 1\n2\n")),
            "line 9: d = '1E8' of layer 1 of 2",
        ),
        (
            file_text(run_text(layer="1.3 1 2 0")),
            "line 9: '1.3 1 2 0' has 4 values; expected 5 (n of layer 1 of 1",
        ),
        (file_text(run_text(layer="1.3 1 2 0 1 9")), "line 9: '1.3 1 2 0 1 9' has 6 values"),
        (file_text(run_text(layer="1.3 x 2 0 1")), "line 9: mua = 'x' is not a number"),
        (file_text(run_text(layer="1.3 -1 2 0 1")), "line 9: mua = '-1' is out of range"),
        (file_text(run_text(layer="1.3 1 -2 0 1")), "line 9: mus = '-2' is out of range"),
        (file_text(run_text(layer="1.3 1 2 1.01 1")), "line 9: g = '1.01' is out of range"),
        (file_text(run_text(layer="1.3 1 2 -1 1")), "line 9: g = '-1' is out of range"),
        (file_text(run_text(layer="1.3 1 2 0 0")), "line 9: d = '0' is out of range"),
        (file_text(run_text(layer="1.3 1 2 0 -1")), "line 9: d = '-1' is out of range"),
        (file_text(run_text(layer="0.4 1 2 0 1")), "line 9: n = '0.4' is out of range"),
        (file_text(run_text(layer="1.3 0 9 1 1")), "line 3: run 1 of 1: sigma_a_per_mm[0]"),
        (file_text(run_text(layer="1.3 1e-12 0 0 1")), "line 9: layer 1, in mm: sigma_a_per_mm[0]"),
        (file_text(run_text(layer="1.3 0 0 0 1e8")), "line 9: layer 1 is clear"),
        (file_text(run_text(layer="1.3 0 0 0 1")), "line 3: run 1 of 1: sigma_a_per_mm[0]"),
        (file_text(run_text(below="0")), "line 10: n below = '0' is out of range"),
        (
            file_text(run_text()).replace("1\n1.0\n1.3", "2\n1.0\n1.3 1 1 0 1e8\n1.3"),
            "line 9: d = '1e8' of layer 1 of 2; only the last layer",
        ),
    ],
)
def test_bad_files_are_refused_in_one_line(text, said):
    assert said in refusal(text)


def test_every_cut_is_refused():
    text = file_text(run_text("a.mco"), run_text("b.mco", below="1.0 # end"))
    whole = text.rstrip()
    for length in range(len(whole) - len("1.0 # end")):
        refusal(text[:length])


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"1.0\n1\n\xff\xfe\n", "line 3: 'ÿþ' has 1 value; expected 2"),
        (bytes(range(256)), "is not text; expected an MCML input file"),
        (b"\x00" * 100, "is not text; expected an MCML input file"),
        (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "is not text; expected an MCML input file"),
    ],
    ids=["byte order mark", "all bytes", "zeros", "png"],
)
def test_files_that_are_no_text(tmp_path, content, said):
    path = tmp_path / "a.mci"
    path.write_bytes(content)
    with pytest.raises(MaterialError) as error:
        load_mci(path)
    assert said in str(error.value)
    assert str(error.value).startswith(str(path))
    assert "\n" not in str(error.value)


def test_letters_of_windows_never_stop_an_input(tmp_path):
    (run,) = load_mci(SAMPLE.with_name("latin1-comment.mci"))
    assert run.material.layers[0].g.tolist() == [0.9]
    # In Latin-1 the ellipsis would be NEL, which ends the line, and the rest of it no comment.
    text = "# µa de la peau… à 633\r\n" + file_text(run_text("größe.mco")).replace("\n", " # é\r\n")
    path = tmp_path / "a.mci"
    for encoding in ("utf-8", "utf-8-sig", "cp1252", "utf-16", "utf-16-le", "utf-16-be"):
        path.write_bytes(text.encode(encoding))
        (run,) = load_mci(path)
        assert run.output == "größe.mco", encoding
        assert run.material.layers == parse_mci(file_text(run_text()), "a.mci")[0].material.layers
    path.write_bytes(file_text(run_text()).replace("\n", "\x85").encode())
    assert load_mci(path)[0].photons == 1000


def test_other_bytes_elsewhere_say_how_to_save(tmp_path):
    path = tmp_path / "a.mci"
    path.write_bytes(file_text(run_text(layer="1.3 1 2 0,9µ 1")).encode("cp1252"))
    with pytest.raises(MaterialError, match=r"line 9: g = '0,9µ'.*save it as UTF-8\.$"):
        load_mci(path)


def test_g_of_one_is_no_scattering_and_n_below_one_stays():
    (run,) = load_mci(SAMPLE.with_name("water-g1.mci"))
    (layer,) = run.material.layers
    assert (layer.sigma_s_per_mm.tolist(), layer.g.tolist()) == ([0.0], [0.0])
    assert layer.sigma_a_per_mm.tolist() == [0.1]
    (run,) = parse_mci(file_text(run_text(layer="0.98 1 2 0 1", below="0.98")), "a.mci")
    assert (run.material.layers[0].eta, run.material.eta_below) == (0.98, 0.98)


def test_missing_files_and_folders(tmp_path):
    for path in (tmp_path / "none.mci", tmp_path):
        with pytest.raises(MaterialError, match="cannot be read"):
            load_mci(path)
    with pytest.raises(MaterialError, match=r"^'nu\\x00ll.mci' holds a null character, which"):
        load_mci("nu\0ll.mci")


def test_flipped_characters_are_refused_in_one_line_or_make_another_file():
    text = file_text(run_text("a.mco"), run_text("b.mco"))
    rng = np.random.default_rng(5)
    for _ in range(800):
        characters = list(text)
        for at in rng.integers(len(text), size=rng.integers(1, 4)):
            characters[at] = chr(rng.integers(1, 400))
        said = refusal_or_nothing("".join(characters))
        assert said == "" or said.startswith("a.mci")
        assert "\n" not in said


@given(
    st.floats(0, 1e9),
    st.floats(0, 1e9),
    st.floats(-1, 1, exclude_min=True, exclude_max=True),
    st.floats(1e-8, 1e5),
)
def test_any_layer_reads_as_written_or_is_refused_in_one_line(mua, mus, g, d):
    text = file_text(run_text(layer=f"1.4 {mua!r} {mus!r} {g!r} {d!r}"))
    if said := refusal_or_nothing(text):
        assert "\n" not in said
        assert mua / 10 + mus / 10 < 1.1e-9  # next to nothing, and no material
        return
    (run,) = parse_mci(text, "a.mci")
    (layer,) = run.material.layers
    np.testing.assert_allclose(layer.sigma_a_per_mm, mua / 10, rtol=1e-15, atol=1e-323)
    np.testing.assert_allclose(layer.sigma_s_per_mm, mus / 10, rtol=1e-15, atol=1e-323)
    assert layer.g[0] == g
    np.testing.assert_allclose(layer.thickness_mm, d * 10, rtol=1e-15)
