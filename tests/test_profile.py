"""The profile record, its statistics, its file, and what a damaged file says."""

import copy
import dataclasses
import io
import json
import os
import pickle
import zipfile

import numpy as np
import pytest
from reference_pixels import make_profile, one_over_r_profile, walk_tallies

from sssfit.errors import FileError, ProfileError
from sssfit.material import Layer, load_material
from sssfit.profile import FORMAT, Profile, is_profile_file, npz

META = {
    "format": FORMAT,
    "channels": ["R", "G"],
    "material": {"name": "skin1", "sigma_a_per_mm": [0.032, 0.17]},
    "method": "montecarlo",
    "photons": 1000,
    "seed": 1,
    "version": "0.1.0",
}


def full_profile(**changes):
    """Every field holds something."""
    rng = np.random.default_rng(3)
    fields = {
        "r_edges_mm": [0.0, 0.1, 0.3, 1.0, 4.0],
        "annulus_energy": rng.random((4, 2)) / 10,
        "annulus_energy_stderr": rng.random((4, 2)) / 1000,
        "beyond_grid": [0.01, 0.02],
        "beyond_grid_stderr": [0.001, np.nan],
        "specular_reflectance": 0.017,
        "absorbed": rng.random((3, 2)),
        "unfinished": [0.0, 1e-9],
        "annulus_transmittance": rng.random((4, 2)),
        "meta": META,
    }
    return Profile(**(fields | changes))


def nested(depth):
    """A list in a list in a list."""
    value = []
    for _ in range(depth):
        value = [value]
    return {"deep": value}


def field_values(profile):
    names = [*npz.REQUIRED, *npz.OPTIONAL]
    return {name: getattr(profile, name) for name in names}


def assert_same(one, other):
    for name, value in field_values(one).items():
        np.testing.assert_array_equal(getattr(other, name), value, strict=True)
    assert dict(one.meta) == dict(other.meta)


def test_arrays_are_read_only_copies_and_meta_too():
    energy = np.ones((2, 1))
    profile = make_profile([0.0, 1.0, 2.0], energy)
    energy[0] = 7
    assert profile.annulus_energy[0, 0] == 1
    for value in field_values(profile).values():
        if isinstance(value, np.ndarray):
            assert value.dtype == np.float64
            assert not value.flags.writeable
    with pytest.raises(TypeError):
        profile.meta["seed"] = 2
    with pytest.raises(AttributeError):
        profile.beyond_grid = energy


def test_sizes_names_and_totals():
    profile = full_profile()
    assert (profile.n_annuli, profile.n_channels) == (4, 2)
    assert profile.channels == ("R", "G")
    total = profile.annulus_energy.sum(axis=0)
    np.testing.assert_allclose(profile.total_on_grid, total, rtol=1e-15)
    np.testing.assert_allclose(profile.diffuse_reflectance - total, [0.01, 0.02], rtol=1e-13)
    assert profile.cumulative.shape == profile.cumulative_stderr.shape == (5, 2)
    assert (profile.cumulative[0] == 0).all()
    np.testing.assert_allclose(profile.cumulative[-1], total, rtol=1e-15)


def test_energy_balance_counts_everything():
    profile = full_profile()
    total = 0.017 + profile.diffuse_reflectance + profile.absorbed.sum(axis=0) + profile.unfinished
    total += profile.annulus_transmittance.sum(axis=0)
    np.testing.assert_allclose(profile.energy_balance, total - 1, atol=1e-15)


def test_transmittance_counts_what_lies_beyond_the_grid():
    on_grid = full_profile()
    below = on_grid.annulus_transmittance.sum(axis=0)
    np.testing.assert_array_equal(on_grid.transmittance, below)
    profile = full_profile(beyond_grid_transmittance=[0.01, 0.03])
    np.testing.assert_allclose(profile.transmittance - below, [0.01, 0.03], rtol=1e-12)
    np.testing.assert_allclose(profile.energy_balance - on_grid.energy_balance, [0.01, 0.03])
    assert full_profile(annulus_transmittance=None).transmittance is None


def test_energy_balance_is_unknown_where_absorption_is():
    profile = full_profile(absorbed=np.zeros((0, 2)))
    assert np.isnan(profile.energy_balance).all()
    assert_same(profile, Profile.read(io.BytesIO(contents(profile))))


