"""What an invocation left behind, as lines that a person can read and compare."""

import contextlib
import io
import json
import re
import tempfile
import zipfile
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import OpenImageIO
from approval_run import Command, Ran

from sssfit import __version__

_FEW = 24  # numbers that are listed in full
_PICTURES = (".exr", ".tif", ".tiff", ".png", ".hdr")
_ANSI = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")


def lines_of(command: Command, ran: Ran) -> list[str]:
    """Everything that an invocation did."""
    lines = [f"exit {ran.status}"]
    lines += _section("stdout", _stdout(ran))
    lines += _section("stderr", _stderr(command, ran))
    stores = Counter(name.partition("/")[0] for name in ran.written if ".zarr/" in name)
    lines += [f"wrote {name}, {count} files" for name, count in stores.items()]
    for name, data in ran.written.items():
        if ".zarr/" in name:
            continue
        content = [] if command.brief else file_lines(name, data, ran.charts)
        lines += _section(f"wrote {name}", content) or [f"wrote {name}"]
    lines += [f"removed {name}" for name in ran.gone]
    return [masked(line, ran.folder, command.hidden) for line in lines]


def _section(head: str, content: list[str]) -> list[str]:
    return [head, *(f"| {line}".rstrip() if line else "|" for line in content)] if content else []


def masked(line: str, folder: str, hidden: Sequence[str] = ()) -> str:
    """Hide what no two machines or versions have alike."""
    line = line.replace(folder, "FOLDER")
    line = re.sub(rf"(?<![\w.]){re.escape(__version__)}(?![\w.])", "VERSION", line)
    # How often a search asks depends on the last bits of sums.
    line = re.sub(r'("evaluations": )(\d+|\[[\d, ]*\])', r"\1HIDDEN", line)
    for pattern in hidden:
        line = re.sub(pattern, "HIDDEN", line)
    return line


# Streams


def _stdout(ran: Ran) -> list[str]:
    if ran.stdout in ran.charts:
        return ran.charts[ran.stdout]
    if ran.stdout.startswith(b"PK"):
        return list(_npz(ran.stdout))
    if ran.stdout.startswith(b"\x76\x2f\x31\x01"):
        return list(_picture("stdout.exr", ran.stdout))
    return text_lines(ran.stdout.decode("utf-8"))


def _stderr(command: Command, ran: Ran) -> list[str]:
    if not command.terminal:
        return text_lines(ran.stderr)
    shown = [line.rstrip() for line in re.split(r"[\r\n]", _ANSI.sub("", ran.stderr))]
    return [line for line in shown if line]


def text_lines(text: str) -> list[str]:
    """Lines as they are, spaces at their ends made visible; JSON a key a line."""
    lines = text.split("\n")
    ending = [] if lines[-1] == "" else ["(no newline at the end)"]
    told = [line for each in lines[: len(lines) - (not ending)] for line in _line(each)]
    return [*told, *ending] if text else []


def _line(line: str) -> Iterator[str]:
    whole = None
    if line.startswith("{") and line.endswith("}"):
        with contextlib.suppress(ValueError):
            whole = json.loads(line)
        if whole is not None and json.dumps(whole) == line:
            yield "{"
            yield from _json(whole)
            yield "}"
            return
    spaces = len(line) - len(line.rstrip(" "))
    yield line.rstrip(" ") + "·" * spaces


def _json(whole: dict[str, Any], depth: int = 1) -> Iterator[str]:
    """A key a line; tables within on lines of their own."""
    space = "  " * depth
    for key, value in whole.items():
        head = f"{space}{json.dumps(key, ensure_ascii=False)}:"
        if isinstance(value, dict) and len(json.dumps(value)) > 100:
            yield head
            yield from _json(value, depth + 1)
        elif isinstance(value, list) and value and all(isinstance(each, dict) for each in value):
            yield head
            yield from _rows(value, depth + 1)
        else:
            yield f"{head} {_short(json.dumps(value, ensure_ascii=False))}"


def _rows(rows: list[dict[str, Any]], depth: int) -> Iterator[str]:
    """One row a key a line; several that are alike as a table."""
    keys = list(rows[0])
    if len(rows) == 1 or any(list(each) != keys for each in rows):
        for each in rows:
            yield "  " * depth + "-"
            yield from _json(each, depth + 1)
        return
    yield "  " * depth + "; ".join(keys)
    for each in rows:
        cells = (_short(json.dumps(value, ensure_ascii=False)) for value in each.values())
        yield "  " * depth + "; ".join(cells)


