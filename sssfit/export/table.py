"""A profile or a kernel as a table (CSV), every number with all its digits."""

import csv
import io
from collections.abc import Iterator, Sequence
from pathlib import Path

from sssfit.errors import KernelError
from sssfit.export.certificate import certificate
from sssfit.export.document import description
from sssfit.files import has_mark
from sssfit.formats.csv import csv_text, is_profile_csv
from sssfit.kernel import Kernel, SeparableKernel, Taps
from sssfit.messages import printable
from sssfit.profile import Profile

_MARK = "# sssfit.kernel.csv/1"
_OF_DENSE: tuple[str, ...] = ("part", "term", "x_mm")
_OF_TAPS: tuple[str, ...] = ("part", "stage", "level", "kind", "angle_degrees", "offset_mm")
_HOW = (
    "A stage adds fetches at offset_mm, on either side of the middle, by their weights; the result "
    "is blend times the irradiance (stage 0) and times each stage's picture, added."
)
_Row = tuple[object, ...]


def table_text(sources: Sequence[Profile | Kernel]) -> str:
    """Return a table: a profile's annuli, a dense kernel's weights, or a table's taps.

    A dense kernel has a row ``scale``, and for each term a row ``sign`` and its rows ``weight``, by
    the distance from the middle pixel. Taps have rows ``blend``, of the irradiance (stage 0) and of
    each stage from 1, and rows ``weight`` by their offset. `sssfit.formats.csv` describes a
    profile's table, which alone can be read back.

    Raises
    ------
    KernelError
        There are several.
    """
    if len(sources) != 1:
        raise KernelError("a table holds one profile or kernel; write the others one by one.")
    (source,) = sources
    if isinstance(source, Profile):
        return csv_text(source)
    if isinstance(source, Taps):
        heads, rows = _OF_TAPS, _of_taps(source)
        words = [*certificate(source), _HOW]
    else:
        heads, rows, words = _OF_DENSE, _of_dense(source), description(source)
    stream = io.StringIO()
    stream.write("\n".join([_MARK, *(f"# {printable(each)}" for each in words), ""]))
    table = csv.writer(stream, lineterminator="\n")
    table.writerow([*heads, *map(printable, source.channels)])
    table.writerows(rows)
    return stream.getvalue()


def _of_dense(kernel: SeparableKernel) -> Iterator[_Row]:
    yield ("scale", "", "", *kernel.scale.tolist())
    for t in range(kernel.rank):
        yield ("sign", t + 1, "", *kernel.signs[t].tolist())
        for k, row in enumerate(kernel.weights[t].tolist()):
            yield ("weight", t + 1, (k - kernel.half_pixels) * kernel.mm_per_pixel, *row)


def _of_taps(taps: Taps) -> Iterator[_Row]:
    yield ("blend", 0, "", "", "", "", *taps.blend[0].tolist())
    for k, stage in enumerate(taps.stages):
        own = stage.level, stage.kind, stage.angle_degrees
        yield ("blend", k + 1, *own, "", *taps.blend[k + 1].tolist())
        for offset_mm, row in zip(
            (0.0, *stage.offsets_mm.tolist()), stage.weights.tolist(), strict=True
        ):
            yield ("weight", k + 1, *own, offset_mm, *row)


def is_our_table(path: Path) -> bool:
    """Return whether a file is a table that we wrote."""
    return is_profile_csv(path) or has_mark(path, {_MARK.encode(): b""})
