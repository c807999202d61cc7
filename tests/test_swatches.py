"""Colours of sweeps over wavelengths: the sums of colour-science, and what is refused."""

import math
import shutil

import numpy as np
import pytest
from figures import assert_legible, words_of
from matplotlib.text import Text
from test_sweep import lose

from sssfit.chart import figure_of
from sssfit.errors import ArgumentError, FileError, SweepError
from sssfit.measure.daylight import srgb_of_xyz, xyz_weights
from sssfit.measure.delta_e import load_colour
from sssfit.sweep import load_plan, sweep_to_store
from sssfit.sweep.swatches import read_swatches

BANDS = [400.0, 460.0, 500.0, 560.0, 610.0, 700.0]
BASE = 'channels = ["mono"]\neta = 1.4\ng = 0.0\nsigma_a_per_mm = [0.1]\nsigma_s_per_mm = [1.0]\n'
PLAN = (
    'material = "base.toml"\nmethod = "dipole"\n[grid]\ndr_mm = 1.0\nradius_mm = 10.0\n'
    '[[axes]]\nkey = "eta"\nvalues = [1.3, 1.5]\n'
    '[[axes]]\ntable = "bands.csv"\n'
    '[[axes]]\nname = "depth_mm"\nvalues = [0.5, 1.0, 2.0]\n'
    '[set]\nsigma_a_per_mm = "depth_mm * dye_per_mm"\n'
)


def swept(folder, text=PLAN, base=BASE, bands=BANDS):
    """The store of a plan whose absorption falls with the wavelength."""
    dye = [0.02 + 4.0 * math.exp((400.0 - nm) / 60.0) for nm in bands]
    rows = "".join(f"{nm},{each!r}\n" for nm, each in zip(bands, dye, strict=True))
    (folder / "bands.csv").write_text("wavelength_nm,dye_per_mm\n" + rows)
    (folder / "base.toml").write_text('name = "dyed"\n' + base)
    (folder / "plan.toml").write_text(text)
    plan = load_plan(folder / "plan.toml")
    sweep_to_store(plan, folder / "x.zarr", threads=1)
    return plan, folder / "x.zarr"


@pytest.fixture(scope="module")
def dyed(tmp_path_factory):
    return swept(tmp_path_factory.mktemp("swatches"))


def by_colour_science(wavelengths, reflectance):
    """X, Y, Z of a spectrum that is given at each nm, by the library's own sum."""
    colour = load_colour()
    nm = np.arange(360.0, 831.0)
    spectrum = dict(zip(nm, np.interp(nm, wavelengths, reflectance), strict=True))
    each_nm = colour.SpectralShape(360, 830, 1)
    daylight = colour.SDS_ILLUMINANTS["D65"].copy()
    daylight.align(each_nm, interpolator=colour.LinearInterpolator)
    return colour.sd_to_XYZ(
        colour.SpectralDistribution(spectrum),
        colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"],
        daylight,
        method="Integration",
        shape=each_nm,
    )


def test_colours_of_a_store_are_those_of_colour_science(dyed):
    _, path = dyed
    found = read_swatches(path)
    assert ([*found.axes], found.xyz.shape) == (["eta", "depth_mm"], (2, 3, 3))
    assert found.units == {"eta": "1", "depth_mm": "mm"}
    for position in np.ndindex(2, 3):
        wanted = by_colour_science(BANDS, found.reflectance[position]) / 100.0
        np.testing.assert_allclose(found.xyz[position], wanted, rtol=1e-9)
        code = load_colour().XYZ_to_sRGB(wanted)
        np.testing.assert_allclose(found.codes[position], code, atol=1e-9)
        pairs = [found.hexadecimal(position)[k : k + 2] for k in (1, 3, 5)]
        assert [int(each, 16) for each in pairs] == pytest.approx(255.0 * code, abs=0.6)


def test_a_white_is_white_and_a_laser_is_outside():
    for wavelengths in (BANDS, BANDS[::-1], np.arange(380.0, 781.0, 5.0)):
        weights = xyz_weights(np.array(wavelengths))
        np.testing.assert_allclose(weights.sum(axis=0), [0.95047, 1.0, 1.08883], atol=1e-4)
        np.testing.assert_allclose(srgb_of_xyz(weights.sum(axis=0)), 1.0, atol=1e-3)
    line = xyz_weights(np.arange(400.0, 701.0, 10.0))[12]  # 520 nm
    assert srgb_of_xyz(line)[0] < 0.0


def test_the_order_of_wavelengths_does_not_matter():
    turned = xyz_weights(np.array(BANDS[::-1]))[::-1]
    np.testing.assert_array_equal(turned, xyz_weights(np.array(BANDS)))


@pytest.mark.parametrize(
    ("wavelengths", "words"),
    [([550.0], "two or more"), ([500.0, 600.0], "wavelengths 500 and 600 nm; expected 95 %")],
)
def test_too_few_wavelengths_are_refused(wavelengths, words):
    with pytest.raises(ArgumentError, match=words):
        xyz_weights(np.array(wavelengths))


def test_the_chart_names_axes_and_codes_and_crosses_out_what_is_missing(dyed, tmp_path):

    plan, path = dyed
    found = read_swatches(path)
    figure = assert_legible(lambda: figure_of(found))
    words = words_of(figure)
    for each in ("eta", "depth_mm (mm)", "1.5", "0.5", found.hexadecimal((1, 2))):
        assert each in words, each
    shutil.copytree(path, tmp_path / "x.zarr")
    lose(tmp_path / "x.zarr", plan, [0])
    partly = read_swatches(tmp_path / "x.zarr")
    assert (partly.missing, partly.hexadecimal((0, 0))) == (1, None)
    assert partly.hexadecimal((1, 2)) == found.hexadecimal((1, 2))
    notes = [each.get_text() for each in figure_of(partly).findobj(Text)]
    assert any("Crossed out: not all of the wavelengths are finished." in each for each in notes)
    assert partly.to_dict()["xyz"][0][0] == [None] * 3


def test_other_folders_are_refused_in_one_line(tmp_path, dyed):
    with pytest.raises(FileError, match="is a folder; name a file in it, or the store of a sweep"):
        read_swatches(tmp_path)
    plain = PLAN.replace('table = "bands.csv"', 'name = "dye_per_mm"\nvalues = [0.1, 0.2]')
    for folder, text, base, bands, words in (
        ("plain", plain, BASE, BANDS, "has 0 axes in nm"),
        (
            "three",
            PLAN,
            BASE.replace('"mono"', '"R", "G"')
            .replace("[0.1]", "[0.1, 0.2]")
            .replace("[1.0]", "[1.0, 1.0]"),
            BANDS,
            "has 2 channels at each wavelength",
        ),
        ("narrow", PLAN, BASE, [500.0, 600.0], "expected 95 % or more"),
    ):
        (tmp_path / folder).mkdir()
        _, path = swept(tmp_path / folder, text, base, bands)
        with pytest.raises(SweepError, match=words):
            read_swatches(path)


def test_a_damaged_store_is_one_line(dyed, tmp_path):

    shutil.copytree(dyed[1], tmp_path / "x.zarr")
    shutil.rmtree(tmp_path / "x.zarr" / "channel")
    (tmp_path / "x.zarr" / ".zmetadata").unlink()
    with pytest.raises(FileError, match=r"is damaged \(KeyError\); make it again"):
        read_swatches(tmp_path / "x.zarr")
