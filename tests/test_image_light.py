"""What light is in a picture file: layers, primaries, Radiance's factors, alpha, compressions."""

import io
import struct
from pathlib import Path

import numpy as np
import OpenEXR
import OpenImageIO
import pytest
from checks_image import chunk, exr, hdr, load_bytes, picture, png, read_png, tiff

from sssfit.errors import FileError, RenderError, SssfitError
from sssfit.formats import pictures as image
from sssfit.scene.record import Scene

DATA = Path(__file__).parent / "data"
# SMPTE ST 2065-1, ACES S-2014-004 and ITU-R BT.2020-2.
PRIMARIES = {
    "ACES2065-1": (0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, 0.32168, 0.33767),
    "ACEScg": (0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767),
    "ITU-R BT.2020": (0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.3290),
}
RADIANCE = "0.640 0.330 0.290 0.600 0.150 0.060 0.333 0.333"


def exr_with(path, channels, **header):
    """An EXR of one part by OpenEXR, which knows attributes that OpenImageIO cannot write."""
    head = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **header}
    OpenEXR.File(head, channels).write(str(path))


def other_library(name):
    """The matrix to BT.709 by colour-science."""
    with np.printoptions():  # which its import changes
        import colour

    theirs, ours = (colour.RGB_COLOURSPACES[each] for each in (name, "ITU-R BT.709"))
    to_xyz, from_xyz = (
        colour.normalised_primary_matrix(each.primaries, each.whitepoint) for each in (theirs, ours)
    )
    whites = (colour.xy_to_XYZ(each.whitepoint) for each in (theirs, ours))
    adapted = colour.adaptation.matrix_chromatic_adaptation_VonKries(*whites, transform="Bradford")
    return np.linalg.inv(from_xyz) @ adapted @ to_xyz


def test_a_compression_that_the_reader_lacks_is_named():
    line = r"zstd\.tif is compressed by Zstandard \(zstd\), which the reader .* was built without; "
    with pytest.raises(FileError, match=line) as caught:
        image.load_image(DATA / "zstd.tif")
    assert "damaged" not in str(caught.value)


@pytest.mark.parametrize(
    ("code", "name"),
    [
        (34712, "JPEG 2000"),
        (34887, "LERC"),
        (34925, "LZMA"),
        (50000, r"Zstandard \(zstd\)"),
        (50002, "JPEG XL"),
        (52546, "JPEG XL"),
        (99, "scheme 99"),
    ],
)
def test_every_such_compression(tmp_path, code, name):
    data = tiff((255 * picture()).astype(np.uint8), tags={259: code})
    with pytest.raises(FileError, match=f"is compressed by {name}, which the reader"):
        load_bytes(tmp_path, data, "a.tif")


def test_damage_is_not_taken_for_a_compression(tmp_path):
    data = tiff(picture())
    with pytest.raises(FileError, match="damaged or cut short") as caught:
        load_bytes(tmp_path, data[:-40], "a.tif")
    assert "subimage" not in str(caught.value)  # the library's word on the next part


def test_the_only_layer_of_an_exr_is_read():
    found = image.load_image(DATA / "blender-layer.exr")
    assert found.channels == ("R", "G", "B")
    ramp = np.linspace(0.1, 0.9, 32, dtype=np.float32)
    assert found.pixels[0, :, 0].tolist() == ramp.astype(float).tolist()
    assert (found.pixels[3:6, 20:26, 0] == 2.0).all()
    assert found.alpha.tolist() == np.ones((24, 32)).tolist()
    assert found.notes[0] == "layer ViewLayer.Combined used"
    named = image.load_image(DATA / "blender-layer.exr", layer="ViewLayer.Combined")
    assert np.array_equal(named.pixels, found.pixels)


