"""MCML output files: units, the last bin, what must add up, and one line for what is wrong."""

import io
from pathlib import Path

import numpy as np
import pytest

from sssfit.errors import ProfileError, SssfitWarning
from sssfit.formats.mco import is_mco, join_channels, load_mco, parse_mco
from sssfit.material import Material
from sssfit.profile import Profile

DATA = Path(__file__).parent / "data"
N_Z, N_R, N_A = 4, 8, 3
DR_CM = 0.02
LAYERS = ("1.4 1 100 0.9 0.1", "1.4 2.5 10 0 0.2")
RNG = np.random.default_rng(2)
REFLECTED = 0.3 * RNG.dirichlet(np.ones(N_R))
BELOW = 0.1 * RNG.dirichlet(np.ones(N_R))
IN_LAYERS = np.array([0.41234, 0.15988])
SPECULAR = 1.0 - REFLECTED.sum() - BELOW.sum() - IN_LAYERS.sum()


def block(name, values, form="{:12.4E}", per_line=1):
    lines = [
        " ".join(form.format(value) for value in values[k : k + per_line])
        for k in range(0, len(values), per_line)
    ]
    return "\n".join([f"{name} #of what, [unit]", *lines, ""])


def mco_text(
    *, layers=LAYERS, outside=(1, 1), below=BELOW, n_r=N_R, dr_cm=DR_CM, name="skin.mco", **blocks
):
    """What MCML 1.2.2 would write of these energies, blocks replaced or, by None, left out.

    ``outside`` has n above and below the layers.
    """
    area_cm2 = 2 * np.pi * (np.arange(N_R) + 0.5) * DR_CM**2
    rat = [SPECULAR, REFLECTED.sum(), IN_LAYERS.sum(), below.sum()]
    written = {
        "RAT": block("RAT", rat, "{:<14.6G} \t#which one [-]"),
        "A_l": block("A_l", IN_LAYERS, "{:12.4G}"),
        "A_z": block("A_z", np.ones(N_Z)),
        "Rd_r": block("Rd_r", REFLECTED / area_cm2),
        "Rd_a": block("Rd_a", np.ones(N_A)),
        "Tt_r": block("Tt_r", below / area_cm2),
        "Tt_a": block("Tt_a", np.ones(N_A)),
        "A_rz": "# A[r][z]. [1/cm3]\n# ...\n" + block("A_rz", np.ones(N_R * N_Z), per_line=5),
        "Rd_ra": "# Rd[r][angle].\n" + block("Rd_ra", np.ones(N_R * N_A), per_line=5),
        "Tt_ra": "# Tt[r][angle].\n" + block("Tt_ra", np.ones(N_R * N_A), per_line=5),
    }
    head = [
        "A1 \t# Version number of the file format.",
        "\n####\n# Data categories include: \n# InParm, RAT, \n####\n",
        "# User time:  1.5 sec =     0.00 hr.   Simulation time of this run.\n",
        "InParm \t\t\t# Input parameters. cm is used.",
        f"{name} \tA\t\t# output file name, ASCII.",
        "5000 \t\t\t# No. of photons",
        f"0.05\t{dr_cm}\t\t# dz, dr [cm]",
        f"{N_Z}\t{n_r}\t{N_A}\t# No. of dz, dr, da.\n",
        f"{len(layers)}\t\t\t\t\t# Number of layers",
        "#n\tmua\tmus\tg\td\t# One line for each layer",
        f"{outside[0]}\t\t\t\t\t# n for medium above",
        *layers,
        f"{outside[1]}\t\t\t\t\t# n for medium below\n",
    ]
    return "\n".join([*head, *filter(None, (written | blocks).values())])


def refusal(text):
    with pytest.raises(ProfileError) as error:
        parse_mco(text, "a.mco")
    line = str(error.value)
    assert line.startswith("a.mco")
    assert "\n" not in line
    return line


def refusal_or_nothing(text):
    try:
        parse_mco(text, "a.mco")
    except ProfileError as error:
        return str(error)
    return ""