def test_density_is_energy_over_area():
    profile = make_profile([0.0, 1.0, 3.0], [[np.pi], [8 * np.pi]])
    np.testing.assert_allclose(profile.reflectance_per_mm2, [[1.0], [1.0]], rtol=1e-15)
    stderr = full_profile().reflectance_per_mm2_stderr
    expected = full_profile().annulus_energy_stderr[1] / (np.pi * (0.3**2 - 0.1**2))
    np.testing.assert_allclose(stderr[1], expected, rtol=1e-13)


def test_cumulative_at_is_exact_at_edges_and_monotone_between():
    profile = full_profile()
    np.testing.assert_array_equal(profile.cumulative_at(profile.r_edges_mm), profile.cumulative)
    np.testing.assert_array_equal(profile.cumulative_at(1e9), profile.cumulative[-1])
    np.testing.assert_array_equal(profile.cumulative_at(np.inf), profile.cumulative[-1])
    radii = np.linspace(0, 4.5, 1000).reshape(10, 100)
    values = profile.cumulative_at(radii)
    assert values.shape == (10, 100, 2)
    assert (np.diff(values.reshape(1000, 2), axis=0) >= -1e-16).all()


def test_cumulative_at_follows_smooth_profiles():
    profile = one_over_r_profile(100, 1.0, [20.0])
    radii = np.linspace(0, 100, 1234)
    # Third order: the error of a parabola's slope, F''' dr^2 / 6, times dr / 4 in a cubic Hermite.
    np.testing.assert_allclose(
        profile.cumulative_at(radii)[:, 0], -20 * np.expm1(-radii / 20), atol=2 * 20 / 20**3 / 24
    )


def test_one_annulus_is_enough():
    profile = make_profile([0.0, 2.0], [[0.5]])
    np.testing.assert_allclose(profile.cumulative_at([0.5, 1.0]), [[0.125], [0.25]])
    assert profile.line_kernel(1.0).sum() == pytest.approx(0.5)


@pytest.mark.parametrize("radius", [-0.1, float("nan")])
def test_cumulative_at_refuses_negative_radii(radius):
    with pytest.raises(ProfileError, match="from 0 up"):
        full_profile().cumulative_at([1.0, radius])


def test_errors_of_sums_are_those_of_the_raw_walks():
    rng = np.random.default_rng(11)
    photons, n_bins = 3000, 6  # five annuli and what lies beyond them
    weights = rng.random(photons) ** 2
    bins = rng.choice(np.arange(-1, n_bins), size=photons, p=[0.3, 0.2, 0.2, 0.1, 0.1, 0.06, 0.04])
    raw, energy, stderr = walk_tallies(weights, bins, n_bins)
    profile = make_profile(
        np.arange(6.0),
        energy[:5, None],
        annulus_energy_stderr=stderr[:5, None],
        beyond_grid=energy[5:],
        beyond_grid_stderr=stderr[5:],
        meta=META | {"photons": photons, "channels": ["R"]},
    )
    direct = np.cumsum(raw, axis=1).std(axis=0, ddof=1) / np.sqrt(photons)
    np.testing.assert_allclose(profile.cumulative_stderr[1:, 0], direct[:5], rtol=1e-10)
    np.testing.assert_allclose(profile.diffuse_reflectance_stderr[0], direct[5], rtol=1e-10)
    np.testing.assert_allclose(profile.cumulative[1:, 0], raw.mean(axis=0).cumsum()[:5])
    # What adding variances would say instead: the anticorrelation matters.
    assert np.sqrt((stderr**2).sum()) > 1.1 * direct[5]


