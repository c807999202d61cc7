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
from sssfit.kernel import Kernel, SeparableKernel, Stage, Taps
from sssfit.kernel.structure import turn_on_disk
from sssfit.messages import printable
from sssfit.profile import Profile

_MARK = "# sssfit.kernel.csv/1"
_OF_DENSE: tuple[str, ...] = ("part", "term", "x_mm")
_OF_TAPS: tuple[str, ...] = ("part", "stage", "level", "kind", "angle_degrees", "offset_mm")
_TOWARDS = "from x to the right towards y down"
_EITHER = "the middle, and a bilinear fetch at offset_mm on either side for each further weight"
_HOW = {
    "pair": f"A pair is a pass along x and the same along y: {_EITHER}.",
    "star": "A star is one pass of nine fetches: the middle, four that lie offset_mm away along "
    "both axes, each by the second weight, and four on the axes, each by the third.",
    "disk": "A disk is one pass of single bilinear fetches at offset_mm in the direction "
    f"angle_degrees, {_TOWARDS}, all turned by an angle for each pixel and frame. A middle of "
    "weight 0 is not fetched.",
    "line": f"A line is one pass in the direction angle_degrees, {_TOWARDS}: {_EITHER}.",
}
_Row = tuple[object, ...]


def table_text(sources: Sequence[Profile | Kernel]) -> str:
    """Return a table: a profile's annuli, a dense kernel's weights, or a table's taps.

    A dense kernel has a row ``scale``, and for each term a row ``sign`` and its rows ``weight``, by
    the distance from the middle pixel. Taps have rows ``blend``, of the irradiance (stage 0) and of
    each stage from 1, and rows ``weight`` by their offset, of a disk each with its own angle.
    `sssfit.formats.csv` describes a profile's table, which alone can be read back.

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
        words = [*certificate(source), *_how(source)]
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


def _how(taps: Taps) -> Iterator[str]:
    """Yield what the rows mean, each kind of stage in a line."""
    kinds = {each.kind for each in taps.stages}
    yield from (words for kind, words in _HOW.items() if kind in kinds)
    if any(each.kind == "pair" and each.angle_degrees for each in taps.stages):
        yield f"A pair with angle_degrees runs along it, {_TOWARDS}, and then perpendicular to it."
    if any(each.level for each in taps.stages):
        yield (
            "A stage of level v works on the picture halved v times, each time by the mean of 2 x "
            "2 texels. Levels are added from the coarsest on, each read by one bilinear fetch."
        )
    yield "The result is blend times the irradiance (stage 0) and each stage's picture, added."


def _of_taps(taps: Taps) -> Iterator[_Row]:
    yield ("blend", 0, "", "", "", "", *taps.blend[0].tolist())
    for k, stage in enumerate(taps.stages):
        own = k + 1, stage.level, stage.kind
        angle = "" if stage.kind == "disk" else stage.angle_degrees
        yield ("blend", *own, angle, "", *taps.blend[k + 1].tolist())
        for place, row in zip(_places(stage), stage.weights.tolist(), strict=True):
            yield ("weight", *own, *place, *row)


def _places(stage: Stage) -> Iterator[tuple[float, float]]:
    """Yield the angle [degrees] and the distance [mm] of the fetches, the middle first."""
    yield (stage.angle_degrees, 0.0)
    for k, offset_mm in enumerate(stage.offsets_mm.tolist()):
        angle = 360.0 * turn_on_disk(k) if stage.kind == "disk" else stage.angle_degrees
        yield (angle, offset_mm)


def is_our_table(path: Path) -> bool:
    """Return whether a file is a table that we wrote."""
    return is_profile_csv(path) or has_mark(path, {_MARK.encode(): b""})