def test_energies_are_those_that_were_written():
    profile = parse_mco(mco_text(), "runs/skin.mco")
    np.testing.assert_allclose(profile.r_edges_mm, 10 * DR_CM * np.arange(N_R), rtol=1e-15)
    # Five printed digits; the last bin is what left beyond.
    np.testing.assert_allclose(profile.annulus_energy[:, 0], REFLECTED[:-1], rtol=6e-5)
    np.testing.assert_allclose(profile.beyond_grid, REFLECTED[-1:], rtol=6e-5)
    np.testing.assert_allclose(profile.annulus_transmittance[:, 0], BELOW[:-1], rtol=6e-5)
    np.testing.assert_allclose(profile.beyond_grid_transmittance, BELOW[-1:], rtol=6e-5)
    np.testing.assert_allclose(profile.absorbed[:, 0], IN_LAYERS, rtol=1e-3)
    assert profile.absorbed.sum() == pytest.approx(IN_LAYERS.sum(), rel=5e-6)
    assert profile.specular_reflectance == pytest.approx(SPECULAR, rel=5e-6)
    np.testing.assert_allclose(profile.transmittance, BELOW.sum(), rtol=6e-5)
    np.testing.assert_allclose(profile.energy_balance, 0.0, atol=3e-5)
    assert np.isnan(profile.annulus_energy_stderr).all()
    assert np.isnan(profile.beyond_grid_stderr).all()
    assert np.isnan(profile.diffuse_reflectance_stderr).all()


def test_density_per_mm2_is_a_hundredth_of_that_per_cm2():
    text = mco_text()
    first = float(text.split("Rd_r #")[1].split("\n")[1])
    profile = parse_mco(text, "a.mco")
    assert profile.reflectance_per_mm2[0, 0] == pytest.approx(first / 100, rel=1e-14)


def test_provenance_and_material():
    profile = parse_mco(mco_text(), "runs/skin.mco")
    assert profile.meta["method"] == "imported"
    assert profile.meta["source"] == "skin.mco"
    assert profile.photons is None
    assert profile.meta["settings"] == {"photons": [5000]}
    assert profile.channels == ("mono",)
    material = Material.from_dict(profile.meta["material"])
    assert material.name == "skin"
    assert material.sha256 == profile.meta["material_sha256"]
    assert [layer.thickness_mm for layer in material.layers] == [1.0, 2.0]
    assert material.layers[1].sigma_a_per_mm.tolist() == [0.25]


def test_semi_infinite_ground_has_no_transmittance():
    layers = (LAYERS[0], "1.4 2.5 10 0 1E+08")
    with pytest.warns(SssfitWarning, match=r"add up to 0\.9 of 1"):
        profile = parse_mco(mco_text(layers=layers, below=np.zeros(N_R)), "a.mco")
    assert profile.annulus_transmittance is None
    assert profile.beyond_grid_transmittance is None
    assert profile.transmittance is None


def test_blocks_that_a_profile_does_not_need_may_be_absent():
    unneeded = ("A_z", "Rd_a", "Tt_a", "A_rz", "Rd_ra", "Tt_ra")
    short = parse_mco(mco_text(**dict.fromkeys(unneeded)), "a.mco")
    assert short.annulus_energy.tobytes() == parse_mco(mco_text(), "a").annulus_energy.tobytes()


def test_profiles_go_through_a_file(tmp_path):
    path = tmp_path / "skin.mco"
    path.write_bytes(mco_text().replace("\n", "\r\n").encode())
    profile = load_mco(path)
    buffer = io.BytesIO()
    profile.write(buffer)
    buffer.seek(0)
    again = Profile.read(buffer)
    np.testing.assert_array_equal(
        again.beyond_grid_transmittance, profile.beyond_grid_transmittance
    )
    assert dict(again.meta) == dict(profile.meta)


def test_outputs_of_the_ports_to_gpus(tmp_path):
    """InParam, and below it the lines of the input file as they were, comments and all."""
    profile = load_mco(DATA / "cudamcml-inparam.mco")
    np.testing.assert_allclose(profile.diffuse_reflectance, 0.4, rtol=1e-6)
    np.testing.assert_allclose(profile.beyond_grid, 0.1, rtol=1e-6)
    np.testing.assert_allclose(profile.r_edges_mm, [0.0, 1.0, 2.0])
    assert profile.absorbed.tolist() == [[0.6]]
    text = mco_text().replace("InParm \t", "InParam\t").replace("5000 \t", "5000# photons\t")
    same = parse_mco(text, "skin.mco")
    assert same.annulus_energy.tobytes() == parse_mco(mco_text(), "a").annulus_energy.tobytes()
    assert same.meta["settings"] == {"photons": [5000]}


def test_comments_may_stand_before_the_version(tmp_path):
    text = "# Compiled yesterday\n\n  # by me\n" + mco_text()
    assert is_mco(text)
    assert parse_mco(text, "a.mco").n_annuli == N_R - 1


