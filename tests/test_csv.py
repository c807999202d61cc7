"""Profiles as tables: what the columns mean, round trips to the bit, one line for what is wrong."""

import string
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from reference_pixels import make_profile

from sssfit.errors import ProfileError, SssfitWarning
from sssfit.formats.csv import csv_text, is_profile_csv, load_csv, parse_csv
from sssfit.material import load_material
from sssfit.profile import FORMAT
from sssfit.simulate import simulate_montecarlo

DATA = Path(__file__).parent / "data"
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
    with pytest.warns(SssfitWarning, match="begins at r = 1 mm"):
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


@pytest.mark.parametrize("quantity", ["density", "energy"])
def test_the_total_of_a_table_that_ends_has_the_error_of_its_annuli(quantity, caplog):
    """What lies beyond is taken as 0, which is said; a column without errors has none."""
    text = "r_mm,R,R_stderr,G\n0.5,0.02,0.001,0.02\n1.5,0.01,0.0005,0.01\n2.5,0.004,0.0002,0\n"
    with caplog.at_level("INFO", logger="sssfit"):
        profile = parse_csv(text, "a.csv", quantity=quantity)
    assert profile.beyond_grid_stderr.tolist() == pytest.approx([0.0, np.nan], nan_ok=True)
    total = np.sqrt((profile.annulus_energy_stderr[:, 0] ** 2).sum())
    assert profile.diffuse_reflectance_stderr.tolist() == pytest.approx(
        [total, np.nan], nan_ok=True
    )
    end = 3 if quantity == "density" else 2.5
    assert f"a.csv has no light beyond {end} mm: it is taken as 0" in caplog.text
    assert_same_bits(parse_csv(csv_text(profile), "b.csv"), profile)


def test_an_unknown_error_beyond_stays_unknown_and_needs_no_note(caplog):
    text = "r_mm,R,R_stderr\n0.5,0.02,0.001\ninf,0.01,nan\n"
    with caplog.at_level("INFO", logger="sssfit"):
        profile = parse_csv(text, "a.csv", quantity="energy")
    assert np.isnan(profile.diffuse_reflectance_stderr).all()
    assert not caplog.text


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
        and name not in ("r", "r_um", "r_mm", "r_cm", "r_m")
        and not name.endswith("_stderr")
    )
)


@st.composite
def profiles(draw):
    names = draw(st.lists(NAMES, min_size=1, max_size=4, unique=True))
    radii_mm = st.lists(st.floats(1e-12, 1e12), min_size=1, max_size=8, unique=True)
    edges_mm = draw(radii_mm.filter(lambda each: (np.diff(np.log(np.sort(each))) > 1e-8).all()))
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


@pytest.mark.parametrize(
    "names", [["R_stderr"], ["r_mm"], ["r_cm"], ["r"], [""], ["R", "R"], ["two\nlines"]]
)
def test_names_that_would_not_come_back_are_not_written(names):
    with pytest.raises(ProfileError) as error:
        csv_text(named_profile(names, np.full((2, len(names)), 0.1)))
    assert "\n" not in str(error.value)


def test_quantity_is_said_by_the_table_or_the_caller():
    table = "r_mm,R\n0.5,0.01\n1.5,0.005\n"
    with pytest.raises(ProfileError, match='give `quantity = "density"`'):
        parse_csv(table, "a.csv")
    by_comment = parse_csv("# quantity = density\n" + table, "a.csv")
    by_caller = parse_csv(table, "a.csv", quantity="density")
    assert_same_bits(by_comment, by_caller)
    with pytest.raises(ProfileError, match="quantity = 'energy', where its comment says 'density'"):
        parse_csv("# quantity = density\n" + table, "a.csv", quantity="energy")
    with pytest.raises(ProfileError, match=r"a\.csv: quantity = 'flux'; expected density or"):
        parse_csv("# quantity = flux\n" + table, "a.csv")


def table_of(radii, densities, head):
    rows = zip(radii.tolist(), densities.tolist(), strict=True)
    return "\n".join([f"{head},R", *(f"{r!r},{d!r}" for r, d in rows)])


