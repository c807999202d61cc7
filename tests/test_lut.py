"""Textures of profiles and kernels: their texels against closed forms and the records' own sums."""

import io
import struct

import numpy as np
import pytest
from test_profile import make_profile
from test_taps import taps_of

from sssfit.errors import KernelError, SssfitError
from sssfit.export.lut import is_our_texture, lut_bytes
from sssfit.fit.svd import fit_svd
from sssfit.formats.pictures import load_image
from sssfit.kernel import Stage
from sssfit.shapes import gaussian_cdf, gaussian_marginal

VARIANCES, ENERGY = np.array([1.0, 0.25, 0.04]), np.array([0.5, 0.3, 0.1])


@pytest.fixture(scope="module")
def profile():
    """A Gaussian of the plane for each channel, whose densities and lines are known."""
    edges_mm = np.linspace(0.0, 8.0, 8001)
    cumulative = ENERGY * gaussian_cdf(edges_mm[:, None], VARIANCES)
    return make_profile(edges_mm, np.diff(cumulative, axis=0), beyond_grid=ENERGY - cumulative[-1])


def read_exr(content, path):
    path.write_bytes(content)
    image = load_image(path)
    return image.pixels, image.mm_per_pixel


def read_dds(content):
    """Texels by the words of the header, as Direct3D's documentation has them."""
    assert content[:4] == b"DDS "
    size, _, height, width, row, depth, mips = struct.unpack_from("<7I", content, 4)
    pixel_size, flags, code = struct.unpack_from("<2I4s", content, 4 + 72)
    form, dimension, misc, count, _ = struct.unpack_from("<5I", content, 4 + 124)
    assert (size, depth, mips, pixel_size, flags, code) == (124, 0, 1, 32, 4, b"DX10")
    assert (dimension, misc, count) == (3, 0, 1)
    channels = {41: 1, 16: 2, 2: 4}[form]
    assert row == 4 * channels * width
    return np.frombuffer(content, "<f4", offset=4 + 124 + 20).reshape(height, width, channels)


def test_radial_texels_are_the_density_near_their_middles(profile, tmp_path):
    content, figures = lut_bytes([profile], texels=400, radius_mm=4.0)
    texels, pitch_mm = read_exr(content, tmp_path / "r.exr")
    assert (texels.shape, pitch_mm) == ((1, 400, 3), 0.01)
    r_mm = (np.arange(400) + 0.5) * 0.01
    density = ENERGY / (2 * np.pi * VARIANCES) * np.exp(-0.5 * r_mm[:, None] ** 2 / VARIANCES)
    # At the beam the mean over a disk of radius d differs most from its middle: by d^2 / 8 v.
    most = 0.01**2 / (8.0 * VARIANCES) * density[0]
    assert (np.abs(texels[0] - density) < 1.01 * most).all()
    assert figures["unit"] == "1/mm^2"
    assert figures["texels"] == [400, 1]


@pytest.mark.parametrize("table", ["line", "kernel"])
def test_lines_and_kernels_are_integrals_over_pixels(profile, table, tmp_path):
    content, figures = lut_bytes([profile], table=table, radius_mm=3.0, mm_per_pixel=0.2)
    texels, pitch_mm = read_exr(content, tmp_path / "k.exr")
    half = 15
    assert pitch_mm == 0.2
    assert figures["texels"] == [31, 1 if table == "line" else 31]
    x_mm = 0.2 * (np.arange(-half, half + 1))
    fine_mm = np.linspace(-0.1, 0.1, 201)
    marginal = gaussian_marginal(x_mm[:, None, None] + fine_mm[:, None], VARIANCES)
    strips = np.trapezoid(marginal, fine_mm, axis=1)
    wanted = ENERGY * (strips[None] if table == "line" else strips[:, None] * strips)
    np.testing.assert_allclose(texels, wanted, atol=3e-5 * wanted.max())


def test_the_default_radius_holds_999_thousandths_of_every_channel(profile):
    _, figures = lut_bytes([profile], texels=1000)
    widest = np.sqrt(-2.0 * VARIANCES[0] * np.log(0.001))
    assert figures["mm_per_texel"] * 1000 == pytest.approx(widest, rel=1e-3)


def test_a_dds_holds_the_floats_of_the_exr(profile, tmp_path):
    for table in ("radial", "line", "kernel"):
        own = {"table": table}
        own |= {"texels": 64} if table == "radial" else {"mm_per_pixel": 0.25}
        exr, _ = read_exr(lut_bytes([profile], **own)[0], tmp_path / "a.exr")
        dds = read_dds(lut_bytes([profile], ending=".dds", **own)[0])
        np.testing.assert_array_equal(dds[..., :3], exr)
        np.testing.assert_array_equal(dds[..., 3], 1.0)


def test_a_png_shows_the_values_over_the_largest(profile, tmp_path):
    own = {"table": "line", "mm_per_pixel": 0.25}
    content, figures = lut_bytes([profile], ending=".png", **own)
    (tmp_path / "line.png").write_bytes(content)
    shown = load_image(tmp_path / "line.png").pixels
    exr, _ = read_exr(lut_bytes([profile], **own)[0], tmp_path / "line.exr")
    assert shown.shape == (64, exr.shape[1], 3)
    np.testing.assert_allclose(shown[5], exr[0] / max(figures["largest"]), atol=1e-4)


