"""Pictures: every format there and back, upright, in order; bad files in one line."""

import contextlib
import io
import os
import struct

import matplotlib.image
import numpy as np
import OpenEXR
import pytest
from checks_image import chunk, exr, hdr, jpeg, load_bytes, picture, png, read_png, tga, tiff

from sssfit.errors import FileError, RenderError, SssfitError
from sssfit.formats import pictures as image

ENDINGS = ("exr", "tif", "png")
HALF_A_CODE = 0.5 / 65535
PITCH = 0.2977213249234697  # mm, of 1080 rows 0.6 m away; with every digit, as kernels have it


def literal_decode(code):
    """IEC 61966-2-1, one value at a time."""
    return code / 12.92 if code <= 0.04045 else ((code + 0.055) / 1.055) ** 2.4


@pytest.mark.parametrize("ending", ["exr", "tif"])
@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("size", [(5, 7), (1, 1), (1, 9), (9, 1)])
def test_float_pictures_come_back_bit_for_bit(tmp_path, ending, channels, size):
    path = tmp_path / f"a.{ending}"
    wanted = 1000.0 * picture(*size, channels)
    wanted.flat[0] = np.float32(1e-42)  # below the smallest normal number
    assert image.save_image(path, wanted) == ()
    found = image.load_image(path)
    assert found.pixels.tolist() == wanted.astype(float).tolist()
    assert found.channels == (("Y",) if channels == 1 else ("R", "G", "B"))
    assert found.notes == ()
    assert (found.name, found.alpha, found.mm_per_pixel) == (path.name, None, None)
    assert not found.pixels.flags.writeable


@pytest.mark.parametrize("channels", [1, 3])
def test_png_comes_back_within_half_a_code(tmp_path, channels):
    path = tmp_path / "a.png"
    wanted = picture(channels=channels)
    assert image.save_image(path, wanted) == ()
    found = image.load_image(path)
    difference = image.srgb_encode(found.pixels) - image.srgb_encode(wanted)
    assert np.abs(difference).max() <= HALF_A_CODE * (1 + 1e-9)
    assert found.notes == ("16-bit sRGB decoded to linear",)
    image.save_image(tmp_path / "b.png", found.pixels)
    assert (tmp_path / "b.png").read_bytes() == path.read_bytes()


def test_the_curve_of_srgb():
    codes = np.arange(256) / 255
    literal = [literal_decode(code) for code in codes]
    np.testing.assert_allclose(image.srgb_decode(codes), literal, rtol=1e-14)
    np.testing.assert_allclose(image.srgb_encode(image.srgb_decode(codes)), codes, atol=1e-7)
    # Middle grey of the standard's usual table: code 188 is 0.5029.
    assert image.srgb_decode(188 / 255) == pytest.approx(0.5029, abs=5e-5)


def test_8_bit_png_is_decoded_by_the_formula(tmp_path):
    found = load_bytes(tmp_path, png([bytes(range(256))], width=256, colour=0))
    literal = [literal_decode(code / 255) for code in range(256)]
    np.testing.assert_allclose(found.pixels.ravel(), literal, rtol=1e-14)
    assert found.channels == ("Y",)
    assert found.notes == ("8-bit sRGB decoded to linear",)


CODES = np.random.default_rng(5).integers(0, 256, (6, 5, 4)).astype(np.uint8)


def decoded(codes):
    return [literal_decode(code / 255) for code in np.ravel(codes)]


@pytest.mark.parametrize("count", [1, 3, 4])
@pytest.mark.parametrize("layout", [{}, {"bottom_up": True}, {"packed": True}, {"new": True}])
def test_tga_is_decoded_by_the_formula(tmp_path, count, layout):
    name = "a.dat" if "new" in layout else "a.TGA"  # the old form is known by its ending only
    found = load_bytes(tmp_path, tga(CODES[..., :count], **layout), name)
    np.testing.assert_allclose(
        found.pixels.ravel(), decoded(CODES[..., : min(count, 3)]), rtol=1e-12
    )
    assert found.channels == (("Y",) if count == 1 else ("R", "G", "B"))
    assert "8-bit sRGB decoded to linear" in found.notes
    if count == 4:
        np.testing.assert_array_equal(found.alpha, CODES[..., 3] / 255)
        assert not found.alpha_is_multiplied
    else:
        assert found.alpha is None


