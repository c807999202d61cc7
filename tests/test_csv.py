"""Profiles as tables: what the columns mean, round trips to the bit, one line for what is wrong."""

import string
import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from reference_pixels import make_profile

from sssfit.errors import ProfileError, SssfitWarning
from sssfit.material import load_material
from sssfit.profile import FORMAT
from sssfit.profile_csv import csv_text, is_profile_csv, load_csv, parse_csv
from sssfit.simulate import simulate_montecarlo

FIELDS = (
    "r_edges_mm",
    "annulus_energy",
    "annulus_energy_stderr",
    "beyond_grid",
    "beyond_grid_stderr",
)


def assert_same_bits(one, other):
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)
    assert one.channels == other.channels


def refusal(text, quantity="energy"):
    with pytest.raises(ProfileError) as error:
        parse_csv(text, "a.csv", quantity=quantity)
    line = str(error.value)
    assert line.startswith("a.csv")
    assert "\n" not in line
    return line


def refusal_or_nothing(text):
    try:
        parse_csv(text, "a.csv")
    except ProfileError as error:
        return str(error)
    return ""


def named_profile(names, energy, **changes):
    meta = {"format": FORMAT, "channels": list(names), "photons": None}
    edges_mm = np.arange(len(energy) + 1.0)
    return make_profile(edges_mm, energy, meta=meta, **changes)


def test_energies_at_outer_edges():
    profile = parse_csv(
        "r_mm,R,G\n0.5,0.1,0.2\n2,0.05,0\ninf,0.01,0.02\n", "a.csv", quantity="energy"
    )
    assert profile.channels == ("R", "G")
    assert profile.r_edges_mm.tolist() == [0.0, 0.5, 2.0]
    assert profile.annulus_energy.tolist() == [[0.1, 0.2], [0.05, 0.0]]
    assert profile.beyond_grid.tolist() == [0.01, 0.02]
    assert np.isnan(profile.annulus_energy_stderr).all()
    assert np.isnan(profile.beyond_grid_stderr).all()
    assert np.isnan(profile.energy_balance).all()
    assert profile.meta["source"] == "a.csv"
    assert (profile.meta["method"], profile.meta["material"]) == ("imported", None)
    assert profile.photons is None


def test_densities_at_unequal_radii():
    """Edges half-way between, the last as far out as its annulus is deep; energy = R_d area."""
    profile = parse_csv("r_mm,R\n1,0.01\n2,0.005\n4,0.001\n", "a.csv", quantity="density")
    assert profile.r_edges_mm.tolist() == [0.0, 1.5, 3.0, 5.0]
    areas = np.pi * np.diff(np.square([0.0, 1.5, 3.0, 5.0]))
    np.testing.assert_allclose(profile.annulus_energy[:, 0], areas * [0.01, 0.005, 0.001])
    np.testing.assert_allclose(profile.reflectance_per_mm2[:, 0], [0.01, 0.005, 0.001])
    assert profile.beyond_grid.tolist() == [0.0]


def test_density_at_the_axis_and_its_errors():
    text = "r_mm,R_stderr,R\n0,0.002,0.1\n1,nan,0.05\n"
    profile = parse_csv(text, "a.csv", quantity="density")
    assert profile.r_edges_mm.tolist() == [0.0, 0.5, 1.5]
    np.testing.assert_allclose(
        profile.annulus_energy_stderr[:, 0], [0.002 * np.pi * 0.25, np.nan], rtol=1e-14
    )


def test_densities_of_bin_centres_are_the_energies_they_came_from():
    walk = simulate_montecarlo(load_material("skin1"), photons=20_000)
    centres_mm = 0.5 * (walk.r_edges_mm[1:] + walk.r_edges_mm[:-1])
    rows = np.column_stack((centres_mm, walk.reflectance_per_mm2)).tolist()
    text = "\n".join(["r_mm,R,G,B", *(",".join(map(repr, row)) for row in rows)])
    profile = parse_csv(text, "a.csv", quantity="density")
    np.testing.assert_allclose(profile.r_edges_mm, walk.r_edges_mm, rtol=1e-12)
    np.testing.assert_allclose(profile.annulus_energy, walk.annulus_energy, rtol=1e-9)


def test_order_of_columns_comments_quotes_and_line_ends():
    text = '# mine\r\n\r\n"R, red", r_mm\r\n# between\r\n 0.1 ,0.5\r\n2e-2, "2"\r\n\r\n'
    profile = parse_csv(text.replace("\r\n", "\n"), "a.csv", quantity="energy")
    assert profile.channels == ("R, red",)
    assert profile.annulus_energy.tolist() == [[0.1], [0.02]]


def test_files_of_other_systems(tmp_path):
    path = tmp_path / "a.csv"
    path.write_bytes(b"\xef\xbb\xbfr_mm,R\r\n1,0.1\r\n2,0.1\r\n")
    assert load_csv(path, quantity="energy").n_annuli == 2
    path.write_bytes(b"r_mm,R\r1,0.1\r2,0.1\r")
    assert load_csv(path, quantity="energy").n_annuli == 2