def test_errors_of_sums_without_photons_or_with_one():
    exact = full_profile(meta=META | {"photons": None}, annulus_energy_stderr=np.full((4, 2), 3e-5))
    np.testing.assert_allclose(exact.cumulative_stderr[-1], 6e-5, rtol=1e-14)
    single = full_profile(meta=META | {"photons": 1})
    assert np.isnan(single.cumulative_stderr[1:]).all()
    assert np.isnan(full_profile().diffuse_reflectance_stderr[1])  # its beyond_grid has no error


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"annulus_energy": np.ones(4)}, "annulus_energy has shape (4,)"),
        ({"annulus_energy": np.ones((0, 2))}, "annulus_energy has shape (0, 2)"),
        ({"annulus_energy": "much"}, "annulus_energy is not an array of numbers"),
        ({"annulus_energy": np.full((4, 2), np.nan)}, "annulus_energy holds nan"),
        ({"annulus_energy_stderr": np.full((4, 2), -1.0)}, "annulus_energy_stderr holds -1.0"),
        ({"annulus_energy_stderr": np.full((4, 2), np.inf)}, "annulus_energy_stderr holds inf"),
        ({"annulus_energy_stderr": np.ones((4, 1))}, "expected (4, 2)"),
        ({"r_edges_mm": [0.0, 1.0, 2.0]}, "one edge more than annuli"),
        ({"r_edges_mm": [0.0, 1.0, 1.0, 2.0, 3.0]}, "not strictly increasing"),
        ({"r_edges_mm": [0.0, 1.0, 2.0, 3.0, np.inf]}, "not strictly increasing"),
        ({"r_edges_mm": [0.1, 1.0, 2.0, 3.0, 4.0]}, "starts at 0.1"),
        ({"beyond_grid": [0.0]}, "beyond_grid has shape (1,); expected (2,)"),
        ({"beyond_grid": None}, "beyond_grid is not an array of numbers"),
        ({"specular_reflectance": [0.1]}, "specular_reflectance has shape (1,)"),
        ({"absorbed": [0.1, 0.2]}, "absorbed has shape (2,)"),
        ({"unfinished": [0.1, np.inf]}, "unfinished holds inf"),
        ({"annulus_transmittance": np.ones((3, 2))}, "annulus_transmittance has shape (3, 2)"),
        ({"beyond_grid_transmittance": [1.0]}, "beyond_grid_transmittance has shape (1,)"),
        ({"beyond_grid_transmittance": [1.0, np.nan]}, "beyond_grid_transmittance holds nan"),
        (
            {"annulus_transmittance": None, "beyond_grid_transmittance": [0.1, 0.1]},
            "given without annulus_transmittance",
        ),
        ({"meta": {}}, "meta has format None"),
        ({"meta": META | {"channels": ["R"]}}, "expected a list of 2 names"),
        ({"meta": META | {"photons": 0}}, "meta.photons = 0"),
        ({"meta": META | {"when": io}}, "meta cannot be kept as JSON"),
        ({"meta": META | {"gain": float("nan")}}, "meta cannot be kept as JSON"),
        ({"meta": META | {"gain": float("nan")}}, "meta.gain = nan is not a finite number"),
        ({"meta": None}, "meta = None; expected a mapping"),
        ({"meta": META | {"settings": {"a": [1, 10**400]}}}, "meta.settings.a[1] = 1000"),
        ({"meta": META | {"settings": {"a": "\ud800"}}}, "meta.settings.a holds half of a char"),
        ({"meta": META | {"settings": {3: 1}}}, "meta.settings has the key 3"),
        ({"meta": META | {"settings": [1]}}, "meta.settings = [1]; expected a mapping"),
        ({"meta": META | {"settings": nested(5000)}}, "nested too deep"),
        ({"meta": META | {"photons": "many"}}, "meta.photons = 'many'; expected a whole number"),
        ({"meta": META | {"photons": True}}, "meta.photons = True"),
        ({"meta": META | {"photons": 1e7}}, "meta.photons = 10000000.0"),
        ({"meta": META | {"photons": 10**400}}, "meta.photons = 1000"),
        ({"meta": META | {"seed": -1}}, "meta.seed = -1"),
        ({"meta": META | {"seed": "1"}}, "meta.seed = '1'"),
        (
            {"meta": META | {"version": "1\n2"}},
            r"meta.version = '1\n2'; expected a text that print",
        ),
        ({"meta": META | {"version": 1}}, "meta.version = 1"),
        ({"meta": META | {"method": "a\x1b[31m"}}, "meta.method"),
        ({"meta": META | {"channels": ["R", "R"]}}, "channels[1] = 'R' is there twice"),
        ({"meta": META | {"channels": ["R", "G\n"]}}, r"channels[1] = 'G\n'; expected a name"),
        ({"meta": META | {"channels": ["R", 1]}}, "channels[1] = 1; expected a name"),
        ({"meta": META | {"material": "skin1"}}, "meta.material = 'skin1'; expected a mapping"),
        ({"meta": META | {"material_sha256": 5}}, "meta.material_sha256 = 5"),
        ({"meta": META | {"material_sha256": "5"}}, "meta.material is not a material"),
        ({"meta": META | {"relative_error": "low"}}, "meta.relative_error = 'low'"),
        ({"meta": META | {"relative_error": -0.1}}, "meta.relative_error = -0.1"),
        ({"meta": META | {"energy_balance_stderr": [0.1]}}, "for each of 2 channels"),
        ({"meta": META | {"energy_balance_stderr": ["a", True]}}, "meta.energy_balance_stderr ="),
        ({"annulus_energy": np.full((4, 2), "0.1")}, "annulus_energy is not an array of numbers"),
        ({"annulus_energy": np.full((4, 2), True)}, "annulus_energy is not an array of numbers"),
        ({"annulus_energy": np.full((4, 2), 1j)}, "annulus_energy is not an array of numbers"),
        ({"beyond_grid": [0.1, True]}, "beyond_grid is not an array of numbers"),
        ({"beyond_grid": [0.1, "0.1"]}, "beyond_grid is not an array of numbers"),
        ({"beyond_grid": [0.1, 10**400]}, "beyond_grid is not an array of numbers"),
        ({"beyond_grid": [[0.1], 0.1]}, "beyond_grid is not an array of numbers"),
        ({"annulus_energy": np.full((4, 2), -1e200)}, "annulus_energy holds -1e+200 at [0, 0]"),
        ({"annulus_energy_stderr": np.full((4, 2), 1e200)}, "holds 1e+200 at [0, 0]"),
        ({"absorbed": np.full((1, 2), 1e200)}, "absorbed holds 1e+200"),
        ({"specular_reflectance": 1.5}, "specular_reflectance = 1.5; expected 0 to 1"),
        ({"r_edges_mm": [0.0, 1e-300, 2.0, 3.0, 4.0]}, "expected radii from 1e-12 to 1e+12 mm"),
        ({"r_edges_mm": [0.0, 1.0, 2.0, 3.0, 1e300]}, "expected radii from 1e-12 to 1e+12 mm"),
        ({"r_edges_mm": [0.0, 1.0, np.nextafter(1.0, 2.0), 3.0, 4.0]}, "[1] and [2] are 2.2e-16"),
    ],
)
def test_fields_that_do_not_fit_are_refused_in_one_line(changes, said):
    with pytest.raises(ProfileError) as error:
        full_profile(**changes)
    assert said in str(error.value)
    assert "\n" not in str(error.value)