@pytest.mark.parametrize("count", [1, 3])
def test_jpeg_is_decoded_by_the_formula(tmp_path, count):
    # Blocks of 8 pixels of one colour: what the format loses is the rounding of its own colours.
    codes = CODES[:2, :3, :count].repeat(8, axis=0).repeat(8, axis=1)
    jpeg(tmp_path / "a.jpg", codes)
    found = image.load_image(tmp_path / "a.jpg")
    assert found.pixels.shape == (16, 24, count)
    off = 255 * image.srgb_encode(found.pixels) - codes
    assert np.abs(off).max() <= 2.0
    assert found.channels == (("Y",) if count == 1 else ("R", "G", "B"))
    assert found.alpha is None
    assert found.notes == ("8-bit sRGB decoded to linear",)


def test_jpeg_is_turned_upright(tmp_path):
    codes = CODES[:2, :3, :3].repeat(8, axis=0).repeat(8, axis=1)
    jpeg(tmp_path / "a.jpeg", codes, Orientation=6)
    found = image.load_image(tmp_path / "a.jpeg")
    off = 255 * image.srgb_encode(found.pixels) - np.rot90(codes, -1)
    assert np.abs(off).max() <= 2.0
    assert "turned upright from orientation 6" in found.notes


def test_a_jpeg_that_is_cut_short_or_damaged_is_not_guessed_at(tmp_path):
    jpeg(tmp_path / "a.jpg", CODES[..., :3].repeat(8, axis=0).repeat(8, axis=1), quality=90)
    data = (tmp_path / "a.jpg").read_bytes()
    for part in (len(data) - 2, len(data) - 60, len(data) // 2):
        with pytest.raises(FileError, match="damaged or cut short") as caught:
            load_bytes(tmp_path, data[:part], "b.jpg")
        assert "\n" not in str(caught.value)
    assert load_bytes(tmp_path, data + b"more", "c.jpg").pixels.shape == (48, 40, 3)


def test_png_by_hand(tmp_path):
    image.save_image(tmp_path / "a.png", picture(), exposure=0.5)
    codes = read_png((tmp_path / "a.png").read_bytes())
    assert codes.shape == (5, 7, 3)
    wanted = image.srgb_encode(0.5 * picture().astype(float))
    assert np.abs(codes / 65535 - wanted).max() <= HALF_A_CODE * (1 + 1e-9)


def test_png_is_read_alike_by_matplotlib(tmp_path):
    image.save_image(tmp_path / "a.png", picture())
    codes = matplotlib.image.imread(tmp_path / "a.png")  # it keeps 8 of the 16 bits
    assert codes.shape == (5, 7, 3)
    assert np.abs(codes - image.srgb_encode(picture())).max() < 1 / 255


def test_tiff_by_hand():
    stream = io.BytesIO()
    image.save_image(stream, picture(), format="tiff")
    data = stream.getvalue()
    assert data[:4] == b"II*\0"
    (start,) = struct.unpack("<I", data[4:8])
    (count,) = struct.unpack("<H", data[start : start + 2])
    fields = [struct.unpack_from("<HHII", data, start + 2 + 12 * i) for i in range(count)]
    values = {tag: value for tag, _, _, value in fields}
    assert (values[256], values[257], values[259]) == (7, 5, 1)
    stored = np.frombuffer(data, "<f4", 5 * 7 * 3, values[273]).reshape(5, 7, 3)
    assert stored.tolist() == picture().tolist()


def test_exr_has_its_channels_by_name():
    stream = io.BytesIO()
    image.save_image(stream, picture(), format="exr")
    data = stream.getvalue()
    assert data[:4] == b"\x76\x2f\x31\x01"
    names = data[data.index(b"chlist\0") :]
    # Each entry is a name, its kind (2 is float32), then 12 bytes.
    assert names.index(b"B\0\2\0\0\0") < names.index(b"G\0\2\0\0\0") < names.index(b"R\0\2\0\0\0")


def test_exr_is_read_alike_by_openexr(tmp_path):
    image.save_image(tmp_path / "a.exr", picture())
    with OpenEXR.File(str(tmp_path / "a.exr")) as file:
        assert np.array_equal(file.channels()["RGB"].pixels, picture())


def test_channels_by_other_names_and_the_scale_stay_in_an_exr(tmp_path):
    wanted = picture(channels=4)
    names = ("450nm", "650nm", "550nm", "x")
    image.save_image(tmp_path / "a.exr", wanted, channels=names, mm_per_pixel=PITCH)
    found = image.load_image(tmp_path / "a.exr")
    assert found.mm_per_pixel == PITCH
    assert sorted(found.channels) == sorted(names)
    for place, name in enumerate(found.channels):
        assert np.array_equal(found.pixels[..., place], wanted[..., names.index(name)])


@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.parametrize("layout", [np.asfortranarray, lambda a: a[::-1, ::-1, ::-1]])
def test_any_layout_in_memory_is_written_right(tmp_path, ending, layout):
    values = layout(picture())
    image.save_image(tmp_path / f"a.{ending}", values)
    image.save_image(tmp_path / f"b.{ending}", np.ascontiguousarray(values))
    first, second = (tmp_path / f"{name}.{ending}" for name in "ab")
    assert first.read_bytes() == second.read_bytes()
    np.testing.assert_allclose(image.load_image(first).pixels, values, atol=2e-5)


def test_no_date_of_writing(tmp_path):
    for ending in ENDINGS:
        image.save_image(tmp_path / f"a.{ending}", picture())
        data = (tmp_path / f"a.{ending}").read_bytes()
        assert b"tIME" not in data
        assert not any(f"{year}:".encode() in data for year in range(2020, 2100))


def test_half_floats_are_read(tmp_path):
    exr(tmp_path / "a.exr", picture(), "RGB", kind="half")
    found = image.load_image(tmp_path / "a.exr")
    assert np.array_equal(found.pixels, picture().astype(np.float16))


def test_radiance_pictures(tmp_path):
    rows = [[[128, 64, 32, 129], [128, 128, 128, 130]]]
    found = load_bytes(tmp_path, hdr(rows, size=b"-Y 1 +X 2"), "a.hdr")
    assert found.pixels.tolist() == [[[1.0, 0.5, 0.25], [2.0, 2.0, 2.0]]]
    assert found.notes == ()
    columns = [[[128, 64, 32, 129]], [[128, 128, 128, 130]]]
    upward = load_bytes(tmp_path, hdr(columns, size=b"+Y 2 +X 1"), "b.hdr")
    assert upward.pixels[:, 0, 0].tolist() == [2.0, 1.0]


def test_palettes_become_rgb(tmp_path):
    palette = (b"PLTE", bytes([255, 0, 0, 10, 20, 30]))
    found = load_bytes(tmp_path, png([b"\0\1"], width=2, colour=3, extra=[palette]))
    wanted = [[1, 0, 0], [literal_decode(code / 255) for code in (10, 20, 30)]]
    np.testing.assert_allclose(found.pixels[0], wanted, rtol=1e-14)
    assert found.alpha is None


def test_alpha_is_kept_apart_and_the_colour_stays(tmp_path):
    found = load_bytes(tmp_path, png([bytes([10, 20, 30, 0, 40, 50, 60, 51])], width=2, colour=6))
    codes = [[10, 20, 30], [40, 50, 60]]
    wanted = [[literal_decode(code / 255) for code in pixel] for pixel in codes]
    np.testing.assert_allclose(found.pixels[0], wanted, rtol=1e-14)
    assert found.alpha.tolist() == [[0.0, 0.2]]
    assert found.notes[0] == "alpha kept apart, colour used as stored, without it"
    grey = load_bytes(tmp_path, png([bytes([10, 51])], width=1, colour=4))
    assert (grey.channels, grey.alpha.tolist()) == (("Y",), [[0.2]])


def test_colour_multiplied_by_alpha(tmp_path):
    values = np.array([[[51, 0, 102, 102], [7, 7, 7, 0]]], dtype=np.uint8)
    found = load_bytes(tmp_path, tiff(values, tags={338: 1}), "a.tif")
    np.testing.assert_allclose(found.pixels[0, 0], [literal_decode(0.5), 0.0, 1.0])
    assert "alpha kept apart, colour divided by it" in found.notes
    exr(tmp_path / "a.exr", picture(channels=4), "RGBA")
    light = image.load_image(tmp_path / "a.exr")
    assert np.array_equal(light.pixels, picture(channels=4)[..., :3])
    assert np.array_equal(light.alpha, picture(channels=4)[..., 3])
    assert light.notes == ("alpha kept apart, colour used as stored, multiplied by it",)


@pytest.mark.parametrize(("kind", "full"), [(np.uint8, 255), (np.uint16, 65535)])
def test_tiff_of_whole_numbers_is_decoded(tmp_path, kind, full):
    codes = (picture() * full).astype(kind)
    found = load_bytes(tmp_path, tiff(codes), "a.tif")
    literal = np.vectorize(literal_decode)(codes / full)
    np.testing.assert_allclose(found.pixels, literal, rtol=1e-13)
    assert found.notes == (f"{8 * codes.itemsize}-bit sRGB decoded to linear",)


def test_a_file_that_says_it_is_linear_stays_so(tmp_path):
    linear = (b"gAMA", struct.pack(">I", 100000))
    found = load_bytes(tmp_path, png([bytes([51])], width=1, colour=0, extra=[linear]))
    assert found.pixels.item() == 0.2
    assert found.notes == ("8-bit, linear as the file says",)
    with_alpha = png([bytes([51, 102, 153, 204])], width=1, colour=6, extra=[linear])
    found = load_bytes(tmp_path, with_alpha)
    np.testing.assert_allclose(found.pixels[0, 0], [0.2, 0.4, 0.6], rtol=1e-12)
    assert found.notes == (
        "alpha kept apart, colour used as stored, without it",
        "8-bit, linear as the file says",
    )


@pytest.mark.parametrize("kind", [np.float16, np.float32, np.float64])
def test_tiff_of_floats_is_linear(tmp_path, kind):
    values = (100 * picture()).astype(kind)
    found = load_bytes(tmp_path, tiff(values), "a.tif")
    assert np.array_equal(found.pixels, values)
    assert found.notes == ()


# Where the corners of a picture lie in the file: TIFF 6.0, Orientation; a is top left, b top
# right, c bottom left, d bottom right.
STORED = {1: "ab/cd", 2: "ba/dc", 3: "dc/ba", 4: "cd/ab", 5: "ac/bd", 6: "bd/ac"}
STORED |= {7: "db/ca", 8: "ca/db"}
UPRIGHT = {"a": 1.0, "b": 2.0, "c": 3.0, "d": 4.0}


@pytest.mark.parametrize("orientation", STORED)
def test_pictures_are_turned_upright(tmp_path, orientation):
    rows = [[[UPRIGHT[corner]] for corner in row] for row in STORED[orientation].split("/")]
    data = tiff(np.array(rows, dtype=np.float32), tags={274: orientation})
    found = load_bytes(tmp_path, data, "a.tif")
    assert found.pixels[..., 0].tolist() == [[1.0, 2.0], [3.0, 4.0]]
    words = f"turned upright from orientation {orientation}"
    assert found.notes == ((words,) if orientation > 1 else ())


def test_the_first_part_with_colour_is_read(tmp_path):
    header = {"type": OpenEXR.scanlineimage}
    depth, colour = picture(channels=1)[..., 0], picture()
    parts = [
        OpenEXR.Part({**header, "name": "z"}, {"Z": depth}, "z"),
        OpenEXR.Part({**header, "name": "rgb"}, {"RGB": colour, "N": depth}, "rgb"),
    ]
    OpenEXR.File(parts).write(str(tmp_path / "a.exr"))
    found = image.load_image(tmp_path / "a.exr")
    assert np.array_equal(found.pixels, colour)
    assert found.notes == ("part 2 of 2 used", "channels N left out")


@pytest.mark.parametrize(
    ("names", "said"),
    [
        ("ab", "channels a, b are read back as b alone, with a as alpha"),
        ("cbAd", "channels c, b, A, d are read back as c, b, d alone, with A as alpha"),
        ("XY", "channels X, Y are read back as Y alone"),
        ("RGBN", "channels R, G, B, N are read back as R, G, B alone"),
        (("s.a", "s.b"), "channels s.a, s.b are not read back"),
        ("abc", None),
        ("rgb", None),
        ("XYZ", None),
        (("s.R", "s.G", "s.B"), None),
        ("Y", None),
        ("A", None),
    ],
)
def test_names_that_are_read_as_something_else_are_noted(tmp_path, names, said):
    path, light = tmp_path / "a.exr", picture(channels=len(names))
    notes = image.save_image(path, light, channels=tuple(names))
    assert [each.partition(";")[0] for each in notes] == ([said] if said else [])
    try:
        found = image.load_image(path)
    except RenderError:
        assert "not read back" in said
        return
    assert (found.pixels.shape == light.shape) == (said is None)
    assert (found.alpha is not None) == ("as alpha" in (said or ""))


def test_a_window_of_data_is_put_into_its_picture(tmp_path):
    window = {"x": 2, "y": -1, "full_width": 6, "full_height": 8, "full_x": 0, "full_y": 0}
    exr(tmp_path / "a.exr", picture(), "RGB", **window)
    found = image.load_image(tmp_path / "a.exr")
    wanted = np.zeros((8, 6, 3))
    wanted[:4, 2:] = picture()[1:, :4]
    assert np.array_equal(found.pixels, wanted)
    assert found.notes == ("7 x 5 pixels of data put into the 6 x 8 of the picture",)


def test_other_channels_are_left_out_or_refused(tmp_path):
    exr(tmp_path / "a.exr", picture(channels=4), ("Z", "R", "G", "B"))
    found = image.load_image(tmp_path / "a.exr")
    assert np.array_equal(found.pixels, picture(channels=4)[..., 1:])
    assert found.notes == ("channels Z left out",)
    exr(tmp_path / "b.exr", picture(), ("skin.N", "skin.U", "skin.V"))
    with pytest.raises(RenderError, match=r"b\.exr has the channels skin\.N, skin\.U, skin\.V; "):
        image.load_image(tmp_path / "b.exr")


def test_the_ending_does_not_matter_for_reading(tmp_path):
    for ending, other in zip(ENDINGS, ("png", "exr", "txt"), strict=True):
        image.save_image(tmp_path / f"a.{ending}", picture())
        data = (tmp_path / f"a.{ending}").read_bytes()
        found = load_bytes(tmp_path, data, f"wrong {ending} %d ü?.{other}")
        assert np.array_equal(found.pixels, image.load_image(tmp_path / f"a.{ending}").pixels)


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (np.nan, "2 of 105 values are NaN or infinite"),
        (np.inf, "2 of 105 values are NaN or infinite"),
        (-1e-9, "2 of 105 values are negative"),
    ],
)
def test_bad_values_are_counted_and_placed(tmp_path, value, words):
    values = picture()
    values[3, 2, 1] = values[4, 0, 0] = value
    exr(tmp_path / "a.exr", values, "RGB")
    with pytest.raises(RenderError, match=f"{words}, the first at row 3, column 2, channel G; "):
        image.load_image(tmp_path / "a.exr")