def test_of_several_layers_the_choice_is_offered(tmp_path):
    channels = ("skin.R", "skin.G", "skin.B", "skin.A", "eyes.B", "eyes.G", "eyes.R", "depth.Z")
    exr(tmp_path / "a.exr", picture(channels=8), channels)
    with pytest.raises(RenderError, match=r"has the layers (skin, eyes|eyes, skin); name the one"):
        image.load_image(tmp_path / "a.exr")
    skin = image.load_image(tmp_path / "a.exr", layer="skin")
    assert np.array_equal(skin.pixels, picture(channels=8)[..., :3])
    assert np.array_equal(skin.alpha, picture(channels=8)[..., 3])
    eyes = image.load_image(tmp_path / "a.exr", layer="eyes")
    assert np.array_equal(eyes.pixels, picture(channels=8)[..., [6, 5, 4]])
    assert eyes.alpha is None  # that of skin is not its own
    for name in ("depth", "", "lips"):
        with pytest.raises(RenderError, match=f"has no layer '{name}'; it has (skin|eyes), "):
            image.load_image(tmp_path / "a.exr", layer=name)


def test_plain_channels_come_before_layers(tmp_path):
    exr(tmp_path / "a.exr", picture(channels=6), ("R", "G", "B", "dim.R", "dim.G", "dim.B"))
    found = image.load_image(tmp_path / "a.exr")
    assert np.array_equal(found.pixels, picture(channels=6)[..., :3])
    assert found.notes == ("channels dim.R, dim.G, dim.B left out",)
    dim = image.load_image(tmp_path / "a.exr", layer="dim")
    assert np.array_equal(dim.pixels, picture(channels=6)[..., 3:])


@pytest.mark.parametrize("names", ["rgb", ("red", "green", "blue"), ("C.r", "C.g", "C.b")])
def test_channels_in_other_spellings(tmp_path, names):
    exr(tmp_path / "a.exr", picture(), names)
    found = image.load_image(tmp_path / "a.exr")
    assert found.channels == ("R", "G", "B")
    assert np.array_equal(found.pixels, picture())


def test_normals_are_no_grey_picture(tmp_path):
    exr(tmp_path / "a.exr", picture(), ("N.X", "N.Y", "N.Z"))
    with pytest.raises(RenderError, match=r"has the channels N\.X, N\.Y, N\.Z; expected R, G, B"):
        image.load_image(tmp_path / "a.exr")
    exr(tmp_path / "b.exr", picture(channels=1), ("light.Y",))
    assert image.load_image(tmp_path / "b.exr").channels == ("Y",)


def test_parts_are_layers_too(tmp_path):
    head = {"type": OpenEXR.scanlineimage}
    parts = [
        OpenEXR.Part({**head, "name": name}, {"RGB": level * picture()}, name)
        for name, level in (("direct", np.float32(1)), ("indirect", np.float32(0.5)))
    ]
    OpenEXR.File(parts).write(str(tmp_path / "a.exr"))
    assert np.array_equal(image.load_image(tmp_path / "a.exr").pixels, picture())
    found = image.load_image(tmp_path / "a.exr", layer="indirect")
    assert np.array_equal(found.pixels, np.float32(0.5) * picture())
    assert found.notes == ("part 2 of 2 used",)


def test_files_without_layers_say_so(tmp_path):
    image.save_image(tmp_path / "a.png", picture())
    with pytest.raises(RenderError, match=r"has no layer 'x'; it has none of R, G, B or Y"):
        image.load_image(tmp_path / "a.png", layer="x")


@pytest.mark.parametrize("name", PRIMARIES)
def test_other_chromaticities_are_converted(tmp_path, name):
    # Colours that lie within the triangle of BT.709: mixtures of its own.
    matrix = other_library(name)
    ours = picture().astype(float)
    theirs = (ours @ np.linalg.inv(matrix).T).astype(np.float32)
    exr_with(tmp_path / "a.exr", {"RGB": theirs}, chromaticities=PRIMARIES[name])
    found = image.load_image(tmp_path / "a.exr")
    np.testing.assert_allclose(found.pixels, ours, rtol=0, atol=2e-6)
    assert found.notes[-1].startswith("converted from the chromaticities 0.7")
    exr_with(tmp_path / "b.exr", {"RGB": np.ones((2, 2, 3), "f4")}, chromaticities=PRIMARIES[name])
    np.testing.assert_allclose(image.load_image(tmp_path / "b.exr").pixels, 1.0, atol=1e-6)