def test_coefficients_must_be_those_of_the_fingerprint():
    material = load_material("skin1")
    material = dataclasses.replace(
        material,
        channels=("R", "G"),
        layers=(Layer(1.3, [0.0, 0.0], [0.1, 0.2], [1.0, 2.0]),),
    )
    record = material.to_dict()
    good = META | {"material": record, "material_sha256": material.sha256}
    assert full_profile(meta=good).meta["material_sha256"] == material.sha256
    edited = copy.deepcopy(record)
    edited["layers"][0]["sigma_a_per_mm"][1] *= 2.0
    with pytest.raises(ProfileError, match=r"meta.material_sha256 is not that of meta.material"):
        full_profile(meta=good | {"material": edited})
    with pytest.raises(ProfileError, match=r"meta.channels = \['G', 'R'\], but meta.material has"):
        full_profile(meta=good | {"channels": ["G", "R"]})


def test_the_fingerprint_is_that_of_the_light():
    profile = full_profile()
    assert len(profile.sha256) == 64
    assert full_profile(meta=META | {"version": "9", "photons": 7}).sha256 == profile.sha256
    assert full_profile(absorbed=np.zeros((0, 2))).sha256 == profile.sha256
    assert pickle.loads(pickle.dumps(profile)).sha256 == profile.sha256
    assert Profile.read(io.BytesIO(contents(profile))).sha256 == profile.sha256
    changed = [
        {"annulus_energy": profile.annulus_energy * np.nextafter(1.0, 2.0)},
        {"beyond_grid": [0.01, 0.021]},
        {"r_edges_mm": [0.0, 0.1, 0.3, 1.0, 4.5]},
        {"meta": META | {"channels": ["R", "B"]}},
    ]
    found = {full_profile(**each).sha256 for each in changed}
    assert len(found | {profile.sha256}) == 5


def test_records_can_be_copied_and_sent_to_other_processes():
    profile = full_profile(beyond_grid_transmittance=[0.01, 0.02])
    assert_same(profile, pickle.loads(pickle.dumps(profile)))
    assert_same(profile, copy.deepcopy(profile))


@pytest.mark.parametrize(
    ("changes", "n_arrays"),
    [
        ({"annulus_transmittance": None}, 9),
        ({}, 10),  # as files were before beyond_grid_transmittance
        ({"beyond_grid_transmittance": [0.01, 0.02]}, 11),
    ],
)
def test_files_hold_every_bit(tmp_path, changes, n_arrays):
    profile = full_profile(**changes)
    path = tmp_path / "skin1.profile.npz"
    profile.save(path)
    assert_same(profile, Profile.load(path))
    with np.load(path, allow_pickle=False) as arrays:  # as anyone would without this package
        np.testing.assert_array_equal(arrays["annulus_energy"], profile.annulus_energy)
        assert json.loads(str(arrays["meta"])) == META
        assert len(arrays.files) == n_arrays