# R_d = .3 exp(-r/.8 mm) / (2 pi .64 mm^2): all but .3 exp(-r/.8)(1 + r/.8) lies within r.
CENTRES_MM = 0.05 + 0.1 * np.arange(100)
DENSITY_PER_MM2 = 0.3 * np.exp(-CENTRES_MM / 0.8) / (2.0 * np.pi * 0.64)
MM = {"um": 1e-3, "mm": 1.0, "cm": 10.0, "m": 1000.0}


@pytest.mark.parametrize("unit", MM)
@pytest.mark.parametrize("per", MM)
def test_radii_and_densities_in_any_unit_are_the_same_profile(unit, per):
    """One physical profile, its table written in every pair of units, comes in as itself."""
    radii, densities = CENTRES_MM / MM[unit], DENSITY_PER_MM2 * MM[per] ** 2
    given = {} if per == unit else {"density_unit": per}
    mm = parse_csv(table_of(CENTRES_MM, DENSITY_PER_MM2, "r_mm"), "a.csv", quantity="density")
    named = table_of(radii, densities, f"r_{unit}")
    profile = parse_csv(named, "a.csv", quantity="density", **given)
    np.testing.assert_allclose(profile.r_edges_mm, mm.r_edges_mm, rtol=1e-12)
    np.testing.assert_allclose(profile.annulus_energy, mm.annulus_energy, rtol=1e-12)
    assert profile.diffuse_reflectance[0] == pytest.approx(0.3, rel=2e-3)
    plain = table_of(radii, densities, "r")
    same = parse_csv(plain, "a.csv", quantity="density", unit=unit, **given)
    assert_same_bits(profile, same)


def test_units_move_energies_radii_only_and_standard_errors_with_densities():
    energies = parse_csv("r_cm,R\n0.05,0.1\n0.2,0.05\ninf,0.01\n", "a.csv", quantity="energy")
    assert energies.r_edges_mm.tolist() == [0.0, 0.5, 2.0]
    assert energies.annulus_energy[:, 0].tolist() == [0.1, 0.05]
    text = "r_cm,R,R_stderr\n0.05,0.1,0.02\n0.15,0.05,0.01\n"
    errors = parse_csv(text, "a.csv", quantity="density")
    ratio = errors.annulus_energy_stderr / errors.annulus_energy
    np.testing.assert_allclose(ratio, 0.2, rtol=1e-14)


def test_a_table_in_cm_has_the_reflectance_it_was_made_with():
    """Multiplying the radii alone by 10, as a message once advised, gives .80."""
    profile = load_csv(DATA / "low-albedo-cm.csv", quantity="density")
    assert profile.diffuse_reflectance[0] == pytest.approx(0.008006, abs=5e-7)
    assert profile.r_edges_mm[-1] == pytest.approx(8.0)


@pytest.mark.parametrize(
    ("text", "given", "said"),
    [
        ("r,R\n1,0.1\n2,0.1\n", {}, "the column r does not say its unit"),
        ("r_mm,R\n1,0.1\n2,0.1\n", {"unit": "cm"}, "r_mm says mm, and the unit given is cm"),
        ("r_mm,r_cm,R\n1,0.1,0\n", {}, "r_mm and r_cm are both radii"),
        ("r,R\n1,0.1\n2,0.1\n", {"unit": "inch"}, "unit = 'inch'; expected um, mm, cm or m"),
        ("r_mm,R\n1,0\n2,0\n", {"density_unit": "km"}, "density_unit = 'km'; expected um, mm"),
        ("r_cm,R\n1,0.1\n0.5,0.1\n", {}, "'0.5' is not above the 1.0 before it"),
        ("r_cm,R\n-1,0.1\n", {}, "column 'r_cm': '-1'; expected a radius in cm"),
    ],
)
def test_units_that_cannot_be_are_refused(text, given, said):
    with pytest.raises(ProfileError) as error:
        parse_csv(text, "a.csv", quantity="density", **given)
    assert said in str(error.value)
    assert "\n" not in str(error.value)
    with pytest.raises(ProfileError, match="energies have no unit"):
        parse_csv("r_mm,R\n1,0\n2,0\n", "a.csv", quantity="energy", density_unit="mm")