def test_the_chromaticities_of_srgb_change_nothing(tmp_path):
    for white in ((0.3127, 0.3290), (0.31271, 0.32902)):
        given = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, *white)
        exr_with(tmp_path / "a.exr", {"RGB": picture()}, chromaticities=given)
        found = image.load_image(tmp_path / "a.exr")
        assert np.array_equal(found.pixels, picture())
        assert found.notes == ()


def test_colours_outside_the_triangle_are_set_to_0_and_counted(tmp_path):
    green = np.zeros((1, 2, 3), dtype=np.float32)
    green[0, 0, 1], green[0, 1] = 1.0, 0.5
    exr_with(tmp_path / "a.exr", {"RGB": green}, chromaticities=PRIMARIES["ITU-R BT.2020"])
    found = image.load_image(tmp_path / "a.exr")
    # ITU-R BT.2087: green of BT.2020 is -.5876, 1.1329, -.1006 in BT.709.
    np.testing.assert_allclose(found.pixels[0, 0], [0.0, 1.1329, 0.0], atol=1e-4)
    np.testing.assert_allclose(found.pixels[0, 1], 0.5, atol=1e-6)
    assert found.notes[-1] == "2 of 6 values outside sRGB's triangle set to 0"
    exr_with(tmp_path / "b.exr", {"RGB": -green}, chromaticities=PRIMARIES["ITU-R BT.2020"])
    with pytest.raises(RenderError, match="values are negative"):
        image.load_image(tmp_path / "b.exr")


@pytest.mark.parametrize("wrong", [(0.0,) * 8, (0.3,) * 8, (np.nan,) * 8])
def test_chromaticities_that_span_nothing(tmp_path, wrong):
    exr_with(tmp_path / "a.exr", {"RGB": picture()}, chromaticities=wrong)
    with pytest.raises(RenderError, match="which span no colour space; expected x and y") as caught:
        image.load_image(tmp_path / "a.exr")
    assert "\n" not in str(caught.value)


def test_grey_has_no_primaries(tmp_path):
    grey = picture(channels=1)[..., 0]
    exr_with(tmp_path / "a.exr", {"Y": grey}, chromaticities=PRIMARIES["ACEScg"])
    found = image.load_image(tmp_path / "a.exr")
    assert np.array_equal(found.pixels[..., 0], grey)


def test_chromaticities_of_a_png(tmp_path):
    numbers = PRIMARIES["ITU-R BT.2020"]
    white_first = (*numbers[6:], *numbers[:6])
    chrm = (b"cHRM", struct.pack(">8I", *(round(100_000 * each) for each in white_first)))
    row = bytes([200, 200, 200, 90, 120, 60])
    found = load_bytes(tmp_path, png([row], width=2, extra=[chrm]))
    plain = load_bytes(tmp_path, png([row], width=2))
    wanted = plain.pixels @ other_library("ITU-R BT.2020").T
    np.testing.assert_allclose(found.pixels, wanted, atol=1e-6)
    for other in ((b"sRGB", b"\0"), (b"cICP", bytes([1, 13, 0, 1]))):
        for chunks in ([chrm, other], [other, chrm]):
            overruled = load_bytes(tmp_path, png([row], width=2, extra=chunks))
            assert np.array_equal(overruled.pixels, plain.pixels)


def radiance(tmp_path, *lines):
    rows = [[[128, 64, 32, 129], [128, 128, 128, 130]]]
    head = "".join(f"{line}\n" for line in lines).encode()
    return load_bytes(tmp_path, hdr(rows, size=b"-Y 1 +X 2", head=head), "a.hdr")


def test_exposure_and_colour_correction_are_taken_out_of_the_light(tmp_path):
    stored = np.array([[[1.0, 0.5, 0.25], [2.0, 2.0, 2.0]]])
    found = radiance(tmp_path, "EXPOSURE=2.0", " EXPOSURE= 4", "COLORCORR=1 2 4")
    np.testing.assert_allclose(found.pixels, stored / [8.0, 16.0, 32.0], rtol=1e-15)
    assert found.notes == (
        "divided by the exposure of 8 in its header",
        "divided by the colour correction of 1 2 4 in its header",
    )
    assert radiance(tmp_path, "EXPOSURE=1", "# EXPOSURE=3").pixels.tolist() == stored.tolist()