def test_walks_come_back_to_the_bit(tmp_path):
    walk = simulate_montecarlo(load_material("skin1"), photons=20_000)
    text = csv_text(walk)
    assert_same_bits(walk, parse_csv(text, "a.csv"))
    assert_same_bits(walk, parse_csv(text, "a.csv", quantity="energy"))
    assert csv_text(parse_csv(text, "a.csv")).split("\n")[3:] == text.split("\n")[3:]
    path = tmp_path / "a.csv"
    path.write_text(text)
    assert is_profile_csv(path)
    path.write_text("r_mm,R\n")
    assert not is_profile_csv(path)
    assert not is_profile_csv(tmp_path)
    assert not is_profile_csv(tmp_path / "none")


NAMES = st.text(
    st.one_of(st.sampled_from(string.ascii_letters + ' ,"#;_'), st.characters(codec="utf-8")),
    min_size=1,
    max_size=12,
).filter(
    lambda name: (
        name.isprintable()
        and name.strip() == name
        and name != "r_mm"
        and not name.endswith("_stderr")
    )
)


@st.composite
def profiles(draw):
    names = draw(st.lists(NAMES, min_size=1, max_size=4, unique=True))
    edges_mm = draw(st.lists(st.floats(1e-300, 1e12), min_size=1, max_size=8, unique=True))
    energies = st.floats(0, 1 / 9)
    errors = st.one_of(st.just(np.nan), st.floats(0, 1e9))
    shape = len(edges_mm) + 1, len(names)

    def array(values):
        size = shape[0] * shape[1]
        return np.array(draw(st.lists(values, min_size=size, max_size=size))).reshape(shape)

    energy, stderr = array(energies), array(errors)
    return make_profile(
        [0.0, *sorted(edges_mm)],
        energy[:-1],
        annulus_energy_stderr=stderr[:-1],
        beyond_grid=energy[-1],
        beyond_grid_stderr=stderr[-1],
        meta={"format": FORMAT, "channels": names, "photons": None},
    )


@given(profiles())
def test_any_profile_comes_back_to_the_bit(profile):
    assert_same_bits(profile, parse_csv(csv_text(profile), "a.csv"))


@pytest.mark.parametrize("names", [["R_stderr"], ["r_mm"], [""], ["R", "R"], ["two\nlines"]])
def test_names_that_would_not_come_back_are_not_written(names):
    with pytest.raises(ProfileError) as error:
        csv_text(named_profile(names, np.full((2, len(names)), 0.1)))
    assert "\n" not in str(error.value)


def test_quantity_is_said_by_the_table_or_the_caller():
    table = "r_mm,R\n1,0.01\n2,0.005\n"
    with pytest.raises(ProfileError, match="give --quantity density"):
        parse_csv(table, "a.csv")
    by_comment = parse_csv("# quantity = density\n" + table, "a.csv")
    by_caller = parse_csv(table, "a.csv", quantity="density")
    assert_same_bits(by_comment, by_caller)
    with pytest.raises(ProfileError, match="quantity = 'energy', where its comment says 'density'"):
        parse_csv("# quantity = density\n" + table, "a.csv", quantity="energy")
    with pytest.raises(ProfileError, match=r"a\.csv: quantity = 'flux'; expected density or"):
        parse_csv("# quantity = flux\n" + table, "a.csv")