def test_letters_of_windows_never_stop_an_output(tmp_path):
    text = mco_text(name="peau_brûlée.mco").replace("# dz, dr", "# dz, dr… à 633 nm")
    path = tmp_path / "a.mco"
    for encoding in ("utf-8", "utf-8-sig", "cp1252", "utf-16", "utf-16-le", "utf-16-be"):
        path.write_bytes(text.replace("\n", "\r\n").encode(encoding))
        profile = load_mco(path)
        assert profile.meta["material"]["name"] == "peau_br_l_e", encoding
        assert profile.diffuse_reflectance[0] == pytest.approx(0.3, rel=1e-4)
    path.write_bytes(text.replace("5000 ", "5000µ ").encode("cp1252"))
    with pytest.raises(ProfileError, match=r"'5000µ'; expected.*save it as UTF-8\.$"):
        load_mco(path)
    path.write_bytes(b"B1 # Version\n\x00\x01")
    with pytest.raises(ProfileError, match="is not text; expected MCML's output in ASCII"):
        load_mco(path)


def test_energies_that_do_not_add_up_are_said():
    text = mco_text(RAT="RAT\n0.01\n0.3\n0.2\n0.1\n", A_l=block("A_l", [0.1, 0.1]))
    with pytest.warns(SssfitWarning) as caught:
        profile = parse_mco(text, "a.mco")
    (line,) = (str(each.message) for each in caught)
    assert line.startswith("a.mco: the energies of RAT add up to 0.61 of 1 (reflected 0.31, absorb")
    np.testing.assert_allclose(profile.energy_balance, -0.39, atol=3e-5)
    said = refusal(mco_text(RAT="RAT\n0.8\n0.3\n0.57222\n0.1\n"))
    assert "RAT says that 1.1 of 1 is reflected" in said


def test_channels_are_joined():
    other = mco_text(layers=("1.4 3 100 0.8 0.1", LAYERS[1]), name="g.mco")
    profiles = [parse_mco(mco_text(name="r.mco"), "r.mco"), parse_mco(other, "x/g.mco")]
    joined = join_channels(profiles, ["R", "G"])
    assert joined.channels == ("R", "G")
    for name in (
        "annulus_energy",
        "annulus_energy_stderr",
        "beyond_grid",
        "absorbed",
        "annulus_transmittance",
        "beyond_grid_transmittance",
    ):
        both = getattr(joined, name)
        for c, profile in enumerate(profiles):
            np.testing.assert_array_equal(both[..., c], getattr(profile, name)[..., 0])
    assert joined.meta["source"] == "r.mco, g.mco"
    assert joined.meta["settings"] == {"photons": [5000, 5000]}
    material = Material.from_dict(joined.meta["material"])
    assert (material.name, material.channels) == ("r+g", ("R", "G"))
    assert material.layers[0].sigma_a_per_mm.tolist() == [0.1, 0.3]
    assert material.layers[0].g.tolist() == [0.9, 0.8]