def test_too_large_pictures_are_refused_by_their_header(tmp_path):
    # As long as a real one would be; nothing of it can be decoded.
    filling = (b"IDAT", np.random.default_rng(1).bytes(6_000_000))
    head = (b"IHDR", struct.pack(">IIBBBBB", 20000, 20000, 8, 2, 0, 0, 0))
    data = b"\x89PNG\r\n\x1a\n" + b"".join(chunk(*c) for c in (head, filling, (b"IEND", b"")))
    line = r"is 20000 x 20000 with 3 channels: rendering needs 38\.4 GB, the limit is 4 GB; crop"
    with pytest.raises(RenderError, match=line):
        load_bytes(tmp_path, data)
    image.save_image(tmp_path / "a.exr", picture())
    image.load_image(tmp_path / "a.exr", largest_bytes=32 * 105)
    with pytest.raises(RenderError, match="7 x 5 with 3 channels"):
        image.load_image(tmp_path / "a.exr", largest_bytes=32 * 105 - 1)


@pytest.mark.parametrize("ending", [*ENDINGS, "hdr", "jpg", "tga"])
def test_damage_is_one_line(tmp_path, ending, capfd):
    if ending == "hdr":
        data = hdr(np.full((5, 7, 4), 130), size=b"-Y 5 +X 7")
    elif ending == "tga":
        data = tga(CODES)
    elif ending == "jpg":
        jpeg(tmp_path / "a.jpg", CODES[..., :3].repeat(4, axis=0))
        data = (tmp_path / "a.jpg").read_bytes()
    else:
        image.save_image(tmp_path / f"a.{ending}", picture())
        data = (tmp_path / f"a.{ending}").read_bytes()
    for part in (0, 3, 12, 30, len(data) // 2, len(data) - 20):
        with pytest.raises(FileError) as caught:
            load_bytes(tmp_path, data[:part], f"b.{ending}")
        assert "\n" not in str(caught.value), part
        assert str(caught.value).startswith(str(tmp_path / f"b.{ending}"))
    # Whatever a flipped byte does, it is an error of ours or a picture.
    for place in range(4, len(data), max(1, len(data) // 150)):
        flipped = data[:place] + bytes([data[place] ^ 0xFF]) + data[place + 1 :]
        with contextlib.suppress(SssfitError):
            load_bytes(tmp_path, flipped, f"c.{ending}")
    assert capfd.readouterr().err == ""


def test_what_is_no_picture(tmp_path):
    for data, words in (
        (b"", "is empty"),
        (b"GIF89a", "is not an EXR, HDR, TIFF, PNG, JPG or TGA file"),
    ):
        with pytest.raises(FileError, match=rf"a\.exr {words}; name a picture"):
            load_bytes(tmp_path, data, "a.exr")
    with pytest.raises(FileError, match="is a folder or a device"):
        image.load_image(tmp_path)
    with pytest.raises(FileError, match=r"b\.exr cannot be read: no such file"):
        image.load_image(tmp_path / "b.exr")
    with pytest.raises(RenderError, match="has pixels of int; expected 8 or 16 bits"):
        load_bytes(tmp_path, tiff(np.ones((2, 2, 3), dtype=np.int32)), "c.tif")


def test_a_name_that_is_not_utf8(tmp_path):
    path = tmp_path / os.fsdecode(b"\xff.png")
    image.save_image(path, picture())
    with pytest.raises(FileError, match=r"udcff\.png has a name that is not UTF-8; rename it"):
        image.load_image(path)


def test_is_image_file(tmp_path):
    for ending in ENDINGS:
        image.save_image(tmp_path / f"a.{ending}", picture())
        assert image.is_image_file(tmp_path / f"a.{ending}")
    (tmp_path / "b.png").write_bytes(b"GIF89a")
    assert not image.is_image_file(tmp_path / "b.png")
    assert not image.is_image_file(tmp_path / "c.png")


def test_png_is_clipped_and_says_so(tmp_path):
    values = np.array([[[-0.1], [0.5], [2.0]]])
    assert image.save_image(tmp_path / "a.png", values) == ("2 of 3 values clipped to 0 to 1",)
    np.testing.assert_allclose(
        image.load_image(tmp_path / "a.png").pixels.ravel(), [0, 0.5, 1], atol=2e-5
    )
    values[0, 0] = 0.0
    assert image.save_image(tmp_path / "a.png", values, exposure=0.5, channels=["Y"]) == ()


def test_signed_results_are_written_as_they_are(tmp_path):
    stream = io.BytesIO()
    image.save_image(stream, np.full((1, 1, 1), -0.5), format="tiff")
    assert struct.pack("<f", -0.5) in stream.getvalue()


@pytest.mark.parametrize(
    ("values", "options", "words"),
    [
        (np.full((1, 1, 3), np.nan), {}, "3 of 3 values are NaN or infinite"),
        (np.zeros((2, 2)), {}, r"pixels of shape \(2, 2\); expected rows"),
        (np.zeros((0, 2, 3)), {}, r"pixels of shape \(0, 2, 3\)"),
        (np.zeros((2, 2, 4)), {"format": "png"}, "4 channels do not fit a PNG file"),
        (np.zeros((2, 2, 4)), {"format": "tiff"}, "4 channels do not fit a TIFF file"),
        (np.zeros((2, 2, 4)), {}, "0 channel names for 4 channels"),
        (np.zeros((2, 2, 2)), {"channels": "aa"}, "2 channel names for 2 channels"),
        (
            np.zeros((2, 2, 3)),
            {"format": "png", "channels": "XYZ"},
            "a PNG file has no names",
        ),
        (
            np.zeros((2, 2, 1)),
            {"format": "tiff", "channels": ["A"]},
            "leave `channels` out",
        ),
        (np.full((1, 1, 1), 1e39), {}, "1e[+]39 does not fit 32-bit floats"),
        (np.zeros((2, 2, 3)), {"exposure": 2.0}, "exposure = 2 is for PNG"),
        (np.zeros((2, 2, 3)), {"format": "png", "exposure": 0.0}, "exposure = 0; expected"),
        (np.zeros((2, 2, 3)), {"format": "gif"}, "format 'gif': pictures are written as exr"),
    ],
)
def test_what_cannot_be_written(values, options, words):
    stream = io.BytesIO()
    with pytest.raises(SssfitError, match=words) as caught:
        image.save_image(stream, values, **{"format": "exr", **options})
    assert "\n" not in str(caught.value)
    assert stream.getvalue() == b""


def test_unknown_ending():
    with pytest.raises(FileError, match=r"a\.jpg: pictures are written as EXR, TIFF or 16-bit PNG"):
        image.save_image("a.jpg", picture())


def test_an_interrupted_write_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "a.exr"
    image.save_image(path, picture())
    old = path.read_bytes()

    def interrupted(*args):
        raise KeyboardInterrupt

    monkeypatch.setattr("os.fsync", interrupted)
    with pytest.raises(KeyboardInterrupt):
        image.save_image(path, picture(3, 3))
    assert path.read_bytes() == old
    assert [found.name for found in tmp_path.iterdir()] == ["a.exr"]


def test_no_room_for_the_passing_file_is_one_line(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "missing"))
    with pytest.raises(FileError, match="cannot be written: no such file"):
        image.save_image(tmp_path / "a.exr", picture())
    assert list(tmp_path.iterdir()) == []