def test_more_light_than_arrives_is_pointed_out():
    with pytest.warns(SssfitWarning, match=r"a\.csv: 'R' adds up to 1\.5 of 1 .* per cm\^2"):
        parse_csv("r_mm,R\n1,1\n2,0.5\n", "a.csv", quantity="energy")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "a.csv holds no table"),
        ("# comment\n\n", "a.csv holds no table"),
        ("0.5,0.1\n1,0.2\n", "line 1: numbers where names should be"),
        ("r_mm;R;G\n1;2;3\n", "line 1: 'r_mm;R;G' is one column"),
        ("r_mm\n1\n", "line 1: 'r_mm' is one column"),
        ("radius,R\n1,0.1\n", "line 1: no column is named r_mm"),
        ("r_cm,R\n1,0.1\n", "line 1: 'r_cm' is not in mm: multiply it by 10 and name it r_mm"),
        ("r_um,R\n1,0.1\n", "divide it by 1000"),
        ("r,R\n1,0.1\n", "'r' is not in mm: convert it to mm"),
        ("r_mm,R,R\n1,0.1,0.1\n", "line 1: the column 'R' is there twice"),
        ("r_mm,r_mm,R\n1,0.1,0.1\n", "line 1: the column 'r_mm' is there twice"),
        ("r_mm,R,\n1,0.1,\n", "line 1: a column has no name"),
        ("r_mm,R_stderr\n1,0.1\n2,0.1\n", "line 1: channels = [] has 0 names"),
        ("r_mm,R,G_stderr\n1,0.1,0.1\n", "the column 'G_stderr' has standard errors of a column"),
        ("r_mm," + ",".join(f"c{k}" for k in range(65)) + "\n", "expected 1 to 64"),
        ("r_mm,R\n", "a.csv ends after its header"),
        ("r_mm,R\n1,0.1\n", "a.csv has 1 radius; a profile needs 2 or more"),
        ("r_mm,R\ninf,0.1\n", "line 2, column 'r_mm': inf comes before any radius"),
        ("r_mm,R\n1,0.1\ninf,0\n3,0\n", "line 4: a line follows r_mm = inf"),
        ("# c\n\nr_mm,R\n1,0.1\n\n2\n", "line 6: 1 cells where the header has 2"),
        ("r_mm,R\n1,0.1,0.2\n", "line 2: 3 cells where the header has 2"),
        ("r_mm,R\n0,5,0,1\n", "line 2: 4 cells where the header has 2"),
        ("r_mm,R,G\n1,0.1,\n", "line 2, column 'G': the cell is empty"),
        ("r_mm,R\n,0.1\n", "line 2, column 'r_mm': the cell is empty"),
        ("r_mm,R\n1,0.1\n2,nan\n", "line 3, column 'R': 'nan' is not a finite number"),
        ("r_mm,R\n1,inf\n", "line 2, column 'R': 'inf' is not a finite number"),
        ("r_mm,R\n1,1e999\n", "line 2, column 'R': '1e999' is not a finite number"),
        ("r_mm,R\n1,1_0\n", "line 2, column 'R': '1_0' is not a finite number"),
        ("r_mm,R\n1,some\n", "line 2, column 'R': 'some' is not a finite number"),
        ("r_mm,R\n1,-0.1\n", "line 2, column 'R': '-0.1' is negative"),
        ("r_mm,R\n1,1e13\n", "line 2, column 'R': '1e13' is out of range"),
        ("r_mm,R,R_stderr\n1,0.1,-1\n", "line 2, column 'R_stderr': '-1' is negative"),
        ("r_mm,R,R_stderr\n1,0.1,\n", "line 2, column 'R_stderr': the cell is empty"),
        ("r_mm,R\nnan,0.1\n", "line 2, column 'r_mm': 'nan' is not a finite number"),
        ("r_mm,R\n-1,0.1\n", "line 2, column 'r_mm': '-1'; expected a radius in mm"),
        ("r_mm,R\n-inf,0.1\n", "line 2, column 'r_mm': '-inf' is not a finite number"),
        ("r_mm,R\n0,0.1\n", "the outer edge of an annulus, above 0"),
        ("r_mm,R\n1e13,0.1\n", "line 2, column 'r_mm': '1e13'; expected a radius in mm"),
        ("r_mm,R\n2,0.1\n1,0.1\n", "line 3, column 'r_mm': '1' is not above the 2.0 before it"),
        ("r_mm,R\n2,0.1\n2.0,0.1\n", "line 3, column 'r_mm': '2.0' is not above the 2.0"),
        ('r_mm,R\n1,"0.1\n2,0.1\n', "line 2: not valid CSV"),
        ("r_mm,R\n1,0.1\n2,\x00\n", "line 3, column 'R': '\\x00' is not a finite number"),
    ],
)
def test_bad_tables_are_refused_in_one_line(text, said):
    assert said in refusal(text)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("r_mm,R\n1,0.1\ninf,0\n", "line 3, column 'r_mm': inf; what lies beyond"),
        ("r_mm,R\n-1,0.1\n", "expected a radius in mm, 0 up"),
        ("r_mm,R\n1,0.1\n", "a.csv has 1 radius"),
        (
            "r_mm,R\n1.0000000000000002,0\n1.0000000000000004,0\n",
            "a.csv: r_edges_mm is not strictly increasing",
        ),
    ],
)
def test_bad_tables_of_densities(text, said):
    assert said in refusal(text, "density")


def test_files_that_are_no_text(tmp_path):
    path = tmp_path / "a.csv"
    path.write_bytes(b"r_mm,R\n1,\xb5\n")
    with pytest.raises(ProfileError, match=r"a\.csv: line 2 holds the byte 0xb5"):
        load_csv(path)
    with pytest.raises(ProfileError, match="cannot be read: no such file"):
        load_csv(tmp_path / "none.csv")


def test_cut_and_flipped_tables_are_refused_in_one_line_or_make_another():
    profile = named_profile(["R", "G"], np.full((12, 2), 0.01), beyond_grid=[0.1, 0.2])
    text = csv_text(profile)
    rng = np.random.default_rng(9)
    trials = [text[:length] for length in range(0, len(text), 7)]
    for _ in range(600):
        characters = list(text)
        for at in rng.integers(len(text), size=rng.integers(1, 4)):
            characters[at] = chr(rng.integers(1, 300))
        trials.append("".join(characters))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SssfitWarning)
        for trial in trials:
            said = refusal_or_nothing(trial)
            assert said == "" or said.startswith("a.csv")
            assert "\n" not in said