def test_same_content_gives_same_bytes(tmp_path):
    reordered = dict(reversed(META.items()))
    full_profile().save(tmp_path / "a")
    full_profile(meta=reordered).save(tmp_path / "b")
    Profile.load(tmp_path / "a").save(str(tmp_path / "c"))
    a, b, c = ((tmp_path / name).read_bytes() for name in "abc")
    assert a == b == c


def test_streams_that_cannot_seek_serve(tmp_path):
    read_end, write_end = os.pipe()
    profile = full_profile()
    with os.fdopen(write_end, "wb") as stream:
        profile.write(stream)
    with os.fdopen(read_end, "rb") as stream:
        assert_same(profile, Profile.read(stream, "standard input"))
    profile.save(tmp_path / "file")
    buffer = io.BytesIO()
    profile.write(buffer)
    assert buffer.getvalue() == (tmp_path / "file").read_bytes()


def test_a_failed_save_leaves_the_older_file(tmp_path):
    with pytest.raises(FileError):
        full_profile().save(tmp_path / "missing" / "a.profile.npz")


def test_own_files_are_told_from_others(tmp_path):
    own, other, text = (tmp_path / name for name in ("own", "other", "text"))
    full_profile().save(own)
    np.savez(other, values=np.ones(3))
    text.write_text("r, R_d\n")
    assert is_profile_file(own)
    assert not any(map(is_profile_file, (other, text, tmp_path, tmp_path / "none")))


def contents(profile):
    buffer = io.BytesIO()
    profile.write(buffer)
    return buffer.getvalue()


def test_values_of_the_monotone_interpolation():
    """Edges 0 1 2 3, energies 1 .2 .04, by hand (Fritsch and Carlson 1980).

    Chords 1 .2 .04; slopes at 1 and 2 are their means .6 and .12, within three times the smaller
    chord (.6 and .12). F(1.5) = 1 + .1 + (.6 - .12)/8 = 1.16, F(2.5) = 1.2 + .02 + (.12 - 0)/8, the
    slope at 3 being 2 x .04 - .12, below 0, so 0. F(.5) = .5 + (1.4 - .6)/8, the slope at 0 being
    2 x 1 - .6.
    """
    profile = make_profile([0.0, 1.0, 2.0, 3.0], [[1.0], [0.2], [0.04]])
    radii_mm = [0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 9.0]
    values = profile.cumulative_at(radii_mm)[:, 0]
    np.testing.assert_allclose(values, [0.6, 1.0, 1.16, 1.2, 1.235, 1.24, 1.24], rtol=1e-14)


def archive(**changes):
    """The bytes of a profile with members replaced or, by None, left out."""
    members = field_values(full_profile()) | {"meta": np.array(json.dumps(META))}
    buffer = io.BytesIO()
    np.savez(buffer, **{k: v for k, v in (members | changes).items() if v is not None})
    return buffer.getvalue()


def edited_meta(old, new):
    """The text of the meta as somebody edited it."""
    text = json.dumps(META)
    assert old in text
    return np.array(text.replace(old, new))


def damaged_header():
    """A member whose header claims 8 TB, in a file of a few kB."""
    plain = archive()
    claim = b"'shape': (4, 2), }" + b" " * 10
    at = plain.index(claim)
    huge = b"'shape': (1000000000000,), }"
    return plain[:at] + huge + plain[at + len(claim) :]