@pytest.mark.parametrize(
    ("head", "radii_mm", "per_mm2", "said"),
    [
        # Micrometres under the name of millimetres: 300 180 of 1.
        ("r_mm", 1000.0, 1.0, {"unit": "um", "density_unit": "mm"}),
        # Densities per cm^2 beside millimetres: 30 of 1.
        ("r_mm", 1.0, 100.0, {"unit": "mm", "density_unit": "cm"}),
        # Millimetres under the name of centimetres, densities as the header would have them.
        ("r_cm", 1.0, 100.0, {"unit": "mm", "density_unit": "cm"}),
    ],
)
def test_more_light_than_arrives_names_the_units_that_make_it_right(head, radii_mm, per_mm2, said):
    """What the message proposes is done here, and gives the profile's own .3."""
    radii, densities = CENTRES_MM * radii_mm, DENSITY_PER_MM2 * per_mm2
    with pytest.raises(ProfileError) as error:
        parse_csv(table_of(radii, densities, head), "a.csv", quantity="density")
    line, unit = str(error.value), said["density_unit"]
    assert " of 1 that arrives; it would be 0.3002 with " in line
    assert f'`density_unit = "{unit}"`' in line
    assert (f"name the column r_{said['unit']}" in line) == (head != f"r_{said['unit']}")
    named = table_of(radii, densities, f"r_{said['unit']}")
    right = parse_csv(named, "a.csv", quantity="density", density_unit=said["density_unit"])
    assert right.diffuse_reflectance[0] == pytest.approx(0.3, rel=5e-3)


def test_more_energy_than_arrives_is_no_matter_of_units():
    said = refusal("r_mm,R\n1,1\n2,0.5\n")
    assert "'R' adds up to 1.5 of 1 that arrives" in said
    assert "divide by 100 if they are per cent" in said
    assert '`quantity = "density"`' in said
    assert "per cent" not in refusal("r_mm,R\n1,1000\n2,0.5\n")


def test_a_table_that_begins_far_out_says_what_the_gap_may_hide():
    """R_d ~ 1/r has twice the energy inside r = 1 mm that a flat one has: 2 pi .1 against pi .1."""
    text = "r_mm,R\n1,0.1\n1.1,0.09\n1.2,0.08\n"
    with pytest.warns(SssfitWarning) as caught:
        parse_csv(text, "a.csv", quantity="density")
    (line,) = (str(each.message) for each in caught)
    assert line.startswith("a.csv begins at r = 1 mm: light nearer to the beam is missing.")
    assert f"has {np.pi * 0.1:.3g} of its" in line
    assert f"another {np.pi * 0.1:.3g} is missing" in line
    # Centres of bins begin at half a bin: no gap.
    parse_csv("r_mm,R\n0.5,0.1\n1.5,0.05\n", "a.csv", quantity="density")


@pytest.mark.parametrize(("unit", "mm"), [("um", 1e-3), ("mm", 1.0), ("cm", 10.0), ("m", 1e3)])
def test_a_gap_is_said_in_the_unit_of_the_table(unit, mm):
    lines = [f"{r / mm:g},{density * mm**2:g}" for r, density in ((2, 0.01), (2.2, 0.009), (3, 0))]
    with pytest.warns(SssfitWarning) as caught:
        profile = parse_csv("\n".join([f"r_{unit},R", *lines]), "a.csv", quantity="density")
    (line,) = (str(each.message) for each in caught)
    assert line.startswith(f"a.csv begins at r = {2 / mm:g} {unit}: ")
    inside, whole = np.pi * 2**2 * 0.01, profile.diffuse_reflectance[0]
    assert f"has {inside:.3g} of its {whole:.3g} inside" in line


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "a.csv holds no table"),
        ("# comment\n\n", "a.csv holds no table"),
        ("0.5,0.1\n1,0.2\n", "line 1: numbers where names should be"),
        ("r_mm;R;G\n1;2;3\n", "line 1: 'r_mm;R;G' is one column"),
        ("r_mm\n1\n", "line 1: 'r_mm' is one column"),
        ("radius,R\n1,0.1\n", "line 1: no column is named r_mm"),
        ("r_cm,R\n1,0.1\n", "a.csv has 1 radius"),
        ("r,R\n1,0.1\n", "the column r does not say its unit; name it r_mm"),
        ("r_mm,R,R\n1,0.1,0.1\n", "line 1: the column 'R' is there twice"),
        ("r_mm,r_mm,R\n1,0.1,0.1\n", "line 1: the column 'r_mm' is there twice"),
        ("r_mm,R,\n1,0.1,\n", "line 1: a column has no name"),
        (
            "r_mm,R_stderr\n1,0.1\n2,0.1\n",
            "line 1: the column 'R_stderr' has standard errors of a column that does not exist",
        ),
        ("r_mm,R,G_stderr\n1,0.1,0.1\n", "the column 'G_stderr' has standard errors of a column"),
        ("r_mm," + ",".join(f"c{k}" for k in range(65)) + "\n", "expected 1 to 64"),
        ("r_mm,R\n", "a.csv ends after its header"),
        ("r_mm,R\n1,0.1\n", "a.csv has 1 radius; a profile needs 2 or more"),
        ("r_mm,R\ninf,0.1\n", "line 2, column 'r_mm': inf comes before any radius"),
        ("r_mm,R\n1,0.1\ninf,0\n3,0\n", "line 4: a line follows r_mm = inf"),
        ("# c\n\nr_mm,R\n1,0.1\n\n2\n", "line 6: 1 cell where the header has 2"),
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