def test_primaries_of_a_radiance_file(tmp_path):
    found = radiance(tmp_path, f"PRIMARIES= {RADIANCE}")
    np.testing.assert_allclose(found.pixels[0, 1], 2.0, rtol=1e-9)  # white stays white
    assert abs(found.pixels[0, 0] - [1.0, 0.5, 0.25]).max() > 1e-3
    assert found.notes[0].startswith("converted from the chromaticities 0.64 0.33 0.29 0.6")
    ours = "0.64 0.33 0.30 0.60 0.15 0.06 0.3127 0.3290"
    assert radiance(tmp_path, f"PRIMARIES={ours}").notes == ()


@pytest.mark.parametrize(
    "line",
    [
        *("EXPOSURE=0", "EXPOSURE=-1", "EXPOSURE=nan", "EXPOSURE=x", "EXPOSURE=1 2", "EXPOSURE="),
        *("COLORCORR=1 1", "COLORCORR=1 0 1", "PRIMARIES=1 2 3", "EXPOSURE=\x1b[31m"),
    ],
)
def test_damaged_lines_of_a_radiance_header(tmp_path, line):
    with pytest.raises(
        FileError, match=r"a\.hdr is damaged \(.*expected [138] numbers? above 0"
    ) as e:
        radiance(tmp_path, line)
    assert str(e.value).isprintable()


def test_exposures_whose_product_is_no_number(tmp_path):
    for lines in (["EXPOSURE=1e-300"] * 2, ["EXPOSURE=1e300"] * 2):
        with pytest.raises(SssfitError, match="out of range"):
            radiance(tmp_path, *lines)


def test_xyze_is_refused_by_name(tmp_path):
    data = hdr([[[128, 64, 32, 129]]], size=b"-Y 1 +X 1").replace(b"rgbe\n", b"xyze\n")
    with pytest.raises(
        RenderError, match=r"holds CIE XYZ \(FORMAT=32-bit_rle_xyze\); expected R, G"
    ):
        load_bytes(tmp_path, data, "a.hdr")


def test_other_transfer_curves_are_said(tmp_path):
    found = load_bytes(tmp_path, png([b"abc"], width=1, extra=[(b"cICP", bytes([9, 16, 0, 1]))]))
    assert found.notes[0].startswith("colour space pq_rec2020")
    assert found.notes[0].endswith("taken for sRGB")


def test_a_gamma_that_is_not_heeded_is_said(tmp_path):
    gamma = struct.pack(">I", round(100_000 / 1.8))
    found = load_bytes(tmp_path, png([b"abc"], width=1, extra=[(b"gAMA", gamma)]))
    assert found.notes == ("gamma 1.8 of the file taken for sRGB", "8-bit sRGB decoded to linear")


def icc_profile(name):
    """A colour profile of that name (ICC.1:2001-04) without any curves."""
    text = name.encode() + b"\0"
    body = b"desc" + bytes(4) + struct.pack(">I", len(text)) + text + bytes(78)
    body += bytes(-len(body) % 4)
    kinds = b"mntr", b"RGB ", b"XYZ "
    head = struct.pack(">I4sI4s4s4s", 144 + len(body), bytes(4), 0x02400000, *kinds)
    head += bytes(12) + b"acsp" + bytes(28) + struct.pack(">3i", 63190, 65536, 54061)  # D50
    return head.ljust(128, b"\0") + struct.pack(">I4sII", 1, b"desc", 144, len(body)) + body


