"""Ways to damage a file or a command line: what people, disks and attackers do to them.

Each takes a ``random.Random`` and returns something else of the same kind; nothing else decides.
"""

import contextlib
import io
import json
import re
import zipfile

import numpy as np

DIGITS = "1234567890" * 40
# In place of a number, or of any other word.
WORDS = (
    *("nan", "inf", "-inf", "1e308", "-1e308", "1e999", "1e-320", "-1", "0", "-0", "1e200", "1e12"),
    *(DIGITS, f"0.{DIGITS}", "1000000000000", "1e0000001", "0x10", "1_000", "1,5", "٣", "1.#INF"),
    *(
        "true",
        "false",
        "null",
        "None",
        '"text"',
        "text",
        "'",
        '"',
        "[]",
        "{}",
        "[[1]]",
        "",
        "#",
        "=",
    ),
)
# Anywhere in a text: halves of characters, marks of byte order, what moves a cursor or a line.
BYTES = (
    *(b"\xff", b"\xfe\xff", b"\xef\xbb\xbf", b"\xed\xa0\x80", b"\x00", b"\x1b[31m", b"\r", b"\n"),
    *(
        "\u2028".encode(),
        "\u202e".encode(),
        "é".encode("latin-1"),
        "🙂".encode(),
        b"\\",
        b"\t",
        b'"',
    ),
)
# In place of a value of JSON.
VALUES = (
    *(None, True, False, "text", "", "1", "a\nb", "\ud800", "\u2028", "\x1b[0m", [], {}, [[]]),
    *(0, -1, 1, 2, 1.5, 1e200, -1e200, 1e18, 1e-320, 10**12, int(DIGITS), [1.0], {"a": 1}),
    *(float("nan"), float("inf"), -float("inf"), 2**64, "x" * 5000),
)
FLOATS = (np.nan, np.inf, -np.inf, 0.0, -0.0, -1.0, 1.0, 5e-324, 1e-200, 1e12, 1e200, -1e200, 1e308)
_NUMBER = re.compile(rb"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")
_WORD = re.compile(rb"[A-Za-z_]+")


def damaged_text(rng, content):
    """A text with one to three things done to its bytes, lines or words."""
    for _ in range(_few(rng)):
        content = rng.choice(_OF_TEXT)(rng, content)
    return content


def damaged_json(rng, content):
    """A JSON text with one to three values replaced, keys lost or lists grown; rarely as a text."""
    if rng.random() < 0.15:
        return damaged_text(rng, content)
    whole = json.loads(content)
    if "terms" in whole and rng.random() < 0.3:
        _rescale(rng, whole)
    for _ in range(_few(rng) if rng.random() < 0.9 else 0):
        _change_somewhere(rng, whole)
    return json.dumps(whole).encode()


def damaged_npz(rng, content):
    """An archive with its numbers, shapes, types, members, headers or bytes changed."""
    if rng.random() < 0.15:
        return rng.choice((_flip, _cut))(rng, content)
    with np.load(io.BytesIO(content)) as members:
        arrays = dict(members)
    for _ in range(_few(rng)):
        rng.choice(_OF_ARRAYS)(rng, arrays)
    stored = zipfile.ZIP_STORED if rng.random() < 0.7 else zipfile.ZIP_DEFLATED
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", stored) as archive:
        for name, value in arrays.items():
            archive.writestr(name if "." in name else f"{name}.npy", _npy(rng, value))
    packed = buffer.getvalue()
    return _bomb(rng, packed) if rng.random() < 0.03 else packed


def _few(rng):
    """Mostly one: what is wrong in a single place gets furthest."""
    return rng.choice((1, 1, 1, 2, 3))


def _flip(rng, content):
    changed = bytearray(content)
    for _ in range(rng.randint(1, 4)):
        if changed:
            changed[rng.randrange(len(changed))] ^= 1 << rng.randrange(8)
    return bytes(changed)