def test_letters_of_windows_never_stop_a_table(tmp_path):
    profile = load_csv(DATA / "latin1-comment.csv", quantity="density")
    assert profile.diffuse_reflectance[0] == pytest.approx(0.785398, abs=5e-7)
    # In Latin-1 the ellipsis would be NEL, which ends the line, and the rest of it no comment.
    text = "# R_d of Müller, in 1/mm²… at 20 °C\r\nr_mm,Rückwärts\r\n0.5,0.1\r\n1.5,0.05\r\n"
    path = tmp_path / "a.csv"
    for encoding in ("utf-8", "utf-8-sig", "cp1252", "utf-16", "utf-16-le", "utf-16-be"):
        path.write_bytes(text.encode(encoding))
        profile = load_csv(path, quantity="density")
        assert profile.channels == ("Rückwärts",), encoding
        assert profile.diffuse_reflectance[0] == pytest.approx(0.785398, abs=5e-7)
    path.write_bytes("# ü\x85r_mm,R\x850.5,0.1\x851.5,0.05\x85".encode())
    assert load_csv(path, quantity="density").n_annuli == 2
    path.write_bytes(b"r_mm,R\r\n0.5,0.1\r\n1.5,0.05\r\n\x1a")  # the end as DOS marks it
    assert load_csv(path, quantity="density").n_annuli == 2


def test_other_bytes_elsewhere_say_how_to_save(tmp_path):
    path = tmp_path / "a.csv"
    path.write_bytes(b"r_mm,R\n1,\xb5\n")
    with pytest.raises(ProfileError, match=r"line 2, column 'R'.*save it as UTF-8\.$"):
        load_csv(path, quantity="energy")
    path.write_bytes("r_mm,R\n1,µ\n".encode())
    with pytest.raises(ProfileError) as error:
        load_csv(path, quantity="energy")
    assert "UTF-8" not in str(error.value)


@pytest.mark.parametrize(
    "content",
    [b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", b"PK\x03\x04\x14\0\0\0", bytes(range(256)), bytes(99)],
    ids=["png", "zip", "all bytes", "zeros"],
)
def test_files_that_are_no_text(tmp_path, content):
    path = tmp_path / "a.csv"
    path.write_bytes(content)
    with pytest.raises(ProfileError, match=r"a\.csv is not text; expected a table of a profile"):
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


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"annulus_energy": [[0.1], [-0.02]]}, "negative energy -0.02 in line 2 of the table"),
        ({"beyond_grid": [-0.01]}, "negative energy -0.01 in line 3 of the table"),
        ({"beyond_grid": [0.9]}, "adds up to 1.1 of 1 that arrives"),
    ],
)
def test_a_table_that_could_not_be_read_back_is_not_written(changes, said):
    fields = {"r_edges_mm": [0.0, 1.0, 2.0], "annulus_energy": [[0.1], [0.1]]} | changes
    with pytest.raises(ProfileError, match=said):
        csv_text(make_profile(**fields))