def test_kernels_have_lines_and_kernels_of_their_own(profile, tmp_path):
    kernel = fit_svd(profile, rank=2, mm_per_pixel=0.3, normalize=True).kernel
    line, _ = read_exr(lut_bytes([kernel], table="line")[0], tmp_path / "l.exr")
    whole, pitch_mm = read_exr(lut_bytes([kernel], table="kernel")[0], tmp_path / "k.exr")
    assert pitch_mm == 0.3
    np.testing.assert_allclose(whole.sum(axis=(0, 1)), kernel.energy * kernel.scale, rtol=1e-5)
    np.testing.assert_allclose(whole.sum(axis=0), line[0], atol=1e-7)
    np.testing.assert_allclose(whole[3, :, 1], kernel.full(1)[3] * kernel.scale[1], rtol=1e-6)


def test_a_table_of_pairs_has_the_kernel_of_its_passes(tmp_path):
    weights = np.array([[0.5, 0.4, 0.3], [0.25, 0.3, 0.35]])
    taps = taps_of(
        channels=3,
        mm_per_pixel=0.5,
        stages=(Stage(0, "pair", np.array([0.75]), weights),),
        blend=np.array([[0.1, 0.0, 0.2], [0.3, 0.4, 0.1]]),
    )
    texels, _ = read_exr(lut_bytes([taps], table="kernel")[0], tmp_path / "t.exr")
    # 1.5 texels away each fetch is half of texel 1 and half of texel 2.
    passes = np.array([[w1 / 2, w1 / 2, w0, w1 / 2, w1 / 2] for w0, w1 in weights.T])
    wanted = 0.3 * np.outer(passes[0], passes[0])
    wanted[2, 2] += 0.1
    np.testing.assert_allclose(texels[..., 0], wanted, atol=1e-7)


def test_the_same_record_gives_the_same_bytes_and_they_are_ours(profile, tmp_path):
    for ending in (".exr", ".dds", ".png"):
        content, _ = lut_bytes([profile], ending=ending, texels=16)
        assert lut_bytes([profile], ending=ending, texels=16)[0] == content
        path = tmp_path / f"x{ending}"
        path.write_bytes(content)
        assert is_our_texture(path)
    path.write_bytes(b"DDS " + bytes(200))
    assert not is_our_texture(path)


def test_more_channels_than_a_format_has_are_refused():
    edges_mm = np.array([0.0, 1.0, 2.0])
    five = make_profile(edges_mm, np.full((2, 5), 0.1))
    stream, _ = lut_bytes([five], texels=4, radius_mm=1.0)
    assert io.BytesIO(stream).read(4) == b"\x76\x2f\x31\x01"  # OpenEXR's magic number
    for ending, words in ((".dds", "at most 4 channels, and this has 5"), (".png", "EXR")):
        with pytest.raises(SssfitError, match=words):
            lut_bytes([five], ending=ending, texels=4, radius_mm=1.0)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"ending": ".tif"}, ".tif: textures are written as .exr, .dds, .png"),
        ({"table": "round"}, "`table = 'round'`; expected one of radial, line, kernel"),
        ({"texels": 1}, "would have 1 texels"),
        ({"texels": 20000}, "would have 20,000 texels"),
        ({"radius_mm": 9.0}, "`radius = 9`; expected one above 0 mm and up to the profile's 8 mm"),
        ({"radius_mm": float("nan")}, "`radius = nan`"),
        ({"table": "line", "mm_per_pixel": 0.0}, "`mm_per_pixel = 0`"),
        ({"table": "kernel", "mm_per_pixel": 1e-9}, "would have 32,769 texels"),
        ({"table": "line", "texels": 9}, "`texels` is for a profile's radial table, and this is a"),
        ({"mm_per_pixel": 0.3}, "is for a profile's line or kernel table, and this is a profile's"),
    ],
)
def test_a_texture_that_cannot_be_is_refused_in_one_line(profile, given, words):
    with pytest.raises(KernelError) as caught:
        lut_bytes([profile], **given)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_what_has_no_such_table_is_refused(profile):
    kernel = fit_svd(profile, rank=1, mm_per_pixel=0.3).kernel
    with pytest.raises(KernelError, match="no radial table"):
        lut_bytes([kernel])
    for own in ({"texels": 9}, {"radius_mm": 1.0}, {"mm_per_pixel": 0.3}):
        with pytest.raises(KernelError, match="this is a table of a kernel's own pixels; leave it"):
            lut_bytes([kernel], table="line", **own)
    with pytest.raises(KernelError, match="a texture holds one profile or kernel"):
        lut_bytes([profile, profile])
    with pytest.raises(KernelError, match="halved pictures"):
        lut_bytes([taps_of("1|1")], table="kernel")
    dark = make_profile(np.array([0.0, 1.0]), np.zeros((1, 1)))
    with pytest.raises(KernelError, match="no light leaves within the profile's grid"):
        lut_bytes([dark])