# Files


def file_lines(
    name: str, data: bytes, charts: Mapping[bytes, list[str]] = MappingProxyType({})
) -> list[str]:
    """A file by its content; ``charts`` are descriptions of charts."""
    if data in charts:
        return charts[data]
    if data.startswith(b"PK"):
        return list(_npz(data))
    if name.endswith(_PICTURES):
        return list(_picture(name, data))
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError:
        return [f"{len(data)} bytes"]
    return [_short(line) for line in text_lines(text)]


def _short(line: str) -> str:
    """Put a summary in the place of long lists of numbers, nested or not."""
    parts, at = [], 0
    while (begin := line.find("[", at)) >= 0:
        end = _closing(line, begin)
        inside = line[begin:end]
        if len(inside) > 200 and re.fullmatch(r"[-+\d.eE\[\],\s]*", inside):
            parts += [line[at:begin], summary(json.loads(inside))]
            at = end
        else:
            parts.append(line[at : begin + 1])
            at = begin + 1
    return "".join([*parts, line[at:]])


def _closing(line: str, begin: int) -> int:
    depth = 0
    for k in range(begin, len(line)):
        depth += (line[k] == "[") - (line[k] == "]")
        if depth == 0:
            return k + 1
    return len(line)


def summary(values: Any) -> str:
    """Shape, first and last, and two sums, of which one tells the order."""
    try:
        array = np.asarray(values, dtype=np.float64)
    except ValueError:  # rows of unlike lengths
        return f"[{', '.join(summary(each) for each in values)}]"
    shape = " x ".join(map(str, array.shape))
    flat = array.ravel()
    places = np.cos(1.0 + np.arange(flat.size))
    ends = " ".join(_number(each) for each in (*flat[:3], *flat[-2:]))
    sums = f"sum {_number(np.nansum(flat))}, mixed {_number(np.nansum(places * flat))}"
    return f"<{shape}: {ends}; {sums}>"


def _number(value: float) -> str:
    return f"{value + 0.0:.10g}"


def _npz(data: bytes) -> Iterator[str]:
    """Every array, and the JSON text."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        yield ", ".join(f"{each.filename}" for each in archive.infolist())
    with np.load(io.BytesIO(data)) as arrays:
        for name in arrays.files:
            array = arrays[name]
            if array.dtype.kind == "U":
                yield f"{name}:"
                yield from _json(json.loads(str(array)))
            else:
                yield f"{name}: {array_text(array)}"


def array_text(array: np.ndarray) -> str:
    """Type, shape and all of a few numbers, of many a summary."""
    if array.size > _FEW:
        return f"{array.dtype} {summary(array)}"
    return f"{array.dtype} {array.shape} {[_number(float(x)) for x in array.ravel()]}"


def _picture(name: str, data: bytes) -> Iterator[str]:
    """Size, channels, all that the header says, and some of the pixels."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"picture{Path(name).suffix}"
        path.write_bytes(data)
        config = OpenImageIO.ImageSpec()
        config.attribute("oiio:UnassociatedAlpha", 1)
        source = OpenImageIO.ImageInput.open(str(path), config)
        assert source is not None, OpenImageIO.geterror()
        spec, pixels = source.spec(), source.read_image("unknown")
        source.close()
    yield (
        f"{spec.width} x {spec.height} {spec.format}, channels {', '.join(spec.channelnames)}, "
        f"alpha {spec.alpha_channel}"
    )
    for each in sorted(spec.extra_attribs, key=lambda each: each.name):
        yield f"{each.name} = {each.value!r}"
    values = pixels.astype(np.float64)
    height, width = values.shape[:2]
    yield f"mean {_row(values.mean(axis=(0, 1)))}"
    places = [
        (height // 3, width // 4),
        (height // 2 - 1, min(width // 2 + 2, width - 1)),
        (height - 2, width // 2),
    ]
    for row, column in (*places, (0, width - 1)):
        yield f"row {row}, column {column}: {_row(values[row, column])}"


def _row(values: Any) -> str:
    return " ".join(f"{each + 0.0:.7g}" for each in values)