@pytest.mark.parametrize(
    ("name", "notes"),
    [
        ("Display P3", ("colour profile Display P3 not applied",)),
        ("sRGB IEC61966-2.1", ()),  # which is what the numbers are taken for
    ],
)
def test_a_colour_profile_that_is_not_applied_is_said(tmp_path, name, notes):
    data = np.frombuffer(icc_profile(name), dtype=np.uint8)
    spec = OpenImageIO.ImageSpec(1, 1, 3, "uint8")
    spec.attribute("ICCProfile", OpenImageIO.TypeDesc(f"uint8[{len(data)}]"), data)
    writer = OpenImageIO.ImageOutput.create(str(tmp_path / "a.tif"))
    assert writer.open(str(tmp_path / "a.tif"), spec)
    assert writer.write_image(np.zeros((1, 1, 3), dtype=np.uint8))
    writer.close()
    found = image.load_image(tmp_path / "a.tif")
    assert found.notes == (*notes, "8-bit sRGB decoded to linear")


COVERAGE = np.array([[0.0, 0.25, 0.5, 1.0]])


def light(multiplied):
    colour = 0.5 * picture(1, 4)
    return colour * COVERAGE[..., None] if multiplied else colour


@pytest.mark.parametrize("is_multiplied", [False, True])
@pytest.mark.parametrize("ending", ["exr", "tif", "png"])
@pytest.mark.parametrize("channels", [1, 3])
def test_alpha_comes_back_and_the_colour_beside_it(tmp_path, ending, is_multiplied, channels):
    path = tmp_path / f"a.{ending}"
    given = light(is_multiplied)[..., :channels]
    image.save_image(path, given, alpha=COVERAGE, alpha_is_multiplied=is_multiplied)
    found = image.load_image(path)
    np.testing.assert_allclose(found.alpha, COVERAGE, atol=1e-5)
    assert found.channels == (("Y",) if channels == 1 else ("R", "G", "B"))
    in_file = {"exr": True, "tif": is_multiplied, "png": False}[ending]
    assert found.alpha_is_multiplied is in_file
    lit = slice(1, None)  # without coverage there is no colour to come back
    expected = light(in_file)[..., :channels]
    np.testing.assert_allclose(found.pixels[:, lit], expected[:, lit], atol=2e-5)


def test_alpha_in_a_file_is_what_other_programs_read(tmp_path):
    image.save_image(tmp_path / "a.exr", light(True), alpha=COVERAGE, alpha_is_multiplied=True)
    with OpenEXR.File(str(tmp_path / "a.exr")) as file:
        stored = file.channels()["RGBA"].pixels
    np.testing.assert_allclose(stored[..., 3], COVERAGE)
    np.testing.assert_allclose(stored[..., :3], light(True).astype("f4"))
    image.save_image(tmp_path / "a.png", light(False), alpha=COVERAGE)
    codes = read_png((tmp_path / "a.png").read_bytes()) / 65535
    np.testing.assert_allclose(codes[..., 3], COVERAGE, atol=1e-5)
    np.testing.assert_allclose(codes[..., :3], image.srgb_encode(light(False)), atol=1e-5)


def test_what_the_format_did_to_the_colour_is_said(tmp_path):
    done = image.save_image(tmp_path / "a.exr", light(False), alpha=COVERAGE)
    assert done == ("colour multiplied by alpha, as an EXR has it",)
    done = image.save_image(
        tmp_path / "a.png", light(True), alpha=COVERAGE, alpha_is_multiplied=True
    )
    assert done == ("colour divided by alpha, as a PNG has it",)


@pytest.mark.parametrize(
    ("pixels", "alpha", "options", "words"),
    [
        (np.ones((2, 2, 3)), np.ones((2, 3)), {}, r"alpha of shape \(2, 3\) for a picture of"),
        (np.ones((2, 2, 3)), np.full((2, 2), np.nan), {}, "values are NaN or infinite"),
        (np.ones((2, 2, 2)), np.ones((2, 2)), {"channels": "ab"}, "it goes with 1 or 3, none"),
        (np.ones((2, 2, 1)), np.ones((2, 2)), {"channels": "A"}, "it goes with 1 or 3, none"),
    ],
)
def test_alpha_that_does_not_fit(tmp_path, pixels, alpha, options, words):
    with pytest.raises(RenderError, match=words):
        image.save_image(tmp_path / "a.exr", pixels, alpha=alpha, **options)