def _cut(rng, content):
    return content[: rng.randrange(len(content) + 1)]


def _insert(rng, content):
    at = rng.randrange(len(content) + 1)
    return content[:at] + rng.choice(BYTES) + content[at:]


def _begin(rng, content):
    return rng.choice(BYTES) + content


def _replace(pattern):
    def replaced(rng, content):
        places = [match.span() for match in pattern.finditer(content)]
        if not places:
            return content
        start, end = rng.choice(places)
        return content[:start] + rng.choice(WORDS).encode() + content[end:]

    return replaced


def _scaled(rng, content):
    """A number that may well be right, only another one."""
    places = list(_NUMBER.finditer(content))
    if not places:
        return content
    match = rng.choice(places)
    try:
        value = float(match[0]) * rng.choice((-1.0, 1e-6, 1e-3, 0.5, 1.01, 2.0, 10.0, 1e3, 1e6))
    except (ValueError, OverflowError):
        return content
    text = repr(int(value) if b"." not in match[0] and abs(value) < 1e15 else value)
    return content[: match.start()] + text.encode() + content[match.end() :]


def _lines(change):
    def changed(rng, content):
        lines = content.split(b"\n")
        change(rng, lines, rng.randrange(len(lines)))
        return b"\n".join(lines)

    return changed


def _twice(rng, lines, at):
    lines.insert(rng.randrange(len(lines) + 1), lines[at])


def _gone(rng, lines, at):
    del lines[at]


def _often(rng, lines, at):
    lines[at:at] = [lines[at]] * 300


def _swapped(rng, lines, at):
    other = rng.randrange(len(lines))
    lines[at], lines[other] = lines[other], lines[at]


def _long(rng, lines, at):
    lines[at] = lines[at] + rng.choice((b" ", b",", b"x", b"1", b"[")) * 5000


def _utf16(rng, content):
    return content.decode("utf-8", "replace").encode("utf-16")


_OF_TEXT = (
    *(_flip, _cut, _insert, _insert, _begin, _replace(_NUMBER), _replace(_NUMBER)),
    *(_replace(_NUMBER), _replace(_WORD), _utf16, _scaled, _scaled, _scaled, _scaled),
    *map(_lines, (_twice, _gone, _often, _swapped, _long)),
)