def bomb():
    """An archive that says it holds more than 2 GB; its directory is all that is read."""
    buffer = io.BytesIO(archive())
    with zipfile.ZipFile(buffer, "a") as target:
        target.getinfo("unfinished.npy").file_size = 3_000_000_000
        target.writestr("last", b"")  # the directory is written again on close
    return buffer.getvalue()


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", " is not a profile; name a .profile.npz file"),
        (b"name = 'skin1'\n", " is not a profile; name a .profile.npz file"),
        (b"\x89PNG\r\n\x1a\n" + bytes(99), " is not a profile; name a .profile.npz file"),
        (b"PK\x03\x04 and no more", " is not a profile; name a .profile.npz file"),
        (contents(full_profile())[:-30], " is damaged; write it again, or"),
        (archive(beyond_grid=None), "lacks beyond_grid"),
        (archive(meta=None), "is not a profile: it holds 'r_edges_mm, annulus_energy"),
        (archive(colour=np.ones(3)), "arrays that a profile does not have"),
        (archive(unfinished=np.array([1, 2])), "int64 where float64"),
        (archive(unfinished=np.zeros(2, dtype=np.float32)), "float32 where float64"),
        (archive(unfinished=np.array(["a", "b"])), "where float64"),
        (archive(unfinished=np.array([{}, {}])), "object where float64"),
        (archive(unfinished=np.zeros(3)), "unfinished has shape (3,)"),
        (archive(meta=np.array(b"\xff\xfe")), "where text was expected"),
        (archive(meta=np.array("\ud800{")), " is damaged; write it again, or"),
        (archive(meta=np.array("[1]")), "not a JSON object"),
        (archive(meta=np.array(["{}"])), " is damaged; write it again, or"),
        (archive(meta=np.array("[" * 100000)), " is damaged; write it again, or"),
        (archive(meta=np.array('{"format": "sssfit.profile/3"}')), "'sssfit.profile/3'"),
        (
            archive(meta=np.array('{"format": "sssfit.kernel/1"}')),
            "is not a profile: it has format 'sssfit.kernel/1'",
        ),
        (damaged_header(), " is damaged; write it again, or"),
        (bomb(), "more than the 0.5 GB"),
        (archive(meta=edited_meta('"photons": 1000', '"photons": "1000"')), "meta.photons = '10"),
        (archive(meta=edited_meta('"photons": 1000', '"gain": NaN')), "meta.gain = nan"),
        (archive(meta=edited_meta("1000", "1" * 400)), "meta.photons = 1111"),
        (archive(meta=edited_meta("1000", "1" * 5000)), " is damaged; write it again, or"),
        (archive(meta=edited_meta("montecarlo", "\\udfff")), "half of a character"),
        (archive(meta=np.array(" " * 5_000_000)), "20,000,128 bytes of meta, more than 16,000"),
    ],
    ids=range(28),
)
def test_unusable_files_are_refused_in_one_line_that_names_them(tmp_path, content, said):
    path = tmp_path / "bad.profile.npz"
    path.write_bytes(content)
    for source, origin in ((path, str(path)), (io.BytesIO(content), "standard input")):
        with pytest.raises(ProfileError) as error:
            Profile.read(source, origin)
        assert said in str(error.value)
        assert str(error.value).startswith(origin)
        assert "\n" not in str(error.value)


def test_missing_files_and_folders_are_named(tmp_path):
    with pytest.raises(ProfileError, match="cannot be read: no such file"):
        Profile.load(tmp_path / "none.profile.npz")
    with pytest.raises(ProfileError, match=r"is a folder; name a \.profile\.npz file"):
        Profile.load(tmp_path)
    with pytest.raises(ProfileError, match=r"^a\\nb\.npz cannot be read"):  # on one line
        Profile.load("a\nb.npz")


@pytest.mark.parametrize("share", [0.0, -0.5, 1.0000001, float("nan")])
def test_shares_of_energy_are_above_0_and_at_most_1(share):
    profile = make_profile([0.0, 1.0, 2.0], [[0.5], [0.25]])
    with pytest.raises(ProfileError, match=r"^share = .*; expected a share above 0 and at most 1"):
        profile.energy_radii_mm([0.5, share])


def read_or_refuse(content):
    """The profile, or the line that refuses it; anything else that is raised fails the test."""
    try:
        return Profile.read(io.BytesIO(content), "f")
    except ProfileError as error:
        return str(error)


def test_truncated_files_are_refused():
    content = contents(full_profile())
    for length in range(0, len(content), 47):
        refusal = read_or_refuse(content[:length])
        # Up to the first member's name nothing says whose the file was.
        assert refusal.startswith("f is damaged" if length > 44 else "f is not a profile")
        assert "\n" not in refusal


def test_flipped_bytes_are_refused_or_harmless():
    profile = full_profile()
    content = contents(profile)
    rng = np.random.default_rng(17)
    for _ in range(1500):
        damaged = bytearray(content)
        for at in rng.integers(len(content), size=rng.integers(1, 4)):
            damaged[at] ^= 1 << rng.integers(8)
        outcome = read_or_refuse(bytes(damaged))
        if isinstance(outcome, str):
            assert outcome.startswith("f ")
            assert "\n" not in outcome
        else:  # dates and the like may change unnoticed; numbers are under a checksum
            assert_same(profile, outcome)