@pytest.mark.parametrize(
    ("other", "channels", "said"),
    [
        (mco_text(), ["R"], "1 channel name ('R') for 2 files"),
        (mco_text(), ["R", "R"], "channels[1] = 'R' is there twice"),
        (mco_text(), ["R", ""], "channels[1] = ''; expected a name"),
        (mco_text(layers=("1.5 1 100 0.9 0.1", LAYERS[1])), ["R", "G"], "b.mco has other layers"),
        (mco_text(layers=("1.4 1 100 0.9 0.2", LAYERS[1])), ["R", "G"], "b.mco has other layers"),
        (mco_text(outside=(1.33, 1)), ["R", "G"], "b.mco has other layers"),
        (mco_text(outside=(1, 1.33)), ["R", "G"], "b.mco has other layers"),
        (
            mco_text(layers=(*LAYERS, LAYERS[1]), A_l=block("A_l", [*IN_LAYERS[:1], 0.1, 0.05988])),
            ["R", "G"],
            "b.mco has other layers",
        ),
        (mco_text(RAT="RAT\n0.0281\n0.3\n0.57222\n0.1\n"), ["R", "G"], "b.mco has other layers"),
        (
            mco_text(
                dr_cm=0.01,
                Rd_r=block("Rd_r", REFLECTED / (2 * np.pi * (np.arange(N_R) + 0.5) * 1e-4)),
                Tt_r=block("Tt_r", BELOW / (2 * np.pi * (np.arange(N_R) + 0.5) * 1e-4)),
            ),
            ["R", "G"],
            "b.mco has 7 annuli of 0.1 mm where a.mco has 7 of 0.2 mm",
        ),
    ],
)
def test_what_does_not_belong_together_is_not_joined(other, channels, said):
    profiles = [parse_mco(mco_text(), "a.mco"), parse_mco(other, "b.mco")]
    with pytest.raises(ProfileError) as error:
        join_channels(profiles, channels)
    assert said in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "ends after line 0, before A1"),
        ("r_mm,R\n1,2\n", "line 1: 'r_mm,R' is where A1 was expected"),
        ("B1 # Version\n", "line 1: this is binary output; run MCML with format A"),
        ("A1\nRAT\n", "line 2: 'RAT' is where InParm was expected"),
        ("mcmloA2.0 # v\n", "line 1: this is a file of MCML 2.0; only the output of MCML 1 (ve"),
        (
            "mcmlo_3.0\n",
            "line 1: this is a file of MCML 3.0; only the output of MCML 1 (version A1",
        ),
        ("A1\n", "ends after line 1, before the block InParm"),
        (mco_text(RAT=None), "before the block RAT"),
        (mco_text(A_l=None), "before the block A_l"),
        (mco_text(Rd_r=None), "before the block Rd_r"),
        (mco_text(Tt_r=None), "before the block Tt_r"),
        (mco_text(A_z="A_l\n1\n2\n"), "'A_l' is where the name of a block or the end was expected"),
        (
            mco_text(A_z="Fluence\n1\n"),
            "'Fluence' is where the name of a block or the end was expected",
        ),
        (mco_text(A_z=block("A_z", np.ones(N_Z + 1))), "missing are Rd_r, Rd_a"),
        (
            mco_text(A_z=block("A_z", np.ones(N_Z - 1))),
            "'Rd_r' in the block A_z; expected a number",
        ),
        (mco_text(A_rz=block("A_rz", np.ones(33), per_line=5)), "more than its 32 numbers"),
        (mco_text(Tt_ra=block("Tt_ra", np.ones(23))), "before number 24 of 24 of the block Tt_ra"),
        (mco_text(A_z="A_z\n1\n1\nnan\n1\n"), "'nan' in the block A_z"),
        (mco_text(A_z="A_z\n1\n1\n1.#INF\n1\n"), "'1.#INF' in the block A_z"),
        (mco_text(A_z="A_z\n1\n1\n-1\n1\n"), "'-1' in the block A_z"),
        (mco_text(RAT="RAT\n0.1\n0.4\n0.57\n0.1\n"), "the block Rd_r adds up to 0.3"),
        (mco_text(RAT="RAT\n0.1\n0.3\n0.57222\n0.2\n"), "the block Tt_r adds up to 0.1"),
        (mco_text(RAT="RAT\n0.1\n0.3\n0.6\n0.1\n"), "the block A_l adds up to 0.572"),
        (mco_text(n_r=1), "1 bin over r holds all"),
        (mco_text(n_r=0), "number of dr = '0'"),
        (mco_text(layers=("1.4 1 100 2 0.1",)), "g = '2' is out of range"),
        (mco_text() + "more\n", "'more' is where the name of a block or the end was expected"),
    ],
)
def test_bad_files_are_refused_in_one_line(text, said):
    assert said in refusal(text)


def test_formats_are_told_apart():
    assert is_mco(mco_text())
    assert is_mco("B1 # Version\n\x00")
    assert is_mco((DATA / "mcml2.mco").read_text())
    assert is_mco("# mine\nmcmlo_3.0 # version\n")
    assert not any(map(is_mco, ("", "\n", "r_mm,A1\n", "A1,r_mm\n", "# A1\nr_mm,R\n")))


def test_cut_files_are_refused_or_whole_but_for_blocks_that_are_not_needed():
    text = mco_text()
    needed = text.index("Tt_a #")
    for length in range(0, len(text), 29):
        if length < needed - 2:
            refusal(text[:length])
        else:
            assert "\n" not in refusal_or_nothing(text[:length])


def test_flipped_characters_are_refused_in_one_line_or_make_another_file():
    text = mco_text()
    rng = np.random.default_rng(3)
    for _ in range(500):
        characters = list(text)
        for at in rng.integers(len(text), size=rng.integers(1, 4)):
            characters[at] = chr(rng.integers(1, 300))
        said = refusal_or_nothing("".join(characters))
        assert said == "" or said.startswith("a.mco")
        assert "\n" not in said
