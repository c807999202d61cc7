"""Pictures for tests: files by hand, byte by byte, and an EXR with what `save_image` leaves out."""

import struct
import zlib

import numpy as np

from sssfit.formats import pictures as image


def picture(rows=5, columns=7, channels=3):
    """No two rows, columns or channels alike; 0 to 1."""
    return np.random.default_rng(1).random((rows, columns, channels), dtype=np.float32)


def chunk(name, data):
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


def png(rows, *, width, bits=8, colour=2, extra=()):
    """A PNG by hand: rows of bytes, filter 0."""
    head = struct.pack(">IIBBBBB", width, len(rows), bits, colour, 0, 0, 0)
    data = zlib.compress(b"".join(b"\0" + row for row in rows))
    chunks = [(b"IHDR", head), *extra, (b"IDAT", data), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunk(*each) for each in chunks)


def read_png(data):
    """The codes of a 16-bit RGB or RGBA PNG, after the five filters of its standard."""
    place, packed = 8, b""
    while place < len(data):
        length, name = struct.unpack_from(">I4s", data, place)
        body = data[place + 8 : place + 8 + length]
        if name == b"IHDR":
            width, height, bits, colour = struct.unpack(">IIBB", body[:10])
        packed += body if name == b"IDAT" else b""
        place += 12 + length
    assert (bits, colour) in ((16, 2), (16, 6))
    count = 3 if colour == 2 else 4
    step, length = 2 * count, 2 * count * width
    stored, above, rows = zlib.decompress(packed), bytes(length), []
    for start in range(0, len(stored), length + 1):
        method, row = stored[start], bytearray(stored[start + 1 : start + 1 + length])
        for i in range(len(row)):
            left, up = (row[i - step] if i >= step else 0), above[i]
            corner = above[i - step] if i >= step else 0
            nearest = min((left, up, corner), key=lambda v: abs(left + up - corner - v))
            row[i] = (row[i] + (0, left, up, (left + up) // 2, nearest)[method]) % 256
        above = bytes(row)
        rows.append(above)
    return np.frombuffer(b"".join(rows), ">u2").reshape(height, width, count).astype(float)


def tiff(values, *, tags=()):
    """A TIFF by hand, one strip: a numpy array (H, W, C) of any type, further short tags."""
    height, width, count = values.shape
    kind = {"f": 3, "i": 2, "u": 1}[values.dtype.kind]
    shorts = {256: width, 257: height, 259: 1, 262: 2 if count >= 3 else 1, 277: count}
    shorts |= {278: height, 284: 1} | dict(tags)
    entries = {tag: struct.pack("<HIHxx", 3, 1, value) for tag, value in shorts.items()}
    directory = 6 + 12 * (len(entries) + 4)
    bits, formats = 8 + directory, 8 + directory + 2 * count
    data = formats + 2 * count
    if count == 1:
        entries[258] = struct.pack("<HIHxx", 3, 1, values.dtype.itemsize * 8)
        entries[339] = struct.pack("<HIHxx", 3, 1, kind)
    else:
        entries |= {258: struct.pack("<HII", 3, count, bits)}
        entries |= {339: struct.pack("<HII", 3, count, formats)}
    entries |= {273: struct.pack("<HII", 4, 1, data), 279: struct.pack("<HII", 4, 1, values.nbytes)}
    body = b"".join(struct.pack("<H", tag) + entries[tag] for tag in sorted(entries))
    arrays = struct.pack(f"<{2 * count}H", *[values.dtype.itemsize * 8] * count, *[kind] * count)
    head = b"II*\0" + struct.pack("<I", 8) + struct.pack("<H", len(entries)) + body
    return head + bytes(4) + arrays + values.astype(values.dtype.newbyteorder("<")).tobytes()


def hdr(rows, *, size, head=b""):
    """A Radiance picture by hand, without run lengths: r, g, b, exponent."""
    text = b"#?RADIANCE\n" + head + b"FORMAT=32-bit_rle_rgbe\n\n" + size + b"\n"
    return text + bytes(np.array(rows, dtype=np.uint8).ravel())


def exr(path, values, names, *, kind="float", parts=(), **attributes):
    """An EXR with what `save_image` does not write."""
    import OpenImageIO as oiio  # noqa: N813

    spec = oiio.ImageSpec(values.shape[1], values.shape[0], values.shape[2], kind)
    spec.channelnames = tuple(names)
    for name, value in attributes.items():
        setattr(spec, name, value)
    out = oiio.ImageOutput.create(str(path))
    assert out.open(str(path), spec), out.geterror()
    assert out.write_image(np.ascontiguousarray(values)), out.geterror()
    out.close()


def load_bytes(tmp_path, data, name="a.png"):
    path = tmp_path / name
    path.write_bytes(data)
    return image.load_image(path)


def jpeg(path, codes, *, quality=100, **attributes):
    """A JPEG of 8-bit codes (H, W, C), each colour of its own (4:4:4)."""
    import OpenImageIO as oiio  # noqa: N813

    spec = oiio.ImageSpec(codes.shape[1], codes.shape[0], codes.shape[2], "uint8")
    spec.attribute("Compression", f"jpeg:{quality}")
    spec.attribute("jpeg:subsampling", "4:4:4")
    for name, value in attributes.items():
        spec.attribute(name, value)
    out = oiio.ImageOutput.create(str(path))
    assert out.open(str(path), spec), out.geterror()
    assert out.write_image(np.ascontiguousarray(codes)), out.geterror()
    out.close()


def tga(codes, *, bottom_up=False, packed=False, new=False):
    """A TGA by hand (Truevision, version 2.0, which ``new`` says): codes (H, W, 1, 3 or 4)."""
    height, width, count = codes.shape
    kind = (3 if count == 1 else 2) + (8 if packed else 0)
    alpha_bits = 8 if count == 4 else 0
    place = alpha_bits | (0 if bottom_up else 0x20)
    head = struct.pack("<BBBHHBHHHHBB", 0, 0, kind, 0, 0, 0, 0, 0, width, height, 8 * count, place)
    order = {1: [0], 3: [2, 1, 0], 4: [2, 1, 0, 3]}[count]
    rows = codes[::-1] if bottom_up else codes
    pixels = rows[..., order].astype(np.uint8).reshape(-1, count)
    each = b"\x80" if packed else b""  # packets of one pixel, repeated once
    body = b"".join(each + bytes(pixel) for pixel in pixels)
    return head + body + (bytes(8) + b"TRUEVISION-XFILE.\0" if new else b"")