def _places(value):
    """Every (container, key) within a value of JSON."""
    if isinstance(value, dict):
        keys = list(value)
    elif isinstance(value, list):
        # Of ten thousand weights a few stand for all.
        keys = range(len(value)) if len(value) < 20 else [0, 1, len(value) // 2, len(value) - 1]
    else:
        return []
    return [(value, key) for key in keys] + [each for key in keys for each in _places(value[key])]


def _change_somewhere(rng, whole):
    places = _places(whole)
    if not places:
        return
    container, key = rng.choice(places)
    what = rng.randrange(6)
    if what == 0:
        del container[key]
    elif what == 1 and isinstance(container, dict):
        container[rng.choice(("", "a\nb", "\ud800", "R", "format"))] = container[key]
    elif what == 1:
        container.append(container[key])
    elif what == 2 and isinstance(container[key], (int, float)):
        container[key] = container[key] * rng.choice((-1, 0, 1.0000001, 2, 1e10, 1e-10))
    else:
        container[key] = rng.choice(VALUES)


def _rescale(rng, kernel):
    """Another kernel that agrees with itself: brighter, fainter, of another pitch."""
    factor = rng.choice((0.0, 1e-40, 1e-30, 1e-3, 3.0, 1e9, 1e16, 1e18, 1e19))
    pitch = rng.choice((1e-13, 1e-12, 0.2, 1.0, 1e12, 1e13))
    for term in kernel["terms"]:
        term["weights"] = [[factor * each for each in row] for row in term["weights"]]
    kernel["energy"] = [factor**2 * each for each in kernel["energy"]]
    kernel["support_mm"] = (kernel["pixels"] - 1) // 2 * pitch
    kernel["mm_per_pixel"] = pitch
    scale = rng.choice((0.0, 1e-300, 1e-3, 1.0, 1e18))
    kernel["scale"] = [scale * each for each in kernel["scale"]]


def _number_changed(rng, arrays):
    name = rng.choice([name for name in arrays if name != "meta"] or ["none"])
    value = arrays.get(name)
    if isinstance(value, np.ndarray) and value.size and value.dtype.kind == "f":
        arrays[name] = value.copy()
        at = rng.randrange(value.size)
        mild = value.flat[at] * rng.choice((0.0, 0.5, 1.001, 2.0, 100.0))
        arrays[name].flat[at] = rng.choice((mild, rng.choice(FLOATS)))


def _all_changed(rng, arrays):
    name = rng.choice(list(arrays))
    value = arrays[name]
    if isinstance(value, np.ndarray) and value.dtype.kind == "f":
        with np.errstate(all="ignore"):
            arrays[name] = value * rng.choice((-1.0, 0.0, 2.0, 1e6, 1e12, 1e200, 1e-200))


def _shape_changed(rng, arrays):
    name = rng.choice(list(arrays))
    value = arrays[name]
    if isinstance(value, np.ndarray):
        shapes = (value[None], value.ravel(), value.ravel()[:-1], value.ravel()[:0], value.T)
        arrays[name] = rng.choice(shapes)


def _type_changed(rng, arrays):
    name = rng.choice(list(arrays))
    value = np.asarray(arrays[name])
    kinds = (
        ("f4", "i8", "?", "c16", "U8", ">f8", "O") if value.dtype.kind == "f" else ("O", "S", "U9")
    )
    with np.errstate(all="ignore"), contextlib.suppress(ValueError):
        arrays[name] = value.astype(rng.choice(kinds), casting="unsafe")


def _member_changed(rng, arrays):
    name, what = rng.choice(list(arrays)), rng.randrange(4)
    if what == 0 and len(arrays) > 1:
        del arrays[name]
    elif what == 1:
        arrays[rng.choice(("more", "a/b", "../up", "a\nb", "meta.txt"))] = arrays[name]
    elif what == 2:
        arrays[name] = b"cos\nsystem\n(S'true'\ntR."  # a pickle that runs a program
    else:
        other = rng.choice(list(arrays))
        arrays[name], arrays[other] = arrays[other], arrays[name]


def _meta_changed(rng, arrays):
    if isinstance(arrays.get("meta"), np.ndarray) and arrays["meta"].dtype.kind == "U":
        content = str(arrays["meta"]).encode("utf-8", "surrogatepass")
        try:
            text = damaged_json(rng, content)
        except ValueError:  # damaged before, no longer JSON
            text = damaged_text(rng, content)
        arrays["meta"] = np.array(text.decode("utf-8", "replace"))


_OF_ARRAYS = (
    *(_number_changed, _number_changed, _all_changed, _shape_changed, _type_changed),
    *(_member_changed, _meta_changed, _meta_changed, _meta_changed),
)


def _npy(rng, value):
    """The bytes of a member; rarely with a header that lies."""
    if isinstance(value, bytes):
        return value
    buffer = io.BytesIO()
    np.lib.format.write_array(buffer, np.asarray(value), allow_pickle=True)
    content = buffer.getvalue()
    if rng.random() < 0.03:
        claim = rng.choice((b"(1000000000000,)", b"(-1,)", b"(100000, 64)", b"None", b"(1,", b"()"))
        content = re.sub(rb"'shape': \([^)]*\)", b"'shape': " + claim, content)
    return content


def _bomb(rng, packed):
    """An archive whose directory declares 3 GB of a member."""
    buffer = io.BytesIO(packed)
    with zipfile.ZipFile(buffer, "a") as target:
        members = target.infolist()
        if members:
            rng.choice(members).file_size = 3_000_000_000
        target.writestr("last", b"")  # the directory is written again on close
    return buffer.getvalue()