def test_alpha_of_nan_is_refused(tmp_path):
    values = picture(channels=4)
    values[1, 2, 3] = np.nan
    exr(tmp_path / "a.exr", values, "RGBA")
    with pytest.raises(RenderError, match=r"1 of 35 values are NaN .* column 2, channel alpha"):
        image.load_image(tmp_path / "a.exr")


@pytest.mark.parametrize("is_multiplied", [False, True])
def test_alpha_serves_as_the_mask(is_multiplied):
    given = image.Image(
        light(is_multiplied),
        ("R", "G", "B"),
        alpha=COVERAGE,
        alpha_is_multiplied=is_multiplied,
        name="a",
    )
    scene = Scene.from_image(given, 0.3, alpha_is_mask=True)
    assert scene.mask.tolist() == [[0, 0, 1, 1]]
    assert (scene.irradiance[:, :2] == 0.0).all()
    np.testing.assert_allclose(scene.irradiance[:, 2:], light(False)[:, 2:], rtol=1e-12)
    assert (scene.alpha.tolist(), scene.alpha_is_multiplied) == (COVERAGE.tolist(), False)
    plain = Scene.from_image(given, 0.3)
    assert plain.mask is None
    assert np.array_equal(plain.irradiance, given.pixels)
    assert plain.alpha_is_multiplied is is_multiplied


def test_a_mask_needs_alpha_that_covers_something():
    pixels = np.ones((2, 2, 3))
    with pytest.raises(RenderError, match="a has no alpha that could be the mask"):
        Scene.from_image(image.Image(pixels, "RGB", name="a"), 0.3, alpha_is_mask=True)
    faint = image.Image(pixels, "RGB", alpha=np.full((2, 2), 0.4), name="a")
    with pytest.raises(RenderError, match=r"alpha is under 0\.5 everywhere"):
        Scene.from_image(faint, 0.3, alpha_is_mask=True)


HEAD = struct.pack(">IIBBBBB", 2, 5, 8, 2, 0, 0, 0)


@pytest.mark.parametrize(
    "chunks",
    [
        [(b"IHDR", HEAD), (b"IDAT", b"junkjunk")],
        [(b"IHDR", HEAD), (b"IDAT", bytes.fromhex("789c6300000001 0001".replace(" ", "")))],
        [(b"IHDR", HEAD[:8] + b"\x07" + HEAD[9:]), (b"IDAT", b"")],
        [(b"IHDR", bytes(4) + HEAD[4:]), (b"IDAT", b"")],
        [(b"IDAT", b"junk")],
        [(b"IHDR", HEAD[:9] + b"\x03" + HEAD[10:]), (b"IDAT", b"")],
        [(b"IHDR", HEAD), (b"ABCD", b""), (b"IDAT", b"")],
    ],
)
def test_libpng_keeps_its_lines_to_itself(tmp_path, capfd, chunks):
    data = b"\x89PNG\r\n\x1a\n" + b"".join(chunk(*each) for each in (*chunks, (b"IEND", b"")))
    with pytest.raises(FileError, match="damaged or cut short") as caught:
        load_bytes(tmp_path, data)
    assert "\n" not in str(caught.value)
    assert capfd.readouterr().err == ""


def test_a_png_has_a_longest_side(tmp_path, capfd):
    for shape in ((1, 1_000_001, 1), (1_000_001, 1, 1)):
        with pytest.raises(RenderError, match=r"do not fit a PNG file, which takes 1000000 a side"):
            image.save_image(tmp_path / "a.png", np.zeros(shape))
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize(
    "wrong",
    ["abc", None, [[1], [1, 2]], object(), {}, np.ones((2, 2, 3), complex), [[["a"]]], np.ones(3)],
)
def test_what_is_no_picture_is_one_line(tmp_path, wrong):
    for call in (
        lambda: image.save_image(tmp_path / "a.exr", wrong),
        lambda: image.Image(wrong, ("R", "G", "B")),
        lambda: Scene("x", wrong, 0.3),
    ):
        with pytest.raises(RenderError, match=r"array of real numbers|of shape") as caught:
            call()
        assert "\n" not in str(caught.value)
    if wrong is not None:
        for call in (
            lambda: image.save_image(tmp_path / "a.exr", picture(), alpha=wrong),
            lambda: image.Image(picture(), ("R", "G", "B"), alpha=wrong),
            lambda: Scene("x", picture(), 0.3, mask=wrong),
        ):
            with pytest.raises(RenderError, match=r"real numbers|of shape|mask is \("):
                call()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"channels": 5}, "channels = 5; expected a list of names"),
        ({"channels": [1, 2, 3]}, "channel name 1; expected a text"),
        ({"channels": ["a\0", "b", "c"]}, r"channel name 'a\\x00'; expected a text"),
        ({"channels": ["\udc80", "b", "c"]}, "expected a text"),
        ({"channels": ["a" * 256, "b", "c"]}, "expected a text of at most 255 bytes"),
        ({"format": 5}, "format 5: pictures are written as"),
        *[({"exposure": each}, "exposure = .*; expected a number above 0") for each in ("x", None)],
        *[
            ({"mm_per_pixel": each}, "mm_per_pixel = .*; expected a number above 0")
            for each in ("x", np.nan, -1, 0, True)
        ],
    ],
)
def test_what_else_cannot_be_written(options, words):
    stream = io.BytesIO()
    with pytest.raises(SssfitError, match=words) as caught:
        image.save_image(stream, picture(), **{"format": "exr", **options})
    assert str(caught.value).isprintable()
    assert stream.getvalue() == b""


@pytest.mark.parametrize(
    ("path", "words"),
    [
        (None, "None is not a path"),
        (5, "5 is not a path"),
        (b"a.png", "is not a path"),
        ("a\0b.png", "holds a null character"),
        (5000 * "x" + ".png", r"^x{200}\.\.\.x{196}\.png cannot be .*name too long"),
        ("a\n\x1b[31mb.png", r"a\\n\\x1b\[31mb\.png cannot be read: no such file"),
    ],
)
def test_what_is_no_path(tmp_path, monkeypatch, path, words):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(FileError, match=words) as caught:
        image.load_image(path)
    assert str(caught.value).isprintable()
    if isinstance(path, str) and "\n" not in path:
        with pytest.raises(FileError, match=words):
            image.save_image(path, picture())
    assert not image.is_image_file(path)


@pytest.mark.parametrize(
    ("options", "words"),
    [({"layer": 5}, "layer = 5"), ({"largest_bytes": None}, "largest_bytes = None")],
)
def test_wrong_options_of_reading(options, words):
    with pytest.raises(RenderError, match=words):
        image.load_image(DATA / "blender-layer.exr", **options)


@pytest.mark.parametrize("mask", [np.full((5, 7), 0.5), np.full((5, 7), 1e20)])
def test_a_mask_holds_whole_numbers(mask):
    with pytest.raises(RenderError, match="mask holds other values than whole numbers"):
        Scene("x", picture(), 0.3, mask=mask)


@pytest.mark.parametrize(("stored", "kept"), [(-1e-3, 0.0), (1.02, 1.0)])
def test_alpha_a_little_outside_0_to_1_is_clipped(stored, kept):
    alpha = np.full((5, 7), stored)
    scene = Scene.from_image(image.Image(picture(), ("R", "G", "B"), alpha=alpha), 0.3)
    assert scene.alpha.tolist() == np.full((5, 7), kept).tolist()


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"channels": ("R", "G")}, r"^channels = \('R', 'G'\) for 3 channels; give each one name"),
        ({"channels": None}, "^channels = None for 3 channels"),
        ({"mm_per_pixel": "1"}, "^mm_per_pixel = '1'; expected a number above 0"),
        ({"name": None}, "^name = None; expected a text"),
        ({"alpha_is_multiplied": 1}, "^alpha_is_multiplied = 1; expected True or False"),
    ],
)
def test_fields_of_a_picture_are_checked(fields, words):
    with pytest.raises(RenderError, match=words):
        image.Image(**{"pixels": picture(), "channels": "RGB"} | fields)
